"""Small faults in Python source: one changed operator, number, condition or statement at a time.

Each is one that a person could make and that Python still runs: `<` for `<=`, `-` for `+`, a
dropped `not`, a number off by one, a condition turned round, a statement left out. Replacements
that fail on every execution, such as `+` by `<<`, are left out, since any test at all notices them,
and so are changes of annotations, docstrings and the texts of messages. Numbers of constants of a
module, which somebody chose, change by a factor of ten: with less they are another choice and no
fault.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass

COMPARISONS = {
    ast.Lt: ("<=", ">="),
    ast.LtE: ("<", ">"),
    ast.Gt: (">=", "<="),
    ast.GtE: (">", "<"),
    ast.Eq: ("!=",),
    ast.NotEq: ("==",),
    ast.Is: ("is not",),
    ast.IsNot: ("is",),
    ast.In: ("not in",),
    ast.NotIn: ("in",),
}
ARITHMETIC = {
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "/"),
    ast.Div: ("/", "*"),
    ast.FloorDiv: ("//", "*"),
    ast.Mod: ("%", "//"),
    ast.Pow: ("**", "*"),
    ast.BitAnd: ("&", "|"),
    ast.BitOr: ("|", "&"),
}
TWINS = {
    one: other
    for pair in (
        ("min", "max"),
        ("any", "all"),
        ("minimum", "maximum"),
        ("argmin", "argmax"),
        ("sin", "cos"),
        ("zeros", "ones"),
        ("zeros_like", "ones_like"),
        ("floor", "ceil"),
        ("append", "extend"),
    )
    for one, other in (pair, pair[::-1])
}
"""Functions that are taken for each other."""


@dataclass(frozen=True)
class Mutation:
    """A replacement of the characters from start to end of a source.

    line, last: of the innermost statement, without its body. name: that the statement defines, "".
    """

    start: int
    end: int
    text: str
    line: int
    last: int
    change: str
    name: str = ""

    def applied(self, source: str) -> str:
        """The source with the fault."""
        return source[: self.start] + self.text + source[self.end :]


def mutations_of(source: str) -> list[Mutation]:
    """All mutations of a source, in its order; a few are no valid Python or change nothing."""
    return sorted(set(_Finder(source).module()), key=lambda m: (m.start, m.end, m.text))


def is_fault(mutation: Mutation, source: str) -> bool:
    """Whether a mutation changes the source to another valid one."""
    mutated = mutation.applied(source)
    try:
        compile(mutated, "mutant", "exec")
    except (SyntaxError, ValueError):
        return False
    return mutated != source


class _Finder:
    """The mutations of one source, found statement by statement."""

    def __init__(self, source: str) -> None:
        self.source = source
        lines = source.encode().splitlines(keepends=True)
        self.lines = [line.decode() for line in lines]
        self.factor = 2
        self.starts = [0]
        for line in self.lines:
            self.starts.append(self.starts[-1] + len(line))

    def module(self) -> Iterator[Mutation]:
        yield from self.body(ast.parse(self.source).body)

    def body(self, statements: list[ast.stmt]) -> Iterator[Mutation]:
        for statement in statements:
            yield from self.statement(statement)
            for name in ("body", "orelse", "finalbody"):
                yield from self.body(getattr(statement, name, []))
            for handler in getattr(statement, "handlers", []):
                yield from self.body(handler.body)

    def statement(self, s: ast.stmt) -> Iterator[Mutation]:
        """The mutations of a statement without those of its body."""
        if isinstance(s, ast.Import | ast.ImportFrom | ast.Raise | ast.Assert):
            return
        if isinstance(s, ast.Expr) and isinstance(s.value, ast.Constant):
            return  # a docstring
        last = s.end_lineno or s.lineno
        inner = getattr(s, "body", None)
        if isinstance(inner, list) and inner:
            last = max(s.lineno, inner[0].lineno - 1)
        where = s.lineno, last, _defined(s)
        self.factor = 10 if where[2].isupper() and s.col_offset == 0 else 2
        yield from self.omission(s, where)
        if isinstance(s, ast.If | ast.While):
            yield self.replaced(s.test, f"not ({self.text(s.test)})", where)
        if isinstance(s, ast.AugAssign) and type(s.op) in ARITHMETIC:
            old, new = ARITHMETIC[type(s.op)]
            yield self.between(s.target, s.value, old + "=", new + "=", where)
        for root in _expressions(s):
            for node in ast.walk(root):
                yield from self.expression(node, where)

    def omission(self, s: ast.stmt, where: tuple[int, int, str]) -> Iterator[Mutation]:
        """The statement left out, where that leaves a program that runs."""
        effect = isinstance(s, ast.Expr | ast.AugAssign) or (
            isinstance(s, ast.Assign)
            and all(isinstance(t, ast.Attribute | ast.Subscript) for t in s.targets)
        )
        if effect:
            yield self.replaced(s, "pass", where)
        if isinstance(s, ast.Break):
            yield self.replaced(s, "continue", where)
        if isinstance(s, ast.Continue):
            yield self.replaced(s, "break", where)

    def expression(self, e: ast.AST, where: tuple[int, int, str]) -> Iterator[Mutation]:
        if isinstance(e, ast.Compare):
            left = e.left
            for op, right in zip(e.ops, e.comparators, strict=True):
                for new in COMPARISONS[type(op)]:
                    yield self.between(left, right, _SYMBOLS[type(op)], new, where)
                left = right
        elif isinstance(e, ast.BinOp) and type(e.op) in ARITHMETIC:
            yield self.between(e.left, e.right, *ARITHMETIC[type(e.op)], where)
        elif isinstance(e, ast.BoolOp):
            old, new = ("and", "or") if isinstance(e.op, ast.And) else ("or", "and")
            for i, (left, right) in enumerate(zip(e.values, e.values[1:], strict=False)):
                yield self.between(left, right, old, new, where)
                if i == 0:
                    yield self.cut(left, right, where)
                yield self.cut(left, right, where, last=True)
        elif isinstance(e, ast.UnaryOp) and isinstance(e.op, ast.Not | ast.USub | ast.Invert):
            yield self.replaced(e, f"({self.text(e.operand)})", where)
        elif isinstance(e, ast.IfExp):
            yield self.replaced(e.test, f"not ({self.text(e.test)})", where)
        elif isinstance(e, ast.comprehension):
            for test in e.ifs:
                yield self.replaced(test, f"not ({self.text(test)})", where)
        elif isinstance(e, ast.Constant):
            yield from self.constant(e, where)
        elif isinstance(e, ast.Call):
            yield from self.call(e, where)

    def constant(self, e: ast.Constant, where: tuple[int, int, str]) -> Iterator[Mutation]:
        if isinstance(e.value, bool):
            yield self.replaced(e, str(not e.value), where)
        elif isinstance(e.value, int):
            coarse = self.factor == 10 and e.value > 0
            more, less = (e.value * 10, e.value // 10) if coarse else (e.value + 1, e.value - 1)
            yield self.replaced(e, str(more), where)
            if e.value > 0:
                yield self.replaced(e, str(less), where)
        elif isinstance(e.value, float):
            zero = e.value == 0.0
            yield self.replaced(e, "1.0" if zero else repr(e.value * self.factor), where)
            yield self.replaced(e, "-1.0" if zero else repr(e.value / self.factor), where)

    def call(self, e: ast.Call, where: tuple[int, int, str]) -> Iterator[Mutation]:
        f = e.func
        name = f.attr if isinstance(f, ast.Attribute) else getattr(f, "id", "")
        if name in TWINS:
            _, end = self.span(f)
            yield self.at(end - len(name), end, TWINS[name], where)
        if name in ("abs", "absolute") and len(e.args) == 1:
            yield self.replaced(e, f"({self.text(e.args[0])})", where)

    def between(
        self, left: ast.AST, right: ast.AST, old: str, new: str, where: tuple[int, int, str]
    ) -> Mutation:
        """The operator between two nodes replaced."""
        start, end = self.span(left)[1], self.span(right)[0]
        at = start + self.source[start:end].index(old.split()[0])
        stop = start + self.source[start:end].rindex(old.split()[-1]) + len(old.split()[-1])
        return self.at(at, stop, new, where)

    def cut(
        self, left: ast.AST, right: ast.AST, where: tuple[int, int, str], last: bool = False
    ) -> Mutation:
        """The left or the right one of two operands of `and` or `or` dropped."""
        (a, b), (c, d) = self.span(left), self.span(right)
        if self.source[b:c].count("(") + self.source[b:c].count(")") > 0:
            return self.at(a, a, "", where)  # parentheses around an operand: nothing to cut
        return self.at(b, d, "", where) if last else self.at(a, c, "", where)

    def replaced(self, node: ast.AST, text: str, where: tuple[int, int, str]) -> Mutation:
        return self.at(*self.span(node), text, where)

    def at(self, start: int, end: int, text: str, where: tuple[int, int, str]) -> Mutation:
        line, last, name = where
        first = self.source.rfind("\n", 0, start) + 1
        stop = self.source.find("\n", end)
        stop = len(self.source) if stop < 0 else stop
        before = " ".join(self.source[first:stop].split())
        after = " ".join((self.source[first:start] + text + self.source[end:stop]).split())
        return Mutation(start, end, text, line, last, f"{before}  ->  {after}", name)

    def text(self, node: ast.AST) -> str:
        start, end = self.span(node)
        return self.source[start:end]

    def span(self, node: ast.AST) -> tuple[int, int]:
        """First and last character of a node in the source; ast counts bytes of UTF-8."""
        return (
            self.offset(node.lineno, node.col_offset),  # type: ignore[attr-defined]
            self.offset(node.end_lineno, node.end_col_offset),  # type: ignore[attr-defined]
        )

    def offset(self, line: int, column: int) -> int:
        before = self.lines[line - 1].encode()[:column].decode()
        return self.starts[line - 1] + len(before)


_SYMBOLS = {
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
    ast.Is: "is",
    ast.IsNot: "is not",
    ast.In: "in",
    ast.NotIn: "not in",
}


def _expressions(s: ast.stmt) -> Iterator[ast.AST]:
    """The expressions of a statement, without annotations, decorators and bodies."""
    if isinstance(s, ast.FunctionDef | ast.AsyncFunctionDef):
        yield from [d for d in (*s.args.defaults, *s.args.kw_defaults) if d is not None]
    elif isinstance(s, ast.ClassDef):
        return
    elif isinstance(s, ast.AnnAssign):
        if s.value is not None:
            yield s.value
    else:
        for name, field in ast.iter_fields(s):
            if name in ("body", "orelse", "finalbody", "handlers", "targets", "target"):
                continue
            for each in field if isinstance(field, list) else [field]:
                if isinstance(each, ast.AST):
                    yield each


def _defined(s: ast.stmt) -> str:
    """The name that a statement defines, for constants and fields whose uses are elsewhere."""
    target: ast.AST | None = None
    if isinstance(s, ast.Assign) and len(s.targets) == 1:
        target = s.targets[0]
    elif isinstance(s, ast.AnnAssign):
        target = s.target
    elif isinstance(s, ast.FunctionDef):
        return s.name
    return target.id if isinstance(target, ast.Name) else ""
