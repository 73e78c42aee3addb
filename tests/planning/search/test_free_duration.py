"""Free durations: Pontryagin's Hamiltonian equals the weight of time."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.errors import InputError

WEIGHT = 20.0


def reach(duration: object, intervals: int = 16, **options: object) -> hovi.Solution:
    task = hovi.load_task(hovi.example("two_link_reach"))
    options = {"limits": "none", "intervals": intervals, **options}
    return hovi.plan(task.scene, task.start, task.goal, duration, **options)


def hamiltonian(solution: hovi.Solution) -> np.ndarray:
    """p.v + p~.a - L at the nodes, a from p~ = M tau by pin.aba."""
    motion, model = solution.trajectory, solution.problem.scene.model
    data, values = model.createData(), []
    for q, v, (p, p_tilde) in zip(motion.q, motion.v, motion.momenta, strict=True):
        mass = pin.crba(model, data, q)
        mass = np.triu(mass) + np.triu(mass, 1).T
        tau = np.linalg.solve(mass, p_tilde)
        a = pin.aba(model, data, q, v, tau)
        values.append(p @ v + p_tilde @ a - 0.5 * tau @ tau)
    return np.array(values)


def test_the_derivative_of_the_cost_in_the_duration_is_that_of_differences() -> None:
    base = reach(1.3)
    moved = [reach(1.3 + d, guess=base.trajectory).cost for d in (-1e-3, 1e-3)]
    assert base.duration_derivative == pytest.approx((moved[1] - moved[0]) / 2e-3, rel=1e-5)


def test_the_hamiltonian_at_the_nodes_is_the_weight_of_time_to_the_order_of_the_scheme() -> None:
    gaps = []
    for N in (8, 16, 32):
        solution = reach((0.5, 4.0), N, time_weight=WEIGHT)
        assert solution.success, solution.message
        gaps.append(np.max(np.abs(hamiltonian(solution) - WEIGHT)))
    slopes = np.log2(np.divide(gaps[:-1], gaps[1:]))
    assert np.all(slopes > 7.0)
    assert gaps[-1] < 1e-7


def test_the_duration_found_is_where_a_sweep_has_its_minimum() -> None:
    solution = reach((0.5, 4.0), time_weight=WEIGHT)
    T = solution.trajectory.duration
    sweep = [
        reach(T * f, guess=solution.trajectory).cost + WEIGHT * T * f for f in (0.98, 1.0, 1.02)
    ]
    assert sweep[1] == pytest.approx(solution.cost, rel=1e-12)
    assert min(sweep) == sweep[1]
    assert solution.cost == pytest.approx(
        hovi.plan(
            solution.problem.scene,
            solution.problem.start,
            solution.problem.goal,
            T,
            limits="none",
            guess=solution.trajectory,
        ).cost
        + WEIGHT * T
    )


def test_a_large_weight_ends_at_the_bound() -> None:
    fast = reach((1.0, 2.0), time_weight=1e4)
    assert fast.trajectory.duration == 1.0
    assert "kept at its bound" in fast.message


def test_limits_hold_while_the_duration_is_found() -> None:
    task, weight = hovi.load_task(hovi.example("ur5_reach_limited")), 60.0
    ends = task.scene, task.start, task.goal
    solution = hovi.plan(*ends, (1.5, 2.5), time_weight=weight, limits=task.options.limits)
    assert solution.success, solution.message
    T, guess = solution.trajectory.duration, solution.trajectory
    assert 1.5 < T < 2.5
    costs = [
        hovi.plan(*ends, T * f, limits=task.options.limits, guess=guess).cost + weight * T * f
        for f in (0.9, 1.1)
    ]
    assert solution.cost < min(costs)


def test_a_search_that_runs_out_of_time_is_no_success() -> None:
    solution = reach((0.5, 4.0), time_weight=WEIGHT, time_limit=1e-3)
    assert not solution.success
    assert solution.status is hovi.Status.TIME_LIMIT


def test_bad_durations_are_refused() -> None:
    with pytest.raises(InputError, match="0 < lower < upper"):
        reach((2.0, 1.0))
    with pytest.raises(InputError, match="time_weight needs a free duration"):
        reach(1.0, time_weight=1.0)
    with pytest.raises(InputError, match="a number or a pair"):
        reach((1.0, 2.0, 3.0))
    with pytest.raises(InputError, match="weight of time must be"):
        reach((1.0, 2.0), time_weight=-1.0)
