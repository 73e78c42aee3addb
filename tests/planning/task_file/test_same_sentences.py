"""A scene file and Python refuse the same values of options in the same words."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import tomlkit

import hovi
from hovi.errors import InputError, SceneError
from hovi.planning.task_file.reading import load_task

CRATE = {
    "name": "crate",
    "frame": "forearm",
    "shape": {"kind": "sphere", "position": [0.0, 0.0, 0.0], "radius": 0.1},
}
WRONG: dict[str, dict[str, Any]] = {
    "a part of an interval": {"intervals": 3.5},
    "no intervals": {"intervals": 0},
    "too many intervals": {"intervals": 10**7},
    "no starts": {"starts": 0},
    "parts of starts": {"starts": 1.5},
    "too many starts": {"starts": 10**10},
    "a negative seed": {"seed": -1},
    "no steps": {"max_iterations": 0},
    "a negative margin": {"margin": -0.01},
    "a misspelt guess": {"guess": "cubik"},
    "a negative weight of the time": {"time_weight": -1},
    "a late via point": {"via": [{"time": 3, "q": [0.0, 0.0]}]},
    "a via point without a time": {"via": [{"q": [0.0, 0.0]}]},
    "a duration of zero": {"duration": 0},
    "bounds that fall": {"duration": [3, 1]},
    "a negative mass": {"grasped": [CRATE | {"mass": -1}]},
}


@pytest.mark.parametrize("case", WRONG)
def test_a_file_and_python_refuse_a_value_in_the_same_words(case: str, tmp_path: Path) -> None:
    ends = {"robot": "two_link.urdf", "duration": 1.0, "start": [0.0, 0.0], "goal": [0.1, 0.2]}
    path = tmp_path / "scene.toml"
    path.write_text(tomlkit.dumps(ends | WRONG[case]))
    with pytest.raises(SceneError) as in_file:
        load_task(path)
    scene = hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")))
    options = {"duration": 1.0} | WRONG[case]
    with pytest.raises(InputError) as in_python:
        hovi.plan(scene, [0.0, 0.0], [0.1, 0.2], **options)
    place, sentence = str(in_file.value).split(": ", 1)
    assert ", line " in place
    assert sentence == str(in_python.value)
