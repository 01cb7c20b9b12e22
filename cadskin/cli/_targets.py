"""Where results go: names for several parts, and checks that cost nothing before work that costs minutes."""

from __future__ import annotations

import re
import stat
import tempfile
from collections.abc import Sequence
from pathlib import Path

from cadskin.errors import ExportError

__all__ = ["check_target", "is_device", "names_for_parts"]


def check_target(path: Path, *, format: str | None, source: Path) -> str:
    """Return the format of the file to be written, and make sure that it can be written.

    Raises
    ------
    ExportError
        No format is known for it, its folder is missing or not writable, or it is the input itself.
    """
    from cadskin.export import FORMATS

    name = (format or path.suffix.lstrip(".")).lower()
    if name not in FORMATS:
        known = ", ".join(FORMATS)
        raise ExportError(f"{path}: no mesh format by that name; known are {known} (suffix or --format)")
    if path.is_dir():
        raise ExportError(f"{path} is a folder; give the name of a file in it")
    if path.exists() and source.exists() and path.samefile(source):
        raise ExportError(f"{path} is the input; choose another name for the output")
    if not is_device(path):
        _check_folder(path)
    return name


def is_device(path: Path) -> bool:
    """Tell whether the path is a device or a pipe, such as ``/dev/stdout``."""
    return path.exists() and not stat.S_ISREG(path.stat().st_mode) and not path.is_dir()


def _check_folder(path: Path) -> None:
    folder = path.resolve().parent
    if not folder.is_dir():
        raise ExportError(f"{path}: there is no folder {folder}; make it first")
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise ExportError(f"{path}: nothing can be written in {folder}: {error.strerror}") from error


def names_for_parts(path: Path, parts: Sequence[str]) -> list[Path]:
    """Return one file name per part: ``path`` itself for one, with the part's name in it for several.

    Examples
    --------
    >>> [file.name for file in names_for_parts(Path("out.stl"), ["nut", "L-bracket 1", "Nut"])]
    ['out_nut.stl', 'out_L-bracket_1.stl', 'out_Nut-2.stl']
    """
    if len(parts) == 1:
        return [path]
    names: list[Path] = []
    taken: set[str] = set()
    for part in parts:
        word = re.sub(r"[^\w.+-]+", "_", part).strip("_.") or "part"
        unique, count = word, 1
        while unique.lower() in taken:  # some file systems do not tell cases apart
            count += 1
            unique = f"{word}-{count}"
        taken.add(unique.lower())
        names.append(path.with_name(f"{path.stem}_{unique}{path.suffix}"))
    return names
