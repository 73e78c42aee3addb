"""What is left of a path and of its rows, against samples of the whole motion."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt
import pytest

import hovi
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.guess import check_path
from hovi.discrete.state import State
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.limits.limit_rows import LimitRows
from hovi.planning.solver.receding.remainder import LEAST_SHARE, Remainder
from hovi.robot.loading import load_robot
from hovi.scene.scene import Scene
from hovi.schemes import by_name, galerkin
from samples.manifold_robots import BASES, chain, configurations, with_arm

Array = npt.NDArray[np.float64]

STEPS = np.array([0.3, 0.2, 0.1, 0.4])
GRID = Grid(STEPS, (galerkin(3), by_name("hermite-simpson"), galerkin(1), galerkin(4)))
TIMES = 0.0, 0.07, 0.31, 0.55, 0.95


def problem_of(base: str, grid: Grid = GRID) -> TrajectoryProblem:
    """A reach of two links, or of a base with joints, with limits in all coordinates."""
    if base == "two_link":
        robot = load_robot(hovi.example("two_link.urdf"))
    elif base == "continuous":
        robot = load_robot(chain([BASES[base]()] * 2))
    else:
        robot = load_robot(with_arm(base))
    q0, q1 = configurations(robot, 2, seed=1, size=0.4)
    v0, v1 = 0.3 * np.random.default_rng(2).normal(size=(2, robot.nv))
    ld = DiscreteLagrangian(Scene(robot, []).effort_lagrangian(), grid)
    limits = as_limits(robot, {"base": "none", "q": 4.0, "v": 3.0, "a": 30.0})
    return TrajectoryProblem(ld, State(q0, v0), State(q1, v1), limits=limits)


def wavy(problem: TrajectoryProblem, size: float = 0.03) -> DiscretePath:
    """The cubic guess with nodes and inner modes displaced at random."""
    objective, x = ActionObjective(problem), problem.guess("cubic")
    model = objective.model(x, None, None)
    return objective.retract(x, size * model.random_vector(5), model)


def rest_of(problem: TrajectoryProblem, remainder: Remainder) -> TrajectoryProblem:
    """The problem on the remaining grid; its ends do not matter."""
    ld = DiscreteLagrangian(problem.ld.lagrangian, remainder.grid)
    return dataclasses.replace(problem, ld=ld)


@pytest.mark.parametrize("time", TIMES)
@pytest.mark.parametrize("base", ["two_link", "continuous"])
def test_the_rest_of_a_path_is_the_same_curve(base: str, time: float) -> None:
    problem = problem_of(base)
    path, remainder = wavy(problem), Remainder.after(GRID, time)
    rest = remainder.path(path, problem)
    grid, t = remainder.grid, np.linspace(0.0, GRID.duration - time, 200)
    check_path(rest, grid, problem.coordinates)
    assert grid.duration == pytest.approx(GRID.duration - time, rel=1e-14)
    here = rest_of(problem, remainder).trajectory(rest).jet(np.minimum(t, grid.duration))
    whole = problem.trajectory(path).jet(np.minimum(time + t, GRID.duration))
    for x, y, tolerance in zip(here, whole, (1e-13, 1e-12, 1e-10), strict=True):
        inside = np.abs(t[:, None] - (grid.t[1:-1] if grid.intervals > 1 else 9.0)).min(axis=1)
        np.testing.assert_allclose(x[inside > 1e-9], y[inside > 1e-9], rtol=0, atol=tolerance)


@pytest.mark.parametrize("base", ["spherical", "free-flyer"])
def test_on_groups_nodes_are_kept_and_the_rest_follows_closely(base: str) -> None:
    problem = problem_of(base)
    path, remainder = wavy(problem), Remainder.after(GRID, 0.07)
    rest, whole = remainder.path(path, problem), problem.trajectory(path)
    check_path(rest, remainder.grid, problem.coordinates)
    for name in ("q", "v"):
        np.testing.assert_array_equal(getattr(rest, name)[1:], getattr(path, name)[1:])
    np.testing.assert_array_equal(rest.z[1:], path.z[1:])
    begun = whole.jet(np.array([0.07]))
    np.testing.assert_allclose(rest.q[0], begun[0][0], atol=1e-13)
    np.testing.assert_allclose(rest.v[0], begun[1][0], atol=1e-13)
    t = np.linspace(0.0, remainder.grid.steps[0], 20)
    here = rest_of(problem, remainder).trajectory(rest).jet(t)
    gap = problem.coordinates.difference(here[0], whole.jet(0.07 + t)[0])
    assert np.abs(gap).max() < 1e-4


def test_a_path_of_order_3_keeps_its_accelerations(two_link: hovi.Robot) -> None:
    grid = Grid(STEPS, (galerkin(2, derivatives=3),) * 4)
    ld = DiscreteLagrangian(hovi.spline(2, 3), grid)
    ends = State([0.0, 1.0], [0.5, 0.0], a=[1.0, -2.0]), State([1.0, 0.0], a=[0.3, 0.0])
    problem = TrajectoryProblem(ld, *ends)
    path, remainder = wavy(problem, 0.3), Remainder.after(grid, 0.35)
    rest = remainder.path(path, problem)
    here = rest_of(problem, remainder).trajectory(rest).jet(np.linspace(0.0, 0.1, 20), 3)
    whole = problem.trajectory(path).jet(np.linspace(0.35, 0.45, 20), 3)
    for x, y in zip(here, whole, strict=True):
        np.testing.assert_allclose(x, y, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(rest.higher[1:], path.higher[2:])


@pytest.mark.parametrize("base", ["two_link", "continuous"])
def test_an_interval_that_is_nearly_over_becomes_one_with_the_next(base: str) -> None:
    """One cubic over both is found again; other curves keep both ends."""
    problem, time = problem_of(base), 0.3 - 0.5 * LEAST_SHARE * 0.2
    remainder = Remainder.after(GRID, time)
    assert remainder.grid.steps[0] == pytest.approx(0.5 - time)
    assert remainder.grid.schemes == GRID.schemes[1:]
    t = np.linspace(0.0, 0.5 - time, 50)
    for path, tolerance in ((problem.guess("cubic"), 1e-12), (wavy(problem), 1.0)):
        rest, whole = remainder.path(path, problem), problem.trajectory(path)
        check_path(rest, remainder.grid, problem.coordinates)
        np.testing.assert_allclose(rest.q[0], whole.jet(np.array([time]))[0][0], atol=1e-14)
        np.testing.assert_array_equal(rest.q[1:], path.q[2:])
        assert not rest.inner[0, GRID.schemes[1].inner_modes :].any()
        here = rest_of(problem, remainder).trajectory(rest).jet(t)[1]
        np.testing.assert_allclose(here, whole.jet(time + t)[1], rtol=0, atol=tolerance)


def test_nodes_that_are_kept_stay_nodes() -> None:
    time = 0.3 - 1e-4
    assert Remainder.after(GRID, time).grid.intervals == 3
    assert Remainder.after(GRID, time, kept=(1,)).grid.intervals == 4
    assert Remainder.after(GRID, 1.0 - 1e-4).grid.intervals == 1


@pytest.mark.parametrize("time", TIMES)
@pytest.mark.parametrize("base", ["two_link", "spherical"])
def test_rows_are_those_of_the_same_parts(base: str, time: float) -> None:
    """Refined ones, too; beyond the first interval they have the same values."""
    problem = problem_of(base)
    path, remainder = wavy(problem), Remainder.after(GRID, time)
    rest = remainder.path(path, problem)
    assert problem.limits is not None
    rows = LimitRows(GRID, problem.limits, problem.coordinates.curved_space, None, (1, 2))
    rows._halve(np.arange(len(rows.parts)) % 3 == 0, np.arange(rows.size))
    left, kept = remainder.rows(rows)
    later = left.intervals > 0
    for mine, theirs in ((left.coordinate, rows.coordinate), (left.orders, rows.orders)):
        np.testing.assert_array_equal(mine[kept >= 0], theirs[kept[kept >= 0]])
    if remainder.grid.inner_modes < GRID.inner_modes:
        assert (kept == -1).all()
        return
    assert (kept[later] >= 0).all()
    number = rows.intervals[kept[later]]
    np.testing.assert_array_equal(left.intervals[later] + remainder.first, number)
    values = rows.values(path)[kept[later]]
    np.testing.assert_allclose(left.values(rest)[later], values, atol=1e-11)
    assert left.size == np.sum(rows.intervals >= remainder.first) or remainder.first > 0


def test_values_of_rows_enclose_those_of_the_rest() -> None:
    """Of the control points in the first interval, too, which is shorter than it was."""
    problem, remainder = problem_of("two_link"), Remainder.after(GRID, 0.07)
    path = wavy(problem)
    rest = remainder.path(path, problem)
    assert problem.limits is not None
    left, _ = remainder.rows(LimitRows(GRID, problem.limits, None, np.ones((2, 2, 2), dtype=bool)))
    motion = rest_of(problem, remainder).trajectory(rest)
    jet = motion.jet_intervals(np.zeros(200, np.intp), np.linspace(0.0, 1.0, 200))
    for c, (order, joint) in enumerate(zip(left.of.order, left.of.joint, strict=True)):
        own = left.values(rest)[(left.intervals == 0) & (left.coordinate == c)] * left.of.ranges[c]
        curve = jet[order][:, joint]
        assert own.min() - 1e-9 <= curve.min()
        assert curve.max() <= own.max() + 1e-9


@pytest.mark.parametrize("time", TIMES)
def test_points_take_over_from_those_next_to_them(time: float) -> None:
    problem, remainder = problem_of("two_link"), Remainder.after(GRID, time)
    found = remainder.points(problem)
    old = np.concatenate(problem.ld.point_times)
    rest = DiscreteLagrangian(problem.ld.lagrangian, remainder.grid)
    own, numbers = (np.concatenate(x) for x in (rest.point_times, rest.point_intervals))
    np.testing.assert_allclose(old[found[numbers > 0]], own[numbers > 0] + time, atol=1e-12)
    gaps = np.abs(old[:, None] - own - time)
    np.testing.assert_allclose(np.abs(old[found] - own - time), gaps.min(axis=0), atol=1e-12)


def test_points_at_the_ends_of_intervals_belong_to_their_own_interval() -> None:
    """Those of neighbours have the same time there."""
    grid = Grid.uniform(1.0, 6, by_name("hermite-simpson"))
    problem = problem_of("two_link", grid)
    numbers = np.concatenate(problem.ld.point_intervals)
    for time in (0.0, 0.05, 0.31, 0.5):
        remainder = Remainder.after(grid, time)
        found = remainder.points(problem)
        rest = DiscreteLagrangian(problem.ld.lagrangian, remainder.grid)
        own = np.concatenate(rest.point_intervals)
        after = own > 0
        np.testing.assert_array_equal(numbers[found][after], own[after] + remainder.first)
        assert (numbers[found][~after] <= remainder.first).all()
        assert len(np.unique(found[after])) == after.sum()
