"""Text files that are either complete or not there."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from cadskin.errors import ExportError

__all__ = ["write_text_file"]


def write_text_file(path: str | Path, text: str, *, encoding: str = "utf-8") -> Path:
    """Write a text file at once: an error leaves an older file as it was, and no half of a new one.

    Parameters
    ----------
    path : str or Path
    text : str
        Written with its own line ends.
    encoding : str

    Raises
    ------
    ExportError
        Missing folder, no permission, full disk.
    """
    target = Path(os.path.realpath(path))
    data = text.encode(encoding)
    try:
        if target.exists() and not target.is_file():  # a device or a pipe
            target.write_bytes(data)
            return Path(path)
        handle, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.", suffix=".part")
        partial = Path(name)
        try:
            with os.fdopen(handle, "wb") as stream:
                stream.write(data)
            partial.chmod(0o666 & ~_umask())
            partial.replace(target)
        except BaseException:
            partial.unlink(missing_ok=True)
            raise
    except OSError as error:
        raise ExportError(f"cannot write {path}: {error.strerror or error}; choose another folder") from error
    return Path(path)


def _umask() -> int:
    mask = os.umask(0o022)
    os.umask(mask)
    return mask
