"""The public names of hovi, and the modules that `import hovi` and a first plan load."""

from __future__ import annotations

import itertools
import os
import pkgutil
import subprocess
import sys

import pytest

import hovi

SUBPACKAGES = {"accuracy", "conditions", "effects", "methods", "schemes", "symbolic"}
FIRST_PLAN = """
import sys
import hovi
solution = hovi.plan_task(hovi.load_task(hovi.example("two_link_reach")))
assert solution.success
print(*sorted({name.partition(".")[0] for name in sys.modules}))
"""


def python(code: str, **environment: str) -> list[str]:
    """The words printed by a program in a separate process."""
    run = [sys.executable, "-c", code]
    done = subprocess.run(
        run, capture_output=True, text=True, check=True, env=os.environ | environment
    )
    return done.stdout.split()


@pytest.mark.parametrize("name", hovi.__all__)
def test_a_public_name_exists(name: str) -> None:
    assert getattr(hovi, name) is not None
    assert name in dir(hovi)


def test_a_module_does_not_hide_a_public_name() -> None:
    """Importing hovi.robot binds that package to the name `robot` of hovi."""
    modules = {module.name for module in pkgutil.iter_modules(hovi.__path__)}
    assert modules & set(hovi.__all__) == SUBPACKAGES


def test_an_unknown_name_raises() -> None:
    unknown = "plann"
    with pytest.raises(AttributeError, match=unknown):
        getattr(hovi, unknown)
    with pytest.raises(ImportError, match=unknown):
        exec(f"from hovi import {unknown}")


def test_all_public_names_can_be_imported_at_once() -> None:
    """Eager loading of all names reveals import cycles that lazy loading hides."""
    assert python("import hovi; print('plan' in dir(hovi))", EAGER_IMPORT="1") == ["True"]


def test_importing_hovi_loads_what_registers_exports_alone() -> None:
    code = "import sys; before = {*sys.modules}; import hovi; print(*{*sys.modules} - before)"
    loaded = python(code)
    assert "hovi" in loaded
    exporter = "hovi.discrete", "hovi.discrete.output", "hovi.discrete.output.exporter"
    assert {name for name in loaded if name.startswith("hovi.")} == {*exporter}
    assert not {"numpy", "importlib.metadata"} & set(loaded)


def test_a_first_plan_loads_no_unused_package() -> None:
    loaded = python(FIRST_PLAN)
    assert "pinocchio" in loaded
    assert not {"scipy", "joblib", "matplotlib", "meshcat", "typer"} & set(loaded)


PLAN_FROM_THE_COMMAND_LINE = """
import sys
from hovi.cli.application import main
assert main(['plan', '{scene}'{more}]) == 0
print(*sys.modules)
"""
OTHER_COMMANDS = {
    "hovi.cli.commands.study",
    "hovi.planning.sequence.sequence_planner",
    "hovi.planning.task_file.obstacle_tables",
    "hovi.viewing.replay_session",
}
OTHER_MOTIONS = {
    "hovi.effects.drag",
    "hovi.effects.expressions.formula",
    "hovi.effects.payload",
    "hovi.planning.obstacles.grasped",
    "hovi.planning.obstacles.primitives",
}
"""Modules for obstacles, loads and other effects than the scene's gravity."""


def modules_of_plan(scene: str, more: str = "") -> set[str]:
    """The modules that a plan from the command line loads."""
    return set(python(PLAN_FROM_THE_COMMAND_LINE.replace("{scene}", scene).replace("{more}", more)))


@pytest.mark.parametrize(
    ("scene", "number"), [("ur5_reach_limited", 10), ("ur5_around_sphere", 15)]
)
def test_what_limits_and_obstacles_need_is_loaded_with_them(scene: str, number: int) -> None:
    """At least so many modules more than a motion without them, which needs none of its own."""
    plain, other = (
        {name for name in modules_of_plan(each) if name.startswith("hovi.planning.")}
        for each in ("two_link_reach", scene)
    )
    assert plain <= other
    assert len(other - plain) >= number


@pytest.mark.parametrize("more", ["", ", '--json'"], ids=["text", "json"])
def test_a_plan_from_the_command_line_loads_only_its_own_modules(more: str) -> None:
    loaded = modules_of_plan("two_link_reach", more)
    assert {"hovi.cli.commands.plan", "hovi.effects.gravity"} <= loaded
    assert not {"scipy", "matplotlib", "meshcat", "tornado", "numpy.ma", "lxml"} & loaded
    assert not {"rich.table", "rich.console", "rich.progress"} & loaded
    assert not (OTHER_COMMANDS | OTHER_MOTIONS | {"hovi.version"}) & loaded


def test_the_command_searches_for_no_plugins_and_no_garbage() -> None:
    """Plugins are searched for in the metadata of all packages, garbage in all that was loaded."""
    code = (
        "import atexit, gc, os, sys; from hovi.__main__ import run\n"
        "searches = []; sys.argv = ['hovi', 'plan', 'two_link_reach', '--json']\n"
        "gc.collect(); gc.callbacks.append(lambda *each: searches.append(each))\n"
        "atexit.register(lambda: print(len(searches), gc.get_count()[0], gc.get_freeze_count()))\n"
        "atexit.register(lambda: print(os.environ['PYDANTIC_DISABLE_PLUGINS']))\n"
        "run()"
    )
    *_, plugins, searches, _, frozen = python(code)
    assert plugins == "__all__"
    assert searches == "0"
    assert int(frozen) > 10_000


def test_a_text_report_loads_no_plotting_package() -> None:
    loaded = python("import sys, hovi.cli.reports.plan; print(*sys.modules)")
    assert "hovi.cli.reports.plan" in loaded
    assert not {"matplotlib", "meshcat", "scipy", "rich"} & set(loaded)


ORDERS = [" ".join(each) for each in itertools.permutations(("hovi", "casadi", "pinocchio"))]
TOGETHER = """
import importlib, sys
for name in sys.argv[1:]:
    importlib.import_module(name)
import hovi
robot = hovi.load_robot(hovi.example("two_link.urdf"))
costs = hovi.effects.RunningCost({"v": "dot(v, v)"})
scene = hovi.Scene(robot, [hovi.effects.Gravity(), costs])
found = hovi.plan(scene, [0.0, 0.0], [0.4, 0.3], 1.0, limits="none")
import casadi, numpy as np, pinocchio
x = casadi.SX.sym("x")
assert float(casadi.Function("f", [x], [x * x])(3.0)) == 9.0
model = found.trajectory.scene.robot.model
data = model.createData()
q = found.trajectory.q[3]
energy = pinocchio.computePotentialEnergy(model, data, q)
assert np.isfinite(energy) and found.success, found.message
print(repr(found.cost))
"""
"""Uses all three in one process, where hovi shares the types of the other two."""


@pytest.mark.parametrize("order", ORDERS)
def test_hovi_is_imported_before_and_after_the_libraries_whose_types_it_shares(order: str) -> None:
    """A second copy of one of them would crash the process, or refuse its values."""
    done = subprocess.run(
        [sys.executable, "-c", TOGETHER, *order.split()], capture_output=True, text=True
    )
    assert done.returncode == 0, (done.returncode, done.stderr[-2000:])
    assert float(done.stdout) == pytest.approx(32.157498945, rel=1e-9)  # without the others
