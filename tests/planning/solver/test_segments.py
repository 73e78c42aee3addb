"""Motions in segments, each with its own Lagrangian and limits, that share nodes."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest
from scipy.integrate import solve_bvp

import hovi
from hovi.conditions.excess import excess_along
from hovi.discrete.state import State
from hovi.errors import InputError
from hovi.planning.problem.limit_conditions import LimitRange, closeness, limit_conditions
from hovi.planning.problem.limits import Limits, as_limits
from hovi.planning.problem.presolve.end_torques import static_sentence
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.scene.lagrangian import Lagrangian
from hovi.schemes import by_name, galerkin
from oracles.ipopt_oracle import least_action

Array = npt.NDArray[np.float64]

Q, V, A, TIME = (ca.SX.sym(name) for name in ("q", "v", "a", "t"))


def on(lagrangian: Lagrangian, T: float, intervals: int, scheme: str = "galerkin-4") -> Any:
    return hovi.DiscreteLagrangian(lagrangian, hovi.Grid.uniform(T, intervals, by_name(scheme)))


@cache
def empty_and_loaded() -> tuple[hovi.Scene, hovi.Scene]:
    """Scenes of one robot, without and with a payload."""
    robot, gravity = hovi.load_robot(hovi.example("two_link.urdf")), hovi.effects.Gravity(9.8)
    payload = hovi.effects.Payload(frame="tip", mass=0.5)
    return hovi.Scene(robot, [gravity]), hovi.Scene(robot, [gravity, payload])


def lift(
    limits: Sequence[Limits | None] | None = None, steps: tuple[int, int] = (6, 9), **rest: Any
) -> hovi.TrajectoryProblem:
    """A move in which a payload is picked up after 0.6 s of 1.5 s."""
    efforts = [scene.effort_lagrangian() for scene in empty_and_loaded()]
    segments = [on(efforts[0], 0.6, steps[0]), on(efforts[1], 0.9, steps[1])]
    ends = State([0.0, 0.0]), State([1.0, 0.5])
    return hovi.TrajectoryProblem.of_segments(segments, *ends, limits, **rest)


@cache
def lifted() -> hovi.Solution:
    found = hovi.solve(lift())
    assert found.success, found.message
    return found


def bounds(**kinds: Any) -> Limits:
    return as_limits(empty_and_loaded()[0].robot, {"base": "none", **kinds})


def test_two_beams_in_one_bend_as_their_equations_and_interface_conditions_say() -> None:
    """Stiffness c and foundation k change at the joint, where q, q', c q'' and its rate agree."""
    (c0, k0, load0), (c1, k1, load1), ends = (1.0, 30.0, 4.0), (5.0, 2.0, -7.0), (0.4, 1.0)

    def beam(c: float, k: float, load: float) -> CasadiLagrangian:
        return CasadiLagrangian([Q, V, A], c * A**2 / 2 + k * Q**2 / 2 - load * Q)

    def rates(s: Array, y: Array) -> Array:
        one = ends[0] * np.array([y[1], y[2], y[3], (load0 - k0 * y[0]) / c0])
        other = (ends[1] - ends[0]) * np.array([y[5], y[6], y[7], (load1 - k1 * y[4]) / c1])
        return np.concatenate([one, other])

    def conditions(y0: Array, y1: Array) -> Array:
        stiff = np.array([1.0, 1.0, c0, c0]) * y1[:4] - np.array([1.0, 1.0, c1, c1]) * y0[4:]
        return np.concatenate([y0[:2], stiff, y1[4:6] - [0.2, 0.5]])

    grid = np.linspace(0, 1, 40)
    true = solve_bvp(rates, conditions, grid, np.zeros((8, 40)), tol=1e-11, max_nodes=200_000)
    assert true.success
    segments = [on(beam(c0, k0, load0), 0.4, 3), on(beam(c1, k1, load1), 0.6, 5)]
    goal = State([0.2], [0.5])
    found = hovi.solve(hovi.TrajectoryProblem.of_segments(segments, State([0.0]), goal))
    assert found.success, found.message
    assert found.n_neg == 0
    s = np.linspace(0, 1, 51)
    for start, end, rows in ((0.0, 0.4, slice(0, 2)), (0.4, 1.0, slice(4, 6))):
        moved = found.trajectory.sample(start + s * (end - start))
        both = np.stack([moved.q[:, 0], moved.v[:, 0]])
        np.testing.assert_allclose(both, true.sol(s)[rows], rtol=0, atol=1e-9)
    p = found.trajectory.momenta[3, :, 0]  # (p, p~) = (-c q''', c q'')
    np.testing.assert_allclose(p, [-c1 * true.sol(0.0)[7], c1 * true.sol(0.0)[6]], rtol=1e-7)


