"""Moments of passive torques: projections, their squares, and grids of several schemes."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from numpy.polynomial import Legendre

import hovi
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.problem.torque_moments import TorqueMoments
from hovi.schemes import by_name

Array = npt.NDArray[np.float64]

STEPS = np.array([0.3, 0.5, 0.2])


def problem_with(*names: str, scene: str = "cart_pole_swing_up") -> TrajectoryProblem:
    """A short problem of a scene, on three intervals of one scheme or of three."""
    task = hovi.load_task(hovi.example(scene))
    schemes = tuple(by_name(name) for name in (names if len(names) == 3 else names * 3))
    ld = hovi.DiscreteLagrangian(task.scene.effort_lagrangian(), hovi.Grid(STEPS, schemes))
    return TrajectoryProblem(ld, task.start, task.goal)


def moments_with(name: str) -> TorqueMoments:
    moments = problem_with(name).torque_moments
    assert moments is not None
    return moments


def torques(name: str, degree: int) -> Array:
    """P_j(s) at the points of every interval, at the passive joint; ones at the other."""
    s = by_name(name).points
    hinge = np.tile(Legendre.basis(degree, domain=[0, 1])(s), len(STEPS))
    return np.stack([np.ones_like(hinge), hinge], axis=1)


@pytest.mark.parametrize(
    "name", ["galerkin-2", "taylor-midpoint", "taylor-trapezoid", "galerkin-0"]
)
def test_as_many_points_as_coefficients_need_no_moments(name: str) -> None:
    assert problem_with(name).torque_moments is None


def test_joints_with_motors_have_no_moments() -> None:
    assert problem_with("galerkin-2x8", scene="two_link_reach").torque_moments is None


@pytest.mark.parametrize(
    ("name", "modes"), [("galerkin-0x3", 0), ("galerkin-1x5", 1), ("galerkin-2x8", 2)]
)
def test_torques_of_low_degree_are_kept_and_others_vanish(name: str, modes: int) -> None:
    moments = moments_with(name)
    Q = len(by_name(name).points)
    for degree in range(Q):
        tau = torques(name, degree)
        kept = tau[:, moments.passive] if degree < modes + 2 else np.zeros((3 * Q, 1))
        np.testing.assert_allclose(moments.projected(tau, 0), kept, rtol=0, atol=1e-13)


def test_squares_are_integrals_of_squared_polynomials() -> None:
    name = "galerkin-2x8"
    tau = 2.0 * torques(name, 1) + 3.0 * torques(name, 2) + 5.0 * torques(name, 6)
    square = 4.0 / 3 + 9.0 / 5  # integrals of P_1^2 and P_2^2; P_6 is no moment
    found = moments_with(name).scaled(tau, 0)
    assert found @ found == pytest.approx(square * STEPS.sum(), rel=1e-13)


def test_moments_of_another_grid_are_its_own() -> None:
    problem = problem_with("galerkin-2x8")
    assert problem.torque_moments is not None
    assert problem.on(problem_with("galerkin-2").grid).torque_moments is None


def test_a_motion_on_several_schemes_is_near_that_on_each() -> None:
    task = hovi.load_task(hovi.example("cart_pole_swing_up"))
    names = ["galerkin-2", "galerkin-2x8", "galerkin-1x5", "galerkin-3"] * 10
    grid = hovi.Grid(np.full(40, task.duration / 40), tuple(by_name(name) for name in names))
    lagrangian = task.scene.effort_lagrangian()
    costs = []
    for each in (grid, hovi.Grid.uniform(task.duration, 40, by_name("galerkin-3"))):
        ld = hovi.DiscreteLagrangian(lagrangian, each)
        solution = hovi.solve(hovi.TrajectoryProblem(ld, task.start, task.goal))
        assert solution.success, solution.message
        costs.append(solution.cost)
    assert costs[0] == pytest.approx(costs[1], rel=2e-6)
