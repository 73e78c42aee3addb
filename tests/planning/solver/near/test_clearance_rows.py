"""Rows of distances, against sampled trajectories and finite differences."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt
import pytest

import hovi
from hovi.discrete.grid import DiscretePath
from hovi.planning.clearance.clearance import DISTANCE_SCALE, Clearance
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.search.job import Job
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.near.approaches import (
    AROUND,
    TOUCHING,
    USED,
    Approaches,
    approaches_along,
)
from hovi.planning.solver.near.clearance_rows import (
    BESIDE,
    LEAST_ROUNDING,
    MOST_INFLATION,
    MOST_ROUNDING,
    ROUNDED_SHARE,
    ClearanceRows,
)
from hovi.planning.solver.solver import guess_path
from hovi.scene.scene import Scene

Array = npt.NDArray[np.float64]

FAR_BALL = hovi.Sphere([0.0, 0.0, 1.85], 0.1, name="far")
LEAST = 0.05
ROBOTS = "ur5", "kinova"
"""One on a vector space, one with continuous joints."""


def problem_of(name: str, *balls: hovi.Sphere) -> TrajectoryProblem:
    robot = hovi.load_robot(name)
    start = robot.space.integrate(robot.neutral(), np.full(robot.nv, 0.2))
    goal = robot.space.integrate(start, np.linspace(0.8, -0.4, robot.nv))
    grid = hovi.Grid.uniform(1.0, 5, hovi.schemes.galerkin(2))
    job = Job(Scene(robot, []), grid, hovi.State(start), hovi.State(goal))
    problem = job.problem()
    if not balls:
        middle = problem.trajectory(guess_path(problem, "cubic")).configurations(np.array([0.5]))
        tip = robot.frame_position(robot.tip_frames[0], middle)[0]
        balls = hovi.Sphere(tip + np.array([0.0, 0.0, 0.16]), 0.06, name="ball"), FAR_BALL
    return dataclasses.replace(problem, clearance=Clearance(balls))


def wavy(problem: TrajectoryProblem, seed: int = 5) -> DiscretePath:
    """The cubic guess, displaced at random."""
    objective = ActionObjective(problem)
    x = guess_path(problem, "cubic")
    model = objective.model(x, None, None)
    return objective.retract(x, 0.02 * model.random_vector(seed), model)


def rows_of(problem: TrajectoryProblem, path: DiscretePath, ahead: float) -> ClearanceRows:
    assert problem.distances is not None
    rows = ClearanceRows(problem, problem.distances, LEAST)
    rows.extend(problem, path, ahead)
    return rows


@pytest.mark.parametrize("name", ROBOTS)
def test_rows_are_distances_along_the_motion(name: str) -> None:
    problem = problem_of(name)
    path = wavy(problem)
    rows = rows_of(problem, path, 0.2)
    assert rows.size > 10
    assert problem.distances is not None
    t = problem.grid.t[rows.intervals] + rows.positions * problem.grid.steps[rows.intervals]
    d = problem.distances.values(problem.trajectory(path).configurations(t))
    expected = (d[np.arange(rows.size), rows.pairs] - LEAST) / DISTANCE_SCALE
    near = expected < 1.0  # beyond, rows level off
    assert near.sum() > 10
    loss = (expected - rows.values(path))[near]  # of rounded shapes, the less the nearer
    assert loss.min() >= -1e-9
    assert (loss <= MOST_INFLATION * rows.rounding[near] / DISTANCE_SCALE).all()
    assert (rows.values(path)[~near] >= 0.9).all()


@pytest.mark.parametrize("name", ROBOTS)
def test_shapes_are_rounded_less_the_nearer_a_row_is_to_its_bound(name: str) -> None:
    problem = problem_of(name)
    path = wavy(problem)
    rows = rows_of(problem, path, 0.2)
    y, size = rows.values(path), rows.rounding
    assert size.min() >= LEAST_ROUNDING
    assert size.max() <= MOST_ROUNDING
    assert (size <= np.maximum(ROUNDED_SHARE * DISTANCE_SCALE * 3.0 * y, LEAST_ROUNDING)).all()
    assert not rows.sharpen(path)  # nothing has come nearer
    rows._round(np.full(rows.size, MOST_ROUNDING))
    coarse = rows.values(path)
    assert rows.sharpen(path)
    sharper = rows.rounding < MOST_ROUNDING
    assert sharper.any()
    assert (rows.values(path)[sharper] >= coarse[sharper] - 1e-12).all()
    assert (rows.rounding[~sharper] == MOST_ROUNDING).all()


def test_rows_beside_a_new_one_are_those_of_its_pair_nearby() -> None:
    problem = problem_of("ur5")
    path = wavy(problem)
    rows = rows_of(problem, path, 0.2)
    at, pair = rows.intervals + rows.positions, rows.pairs
    k = int(np.argmax(pair == pair[0]))
    found = Approaches(np.array([at[k] + 0.1]), pair[[k]], np.zeros(1, dtype=bool))
    new, beside = rows._beside(found)
    assert (new == rows.size).all()
    apart = np.abs(at - found.at[0])
    expected = np.flatnonzero((pair == pair[k]) & (apart <= BESIDE))
    np.testing.assert_array_equal(np.sort(beside), expected)
    assert k in beside


@pytest.mark.parametrize("name", ROBOTS)
def test_derivatives_are_those_of_finite_differences(name: str) -> None:
    problem = problem_of(name)
    objective = ActionObjective(problem)
    path = wavy(problem)
    model = objective.model(path, None, None)
    rows = rows_of(problem, path, 0.2)
    force = np.random.default_rng(3).normal(size=rows.size)
    expanded = rows.expanded(path, force, objective.coordinates)
    step, h = model.random_vector(7), 1e-5
    columns = model.gather(step)
    moved = [rows.values(objective.retract(path, s * step, model)) for s in (h, -h)]
    pushed = expanded.push(columns)
    np.testing.assert_allclose(pushed, (moved[0] - moved[1]) / (2 * h), atol=1e-5)
    gradient = np.zeros_like(model.intervals.gradient)
    expanded.pull(force, gradient)
    assert np.vdot(gradient, columns) == pytest.approx(float(force @ pushed), rel=1e-9)
    if name == "kinova":  # its hulls have small faces, at whose edges there are no second ones
        return
    hessian = np.zeros_like(model.intervals.hessian)
    weights = np.random.default_rng(4).uniform(size=rows.size)
    expanded.add_squares(weights, hessian)
    square = float(np.einsum("kia,kijab,kjb", columns, hessian, columns))
    near = [objective.retract(path, s * step, model) for s in (1e-4, -1e-4)]
    bend = force @ (rows.values(near[0]) + rows.values(near[1]) - 2 * rows.values(path)) / 1e-8
    assert square == pytest.approx(float(weights @ pushed**2 + bend), rel=1e-2)


def test_pairs_that_stay_far_have_no_rows() -> None:
    problem = problem_of("ur5", FAR_BALL)
    assert rows_of(problem, wavy(problem), 0.5).size == 0


def test_least_distances_are_found_between_the_samples() -> None:
    problem = problem_of("ur5")
    path = wavy(problem)
    assert problem.distances is not None
    t = np.linspace(0.0, 1.0, 20_001)
    d = problem.distances.values(problem.trajectory(path).configurations(t))
    pair = int(d.min(axis=0).argmin())
    inner = int(d[:, pair].argmin())
    least = float(d[inner, pair])
    found = approaches_along(problem, path, problem.distances, least + 1e-3, 0.0)
    assert found.nearest == pytest.approx(least, abs=1e-3)
    assert 0 < inner < len(t) - 1
    times = found.at[found.pairs == pair] / problem.grid.intervals
    assert np.abs(times - t[inner]).min() < 1e-3


def test_a_second_look_at_the_same_motion_adds_nothing() -> None:
    problem = problem_of("ur5")
    path = wavy(problem)
    rows = rows_of(problem, path, 0.1)
    assert rows.extend(problem, path, 0.1) == 0
    assert rows.hidden_depth(path) <= 0.0


@pytest.mark.parametrize("name", ROBOTS)
def test_what_is_known_of_earlier_motions_holds_after_rows_were_added_and_sharpened(
    name: str,
) -> None:
    problem = problem_of(name)
    paths = [wavy(problem, seed) for seed in range(4)]
    rows = rows_of(problem, paths[0], 0.15)
    first = rows.size
    for path in paths[1:]:
        rows.values(path)
        rows.hidden_depth(path)
    assert rows.extend(problem, paths[1], 0.5) > 0
    rows._round(np.where(np.arange(rows.size) % 2 == 0, rows.rounding, LEAST_ROUNDING))
    fresh = rows.on(dataclasses.replace(problem))  # which shares nothing
    fresh._normals[:] = 0.0
    assert rows.size > first
    for path in paths:
        assert np.allclose(rows.values(path), fresh.values(path), atol=1e-9)
        assert np.isclose(rows.hidden_depth(path), fresh.hidden_depth(path), atol=1e-9)


@pytest.mark.parametrize("name", ROBOTS)
def test_curvature_without_its_negative_part_is_the_nearest_convex_one(name: str) -> None:
    problem = problem_of(name)
    path = wavy(problem)
    rows = rows_of(problem, path, 0.2)
    force = np.random.default_rng(0).uniform(-1.0, 0.5, rows.size)
    expanded = rows.expanded(path, force, "nodal")
    convex = expanded.without_negative_curvature()
    assert convex is not None
    size = np.abs(expanded.curvature).max()
    values = np.linalg.eigvalsh(expanded.curvature)
    assert values.min() < -1e-3 * size
    assert np.linalg.eigvalsh(convex.curvature).min() >= -1e-12 * size
    rest = np.linalg.eigvalsh(convex.curvature - expanded.curvature)
    expected = np.sort(np.maximum(-values, 0.0), axis=1)
    assert np.allclose(rest, expected, atol=1e-12 * size)
    assert convex.without_negative_curvature() is None
    no_numbers = dataclasses.replace(expanded, curvature=np.nan * expanded.curvature)
    assert no_numbers.without_negative_curvature() is None


def test_thinned_rows_are_those_of_near_pairs() -> None:
    problem = problem_of("ur5")
    path = wavy(problem)
    rows = rows_of(problem, path, 0.2)
    rows.order = np.arange(rows.size)[::-1]  # no rows of limits, the last row first
    within = 1.001 * float(np.median(rows.values(path))) * DISTANCE_SCALE
    near, kept = rows.thinned(path, within)
    ordered = rows.values(path)[rows.order]
    np.testing.assert_allclose(ordered[kept], near.values(path), atol=1e-12)
    assert (near.values(path) <= within / DISTANCE_SCALE).all()
    assert 0 < near.size < rows.size


@pytest.mark.parametrize(("share", "wanted"), [(-1.0, True), (0.5, False), (2.0, True)])
def test_what_a_motion_may_use_up_between_rows_gets_none(share: float, wanted: bool) -> None:
    """share: by how much it is too close, relative to what it may use up."""
    problem = problem_of("ur5")
    path, distances = wavy(problem), problem.distances
    assert distances is not None
    t = np.linspace(0.0, problem.grid.duration, 20_001)
    nearest = float(distances.values(problem.trajectory(path).configurations(t)).min())
    found = approaches_along(problem, path, distances, nearest + share * USED, 0.0)
    assert (len(found.pairs) > 0) == wanted
    assert found.too_close.any() == (share > 1.0)


@pytest.mark.parametrize("name", ROBOTS)
def test_between_the_rows_around_a_touch_a_motion_cannot_dip_far(name: str) -> None:
    """A curve through two of them with the curvature of the distance, by differences of its own."""
    problem = problem_of(name)
    path, distances = wavy(problem), problem.distances
    assert distances is not None
    motion, steps = problem.trajectory(path), problem.grid.steps
    t = np.linspace(0.0, problem.grid.duration, 20_001)
    d = distances.values(motion.configurations(t))
    i, pair = np.unravel_index(int(d.argmin()), d.shape)
    touch = t[i] / steps[0]  # equal intervals
    bend = (d[i - 400, pair] - 2.0 * d[i, pair] + d[i + 400, pair]) / (t[400] / steps[0]) ** 2
    found = approaches_along(problem, path, distances, float(d[i, pair]) - 1e-5, 0.0)
    own = np.sort(found.at[found.pairs == pair])
    around = own[np.abs(own - touch) <= AROUND]
    assert len(around) >= 5
    assert around[0] < touch - 0.5 * AROUND
    assert around[-1] > touch + 0.5 * AROUND
    assert (bend * np.diff(around) ** 2 / 8.0 < USED).all()
    apart = approaches_along(problem, path, distances, float(d[i, pair]) - 2.0 * TOUCHING, 0.0)
    assert (apart.pairs == pair).sum() == 1  # the least distance alone
