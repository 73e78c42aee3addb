"""The packages are floors of a house: a file imports only from the floors below its own."""

from __future__ import annotations

import ast
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import hovi

SOURCE = Path(hovi.__file__).parent

# From the ground up. A package may import within itself, in the order that INSIDE gives.
FLOORS = [
    {"errors", "system", "_native"},
    {"schemes", "optimize", "robot"},
    {"dynamics"},
    {"effects"},
    {"scene"},
    {"discrete"},
    {"flows"},
    {"planning"},
    {"viewing"},
    {"accuracy", "exchange"},
    {"cli"},
    {"__main__"},
]
# "" stands for the files of the package itself.
INSIDE = {
    "robot": [{"space", "urdf"}, {""}],
    "effects": [{"expressions"}, {""}],
    "planning": [
        {"clearance"},
        {"problem"},
        {"solver"},
        {"refinement"},
        {"search"},
        {"task_file"},
    ],
    "accuracy": [{""}, {"peers", "effect_study"}],
    "cli": [{"reports"}, {"commands"}, {""}],
}
FLOOR_OF = {package: floor for floor, packages in enumerate(FLOORS) for package in packages}
FOLDER_OF = {
    (package, folder): floor
    for package, floors in INSIDE.items()
    for floor, folders in enumerate(floors)
    for folder in folders
}
FILES = sorted(path for path in SOURCE.rglob("*.py") if path != SOURCE / "__init__.py")


def parts_of(path: Path) -> tuple[str, ...]:
    """A file's module below hovi; a package's __init__ is the package."""
    parts = path.relative_to(SOURCE).with_suffix("").parts
    return parts[:-1] if parts[-1] == "__init__" else parts


MODULES = {parts_of(path): path for path in FILES}


def imports_of(path: Path) -> set[tuple[str, ...]]:
    """The modules of hovi that a file imports, wherever in it, for types alone too."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}, line {node.lineno}: relative import"
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    found = set()
    for name in names:
        first, *parts = name.split(".")
        if first == "hovi" and parts != ["__version__"]:
            found.add(next(p for k in (0, 1) if (p := tuple(parts[: len(parts) - k])) in KNOWN))
    return found


KNOWN = set(MODULES) | {("_native",)}
KNOWN |= {("_native", path.stem) for path in (SOURCE / "_native").glob("*.pyi")}


def folder(module: tuple[str, ...]) -> str:
    """The folder of its package that a module stands in; "" for the package itself."""
    is_folder = module in MODULES and MODULES[module].name == "__init__.py"
    return module[1] if len(module) > 2 or (len(module) == 2 and is_folder) else ""


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(SOURCE)))
def test_a_file_imports_only_from_lower_floors(path: Path) -> None:
    module = parts_of(path)
    assert module[0] in FLOOR_OF, f"{module[0]} has no floor: give it one in {Path(__file__).name}"
    for imported in imports_of(path):
        here, there = FLOOR_OF[module[0]], FLOOR_OF[imported[0]]
        if imported[0] != module[0]:
            assert there < here, f"{'.'.join(module)} imports {'.'.join(imported)} from above"
        elif module[0] in INSIDE and folder(module) != folder(imported):
            here = FOLDER_OF[module[0], folder(module)]
            there = FOLDER_OF[module[0], folder(imported)]
            assert there < here, f"{'.'.join(module)} imports {'.'.join(imported)} from above"


def test_no_files_import_each_other_in_a_circle() -> None:
    graph = {module: imports_of(path) for module, path in MODULES.items()}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as circle:
        pytest.fail(" -> ".join(".".join(module) for module in circle.args[1]))


def test_no_floor_is_empty() -> None:
    packages = {module[0] for module in KNOWN}
    assert set(FLOOR_OF) == packages
