"""Instants between quadrature points: their jets, and actions with forces at them."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt
import pytest

import hovi
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.instants import InstantBatch, Instants
from hovi.discrete.state import State
from hovi.errors import InputError
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.robot.loading import load_robot
from hovi.scene.lagrangian import PointTerms
from hovi.scene.scene import Scene
from hovi.schemes import by_name, galerkin
from oracles.path_steps import moved, random_step
from samples.manifold_robots import BASES, chain, configurations, with_arm

Array = npt.NDArray[np.float64]

WHERE = Instants(
    np.array([0, 0, 2, 2, 3]), np.array([0.0, 0.37, 0.5, 1.0, 0.81]), np.array([0.2, 1, 0.5, 2, 1])
)
STEPS = np.array([0.3, 0.2, 0.1, 0.4])
GRIDS = {
    "one scheme": Grid(STEPS, (galerkin(2),) * 4),
    "mixed schemes": Grid(
        STEPS, (galerkin(3), by_name("hermite-simpson"), galerkin(1), galerkin(3))
    ),
}
ROBOTS = "vector space", "continuous", "spherical", "free-flyer"
each_robot = pytest.mark.parametrize("name", ROBOTS)
each_grid = pytest.mark.parametrize("grid", GRIDS.values(), ids=GRIDS.keys())


def scene_of(name: str) -> Scene:
    if name == "vector space":
        return Scene(hovi.load_robot(hovi.example("two_link.urdf")), [hovi.effects.Gravity()])
    model = with_arm(name) if name == "continuous" else chain([BASES[name]()])
    return Scene(load_robot(model), [])


def problem_of(name: str, grid: Grid, instants: Instants | None = WHERE) -> TrajectoryProblem:
    """A reach with fixed ends; the motion moves in all coordinates."""
    scene = scene_of(name)
    robot, n = scene.robot, scene.robot.nv
    q0, q1 = configurations(robot, 2, seed=1, size=0.4)
    v0, v1 = 0.3 * np.random.default_rng(2).normal(size=(2, n))
    ld = DiscreteLagrangian(scene.effort_lagrangian(), grid, instants)
    return TrajectoryProblem(ld, State(q0, v0), State(q1, v1))


def wavy(problem: TrajectoryProblem) -> DiscretePath:
    """The cubic guess with nodes and inner modes displaced at random."""
    return moved(problem, problem.guess("cubic"), 0.1 * random_step(problem, 5))


def random_forces(problem: TrajectoryProblem, seed: int = 0) -> list[PointTerms]:
    """Forces on (q, v, a) at the instants alone, where torques are not evaluated."""
    ld, nv = problem.ld, problem.ld.lagrangian.nv
    random, first = np.random.default_rng(seed), len(ld.interval_batches)
    terms = []
    for i, batch in enumerate(ld.batches):
        P, size = len(batch.t), 3 * nv
        share = 0.0 if i < first else 1.0
        slope, force = share * random.normal(size=(P, size)), np.zeros((P, nv))
        terms.append(PointTerms(slope, np.zeros((P, size)), force, np.zeros((P, nv))))
    return terms


def work(problem: TrajectoryProblem, path: DiscretePath, reference: DiscretePath) -> float:
    """sum weights (slope . (q - q_reference, v, a) + force . tau), by Trajectory."""
    *_, terms = random_forces(problem)
    sample = problem.trajectory(path).sample_intervals(WHERE.intervals, WHERE.positions)
    origin = problem.trajectory(reference).sample_intervals(WHERE.intervals, WHERE.positions).q
    space = problem.ld.lagrangian.space
    dq = sample.q - origin if space is None else space.difference(origin, sample.q)
    jet = np.concatenate([dq, sample.v, sample.a], axis=1)
    each = np.vecdot(terms.jet_gradient, jet) + np.vecdot(terms.output_gradient, sample.tau)
    return float(WHERE.weights @ each)


@each_grid
@each_robot
def test_jets_at_instants_are_those_of_the_trajectory(name: str, grid: Grid) -> None:
    problem = problem_of(name, grid)
    path = wavy(problem)
    *_, found = problem.ld.jets(path)
    expected = problem.trajectory(path).jet_intervals(WHERE.intervals, WHERE.positions)
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-10, atol=1e-11)
    np.testing.assert_allclose(
        problem.ld.point_times[-1],
        grid.t[WHERE.intervals] + WHERE.positions * STEPS[WHERE.intervals],
    )
    np.testing.assert_array_equal(problem.ld.point_intervals[-1], WHERE.intervals)
    np.testing.assert_allclose(problem.ld.point_weights[-1], WHERE.weights)


@each_grid
@pytest.mark.parametrize("name", ["vector space", "continuous"])
def test_displacements_at_instants_lead_to_the_configurations_there(name: str, grid: Grid) -> None:
    problem = problem_of(name, grid)
    path = wavy(problem)
    batch = InstantBatch(grid, WHERE.intervals, WHERE.positions, WHERE.weights)
    found = problem.coordinates.integrate(path.q[WHERE.intervals], batch.displacements(path))
    q = problem.trajectory(path).jet_intervals(WHERE.intervals, WHERE.positions)[0]
    np.testing.assert_allclose(found, q, rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("order", [1, 3, 4])
def test_jets_at_instants_are_those_of_the_trajectory_for_other_orders(order: int) -> None:
    grid = Grid(STEPS, (galerkin(2, order),) * 4)
    ld = DiscreteLagrangian(hovi.spline(2, order), grid, WHERE)
    problem = TrajectoryProblem(ld, State([0.0, 0.1]), State([1.0, -0.5]))
    path = problem.guess("cubic")
    random = np.random.default_rng(order)
    path = dataclasses.replace(path, inner=random.normal(size=path.inner.shape))
    *_, found = ld.jets(path)
    expected = problem.trajectory(path).jet_intervals(WHERE.intervals, WHERE.positions, order)
    batch = InstantBatch(grid, WHERE.intervals, WHERE.positions, WHERE.weights)
    np.testing.assert_allclose(path.q[WHERE.intervals] + batch.displacements(path), expected[0])
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-11, atol=1e-11)


@each_grid
@each_robot
def test_instants_have_no_part_in_the_cost(name: str, grid: Grid) -> None:
    problem, plain = problem_of(name, grid), problem_of(name, grid, None)
    path = wavy(plain)
    assert problem.ld.action(path) == plain.ld.action(path)
    np.testing.assert_array_equal(problem.ld.values(path), plain.ld.values(path))
    one, other = problem.ld.expand(path), plain.ld.expand(path)
    for part in ("values", "gradient", "hessian"):
        expected = getattr(other, part)
        scale = np.abs(expected).max()
        np.testing.assert_allclose(getattr(one, part), expected, rtol=0, atol=1e-14 * scale)
    np.testing.assert_allclose(problem.ld.derivatives(path), plain.ld.derivatives(path), atol=1e-11)


@each_grid
@each_robot
def test_gradients_with_forces_at_instants_match_differences(name: str, grid: Grid) -> None:
    """Of the action and the forces' work, in the free unknowns of a path."""
    problem = problem_of(name, grid)
    path = wavy(problem)
    gradient = problem.ld.expand(path, terms=random_forces(problem)).gradient
    for seed in range(3):
        step = random_step(problem, seed)

        def value(share: float, step: Array = step) -> float:
            there = moved(problem, path, share * step)
            return problem.ld.action(there) + work(problem, there, path)

        h = 1e-3
        slope = (8 * (value(h) - value(-h)) - (value(2 * h) - value(-2 * h))) / (12 * h)
        assert float(np.vdot(gradient, step)) == pytest.approx(slope, rel=1e-6)


