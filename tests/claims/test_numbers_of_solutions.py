"""Numbers of a solution beside closed forms: index, derivative, minima, effort, certificate."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import hovi
from samples.oscillating_lagrangian import HORIZONS, OscillatingLagrangian

FREE: dict[str, Any] = {"limits": "none", "self_collision": False}
DENSE = 20_001


@pytest.mark.parametrize(("T", "index"), HORIZONS.items())
def test_the_index_of_a_stationary_motion_is_that_of_its_conjugate_points(
    two_link: hovi.Robot, T: float, index: int
) -> None:
    """The second joint stays where its Lagrangian oscillates."""
    lagrangian = OscillatingLagrangian(hovi.Scene(two_link), (0.0, 1.0))
    ld = hovi.DiscreteLagrangian(lagrangian, hovi.Grid.uniform(T, 16, hovi.schemes.galerkin(2)))
    problem = hovi.TrajectoryProblem(ld, hovi.State([-1.0, 0.0]), hovi.State([1.0, 0.0]))
    held = hovi.solve(problem, escape_saddles=False)
    assert held.n_neg == held.trajectory.metadata["n_neg"] == index
    assert held.success == (index == 0)
    assert held.status == ("minimum" if index == 0 else "saddle")
    assert held.minima == ((held.cost,) if index == 0 else ())
    sought = hovi.solve(problem, seek="stationary")
    assert sought.n_neg == index
    assert sought.success


@pytest.mark.parametrize("T", [0.7, 1.0, 2.0])
@pytest.mark.parametrize("limited", [False, True])
def test_the_cost_falls_with_the_cube_of_the_duration(
    two_link: hovi.Robot, T: float, limited: bool
) -> None:
    """Without gravity torques are of the order T^-2, whatever the motion: dJ/dT = -3 J/T.

    Bounds on positions leave that as it is.
    """
    scene = hovi.Scene(two_link)
    limits = {"base": "none", "q": [1.0, 0.9]} if limited else "none"
    options: dict[str, Any] = {"limits": limits, "self_collision": False, "tolerance": 1e-5}
    solution = hovi.plan(scene, [-0.9, -0.8], [0.9, 0.8], T, **options)
    assert solution.success
    assert solution.duration_derivative == pytest.approx(-3 * solution.cost / T, rel=1e-3)
    longer = hovi.plan(scene, [-0.9, -0.8], [0.9, 0.8], 1.001 * T, **options)
    difference = (longer.cost - solution.cost) / (1e-3 * T)
    assert solution.duration_derivative == pytest.approx(difference, rel=2e-2)


def test_minima_are_the_costs_of_different_minima_the_least_first(
    arm_scene: hovi.Scene,
) -> None:
    ends = [-np.pi / 2, 0.0], [np.pi / 2, 0.0]
    grid = {"scheme": "galerkin-2", "intervals": 40}
    solution = hovi.plan(arm_scene, *ends, 2.0, starts=6, seed=1, processes=1, **grid, **FREE)
    assert solution.success
    assert len(solution.minima) >= 2
    assert solution.cost == solution.minima[0]
    assert all(a < b for a, b in itertools.pairwise(solution.minima))
    alone = hovi.plan(arm_scene, *ends, 2.0, guess=solution.trajectory, **grid, **FREE)
    assert alone.minima == (alone.cost,)
    assert alone.cost == pytest.approx(solution.cost, rel=1e-9)


def test_cost_and_effort_are_the_integrals_of_torques_by_pinocchio(two_link: hovi.Robot) -> None:
    weights = (3.0, 0.2)
    scene = hovi.Scene(two_link, [hovi.effects.Gravity(9.8), hovi.effects.EffortWeight(weights)])
    solution = hovi.plan(scene, [-1.0, 0.0], [1.0, 0.5], 1.0, tolerance=1e-9, **FREE)
    assert solution.success
    t = np.linspace(0.0, 1.0, DENSE)
    sampled = solution.trajectory.sample(t)
    model = two_link.model.copy()
    model.gravity.linear = np.array([0.0, 0.0, -9.8])
    data = model.createData()
    tau = np.array([pin.rnea(model, data, *each) for each in zip(*sampled[:3], strict=True)])
    squares = np.trapezoid(0.5 * tau**2, t, axis=0)
    assert solution.effort == pytest.approx(squares.sum(), rel=1e-6)
    assert solution.cost == pytest.approx(squares @ weights, rel=1e-6)


@pytest.mark.parametrize(("scheme", "intervals"), [("galerkin-1", 8), ("galerkin-3", 4)])
def test_a_certificate_bounds_the_least_cost_nearby(
    arm_scene: hovi.Scene, scheme: str, intervals: int
) -> None:
    ends = [-1.0, 0.0], [1.0, 0.5]
    solution = hovi.plan(arm_scene, *ends, 1.0, scheme=scheme, intervals=intervals, **FREE)
    found = hovi.certify(solution)
    fine = hovi.plan(arm_scene, *ends, 1.0, guess=solution.trajectory, tolerance=1e-10, **FREE)
    t = np.linspace(0.0, 1.0, DENSE)
    dense = np.trapezoid(0.5 * np.square(solution.trajectory.sample(t).tau).sum(axis=1), t)
    assert found.integral == pytest.approx(dense, rel=1e-4)
    assert found.action == pytest.approx(solution.cost, rel=1e-12)
    assert found.bound is not None
    assert found.errors is not None
    assert fine.cost * (1 - 1e-9) <= found.bound <= fine.cost * (1 + 0.05)
    true = abs(solution.cost / fine.cost - 1)
    assert 0.9 * true <= found.errors.cost <= 4 * true
    assert found.n_neg == 0


def test_the_torque_of_a_peak_is_that_of_the_motion(arm_scene: hovi.Scene) -> None:
    solution = hovi.plan(arm_scene, [-1.0, 0.0], [1.0, 0.5], 1.0, **FREE)
    found, motion = hovi.certify(solution), solution.trajectory
    dense = motion.sample(np.linspace(0.0, 1.0, DENSE))
    for peak, values in ((found.torque, dense.tau), (found.velocity, dense.v)):
        assert peak is not None
        row, joint = np.unravel_index(np.argmax(np.abs(values)), values.shape)
        assert peak.joint == motion.coordinate_names[int(joint)]
        assert peak.value == pytest.approx(np.abs(values).max(), rel=1e-3)
        assert peak.t == pytest.approx(row / (DENSE - 1), abs=0.02)
