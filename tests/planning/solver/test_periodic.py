"""Periodic motions: q(T) = q(0) + displacement, with equal derivatives at both ends."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest
from scipy.integrate import solve_bvp, solve_ivp
from scipy.special import ellipk

import hovi
from hovi.discrete.state import Periodic, State
from hovi.errors import InputError
from hovi.planning.problem.limits import as_limits
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.scene.lagrangian import Lagrangian
from hovi.schemes import galerkin
from samples.asked_motions import USUAL, Asked, planned

Array = npt.NDArray[np.float64]

Q, V, A, JERK, TIME = (ca.SX.sym(name) for name in ("q", "v", "a", "j", "t"))
T = 2.0
W = 2 * np.pi / T


def problem_of(
    lagrangian: Lagrangian,
    goal: Any = None,
    start: State | None = None,
    duration: float = T,
    intervals: int = 8,
    modes: int = 4,
    **rest: Any,
) -> hovi.TrajectoryProblem:
    grid = hovi.Grid.uniform(duration, intervals, galerkin(modes, lagrangian.order))
    ld = hovi.DiscreteLagrangian(lagrangian, grid)
    return hovi.TrajectoryProblem(ld, start or State([0.0]), goal or Periodic(), **rest)


def timed(jet: list[ca.SX], expression: ca.SX) -> CasadiLagrangian:
    return CasadiLagrangian(jet, expression, time=TIME)


def forced(k: int) -> CasadiLagrangian:
    """1/2 |q^(k) - f|^2 + 3/2 q^2 with f = cos(w t) + 0.3 sin(2 w t), for k >= 2."""
    jet = [Q, V, A, JERK][: k + 1]
    f = ca.cos(W * TIME) + 0.3 * ca.sin(2 * W * TIME)
    return timed(jet, (jet[k] - f) ** 2 / 2 + 1.5 * Q**2)


def response(k: int, t: Array) -> Array:
    """q of `forced`: (-1)^k (q^(k) - f)^(k) + 3 q = 0, Fourier mode by mode."""
    found = np.zeros(len(t), complex)
    for w, f in ((W, 1.0), (2 * W, -0.3j)):
        s = 1j * w
        found += (-1) ** k * s**k * f / ((-1) ** k * s ** (2 * k) + 3) * np.exp(s * t)
    return found.real


@pytest.mark.parametrize("k", [2, 3])
@pytest.mark.parametrize("intervals", [1, 2, 3, 8])
def test_a_forced_spline_is_its_fourier_series(k: int, intervals: int) -> None:
    found = hovi.solve(problem_of(forced(k), intervals=intervals, modes=10 - intervals))
    assert found.success, found.message
    assert found.status is hovi.Status.MINIMUM
    assert found.n_neg == 0
    motion = found.trajectory
    t = np.linspace(0.0, T, 41)
    accuracy = {1: 2e-5, 2: 1e-6, 3: 1e-6, 8: 1e-6}[intervals]
    np.testing.assert_allclose(motion.sample(t).q[:, 0], response(k, t), rtol=0, atol=accuracy)
    np.testing.assert_allclose(motion.path.nodes[-1], motion.path.nodes[0], rtol=0, atol=1e-13)
    np.testing.assert_allclose(motion.momenta[-1], motion.momenta[0], rtol=0, atol=1e-11)


def test_the_nodes_of_a_fine_grid_are_those_of_the_fourier_series() -> None:
    found = hovi.solve(problem_of(forced(2), intervals=12, modes=5))
    np.testing.assert_allclose(
        found.trajectory.q[:, 0], response(2, found.trajectory.t), rtol=0, atol=1e-13
    )


def test_intervals_of_different_lengths_share_the_node_between_the_last_and_the_first() -> None:
    steps = np.array([0.1, 0.4, 0.25, 0.15, 0.3, 0.5, 0.3])
    grid = hovi.Grid(steps, tuple(galerkin(4 + i % 2) for i in range(7)))
    ld = hovi.DiscreteLagrangian(forced(2), grid)
    found = hovi.solve(hovi.TrajectoryProblem(ld, State([0.0]), Periodic()))
    assert found.success, found.message
    np.testing.assert_allclose(
        found.trajectory.q[:, 0], response(2, found.trajectory.t), rtol=0, atol=1e-9
    )


@pytest.mark.parametrize("stiffness", [0.5, 4.0, 30.0, 95.0])
def test_a_forced_oscillator_has_the_index_of_its_slow_modes(stiffness: float) -> None:
    """1/2 v^2 - c/2 q^2 + q cos(w t): one direction for the mean, two for each n w < sqrt(c)."""
    L = timed([Q, V], V**2 / 2 - stiffness * Q**2 / 2 + Q * ca.cos(W * TIME))
    found = hovi.solve(problem_of(L, intervals=16), seek="stationary")
    assert found.success, found.message
    n = np.arange(1, 10)
    assert found.n_neg == 1 + 2 * int(np.sum((n * W) ** 2 < stiffness))
    t = found.trajectory.t
    expected = np.cos(W * t) / (stiffness - W**2)
    np.testing.assert_allclose(found.trajectory.q[:, 0], expected, rtol=0, atol=1e-9)


def test_a_duffing_oscillator_moves_as_solve_bvp_says() -> None:
    """q'' = -q - 3 q^3 + 2 cos(w t)."""
    L = timed([Q, V], V**2 / 2 - Q**2 / 2 - 0.75 * Q**4 + 2 * Q * ca.cos(W * TIME))
    found = hovi.solve(problem_of(L, intervals=16), seek="stationary")
    assert found.success, found.message

    def rates(t: Array, y: Array) -> Array:
        return np.array([y[1], -y[0] - 3 * y[0] ** 3 + 2 * np.cos(W * t)])

    t = np.linspace(0.0, T, 41)
    guess = np.stack([found.trajectory.sample(t).q[:, 0], found.trajectory.sample(t).v[:, 0]])
    true = solve_bvp(rates, lambda y0, y1: y1 - y0, t, guess + 0.05, tol=1e-11, max_nodes=10**5)
    assert true.success
    np.testing.assert_allclose(guess[0], true.sol(t)[0], rtol=0, atol=1e-9)


PENDULUM = CasadiLagrangian([Q, V], V**2 / 2 + 9.81 * ca.cos(Q))


def swinging(at: float, phase: float, amplitude: float = 1.0, period: float = T) -> Any:
    """The pendulum's oscillation of a period that is held at a position, from a sine."""
    held = Periodic(held=["q[0]"])
    problem = problem_of(PENDULUM, held, State([at]), period, intervals=24)
    w = 2 * np.pi / period

    def curve(t: Array) -> tuple[Array, Array, Array]:
        s = w * t[:, None] + phase
        return amplitude * np.sin(s), amplitude * w * np.cos(s), -amplitude * w**2 * np.sin(s)

    return hovi.solve(problem, problem.path(curve), seek="stationary")


