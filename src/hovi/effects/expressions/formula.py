"""Formulas in scene files: arithmetic over named symbols, and nothing else.

A formula is parsed by Python's `ast` and translated node by node; it is never executed. Where the
symbols include columns, arithmetic is by entry, and `sum` and `dot` make a number of them.
"""

from __future__ import annotations

import ast
import functools
import math
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence

import casadi as ca
import numpy as np

from hovi.errors import SceneError, nearest

Number = float | str
"""A number, or a formula."""
Symbols = Mapping[str, ca.SX | Mapping[str, ca.SX]]
"""Symbols by name; q["elbow"] is looked up in the mapping `q`, which may be a Table."""


class Table(Mapping[str, ca.SX]):
    """Symbols by a name in brackets, made when a formula uses them.

    names: what the brackets may contain. entry: the symbol of a name, a number or a column.
    whole: what the table stands for without brackets; None if it needs them.
    components: names of the rows of an entry, as in acceleration["hand", "z"]; empty for numbers.
    kind: what a name is, for messages.
    """

    def __init__(
        self,
        names: Sequence[str],
        entry: Callable[[str], ca.SX],
        whole: Callable[[], ca.SX] | None = None,
        components: Sequence[str] = (),
        kind: str = "joint",
    ) -> None:
        self.names, self.entry = names, functools.cache(entry)
        self.whole, self.components, self.kind = whole, components, kind

    def __getitem__(self, name: str) -> ca.SX:
        """The symbol of a name."""
        if name not in self.names:
            raise KeyError(name)
        return self.entry(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)


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
    "sum": ca.sum1,
    "dot": ca.dot,
}
_BINARY = ("atan2", "min", "max", "dot")
_OPERATORS: dict[type[ast.operator], Callable[[ca.SX, ca.SX], ca.SX]] = {
    ast.Add: lambda x, y: x + y,
    ast.Sub: lambda x, y: x - y,
    ast.Mult: lambda x, y: x * y,
    ast.Div: lambda x, y: x / y,
    ast.Pow: lambda x, y: x**y,
}


def expression(what: str, given: Number, symbols: Symbols, columns: bool = False) -> ca.SX:
    """A number or a formula as a CasADi expression.

    what: the effect and its key, the start of messages.
    given: a finite number, or a string of + - * / **, brackets, pi, sin, cos, tan, asin, acos,
        atan, atan2, exp, log, sqrt, tanh, abs, min, max, sum, dot and the symbols.
    columns: whether it may be a column of numbers.
    Raises SceneError.
    """
    if isinstance(given, str):
        value = _walk(_parsed(what, given), _Reader(what, given, symbols), 0)
    else:
        value = ca.SX(float(given))
    if not (columns or value.is_scalar()):
        raise _Reader(what, str(given), symbols).refused(
            f"is a column of {value.numel()} numbers where one is needed: take sum(...) of it"
        )
    if value.is_constant() and not np.isfinite(ca.DM(value).full()).all():
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
        if isinstance(found, Table) and found.whole is not None:
            return found.whole()
        if isinstance(found, Mapping):
            kind = found.kind if isinstance(found, Table) else "joint"
            raise self.refused(
                f'needs a {kind} after {name!r}, as in {name}["{next(iter(found), kind)}"]'
            )
        if found is None:
            names = [*self.symbols, "pi", *_FUNCTIONS]
            raise self.refused(f"names {name!r}, which is unknown: {nearest(name, names)}")
        return found

    def entry(self, name: str, key: object) -> ca.SX:
        """The symbol of a name with a joint in brackets."""
        table = self.symbols.get(name)
        if not isinstance(table, Mapping) or not isinstance(key, str):
            known = [name for name, each in self.symbols.items() if isinstance(each, Mapping)]
            names = f"{', '.join(known[:-1])} and {known[-1]}" if known else "q, v and a"
            raise self.refused(f'may use brackets only after {names}, as in q["joint"]')
        if key not in table:
            kind = table.kind if isinstance(table, Table) else "joint"
            raise self.refused(f"names the {kind} {key!r}, which is unknown: {nearest(key, table)}")
        return table[key]

    def component(self, name: str, key: object, component: object) -> ca.SX:
        """One row of the symbol of a name with two names in brackets."""
        column, table = self.entry(name, key), self.symbols[name]
        rows = table.components if isinstance(table, Table) else ()
        if type(component) is int and 0 <= component < len(rows):
            return column[component]
        if component not in rows:
            hint = nearest(str(component), rows) if rows else "give one name in brackets"
            raise self.refused(f"names the component {component!r} of {name!r}: {hint}")
        return column[list(rows).index(str(component))]

    def applied(self, function: Callable[..., ca.SX], *arguments: ca.SX) -> ca.SX:
        """The value of a function, by entry if there are columns."""
        sizes = {each.numel() for each in arguments if not each.is_scalar()}
        if len(sizes) > 1:
            raise self.refused(
                f"combines columns of {' and '.join(map(str, sorted(sizes)))} numbers"
            )
        if function is ca.dot and len(sizes) == 1:
            rows = sizes.pop()
            arguments = tuple(ca.repmat(x, rows) if x.is_scalar() else x for x in arguments)
        return function(*arguments)


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
        case ast.Subscript(
            value=ast.Name(id=name),
            slice=ast.Tuple(elts=[ast.Constant(value=key), ast.Constant(value=component)]),
        ):
            return reader.component(name, key, component)
        case ast.Subscript(
            value=ast.Subscript(value=ast.Name(id=name), slice=ast.Constant(value=key)),
            slice=ast.Constant(value=component),
        ):
            return reader.component(name, key, component)
        case ast.UnaryOp(op=ast.USub() | ast.UAdd() as sign, operand=inner):
            operand = _walk(inner, reader, depth + 1)
            return -operand if isinstance(sign, ast.USub) else operand
        case ast.BinOp(left=left, op=operator, right=right) if type(operator) in _OPERATORS:
            sides = (_walk(side, reader, depth + 1) for side in (left, right))
            return reader.applied(_OPERATORS[type(operator)], *sides)
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
    return reader.applied(_FUNCTIONS[name], *(_walk(each, reader, depth + 1) for each in arguments))