def test_time_runs_on_through_the_segments() -> None:
    """1/2 (a - cos t)^2 in both halves is one Lagrangian, that of a single segment."""
    L = CasadiLagrangian([Q, V, A], (A - ca.cos(3 * TIME)) ** 2 / 2, time=TIME)
    ends = State([0.0]), State([1.0])
    found = hovi.solve(hovi.TrajectoryProblem.of_segments([on(L, 1.0, 4), on(L, 1.0, 4)], *ends))
    single = hovi.solve(hovi.TrajectoryProblem(on(L, 2.0, 8), *ends))
    assert found.cost == pytest.approx(single.cost, rel=1e-13)
    np.testing.assert_allclose(found.trajectory.q, single.trajectory.q, rtol=0, atol=1e-13)


@pytest.mark.parametrize("schemes", [("galerkin-4", "galerkin-2"), ("hermite-simpson",) * 2])
def test_equal_segments_are_the_motion_of_one(schemes: tuple[str, str]) -> None:
    """With points at nodes, too, which belong to the segment of their interval."""
    effort = empty_and_loaded()[0].effort_lagrangian()
    segments = [on(effort, 0.5, 10, schemes[0]), on(effort, 0.5, 10, schemes[1])]
    grid = hovi.Grid.joined([each.grid for each in segments])
    ends = State([0.0, 0.0]), State([0.3, 0.7])
    found = hovi.solve(hovi.TrajectoryProblem.of_segments(segments, *ends))
    single = hovi.solve(hovi.TrajectoryProblem(hovi.DiscreteLagrangian(effort, grid), *ends))
    assert found.status is single.status
    assert found.cost == pytest.approx(single.cost, rel=1e-13)


def test_a_payload_picked_up_half_way_is_least_effort_by_ipopt_as_well() -> None:
    found = lifted()
    assert found.problem is not None
    cost, nodes = least_action(found.problem, found.trajectory.path)
    assert found.n_neg == 0
    assert found.error_estimate is not None
    assert found.error_estimate < 1e-4
    assert found.cost == pytest.approx(cost, rel=1e-10)
    path = found.trajectory.path
    np.testing.assert_allclose(np.hstack([path.q, path.v])[1:-1], nodes, rtol=0, atol=1e-6)


def test_the_effort_of_segments_is_their_cost_where_nothing_else_costs_anything() -> None:
    assert lifted().effort == pytest.approx(lifted().cost, rel=1e-12)


def test_torque_limits_hold_between_the_points_of_segments_of_order_3() -> None:
    """Of a coarse grid, on which the motion without limits needs more."""
    limits = bounds(tau=[11.0, 4.5], jerk=1e4)
    parts = [
        hovi.DiscreteLagrangian(
            hovi.Scene(
                scene.robot, [*scene.effects, hovi.effects.JerkCost(1e-4)]
            ).effort_lagrangian(),
            hovi.Grid.uniform(T, 4, galerkin(1, 3)),
        )
        for scene, T in zip(empty_and_loaded(), (0.6, 0.9), strict=True)
    ]
    ends = State([0.0, 0.0]), State([1.0, 0.5])
    found = hovi.solve(hovi.TrajectoryProblem.of_segments(parts, *ends, limits=[limits, limits]))
    assert found.usable, found.message
    assert found.n_neg == 0
    N = found.trajectory.grid.intervals
    k, s = np.repeat(np.arange(N), 101), np.tile(np.linspace(0.0, 1.0, 101), N)
    largest = np.abs(found.trajectory.sample_intervals(k, s).tau).max(axis=0)
    assert (largest < np.array([11.0, 4.5]) * (1 + 3e-6)).all()
    assert largest[0] > 10.5


