"""Pictures of parts and deviations, off screen."""

from __future__ import annotations

from cadskin.view.pictures import picture
from cadskin.view.pyvista_engine import to_pyvista
from cadskin.view.sheets import sheet

__all__ = ["picture", "sheet", "to_pyvista"]
