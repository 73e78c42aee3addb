"""`replan` and `advance` take the starts and goals that `plan` and scene files take."""

from __future__ import annotations

import inspect
import warnings
from typing import Any

import numpy as np
import pytest

import hovi
from hovi.errors import InputError, UnreachableError
from samples.small_robots import with_shapes

Q = [0.3, -1.2, 1.2, -0.5, 0.3, 0.1]
HAND = [0.45, 0.25, 0.35]


@pytest.fixture(scope="module")
def planned() -> hovi.Solution:
    robot = hovi.load_robot("ur5")
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    return hovi.plan(
        scene,
        [0.0, -1.2, 1.2, -0.5, 0.3, 0.1],
        Q,
        1.5,
        limits="none",
        intervals=30,
        self_collision=False,
    )


def by_joint(robot: hovi.Robot, q: list[float]) -> dict[str, float]:
    return dict(zip(robot.joint_names, q, strict=True))


GOALS: dict[str, Any] = {
    "a table with q": lambda robot: {"q": Q},
    "a table with joints": lambda robot: {"q": by_joint(robot, Q), "v": {"elbow_joint": 0.0}},
    "joints": lambda robot: by_joint(robot, Q),
    "a state": lambda robot: hovi.State(Q),
    "a configuration": lambda robot: Q,
}


@pytest.mark.parametrize("form", GOALS)
def test_every_form_of_a_goal_is_the_same_goal(planned: hovi.Solution, form: str) -> None:
    robot = planned.trajectory.robot
    again = planned.replan(goal=GOALS[form](robot))
    assert again.cost == pytest.approx(planned.cost, rel=1e-9)
    rest = planned.advance("500 ms", goal=GOALS[form](robot))
    assert rest.trajectory.duration == pytest.approx(1.0)
    np.testing.assert_allclose(rest.trajectory.q[-1], Q, atol=1e-12)


def test_a_table_of_a_frame_is_met(planned: hovi.Solution) -> None:
    robot = planned.trajectory.robot
    assert robot is not None
    found = planned.replan(goal={"frame": "tool0", "position": HAND})
    place = robot.frame_pose("tool0", found.trajectory.q[-1])[:3, 3]
    np.testing.assert_allclose(place, HAND, atol=1e-8)


def test_a_start_may_be_a_pose_or_a_frame_near_the_old_start(planned: hovi.Solution) -> None:
    robot = planned.trajectory.robot
    assert robot is not None
    begin = robot.frame_pose("tool0", planned.trajectory.q[0])
    found = planned.replan(start={"frame": "tool0", "pose": begin})
    np.testing.assert_allclose(found.trajectory.q[0], planned.trajectory.q[0], atol=1e-6)
    with pytest.raises(UnreachableError):
        planned.replan(start={"frame": "tool0", "position": [9.0, 0.0, 0.0]})


UP, DOWN = [0.9, 0.8], [1.5312840589, -0.8]
"""Two configurations of the two-link arm with its tip at the same place."""


def from_frame(start: Any, goal: Any, guess: Any = None, to: Any = None, **given: Any) -> Any:
    """Where a motion starts that is replanned from a frame at the place of UP and DOWN."""
    robot = with_shapes("two_link.urdf")
    options = {"limits": "none", "self_collision": False, "intervals": 8, **given}
    found = hovi.plan(hovi.Scene(robot), start, goal, 1.0, **options)
    assert found.success, found.message
    at = robot.frame_position("tip", np.array(UP))
    again = found.replan(start=hovi.FrameGoal("tip", position=at, guess=guess), goal=to)
    assert again.success, again.message
    return again.trajectory.q[0]


def test_of_the_configurations_of_a_frame_the_nearest_to_the_old_start_is_taken() -> None:
    """Not the one that is nearest to the goal or to zero; a guess is nearer than anything."""
    old, goal = [1.4, -0.7], [0.8, 0.7]
    np.testing.assert_allclose(from_frame(old, goal), DOWN, atol=1e-6)
    np.testing.assert_allclose(from_frame(old, goal, guess=UP), UP, atol=1e-6)


@pytest.mark.parametrize(
    ("old", "goal", "other"), [([0.5, 1.1], [0.3, 0.7], DOWN), ([1.9, -1.1], [2.1, -0.7], UP)]
)
def test_of_the_configurations_of_a_frame_one_clear_of_obstacles_is_taken(
    old: Any, goal: Any, other: Any
) -> None:
    robot = with_shapes("two_link.urdf")
    nearest = DOWN if other is UP else UP
    np.testing.assert_allclose(from_frame(old, goal), nearest, atol=1e-6)
    ball = hovi.Sphere(robot.frame_position("elbow", np.array(nearest)), 0.1)
    found = from_frame(old, goal, to=np.add(other, 0.1), obstacles=[ball])
    np.testing.assert_allclose(found, other, atol=1e-6)


@pytest.mark.parametrize(("old", "other"), [([0.9, 0.1], DOWN), ([1.5, -0.1], UP)])
def test_of_the_configurations_of_a_frame_one_within_the_limits_is_taken(
    old: Any, other: Any
) -> None:
    """In a sequence those of the first segment."""
    bounds = sorted([0.2 * np.sign(old[1]), 3.0 * np.sign(other[1])])
    limits = {"base": "none", "q": {"elbow": bounds}}
    found = from_frame(old, [1.2, 0.0], limits=limits)
    np.testing.assert_allclose(found, other, atol=1e-6)
    scene = hovi.Scene(with_shapes("two_link.urdf"))
    segments = [hovi.Segment([1.2, 0.0], 0.6, limits=limits), hovi.Segment([1.0, 0.0], 0.6)]
    options = {"limits": "none", "self_collision": False, "intervals": 8}
    motion = hovi.plan_sequence(scene, old, segments, **options)
    start = {"frame": "tip", "position": scene.robot.frame_position("tip", np.array(UP))}
    again = motion.replan(start=start)
    np.testing.assert_allclose(again.trajectory.q[0], other, atol=1e-6)