def test_momenta_are_continuous_where_segments_meet_and_torques_are_not() -> None:
    found = hovi.solve(lift(steps=(24, 36)))
    problem, motion = found.problem, found.trajectory
    assert problem is not None
    D = problem.ld.derivatives(motion.path)
    jumps = np.abs(D[:-1, 2:] + D[1:, :2]).max(axis=(1, 2))
    assert jumps.max() < 1e-10 * np.abs(D).max()
    both = motion.sample_intervals([23, 24], [1.0, 0.0])
    np.testing.assert_allclose(both.q[0], both.q[1], rtol=0, atol=1e-13)
    assert np.abs(both.tau[1] - both.tau[0]).max() > 1.0
    # p~ = dL/da = M tau, with each mass matrix
    for scene, tau in zip(empty_and_loaded(), both.tau, strict=True):
        zero = np.zeros((1, 2))
        M = np.column_stack(
            [
                scene.inverse_dynamics(both.q[:1], zero, a[None])[0]
                - scene.inverse_dynamics(both.q[:1], zero, zero)[0]
                for a in np.eye(2)
            ]
        )
        np.testing.assert_allclose(M @ tau, motion.momenta[24, 1], rtol=3e-4)


def test_torques_are_those_of_the_scene_of_the_time() -> None:
    motion, (empty, loaded) = lifted().trajectory, empty_and_loaded()
    t = np.linspace(0.0, 1.5, 101)
    m = motion.sample(t)
    for scene, here in ((empty, t < 0.6), (loaded, t >= 0.6)):
        expected = scene.inverse_dynamics(m.q[here], m.v[here], m.a[here])
        np.testing.assert_array_equal(m.tau[here], expected)


@pytest.mark.parametrize("c", [(4.0, 4.0), (0.0, 6.0), (9.0, 5.0), (9.0, 12.0)])
def test_the_index_is_that_of_the_action_over_all_segments(c: tuple[float, float]) -> None:
    """1/2 a^2 - c^4/2 q^2 with c by segment, by Ritz's method with polynomials clamped at ends."""
    segments = [on(CasadiLagrangian([Q, V, A], A**2 / 2 - x**4 * Q**2 / 2), 0.5, 6) for x in c]
    problem = hovi.TrajectoryProblem.of_segments(segments, State([0.0]), State([1.0]))
    found = hovi.solve(problem, seek="stationary")
    assert found.success, found.message
    clamped = np.polynomial.Polynomial([0, 0, 1, -2, 1])  # x^2 (1 - x)^2
    basis = [clamped * np.polynomial.Legendre.basis(i, [0, 1]).convert(kind=type(clamped))
             for i in range(14)]  # fmt: skip
    x, w = np.polynomial.legendre.leggauss(40)
    H = np.zeros((14, 14))
    for begin, value in zip((0.0, 0.5), c, strict=True):
        at = begin + (x + 1) / 4
        q, a = (np.array([f(at) for f in each]) for each in (basis, [f.deriv(2) for f in basis]))
        H += (a * w / 4) @ a.T - value**4 * (q * w / 4) @ q.T
    assert found.n_neg == int(np.sum(np.linalg.eigvalsh(H) < 0))


def test_each_segment_has_its_own_limits() -> None:
    """The elbow turns at 10.8 rad/s where they meet: slow in one, weak in the other."""
    slow, weak = bounds(v=[20.0, 9.0]), bounds(tau=[4.6, 6.5])
    problem = lift([slow, weak])
    found = hovi.solve(problem)
    assert found.success, found.message
    m = found.trajectory.sample(np.linspace(0.0, 1.5, 20_001))
    first = np.linspace(0.0, 1.5, 20_001) < 0.6
    assert 8.8 < np.abs(m.v[first, 1]).max() < 9.0001
    assert 6.0 < np.abs(m.tau[~first, 1]).max() < 6.5001
    assert np.abs(m.tau[~first, 0]).max() < 4.6001
    assert np.abs(m.tau[first, 0]).max() > 10.0
    assert found.problem is not None
    assert closeness(found.trajectory, found.problem.limits).min() > -1e-6  # type: ignore[arg-type]
    assert "segment_limits" in found.trajectory.metadata
    assert "limits" not in found.trajectory.metadata


