"""The view provider of datums."""

from __future__ import annotations

from typing import Any

from .view_base import PlainViewProvider

__all__ = ["ViewProviderDatum", "attach_view"]


def attach_view(view_object: Any) -> None:
    """Give the view object of a new datum its view provider."""
    ViewProviderDatum(view_object)


class ViewProviderDatum(PlainViewProvider):
    """A datum in the tree; a double click opens its panel."""

    icon = "datum"
    panel = "datum"
