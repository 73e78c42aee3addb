"""The map of the packages in design.md, from the imports and docstrings of the source.

python docs/package_graph.py            print it
python docs/package_graph.py --write    and put it between its two markers in docs/design.md
"""

from __future__ import annotations

import ast
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path

TOP = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(TOP / "tests"))

from oracles.packages import FILES, FLOORS, INSIDE, NAMES, PACKAGES, Module, imports  # noqa: E402

PAGE = TOP / "docs" / "design.md"
BEGIN = "<!-- written by docs/package_graph.py -->\n"
END = "<!-- end of what docs/package_graph.py writes -->\n"
DOCSTRING_COLUMN = 25
PUBLIC_NAMES = "The public names, each imported when it is first used."
NATIVE = "Compiled modules and their type stubs."


def package_map() -> str:
    """The table of floors, the order inside packages, and the tree, in Markdown."""
    return "\n".join([*_table(), "", *_orders(), "", "```text", *_tree(), "```", ""])


def with_map(page: str) -> str:
    """The page with a new map between the markers."""
    before, rest = page.split(BEGIN)
    _, after = rest.split(END)
    return before + BEGIN + "\n" + package_map() + "\n" + END + after


def _table() -> Iterator[str]:
    yield "| floor | package | files | imports |"
    yield "|---:|---|---:|---|"
    for floor, packages in enumerate(FLOORS):
        for package in sorted(packages):
            files = [module for module in NAMES - PACKAGES if module[0] == package]
            names = ", ".join(f"`{name}`" for name in _imported_packages(package))
            yield f"| {floor} | `{package}` | {len(files)} | {names} |"


def _imported_packages(package: str) -> list[str]:
    """The other packages that one imports, from the ground up."""
    modules = [module for module in FILES if module[0] == package]
    found = {imported[0] for module in modules for imported in imports(module)} - {package}
    return [name for packages in FLOORS for name in sorted(packages & found)]


def _orders() -> Iterator[str]:
    for package, floors in INSIDE.items():
        steps = [
            ", ".join(f"`{folder}`" if folder else "its own files" for folder in sorted(folders))
            for folders in floors
        ]
        yield f"- `{package}`: {' < '.join(steps)}"


def _tree() -> Iterator[str]:
    yield "src/hovi/"
    yield _entry(0, "__init__.py", PUBLIC_NAMES)
    for packages in FLOORS:
        for package in sorted(packages):
            if (package,) in FILES.keys() - PACKAGES:
                yield _entry(0, f"{package}.py", _docstring((package,)))
            else:
                yield from _folder((package,))


def _folder(package: Module) -> Iterator[str]:
    """One package: its docstring, the names of its files, then its folders."""
    depth = len(package) - 1
    yield _entry(depth, f"{package[-1]}/", _docstring(package))
    files = sorted(module[-1] for module in NAMES - PACKAGES if module[:-1] == package)
    indent = "  " * (depth + 3)
    yield from textwrap.wrap("  ".join(files), 96, initial_indent=indent, subsequent_indent=indent)
    for inner in _inner(package):
        yield from _folder(inner)


def _inner(package: Module) -> list[Module]:
    """The folders of a package, in the order that INSIDE gives, or of a folder, by name."""
    order = [folder for folders in INSIDE.get(package[0], []) for folder in sorted(folders)]
    inner = [module for module in PACKAGES if module[:-1] == package]
    return sorted(inner, key=lambda module: (order.index(module[1]), module))


def _entry(depth: int, name: str, docstring: str) -> str:
    return f"{'  ' * (depth + 1)}{name}".ljust(DOCSTRING_COLUMN) + docstring


def _docstring(module: Module) -> str:
    """The first line of a module's docstring."""
    if module == ("_native",):
        return NATIVE
    docstring = ast.get_docstring(ast.parse(FILES[module].read_text()))
    assert docstring, f"{FILES[module]} has no docstring"
    return docstring.splitlines()[0]


if __name__ == "__main__":
    print(package_map())
    if "--write" in sys.argv[1:]:
        PAGE.write_text(with_map(PAGE.read_text()))
