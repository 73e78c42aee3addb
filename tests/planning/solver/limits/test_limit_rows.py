"""Control points as rows, against sampled trajectories."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.interpolate import BPoly, PPoly

import hovi
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.state import State
from hovi.planning.problem.limits import Limits, as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.sequence.sequence_planner import plan_sequence
from hovi.planning.solver.limits.limit_rows import LEAST_GAP, WEIGHT, LimitRows, push_rows
from hovi.robot.loading import load_robot
from hovi.scene.scene import Scene
from hovi.schemes import by_name, galerkin
from oracles.path_steps import moved, random_step
from samples.manifold_robots import BASES, chain, configurations, with_arm

Array = npt.NDArray[np.float64]

STEPS = np.array([0.3, 0.2, 0.1, 0.4])
GRIDS = {
    "one scheme": Grid(STEPS, (galerkin(3),) * 4),
    "mixed schemes": Grid(
        STEPS, (galerkin(3), by_name("hermite-simpson"), galerkin(1), galerkin(4))
    ),
}
each_grid = pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS.keys())
LIMITS: dict[str, Any] = {"base": "none", "q": 4.0, "v": 3.0, "a": 30.0}


def problem_of(
    base: str, grid: Grid, limits: dict[str, Any] | Limits = LIMITS
) -> TrajectoryProblem:
    """A reach of two links, or of a base with joints, in all coordinates."""
    joints = {"two_link": [], "continuous": ["continuous", "continuous"]}.get(base)
    if base == "two_link":
        robot = load_robot(hovi.example("two_link.urdf"))
    else:
        robot = load_robot(chain([BASES[b]() for b in joints]) if joints else with_arm(base))
    q0, q1 = configurations(robot, 2, seed=1, size=0.4)
    v0, v1 = 0.3 * np.random.default_rng(2).normal(size=(2, robot.nv))
    ld = DiscreteLagrangian(Scene(robot, []).effort_lagrangian(), grid)
    return TrajectoryProblem(ld, State(q0, v0), State(q1, v1), limits=as_limits(robot, limits))


def wavy(problem: TrajectoryProblem, size: float = 0.03, seed: int = 5) -> DiscretePath:
    """The cubic guess with nodes and inner modes displaced at random."""
    return moved(problem, problem.guess("cubic"), size * random_step(problem, seed))


def rows_of(
    problem: TrajectoryProblem, fixed_ends: tuple[bool, bool] = (False, False)
) -> LimitRows:
    assert problem.limits is not None
    free = np.broadcast_to(~np.array(fixed_ends)[:, None, None], problem.free_ends.shape)
    return LimitRows(problem.grid, problem.limits, problem.coordinates.curved_space, free)


def with_rows(problem: TrajectoryProblem) -> LimitRows:
    """Rows of which some parts are halved once, and some of these again."""
    rows = rows_of(problem)
    for every in (3, 5):
        rows._halve(np.arange(len(rows.parts)) % every == 0, np.arange(rows.size))
    return rows


def coordinates_of(problem: TrajectoryProblem, path: DiscretePath, k: Array, s: Array) -> Array:
    """(q in tangent coordinates, v, a, ...) in intervals k at positions s, (rows, M, nv)."""
    order = max(2, problem.ld.k)
    q, *rates = problem.trajectory(path).jet_intervals(k, s, order)
    space = problem.coordinates.curved_space
    return np.stack([q if space is None else space.coordinates(q), *rates])


def sampled_values(problem: TrajectoryProblem, rows: LimitRows, path: DiscretePath) -> Array:
    """What every row stands for: a Bernstein coefficient of the curve, fitted on its part."""
    found = []
    for e in range(rows.size):
        k, order, joint = rows.intervals[e], rows.orders[e], rows.joints[e]
        part, i = rows._rows.part[e], rows._rows.number[e]
        degree = 2 * problem.ld.k - 1 + problem.grid.inner_modes - order
        u = (1 - np.cos(np.linspace(0.0, np.pi, degree + 1))) / 2
        s = rows.parts.left[part] + rows.parts.width[part] * u
        x = coordinates_of(problem, path, np.full(len(s), k), s)[order, :, joint]
        powers = np.polynomial.polynomial.polyfit(u, x, degree)[::-1]
        polynomial = PPoly(powers[:, None], [0.0, 1.0])
        found.append(BPoly.from_power_basis(polynomial).c[i, 0])
    return np.array(found) / rows.of.ranges[rows.coordinate]


def excess_by_sampling(
    problem: TrajectoryProblem, path: DiscretePath, samples: int = 4001
) -> Array:
    """Largest share of its range by which each kind and joint exceeds its limit, per interval."""
    limits, s = problem.limits, np.linspace(0.0, 1.0, samples)
    assert limits is not None
    lower, upper = limits.on(problem.grid.t)
    found = []
    for k in range(problem.grid.intervals):
        x = coordinates_of(problem, path, np.full(samples, k), s)
        kinds = [0, 1, 2, *([4] if len(x) > 3 else [])]
        low, high = (each[min(k, len(each) - 1)][kinds] for each in (lower, upper))
        beyond = np.maximum(x - high[:, None], low[:, None] - x).max(axis=1)
        with np.errstate(invalid="ignore"):
            found.append(np.where(np.isfinite(beyond), beyond / limits.ranges[kinds], -np.inf))
    return np.stack(found)


# Values


@each_grid
@pytest.mark.parametrize("base", ["two_link", "continuous", "spherical", "free-flyer", "planar"])
def test_values_of_rows_are_control_points_of_the_trajectory(base: str, grid: Grid) -> None:
    problem = problem_of(base, grid)
    rows, path = with_rows(problem), wavy(problem)
    assert set(rows.of.order) == ({1, 2} if base == "continuous" else {0, 1, 2})
    found = rows.values(path)
    np.testing.assert_allclose(found, sampled_values(problem, rows, path), rtol=1e-8, atol=1e-9)


@each_grid
@pytest.mark.parametrize("base", ["two_link", "continuous", "free-flyer"])
def test_columns_of_rows_are_their_derivatives(base: str, grid: Grid) -> None:
    """Rows are linear in the columns: one difference is exact."""
    problem = problem_of(base, grid)
    rows, path = with_rows(problem), wavy(problem)
    step = 1e-3 * random_step(problem, 1)
    after = moved(problem, path, step)
    found = push_rows(rows, rows.columns("nodal"), step)
    expected = sampled_values(problem, rows, after) - sampled_values(problem, rows, path)
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-10)


@pytest.mark.parametrize("base", ["two_link", "continuous"])
def test_bounds_and_weights_follow_the_limits(base: str) -> None:
    problem = problem_of(base, GRIDS["one scheme"])
    rows = with_rows(problem)
    lower, upper = rows.bounds
    kind = np.array([4.0, 3.0, 30.0])[rows.of.order[rows.coordinate]]
    np.testing.assert_allclose(lower, -kind / (2 * kind))
    np.testing.assert_allclose(upper, kind / (2 * kind))
    assert (rows.weights > 0).all()
    np.testing.assert_allclose(rows.weights / STEPS[rows.intervals], WEIGHT)


@pytest.mark.parametrize("base", ["spherical", "free-flyer", "planar"])
def test_orientations_have_no_rows_and_other_joints_have(base: str) -> None:
    """Coordinates of an orientation are no polynomials; those of the arm's joints are."""
    problem = problem_of(base, GRIDS["one scheme"])
    rows, nv = rows_of(problem), problem.ld.lagrangian.nv
    first = nv - 3
    assert set(rows.of.joint) == set(range(first, nv))
    assert set(rows.joints) <= set(range(first, nv))


