"""Reference tools: tables, programs, the robot model, and tools in other Python environments."""

from __future__ import annotations

import dataclasses
import os
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
from hovi.accuracy.peers.external_method import ExternalMethod, scene_request
from hovi.accuracy.peers.ipopt_method import CollocationMethod, Kernels
from hovi.accuracy.peers.supported_scenes import require_supported
from hovi.accuracy.peers.tools import EXTERNAL, tool_peers
from hovi.accuracy.peers.worker_client import Worker
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.guess import cubic
from hovi.discrete.state import State
from hovi.effects import Gravity, JointLimitPotential
from hovi.errors import InputError, SchemeError, UnmeasurableError
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.schemes import galerkin
from oracles.on_grid import solve_on_grid

Array = npt.NDArray[np.float64]


def reach(scene: Scene, intervals: int = 8, modes: int = 1) -> TrajectoryProblem:
    ld = DiscreteLagrangian(
        scene.effort_lagrangian(), Grid.uniform(1.0, intervals, galerkin(modes))
    )
    return TrajectoryProblem(ld, State([-np.pi / 2, 0.0]), State([0.3, 0.7], [0.5, -0.4]))


@pytest.fixture(scope="module")
def setting(arm_scene: Scene) -> Setting:
    problem = reach(arm_scene, 32, 3)
    guess = guess_curve("near", problem, solve_on_grid(problem).trajectory)
    return Setting(problem, guess, guess)


# Tables


def polynomial_motion(power: int, t: Array) -> tuple[Array, Array, Array]:
    """q, v and a for a = t^power with q(0) = v(0) = 0."""
    a = t**power
    return t ** (power + 2) / ((power + 1) * (power + 2)), t ** (power + 1) / (power + 1), a


EXACT = {"hermite-simpson": 0, "lg-3": 2, "lg-4": 3, "lg-5": 4, "lgr-3": 2, "lgr-4": 3, "lgr-5": 4}
"""Largest degree of the acceleration for which a table is exact."""


@pytest.mark.parametrize(
    ("name", "power"), [(name, power) for name in EXACT for power in range(EXACT[name] + 1)]
)
def test_polynomials_of_low_degree_have_no_defects_and_pass_through_the_points(
    name: str, power: int
) -> None:
    table = collocation_table(name)
    ends = np.array(polynomial_motion(power, np.array([0.0, 1.0])))[: table.node_size]
    inner = polynomial_motion(power, table.inner)[2]
    w = np.concatenate([ends[:, 0], inner, ends[:, 1]])
    np.testing.assert_allclose(table.defects @ w, 0, atol=1e-14)
    c = np.array([0.5]) if name == "hermite-simpson" else table.inner
    expected = np.stack(polynomial_motion(power, c), axis=1)
    np.testing.assert_allclose(table.points @ w, expected, atol=1e-14)


def test_trapezoidal_defects_are_the_trapezoidal_rules() -> None:
    q0, hv0, hha0, hv1, hha1 = 0.3, -0.2, 0.5, 0.7, -0.1
    q1, hv1_found = q0 + (hv0 + hv1) / 2, hv0 + (hha0 + hha1) / 2
    defects = collocation_table("trapezoidal").defects @ np.array([q0, hv0, hha0, q1, hv1, hha1])
    np.testing.assert_allclose(defects, [0.0, hv1_found - hv1], atol=1e-15)


@pytest.mark.parametrize("name", NAMES)
def test_weights_sum_to_one(name: str) -> None:
    table = collocation_table(name)
    assert table.weights.sum() + 2 * table.end_weight == pytest.approx(1.0, rel=1e-14)


@pytest.mark.parametrize("s", [2, 3, 4, 5])
def test_radau_points_integrate_polynomials_of_degree_2s_minus_2(s: int) -> None:
    c = radau_points(s)
    weights = lagrange_integrals(c, np.ones(1))[0][0]
    degrees = np.arange(2 * s - 1)
    np.testing.assert_allclose((c[:, None] ** degrees).T @ weights, 1 / (degrees + 1), rtol=1e-13)
    assert c[-1] == 1.0


