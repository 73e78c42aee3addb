"""The packages of hovi, the floors that they stand on, and which module imports which."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

Module = tuple[str, ...]
"""A module's name below hovi: ("planning", "solver", "status")."""

TOP = Path(__file__).resolve().parents[2]
SOURCE = TOP / "src" / "hovi"

# From the ground up: a package imports only packages of the floors below its own.
FLOORS = [
    {"_native", "errors", "system", "version"},
    {"checks", "workers"},
    {"optimize", "robot", "schemes"},
    {"dynamics", "methods"},
    {"effects"},
    {"scene"},
    {"discrete"},
    {"conditions", "flows"},
    {"planning", "symbolic"},
    {"viewing"},
    {"accuracy", "exchange", "study"},
    {"cli"},
    {"__main__"},
]
# The folders inside a package, in the same order; "" stands for the files of the package itself.
INSIDE = {
    "robot": [{"meshes"}, {"space", "urdf"}, {"findings"}, {"formats"}, {""}],
    "conditions": [{""}, {"kept"}],
    "effects": [{"expressions"}, {""}],
    "discrete": [{"output"}, {""}, {"measures"}],
    "flows": [{""}, {"execution"}],
    "planning": [
        {"obstacles"},
        {"clearance"},
        {"problem"},
        {"paths"},
        {"solver"},
        {"refinement"},
        {"search"},
        {"sequence"},
        {"task_file"},
    ],
    "viewing": [{"curves", "meshes"}, {"panel"}, {""}, {"documents"}],
    "accuracy": [{""}, {"effect_study", "peers"}],
    "study": [{"cells"}, {"axes"}, {"storage"}, {"running"}, {"showing"}, {""}],
    "exchange": [{""}, {"film"}],
    "cli": [{"arguments", "reports"}, {"commands"}, {""}],
}


def _module(path: Path) -> Module:
    """The name of a file's module; the `__init__` of a package is the package."""
    parts = path.relative_to(SOURCE).with_suffix("").parts
    return parts[:-1] if parts[-1] == "__init__" else parts


FILES = {
    _module(path): path
    for path in sorted(SOURCE.rglob("*.py"))
    if path != SOURCE / "__init__.py"  # which imports what it is asked for
}
PACKAGES = {module for module, path in FILES.items() if path.name == "__init__.py"}
COMPILED = {_module(path) for path in (SOURCE / "_native").glob("*.pyi")}
NAMES = {*FILES, *COMPILED}


def folder(module: Module) -> str:
    """The folder of its package that a module is in, at any depth; "" is the package itself."""
    home = module if module in PACKAGES else module[:-1]
    return home[1] if len(home) > 1 else ""


def imports(module: Module) -> set[Module]:
    """The modules of hovi that a module imports: in functions, for types alone and by name, too."""
    named = {_known(name, module) for name in _imported(FILES[module]) if name[0] == "hovi"}
    return named | _by_name(FILES[module])


def _imported(path: Path) -> Iterator[Module]:
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (tuple(alias.name.split(".")) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert not node.level, f"{path}:{node.lineno}: relative import"
            yield from ((*node.module.split("."), alias.name) for alias in node.names)


def _by_name(path: Path) -> set[Module]:
    """The modules that texts name, as `import_module` takes them, with a function after a colon."""
    texts = [x.value for x in ast.walk(ast.parse(path.read_text())) if isinstance(x, ast.Constant)]
    names = [tuple(x.split(":")[0].split(".")) for x in texts if isinstance(x, str)]
    return {name[1:] for name in names if name[0] == "hovi" and name[1:] in NAMES}


def _known(name: Module, importer: Module) -> Module:
    """The module imported: `from a.b import c` names the module a.b.c or something in a.b."""
    for found in (name[1:], name[1:-1]):
        if found in NAMES:
            return found
    raise AssertionError(f"{'.'.join(importer)} imports {'.'.join(name)}, which is no module")
