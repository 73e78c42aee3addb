"""`replan` and `advance` take the starts and goals that `plan` and scene files take."""

from __future__ import annotations

import inspect
import warnings
from typing import Any

import numpy as np
import pytest

import hovi
from hovi.errors import InputError, UnreachableError

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
        ({"q": Q, "velocity": Q}, "unknown key `goal.velocity`"),
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
