"""Scene files take configurations and single tables by themselves, as Python does."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomlkit

import hovi
from hovi.discrete.state import State
from hovi.errors import HoviError, SceneError
from hovi.planning.problem.notation.ends import as_end
from hovi.planning.task_file.reading import load_task

ROBOT = hovi.load_robot(hovi.example("two_link.urdf"))
SRDF = """<robot name="two_link"><group_state name="ready" group="arm">
<joint name="shoulder" value="0.4"/><joint name="elbow" value="-0.2"/></group_state></robot>"""
BALL = {"kind": "sphere", "position": [0.0, 3.0, 0.0], "radius": 0.1}
CRATE = {"frame": "forearm", "mass": 1.0, "shape": {**BALL, "position": [0.0, 0.0, 0.0]}}


def loaded(folder: Path, **keys: Any) -> hovi.Task:
    whole = {"robot": "two_link.urdf", "duration": 1.0, "start": [0.1, 0.2], "goal": [0.3, 0.4]}
    path = folder / "scene.toml"
    path.write_text(tomlkit.dumps(whole | keys))
    return load_task(path)


@pytest.mark.parametrize("given", [[0.4, -0.2], {"elbow": -0.2, "shoulder": 0.4}, "ready"])
@pytest.mark.parametrize("end", ["start", "goal", "segment"])
def test_an_end_may_be_a_configuration_by_itself(given: Any, end: str, tmp_path: Path) -> None:
    (tmp_path / "arm.srdf").write_text(SRDF)
    keys: dict[str, Any] = {"srdf": "arm.srdf", "start": [0.1, 0.2]}
    if end == "segment":
        path = tmp_path / "scene.toml"
        segments = [{"duration": 1.0, "goal": given}]
        path.write_text(tomlkit.dumps({"robot": "two_link.urdf", **keys, "segments": segments}))
        read = load_task(path).segments[0].goal
    else:
        read = getattr(loaded(tmp_path, **(keys | {end: given})), end)
    assert isinstance(read, State)
    np.testing.assert_array_equal(read.q, [0.4, -0.2])


@pytest.mark.parametrize("given", [[0.4], {"elbow": 0.4}, {"elbo": 0.4}, "redy"])
def test_a_wrong_configuration_is_refused_as_in_python(given: Any, tmp_path: Path) -> None:
    with pytest.raises(SceneError) as in_file:
        loaded(tmp_path, goal=given)
    with pytest.raises(HoviError) as in_python:
        as_end(given, ROBOT, "goal")
    place, sentence = str(in_file.value).split(": ", 1)
    assert place.endswith("line 4") or isinstance(given, dict)
    assert sentence.replace("goal.q has", "goal has") == str(in_python.value)


def test_a_single_table_stands_for_a_list_of_one(tmp_path: Path) -> None:
    alone = loaded(tmp_path, obstacles=BALL, grasped=CRATE).options
    listed = loaded(tmp_path, obstacles=[BALL], grasped=[CRATE]).options
    assert [each.to_dict() for each in alone.obstacles] == [
        each.to_dict() for each in listed.obstacles
    ]
    assert alone.grasped == listed.grasped
    with pytest.raises(SceneError, match=r"scene.toml, line 6: .*`radius`"):
        loaded(tmp_path, obstacles=BALL | {"radius": -1.0})