def test_torques_have_no_rows() -> None:
    problem = problem_of("two_link", GRIDS["one scheme"], {"base": "none", "tau": 1.0})
    rows = rows_of(problem)
    assert rows.size == len(rows.of.order) == 0
    assert rows.refine(wavy(problem, 1.0), 0.0) is None


@pytest.mark.parametrize("end", [0, 1])
@pytest.mark.parametrize(("free", "missing"), [((0, 0), 3), ((0, 1), 1), ((1, 0), 1), ((1, 1), 0)])
def test_what_an_end_leaves_free_has_rows(end: int, free: tuple[int, int], missing: int) -> None:
    """Of q two, and of v one control point are given by q and v; without v one of q, without q one
    of v."""
    problem = problem_of("two_link", GRIDS["one scheme"])
    every = rows_of(problem)
    assert problem.limits is not None
    mask = np.ones((2, 2, 2), dtype=bool)
    mask[end, :, 1] = free  # the elbow
    rows = LimitRows(problem.grid, problem.limits, None, mask)
    assert {0, 1} <= {*every.orders}
    assert every.size - rows.size == missing
    assert (rows.joints == 0).sum() == (every.joints == 0).sum()


@pytest.mark.parametrize("fixed_ends", [(True, False), (False, True)])
def test_given_ends_have_no_rows(fixed_ends: tuple[bool, bool]) -> None:
    """q and v are data there: two control points of q and one of v, whose rows would vanish."""
    problem = problem_of("two_link", GRIDS["one scheme"])
    rows = rows_of(problem, fixed_ends)
    columns = rows.columns("nodal")
    free = columns.copy()
    if fixed_ends[0]:
        free[rows.intervals == 0, :2] = 0.0
    if fixed_ends[1]:
        free[rows.intervals == rows.grid.intervals - 1, 2:4] = 0.0
    assert (np.abs(free).max(axis=1) > 1e-12).all()
    both, none = rows_of(problem, (True, True)).size, rows_of(problem, (False, False)).size
    assert none - rows.size == rows.size - both == 2 * (2 + 1)


