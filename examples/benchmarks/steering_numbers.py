"""The numbers that steer the code that solves: where each is, and what it means.

A number is a literal of the packages of solving_statements.py, with these exceptions: 0, and -1, 1,
2 and 1/2 where they have no name, subscripts, exponents that are integers, axes, and what functions
of shapes and of evenly spaced points are called with. Constants have a row each, with the string
that follows them; the numbers inside a function have one row, with what the function does and their
lines.

    python steering_numbers.py            # prints the table
    python steering_numbers.py --write    # writes it to docs/tables/numbers.md
"""

from __future__ import annotations

import argparse
import ast
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from solving_statements import PACKAGES

TOP = Path(__file__).resolve().parents[2]
TABLE = TOP / "docs" / "tables" / "numbers.md"
PLAIN = {-1, 0, 1, 2, 0.5}
"""Values that steer nothing, unless they have a name."""
SHAPED = {"zeros", "ones", "empty", "full", "eye", "reshape", "range", "arange", "linspace"}
"""Functions whose arguments are lengths of arrays and numbers of points."""
AXES = {"axis", "axes", "ndim"}
"""Keywords whose values are axes of arrays."""
MOVING_AXES = {"transpose", "moveaxis", "swapaxes"}
"""Functions whose arguments are axes of arrays."""
TINY = 1e-300
"""Stands for zero in a denominator."""
COLUMNS = "| place | numbers | meaning |\n|---|---|---|"

Function = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True)
class Row:
    """A constant or a function with numbers.

    file: below src/hovi, without ".py". name: of the constant, or of the function with its classes.
    count: of numbers. written: as in the source. meaning: in Markdown.
    """

    file: str
    name: str
    count: int
    written: str
    meaning: str

    def __str__(self) -> str:
        """As a line of the table."""
        return f"| `{self.file}: {self.name}` | {code(self.written)} | {self.meaning} |"


def all_rows() -> list[Row]:
    """The rows of the packages that solve, by file and line."""
    source = TOP / "src" / "hovi"
    files = sorted(file for name in PACKAGES for file in (source / name).rglob("*.py"))
    return [row for file in files for row in rows_of(_name(file, source), file.read_text())]


def _name(file: Path, source: Path) -> str:
    return file.relative_to(source).with_suffix("").as_posix()


def rows_of(file: str, source: str) -> list[Row]:
    """The rows of a source, by line."""
    return Rows(file, source).rows()


def table(rows: Sequence[Row]) -> str:
    """The table in Markdown, a part for each package."""
    count = sum(row.count for row in rows)
    parts = [f"{count:,} numbers in {len(rows):,} constants and functions."]
    packages = dict.fromkeys(_package(row) for row in rows)
    for package in sorted(packages):
        lines = [str(row) for row in rows if _package(row) == package]
        parts.append("\n".join([f"**{package}**\n", COLUMNS, *lines]))
    return "\n\n".join(parts) + "\n"


def _package(row: Row) -> str:
    """The folder of a file, and the one inside it."""
    return "/".join(row.file.split("/")[:-1][:2])


