"""[[segments]] of a scene file: the same words as in Python, and errors with their line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import hovi
from hovi import PlanOptions
from hovi.errors import InputError, SceneError
from hovi.planning.task_file.reading import load_task
from hovi.planning.task_file.task import Task
from hovi.planning.task_file.task_plan import plan_task
from hovi.planning.task_file.writing import save_task

PICK = """\
robot = "two_link.urdf"
limits = "none"
[start]
q = [0.0, 0.0]
[[segments]]
name = "reach"
duration = "600 ms"
limits = { base = "none", v = 20.0 }
[segments.goal]
q = [0.7, 0.9]
[[segments]]
duration = 0.9
[segments.goal]
frame = "tip"
position = [-0.6, 0.0, 1.4]
free_velocity = ["all"]
[segments.effects.payload]
frame = "tip"
mass = 0.5
[[segments]]
duration = 0.8
goal = { q = { shoulder = 0.1, elbow = 0.2 } }
[effects.gravity]
"""


def write(folder: Path, text: str) -> Path:
    (folder / "two_link.urdf").write_text(hovi.example("two_link.urdf").read_text())
    (folder / "scene.toml").write_text(text)
    return folder / "scene.toml"


def test_a_file_says_what_python_says(tmp_path: Path) -> None:
    task = load_task(write(tmp_path, PICK))
    assert task.duration == pytest.approx(2.3)
    goal = hovi.FrameGoal("tip", position=[-0.6, 0.0, 1.4], free_velocity=["all"])
    segments = [
        hovi.Segment([0.7, 0.9], "600 ms", limits={"base": "none", "v": 20.0}, name="reach"),
        hovi.Segment(goal, 0.9, effects=[hovi.effects.Payload(frame="tip", mass=0.5)]),
        hovi.Segment([0.1, 0.2], 0.8),
    ]
    robot = hovi.load_robot(hovi.example("two_link.urdf"))
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    options = {"scheme": "galerkin-2", "intervals": 12}
    found = plan_task(task, **options)
    by_python = hovi.plan_sequence(scene, [0.0, 0.0], segments, limits="none", **options)
    assert found.cost == by_python.cost
    np.testing.assert_array_equal(found.trajectory.q, by_python.trajectory.q)
    names = ["reach", "segment 2", "segment 3"]
    assert found.trajectory.metadata["segment_names"] == names


def test_a_saved_sequence_is_read_back(tmp_path: Path) -> None:
    task = load_task(write(tmp_path, PICK))
    again = load_task(save_task(task, tmp_path / "copy" / "copy.toml"))
    assert [each.name for each in again.segments] == ["reach", "", ""]
    assert [each.duration for each in again.segments] == [0.6, 0.9, 0.8]
    assert again.segments[0].limits == task.segments[0].limits
    assert again.segments[1].effects == task.segments[1].effects
    goal = again.segments[1].goal
    assert isinstance(goal, hovi.FrameGoal)
    assert goal.free_velocity == ("all",)
    np.testing.assert_array_equal(goal.position, [-0.6, 0.0, 1.4])  # type: ignore[arg-type]
    options = {"scheme": "galerkin-2", "intervals": 6}
    assert plan_task(again, **options).cost == plan_task(task, **options).cost


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("q = [0.7, 0.9]", "q = [0.7]", "line 10: segments[0].goal.q has shape (1,)"),
        ('frame = "tip"\nposition', 'frame = "tup"\nposition', "line 14: "),
        ("mass = 0.5", "mas = 0.5", "line 19: unknown key `segments[1].effects.payload.mas`"),
        ("mass = 0.5", "mass = -0.5", "line 17: effect 'payload': mass must be finite"),
        ("[segments.effects.payload]", "[segments.effects.paylod]", "line 17: there is no effect"),
        ('"600 ms"', '"6 parsecs"', "line 7: the duration of a segment '6 parsecs' has the unit"),
        ('"600 ms"', "-1.0", "line 7: `segments[0].duration` must be a positive number"),
        ("v = 20.0", "v = -20.0", "line 8: limits.v of 'shoulder' must be a positive number"),
        ("v = 20.0", "speed = 1.0", "line 8: unknown key `segments[0].limits.speed`"),
        ('{ base = "none", v = 20.0 }', '"pandda"', 'line 8: `segments[0].limits` must be "urdf"'),
        ("duration = 0.9\n", "", "`segments[1].duration` is missing"),
        ("duration = 0.9", "time = 0.9", "line 12: unknown key `segments[1].time`"),
        (
            "duration = 0.8\ngoal",
            "duration = 0.8\n#",
            "the last segment, 'segment 3', needs a goal",
        ),
        ('name = "reach"', 'name = "segment 2"', "two segments have the name 'segment 2'"),
        ("q = [0.7, 0.9]", "q = [0.7, 0.9]\na = [1.0, 1.0]", "the goal of 'reach' takes no `a`"),
        ("[start]", "duration = 2.0\n[start]", "line 3: a file with [[segments]] takes no"),
        ("[start]", "[goal]\nq = [0.0, 0.0]\n[start]", "line 3: a file with [[segments]] takes"),
        ("[start]", "time_weight = 1.0\n[start]", "time_weight needs a free duration"),
    ],
)
def test_an_error_has_its_line(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in PICK
    with pytest.raises((SceneError, InputError)) as raised:
        load_task(write(tmp_path, PICK.replace(old, new, 1)))
    assert said in str(raised.value)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("key", ["duration", "goal"])
def test_a_file_without_segments_needs_a_duration_and_a_goal(tmp_path: Path, key: str) -> None:
    text = (
        'robot = "two_link.urdf"\nduration = 1.0\n[start]\nq = [0.0, 0.0]\n[goal]\nq = [1, 1.0]\n'
    )
    old = "duration = 1.0\n" if key == "duration" else "[goal]\nq = [1, 1.0]\n"
    with pytest.raises(SceneError, match=f"`{key}` is missing; it must be a"):
        load_task(write(tmp_path, text.replace(old, "")))


def test_the_duration_of_a_sequence_is_that_of_its_segments(tmp_path: Path) -> None:
    task = load_task(write(tmp_path, PICK))
    with pytest.raises(InputError, match=r"is that of its segments, 2\.3 s, got 3"):
        Task(task.scene, task.start, task.goal, 3.0, PlanOptions(), "pick", task.segments)
    with pytest.raises(InputError, match="an experiment takes one motion, and task 'scene' has 3"):
        task.require_one_motion("an experiment")
