"""How many statements of a checkout solve: a size that no formatter and no docstring changes.

python solving_statements.py [CHECKOUT]
"""

from __future__ import annotations

import ast
import sys
from pathlib import Path

PACKAGES = {
    *("optimize", "planning", "conditions", "program", "kkt", "resolve", "search", "motion"),
    "solver",
}
"""Packages of hovi that search for motions, wherever they are put."""


def solving_statements(checkout: Path) -> int:
    """The statements of the packages that solve."""
    package = checkout / "src" / "hovi"
    files = (file for name in PACKAGES for file in (package / name).rglob("*.py"))
    return sum(statements(file.read_text()) for file in files)


def statements(source: str) -> int:
    """The statements of a source, without strings that document."""
    return sum(
        isinstance(node, ast.stmt) and not _documents(node) for node in ast.walk(ast.parse(source))
    )


def _documents(node: ast.AST) -> bool:
    """Whether a statement is a string and nothing else."""
    constant = node.value if isinstance(node, ast.Expr) else None
    return isinstance(constant, ast.Constant) and isinstance(constant.value, str)


if __name__ == "__main__":
    print(solving_statements(Path(sys.argv[1] if len(sys.argv) > 1 else ".")))
