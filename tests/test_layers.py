"""Packages are layers, called floors: a module imports only from the floors below its own."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from graphlib import CycleError, TopologicalSorter

import pytest

from oracles.packages import FILES, FLOORS, INSIDE, NAMES, PACKAGES, TOP, Module, folder, imports

FLOOR = {package: floor for floor, packages in enumerate(FLOORS) for package in packages}
INNER_FLOOR = {
    (package, inner): floor
    for package, floors in INSIDE.items()
    for floor, folders in enumerate(floors)
    for inner in folders
}
EFFORT = {("scene", name) for name in ("cost_terms", "effort_lagrangian", "squared_effort")}
SOLVER = re.compile(
    r"^\s*(from|import) hovi\.(optimize|planning\.(solver|refinement|search))\b", re.M
)
WITH_ORACLES = {
    "accuracy/test_lighter_rotors.py",
    "optimize/test_banded_model.py",
    "optimize/test_batched_newton.py",
    "optimize/test_bordered_model.py",
    "optimize/test_kkt_model.py",
    "optimize/test_merge_tree.py",
    "optimize/test_small_problems.py",
    "oracles/on_grid.py",
    "conditions/test_derivatives.py",
    "planning/refinement/test_candidate.py",
    "planning/refinement/test_hp_refinement.py",
    "planning/solver/free_duration/test_parts_of_free_length.py",
    "planning/solver/limits/test_limit_rows.py",
    "planning/solver/near/test_rows_on_groups.py",
    "planning/solver/test_between_points.py",
    "planning/solver/test_equations_along.py",
    "samples/interval_problems.py",
    "test_rules.py",
}
"""Tests of what solvers are made of, by dense matrices and sampled curves, and the one door."""
PUBLIC = {("accuracy",), ("conditions",), ("effects",), ("methods",), ("schemes",), ("symbolic",)}


def is_below(imported: Module, module: Module) -> bool:
    """Whether a module may import the other one."""
    package, inner = module[0], folder(module)
    if imported[0] != package:
        return FLOOR[imported[0]] < FLOOR[package]
    if folder(imported) == inner:
        return True
    return INNER_FLOOR[package, folder(imported)] < INNER_FLOOR[package, inner]


def dotted(module: Module) -> str:
    return ".".join(module)


def test_every_package_has_a_floor() -> None:
    assert {module[0] for module in NAMES} == set(FLOOR)


@pytest.mark.parametrize("package", sorted(FLOOR))
def test_every_folder_of_a_package_has_a_floor(package: str) -> None:
    modules = [module for module in NAMES - PACKAGES if module[0] == package]
    ordered = set().union(*INSIDE.get(package, [{""}]))
    assert {folder(module) for module in modules} == ordered


def test_every_folder_is_a_package() -> None:
    assert {module[:-1] for module in FILES} - {()} == PACKAGES


@pytest.mark.parametrize("module", FILES, ids=dotted)
def test_a_module_imports_only_from_lower_floors(module: Module) -> None:
    above = [dotted(other) for other in imports(module) if not is_below(other, module)]
    assert not above


def test_there_are_no_import_cycles() -> None:
    try:
        TopologicalSorter({module: imports(module) for module in FILES}).prepare()
    except CycleError as circle:
        pytest.fail(" -> ".join(map(dotted, circle.args[1])))


@pytest.mark.parametrize("package", sorted(PACKAGES - PUBLIC), ids=dotted)
def test_a_package_init_has_only_a_docstring(package: Module) -> None:
    """So that imports name the modules they use, and no cycle is hidden by a package."""
    tree = ast.parse(FILES[package].read_text())
    assert ast.get_docstring(tree)
    assert len(tree.body) == 1


@pytest.mark.parametrize("module", FILES, ids=dotted)
def test_the_optimiser_does_not_import_the_effort(module: Module) -> None:
    if module[0] in ("discrete", "optimize", "planning"):
        assert not imports(module) & EFFORT


def test_the_map_in_the_docs_is_up_to_date() -> None:
    """Otherwise run `python docs/package_graph.py --write`."""
    draw = [sys.executable, str(TOP / "docs" / "package_graph.py")]
    drawn = subprocess.run(draw, capture_output=True, text=True, check=True).stdout
    assert drawn.strip() in (TOP / "docs" / "design.md").read_text()


def test_claims_about_motions_are_stated_through_public_names() -> None:
    """So that they hold whatever solves: `hovi.plan`, `solve`, `replan`, or oracles.on_grid."""
    tests = TOP / "tests"
    found = {path for path in tests.rglob("*.py") if SOLVER.search(path.read_text())}
    assert {str(path.relative_to(tests)) for path in found} <= WITH_ORACLES
