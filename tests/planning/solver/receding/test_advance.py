"""Motions that go on from a measured state, against cold solves and samples of the whole motion."""

from __future__ import annotations

import dataclasses
import time

import casadi as ca
import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

import hovi
from hovi import Solution, Status, solve
from hovi.discrete.grid import Grid
from hovi.discrete.state import Periodic, State
from hovi.errors import InputError
from hovi.planning.problem.limits import Limits
from hovi.robot.robot import Robot
from hovi.scene.lagrangian import Lagrangian
from hovi.scene.scene import Scene
from hovi.schemes import by_name, galerkin

Array = npt.NDArray[np.float64]

START, GOAL = State([-0.5, 0.3]), State([0.9, -0.4])
DT = 0.03
ROWS = 1e-5
"""Rise of a cost by rows beside the curve, relative: see MAX_LOSS of limit_rows."""
TIGHT = {"base": "none", "v": 2.2, "tau": [60.0, 22.0]}


def problem_of(
    scene: Scene, limits: object = None, goal: object = GOAL, via: tuple[hovi.Via, ...] = ()
) -> hovi.TrajectoryProblem:
    """A reach in a second on 16 intervals."""
    grid = Grid.uniform(1.0, 16, by_name("galerkin-2x6"))
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
    bounds = None if limits is None else hovi.as_limits(scene.robot, limits)
    return hovi.TrajectoryProblem(ld, START, goal, limits=bounds, via=via)


@pytest.fixture(scope="module")
def scene(two_link: Robot) -> Scene:
    return Scene(two_link, [hovi.effects.Gravity(9.8)])


@pytest.fixture(scope="module")
def free(scene: Scene) -> Solution:
    return hovi.solve(problem_of(scene))


@pytest.fixture(scope="module")
def limited(scene: Scene) -> Solution:
    found = hovi.solve(problem_of(scene, TIGHT))
    assert found.success, found.message
    assert found.cost > 1.001 * hovi.solve(problem_of(scene)).cost
    return found


def at(motion: Solution, t: float) -> tuple[Array, Array]:
    x = motion.trajectory.sample(t)
    return x.q[0], x.v[0]


def pushed(motion: Solution, t: float, size: float = 1e-3) -> State:
    """The state at a time, after a push, within the velocity limits."""
    q, v = at(motion, t)
    v = v + np.array([10.0, -10.0]) * size
    limits = motion.problem.limits if motion.problem else None
    if limits is not None:
        v = np.clip(v, limits.lower[1], limits.upper[1])
    return State(q + np.array([size, -size]), v)


def excess(motion: Solution, limits: Limits) -> float:
    """Largest excess over v and tau at 10,000 samples, torques by pin.rnea, of their ranges."""
    x = motion.trajectory.sample(np.linspace(0.0, motion.trajectory.duration, 10_000))
    model = motion.trajectory.scene.model  # type: ignore[union-attr]
    data = model.createData()
    tau = np.array([pin.rnea(model, data, *row) for row in zip(x.q, x.v, x.a, strict=True)])
    worst = -np.inf
    for row, y in ((1, x.v), (3, tau)):
        low, high = limits.lower[row], limits.upper[row]
        worst = max(worst, float((np.maximum(y - high, low - y) / (high - low)).max()))
    return worst


# Where nothing disturbs


def test_undisturbed_a_free_motion_goes_on_as_it_was(free: Solution) -> None:
    rest = free.advance(DT)
    assert rest.status is Status.MINIMUM
    assert rest.nit <= 3
    assert rest.trajectory.duration == pytest.approx(1.0 - DT)
    t = np.linspace(0.0, 1.0 - DT, 100)
    whole = free.trajectory.sample(np.minimum(DT + t, 1.0))
    np.testing.assert_allclose(rest.trajectory.sample(t).q, whole.q, atol=2e-4)
    fresh = solve(rest.problem, "cubic")  # type: ignore[arg-type]
    assert rest.cost == pytest.approx(fresh.cost, rel=1e-10)


def test_undisturbed_a_limited_motion_takes_few_steps(limited: Solution) -> None:
    rest = limited.advance(DT)
    cold = solve(rest.problem)  # type: ignore[arg-type]
    assert rest.status is Status.MINIMUM
    assert rest.nit <= 0.3 * cold.nit
    assert rest.cost == pytest.approx(cold.cost, rel=ROWS)


def test_no_time_at_all_is_the_same_motion(limited: Solution) -> None:
    same = limited.advance(0.0)
    assert same.trajectory.grid.intervals == limited.trajectory.grid.intervals
    assert same.cost == pytest.approx(limited.cost, rel=ROWS)