# The hull


@each_grid
@pytest.mark.parametrize("base", ["two_link", "continuous", "free-flyer"])
@pytest.mark.parametrize("seed", range(3))
def test_motions_whose_rows_are_within_bounds_are_within_their_limits(
    base: str, grid: Grid, seed: int
) -> None:
    """With limits at the largest control point, and a curve that ends just below."""
    wide = problem_of(base, grid)
    path, rows = wavy(wide, 0.05, seed), with_rows(wide)
    y = np.abs(rows.values(path))
    sizes = {}
    for order, kind in enumerate("qva"):
        if (rows.orders == order).any():
            sizes[kind] = float((y * rows.of.ranges[rows.coordinate])[rows.orders == order].max())
    limits = {"base": "none", **sizes}
    problem = problem_of(base, grid, limits)
    excess = excess_by_sampling(problem, path)[:, rows.of.order, rows.of.joint]
    assert -0.4 < excess.max() <= 1e-12


def test_every_control_point_has_a_row_or_is_given() -> None:
    """Rows and given values bound all of them: those that are left out are equal to others."""
    problem = problem_of("two_link", GRIDS["one scheme"])
    rows, path = rows_of(problem), wavy(problem)
    y = rows.values(path)
    for order in range(3):
        for joint in range(2):
            own = (rows.orders == order) & (rows.joints == joint)
            d = 2 * 2 - 1 + problem.grid.inner_modes - order
            shared = 1 if order < 2 else 0
            assert own.sum() == 4 * (d + 1) - 3 * shared
            values = y[own] * rows.of.ranges[rows.coordinate[own]]
            x = coordinates_of(problem, path, np.arange(4), np.zeros(4))[order, :, joint]
            assert np.abs(values[:, None] - x).min(axis=0).max() < 1e-9


# Refinement


def limited(excess: float, kind: str = "q") -> tuple[TrajectoryProblem, DiscretePath]:
    """A motion whose second joint stays below its upper limit by a share of the range."""
    free = problem_of("two_link", GRIDS["one scheme"], {"base": "none", kind: 1e3})
    path, order = wavy(free, 0.01), ["q", "v", "a"].index(kind)
    k = np.repeat(np.arange(4), 20_001)
    x = coordinates_of(free, path, k, np.tile(np.linspace(0, 1, 20_001), 4))[order, :, 1]
    low = x.min() - 1.0
    high = (x.max() + excess * low) / (1 + excess)  # x.max() - high is excess (high - low)
    limits = {"base": "none", kind: {free.scene.robot.joint_names[1]: [low, high]}}
    return problem_of("two_link", GRIDS["one scheme"], limits), path