@each_robot
def test_weights_at_instants_are_squares_in_the_hessian(name: str) -> None:
    """With the same curvature of torques, the Hessian gains sum w sigma (dy)^2."""
    problem = problem_of(name, GRIDS["mixed schemes"])
    path, ld = wavy(problem), problem.ld
    parts = zip(ld.lagrangians, ld.jets(path), ld.point_times, strict=True)
    curvature = [L.output_slope(L.output(*jet, t=t)) for L, jet, t in parts]
    assert not curvature[-1].any()
    none = random_forces(problem)
    none = [PointTerms(*(np.zeros_like(x) for x in dataclasses.astuple(t)[:4])) for t in none]
    random = np.random.default_rng(3)
    last = none[-1]
    sigma = random.uniform(size=last.jet_gradient.shape)
    on_tau = np.zeros(last.output_gradient.shape)  # torques have no rows
    weighted = [*none[:-1], PointTerms(last.jet_gradient, sigma, last.output_gradient, on_tau)]
    step = random_step(problem, 4)

    def square(terms: list[PointTerms]) -> float:
        hessian = ld.expand(path, multipliers=curvature, terms=terms).hessian
        return float(np.einsum("kia,kijab,kjb->", step, hessian, step, optimize=True))

    gained = square(weighted) - square(none)
    h, k, s = 1e-4, WHERE.intervals, WHERE.positions

    def sampled(share: float) -> Array:
        there = moved(problem, path, share * step)
        q, v, a, tau = problem.trajectory(there).sample_intervals(k, s)
        origin = problem.trajectory(path).sample_intervals(k, s).q
        space = problem.ld.lagrangian.space
        dq = q - origin if space is None else space.difference(origin, q)
        return np.concatenate([dq, v, a, tau], axis=1)

    dy = (8 * (sampled(h) - sampled(-h)) - (sampled(2 * h) - sampled(-2 * h))) / (12 * h)
    expected = WHERE.weights @ np.vecdot(np.concatenate([sigma, on_tau], axis=1), dy**2)
    assert gained == pytest.approx(float(expected), rel=1e-7)


