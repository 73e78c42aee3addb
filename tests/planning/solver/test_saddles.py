"""A saddle is never called a minimum: indices 0 to 3 by closed form and by dense eigenvalues."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

from hovi import Solution, Status, solve
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.effects import Gravity
from hovi.planning.problem.goals import Via
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.schemes import galerkin
from oracles.dense_action import DenseAction
from samples.oscillating_lagrangian import FREE_HORIZONS, HORIZONS, OscillatingLagrangian

Array = npt.NDArray[np.float64]
STEEP = pin.SE3(pin.utils.rotate("x", np.pi / 2), np.zeros(3))
"""A placement that turns the plane of a planar joint upright."""


def assert_told(found: Solution, index: int) -> None:
    """Whether status, success, minima and message are those of a motion of this index."""
    assert found.n_neg == index, found.message
    assert found.trajectory.metadata["n_neg"] == index
    assert found.success == (index == 0)
    assert found.status is (Status.MINIMUM if index == 0 else Status.SADDLE)
    assert found.minima == ((found.cost,) if index == 0 else ())
    words = "a minimum of cost" if index == 0 else f"with {index} directions of negative curvature"
    assert words in found.message


# Closed form


def oscillating(
    robot: Robot,
    T: float,
    intervals: int,
    inner_modes: int = 2,
    limits: object = None,
    free_velocity: Sequence[str] = (),
) -> TrajectoryProblem:
    """The first joint moves from -1 to 1 by a cubic, the second stays where it oscillates."""
    L = OscillatingLagrangian(Scene(robot), (0.0, 1.0))
    ld = DiscreteLagrangian(L, Grid.uniform(T, intervals, galerkin(inner_modes)))
    bounds = None if limits is None else as_limits(robot, limits)
    goal = State([1.0, 0.0], free_velocity=free_velocity)
    return TrajectoryProblem(ld, State([-1.0, 0.0]), goal, bounds)


@pytest.mark.parametrize(("T", "index"), HORIZONS.items())
@pytest.mark.parametrize("intervals", [24, 1001], ids=["band", "tree"])
def test_a_stationary_motion_has_as_many_negative_eigenvalues_as_conjugate_points(
    two_link: Robot, T: float, index: int, intervals: int
) -> None:
    inner_modes = 2 if intervals < 100 else 0
    problem = oscillating(two_link, T, intervals, inner_modes)
    assert_told(solve(problem, escape_saddles=False), index)


@pytest.mark.parametrize(("T", "index"), FREE_HORIZONS.items())
def test_with_a_free_last_velocity_the_conjugate_points_are_others(
    two_link: Robot, T: float, index: int
) -> None:
    problem = oscillating(two_link, T, 24, free_velocity=["elbow"])
    assert_told(solve(problem, escape_saddles=False), index)


def test_directions_that_were_not_counted_have_no_number(
    two_link: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    count = "hovi.planning.solver.action_objective.ActionObjective.negative_eigenvalues"
    monkeypatch.setattr(count, lambda *_: -1)
    T = next(T for T, index in HORIZONS.items() if index > 0)
    found = solve(oscillating(two_link, T, 24), escape_saddles=False)
    assert found.status is Status.SADDLE
    assert found.n_neg == -1
    assert found.message.startswith("perhaps a saddle, of cost ")
    assert "-1" not in found.message


@pytest.mark.parametrize("T", [T for T, index in HORIZONS.items() if index > 0])
def test_a_saddle_is_left_for_lower_costs(two_link: Robot, T: float) -> None:
    """Without limits the cost has no lower bound there, so that no minimum can be found."""
    found = solve(oscillating(two_link, T, 8), max_iterations=30)
    assert not found.success
    assert found.status not in (Status.MINIMUM, Status.SADDLE)
    assert found.cost < solve(oscillating(two_link, T, 8), escape_saddles=False).cost


def assert_told_within(problem: TrajectoryProblem, active: bool, index: int) -> None:
    """Whether a motion that meets the first-order conditions with limits is a minimum or left.

    The joint with limits moves independently of the other, which has none; so the minimum of both
    without the bend of the latter is stationary.
    """
    convex = OscillatingLagrangian(problem.scene, (0.0, 0.0))
    stationary = solve(dataclasses.replace(problem, ld=DiscreteLagrangian(convex, problem.grid)))
    assert stationary.success
    assert problem.limits is not None
    t, most = np.linspace(0.0, problem.grid.duration, 2001), problem.limits.upper[1, 0]
    fastest = np.abs(stationary.trajectory.sample(t).v[:, 0]).max()
    assert (fastest > 0.999 * most) == active
    cost = problem.ld.action(stationary.trajectory.path)
    motion = stationary.trajectory
    for guess in (motion, motion.path)[problem.grid.intervals > 1000 :]:
        found = solve(problem, guess, max_iterations=40 if index == 0 else 12)
        if index == 0:
            assert_told(found, 0)
            assert found.cost == pytest.approx(cost, rel=1e-6)
        else:
            assert found.cost < cost - 1.0
            assert found.success == (found.n_neg == 0)


def velocity_limits(T: float, active: bool) -> dict[str, object]:
    """Limits on the cubic of the first joint, whose peak velocity is 3/T."""
    return {"base": "none", "v": [2.4 / T if active else 10.0, 10.0]}


@pytest.mark.parametrize(("T", "index"), HORIZONS.items())
@pytest.mark.parametrize(
    ("intervals", "active"), [(24, True), (24, False), (1001, True)], ids=["band", "slack", "tree"]
)
def test_a_saddle_within_limits_is_left(
    two_link: Robot, T: float, index: int, active: bool, intervals: int
) -> None:
    inner_modes = 2 if intervals < 100 else 0
    limits = velocity_limits(T, active)
    assert_told_within(oscillating(two_link, T, intervals, inner_modes, limits), active, index)


@pytest.mark.parametrize(("T", "index"), FREE_HORIZONS.items())
def test_a_saddle_within_limits_and_with_a_free_end_is_left(
    two_link: Robot, T: float, index: int
) -> None:
    limits = velocity_limits(T, active=True)
    problem = oscillating(two_link, T, 24, limits=limits, free_velocity=["elbow"])
    assert_told_within(problem, True, index)


@pytest.mark.parametrize("T", [T for T, index in HORIZONS.items() if index > 0])
def test_with_limits_a_saddle_is_left_for_a_minimum(two_link: Robot, T: float) -> None:
    """The velocity limit bounds the cost from below, -T v^2/2, nearly reached by each joint."""
    fastest = 10.0
    limits = {"base": "none", "v": [2.4 / T, fastest], "a": 1e3}
    found = solve(oscillating(two_link, T, 12, limits=limits))
    assert_told(found, 0)
    assert -T * fastest**2 / 2 < found.cost < 0.0


@pytest.mark.parametrize("T", HORIZONS)
def test_steps_of_a_quadratic_cost_decrease_it_as_predicted(two_link: Robot, T: float) -> None:
    """Those along negative curvature as well."""
    problem = oscillating(two_link, T, 8)
    path = problem.guess("cubic")
    path = dataclasses.replace(path, inner=path.inner + np.array([0.3, 0.2]))
    found = solve(problem, path, max_iterations=12)
    costs = [problem.ld.action(path), *(step.value for step in found.history)]
    predicted = np.array([step.decrease for step in found.history])
    large = predicted > 1e-9 * np.abs(costs[1:])
    assert large.sum() >= 1
    np.testing.assert_allclose(-np.diff(costs)[large], predicted[large], rtol=0.1)


# Dense eigenvalues


BODIES: dict[str, tuple[pin.JointModel, pin.SE3, tuple[float, ...]]] = {
    "revolute": (pin.JointModelRY(), pin.SE3.Identity(), (1.0, 1.4, 2.0, 2.8)),
    "continuous": (pin.JointModelRUBY(), pin.SE3.Identity(), (1.0, 1.4, 2.0, 2.8)),
    "spherical": (pin.JointModelSpherical(), pin.SE3.Identity(), (1.0, 1.4, 1.7, 2.0)),
    "planar": (pin.JointModelPlanar(), STEEP, (0.3, 0.5, 0.7, 1.0)),
    "free-flyer": (pin.JointModelFreeFlyer(), pin.SE3.Identity(), (0.3, 0.47, 0.56, 0.65)),
}
"""Joints that carry a body, and durations of motions of index 0, 1, 2 and 3."""
CASES = [(kind, T, i) for kind, (_, _, times) in BODIES.items() for i, T in enumerate(times)]


def held_level(kind: str, T: float, **ends: object) -> TrajectoryProblem:
    """Hold a body with its lever of half a metre level, where its weight takes the most torque.

    By symmetry the hold is stationary; for a short time it is a minimum.
    """
    joint, place, _ = BODIES[kind]
    model = pin.Model()
    model.name = "body"
    index = model.addJoint(0, joint, place, "joint")
    lever = place.rotation.T @ np.array([0.5, 0.0, 0.0])
    body = pin.Inertia(1.0, lever, np.diag([0.02, 0.03, 0.04]))
    model.appendBodyToJoint(index, body, pin.SE3.Identity())
    robot = load_robot(model)
    L = Scene(robot, [Gravity(9.81)]).effort_lagrangian()
    ld = DiscreteLagrangian(L, Grid.uniform(T, 4, galerkin(1)))
    level = robot.neutral()
    return TrajectoryProblem(ld, State(level), State(level), **ends)  # type: ignore[arg-type]


@pytest.mark.parametrize(("kind", "T", "index"), CASES)
def test_a_hold_has_as_many_negative_eigenvalues_as_its_dense_hessian(
    kind: str, T: float, index: int
) -> None:
    problem = held_level(kind, T)
    assert DenseAction(problem, problem.guess("cubic")).index() == index
    assert_told(solve(problem, escape_saddles=False), index)


@pytest.mark.parametrize(
    ("kind", "T", "index"),
    [
        ("revolute", 1.4, 0),
        ("continuous", 2.0, 1),
        ("continuous", 2.4, 2),
        ("spherical", 2.0, 1),
        ("planar", 0.7, 1),
        ("planar", 0.95, 2),
        ("free-flyer", 0.65, 1),
        ("free-flyer", 0.95, 3),
    ],
)
def test_at_a_via_point_only_motions_through_it_count(kind: str, T: float, index: int) -> None:
    """The index is that on the null space of the condition, here of the middle node."""
    level = held_level(kind, T).start
    problem = held_level(kind, T, via=(Via(T / 2, State(level.q)),))
    action = DenseAction(problem, problem.guess("cubic"))
    assert action.index(held=action.nodes[2, 0]) == index
    found = solve(problem, escape_saddles=False)
    assert_told(found, index)
    assert "So far" not in found.message  # the via point is met


@pytest.mark.parametrize("kind", BODIES)
def test_an_end_with_a_free_velocity_is_stationary_on_that_of_the_dense_hessian(kind: str) -> None:
    problem = held_level(kind, 0.2)
    free = TrajectoryProblem(
        problem.ld, problem.start, State(problem.goal.q, free_velocity=["all"])
    )
    found = solve(free, escape_saddles=False)
    assert_told(found, DenseAction(free, found.trajectory.path).index())