class Rows:
    """The numbers of a source, by the constants and functions that they stand in."""

    def __init__(self, file: str, source: str) -> None:
        self.file, self.lines = file, source.encode().split(b"\n")
        self.parents = dict[ast.AST, ast.AST]()
        left: list[ast.AST] = [ast.parse(source)]
        while left:
            node = left.pop()
            inside = list(ast.iter_child_nodes(node))
            self.parents.update(dict.fromkeys(inside, node))
            left += inside

    def rows(self) -> list[Row]:
        """By line."""
        places = dict[ast.AST, list[ast.Constant]]()
        for number in sorted(self._numbers(), key=lambda n: (n.lineno, n.col_offset)):
            places.setdefault(self._place(number), []).append(number)
        return [self._row(*each) for each in places.items()]

    def _row(self, place: ast.AST, numbers: Sequence[ast.Constant]) -> Row:
        written, says = self._written(place, numbers), self._says(place, numbers)
        return Row(self.file, self._named(place), len(numbers), written, says)

    def _numbers(self) -> Iterator[ast.Constant]:
        for node in self.parents:
            if isinstance(node, ast.Constant) and self._steers(node):
                above = [node, *self._above(node)]
                if not any(is_left_out(*pair) for pair in pairwise(above)):
                    yield node

    def _steers(self, node: ast.Constant) -> bool:
        """Whether a literal is a number that is not plain, or that of a named constant; not 0."""
        if not isinstance(node.value, int | float) or isinstance(node.value, bool):
            return False
        if node.value not in PLAIN or node.value == 0:
            return node.value != 0
        place = self._place(node)
        names = [] if isinstance(place, Function) else targets(place)
        return bool(names) and all(name.isupper() for name in names)

    def _above(self, node: ast.AST) -> Iterator[ast.AST]:
        """What a node is in, from the inside out."""
        while node in self.parents:
            node = self.parents[node]
            yield node

    def _place(self, number: ast.Constant) -> ast.AST:
        """The innermost function of a number, or its statement outside of functions."""
        above = list(self._above(number))
        function = next((node for node in above if isinstance(node, Function)), None)
        return function or next(node for node in above if isinstance(node, ast.stmt))

    def _named(self, place: ast.AST) -> str:
        """The name of a function or of a constant, after those of what it is in."""
        scopes = [node for node in self._above(place) if isinstance(node, Function | ast.ClassDef)]
        own = place.name if isinstance(place, Function) else ", ".join(targets(place))
        return ".".join([*(scope.name for scope in reversed(scopes)), own])

    def _written(self, place: ast.AST, numbers: Sequence[ast.Constant]) -> str:
        """The value of a constant if it is in one line, else the numbers with their signs."""
        value = getattr(place, "value", None)
        if isinstance(value, ast.expr) and value.lineno == value.end_lineno:
            return self._text(value)
        return ", ".join(map(self._signed, numbers))

    def _signed(self, number: ast.Constant) -> str:
        sign = "-" * isinstance(getattr(self.parents[number], "op", None), ast.USub)
        return sign + self._text(number)

    def _text(self, value: ast.expr) -> str:
        """An expression in one line as it is in the source."""
        return self.lines[value.lineno - 1][value.col_offset : value.end_col_offset].decode()

    def _says(self, place: ast.AST, numbers: Sequence[ast.Constant]) -> str:
        """The meaning of the numbers of a place."""
        if isinstance(place, Function):
            kinds = ", ".join(dict.fromkeys(self._kind(each) for each in numbers))
            return f"{kinds}: {' '.join([*self._summary(place), self._code(numbers)])}"
        said = self._string_after(place) or self._field(place)
        return escaped(said) if said else self._code(numbers)

    def _kind(self, number: ast.Constant) -> str:
        """What the number of a function is for, as far as its place shows that."""
        above = list(self._above(number))
        names = {node.arg for node in above if isinstance(node, ast.keyword)}
        called = {called_name(node) for node in above if isinstance(node, ast.Call)}
        if number.value == TINY:
            return "no division by zero"
        if "maxsize" in names:
            return "size of a cache"
        if MOVING_AXES & called:
            return "axes of an array"
        if any(isinstance(node, ast.FormattedValue) for node in above):
            return "text of a message"
        parent = self.parents[number]
        place = isinstance(parent, ast.Tuple) and isinstance(number.value, int)
        return "place or length in arrays" if place or compares_length(parent) else "inside"

    def _summary(self, function: ast.AST) -> Iterator[str]:
        """The first paragraph of what documents a function, or else what it is in."""
        for node in (function, *self._above(function)):
            said = ast.get_docstring(node) if isinstance(node, Function | ast.ClassDef) else None
            if said:
                yield escaped(said.split("\n\n")[0])
                return

    def _code(self, numbers: Sequence[ast.Constant]) -> str:
        """The lines of numbers."""
        lines = dict.fromkeys(self.lines[each.lineno - 1].strip().decode() for each in numbers)
        return ", ".join(code(line) for line in lines)

    def _string_after(self, statement: ast.AST) -> str:
        """The string that follows a statement."""
        body = getattr(self.parents[statement], "body", [])
        after = body[body.index(statement) + 1 :][:1] if statement in body else []
        match after:
            case [ast.Expr(value=ast.Constant(value=str(said)))]:
                return said
        return ""

    def _field(self, statement: ast.AST) -> str:
        """What the docstring of a class says of a field, as "name: ..."."""
        scope = self.parents[statement]
        if not isinstance(scope, ast.ClassDef):
            return ""
        said = " ".join((ast.get_docstring(scope) or "").split())
        fields = "|".join(field for each in scope.body for field in targets(each))
        name = "|".join(targets(statement))
        found = re.search(rf"(?:^|[ .])(?:{name}): (.*?)(?= (?:{fields})(?:, \w+)*: |$)", said)
        return found[1] if found else ""


def is_left_out(node: ast.AST, parent: ast.AST) -> bool:
    """Whether numbers in a node steer nothing, as its parent is what it is."""
    if isinstance(parent, ast.Subscript):
        return node is parent.slice
    if isinstance(parent, ast.BinOp) and isinstance(parent.op, ast.Pow):
        number = isinstance(node, ast.Constant) and isinstance(node.value, float)
        return node is parent.right and not number
    if isinstance(parent, ast.Call):
        axes = isinstance(node, ast.keyword) and node.arg in AXES
        return axes or (node is not parent.func and called_name(parent) in SHAPED)
    return False


def called_name(call: ast.Call) -> str:
    """The name of a function or method that is called."""
    return str(getattr(call.func, "attr", getattr(call.func, "id", "")))


def compares_length(node: ast.AST) -> bool:
    """Whether a node is a comparison with the length or the shape of something."""
    sides = [node.left, *node.comparators] if isinstance(node, ast.Compare) else []
    inside = [each for side in sides for each in ast.walk(side)]
    names = {getattr(each, "id", getattr(each, "attr", "")) for each in inside}
    return bool(names & {"len", "shape"})


def targets(statement: ast.AST) -> list[str]:
    """The names that a statement assigns to."""
    assigned = getattr(statement, "targets", [getattr(statement, "target", None)])
    nodes = [node for each in assigned if each is not None for node in ast.walk(each)]
    return [node.id for node in nodes if isinstance(node, ast.Name)]


def code(text: str) -> str:
    """Code in a cell of a table."""
    marks = "``" if "`" in text else "`"
    return marks + text.replace("|", r"\|") + marks


def escaped(text: str) -> str:
    """A documenting string in a cell of a table: in one line, with its code as it is."""
    parts = re.split("(`[^`]+`)", " ".join(text.split()))
    return "".join(
        code(part.strip("`")) if k % 2 else re.sub(r"([|*$<\\])", r"\\\1", part)
        for k, part in enumerate(parts)
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help=f"into {TABLE.relative_to(TOP)}")
    text = table(all_rows())
    if parser.parse_args().write:
        TABLE.write_text(text)
    else:
        print(text, end="")


if __name__ == "__main__":
    main()
