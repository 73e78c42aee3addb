"""Motions with a cost on the jerk: smooth = True, and limits on the jerk and the torque rate."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

import hovi
from hovi.effects import Gravity, JerkCost
from hovi.errors import InputError
from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]
START = np.array([0.0, -1.2, 1.4, -1.0, -1.5, 0.0])
GOAL = np.array([1.0, -0.8, 0.9, -1.4, -1.2, 0.5])


@pytest.fixture(scope="module")
def ur5() -> hovi.Scene:
    return hovi.Scene(hovi.load_robot("ur5"), [Gravity()])


def rows(motion: hovi.Trajectory, per_interval: int = 65) -> tuple[Array, ...]:
    """t and q, v, a, tau, jerk and d tau / dt along a motion, torques and their rates by RNEA.

    Both ends of every interval are sampled: jerk and d tau / dt jump at the nodes.
    """
    N = motion.grid.intervals
    k, s = np.repeat(np.arange(N), per_interval), np.tile(np.linspace(0, 1, per_interval), N)
    q, v, a, j = motion.jet_intervals(k, s, 3)
    model = motion.scene.model  # type: ignore[union-attr]
    data = model.createData()

    def rnea(h: float) -> Array:
        x = q + v * h + a * h**2 / 2 + j * h**3 / 6, v + a * h + j * h**2 / 2, a + j * h
        return np.array([pin.rnea(model, data, *row) for row in zip(*x, strict=True)])

    t = motion.t[k] + s * motion.grid.steps[k]
    return t, q, v, a, rnea(0.0), j, (rnea(1e-5) - rnea(-1e-5)) / 2e-5


@pytest.fixture(scope="module")
def smooth(ur5: hovi.Scene) -> hovi.Solution:
    return hovi.plan(ur5, START, GOAL, 1.5, smooth=True, self_collision=False)


def test_a_smooth_motion_begins_and_ends_without_acceleration(smooth: hovi.Solution) -> None:
    assert smooth.success, smooth.message
    q, v, a = smooth.trajectory.jet([0.0, 1.5])
    np.testing.assert_allclose(q, [START, GOAL], atol=1e-12)
    np.testing.assert_allclose(v, 0.0, atol=1e-12)
    np.testing.assert_allclose(a, 0.0, atol=1e-9)


def test_accelerations_and_torques_are_continuous(smooth: hovi.Solution) -> None:
    """At the nodes, from the left and from the right; the motion of least effort jumps there."""
    motion = smooth.trajectory
    k = np.arange(motion.grid.intervals - 1)
    left = motion.sample_intervals(k, np.ones(len(k)))
    right = motion.sample_intervals(k + 1, np.zeros(len(k)))
    np.testing.assert_allclose(left.a, right.a, atol=1e-9 * np.abs(left.a).max())
    np.testing.assert_allclose(left.tau, right.tau, atol=1e-9 * np.abs(left.tau).max())


def test_the_weight_follows_from_the_largest_inertia_and_the_duration(
    ur5: hovi.Scene, smooth: hovi.Solution
) -> None:
    """w = (T M / 100)^2 with M the largest eigenvalue of the mass matrix at both ends."""
    data = ur5.model.createData()
    masses = [np.linalg.eigvalsh(pin.crba(ur5.model, data, q)).max() for q in (START, GOAL)]
    scene = smooth.trajectory.scene
    assert scene is not None
    assert scene.terms.jerk_weight == pytest.approx((0.01 * 1.5 * max(masses)) ** 2, rel=1e-12)


def test_sliding_joints_have_a_weight_by_their_own_inertia() -> None:
    robot = hovi.load_robot(Path(hovi.example("cart_pole_swing_up")).parent / "cart_pole.urdf")
    scene = hovi.Scene(robot, [Gravity()])
    found = hovi.plan(scene, [0.0, 0.0], [0.5, 0.3], 1.0, smooth=True, limits="none")
    assert found.success, found.message
    M = pin.crba(scene.model, scene.model.createData(), np.array([0.5, 0.3]))
    assert found.trajectory.scene is not None
    weight = found.trajectory.scene.terms.jerk_weight
    np.testing.assert_allclose(weight, (0.01 * np.diag(M)) ** 2, rtol=1e-12)


def test_the_cost_contains_the_jerk_and_the_effort_does_not(smooth: hovi.Solution) -> None:
    t, _, _, _, tau, j, _ = rows(smooth.trajectory, 401)
    assert smooth.trajectory.scene is not None
    weight = smooth.trajectory.scene.terms.jerk_weight
    effort = 0.5 * np.trapezoid((tau**2).sum(axis=1), t)
    jerk = 0.5 * np.trapezoid((weight * j**2).sum(axis=1), t)
    assert smooth.cost == pytest.approx(effort + jerk, rel=1e-5)
    assert jerk > 0.01 * effort


@pytest.mark.parametrize("kind", ["jerk", "torque_rate"])
def test_a_limit_on_a_rate_holds_everywhere(
    ur5: hovi.Scene, smooth: hovi.Solution, kind: str
) -> None:
    """It is exceeded without it, and is reached with it."""
    column = {"jerk": 5, "torque_rate": 6}[kind]
    bound = 0.8 * float(np.abs(rows(smooth.trajectory)[column]).max())
    found = hovi.plan(
        ur5, START, GOAL, 1.5, smooth=True, limits={kind: bound}, self_collision=False
    )
    assert found.success, found.message
    values = rows(found.trajectory)[column]
    assert 0.9 * bound < np.abs(values).max() < (1 + 3e-6) * bound
    assert found.cost > smooth.cost
    assert found.problem is not None
    finer = hovi.solve(found.problem.on(found.trajectory.grid.halved()), found.trajectory)
    assert finer.success, finer.message
    assert finer.cost == pytest.approx(found.cost, rel=2e-3)


def test_far_limits_on_the_torque_rate_change_nothing(ur5: hovi.Scene) -> None:
    one, other = (
        hovi.plan(ur5, START, GOAL, 1.5, smooth=True, limits=limits, self_collision=False)
        for limits in ({"a": 6.0}, {"a": 6.0, "torque_rate": 1e5})
    )
    assert one.success
    assert other.success
    assert one.cost == pytest.approx(other.cost, rel=1e-6)  # other parts are halved


def test_given_accelerations_are_met(ur5: hovi.Scene) -> None:
    start = hovi.State(START, a=np.full(6, 0.5))
    goal = hovi.State(GOAL, np.full(6, 0.1), a=np.full(6, -0.3))
    found = hovi.plan(ur5, start, goal, 1.5, smooth=True, self_collision=False)
    assert found.success, found.message
    _, v, a = found.trajectory.jet([0.0, 1.5])
    np.testing.assert_allclose(a, [np.full(6, 0.5), np.full(6, -0.3)], atol=1e-9)
    np.testing.assert_allclose(v[1], 0.1, atol=1e-9)


def test_an_end_acceleration_outside_its_limits_is_infeasible_by_name(ur5: hovi.Scene) -> None:
    start = hovi.State(START, a=np.full(6, 7.0))
    found = hovi.plan(ur5, start, GOAL, 1.5, smooth=True, limits={"a": 6.0}, self_collision=False)
    assert found.status == "infeasible"
    assert "acceleration of joint 'shoulder_pan_joint' at the start is 7 rad/s^2" in found.message


def test_frames_via_points_and_obstacles_go_with_a_cost_on_the_jerk(ur5: hovi.Scene) -> None:
    via = hovi.Via(0.7, hovi.State((START + GOAL) / 2, free_velocity=ur5.robot.joint_names))
    middle = hovi.plan(ur5, START, GOAL, 1.5, smooth=True, via=[via], self_collision=False)
    assert middle.success, middle.message
    np.testing.assert_allclose(
        middle.trajectory.configurations([0.7])[0], (START + GOAL) / 2, atol=1e-8
    )
    frame = ur5.robot.tip_frame
    position = ur5.robot.frame_positions((frame,), GOAL[None])[0][0]
    reach = hovi.plan(
        ur5, START, hovi.FrameGoal(frame, position=position), 1.5, smooth=True, self_collision=False
    )
    assert reach.success, reach.message
    end = ur5.robot.frame_positions((frame,), reach.trajectory.q[-1:])[0][0]
    np.testing.assert_allclose(end, position, atol=1e-7)


def test_several_starts_and_a_free_duration_go_with_it(ur5: hovi.Scene) -> None:
    several = hovi.plan(
        ur5, START, GOAL, 1.5, smooth=True, starts=3, processes=1, self_collision=False
    )
    assert several.success, several.message
    free = hovi.plan(
        ur5, START, GOAL, (0.8, 4.0), smooth=True, time_weight=100.0, self_collision=False
    )
    assert free.success, free.message
    assert 0.8 < free.trajectory.duration < 4.0
    assert abs(free.duration_derivative + 100.0) < 0.2


def test_a_smooth_motion_replans_and_survives_a_file(smooth: hovi.Solution, tmp_path: Path) -> None:
    again = smooth.replan(goal=GOAL + 0.01)
    assert again.success, again.message
    np.testing.assert_allclose(again.trajectory.jet([0.0, 1.5])[2], 0.0, atol=1e-9)
    smooth.trajectory.save(tmp_path / "motion.npz")
    loaded = hovi.Trajectory.load(tmp_path / "motion.npz")
    t = np.linspace(0.0, 1.5, 7)
    for one, other in zip(loaded.sample(t), smooth.trajectory.sample(t), strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("duration", [5e-324, 1e-200, 1e160, 1e308])
def test_a_duration_whose_square_is_no_number_is_refused(two_link: Robot, duration: float) -> None:
    """The weight is (T M / 100)^2."""
    scene, ends = hovi.Scene(two_link, [Gravity()]), ([0.0, 0.0], [0.3, 0.7])
    with pytest.raises(InputError, match=re.escape(f"too long for that at {duration:.3g} s")):
        hovi.plan(scene, *ends, duration, smooth=True)


def test_both_smooth_and_a_weight_of_the_jerk_are_refused(ur5: hovi.Scene) -> None:
    scene = hovi.Scene(ur5.robot, [Gravity(), JerkCost(0.1)])
    with pytest.raises(InputError, match="leave one of the two out"):
        hovi.plan(scene, START, GOAL, 1.5, smooth=True, self_collision=False)


def test_limits_on_rates_without_a_cost_on_the_jerk_are_refused(ur5: hovi.Scene) -> None:
    for limits in ({"jerk": 10.0}, {"torque_rate": 10.0}):
        with pytest.raises(InputError, match="add the effect jerk_cost to the scene, set smooth"):
            hovi.plan(ur5, START, GOAL, 1.5, limits=limits, self_collision=False)


def test_continuous_joints_move_smoothly_within_limits_on_the_torque_rate() -> None:
    """The kinova's; the rate by differences of the fourth order of the torque along the motion."""
    robot = hovi.load_robot("kinova")
    scene = hovi.Scene(robot, [Gravity()])
    start = robot.integrate(robot.neutral(), np.array([0.3, 2.8, 1.2, 0.5, 1.0, 0.2]))
    goal = robot.integrate(start, np.array([0.8, 0.4, -0.3, 0.6, 0.4, -0.5]))
    free = hovi.plan(scene, start, goal, 1.5, smooth=True, self_collision=False)
    assert free.success, free.message

    def largest_rate(motion: hovi.Trajectory) -> float:
        t, h = np.linspace(0.01, 1.49, 1_001), 1e-4
        tau = [motion.sample(t + i * h).tau for i in (-2, -1, 1, 2)]
        return float(np.abs((tau[0] - 8 * tau[1] + 8 * tau[2] - tau[3]) / (12 * h)).max())

    bound = 0.8 * largest_rate(free.trajectory)
    found = hovi.plan(
        scene, start, goal, 1.5, smooth=True, limits={"torque_rate": bound}, self_collision=False
    )
    assert found.success, found.message
    np.testing.assert_allclose(found.trajectory.jet([0.0, 1.5])[2], 0.0, atol=1e-9)
    assert largest_rate(found.trajectory) < (1 + 1e-4) * bound