def test_an_unknown_table_raises_with_a_suggestion() -> None:
    with pytest.raises(SchemeError, match="did you mean 'hermite-simpson'"):
        collocation_table("hermit-simpson")


# Programs


@pytest.mark.parametrize("modes", [1, 2, 3])
def test_legendre_gauss_collocation_equals_galerkin_with_two_modes_fewer(
    setting: Setting, modes: int
) -> None:
    ours = solve_on_grid(reach(setting.problem.scene, 8, modes))
    method = CollocationMethod(setting, f"lg-{modes + 2}", Kernels(compiled=False))
    theirs = method.prepare(8).solve()
    assert theirs.success
    assert theirs.cost == pytest.approx(ours.cost, rel=1e-12)
    t = np.linspace(0.0, 1.0, 37)
    np.testing.assert_allclose(
        theirs.configurations(t), ours.trajectory.configurations(t), rtol=0, atol=1e-8
    )


@pytest.mark.parametrize("name", NAMES)
def test_collocation_converges_with_its_order(setting: Setting, name: str) -> None:
    exact = solve_on_grid(reach(setting.problem.scene, 64, 5)).cost
    method = CollocationMethod(setting, name, Kernels(compiled=False))
    assert method.order is not None
    errors = [abs(method.prepare(N).solve().cost / exact - 1) for N in (24, 48)]
    assert errors[0] < 2e-2
    assert errors[1] < max(4 * errors[0] / 2**method.order, 1e-13)


def test_compiled_and_interpreted_kernels_agree(setting: Setting) -> None:
    costs = [
        CollocationMethod(setting, "lgr-3", Kernels(compiled=c)).prepare(6).solve().cost
        for c in (True, False)
    ]
    assert costs[0] == pytest.approx(costs[1], rel=1e-12)


def test_a_cubic_guess_is_represented_exactly(two_link: Robot) -> None:
    ends = np.array([[0.1, 0.2], [1.0, -1.0]]), np.array([[0.3, 0.4], [0.0, 0.0]])
    curve = cubic(two_link, ends, 2.0)
    method = Collocation(collocation_table("lg-3"), 5, 2.0, 2)
    w = method.unknowns(curve, ends)
    t = np.linspace(0.0, 2.0, 23)
    np.testing.assert_allclose(method.configurations(w, t), curve(t)[0], atol=1e-13)
    np.testing.assert_array_equal(w[method.fixed], np.stack(ends, axis=1).reshape(4, 2))
    defects = np.array(method.program.defects @ w.ravel()).ravel()
    np.testing.assert_allclose(defects, 0, atol=1e-13)


def test_an_unsupported_scene_raises(two_link: Robot) -> None:
    elbow = JointLimitPotential({"elbow": (0.0, 1.0)}, slope=10.0)
    problem = reach(Scene(two_link, [Gravity(), elbow]))
    with pytest.raises(UnmeasurableError, match="gravity and armature"):
        CollocationMethod(Setting(problem, None, None), "lg-3", Kernels(compiled=False))


def test_limits_are_refused(setting: Setting) -> None:
    lower = np.full((4, 2), -np.inf)
    lower[3] = -8.0
    problem = dataclasses.replace(setting.problem, limits=Limits(lower, -lower))
    with pytest.raises(UnmeasurableError, match="do not hold limits along the whole motion"):
        require_supported(dataclasses.replace(setting, problem=problem))


# The robot that other tools read


@pytest.mark.parametrize("fixture", ["two_link", "ur5", "panda"])
def test_the_bare_urdf_has_the_same_dynamics(fixture: str, request: pytest.FixtureRequest) -> None:
    model = request.getfixturevalue(fixture).model
    bare = pin.buildModelFromXML(bare_urdf(model))
    assert bare.nv == model.nv
    q, v, a = np.random.default_rng(0).uniform(-1, 1, (3, model.nv))
    tau = pin.rnea(model, model.createData(), q, v, a) - model.armature * a
    np.testing.assert_allclose(pin.rnea(bare, bare.createData(), q, v, a), tau, atol=1e-12)


