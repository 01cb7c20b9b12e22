"""The view provider of imported dimensions."""

from __future__ import annotations

from typing import Any

from .view_base import PlainViewProvider

__all__ = ["ViewProviderDimension", "attach_view"]


class ViewProviderDimension(PlainViewProvider):
    """A dimension in the tree; it has no panel."""

    icon = "dimension"

    def doubleClicked(self, _view_object: Any) -> bool:
        """Leave it: an imported dimension is not edited."""
        return False


attach_view = ViewProviderDimension  #: gives the view object of a new dimension its view provider
