"""Switches: expressions of hovi's functions that a script replaces, or counts, from outside.

A switch names a function and an expression of it, as Python compares them and not as text, and the
expression that takes its place. Functions are compiled anew with the other expression; whoever
holds them calls the new code. Nothing of this is known to hovi.
"""

from __future__ import annotations
import __future__

import ast
import builtins
import functools
import importlib
import inspect
import textwrap
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import CodeType, FunctionType
from typing import Any

import numpy as np

_SEEN = "__hovi_switch_seen__"
"""Builtin that counts, while functions are watched."""
_FLAGS = __future__.annotations.compiler_flag


@dataclass(frozen=True)
class Edit:
    """An expression of a function, and what takes its place.

    where: "module:qualified.name". on: the expression. off: the other one. times: how often it
        occurs in the function.
    probed: whether `off` is evaluated, too, to see where the two differ; else `on` alone, and every
        evaluation that gives something other than None, False or 0 counts.
    """

    where: str
    on: str
    off: str
    probed: bool = True
    times: int = 1


class SwitchError(Exception):
    """A switch that names something that does not exist, or not as often as it says."""


@functools.cache
def function_of(where: str) -> FunctionType:
    """The function that "module:qualified.name" names, without its decorators."""
    module, _, names = where.partition(":")
    try:
        found: Any = importlib.import_module(module)
        for name in names.split("."):
            found = inspect.getattr_static(found, name)
    except (ImportError, AttributeError) as missing:
        raise SwitchError(f"{where}: {missing}") from None
    while not isinstance(found, FunctionType) or hasattr(found, "__wrapped__"):
        inner = ("__wrapped__", "__func__", "fget", "func")
        more = [getattr(found, name) for name in inner if getattr(found, name, None) is not None]
        if not more:
            raise SwitchError(f"{where} is no function of Python.")
        found = more[0]
    return found


@functools.cache
def _parsed(where: str) -> tuple[CodeType, str]:
    """The code of a function as it was first, and its source."""
    function = function_of(where)
    return function.__code__, textwrap.dedent(inspect.getsource(function))


def _places(tree: ast.AST, edit: Edit) -> list[int]:
    """The identities of the nodes of an edit's expression."""
    wanted = ast.dump(_expression(edit.on))
    found = [id(x) for x in ast.walk(tree) if isinstance(x, ast.expr) and ast.dump(x) == wanted]
    if len(found) != edit.times:
        raise SwitchError(f"{edit.where} has {edit.on!r} {len(found)} times, not {edit.times}.")
    return found


def _expression(text: str) -> ast.expr:
    return ast.parse(text.strip(), mode="eval").body


class _Replaced(ast.NodeTransformer):
    """Replaces nodes by what a table has for their identity, from the inside out."""

    def __init__(self, table: dict[int, Callable[[ast.expr], ast.expr]]) -> None:
        self.table = table

    def visit(self, node: ast.AST) -> Any:
        """The node, or what takes its place."""
        number = id(node)
        self.generic_visit(node)
        return self.table[number](node) if number in self.table else node  # type: ignore[arg-type]


def _code(where: str, off: Iterable[Edit], watched: Iterable[tuple[int, Edit]]) -> CodeType:
    """The code of a function with some expressions replaced, and others watched by number."""
    first, source = _parsed(where)
    tree = ast.parse(source)
    table: dict[int, Callable[[ast.expr], ast.expr]] = {}
    for edit in off:
        table |= dict.fromkeys(_places(tree, edit), functools.partial(_other, edit))
    for number, edit in watched:
        table |= dict.fromkeys(_places(tree, edit), functools.partial(_watched, number, edit))
    changed = _Replaced(table).visit(tree)
    definition = changed.body[0]
    definition.decorator_list = []
    if "__class__" in first.co_freevars:
        changed.body = [ast.ClassDef("_", [], [], [definition], [])]
    ast.fix_missing_locations(changed)
    whole = compile(changed, first.co_filename, "exec", _FLAGS, dont_inherit=True)
    code = next(x for x in _codes(whole) if x.co_name == first.co_name)
    return code.replace(co_firstlineno=first.co_firstlineno, co_qualname=first.co_qualname)


def _other(edit: Edit, _: ast.expr) -> ast.expr:
    """What takes the place of an expression."""
    return _expression(edit.off)


def _watched(number: int, edit: Edit, node: ast.expr) -> ast.expr:
    """A call that counts where an expression differs from the one in its place."""
    call = _expression(f"{_SEEN}({number}, 0, {f'lambda: {edit.off}' if edit.probed else 'None'})")
    assert isinstance(call, ast.Call)
    call.args[1] = node
    return call


def _codes(code: CodeType) -> Iterator[CodeType]:
    for each in code.co_consts:
        if isinstance(each, CodeType):
            yield each
            yield from _codes(each)


@contextmanager
def replaced(off: Iterable[Edit]) -> Iterator[None]:
    """Within it the given expressions are replaced. Raises SwitchError."""
    with _with_code(list(off), []):
        yield


@contextmanager
def watched(edits: Iterable[Edit]) -> Iterator[list[int]]:
    """Within it counts, of each expression, how often the other one would have differed."""
    edits = list(edits)
    counts = [0] * len(edits)

    def seen(number: int, value: Any, other: Callable[[], Any] | None) -> Any:
        counts[number] += bool(value) if other is None else _differ(value, other())
        return value

    setattr(builtins, _SEEN, seen)
    try:
        with _with_code([], list(enumerate(edits))):
            yield counts
    finally:
        delattr(builtins, _SEEN)


@contextmanager
def _with_code(off: list[Edit], seen: list[tuple[int, Edit]]) -> Iterator[None]:
    places = {each.where for each in off} | {each.where for _, each in seen}
    codes = {
        where: _code(
            where,
            [each for each in off if each.where == where],
            [pair for pair in seen if pair[1].where == where],
        )
        for where in sorted(places)
    }
    before = {where: function_of(where).__code__ for where in codes}
    try:
        for where, code in codes.items():
            function_of(where).__code__ = code
        yield
    finally:
        for where, code in before.items():
            function_of(where).__code__ = code


def _differ(one: Any, other: Any) -> bool:
    """Whether two values of an expression differ."""
    if one is other:
        return False
    if isinstance(one, list | tuple) and isinstance(other, list | tuple):
        return len(one) != len(other) or any(map(_differ, one, other))
    return not np.array_equal(one, other) if _are_numbers(one, other) else one != other


def _are_numbers(*values: Any) -> bool:
    return any(isinstance(each, np.ndarray) for each in values)
