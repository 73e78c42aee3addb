"""[start], [goal] and [[via]] by the target of a frame, as a FrameGoal takes it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import hovi
from hovi.errors import InputError, SceneError

FILE = """robot = "ur5"
duration = 2
[start]
{start}
[goal]
frame = "tool0"
{goal}
[effects.gravity]
"""
WHERE = "position = [0.4, 0.2, 0.3]"
START = f'frame = "tool0"\n{WHERE}\nrpy = [3.0, 0.2, 0.1]'
WAYS = ("rpy = [3.0, 0.2, 0.1]", "quaternion_xyzw = {xyzw}", "quaternion_wxyz = {wxyz}")
ROTATION = np.asarray(hovi.FrameGoal("tool0", rpy=[3.0, 0.2, 0.1]).rotation)


def task_with(folder: Path, start: str, goal: str) -> hovi.Task:
    path = folder / "scene.toml"
    path.write_text(FILE.format(start=start, goal=goal))
    return hovi.load_task(path)


def quaternion() -> list[float]:
    """x, y, z, w of the rotation, from its trace."""
    R = ROTATION
    w = np.sqrt(max(0.0, 1 + np.trace(R))) / 2
    xyz = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / (4 * w)
    return [*xyz.tolist(), float(w)]


@pytest.mark.parametrize("way", WAYS)
def test_a_rotation_is_read_as_in_python_and_written_again(tmp_path: Path, way: str) -> None:
    x, y, z, w = quaternion()
    text = way.format(xyzw=[x, y, z, w], wxyz=[w, x, y, z])
    task = task_with(tmp_path, START, f"{WHERE}\n{text}")
    again = hovi.load_task(hovi.save_task(task, tmp_path / "again.toml"))
    for read in (task, again):
        for end in (read.start, read.goal):
            assert isinstance(end, hovi.FrameGoal)
            np.testing.assert_allclose(end.rotation, ROTATION, atol=1e-12)
            np.testing.assert_allclose(end.position, [0.4, 0.2, 0.3])


@pytest.mark.parametrize(
    ("start", "goal", "sentence"),
    [
        (
            START,
            "quaternion_xyzw = [1, 1, 0, 0]",
            "line 8: the quaternion_xyzw of a frame goal must",
        ),
        (START, "quaternion_xyzw = [1, 0, 0]", "`goal.quaternion_xyzw` must be a list of four"),
        (START, "rpy = [0, 0, 0]\nquaternion_wxyz = [1, 0, 0, 0]", "leave out rpy or quaternion_w"),
        (START + "\nq = [0, 0, 0, 0, 0, 0]", WHERE, "a start of a `frame` takes no `q`"),
        (START + "\nq = []", WHERE, "a start of a `frame` takes no `q`: leave it out"),
        (START, WHERE + "\nrpy = [0, 0, 0]\nv = []", "a goal of a `frame` takes no `v`"),
        (START, WHERE + "\nrpy = [0, 0, 0]\nfree = []", "a goal of a `frame` takes no `free`"),
        ("rpy = [0, 0, 0]\nq = [0, 0, 0, 0, 0, 0]", WHERE, "`rpy` needs a `frame`"),
        ('frame = "tool9"\nrpy = [0, 0, 0]', WHERE, "line 4: robot 'ur5' has no frame 'tool9'"),
        ("v = [0, 0, 0, 0, 0, 0]", WHERE, "`start` needs q, or a frame and its target"),
    ],
)
def test_a_mistake_is_reported_with_its_line(
    tmp_path: Path, start: str, goal: str, sentence: str
) -> None:
    with pytest.raises(SceneError) as refused:
        task_with(tmp_path, start, goal)
    assert sentence in str(refused.value)


def test_the_sentence_of_a_quaternion_is_that_of_python(tmp_path: Path) -> None:
    with pytest.raises(InputError) as python:
        hovi.FrameGoal("tool0", quaternion_xyzw=[1, 1, 0, 0])
    with pytest.raises(SceneError) as file:
        task_with(tmp_path, START, "quaternion_xyzw = [1, 1, 0, 0]")
    known = str(python.value).split("got")[0]
    assert known in str(file.value)


def test_only_a_plan_starts_at_a_frame(tmp_path: Path) -> None:
    task = task_with(tmp_path, START, WHERE)
    with pytest.raises(InputError, match="give the start joint positions"):
        _ = task.start_state
