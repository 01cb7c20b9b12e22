"""Files out: mesh formats, conversions, and the one way to write to disk."""

from __future__ import annotations

from cadskin.export.atomic import atomic_file, write_bytes, write_text
from cadskin.export.convert import to_meshio, to_trimesh
from cadskin.export.files import FORMATS, write

__all__ = ["FORMATS", "atomic_file", "to_meshio", "to_trimesh", "write", "write_bytes", "write_text"]
