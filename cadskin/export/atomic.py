"""Files that are either complete or not there: the one home for writing to disk."""

from __future__ import annotations

import errno
import os
import secrets
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from cadskin.errors import ExportError

__all__ = ["atomic_file", "write_bytes", "write_text"]

_DISK_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
_NOT_ALLOWED = {errno.EACCES, errno.EPERM, errno.EROFS}


@contextmanager
def atomic_file(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Open ``path`` for writing bytes; the file appears complete, or not at all.

    The bytes go to a temporary file in the same folder, which is flushed to the disk and then takes the
    place of ``path`` in one step. An error or Ctrl-C removes the temporary file and leaves an older file as
    it was. A symbolic link is followed. A device or a pipe (``/dev/stdout``) is written to directly.

    Parameters
    ----------
    path : str or path

    Yields
    ------
    binary stream
        May be a pipe: write in order, do not seek.

    Raises
    ------
    ExportError
        Missing folder, no permission, full disk, broken pipe; the message names the path and the way out.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with atomic_file(pathlib.Path(folder, "a.txt")) as stream:
    ...         _ = stream.write(b"whole")
    ...     pathlib.Path(folder, "a.txt").read_bytes()
    b'whole'
    """
    target = Path(os.path.realpath(path))
    try:
        if _is_special(target):
            with open(target, "wb") as stream:
                yield stream
        else:
            with _replacing(target) as stream:
                yield stream
    except ExportError:
        raise
    except OSError as error:
        raise ExportError(_explain(Path(path), error)) from error


def write_bytes(path: str | os.PathLike[str], data: bytes) -> Path:
    """Write ``data`` to ``path`` in one step (see `atomic_file`) and return the path."""
    with atomic_file(path) as stream:
        stream.write(data)
    return Path(path)


def write_text(path: str | os.PathLike[str], text: str) -> Path:
    """Write ``text`` as UTF-8 with line feeds in one step (see `atomic_file`) and return the path."""
    return write_bytes(path, text.encode())


def _is_special(target: Path) -> bool:
    try:
        mode = target.stat().st_mode
    except FileNotFoundError:
        return False
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(target))
    return not stat.S_ISREG(mode)


@contextmanager
def _replacing(target: Path) -> Iterator[BinaryIO]:
    """Write to a new file beside ``target`` and rename it on success."""
    if target.exists() and not os.access(target, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(target))
    temporary = target.parent / f".cadskin-{secrets.token_hex(8)}.tmp"
    # 0o666 lets the process's umask decide, as it does for any new file.
    descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666)
    try:
        with open(descriptor, "wb") as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        if target.exists():
            os.chmod(temporary, stat.S_IMODE(target.stat().st_mode))
        os.replace(temporary, target)
    except BaseException:
        with suppress(FileNotFoundError):
            temporary.unlink()
        raise
    _sync_folder(target.parent)


def _sync_folder(folder: Path) -> None:
    """Make the rename itself durable, where the system can do that."""
    if not hasattr(os, "O_DIRECTORY"):
        return
    with suppress(OSError):  # the data is on the disk already; some file systems cannot sync a folder
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _explain(path: Path, error: OSError) -> str:
    """Return one line: which file, what is wrong, what to do."""
    folder = path.absolute().parent
    if error.errno == errno.ENOENT and not folder.exists():
        return f"cannot write {path}: the folder {folder} does not exist; make it first, or name another one"
    if error.errno in _DISK_FULL:
        return (
            f"cannot write {path}: the disk is full ({error.strerror}); "
            "free some space or write to another disk (nothing was left behind)"
        )
    if error.errno in _NOT_ALLOWED:
        return (
            f"cannot write {path}: not allowed ({error.strerror}); "
            f"change the permissions of {folder} or write to a folder of your own"
        )
    if error.errno == errno.EISDIR:
        return f"cannot write {path}: it is a folder; name a file in it"
    if error.errno == errno.EPIPE:
        return f"cannot write {path}: the reader closed the pipe"
    reason = error.strerror or str(error) or type(error).__name__
    return f"cannot write {path}: {reason}; check the path or write to another place"
