"""Pictures of parts and deviations, off screen."""

from __future__ import annotations

from cadskin.view.picture import picture
from cadskin.view.pyvista_engine import to_pyvista

__all__ = ["picture", "to_pyvista"]
