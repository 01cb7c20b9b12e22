"""Models from their text form, ``GaussianField(sigma=0.01 mm, length=12 mm) + Shift(...).on('>Z')``."""

from __future__ import annotations

import ast
import re
from typing import Any

from cadskin.deviation.base import DeviationModel
from cadskin.deviation.registry import model_class, model_names
from cadskin.errors import DeviationError

__all__ = ["from_text"]

# Quoted text stays as it is; units after values go.
_UNIT = re.compile(r"""('(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*")|\s(?:mm³|1/mm|K/mm|1/K|mm|rad|K)(?=[\s,)]|$)""")
_NUMBERS = {"inf": float("inf"), "nan": float("nan")}


def from_text(text: str) -> DeviationModel:
    """Return the model whose text form, ``str(model)``, is given.

    The text has twelve digits of each number; a specification file has all of them.

    Parameters
    ----------
    text : str
        Calls of model classes with literal arguments, joined by ``+``, ``-``, ``*`` and ``.on(...)``. Nothing
        else is evaluated.

    Raises
    ------
    DeviationError
        Not such a text; an unknown class; long arrays, which the text form leaves out (it says only
        ``<20 values, 0.1..0.3, mean 0.2>``).

    Examples
    --------
    >>> from_text("GaussianField(sigma=0.01 mm, length=12 mm) + 2 * Lobing(amplitude=0.1 mm).on('>Z')")
    GaussianField(sigma=0.01 mm, length=12 mm) + 2 * Lobing(amplitude=0.1 mm).on('>Z')
    """
    bare = _UNIT.sub(lambda found: found[1] or "", text)
    if re.search(r"<\d[^>]*>", bare):
        raise DeviationError(
            f"the text form leaves out long arrays, so it cannot be read: {text}; use to_dict"
        )
    try:
        tree = ast.parse(bare.strip(), mode="eval")
    except SyntaxError as error:
        raise DeviationError(f"{text!r} is not the text form of a deviation model: {error.msg}") from error
    found = _value(tree.body, text)
    if not isinstance(found, DeviationModel):
        raise DeviationError(f"{text!r} is not the text form of a deviation model but {found!r}")
    return found


def _value(node: ast.expr, text: str) -> Any:
    match node:
        case ast.Constant():
            return node.value
        case ast.Name(id=name) if name in _NUMBERS:
            return _NUMBERS[name]
        case ast.Tuple() | ast.List():
            return tuple(_value(item, text) for item in node.elts)
        case ast.Dict():
            pairs = zip(node.keys, node.values, strict=True)
            return {_value(key, text): _value(value, text) for key, value in pairs if key is not None}
        case ast.UnaryOp(op=ast.USub()):
            return -_value(node.operand, text)
        case ast.BinOp():
            return _operation(node, text)
        case ast.Call():
            return _call(node, text)
    raise DeviationError(f"{ast.unparse(node)!r} has no place in the text form of a deviation model: {text}")


def _operation(node: ast.BinOp, text: str) -> Any:
    left, right = _value(node.left, text), _value(node.right, text)
    match node.op:
        case ast.Add():
            return left + right
        case ast.Sub():
            return left - right
        case ast.Mult():
            return left * right
    raise DeviationError(f"models are joined by +, - and *, not as in {ast.unparse(node)!r}")


def _call(node: ast.Call, text: str) -> Any:
    arguments = [_value(item, text) for item in node.args]
    named = {item.arg: _value(item.value, text) for item in node.keywords if item.arg}
    match node.func:
        case ast.Attribute(attr="on"):
            return _value(node.func.value, text).on(*arguments, **named)
        case ast.Name(id="array"):
            return arguments[0]
        case ast.Name(id=name):
            return _class_called(name)(*arguments, **named)
    raise DeviationError(f"{ast.unparse(node.func)!r} is not a deviation model, in: {text}")


def _class_called(name: str) -> type[DeviationModel]:
    found = {model_class(key).__name__: model_class(key) for key in model_names()}
    if name not in found:
        raise DeviationError(f"no deviation model is called {name}; there are {', '.join(sorted(found))}")
    return found[name]