def test_limits_of_segments_are_those_of_ipopt() -> None:
    """At the quadrature points of the same grid, before any are tightened."""
    problem = lift([None, bounds(tau=[30.0, 6.5])])
    found = hovi.solve(problem)
    assert found.success, found.message
    assert found.problem is not None
    assert found.problem.grid.intervals == problem.grid.intervals
    cost, _ = least_action(found.problem, found.trajectory.path)
    assert cost > 1.0001 * lifted().cost
    assert found.cost == pytest.approx(cost, rel=2e-4)


def test_limits_of_segments_are_not_written_as_those_of_one_motion() -> None:
    problem = lift([bounds(v=1.0), None])
    assert problem.limits is not None
    with pytest.raises(InputError, match="limits of segments are written one by one"):
        problem.limits.to_dict()
    tight = problem.limits.with_margin(0.25)
    assert tight.parts[0].upper[1, 0] == pytest.approx(0.5)
    assert tight.parts[1].bounded.sum() == 0


def test_limits_of_one_segment_alone_do_not_limit_the_other() -> None:
    found = hovi.solve(lift([bounds(v=[20.0, 20.0]), None]))
    assert found.cost == pytest.approx(lifted().cost, rel=1e-7)


def test_an_end_outside_the_limits_of_its_segment_is_named() -> None:
    tight = bounds(q=[[-0.5, 0.5], [-1.0, 1.0]])
    assert hovi.solve(lift([None, tight])).status is hovi.Status.INFEASIBLE
    message = hovi.solve(lift([None, tight])).message
    assert "the position of joint 'shoulder' at the goal is 1 rad, outside its limits" in message
    assert "outside its limits" not in hovi.solve(lift([tight, None])).message


def test_limits_are_checked_in_each_segment_against_its_own() -> None:
    motion = lifted().trajectory
    parts = [bounds(v=[1.2, 9.0], tau=[30.0, 4.4]), bounds(v=[1.5, 4.0], tau=[4.0, 7.5])]
    limits = Limits.of_segments(parts, (0.6,))
    lower, upper = np.full((2, motion.grid.intervals, 4, 2), -np.inf)
    for each in limit_conditions(limits, motion.grid.order, None):
        assert isinstance(each.on, LimitRange)
        lower[:, each.on.row], upper[:, each.on.row] = excess_along(motion, each)
    t = np.linspace(0.0, 1.0, 20_001)
    for segment, span in zip(parts, (slice(0, 6), slice(6, 15)), strict=True):
        for k in range(span.start, span.stop):
            m = motion.sample_intervals(np.full(len(t), k), t)
            for row, values in ((1, m.v), (3, m.tau)):
                ranges = 2 * np.maximum(parts[0].upper[row], parts[1].upper[row])
                above = ((values - segment.upper[row]) / ranges).max(axis=0)
                below = ((segment.lower[row] - values) / ranges).max(axis=0)
                for dense, side in ((above, upper), (below, lower)):
                    near = dense > -1e-3
                    np.testing.assert_allclose(side[k, row][near], dense[near], atol=1e-6)
                    assert (side[k, row][~near] < -5e-4).all()


def test_the_torque_that_holds_the_goal_is_that_of_the_last_scene() -> None:
    goal, zero = np.array([[1.0, 0.5]]), np.zeros((1, 2))
    tau = empty_and_loaded()[1].inverse_dynamics(goal, zero, zero)[0]
    problem = lift([None, bounds(tau=[0.8 * abs(tau[0]), 30.0])])
    assert problem.limits is not None
    sentence = static_sentence(problem, problem.limits)
    assert f"holding the robot still at the goal takes {tau[0]:.4g} N m" in sentence


