"""What the proxies of all document objects share: properties, state, migration."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import FreeCAD

__all__ = [
    "EXTRA",
    "SIGNATURE",
    "STATUS",
    "Field",
    "Proxy",
    "add_fields",
    "attach_view",
    "extra_of",
    "is_a",
    "new_object",
    "objects_of",
    "set_status",
    "transaction",
    "with_extra",
]

READ_ONLY, HIDDEN = 1, 2


class Field(NamedTuple):
    """A property of a document object.

    Parameters
    ----------
    kind : str
        ``App::PropertyLength``, ...
    name : str
    text : str
        Shown in the property editor.
    value : object
        At the beginning; None leaves FreeCAD's own.
    mode : int
        Of the editor: ``READ_ONLY``, ``HIDDEN``.
    """

    kind: str
    name: str
    text: str
    value: Any = None
    mode: int = 0


#: What objects of a specification share.
EXTRA = Field("App::PropertyString", "Extra", "Further properties, as in a spec file (JSON)", "{}", HIDDEN)
SIGNATURE = Field("App::PropertyStringList", "Signature", "What the faces looked like", None, HIDDEN)
STATUS = Field("App::PropertyString", "Status", "Whether it can be used", None, READ_ONLY)


def extra_of(obj: Any) -> dict[str, Any]:
    """Return the further properties of an object, as in a spec file.

    Raises
    ------
    ValueError
        They are no JSON table.
    """
    values = json.loads(obj.Extra or "{}")
    if not isinstance(values, dict):
        raise ValueError("Extra must be a JSON table")
    return values


def with_extra(table: dict[str, Any], obj: Any) -> dict[str, Any]:
    """Return a table for the worker with the further properties of an object, where it has any."""
    extra = extra_of(obj)
    return {**table, "extra": extra} if extra else table


def add_fields(obj: Any, group: str, fields: Iterable[Field]) -> None:
    """Add the properties that an object does not have yet: to a new one, or to one of an older version."""
    for item in fields:
        if item.name not in obj.PropertiesList:
            obj.addProperty(item.kind, item.name, group, item.text)
            if item.value is not None:
                setattr(obj, item.name, item.value)
        obj.setEditorMode(item.name, _editor_modes(item.mode))


def _editor_modes(mode: int) -> list[str]:
    return {0: [], 1: ["ReadOnly"], 2: ["Hidden"]}.get(mode, ["Hidden"])


def set_status(obj: Any, text: str) -> None:
    """Set ``Status`` where it changes: an equal value would still touch the object."""
    if obj.Status != text:
        obj.Status = text


def is_a(obj: Any, kind: str) -> bool:
    """Tell whether a document object is one of ours of this kind (``CadSkinTolerance``)."""
    return getattr(getattr(obj, "Proxy", None), "Type", None) == kind


def objects_of(document: Any, *kinds: str) -> list[Any]:
    """Return our objects of these kinds in a document, in the order of their making."""
    return [obj for obj in document.Objects if any(is_a(obj, kind) for kind in kinds)]


@contextmanager
def new_object(document: Any, proxy: type[Proxy], name: str) -> Iterator[Any]:
    """Yield a new object with a proxy; where what follows fails, the document is left as it was."""
    obj = document.addObject("App::FeaturePython", name)
    try:
        proxy(obj)
        yield obj
    except BaseException:
        document.removeObject(obj.Name)
        raise


def attach_view(obj: Any, module: str) -> None:
    """Give an object its view provider, where there is a window."""
    if not FreeCAD.GuiUp:
        return
    from importlib import import_module

    import_module(f".{module}", __package__).attach_view(obj.ViewObject)


class Proxy:
    """Base of the proxies: they hold no data of their own, everything is in properties."""

    Type = ""
    GROUP = "CadSkin"
    FIELDS: tuple[Field, ...] = ()
    VERSION = 1

    def __init__(self, obj: Any) -> None:
        obj.Proxy = self
        self.migrate(obj)

    def migrate(self, obj: Any) -> None:
        """Add what a document of an older version does not have."""
        add_fields(obj, self.GROUP, self.FIELDS)
        if "SchemaVersion" not in obj.PropertiesList:
            obj.addProperty(
                "App::PropertyInteger", "SchemaVersion", self.GROUP, "Version of these properties"
            )
            obj.setEditorMode("SchemaVersion", ["Hidden"])
        if obj.SchemaVersion > self.VERSION:
            FreeCAD.Console.PrintWarning(
                f"CadSkin: {obj.Label} was saved by a later version of the workbench ({obj.SchemaVersion} > "
                f"{self.VERSION}); update the workbench\n"
            )
        else:
            obj.SchemaVersion = self.VERSION

    def problem(self, obj: Any) -> str | None:
        """Say why an object cannot be used; None where it can."""
        raise NotImplementedError

    def execute(self, obj: Any) -> None:
        """Check the object; nothing is computed here."""
        set_status(obj, self.problem(obj) or "OK")

    def onDocumentRestored(self, obj: Any) -> None:
        """Bring an object of an older version up to date."""
        obj.Proxy = self
        self.migrate(obj)

    def dumps(self) -> None:
        """Return nothing: the class has no state."""

    def loads(self, _state: Any) -> None:
        """Take nothing."""

    # FreeCAD before 0.21 asks by these names.
    def __getstate__(self) -> None:
        return None

    def __setstate__(self, _state: Any) -> None:
        return None


@contextmanager
def transaction(document: Any, text: str) -> Iterator[None]:
    """Do something in a transaction: all of it or nothing; within one that is open it is a part of that."""
    within = document.HasPendingTransaction
    if not within:
        document.openTransaction(text)
    try:
        yield
        document.recompute()
    except BaseException:
        if not within:
            document.abortTransaction()
        raise
    if not within:
        document.commitTransaction()
