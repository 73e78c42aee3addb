"""Formulas in scene files: arithmetic over named symbols, and nothing else.

A formula is parsed by Python's `ast` and translated node by node; it is never executed.
"""

from __future__ import annotations

import ast
import math
import warnings
from collections.abc import Callable, Mapping

import casadi as ca
import numpy as np

from hovi.errors import SceneError, nearest

Number = float | str
"""A number, or a formula."""
Symbols = Mapping[str, ca.SX | Mapping[str, ca.SX]]
"""Symbols by name; q["elbow"] is looked up in the mapping `q`."""

MAX_CHARACTERS = 2000
_MAX_DEPTH = 100
_FUNCTIONS: dict[str, Callable[..., ca.SX]] = {
    "sin": ca.sin,
    "cos": ca.cos,
    "tan": ca.tan,
    "asin": ca.asin,
    "acos": ca.acos,
    "atan": ca.atan,
    "atan2": ca.atan2,
    "exp": ca.exp,
    "log": ca.log,
    "sqrt": ca.sqrt,
    "tanh": ca.tanh,
    "abs": ca.fabs,
    "min": ca.fmin,
    "max": ca.fmax,
}
_BINARY = ("atan2", "min", "max")
_OPERATORS: dict[type[ast.operator], Callable[[ca.SX, ca.SX], ca.SX]] = {
    ast.Add: lambda x, y: x + y,
    ast.Sub: lambda x, y: x - y,
    ast.Mult: lambda x, y: x * y,
    ast.Div: lambda x, y: x / y,
    ast.Pow: lambda x, y: x**y,
}


def expression(what: str, given: Number, symbols: Symbols) -> ca.SX:
    """A number or a formula as a CasADi expression.

    what: the effect and its key, the start of messages.
    given: a finite number, or a string of + - * / **, brackets, pi, sin, cos, tan, asin, acos,
        atan, atan2, exp, log, sqrt, tanh, abs, min, max and the symbols.
    Raises SceneError.
    """
    if isinstance(given, str):
        value = _walk(_parsed(what, given), _Reader(what, given, symbols), 0)
    else:
        value = ca.SX(float(given))
    if value.is_constant() and not np.isfinite(float(value)):
        raise SceneError(f"{what} must be a finite number or a formula, got {given!r}.")
    return value


class _Reader:
    """The symbols of a formula, and its error messages."""

    def __init__(self, what: str, text: str, symbols: Symbols) -> None:
        self.what, self.text, self.symbols = what, text, symbols

    def refused(self, reason: str) -> SceneError:
        """The error for an invalid formula."""
        text = self.text if len(self.text) <= 60 else self.text[:57] + "..."
        end = "" if reason.endswith(("?", ".")) else "."
        return SceneError(f"{self.what}: the formula {text!r} {reason}{end}")

    def symbol(self, name: str) -> ca.SX:
        """The symbol of a name without brackets."""
        if name == "pi":
            return ca.SX(math.pi)
        found = self.symbols.get(name)
        if isinstance(found, Mapping):
            raise self.refused(
                f'needs a joint after {name!r}, as in {name}["{next(iter(found), "joint")}"]'
            )
        if found is None:
            names = [*self.symbols, "pi", *_FUNCTIONS]
            raise self.refused(f"names {name!r}, which is unknown: {nearest(name, names)}")
        return found

    def entry(self, name: str, key: object) -> ca.SX:
        """The symbol of a name with a joint in brackets."""
        table = self.symbols.get(name)
        if not isinstance(table, Mapping) or not isinstance(key, str):
            raise self.refused('may use brackets only after q, v and a, as in q["joint"]')
        if key not in table:
            raise self.refused(f"names the joint {key!r}, which is unknown: {nearest(key, table)}")
        return table[key]


def _parsed(what: str, text: str) -> ast.expr:
    if len(text) > MAX_CHARACTERS:
        raise SceneError(
            f"{what}: a formula has at most {MAX_CHARACTERS} characters, not {len(text)}."
        )
    try:
        with (
            warnings.catch_warnings()
        ):  # about invalid escapes in strings, which are refused anyway
            warnings.simplefilter("ignore")
            return ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise _Reader(what, text, {}).refused("is not arithmetic") from None


def _walk(node: ast.expr, reader: _Reader, depth: int) -> ca.SX:
    if depth > _MAX_DEPTH:
        raise reader.refused("is nested too deeply")
    match node:
        case ast.Constant(value=bool()):
            pass
        case ast.Constant(value=int() | float() as value):
            return _constant(value, reader)
        case ast.Name(id=name):
            return reader.symbol(name)
        case ast.Subscript(value=ast.Name(id=name), slice=ast.Constant(value=key)):
            return reader.entry(name, key)
        case ast.UnaryOp(op=ast.USub() | ast.UAdd() as sign, operand=inner):
            operand = _walk(inner, reader, depth + 1)
            return -operand if isinstance(sign, ast.USub) else operand
        case ast.BinOp(left=left, op=operator, right=right) if type(operator) in _OPERATORS:
            sides = (_walk(side, reader, depth + 1) for side in (left, right))
            return _OPERATORS[type(operator)](*sides)
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]):
            return _call(name, arguments, reader, depth)
    raise reader.refused("may contain only numbers, names, + - * / **, brackets and functions")


def _constant(value: float, reader: _Reader) -> ca.SX:
    try:
        return ca.SX(float(value))
    except OverflowError:
        raise reader.refused("contains a number that is too large") from None


def _call(name: str, arguments: list[ast.expr], reader: _Reader, depth: int) -> ca.SX:
    if name not in _FUNCTIONS:
        raise reader.refused(f"calls {name!r}, which is unknown: {nearest(name, _FUNCTIONS)}")
    wanted = 2 if name in _BINARY else 1
    if len(arguments) != wanted:
        raise reader.refused(f"calls {name!r} with {len(arguments)} arguments; it takes {wanted}")
    return _FUNCTIONS[name](*(_walk(each, reader, depth + 1) for each in arguments))