def test_a_motion_in_segments_is_replanned() -> None:
    found = lifted()
    again = found.replan(goal=[1.05, 0.45])
    fresh = hovi.solve(dataclasses.replace(found.problem, goal=State([1.05, 0.45])))  # type: ignore[type-var]
    assert again.success
    assert again.nit < fresh.nit
    assert again.cost == pytest.approx(fresh.cost, rel=1e-11)


def test_a_via_point_is_where_segments_meet() -> None:
    found = hovi.solve(lift(via=(hovi.Via(0.6, State([0.7, 0.9], [0.0, 0.0])),)))
    assert found.success, found.message
    np.testing.assert_allclose(found.trajectory.q[6], [0.7, 0.9], rtol=0, atol=1e-9)
    np.testing.assert_allclose(found.trajectory.v[6], 0.0, rtol=0, atol=1e-9)


def test_a_frame_is_the_goal_of_the_last_segment() -> None:
    robot = empty_and_loaded()[0].robot
    target = robot.frame_position("tip", np.array([[1.0, 0.5]]))[0]
    goal = hovi.FrameGoal("tip", position=target)
    found = hovi.solve(dataclasses.replace(lift(), goal=goal))
    assert found.success, found.message
    reached = robot.frame_position("tip", found.trajectory.q[-1:])[0]
    np.testing.assert_allclose(reached, target, rtol=0, atol=1e-8)
    assert found.cost <= lifted().cost * (1 + 1e-9)


def test_an_obstacle_is_avoided_in_every_segment() -> None:
    robot = empty_and_loaded()[0].robot
    at = robot.frame_position("tip", lifted().trajectory.configurations([0.8]))[0]
    clearance = hovi.Clearance((hovi.Sphere(at, 0.05),), margin=0.01)
    found = hovi.solve(lift(clearance=clearance))
    assert found.success, found.message
    assert found.cost > 1.001 * lifted().cost
    tips = robot.frame_position("tip", found.trajectory.configurations(np.linspace(0, 1.5, 301)))
    assert np.linalg.norm(tips - at, axis=1).min() > 0.06


def test_the_derivative_in_the_duration_stretches_every_segment() -> None:
    def cost(stretch: float) -> float:
        efforts = [scene.effort_lagrangian() for scene in empty_and_loaded()]
        lengths = ((0.6, 6), (0.9, 9))
        segments = [on(L, stretch * T, n) for L, (T, n) in zip(efforts, lengths, strict=True)]
        ends = State([0.0, 0.0]), State([1.0, 0.5])
        return float(hovi.solve(hovi.TrajectoryProblem.of_segments(segments, *ends)).cost)

    d = 1e-4
    expected = (cost(1 + d) - cost(1 - d)) / (2 * d * 1.5)
    assert lifted().duration_derivative == pytest.approx(expected, rel=1e-5)


def test_a_motion_in_segments_is_saved_with_its_scenes(tmp_path: Path) -> None:
    motion = lifted().trajectory
    motion.save(tmp_path / "motion.npz")
    loaded = hovi.Trajectory.load(tmp_path / "motion.npz")
    t = np.linspace(0.0, 1.5, 41)
    for one, other in zip(motion.sample(t), loaded.sample(t), strict=True):
        np.testing.assert_array_equal(one, other)
    assert loaded.scene is None
    assert loaded.segments is not None
    assert loaded.segments.intervals == (6, 9)
    assert loaded.robot is not None
    loaded.save(tmp_path / "copy.npz")
    assert (tmp_path / "copy.npz").read_bytes() == (tmp_path / "motion.npz").read_bytes()


def test_a_certificate_says_which_checks_need_one_scene() -> None:
    found = hovi.certify(lifted(), "tip")
    assert found.quadrature < 1e-4
    assert found.residual is not None
    assert found.residual < 1e-10
    assert found.errors is not None
    assert found.missing["hamiltonian"].startswith("H changes where the Lagrangian does")
    assert found.replay is not None
    assert found.replay.angle < 1e-9


