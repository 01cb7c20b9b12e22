"""The view provider of tolerances, the general one too."""

from __future__ import annotations

from typing import Any

from .view_base import PlainViewProvider

__all__ = ["ViewProviderTolerance", "attach_view"]


class ViewProviderTolerance(PlainViewProvider):
    """A tolerance in the tree; a double click opens its panel."""

    icon = "tolerance"
    panel = "tolerance"

    def doubleClicked(self, view_object: Any) -> bool:
        """Open the panel; the general tolerance is edited by its command."""
        if hasattr(view_object.Object, "Faces"):
            return super().doubleClicked(view_object)
        from .commands.general_tolerance import GeneralTolerance

        GeneralTolerance().Activated()
        return True


attach_view = ViewProviderTolerance  #: gives the view object of a new tolerance its view provider