@pytest.mark.parametrize("kind", ["q", "v", "a"])
def test_refined_rows_come_as_near_to_the_curve_as_the_barrier_asks_for(kind: str) -> None:
    problem, path = limited(-1e-5, kind)
    rows = rows_of(problem)
    outside = float((rows.values(path) - rows.bounds[1]).max())
    before = np.inf
    for level in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8):
        rows.refine(path, level)
        y, (lower, upper) = rows.values(path), rows.bounds
        gap = float((y - upper).max()) + 1e-5
        assert (y > lower).all()
        assert -1e-12 <= gap <= min(before + 1e-12, max(2 * level, LEAST_GAP, outside))
        before = gap
    assert gap <= 1e-5
    assert rows.refine(path, 1e-8) is None


def test_motions_far_from_their_limits_are_left(two_link: hovi.Robot) -> None:
    problem = problem_of("two_link", GRIDS["one scheme"], LIMITS | {"v": 50.0, "a": 1e5})
    rows, path = rows_of(problem), wavy(problem, 0.01)
    assert rows.refine(path, 1e-9) is None


def test_fixed_rows_are_not_refined() -> None:
    problem, path = limited(-1e-5)
    rows = rows_of(problem)
    assert rows.fixed_on(problem.grid).refine(path, 1e-3) is None
    assert rows.copied().refine(path, 1e-3) is not None
    assert rows.size == rows_of(problem).size


@each_grid
def test_refinement_keeps_rows_and_tells_at_whose_place_new_ones_are(grid: Grid) -> None:
    problem = problem_of("two_link", grid, {"base": "none", "q": 0.8, "v": 3.0, "a": 30.0})
    path = wavy(problem, 0.03)
    rows = rows_of(problem)
    before, places = rows.values(path), positions(rows)
    found = rows.refine(path, 1e-3)
    assert found is not None
    first = len(found.kept)
    assert 0 < first < len(before) < rows.size
    np.testing.assert_allclose(rows.values(path)[:first], before[found.kept], rtol=1e-12)
    np.testing.assert_allclose(positions(rows)[:first], places[found.kept])
    assert len(found.origin) == rows.size - first
    known = found.origin >= 0
    np.testing.assert_allclose(positions(rows)[first:][known], places[found.origin[known]])
    assert not np.isin(found.origin[known], found.kept).any()
    assert known.sum() == len(before) - first


def positions(rows: LimitRows) -> Array:
    """Interval, order, joint and relative time of every row."""
    degree = 2 * rows.grid.order - 1 + rows.grid.inner_modes - rows.orders
    part, i = rows._rows.part, rows._rows.number
    s = rows.parts.left[part] + rows.parts.width[part] * i / degree
    return np.stack([rows.intervals, rows.orders, rows.joints, s], axis=1)


def test_on_another_grid_the_rows_have_the_same_parts() -> None:
    problem, path = limited(-1e-5)
    rows = rows_of(problem)
    rows.refine(path, 1e-4)
    fine = Grid(STEPS, (galerkin(5),) * 4)
    other = rows.on(fine)
    assert other.grid is fine
    assert len(other.parts) == len(rows.parts)
    assert other.size > rows.size
    back = other.on(problem.grid)
    np.testing.assert_allclose(np.sort(back.values(path)), np.sort(rows.values(path)), rtol=1e-12)


def test_rows_keep_their_order_when_time_is_stretched() -> None:
    problem, path = limited(-1e-5)
    rows = rows_of(problem)
    rows.refine(path, 1e-4)
    longer = rows.on(problem.grid.stretched(2.0 * problem.grid.duration))
    np.testing.assert_array_equal(positions(longer), positions(rows))
    slower = 2.0 ** -rows.orders.astype(float)
    np.testing.assert_allclose(longer._regular, rows._regular * slower[:, None], rtol=1e-12)


