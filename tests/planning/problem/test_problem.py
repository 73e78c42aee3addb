"""Valid trajectory problems, and the error messages of invalid ones."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.guess import cubic
from hovi.discrete.state import State
from hovi.effects import Gravity, JerkCost
from hovi.errors import InputError, ModelError, SchemeError
from hovi.planning.problem.goals import Via
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.schemes import CLASSIC, by_name, galerkin
from samples.manifold_robots import half_turning

REST = State([0.0, 0.0])


def problem(
    robot: Robot, start: State = REST, goal: State = REST, scheme: str = "galerkin-1"
) -> TrajectoryProblem:
    grid = Grid.uniform(1.0, 4, by_name(scheme))
    L = Scene(robot, [Gravity(9.8)]).effort_lagrangian()
    return TrajectoryProblem(DiscreteLagrangian(L, grid), start, goal)


def test_a_problem_knows_its_grid_scene_robot_and_ends(two_link: Robot) -> None:
    found = problem(two_link, State([1, 2], [3, 4]), State(np.array([5.0, 6.0])))
    assert found.robot is two_link
    assert found.scene.robot is two_link
    assert found.grid is found.ld.grid
    expected = [[1.0, 2.0], [5.0, 6.0]], [[3.0, 4.0], [0.0, 0.0]]
    for rows, numbers in zip(found.ends, expected, strict=True):
        assert rows.dtype == np.float64
        np.testing.assert_array_equal(rows, numbers)
    with pytest.warns(DeprecationWarning, match="is now `ends`"):
        q0, v0, q1, v1 = found.boundary
    np.testing.assert_array_equal([[q0, q1], [v0, v1]], expected)
    with pytest.warns(DeprecationWarning, match="is now `ends`"):
        assert found.end_jets == ()


def test_between_other_ends_the_finer_problem_shares_what_was_built(two_link: Robot) -> None:
    first = problem(two_link, REST, State([3.0, 1.0]))
    known = first.finer
    for _ in range(2):
        other = first.between(State([0.1, 0.0]), State([2.0, 1.0]))
        assert other.finer.ld is known.ld
        assert other.finer.structure is known.structure
        np.testing.assert_array_equal(other.finer.ends[0][0], [0.1, 0.0])
        assert other.finer.finer.grid.inner_modes == first.finer.grid.inner_modes + 2
        first = other.between(REST, State([1.0, 1.0]))  # without a finer problem in between
    free = first.between(REST, State([3.0, 1.0], free_velocity="all"))
    assert free.finer.structure is not first.finer.structure
    assert free.finer.structure.layout.size > first.finer.structure.layout.size
    coarser = free.on(Grid.uniform(1.0, 2, by_name("galerkin-1")))
    assert coarser.finer.grid.intervals == 2


ENDS = {
    "at rest": (State([0.3, 0.1]), State([1.0, -1.0])),
    "moving": (State([0.3, 0.1], [1.0, 2.0]), State([1.0, -1.0], [3.0, 4.0])),
    "free": (State([0.3, 0.1], free=["elbow"]), State([1.0, -1.0], free_velocity="all")),
    "turning": (State([0.3, 0.1]), State([1.0, -1.0], free_velocity=["shoulder"])),
}


@pytest.mark.parametrize("ends", ENDS)
@pytest.mark.parametrize("via", [(), (Via(0.5, State([0.5, 0.5])),)])
@pytest.mark.parametrize("order", [2, 3])
def test_between_other_ends_it_is_the_problem_that_would_be_built_there(
    two_link: Robot, ends: str, via: tuple[Via, ...], order: int
) -> None:
    effects = [Gravity(9.8), *([JerkCost(0.1)] if order == 3 else [])]
    L = Scene(two_link, effects).effort_lagrangian()
    ld = DiscreteLagrangian(L, Grid.uniform(1.0, 4, galerkin(2, order)))
    limits = as_limits(two_link, {"base": "none", "v": 9.0})
    first = TrajectoryProblem(ld, REST, State([3.0, 1.0], free_velocity="all"), limits, via)
    known = first.structure, first.inertial_torque
    found = first.between(*ENDS[ends])
    anew = TrajectoryProblem(ld, *ENDS[ends], limits, via)
    assert {*vars(anew)} <= {*vars(found)}
    for name in ("ends", "free_ends", "turns"):
        if hasattr(anew, name):
            np.testing.assert_array_equal(getattr(found, name), getattr(anew, name))
    assert (found.ld, found.start, found.goal) == (ld, *ENDS[ends])
    assert (found.limits, found.via, found.clearance) == (limits, via, None)
    assert found.unreachable == anew.unreachable
    assert [each.node for each in found.holds] == [each.node for each in anew.holds]
    assert found.structure.layout.size == anew.structure.layout.size
    assert found.inertial_torque == anew.inertial_torque != known[1]
    with pytest.raises(InputError, match=r"goal has shape \(1,\), expected \(2,\)"):
        first.between(REST, State([1.0]))


def test_on_another_grid_it_is_the_problem_that_would_be_built_there(two_link: Robot) -> None:
    first = problem(two_link, State([1, 2], free_velocity="all"), State([3.0, 1.0]))
    assert first.structure.layout.size > 0
    steps = np.array([0.3, 0.3, 0.4])
    for grid in (Grid(steps, (galerkin(2),) * 3), Grid(2 * steps, (galerkin(2),) * 3)):
        found = first.on(grid)
        anew = TrajectoryProblem(found.ld, first.start, first.goal)
        assert found.grid is grid
        assert found.structure.layout.size == anew.structure.layout.size
        np.testing.assert_array_equal(found.free_ends, anew.free_ends)
        assert found.inertial_torque == anew.inertial_torque
        assert found.finer.grid.inner_modes == 4
    with pytest.raises(SchemeError, match="not regular"):
        first.on(Grid(steps, (by_name("mean-difference"),) * 3))


def test_the_ends_are_copies_of_the_callers_arrays(two_link: Robot) -> None:
    q = np.array([1.0, 2.0])
    found = problem(two_link, State(q))
    q[:] = 9.0
    np.testing.assert_array_equal(found.ends[0][0], [1.0, 2.0])


def test_a_sampled_curve_keeps_its_own_ends_where_they_are_free(two_link: Robot) -> None:
    start = State([0.1, 0.2], [0.3, 0.4], free=["elbow"], free_velocity=["shoulder"])
    goal = State([1.1, 1.2], [1.3, 1.4], free=["shoulder"], free_velocity=["elbow"])
    ends = np.array([[5.0, 6.0], [7.0, 8.0], [9.0, 10.0], [11.0, 12.0]])
    curve = cubic(two_link, (ends[::2], ends[1::2]), 1.0)
    path = problem(two_link, start, goal).path(curve)
    np.testing.assert_allclose(path.q[[0, -1]], [[0.1, 6.0], [9.0, 1.2]], rtol=1e-14)
    np.testing.assert_allclose(path.v[[0, -1]], [[7.0, 0.4], [1.3, 12.0]], rtol=1e-14)


@pytest.mark.parametrize("end", ["start", "goal"])
@pytest.mark.parametrize(
    ("state", "sentence"),
    [
        (State([0.0]), r"{end}.* has shape \(1,\), expected \(2,\).*shoulder, elbow"),
        (State([0.0, 0.0, 0.0]), r"{end}.* has shape \(3,\), expected \(2,\)"),
        (State([[0.0, 0.0]]), r"{end}.* has shape \(1, 2\), expected \(2,\)"),
        (State([0.0, np.nan]), "{end}.* is nan at joint 'elbow'"),
        (State([-np.inf, 0.0]), "{end}.* is -inf at joint 'shoulder'"),
        (State([0.0, 0.0], [np.nan, 0.0]), "{end}.* is nan at joint 'shoulder'"),
        (State([0.0, 0.0], [0.0]), r"{end}.* has shape \(1,\), expected \(2,\)"),
        (State(["up", "down"]), "{end}.* must be 2 numbers"),
        (State(None), "{end}"),  # type: ignore[arg-type]
    ],
)
def test_a_state_that_does_not_fit_is_refused_by_name(
    two_link: Robot, end: str, state: State, sentence: str
) -> None:
    ends: dict[str, Any] = {end: state}
    with pytest.raises(InputError, match=sentence.format(end=end)):
        problem(two_link, **ends)


@pytest.mark.parametrize("scheme", CLASSIC)
def test_only_regular_schemes_make_a_problem(two_link: Robot, scheme: str) -> None:
    if "difference" not in scheme:
        problem(two_link, scheme=scheme)
        return
    with pytest.raises(SchemeError, match=f"scheme '{scheme}' is not regular"):
        problem(two_link, scheme=scheme)


def test_one_irregular_interval_is_enough_to_refuse(two_link: Robot) -> None:
    schemes = (galerkin(1), by_name("mean-difference"), galerkin(1))
    L = Scene(two_link).effort_lagrangian()
    with pytest.raises(SchemeError, match="'mean-difference' is not regular"):
        TrajectoryProblem(DiscreteLagrangian(L, Grid(np.ones(3), schemes)), REST, REST)


def test_a_mimic_joint_with_a_multiplier_on_a_turn_is_named_with_the_remedy() -> None:
    robot = load_robot(half_turning())
    start = State(robot.neutral())
    with pytest.raises(ModelError, match=r"does not support planning.*'last' mimics.*lock one"):
        problem(robot, start, start)


def test_a_robot_without_joints_is_refused(two_link: Robot) -> None:
    model = pin.Model()
    model.name = "statue"
    with pytest.raises(ModelError, match="'statue' has no joint that moves"):
        problem(load_robot(model), State([]), State([]))


def test_a_massless_link_is_refused(two_link: Robot) -> None:
    model = two_link.model.copy()
    model.inertias[2] = pin.Inertia.Zero()
    with pytest.raises(ModelError, match=r"(?i)mass"):
        problem(load_robot(model))
