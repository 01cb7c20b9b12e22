"""Files out: mesh formats, conversions, run folders, and the one way to write to disk."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cadskin.export.atomic import atomic_file, write_bytes, write_text
from cadskin.export.convert import to_meshio, to_trimesh
from cadskin.export.files import FORMATS, write

if TYPE_CHECKING:
    from cadskin.export.runs import Run as Run
    from cadskin.export.runs import open_run as open_run
    from cadskin.export.runs import simulate_run as simulate_run

__all__ = [
    "FORMATS",
    "Run",
    "atomic_file",
    "open_run",
    "simulate_run",
    "to_meshio",
    "to_trimesh",
    "write",
    "write_bytes",
    "write_text",
]


def __getattr__(name: str) -> Any:
    if name in ("Run", "open_run", "simulate_run"):  # the samplers behind them are heavy
        from cadskin.export import runs

        return getattr(runs, name)
    raise AttributeError(f"module 'cadskin.export' has no attribute {name!r}")