def test_rows_of_segments_have_the_bounds_of_their_interval(two_link: hovi.Robot) -> None:
    parts = [as_limits(two_link, {"base": "none", "v": v}) for v in (2.0, 1.0)]
    limits = Limits.of_segments(parts, [0.5])
    problem = problem_of("two_link", GRIDS["one scheme"])
    rows = LimitRows(problem.grid, limits, None)
    lower, upper = rows.bounds
    expected = np.where(rows.intervals < 2, 2.0, 1.0)  # the second segment begins at 0.5 s
    ranges = rows.of.ranges[rows.coordinate]
    np.testing.assert_allclose(upper * ranges, expected)
    np.testing.assert_allclose(lower * ranges, -expected)


def test_where_limits_change_both_intervals_bound_the_node(two_link: hovi.Robot) -> None:
    """Elsewhere the control point at a node has one row, of the interval before."""
    parts = [as_limits(two_link, {"base": "none", "v": v}) for v in (2.0, 1.0)]
    problem = problem_of("two_link", GRIDS["one scheme"])
    same = rows_of(problem_of("two_link", GRIDS["one scheme"], {"base": "none", "v": 2.0}))
    free = np.ones((2, 2, 2), dtype=bool)
    rows = LimitRows(problem.grid, Limits.of_segments(parts, [0.5]), None, free)
    assert rows.size == same.size + 2
    at_node = positions(rows)[:, 3] == 0.0
    assert sorted(rows.intervals[at_node]) == [0, 0, 2, 2]
    faster = plan_sequence(
        Scene(two_link, [hovi.effects.Gravity()]),
        [0.0, 0.0],
        [
            hovi.Segment(None, 0.5, limits=parts[0]),
            hovi.Segment([0.9, 0.9], 0.5, limits=parts[1]),
        ],
    )
    assert faster.success, faster.message
    t = np.linspace(0.5 + 1e-9, 1.0, 2000)
    assert np.abs(faster.trajectory.sample(t).v).max() <= 1.0 + 2e-6


def test_motions_of_order_3_have_rows_of_the_jerk(two_link: hovi.Robot) -> None:
    grid = Grid(STEPS, (galerkin(3, 3),) * 4)
    limits = as_limits(two_link, {"base": "none", "v": 1.0, "a": 3.0, "jerk": 20.0}, 3)
    ld = DiscreteLagrangian(hovi.spline(2, 3), grid)
    problem = TrajectoryProblem(ld, State([0.0, 0.1]), State([1.0, -0.5]), limits=limits)
    path = problem.guess("cubic")
    random = np.random.default_rng(1)
    path = dataclasses.replace(path, inner=3.0 * random.normal(size=path.inner.shape))
    rows = LimitRows(grid, limits, None)
    assert set(rows.of.order) == {1, 2, 3}
    found, value = sampled_values(problem, rows, path), rows.values(path)
    np.testing.assert_allclose(value, found, rtol=1e-9, atol=1e-10)
    y, (lower, upper) = value, rows.bounds
    assert np.maximum(y - upper, lower - y).max() >= excess_by_sampling(problem, path).max() > 0


def test_stretched_rows_are_those_on_the_stretched_grid() -> None:
    problem, path = limited(-1e-5)
    rows = rows_of(problem)
    rows.refine(path, 1e-4)
    longer = problem.grid.stretched(1.7 * problem.grid.duration)
    stretched, built = rows.stretched(longer), rows.on(longer)
    assert stretched.grid is longer
    assert np.allclose(stretched.values(path), built.values(path), rtol=1e-12, atol=0)
    assert np.allclose(stretched.columns("nodal"), built.columns("nodal"), rtol=1e-12, atol=1e-15)
    assert np.allclose(stretched.weights, built.weights, rtol=1e-14)
    data = stretched._data(path)
    beyond = (push_rows(each, each._beyond, data) for each in (stretched, built))
    assert np.allclose(*beyond, rtol=1e-12, atol=1e-15)
