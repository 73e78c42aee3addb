"""Full turns of continuous joints in sequences: what goals say, one after the other."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest

import hovi
from hovi.discrete.node_continuity import require_continuous
from hovi.errors import InputError
from hovi.planning.problem.seams import Seam, curve_through, holding
from hovi.robot.space.configuration_space import ConfigurationSpace
from samples.manifold_robots import with_arm
from samples.small_robots import arm, with_shapes

pytestmark = pytest.mark.filterwarnings("ignore::hovi.errors.HoviWarning")
Array = npt.NDArray[np.float64]
ROBOT = arm("c2", ("revolute", "continuous"))
SCENE = hovi.Scene(ROBOT, [hovi.effects.Gravity(9.81)], compile=False)
T = 0.8


def sequence(*goals: Any, limits: Any = "none", duration: float = T) -> hovi.Solution:
    segments = [hovi.Segment(goal, duration) for goal in goals]
    options = {"limits": limits, "self_collision": False, "intervals": 8 * len(goals)}
    return hovi.plan_sequence(SCENE, [0.0, 0.0], segments, **options)


def angles(found: hovi.Solution, stops: int) -> Array:
    """Of the second joint, at the end of every segment."""
    assert found.success, found.message
    return found.trajectory.positions(np.linspace(0.0, found.trajectory.duration, stops + 1))[1:, 1]


def via(*goals: hovi.State) -> hovi.TrajectoryProblem:
    """The problem of a sequence with these goals, the last of the motion."""
    grid = hovi.Grid.uniform(T, 6, hovi.schemes.galerkin(2, points=8))
    parts = [hovi.DiscreteLagrangian(SCENE.effort_lagrangian(), grid) for _ in goals]
    seams = tuple(Seam((i + 1) * T, goal) for i, goal in enumerate(goals[:-1]))
    start = hovi.State([0.0, 0.0])
    return hovi.TrajectoryProblem.of_segments(parts, start, goals[-1], via=seams)


def test_an_angle_at_a_goal_on_the_way_says_its_turns_and_the_rest_follows_from_there() -> None:
    found = sequence([0.5, 7.0], [0.0, 0.0], [0.2, -6.0])
    np.testing.assert_allclose(angles(found, 3), [7.0, 2 * np.pi, -6.0], atol=1e-9)
    assert "'j2' goes a full turn beyond the shortest way, as its goal 7 rad says" in found.message
    assert (
        "'j2' goes 2 full turns beyond the shortest way, as its goal -6 rad says" in found.message
    )


def test_turns_that_nobody_says_count_for_those_that_a_later_goal_says() -> None:
    """0, 3 and on to -1, the shortest way, which is 5.28; from there 7 is near."""
    limits = {"base": "none", "v": 6.0}
    found = sequence([0.5, 3.0], [0.2, -1.0], [0.0, 7.0], limits=limits)
    np.testing.assert_allclose(angles(found, 3), [3.0, 2 * np.pi - 1.0, 7.0], atol=1e-9)


def test_turns_are_given_to_the_goal_of_every_segment() -> None:
    forth, back = (hovi.State([0.1, x], turns={"j2": turns}) for x, turns in ((1.0, -1), (0.0, 1)))
    found = sequence(forth, back, duration=1.2)
    np.testing.assert_allclose(angles(found, 2), [1.0 - 2 * np.pi, 0.0], atol=1e-9)
    both = [hovi.Segment([0.0, 0.0], T), hovi.Segment([0.0, 1.0], T)]
    with pytest.raises(InputError, match="give them to the goal of a segment"):
        hovi.plan_sequence(SCENE, [0.0, 0.0], both, turns={"j2": 1})


def test_a_replan_makes_up_for_turns_after_the_last_seam_alone() -> None:
    found = sequence([0.5, 7.0], [0.0, 0.0])
    for angle in (0.4, 13.0, -5.0):
        again = found.replan(goal=[0.1, angle])
        expected = angle + (2 * np.pi if abs(angle) < np.pi else 0.0)
        np.testing.assert_allclose(angles(again, 2), [7.0, expected], atol=1e-9)


@pytest.mark.parametrize("elapsed", [0.3, 0.8, 1.2])
def test_what_is_left_of_a_sequence_keeps_its_turns(elapsed: float) -> None:
    found = sequence([0.5, 7.0], [0.2, 14.0], [0.0, 0.0])
    left = found.advance(elapsed)
    assert left.success, left.message
    t = np.linspace(0.0, found.trajectory.duration - elapsed, 9)
    expected = found.trajectory.positions(elapsed + t)
    np.testing.assert_allclose(left.trajectory.positions(t), expected, atol=1e-3)


def test_a_guess_of_other_turns_makes_up_for_them_where_they_are_said() -> None:
    """Of two seams; the guess makes no turn at all."""
    straight = hovi.solve(via(*(hovi.State([0.2, x]) for x in (0.3, 0.8, 0.5))))
    wanted = via(*(hovi.State([0.2, x]) for x in (0.3 + 2 * np.pi, 0.8 - 2 * np.pi, 0.5)))
    found = hovi.solve(wanted, straight.trajectory)
    expected = [0.3 + 2 * np.pi, 0.8 - 2 * np.pi, 0.5 - 2 * np.pi]
    np.testing.assert_allclose(angles(found, 3), expected, atol=1e-9)


def test_a_motion_that_misses_the_turns_of_a_seam_is_no_success() -> None:
    straight = hovi.solve(via(hovi.State([0.2, 0.3]), hovi.State([0.0, 0.5])))
    found = hovi.solve(
        via(hovi.State([0.2, 0.3 + 2 * np.pi]), hovi.State([0.0, 0.5])), straight.trajectory.path
    )
    assert not found.success
    assert "a full turn from the goal of 'j2', 6.58" in found.message


def test_a_free_velocity_of_a_guess_is_the_mean_one_with_all_turns() -> None:
    problem = via(hovi.State([0.0, 7.0], free_velocity=["all"]), hovi.State([0.0, 9.0]))
    known = ROBOT, problem.ends, 2 * T, problem.holds, problem.turns
    v = curve_through("cubic", *known)(np.array([T]))[1][0]
    np.testing.assert_allclose(v, [0.0, 9.0 / (2 * T)], atol=1e-12)


@pytest.mark.parametrize("base", ["free-flyer", "spherical", "planar", "continuous"])
def test_a_path_that_is_led_to_its_seams_is_a_path(base: str) -> None:
    """Its intervals end where the next ones begin, with the velocity of the seam."""
    robot = hovi.load_robot(with_arm(base))
    grid = hovi.Grid.uniform(T, 4, hovi.schemes.galerkin(2))
    scene = hovi.Scene(robot, compile=False)
    parts = [hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)] * 2
    ends = [hovi.State(robot.integrate(robot.neutral(), x * np.ones(robot.nv))) for x in (0, 1)]
    middle = robot.integrate(robot.neutral(), 0.4 * np.cos(np.arange(robot.nv)))
    seam = Seam(T, hovi.State(middle, 0.3 * np.ones(robot.nv)))
    problem = hovi.TrajectoryProblem.of_segments(parts, *ends, via=(seam,))
    without = hovi.TrajectoryProblem.of_segments(parts, *ends).guess("cubic")
    path = holding(without, problem.grid, problem.holds, robot)
    require_continuous(path, problem.grid, robot.curved_space)
    np.testing.assert_allclose(robot.difference(middle, path.q[4]), 0.0, atol=1e-12)
    np.testing.assert_array_equal(path.v[4], 0.3)
    np.testing.assert_array_equal(path.q[[0, 1, 6, 8]], without.q[[0, 1, 6, 8]])


@pytest.mark.parametrize("parts", [("SO(2)",), ("SO(3)",), ("SO(3)", "SO(2)", 1)])
def test_a_lagrangian_about_no_robot_has_segments_on_groups(parts: tuple[str | int, ...]) -> None:
    """c/2 |a|^2 of a left-invariant acceleration: turning about one axis, cubics as in one angle.

    From rest at 0 by x at h to y at 2 h, with the weights c and d: with v at the middle free, it is
    where c a = d a' on both sides, so that v = (3 c x + 3 d (y - x)) / (2 h (c + d)).
    """
    space = ConfigurationSpace(parts)
    q, v, a = (
        ca.SX.sym(name, n) for name, n in zip("qva", (space.nq, space.nv, space.nv), strict=True)
    )
    (c, d), h, axis = (1.0, 4.0), 0.5, np.zeros(space.nv)
    axis[0] = 1.0
    grid = hovi.Grid.uniform(h, 3, hovi.schemes.galerkin(2))
    segments = [
        hovi.DiscreteLagrangian(hovi.CasadiLagrangian([q, v, a], w * ca.sumsqr(a) / 2, space), grid)
        for w in (c, d)
    ]
    neutral = {"SO(2)": [1.0, 0.0], "SO(3)": [0.0, 0.0, 0.0, 1.0], 1: [0.0]}
    first = np.concatenate([neutral[part] for part in parts])
    x, y = 0.7, 1.1
    ends = [hovi.State(space.integrate(first, angle * axis)) for angle in (0.0, x, y)]
    seam = Seam(h, hovi.State(ends[1].q, free_velocity=["all"]))
    found = hovi.solve(hovi.TrajectoryProblem.of_segments(segments, ends[0], ends[2], via=(seam,)))
    assert found.success, found.message
    passed = 3 * (c * x + d * (y - x)) / (2 * h * (c + d))
    np.testing.assert_allclose(found.trajectory.v[3], passed * axis, atol=1e-7)


def test_a_passive_joint_is_free_where_a_frame_that_it_does_not_move_has_its_goal() -> None:
    robot = with_shapes("cart_pole.urdf")
    scene = hovi.Scene(robot, [hovi.effects.Gravity(9.81)], passive=("hinge",), compile=False)
    frame = "cart"
    position = robot.frame_position(frame, np.array([0.5, 0.0]))
    goal = hovi.FrameGoal(frame, position=position, free_velocity=["all"])
    segments = [hovi.Segment(goal, 1.0), hovi.Segment([0.0, 0.0], 1.2)]
    found = hovi.plan_sequence(
        scene, [0.0, 0.0], segments, limits="none", self_collision=False, intervals=16
    )
    assert found.success, found.message
    node = int(np.argmin(np.abs(found.trajectory.t - 1.0)))
    q = found.trajectory.q[node]
    np.testing.assert_allclose(robot.frame_position(frame, q), position, atol=1e-8)
    assert abs(q[1]) > 1e-3