@each_robot
def test_momenta_with_forces_at_instants_are_derivatives(name: str) -> None:
    """D1 .. D4, and the gradient in the inner modes, are that of the expansion in any step."""
    problem = problem_of(name, GRIDS["one scheme"])
    path = wavy(problem)
    forces, ld = random_forces(problem), problem.ld
    gradient = ld.expand(path, terms=forces).gradient
    d = ld.derivatives(path, forces)
    np.testing.assert_allclose(
        ld.momenta(path, forces), np.concatenate([-d[:, :2], d[-1:, 2:]]), rtol=1e-14
    )
    for seed in range(3):
        step = random_step(problem, seed)
        ends = step[:, :4] / STEPS[:, None, None] ** np.array([0, 1, 0, 1])[:, None]
        inner = float(np.vdot(gradient[:, 4:], step[:, 4:]))
        nodal = float(np.vdot(d, ends))
        assert nodal + inner == pytest.approx(float(np.vdot(gradient, step)), rel=1e-9)


def test_duration_derivatives_count_the_work_at_instants() -> None:
    """S(T) with nodal q and v and inner modes scaled, with forces constant: by differences."""
    problem = problem_of("vector space", GRIDS["one scheme"])
    path = wavy(problem)
    *_, last = random_forces(problem)
    forces = random_forces(problem)
    found = problem.ld.duration_derivative(path, forces)
    plain = problem.ld.duration_derivative(path)
    T = problem.grid.duration

    def work_at(scale: float) -> float:
        """The forces' work for the same curve in relative time, at fixed nodal q and v."""
        steps = scale * STEPS
        h = steps[:, None]
        z0 = (path.q[1:] - path.q[:-1] - h * path.v[:-1]) / h**2
        z = np.stack([z0, np.diff(path.v, axis=0) / h], axis=1)
        inner = path.inner / scale**2
        moved = DiscretePath(path.q, path.v, z, inner)
        grid = Grid(steps, problem.grid.schemes)
        ld = DiscreteLagrangian(problem.ld.lagrangian, grid, WHERE)
        q, v, a = ld.jets(moved)[-1]
        tau = problem.scene.inverse_dynamics(q, v, a)
        x = np.concatenate([q, v, a], axis=1)
        each = np.vecdot(last.jet_gradient, x) + np.vecdot(last.output_gradient, tau)
        return float(WHERE.weights @ each)

    e = 1e-4
    slope = (8 * (work_at(1 + e) - work_at(1 - e)) - (work_at(1 + 2 * e) - work_at(1 - 2 * e))) / 12
    assert found - plain == pytest.approx(slope / e / T, rel=1e-7)


@pytest.mark.parametrize(
    ("k", "s", "w", "sentence"),
    [
        ([0, 1], [0.5], [1.0, 1.0], "positions"),
        ([0, 1], [0.5, 0.5], [1.0], "weights"),
        ([0, 1], [0.5, 1.5], [1.0, 1.0], "positions from 0 to 1"),
        ([0, 1], [0.5, np.nan], [1.0, 1.0], "positions from 0 to 1"),
        ([1, 0], [0.5, 0.5], [1.0, 1.0], "ascending intervals; sort them"),
    ],
)
def test_instants_that_do_not_fit_each_other_are_refused(
    k: list[int], s: list[float], w: list[float], sentence: str
) -> None:
    with pytest.raises(InputError, match=sentence):
        Instants(np.array(k), np.array(s), np.array(w))


@pytest.mark.parametrize("k", [-1, 4])
def test_instants_in_intervals_that_the_grid_does_not_have_are_refused(k: int) -> None:
    where = Instants(np.array([k]), np.array([0.5]), np.array([1.0]))
    ld = problem_of("vector space", GRIDS["one scheme"], where).ld
    with pytest.raises(InputError, match="intervals 0 to 3"):
        ld.batches  # noqa: B018


def test_no_instants_are_no_batch() -> None:
    none = Instants(np.zeros(0, dtype=np.intp), np.zeros(0), np.zeros(0))
    ld = problem_of("vector space", GRIDS["one scheme"], none).ld
    assert len(ld.batches) == len(ld.interval_batches)