def test_orientations_are_refused_by_name() -> None:
    scene = hovi.Scene(hovi.load_robot(hovi.example("flying_body.urdf"), free_flyer=True))
    q = scene.robot.neutral()
    with pytest.raises(InputError, match="order 3 need the third derivatives of charts"):
        hovi.plan(scene, q, q, 1.0, smooth=True, limits="none")


def test_a_limit_on_the_torque_rate_alone_holds(two_link: Robot) -> None:
    scene = hovi.Scene(two_link, [Gravity()])
    start, goal = np.zeros(2), np.array([1.0, 0.6])
    free = hovi.plan(scene, start, goal, 1.0, smooth=True, limits="none")
    bound = 0.7 * float(np.abs(rows(free.trajectory)[6]).max())
    limits = {"base": "none", "torque_rate": bound}
    found = hovi.plan(scene, start, goal, 1.0, smooth=True, limits=limits)
    assert found.success, found.message
    assert np.abs(rows(found.trajectory)[6]).max() < (1 + 3e-6) * bound


def test_a_via_point_takes_no_acceleration() -> None:
    with pytest.raises(InputError, match="a via point takes no `a`: leave it out"):
        hovi.Via(0.5, hovi.State([0.0, 0.0], a=[1.0, 0.0]))
    with pytest.raises(InputError, match="takes no `free_acceleration`"):
        hovi.Via(0.5, hovi.State([0.0, 0.0], free_acceleration=("elbow",)))


