"""The transcription with limits: kernels, bounds, and the minima of hovi's solver."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

from hovi.accuracy.peers.collocation import Collocation
from hovi.accuracy.peers.collocation_table import collocation_table, with_points
from hovi.accuracy.peers.limited_program import LimitedKernels, LimitedProgram, limited_kernels
from hovi.accuracy.peers.point_program import compiled_functions
from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import Grid
from hovi.discrete.guess import cubic
from hovi.discrete.state import State
from hovi.dynamics.symbolic_dynamics import casadi_functions
from hovi.errors import SchemeError
from hovi.planning.problem.limits import as_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.scene.scene import Scene
from hovi.schemes import galerkin
from oracles.on_grid import solve_on_grid

Array = npt.NDArray[np.float64]

INTERVALS = 8
LIMITS = {
    "base": "none",
    **{
        kind: {"elbow": bound}
        for kind, bound in (("q", 2.5), ("v", 7.0), ("a", 80.0), ("tau", 7.0))
    },
}
"""Every one is active in the reach."""


@pytest.fixture(scope="module")
def kernels(arm_scene: Scene) -> LimitedKernels:
    return limited_kernels(casadi_functions(arm_scene.model).inverse_dynamics)


def reach(scene: Scene, points: int | None = None) -> TrajectoryProblem:
    grid = Grid.uniform(1.0, INTERVALS, galerkin(1, points=points))
    ld = DiscreteLagrangian(scene.effort_lagrangian(), grid)
    limits = as_limits(scene.robot, LIMITS)
    ends = State([-np.pi / 2, 0.0]), State([0.3, 0.7], [0.5, -0.4])
    return TrajectoryProblem(ld, *ends, limits=limits)


def discrete(
    problem: TrajectoryProblem, samples: tuple[float, ...] = ()
) -> tuple[LimitedProgram, Collocation]:
    """The problem's own discretisation, with limits at further samples of every interval."""
    scheme, limits = problem.grid.schemes[0], problem.limits
    assert limits is not None
    s = np.append(scheme.points, samples)
    weights = np.append(scheme.weights, np.zeros(len(samples)))
    table = with_points(collocation_table("lg-3"), s, weights)
    collocation = Collocation(table, INTERVALS, problem.grid.duration, 2)
    return LimitedProgram(collocation.program, limits.lower, limits.upper), collocation


def ipopt(
    problem: TrajectoryProblem, kernels: LimitedKernels, samples: tuple[float, ...] = ()
) -> tuple[float, Array]:
    """The cost and the unknowns that Ipopt finds."""
    program, collocation = discrete(problem, samples)
    guess = cubic(problem.robot, problem.ends, problem.grid.duration)
    w = collocation.unknowns(guess, problem.ends)
    free = np.where(collocation.fixed[:, None], 0.0, np.inf)
    ends = {"lbx": (w - free).ravel(), "ubx": (w + free).ravel()}
    solver = program.solver(kernels)
    found = solver(x0=w.ravel(), **ends, **program.bounds)
    assert solver.stats()["success"], solver.stats()["return_status"]
    return float(found["f"]), found["x"].full().ravel()


def test_kernels_have_the_torques_and_derivatives_of_pinocchio(
    kernels: LimitedKernels, arm_scene: Scene
) -> None:
    model, n = arm_scene.model, 2
    q, v, a, multipliers = np.random.default_rng(0).uniform(-1, 1, (4, n))
    p, s = np.concatenate([q, v, a]), 0.7
    L, slope, tau, J = (np.array(x) for x in kernels.first(p))
    data = model.createData()
    exact = pin.rnea(model, data, q, v, a)
    np.testing.assert_allclose(tau.ravel(), exact, rtol=1e-12)
    derivatives = np.hstack(pin.computeRNEADerivatives(model, data, q, v, a))
    np.testing.assert_allclose(J, derivatives, atol=1e-12)
    np.testing.assert_allclose(L, exact @ exact / 2, rtol=1e-12)
    np.testing.assert_allclose(slope.ravel(), derivatives.T @ exact, atol=1e-11)
    np.testing.assert_allclose(
        [x.full().ravel()[0] for x in kernels.value(p)], [L[0, 0], tau[0, 0]]
    )

    def gradient(p: Array) -> Array:
        _, slope, _, J = (x.full() for x in kernels.first(p))
        return np.asarray(s * slope.ravel() + J.T @ multipliers)

    step = 1e-5
    numbers = [
        (gradient(p + step * e) - gradient(p - step * e)) / (2 * step) for e in np.eye(3 * n)
    ]
    np.testing.assert_allclose(kernels.second(p, s, multipliers).full(), numbers, atol=1e-7)