def test_a_motion_advances_to_its_end(limited: Solution) -> None:
    motion, passed = limited, 0.0
    while passed < 0.9:
        motion, passed = motion.advance(0.11), passed + 0.11
        assert motion.success, motion.message
        assert motion.trajectory.duration == pytest.approx(1.0 - passed)
    assert motion.trajectory.grid.intervals <= 3
    np.testing.assert_array_equal(motion.trajectory.q[-1], GOAL.q)


# After a push


def test_a_pushed_motion_starts_where_it_was_pushed_to(free: Solution) -> None:
    state = pushed(free, DT, 0.02)
    rest = free.advance(DT, state)
    fresh = solve(rest.problem, "cubic")  # type: ignore[arg-type]
    np.testing.assert_array_equal(rest.trajectory.q[0], state.q)
    np.testing.assert_array_equal(rest.trajectory.v[0], state.v)
    assert rest.status is Status.MINIMUM
    assert rest.nit <= 4
    assert rest.cost == pytest.approx(fresh.cost, rel=1e-10)


@pytest.mark.parametrize("t", [DT, 0.3, 0.62])
def test_a_pushed_motion_keeps_its_limits(limited: Solution, t: float) -> None:
    state = pushed(limited, t)
    rest = limited.advance(t, state)
    assert rest.status is Status.MINIMUM, rest.message
    np.testing.assert_allclose(rest.trajectory.q[0], np.asarray(state.q), atol=1e-9)
    np.testing.assert_allclose(rest.trajectory.v[0], np.asarray(state.v), atol=5e-6)
    assert excess(rest, rest.problem.limits) <= 1e-6  # type: ignore[union-attr, arg-type]
    cold = solve(rest.problem)  # type: ignore[arg-type]
    assert rest.cost == pytest.approx(cold.cost, rel=ROWS)


def test_the_goal_may_move_meanwhile(limited: Solution) -> None:
    goal = State([0.91, -0.41])
    rest = limited.advance(DT, pushed(limited, DT), goal)
    assert rest.success, rest.message
    np.testing.assert_array_equal(rest.trajectory.q[-1], goal.q)


def test_a_start_outside_the_limits_is_told(limited: Solution) -> None:
    q, v = at(limited, DT)
    rest = limited.advance(DT, State(q, [2.3, v[1]]))
    assert rest.status is Status.INFEASIBLE
    assert "velocity of joint" in rest.message


def test_a_horizon_that_moves_keeps_its_intervals(limited: Solution) -> None:
    rest = limited.advance(0.1, pushed(limited, 0.1), duration=1.0)
    assert rest.success, rest.message
    assert rest.trajectory.duration == pytest.approx(1.0)
    assert rest.trajectory.grid.intervals >= 16
    assert rest.cost < limited.cost
    assert excess(rest, rest.problem.limits) <= 1e-6  # type: ignore[union-attr, arg-type]


# Other problems


def test_a_smooth_motion_keeps_its_acceleration(scene: Scene) -> None:
    found = hovi.plan(scene, [-0.5, 0.3], [0.9, -0.4], 1.0, smooth=True, limits="none")
    q, v = at(found, 0.2)
    rest = found.advance(0.2, State(q + 1e-3, v))
    assert rest.success, rest.message
    a = found.trajectory.sample(0.2).a[0]
    np.testing.assert_allclose(rest.trajectory.sample(0.0).a[0], a, atol=1e-9)


def test_via_points_that_have_passed_are_left_out(scene: Scene) -> None:
    via = tuple(hovi.Via(t, State(q)) for t, q in ((0.25, [0.0, 0.2]), (0.625, [0.5, 0.2])))
    found = hovi.solve(problem_of(scene, via=via))
    assert found.success, found.message
    rest = found.advance(0.3)
    assert rest.success, rest.message
    assert [each.time for each in rest.problem.via] == [pytest.approx(0.325)]  # type: ignore[union-attr]
    np.testing.assert_allclose(rest.trajectory.configurations(0.325)[0], [0.5, 0.2], atol=1e-9)


def test_goals_of_frames_are_met(scene: Scene) -> None:
    found = hovi.solve(problem_of(scene, goal=hovi.FrameGoal("tip", position=[1.2, 0.0, 0.9])))
    assert found.success, found.message
    rest = found.advance(0.1, pushed(found, 0.1))
    assert rest.success, rest.message
    miss = rest.problem.goal.miss(scene.robot, rest.trajectory.q[-1])  # type: ignore[union-attr]
    assert miss[0] < 1e-8