def test_a_solved_problem_without_obstacles_starts_at_a_frame() -> None:
    scene = hovi.Scene(with_shapes("two_link.urdf"))
    grid = hovi.Grid.uniform(1.0, 8, hovi.schemes.by_name("galerkin-2"))
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
    solved = hovi.solve(hovi.TrajectoryProblem(ld, hovi.State([0.5, 0.5]), hovi.State([1.0, 0.5])))
    at = scene.robot.frame_position("tip", np.array(UP))
    again = solved.replan(start={"frame": "tip", "position": at})
    np.testing.assert_allclose(again.trajectory.q[0], UP, atol=1e-6)


@pytest.mark.parametrize(
    ("frame", "words"), [("shoulder_pan", "no frame"), ("base_link", "as no joint moves it")]
)
def test_a_start_at_a_frame_that_cannot_be_led_anywhere_is_refused(
    planned: hovi.Solution, frame: str, words: str
) -> None:
    for start in ({"frame": frame, "position": HAND}, hovi.FrameGoal(frame, position=HAND)):
        with pytest.raises(InputError, match=words):
            planned.replan(start=start)


def test_times_may_be_texts(planned: hovi.Solution) -> None:
    rest = planned.advance("300 ms", duration="1 s", time_limit="1 min")
    assert rest.trajectory.duration == pytest.approx(1.0)
    with pytest.raises(InputError, match="has the unit 'parsec'"):
        planned.advance("300 parsec")


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        ({"q": Q, "frame": "tool0"}, "takes no `q`"),
        ({"frame": "tool9", "position": HAND}, "tool9"),
        ({"position": HAND}, "needs a `frame`"),
        ({"elbow_joint": 0.3}, "leaves out joint"),
        ({"q": Q, "speed": Q}, "unknown key `goal.speed`"),
        ({"q": Q, "velocity": Q}, "`velocity` needs a `frame`: velocities of joints are `v`"),
        ("default", "pose"),
    ],
)
def test_what_is_no_goal_gets_the_sentence_of_plan(
    planned: hovi.Solution, wrong: Any, sentence: str
) -> None:
    with pytest.raises(InputError, match=sentence) as told:
        planned.replan(goal=wrong)
    assert planned.problem is not None
    with pytest.raises(InputError) as by_plan:
        hovi.plan(planned.problem.scene, Q, wrong, 1.5, self_collision=False)
    assert str(told.value) == str(by_plan.value)


def test_a_measured_configuration_without_a_velocity_is_warned_of(planned: hovi.Solution) -> None:
    passed = planned.trajectory.sample(np.array([0.7]))
    with pytest.warns(hovi.errors.HoviWarning, match=r"passes at up to .* give hovi.State\(q, v\)"):
        planned.advance(0.7, passed.q[0])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        planned.advance(0.7, hovi.State(passed.q[0], passed.v[0]))
        planned.advance(0.7)


OWN = {"scene", "start", "goal", "progress", "options", "guess", "time_limit", "strict", "seed"}


@pytest.mark.parametrize("method", ["replan", "advance"])
def test_every_other_option_of_plan_is_kept(planned: hovi.Solution, method: str) -> None:
    """Or is one of `solve` as well; none of them is unknown."""
    options = {*inspect.signature(hovi.PlanOptions).parameters, "duration"}
    kept = options - OWN - {*inspect.signature(hovi.solve).parameters}
    kept -= {"duration"} if method == "advance" else set()
    assert {"tolerance", "limits", "via", "obstacles"} < kept
    call = {"replan": planned.replan, "advance": lambda **given: planned.advance(0.1, **given)}
    for name in kept:
        with pytest.raises(
            InputError, match=f"{method} keeps `{name}` as planned: call plan again"
        ):
            call[method](**{name: None})


def test_an_option_that_does_not_exist_is_named(planned: hovi.Solution) -> None:
    with pytest.raises(InputError, match="replan has no option 'gaol': did you mean 'goal'"):
        planned.replan(gaol=Q)
    with pytest.raises(InputError, match="advance has no option 'durations': did you mean"):
        planned.advance(0.1, durations=1.0)
    with pytest.raises(InputError, match=r"replan keeps `duration` as planned: call plan again"):
        planned.replan(duration=1.0)
    with pytest.raises(InputError, match=r"advance keeps `limits` as planned"):
        planned.advance(0.1, limits="none")
    with pytest.raises(InputError, match="replan has no option 'near'"):
        planned.replan(near=True)
    assert planned.replan(max_iterations=50, escape_saddles=False).success


def test_a_problem_about_no_robot_has_no_frames() -> None:
    grid = hovi.Grid.uniform(1.0, 4, hovi.schemes.galerkin(1))
    ld = hovi.DiscreteLagrangian(hovi.spline(2), grid)
    problem = hovi.TrajectoryProblem(ld, hovi.State([0.0, 0.0]), hovi.State([1.0, 0.5]))
    found = hovi.solve(problem)
    assert found.replan(goal={"q": [1.0, 0.7]}).success
    for end in ({"goal": {"frame": "tip", "position": HAND}}, {"start": {"frame": "tip"}}):
        with pytest.raises(InputError):
            found.replan(**end)
