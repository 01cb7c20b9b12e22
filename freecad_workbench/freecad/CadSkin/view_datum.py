"""The view provider of datums."""

from __future__ import annotations

from .view_base import PlainViewProvider

__all__ = ["ViewProviderDatum", "attach_view"]


class ViewProviderDatum(PlainViewProvider):
    """A datum in the tree; a double click opens its panel."""

    icon = "datum"
    panel = "datum"


attach_view = ViewProviderDatum  #: gives the view object of a new datum its view provider
