"""Where the icons are. Plain SVG files, drawn for this project."""

from __future__ import annotations

from pathlib import Path

__all__ = ["ICON_FOLDER", "icon_path"]

ICON_FOLDER = Path(__file__).resolve().parent / "resources" / "icons"


def icon_path(name: str) -> str:
    """Return the file of an icon."""
    return str(ICON_FOLDER / f"{name}.svg")