def test_the_bare_urdf_has_prismatic_joints() -> None:
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelPY(), pin.SE3.Random(), "slide")
    model.appendBodyToJoint(joint, pin.Inertia.Random(), pin.SE3.Identity())
    bare = pin.buildModelFromXML(bare_urdf(model))
    one = np.ones(1)
    assert pin.rnea(bare, bare.createData(), 0 * one, one, one) == pytest.approx(
        pin.rnea(model, model.createData(), 0 * one, one, one), rel=1e-12
    )


# Tools in another Python


def external_method(setting: Setting, python: Path) -> ExternalMethod:
    return ExternalMethod(
        setting, python, "crocoddyl_worker", "tool", "Tool", 2, {"control": "zero"}
    )


def test_a_missing_python_raises(setting: Setting) -> None:
    with pytest.raises(InputError, match="cannot be started: No such file"):
        external_method(setting, Path("/nowhere/bin/python"))


def test_a_python_without_the_tool_raises_with_the_missing_module(setting: Setting) -> None:
    with pytest.raises(UnmeasurableError, match="No module named 'crocoddyl'"):
        external_method(setting, Path(sys.executable))


@pytest.mark.skipif("HOVI_CROCODDYL_PYTHON" not in os.environ, reason="needs Crocoddyl")
def test_torque_limits_raise_the_cost_of_crocoddyl_and_goals_move(setting: Setting) -> None:
    t = np.linspace(0.0, setting.problem.grid.duration, 81)
    q, v, a = (x.tolist() for x in setting.guess(t))
    goal = [*setting.problem.ends[0][1] + 0.01, *setting.problem.ends[1][1]]
    costs = []
    for limits in (None, [7.0, 7.0]):
        worker = Worker(Path(os.environ["HOVI_CROCODDYL_PYTHON"]), "crocoddyl_worker")
        options = {"control": "zero", "torque_limits": limits}
        worker.ask(scene_request(setting) | {"options": options})
        worker.ask({"prepare": 40, "guess": {"q": q, "v": v, "a": a}})
        answers = [worker.ask({"solve": 40}), worker.ask({"solve": 40, "goal": goal})]
        worker.close()
        assert [answer["success"] for answer in answers] == [True, True]
        np.testing.assert_allclose([*answers[1]["q"][-1], *answers[1]["v"][-1]], goal, atol=1e-6)
        costs.append([answer["cost"] for answer in answers])
    assert np.all(np.array(costs[1]) > 1.001 * np.array(costs[0]))


@pytest.mark.parametrize("name", EXTERNAL)
def test_a_tool_has_a_worker_and_a_method_per_variant(name: str, setting: Setting) -> None:
    tool = EXTERNAL[name]
    assert find_spec(f"hovi.accuracy.peers.{tool.worker}") is not None
    peers = tool_peers(name, Path("/nowhere/bin/python"))
    assert len(peers) == len(tool.variants) > 0
    for peer in peers:
        with pytest.raises(InputError, match="cannot be started: No such file"):
            peer(setting)


def test_collocation_runs_in_this_process(setting: Setting) -> None:
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
def test_an_invalid_peer_raises(name: str, python: Path | None, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        tool_peers(name, python)


def test_a_silent_tool_times_out(tmp_path: Path) -> None:
    silent = tmp_path / "python"
    silent.write_text("#!/bin/sh\nexec sleep 60\n")
    silent.chmod(0o755)
    worker = Worker(silent, "crocoddyl_worker", timeout=0.2)
    with pytest.raises(UnmeasurableError, match="gave no answer"):
        worker.ask({"urdf": ""})
    worker.close()


def test_a_tool_that_exits_raises(tmp_path: Path) -> None:
    short = tmp_path / "python"
    short.write_text("#!/bin/sh\nread line\n")
    short.chmod(0o755)
    worker = Worker(short, "crocoddyl_worker")
    with pytest.raises(UnmeasurableError, match="ended without an answer"):
        worker.ask({"urdf": ""})
    worker.close()