def test_a_smooth_motion_replans_to_the_goal_of_a_frame(
    ur5: hovi.Scene, smooth: hovi.Solution
) -> None:
    frame = ur5.robot.tip_frame
    position = ur5.robot.frame_position(frame, GOAL[None])[0] + 0.02
    again = smooth.replan(goal=hovi.FrameGoal(frame, position=position))
    assert again.success, again.message
    end = ur5.robot.frame_position(frame, again.trajectory.q[-1:])[0]
    np.testing.assert_allclose(end, position, atol=1e-7)
    np.testing.assert_allclose(again.trajectory.jet([0.0, 1.5])[2], 0.0, atol=1e-9)


@pytest.mark.parametrize("limits", ["none", {"tau": 40.0, "jerk": 2e3}])
def test_passive_joints_have_no_torque_along_a_smooth_motion(limits: object) -> None:
    """A cart-pole, on the grid of the search within limits and on one with few points."""
    folder = Path(hovi.example("cart_pole_swing_up")).parent
    robot = hovi.load_robot(folder / "cart_pole.urdf")
    passive = robot.joint_names[1]
    scene = hovi.Scene(robot, [Gravity()], passive=[passive])
    found = hovi.plan(scene, [0.0, 0.0], [0.4, 0.0], 1.2, smooth=True, limits=limits)
    assert found.success, found.message
    tau = np.abs(rows(found.trajectory)[4]).max(axis=0)
    assert tau[1] < 0.01 * tau[0]