@pytest.mark.parametrize("period", [2.1, 2.5, 4.0])
def test_a_pendulum_of_a_given_period_has_the_amplitude_of_the_elliptic_integral(
    period: float,
) -> None:
    found = swinging(0.0, 0.0, 2.0, period)
    assert found.success, found.message
    motion = found.trajectory
    top = float(np.abs(motion.sample(np.linspace(0, period, 4001)).q).max())
    assert 4 / np.sqrt(9.81) * ellipk(np.sin(top / 2) ** 2) == pytest.approx(period, rel=1e-7)
    v0 = float(motion.momenta[0, 0, 0])

    def rates(t: float, y: Array) -> Array:
        return np.array([y[1], -9.81 * np.sin(y[0])])

    true = solve_ivp(rates, (0, period), [0.0, v0], "DOP853", rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(true.y[:, -1], [0.0, v0], rtol=0, atol=1e-7)
    np.testing.assert_allclose(motion.momenta[-1], motion.momenta[0], rtol=1e-7)


def test_another_phase_is_the_same_motion_later_with_the_same_index() -> None:
    """The direction along the motion is none of n_neg, wherever the motion is held."""
    one, other = swinging(0.0, 0.0, 2.0, 2.5), swinging(0.8, 0.4, 2.0, 2.5)
    assert one.success
    assert other.success
    assert other.cost == pytest.approx(one.cost, rel=1e-9)
    assert other.n_neg == one.n_neg
    assert other.trajectory.q[0, 0] == pytest.approx(0.8, abs=1e-14)


def test_a_position_that_the_motion_does_not_pass_is_held_by_a_force_and_no_success() -> None:
    found = swinging(1.2, np.pi / 2, 1.2, 2.04)  # of amplitude 0.55
    assert found.status is hovi.Status.UNRESOLVED
    assert "'q[0]' is held at 1.2 by a force" in found.message


def test_a_pendulum_turns_over_in_its_period() -> None:
    """With a displacement of 2 pi, which also chooses the phase: held where it starts."""
    problem = problem_of(PENDULUM, Periodic([2 * np.pi]), State([0.5]), 1.0, intervals=24)
    found = hovi.solve(problem, seek="stationary")
    assert found.success, found.message
    motion = found.trajectory
    assert motion.q[0, 0] == 0.5
    assert motion.q[-1, 0] == pytest.approx(0.5 + 2 * np.pi, abs=1e-13)
    energy = motion.momenta[:, 0, 0] ** 2 / 2 - 9.81 * np.cos(motion.q[:, 0])
    np.testing.assert_allclose(energy, energy[0], rtol=1e-9)
    m = 4 * 9.81 / (2 * (energy[0] + 9.81))
    period = 2 * ellipk(m) * 2 / np.sqrt(2 * (energy[0] + 9.81))
    assert period == pytest.approx(1.0, rel=1e-8)


def arm(*effects: Any) -> hovi.Scene:
    robot = hovi.load_robot(hovi.example("two_link.urdf"))
    return hovi.Scene(robot, [hovi.effects.Gravity(9.8), *effects])


def turning(start: list[float], intervals: int = 24) -> hovi.Solution:
    """The shoulder turns over within 1.5 s, against friction."""
    friction = hovi.effects.ViscousFriction({"shoulder": 0.5, "elbow": 0.5})
    goal = Periodic([2 * np.pi, 0.0])
    lagrangian = arm(friction).effort_lagrangian()
    start_state = State(start, [2 * np.pi / 1.5, 0.0])
    return hovi.solve(problem_of(lagrangian, goal, start_state, 1.5, intervals))


def test_an_arm_turns_over_with_least_effort_wherever_it_starts() -> None:
    one, other = turning([0.0, 0.0]), turning([1.0, 0.0])
    for found in (one, other):
        assert found.status is hovi.Status.MINIMUM, found.message
        motion = found.trajectory
        np.testing.assert_allclose(motion.q[-1] - motion.q[0], [2 * np.pi, 0.0], atol=1e-12)
        np.testing.assert_allclose(motion.v[-1], motion.v[0], rtol=0, atol=1e-12)
        both = motion.sample_intervals([0, 23], [0.0, 1.0]).tau
        np.testing.assert_allclose(both[0], both[1], rtol=0, atol=2e-2)
        jump = np.abs(motion.momenta[-1] - motion.momenta[0]).max(axis=1)
        assert (jump < 1e-4 * np.abs(motion.momenta).max()).all()
    assert other.cost == pytest.approx(one.cost, rel=1e-6)
    assert one.cost == pytest.approx(turning([0.0, 0.0], 48).cost, rel=1e-5)


def test_a_periodic_motion_keeps_its_limits() -> None:
    """1/2 (a - f)^2 + 3/2 q^2, with a speed that the free motion exceeds."""
    free = problem_of(forced(2), intervals=16)
    fastest = float(np.abs(hovi.solve(free).trajectory.sample(np.linspace(0, T, 999)).v).max())
    limits = as_limits(forced(2).coordinates, {"base": "none", "v": 0.7 * fastest})
    found = hovi.solve(dataclasses.replace(free, limits=limits))
    assert found.success, found.message
    motion = found.trajectory
    v = np.abs(motion.sample(np.linspace(0, T, 9_999)).v)
    assert 0.69 * fastest < v.max() < 0.70001 * fastest
    np.testing.assert_allclose(motion.v[-1], motion.v[0], rtol=0, atol=1e-12)
    jump = np.abs(motion.momenta[-1] - motion.momenta[0]).max()
    assert jump < 1e-6 * np.abs(motion.momenta).max()


def test_a_load_is_carried_to_and_fro() -> None:
    """Two segments of a period: momenta agree at both shared nodes, though the scenes differ."""
    loaded = arm(hovi.effects.Payload(frame="tip", mass=1.0))
    push = hovi.effects.ReferenceCost({"elbow": "sin(2*pi*t)"}, 50.0)
    segments = [
        hovi.DiscreteLagrangian(
            hovi.Scene(scene.robot, [*scene.effects, push]).effort_lagrangian(),
            hovi.Grid.uniform(0.5, 6, galerkin(4)),
        )
        for scene in (arm(), loaded)
    ]
    problem = hovi.TrajectoryProblem.of_segments(segments, State([0.0, 0.0]), Periodic())
    found = hovi.solve(problem)
    assert found.success, found.message
    motion = found.trajectory
    D = problem.ld.derivatives(motion.path)
    jumps = np.abs(np.roll(D, 1, axis=0)[:, 2:] + D[:, :2]).max(axis=(1, 2))
    assert jumps.max() < 1e-9 * np.abs(D).max()
    both = motion.sample_intervals([0, 11], [0.0, 1.0])
    assert np.abs(both.tau[1] - both.tau[0]).max() > 0.1


def test_a_periodic_motion_is_replanned_with_another_displacement() -> None:
    found = turning([0.0, 0.0])
    again = found.replan(goal=Periodic([2 * np.pi, 0.1]))
    assert again.success, again.message
    np.testing.assert_allclose(
        again.trajectory.q[-1] - again.trajectory.q[0], [2 * np.pi, 0.1], atol=1e-12
    )
    between = found.replan(goal=State([2 * np.pi, 0.0]))  # from rest at the start to rest
    assert between.success, between.message
    np.testing.assert_allclose(between.trajectory.v[-1], 0.0, atol=1e-12)


def test_a_period_that_becomes_a_motion_between_free_ends_is_none_any_more() -> None:
    everything = {"free": "all", "free_velocity": "all"}
    start, goal = State([0.0], **everything), State([0.5], **everything)  # type: ignore[arg-type]
    found = hovi.solve(problem_of(forced(2), Periodic(), start)).replan(goal=goal)
    fresh = hovi.solve(problem_of(forced(2), goal, start))
    assert found.cost == pytest.approx(fresh.cost, rel=1e-9)
    assert found.trajectory.momenta[0] == pytest.approx(0.0, abs=1e-9)


def test_a_periodic_motion_is_saved_and_certified(tmp_path: Path) -> None:
    found = hovi.solve(problem_of(forced(2)))
    found.trajectory.save(tmp_path / "motion.npz")
    loaded = hovi.Trajectory.load(tmp_path / "motion.npz")
    np.testing.assert_array_equal(loaded.q, found.trajectory.q)
    certificate = hovi.certify(found)
    assert certificate.bound is not None
    assert certificate.residual is not None
    assert certificate.residual < 1e-10


@pytest.mark.parametrize("k", [2, 3])
def test_a_guess_of_any_curve_is_made_periodic(k: int) -> None:
    problem = problem_of(forced(k), Periodic([0.5], held=["q[0]"]), State([0.2]))

    def curve(t: Array) -> tuple[Array, ...]:
        return tuple(np.exp(t)[:, None] for _ in range(k + 1))

    path = problem.path(curve)
    for each in (path, problem.moved(path)):
        expected = np.concatenate([[0.2], np.ones(k - 1)])
        np.testing.assert_allclose(each.nodes[0, :, 0], expected, rtol=0, atol=1e-14)
        expected[0] += 0.5
        np.testing.assert_allclose(each.nodes[-1, :, 0], expected, rtol=0, atol=1e-14)
    other = problem_of(forced(k), Periodic([0.5]), State([0.2]))
    again = other.moved(path)
    np.testing.assert_allclose(again.nodes[-1, 0] - again.nodes[0, 0], 0.5, rtol=0, atol=1e-14)


def test_what_a_periodic_motion_does_not_have_is_refused() -> None:
    L = CasadiLagrangian([Q, V, A], A**2 / 2 - ca.cos(Q))
    refused: list[tuple[Any, str]] = [
        (lambda: problem_of(L), "name a joint that passes the start's position"),
        (lambda: problem_of(L, Periodic(held="wrist")), "has no joint 'wrist'"),
        (lambda: problem_of(L, Periodic([1.0, 2.0])), "the displacement of a period"),
        (lambda: problem_of(L, Periodic([np.nan])), "the displacement of a period"),
        (
            lambda: problem_of(forced(2), via=(hovi.Via(1.0, State([0.0])),)),
            "periodic motions have no via points or passive joints",
        ),
    ]
    for make, reason in refused:
        with pytest.raises(InputError, match=reason):
            make()
    turns = hovi.Scene(hovi.load_robot("kinova")).effort_lagrangian()
    assert turns.space is not None
    with pytest.raises(InputError, match="periodic motions need joints with nq = nv"):
        problem_of(turns, Periodic(), State(turns.scene.robot.neutral()))


@pytest.mark.filterwarnings("ignore::hovi.errors.HoviWarning")
def test_a_symmetry_takes_no_steps() -> None:
    """Without gravity a period may begin at any angle of the first joint: H is singular."""
    free = {"effect": "rates", "limits": "none", "goal": "periodic"}
    found = planned(Asked(USUAL | free))
    assert found.success, found.message
    assert found.nit < 50
