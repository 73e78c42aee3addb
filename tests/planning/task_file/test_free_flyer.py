"""Whether the base of a robot in a scene file floats: as in Python."""

from __future__ import annotations

from pathlib import Path

import pytest

import hovi
from hovi.discrete.state import State
from hovi.errors import SceneError
from hovi.planning.task_file.reading import load_task
from hovi.planning.task_file.task import Task
from hovi.planning.task_file.writing import save_task


@pytest.mark.parametrize("free_flyer", [None, False, True])
@pytest.mark.parametrize("name", ["solo8", "ur5"])
def test_the_base_floats_as_in_python(name: str, free_flyer: bool | None, tmp_path: Path) -> None:
    robot = hovi.load_robot(name, free_flyer=free_flyer)
    passive = ["root_joint"] if robot.source.free_flyer else []
    end = State(robot.neutral())
    task = Task(hovi.Scene(robot, passive=passive), end, end, 1.0)
    path = save_task(task, tmp_path / "scene.toml")
    assert ("free_flyer" in path.read_text()) == (robot.nq not in (8 + 7, 6))
    assert load_task(path).scene.robot.nq == robot.nq
    if free_flyer is None:
        plain = [each for each in path.read_text().splitlines() if "free_flyer" not in each]
        path.write_text("\n".join(plain))
        assert load_task(path).scene.robot.nq == robot.nq


def test_a_passive_base_that_is_fixed_names_free_flyer() -> None:
    with pytest.raises(SceneError, match="free_flyer"):
        hovi.Scene(hovi.load_robot("ur5"), passive=["root_joint"])
