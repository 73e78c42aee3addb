"""Whether a motion can be used, minimum or not: its ends, limits, distances and equations."""

from __future__ import annotations

import dataclasses

import pytest

import hovi
from hovi.errors import InputError

START, GOAL = [0.0, 0.0], [0.7, 0.9]


@pytest.fixture(scope="module")
def scene() -> hovi.Scene:
    robot = hovi.load_robot(hovi.example("two_link.urdf"))
    return hovi.Scene(robot, [hovi.effects.Gravity(9.8)])


@pytest.fixture(scope="module")
def found(scene: hovi.Scene) -> hovi.Solution:
    return hovi.plan(scene, START, GOAL, 1.0, limits={"base": "none", "v": 3.0}, intervals=8)


def of_problem(found: hovi.Solution, **changes: object) -> hovi.Solution:
    """The same motion as the answer to another problem."""
    assert found.problem is not None
    problem = dataclasses.replace(found.problem, **changes)
    return dataclasses.replace(found, problem=problem)


def test_a_minimum_is_usable(found: hovi.Solution) -> None:
    assert found.success
    assert (found.usable, found.violation) == (True, "")


@pytest.mark.parametrize(
    ("changes", "clause"),
    [
        ({"goal": hovi.State([0.7, 1.0])}, "ends 0.1 rad from the position of 'elbow'"),
        ({"start": hovi.State(START, [0.5, 0.0])}, "starts 0.5 rad/s from the velocity"),
        (
            {"goal": hovi.FrameGoal("tip", position=[0, 0, 0.5])},
            "goal at t = 1 s is missed: frame",
        ),
    ],
)
def test_ends_that_are_missed_are_named(
    found: hovi.Solution, changes: dict[str, object], clause: str
) -> None:
    other = of_problem(found, **changes)
    assert not other.usable
    assert clause in other.violation


@pytest.mark.parametrize(
    ("kind", "said"), [("v", "the velocity of joint '"), ("tau", "the torque of joint '")]
)
def test_a_limit_that_is_exceeded_is_named(found: hovi.Solution, kind: str, said: str) -> None:
    limits = hovi.as_limits(found.problem.robot, {"base": "none", kind: 1.0})  # type: ignore[union-attr]
    other = of_problem(found, limits=limits)
    assert not other.usable
    assert other.violation.startswith(said)
    assert other.violation.endswith("its limit is 1")
    loose = dataclasses.replace(limits, tolerance=100.0)
    assert of_problem(found, limits=loose).usable


def test_an_obstacle_that_is_hit_is_named(found: hovi.Solution) -> None:
    robot = found.problem.robot  # type: ignore[union-attr]
    x, y, z = robot.frame_pose("tip", found.trajectory.sample([0.5]).q[0])[:3, 3]
    ball = hovi.Clearance([hovi.Sphere([x, y, z], 0.05, name="ball")])
    assert "and obstacle 'ball' overlap by" in of_problem(found, clearance=ball).violation
    far = hovi.Clearance([hovi.Sphere([x, y + 5.0, z], 0.05, name="ball")])
    assert of_problem(found, clearance=far).usable


def test_a_passive_joint_with_a_torque_is_named(scene: hovi.Scene) -> None:
    free = hovi.plan(scene, START, GOAL, 1.0, limits="none", intervals=8)
    assert free.problem is not None
    hinge = dataclasses.replace(scene, passive=("elbow",))
    ld = hovi.DiscreteLagrangian(hinge.effort_lagrangian(), free.trajectory.grid)
    problem = hovi.TrajectoryProblem(ld, hovi.State(START), hovi.State(GOAL))
    other = dataclasses.replace(free, problem=problem)
    assert other.violation.startswith("the torque at passive joint 'elbow' is ")
    assert other.violation.endswith(" of the largest")


def test_a_via_point_that_is_missed_is_named_with_its_time(found: hovi.Solution) -> None:
    robot = found.problem.robot  # type: ignore[union-attr]
    x, y, z = robot.frame_pose("tip", found.trajectory.sample([0.5]).q[0])[:3, 3]
    via = (hovi.Via(0.5, hovi.FrameGoal("tip", position=[x, y, z])),)
    assert of_problem(found, via=via).usable
    via = (hovi.Via(0.5, hovi.FrameGoal("tip", position=[x, y, z + 0.02])),)
    missed = of_problem(found, via=via).violation
    assert missed.startswith("the goal at t = 0.5 s is missed: ")
    assert "0.02 m" in missed


def test_a_motion_that_ran_out_of_time_says_whether_it_can_be_used(scene: hovi.Scene) -> None:
    limits = {"base": "none", "v": 1.2}
    late = hovi.plan(scene, START, GOAL, 1.0, limits=limits, intervals=64, time_limit=1e-3)
    assert late.status is hovi.Status.TIME_LIMIT
    assert late.usable == (late.violation == "")
    assert "its limit is 1.2" in late.violation


def test_a_solution_without_a_problem_cannot_tell(found: hovi.Solution) -> None:
    alone = dataclasses.replace(found, problem=None)
    for ask in (lambda: alone.usable, alone.margins):
        with pytest.raises(InputError, match="has no problem"):
            ask()