def test_torques_are_computed_for_one_scene_only() -> None:
    with pytest.raises(InputError, match="computed torques need one scene, and a plan in segments"):
        hovi.play(empty_and_loaded()[0], lifted().trajectory, "computed-torque")


def test_the_error_estimate_is_that_of_the_next_grid() -> None:
    """Twice the intervals, against the estimate of the coarse one."""
    coarse = hovi.solve(lift(steps=(4, 6)))
    fine = hovi.solve(lift(steps=(12, 18)))
    assert coarse.error_estimate is not None
    true = abs(coarse.cost - fine.cost) / fine.cost
    assert true / 3 < coarse.error_estimate < 3 * true


def test_segments_that_do_not_fit_are_refused() -> None:
    effort = empty_and_loaded()[0].effort_lagrangian()
    other = hovi.Scene(hovi.load_robot(hovi.example("pendulum.urdf"))).effort_lagrangian()
    ends = State([0.0, 0.0]), State([1.0, 0.5])
    make = hovi.TrajectoryProblem.of_segments
    refused = [
        ([on(effort, 1.0, 4)], "has two or more"),
        ([on(effort, 1.0, 4), on(other, 1.0, 4)], "must move the same joints"),
        ([on(effort, 1.0, 4), on(hovi.spline(2), 1.0, 4)], "must move the same joints"),
        ([], "nothing to join"),
    ]
    for segments, reason in refused:
        with pytest.raises(InputError, match=reason):
            make(segments, *ends)
    third = hovi.DiscreteLagrangian(
        hovi.spline(2, 3), hovi.Grid.uniform(1.0, 4, galerkin(2, derivatives=3))
    )
    with pytest.raises(InputError, match="Lagrangians of one order"):
        make([on(hovi.spline(2), 1.0, 4), third], *ends)
    with pytest.raises(InputError, match="for each of the 2 segments, got 1"):
        lift([None])
    passive = dataclasses.replace(empty_and_loaded()[0], passive=("elbow",)).effort_lagrangian()
    with pytest.raises(InputError, match="the same passive joints, got none and 'elbow'"):
        make([on(effort, 1.0, 4), on(passive, 1.0, 4)], *ends)


def test_a_grid_without_a_node_at_the_end_of_a_segment_is_refused() -> None:
    with pytest.raises(
        InputError, match=r"a segment ends at 0\.6 s, where the grid needs an inner"
    ):
        lift().on(hovi.Grid.uniform(1.5, 4, galerkin(4)))


@pytest.mark.parametrize(("k", "jump"), [(1, 0), (3, 2)])
def test_segments_of_other_orders_meet_with_continuous_momenta(k: int, jump: int) -> None:
    """L = c/2 |q^(k)|^2: c q^(k) = p_{k-1} is continuous, q^(k) jumps."""
    segments = []
    for c in (1.0, 4.0):
        jet = [ca.SX.sym(f"x{j}") for j in range(k + 1)]
        grid = hovi.Grid.uniform(0.5, 3, galerkin(2, k))
        L = CasadiLagrangian(jet, c * jet[-1] ** 2 / 2)
        segments.append(hovi.DiscreteLagrangian(L, grid))
    found = hovi.solve(hovi.TrajectoryProblem.of_segments(segments, State([0.0]), State([1.0])))
    assert found.success, found.message
    before, after = (
        found.trajectory.jet_intervals([i], [s], k)[k] for i, s in ((2, 1.0), (3, 0.0))
    )
    np.testing.assert_allclose(before, 4 * after, rtol=1e-9)
    np.testing.assert_allclose(found.trajectory.momenta[3, jump], before[0], rtol=1e-9)


def test_limits_of_segments_hold_at_nodes_of_any_size() -> None:
    """The sum of two nodes overflows where their mean does not."""
    both = Limits.of_segments([bounds(tau=1.0), bounds(tau=2.0)], [1.0])
    _, upper = both.on(np.array([-1.7e308, -1e308, 1e308, 1.7e308]))
    np.testing.assert_array_equal(upper[:, 3, 0], [1.0, 1.0, 2.0])
