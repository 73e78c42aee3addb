"""Costs that are flat, undefined somewhere, or wrong: minima where there are, and no others."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest
from scipy.integrate import quad

import hovi
from hovi.discrete.state import State
from hovi.schemes import galerkin
from samples.joint_lagrangian import JointLagrangian

Array = npt.NDArray[np.float64]

Q, V, A = (ca.SX.sym(name) for name in "qva")


def problem_of(
    cost: ca.SX, start: float = 0.0, goal: float = 1.0, T: float = 1.0, intervals: int = 16
) -> hovi.TrajectoryProblem:
    L = hovi.CasadiLagrangian([Q, V, A], cost)
    ld = hovi.DiscreteLagrangian(L, hovi.Grid.uniform(T, intervals, galerkin(2)))
    return hovi.TrajectoryProblem(ld, State([start]), State([goal]))


def test_a_cost_that_is_flat_at_its_minimum_is_solved_all_the_same() -> None:
    """1/4 a^4: a^3 is linear in time and vanishes half way, where no curvature is left."""
    unit = quad(lambda t: (1 - t) * np.cbrt(1 - 2 * t), 0, 1, points=[0.5])[0]
    known = quad(lambda t: np.cbrt(1 - 2 * t) ** 4, 0, 1, points=[0.5])[0] / (4 * unit**4)
    found = hovi.solve(problem_of(A**4 / 4))
    assert found.n_neg == 0, found.message
    assert found.cost == pytest.approx(known, rel=1e-3)
    assert found.nit <= 60


def test_steps_to_where_the_cost_is_undefined_are_not_taken() -> None:
    """1/2 a^2 - 400 log q from 0.02 back to it: the best motion swings high."""
    problem = problem_of(A**2 / 2 - 400 * ca.log(Q), 0.02, 0.02)
    found = hovi.solve(problem)
    assert found.success, found.message
    assert found.n_neg == 0
    t = np.linspace(0.0, 1.0, 2001)
    q = found.trajectory.sample(t).q[:, 0]
    assert q.min() > 0.0199
    momenta = found.trajectory.momenta[:, :, 0]  # p' = dL/dq = -400 / q
    middle = 0.5 * (found.trajectory.t[1:] + found.trajectory.t[:-1])
    force = -400 / found.trajectory.sample(middle).q[:, 0]
    slope = np.diff(momenta[:, 0]) / np.diff(found.trajectory.t)
    np.testing.assert_allclose(slope[4:-4], force[4:-4], rtol=0.05)


@pytest.mark.parametrize("cost", [-(A**4), A**2 / 2 - 60 * V**2, A**3, -ca.exp(A)], ids=str)
def test_a_cost_without_a_lower_bound_has_no_minimum(cost: ca.SX) -> None:
    with np.errstate(over="ignore", invalid="ignore"):
        found = hovi.solve(problem_of(cost), max_iterations=60)
    assert not found.success
    assert found.status in ("iteration_limit", "diverged", "unresolved", "saddle")


@dataclass(frozen=True, eq=False)
class Wrong(JointLagrangian):
    """1/2 |a|^2 and a constant, with derivatives that are multiplied by a factor of each."""

    factors: tuple[float, float] = (1.0, 1.0)
    after: float = 0.0
    """Of |a|: below, derivatives are right."""

    def value(self, *jet: Array, t: Array | None = None) -> Array:
        return 1.0 + np.sum(jet[2] ** 2, axis=1) / 2

    def evaluate(self, *jet: Array, t: Array | None = None) -> tuple[Array, Array, Array]:
        (P, n), a = jet[2].shape, jet[2]
        gradient, hessian = np.zeros((P, 3, n)), np.zeros((P, 3, n, 3, n))
        wrong = np.abs(a).max() > self.after
        first, second = self.factors if wrong else (1.0, 1.0)
        gradient[:, 2] = first * a
        hessian[:, 2, range(n), 2, range(n)] = second
        return self.value(*jet), gradient, hessian


def solved(factors: tuple[float, float], **options: Any) -> hovi.Solution:
    scene = hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")))
    ld = hovi.DiscreteLagrangian(Wrong(scene, factors), hovi.Grid.uniform(1.0, 8, galerkin(2)))
    problem = hovi.TrajectoryProblem(ld, State([0.0, 0.0]), State([1.0, -0.5]))
    return hovi.solve(problem, guess(problem), **options)


def guess(problem: hovi.TrajectoryProblem) -> hovi.DiscretePath:
    """Away from the solution, which the cubic is."""

    def curve(t: Array) -> tuple[Array, Array, Array]:
        s, goal = t[:, None], np.array([1.0, -0.5])
        q = goal * s + 0.3 * np.sin(3 * np.pi * s)
        w = 3 * np.pi
        return q, goal + 0.3 * w * np.cos(w * s), 0 * goal - 0.3 * w**2 * np.sin(w * s)

    return problem.path(curve)


def test_right_derivatives_lead_to_the_cubic() -> None:
    found = solved((1.0, 1.0))
    assert found.success, found.message
    assert found.cost == pytest.approx(1.0 + 6 * 1.25, rel=1e-12)
    assert found.nit <= 6


@pytest.mark.parametrize(
    "factors", [(-1.0, 1.0), (np.nan, 1.0), (1.0, np.nan), (np.inf, 1.0)], ids=str
)
def test_derivatives_that_are_wrong_or_no_numbers_end_without_a_minimum(
    factors: tuple[float, float],
) -> None:
    with np.errstate(invalid="ignore"):
        found = solved(factors)
    assert found.status == "diverged"
    assert np.isfinite(found.trajectory.q).all()
    assert np.isfinite(found.cost)


@pytest.mark.parametrize("factor", [0.6, 4.0])
def test_a_curvature_that_is_wrong_costs_steps_alone(factor: float) -> None:
    found = solved((1.0, factor))
    assert found.success, found.message
    assert found.cost == pytest.approx(1.0 + 6 * 1.25, rel=1e-9)