def test_the_estimate_of_a_resolved_motion_is_kept_for_its_rest(free: Solution) -> None:
    """The error of the cost stays as large, and the cost falls."""
    assert free.success
    assert free.error_estimate is not None
    rest = free.advance(DT, pushed(free, DT))
    undisturbed = free.advance(DT)
    expected = free.error_estimate * free.cost / undisturbed.cost
    assert rest.error_estimate == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("elapsed", [-0.1, 1.0, 2.0, np.nan])
def test_only_times_within_the_motion_are_accepted(free: Solution, elapsed: float) -> None:
    with pytest.raises(InputError, match="lasts 1 s"):
        free.advance(elapsed)


class _OfTime(hovi.CasadiLagrangian):
    """A Lagrangian of somebody's own, which says nothing of a part of a motion."""

    within = Lagrangian.within


def test_what_cannot_go_on_is_refused(free: Solution) -> None:
    with pytest.raises(InputError, match="has no problem"):
        dataclasses.replace(free, problem=None).advance(DT)
    with pytest.raises(InputError, match="duration must be positive"):
        free.advance(DT, duration=0.0)
    L = _OfTime([ca.SX.sym("q"), ca.SX.sym("v"), a := ca.SX.sym("a")], a**2, time=ca.SX.sym("t"))
    own = hovi.DiscreteLagrangian(L, Grid.uniform(1.0, 4, galerkin(2)))
    found = solve(hovi.TrajectoryProblem(own, State([0.0]), State([1.0])))
    with pytest.raises(InputError, match="a _OfTime depends on time"):
        found.advance(DT)
    ld = hovi.DiscreteLagrangian(hovi.spline(1), Grid.uniform(1.0, 4, galerkin(2)))
    turning = solve(hovi.TrajectoryProblem(ld, State([0.0]), Periodic([1.0])))
    with pytest.raises(InputError, match="periodic"):
        turning.advance(DT)


# Time limits


@pytest.mark.parametrize("name", ["free", "limited"])
def test_without_time_the_last_motion_comes_back_shifted(
    name: str, request: pytest.FixtureRequest
) -> None:
    motion: Solution = request.getfixturevalue(name)
    q, v = at(motion, DT)
    state = State(q + np.array([0.0, 0.01]), v)
    rest = motion.advance(DT, state, State([0.95, -0.4]), time_limit=1e-9)
    assert (rest.status, rest.success, rest.nit) == (Status.TIME_LIMIT, False, 0)
    t = np.linspace(0.0, 1.0 - DT, 60)
    whole = motion.trajectory.sample(np.minimum(DT + t, 1.0))
    np.testing.assert_allclose(rest.trajectory.sample(t).q, whole.q, atol=1e-10)
    assert "starts 0.01 rad from the position of 'elbow'" in rest.message
    assert "ends 0.05 rad from the position of 'shoulder'" in rest.message
    again = rest.advance(DT, pushed(motion, 2 * DT))
    assert again.success, again.message


def test_without_time_a_replan_returns_the_motion_as_it_is(limited: Solution) -> None:
    again = limited.replan(goal=[0.95, -0.4], time_limit=1e-9)
    assert again.status is Status.TIME_LIMIT
    np.testing.assert_array_equal(again.trajectory.q, limited.trajectory.q)
    assert "ends 0.05 rad from the position of 'shoulder'" in again.message
    assert limited.replan(time_limit=1e-9).message.endswith("its limits were not checked.")


@pytest.mark.parametrize("steps", [1, 3, 6])
def test_out_of_time_a_motion_meets_ends_and_limits_or_says_what_it_misses(
    limited: Solution, steps: int
) -> None:
    """Every step after the first ones takes longer than the limit."""

    def slow(number: int, value: float) -> None:
        time.sleep(2.0 if number >= steps else 0.0)

    state = pushed(limited, 0.1, 3e-3)
    found = limited.advance(0.1, state, [0.93, -0.38], time_limit=2.5, report=slow)
    assert found.status in (Status.TIME_LIMIT, Status.MINIMUM)
    limits = found.problem.limits  # type: ignore[union-attr]
    assert limits is not None
    if "this is the last motion" in found.message:
        assert "starts" in found.message
        np.testing.assert_allclose(found.trajectory.q[0], at(limited, 0.1)[0], atol=1e-9)
        return
    assert excess(found, limits) <= 1e-6
    np.testing.assert_allclose(found.trajectory.q[0], state.q, atol=1e-9)
    if "brakes to rest" in found.message:
        assert found.usable
        assert not found.success
        np.testing.assert_array_equal(found.trajectory.v[-1], 0.0)
    else:
        np.testing.assert_allclose(found.trajectory.q[-1], [0.93, -0.38], atol=1e-9)
