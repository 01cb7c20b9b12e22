"""What the view providers of tolerances and datums share."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from pivy import coin

from .faces import InputError
from .icons import icon_path

__all__ = ["PlainViewProvider", "open_or_tell"]


_MODE = "Default"


def open_or_tell(panel: str, obj: Any) -> bool:
    """Open a panel after a double click, or say why it cannot be opened."""
    from .command import tell

    try:
        import_module(f".panels.{panel}", __package__).show(obj)
    except InputError as error:
        tell(str(error))
    return True


class PlainViewProvider:
    """An object of the tree that has an icon and a panel and draws nothing itself."""

    icon = ""
    panel = ""

    def __init__(self, view_object: Any) -> None:
        view_object.Proxy = self

    def attach(self, view_object: Any) -> None:
        """Remember the object; FreeCAD calls it when the object appears, new or from a file."""
        self._object = view_object.Object
        view_object.addDisplayMode(coin.SoGroup(), _MODE)  # without a mode the tree shows it as hidden

    def getDisplayModes(self, _obj: Any) -> list[str]:
        """Return the mode that draws nothing."""
        return [_MODE]

    def getDefaultDisplayMode(self) -> str:
        """Return the mode that draws nothing."""
        return _MODE

    def getIcon(self) -> str:
        """Return the icon, with a mark where the object cannot be used."""
        status = getattr(getattr(self, "_object", None), "Status", "OK") or "OK"
        return icon_path(self.icon if status == "OK" else f"{self.icon}_bad")

    def updateData(self, obj: Any, name: str) -> None:
        """Show another icon when the status changes."""
        if name == "Status" and obj.ViewObject is not None:
            obj.ViewObject.signalChangeIcon()

    def doubleClicked(self, view_object: Any) -> bool:
        """Open the panel."""
        return open_or_tell(self.panel, view_object.Object)

    def dumps(self) -> None:
        """Nothing is stored."""

    def loads(self, _state: Any) -> None:
        """Nothing was stored."""

    __getstate__ = dumps  # FreeCAD 0.20
    __setstate__ = loads