def test_compiled_kernels_equal_interpreted_ones(kernels: LimitedKernels, tmp_path: Path) -> None:
    compiled = kernels.passed_through(lambda functions: compiled_functions(functions, tmp_path))
    p, s, multipliers = np.split(np.random.default_rng(1).uniform(-1, 1, 9), [6, 7])
    for name, arguments in (("value", [p]), ("first", [p]), ("second", [p, s, multipliers])):
        ours, theirs = (getattr(each, name)(*arguments) for each in (kernels, compiled))
        assert getattr(compiled, name).is_a("External")
        pairs = zip(ours, theirs, strict=True) if isinstance(ours, tuple) else [(ours, theirs)]
        for a, b in pairs:
            np.testing.assert_allclose(b.full(), a.full(), rtol=1e-10, atol=1e-10)


def test_assembled_derivatives_are_those_of_the_cost_and_the_constraints(
    kernels: LimitedKernels, arm_scene: Scene
) -> None:
    program, collocation = discrete(reach(arm_scene), (0.5,))
    solver, random = program.solver(kernels), np.random.default_rng(2)
    w = random.uniform(-1, 1, 2 * collocation.rows)
    first, jacobian = (solver.get_function(name) for name in ("nlp_grad_f", "nlp_jac_g"))
    multipliers, s = random.uniform(-1, 1, program.bounds["lbg"].shape), 0.7

    def values(w: Array) -> Array:
        return np.append(first(w, [])[0].full(), jacobian(w, [])[0].full())

    def slope(w: Array) -> Array:
        return (s * first(w, [])[1] + jacobian(w, [])[1].T @ multipliers).full().ravel()

    H = solver.get_function("nlp_hess_l")(w, [], s, multipliers).full()
    for column, e in enumerate(np.eye(len(w))):
        step = 1e-5 * e
        change = (values(w + step) - values(w - step)) / 2e-5
        exact = np.append(first(w, [])[1].full()[column], jacobian(w, [])[1].full()[:, column])
        np.testing.assert_allclose(exact, change, rtol=1e-6, atol=1e-5)
        bent = (slope(w + step) - slope(w - step)) / 2e-5
        exact = np.append(H[:column, column], H[column, column:])
        np.testing.assert_allclose(exact, bent, rtol=1e-6, atol=1e-5)


SAMPLES = tuple(np.linspace(0.0, 1.0, 25).tolist())
"""Between the points of an interval."""


def test_the_cost_is_that_of_torques_at_the_points(
    kernels: LimitedKernels, arm_scene: Scene
) -> None:
    """h sum w 1/2 |tau|^2 by pin.rnea, of the motion that Ipopt finds."""
    problem = reach(arm_scene)
    cost, w = ipopt(problem, kernels)
    program, _ = discrete(problem)
    q, v, a = np.array(program.program.points @ w).reshape(-1, 3, 2).swapaxes(0, 1)
    model = arm_scene.model
    data = model.createData()
    tau = np.array([pin.rnea(model, data, *jet) for jet in zip(q, v, a, strict=True)])
    weights = np.tile(problem.grid.schemes[0].weights, INTERVALS) * problem.grid.steps[0]
    assert cost == pytest.approx(float(weights @ np.vecdot(tau, tau)) / 2, rel=1e-12)


@pytest.mark.parametrize(("points", "near"), [(None, 4e-3), (6, 1e-4)])
def test_ipopt_finds_the_minimum_of_the_solver(
    points: int | None, near: float, kernels: LimitedKernels, arm_scene: Scene
) -> None:
    """Limits at the points alone cost less than limits at all times; at many samples, as much."""
    problem = reach(arm_scene, points)
    limits = problem.limits
    assert limits is not None
    at_points, everywhere = (ipopt(problem, kernels, samples)[0] for samples in ((), SAMPLES))
    found = solve_on_grid(problem)
    assert found.success, found.message
    assert at_points <= everywhere * (1 + 1e-8)
    free = dataclasses.replace(problem, limits=limits.without("v", "a", "tau"))
    assert everywhere > 1.01 * solve_on_grid(free).cost
    assert everywhere * (1 - 1e-6) <= found.cost <= everywhere * (1 + near)


def test_limits_hold_at_samples_of_no_weight(kernels: LimitedKernels, arm_scene: Scene) -> None:
    problem, samples = reach(arm_scene), (0.0, 0.3, 0.5, 0.9)
    limits = problem.limits
    assert limits is not None
    excess, costs = [], []
    for more in ((), samples):
        cost, w = ipopt(problem, kernels, more)
        every = discrete(problem, samples)[0].program.points
        q, v, a = np.array(every @ w).reshape(-1, 3, 2).swapaxes(0, 1)
        tau = arm_scene.inverse_dynamics(q, v, a)
        excess.append(float(limits.excess(np.stack([q, v, a, tau], axis=1)).max()))
        costs.append(cost)
    assert excess[0] > 1e-3
    assert excess[1] < 1e-7
    assert costs[1] > costs[0]


def test_tables_with_accelerations_at_the_nodes_keep_their_points() -> None:
    with pytest.raises(SchemeError, match="quadrature points at the nodes"):
        with_points(collocation_table("trapezoidal"), np.array([0.5]), np.ones(1))
