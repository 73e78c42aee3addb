"""Reference tools: their tables, their programs, their robot, and tools in other Pythons."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

from hovi.accuracy import Setting
from hovi.accuracy.guess_motion import guess_curve
from hovi.accuracy.peers.bare_urdf import bare_urdf
from hovi.accuracy.peers.collocation import Collocation
from hovi.accuracy.peers.collocation_table import (
    NAMES,
    collocation_table,
    lagrange_integrals,
    radau_points,
)
from hovi.accuracy.peers.external_method import OutsideMethod
from hovi.accuracy.peers.ipopt_method import CollocationMethod, Kernels
from hovi.accuracy.peers.tools import OUTSIDE, tool_peers
from hovi.accuracy.peers.worker import Worker
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.guess import cubic
from hovi.discrete.state import State
from hovi.effects import Gravity, JointLimitPotential
from hovi.errors import InputError, SchemeError, UnmeasurableError
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.solver import solve
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.schemes import galerkin

Array = npt.NDArray[np.float64]


def reach(scene: Scene, intervals: int = 8, modes: int = 1) -> TrajectoryProblem:
    ld = DiscreteLagrangian(
        scene.effort_lagrangian(), Grid.uniform(1.0, intervals, galerkin(modes))
    )
    return TrajectoryProblem(ld, State([-np.pi / 2, 0.0]), State([0.3, 0.7], [0.5, -0.4]))


@pytest.fixture(scope="module")
def setting(arm_scene: Scene) -> Setting:
    problem = reach(arm_scene, 32, 3)
    guess = guess_curve("near", problem, solve(problem).trajectory)
    return Setting(problem, guess, guess)


# Tables


def polynomial_motion(power: int, t: Array) -> tuple[Array, Array, Array]:
    """a = t^power, at rest in 0 at t = 0."""
    a = t**power
    return t ** (power + 2) / ((power + 1) * (power + 2)), t ** (power + 1) / (power + 1), a


EXACT = {"hermite-simpson": 0, "lg-3": 2, "lg-4": 3, "lg-5": 4, "lgr-3": 2, "lgr-4": 3, "lgr-5": 4}
"""Degree of the acceleration up to which a table has nothing to approximate."""


@pytest.mark.parametrize(
    ("name", "power"), [(name, power) for name in EXACT for power in range(EXACT[name] + 1)]
)
def test_a_motion_of_low_degree_fulfils_the_ties_and_passes_through_the_points(
    name: str, power: int
) -> None:
    table = collocation_table(name)
    ends = np.array(polynomial_motion(power, np.array([0.0, 1.0])))[: table.node_size]
    inner = polynomial_motion(power, table.inner)[2]
    w = np.concatenate([ends[:, 0], inner, ends[:, 1]])
    np.testing.assert_allclose(table.ties @ w, 0, atol=1e-14)
    c = np.array([0.5]) if name == "hermite-simpson" else table.inner
    expected = np.stack(polynomial_motion(power, c), axis=1)
    np.testing.assert_allclose(table.points @ w, expected, atol=1e-14)


def test_the_trapezoidal_ties_are_its_rules() -> None:
    q0, hv0, hha0, hv1, hha1 = 0.3, -0.2, 0.5, 0.7, -0.1
    q1, hv1_found = q0 + (hv0 + hv1) / 2, hv0 + (hha0 + hha1) / 2
    ties = collocation_table("trapezoidal").ties @ np.array([q0, hv0, hha0, q1, hv1, hha1])
    np.testing.assert_allclose(ties, [0.0, hv1_found - hv1], atol=1e-15)


@pytest.mark.parametrize("name", NAMES)
def test_weights_integrate_one(name: str) -> None:
    table = collocation_table(name)
    assert table.weights.sum() + 2 * table.end_weight == pytest.approx(1.0, rel=1e-14)


@pytest.mark.parametrize("s", [2, 3, 4, 5])
def test_radau_points_integrate_polynomials_of_degree_2s_minus_2(s: int) -> None:
    c = radau_points(s)
    weights = lagrange_integrals(c, np.ones(1))[0][0]
    degrees = np.arange(2 * s - 1)
    np.testing.assert_allclose((c[:, None] ** degrees).T @ weights, 1 / (degrees + 1), rtol=1e-13)
    assert c[-1] == 1.0


def test_an_unknown_table_is_refused_with_the_nearest() -> None:
    with pytest.raises(SchemeError, match="did you mean 'hermite-simpson'"):
        collocation_table("hermit-simpson")


# Programs


@pytest.mark.parametrize("modes", [1, 2, 3])
def test_legendre_gauss_collocation_is_the_galerkin_scheme_with_two_modes_less(
    setting: Setting, modes: int
) -> None:
    ours = solve(reach(setting.problem.scene, 8, modes))
    method = CollocationMethod(setting, f"lg-{modes + 2}", Kernels(compiled=False))
    theirs = method.prepare(8).solve()
    assert theirs.success
    assert theirs.cost == pytest.approx(ours.cost, rel=1e-12)
    t = np.linspace(0.0, 1.0, 37)
    np.testing.assert_allclose(
        theirs.configurations(t), ours.trajectory.configurations(t), rtol=0, atol=1e-8
    )


@pytest.mark.parametrize("name", NAMES)
def test_collocation_finds_the_motion_with_its_order(setting: Setting, name: str) -> None:
    exact = solve(reach(setting.problem.scene, 64, 5)).cost
    method = CollocationMethod(setting, name, Kernels(compiled=False))
    assert method.order is not None
    errors = [abs(method.prepare(N).solve().cost / exact - 1) for N in (24, 48)]
    assert errors[0] < 2e-2
    assert errors[1] < max(4 * errors[0] / 2**method.order, 1e-13)


def test_compiled_kernels_give_what_interpreted_ones_give(setting: Setting) -> None:
    costs = [
        CollocationMethod(setting, "lgr-3", Kernels(compiled=c)).prepare(6).solve().cost
        for c in (True, False)
    ]
    assert costs[0] == pytest.approx(costs[1], rel=1e-12)


def test_a_guess_is_put_on_the_nodes_and_keeps_the_ends(two_link: Robot) -> None:
    boundary = (np.array([0.1, 0.2]), np.array([0.3, 0.4]), np.array([1.0, -1.0]), np.zeros(2))
    curve = cubic(two_link, boundary, 2.0)
    it = Collocation(collocation_table("lg-3"), 5, 2.0, 2)
    w = it.unknowns(curve, boundary)
    t = np.linspace(0.0, 2.0, 23)
    np.testing.assert_allclose(it.configurations(w, t), curve(t)[0], atol=1e-13)
    np.testing.assert_array_equal(w[it.held], np.stack(boundary))
    ties = np.array(it.program.ties @ w.ravel()).ravel()
    np.testing.assert_allclose(ties, 0, atol=1e-13)


def test_a_scene_that_other_tools_do_not_know_is_refused(two_link: Robot) -> None:
    kept = JointLimitPotential({"elbow": (0.0, 1.0)}, slope=10.0)
    problem = reach(Scene(two_link, [Gravity(), kept]))
    with pytest.raises(UnmeasurableError, match="gravity and armature"):
        CollocationMethod(Setting(problem, None, None), "lg-3", Kernels(compiled=False))


# The robot that other tools read


@pytest.mark.parametrize("fixture", ["two_link", "ur5", "panda"])
def test_the_bare_urdf_is_the_same_robot(fixture: str, request: pytest.FixtureRequest) -> None:
    model = request.getfixturevalue(fixture).model
    bare = pin.buildModelFromXML(bare_urdf(model))
    assert bare.nv == model.nv
    q, v, a = np.random.default_rng(0).uniform(-1, 1, (3, model.nv))
    tau = pin.rnea(model, model.createData(), q, v, a) - model.armature * a
    np.testing.assert_allclose(pin.rnea(bare, bare.createData(), q, v, a), tau, atol=1e-12)


def test_sliding_joints_are_in_the_bare_urdf() -> None:
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelPY(), pin.SE3.Random(), "slide")
    model.appendBodyToJoint(joint, pin.Inertia.Random(), pin.SE3.Identity())
    bare = pin.buildModelFromXML(bare_urdf(model))
    one = np.ones(1)
    assert pin.rnea(bare, bare.createData(), 0 * one, one, one) == pytest.approx(
        pin.rnea(model, model.createData(), 0 * one, one, one), rel=1e-12
    )


# Tools in another Python


def outside(setting: Setting, python: Path) -> OutsideMethod:
    return OutsideMethod(
        setting, python, "crocoddyl_worker", "tool", "Tool", 2, {"control": "zero"}
    )


def test_a_python_that_is_not_there_is_one_sentence(setting: Setting) -> None:
    with pytest.raises(InputError, match="cannot be started: No such file"):
        outside(setting, Path("/nowhere/bin/python"))


def test_a_python_without_the_tool_says_which_module_it_lacks(setting: Setting) -> None:
    with pytest.raises(UnmeasurableError, match="No module named 'crocoddyl'"):
        outside(setting, Path(sys.executable))


@pytest.mark.parametrize("name", OUTSIDE)
def test_a_tool_has_a_worker_and_a_method_per_variant(name: str, setting: Setting) -> None:
    tool = OUTSIDE[name]
    assert find_spec(f"hovi.accuracy.peers.{tool.worker}") is not None
    peers = tool_peers(name, Path("/nowhere/bin/python"))
    assert len(peers) == len(tool.variants) > 0
    for peer in peers:
        with pytest.raises(InputError, match="cannot be started: No such file"):
            peer(setting)


def test_a_tool_of_this_python_needs_no_other(setting: Setting) -> None:
    peers = tool_peers("collocation")
    methods = [peer(setting).name for peer in peers]
    assert methods[: len(NAMES)] == [f"{name}, Ipopt, compiled" for name in NAMES]
    assert len(methods) == 2 * len(NAMES)


@pytest.mark.parametrize(
    ("name", "python", "sentence"),
    [
        ("crocodyl", None, "there is no peer 'crocodyl': did you mean 'crocoddyl'"),
        ("drake", None, "drake=PYTHON"),
        ("collocation", Path("python3"), "runs in this Python"),
    ],
)
def test_a_peer_that_cannot_be_is_refused(name: str, python: Path | None, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        tool_peers(name, python)


def test_a_tool_that_says_nothing_is_given_up(tmp_path: Path) -> None:
    silent = tmp_path / "python"
    silent.write_text("#!/bin/sh\nexec sleep 60\n")
    silent.chmod(0o755)
    worker = Worker(silent, "crocoddyl_worker", patience=0.2)
    with pytest.raises(UnmeasurableError, match="gave no answer"):
        worker.ask({"urdf": ""})
    worker.close()


def test_a_tool_that_ends_is_given_up(tmp_path: Path) -> None:
    short = tmp_path / "python"
    short.write_text("#!/bin/sh\nread line\n")
    short.chmod(0o755)
    worker = Worker(short, "crocoddyl_worker")
    with pytest.raises(UnmeasurableError, match="ended without an answer"):
        worker.ask({"urdf": ""})
    worker.close()
