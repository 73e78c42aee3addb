"""A task file means what it says, and every mistake in one is answered by one sentence."""

from __future__ import annotations

import dataclasses
import math
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hovi.effects
from hovi.errors import HoviError, InputError, ModelError, SceneError, SchemeError
from hovi.model_files import example, example_scenes
from hovi.task_file import load_task, save_task

REACH = example("two_link_reach.toml").read_text()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    shutil.copy(example("two_link.urdf"), tmp_path)
    return tmp_path


def write(folder: Path, text: str) -> Path:
    path = folder / "scene.toml"
    path.write_text(text)
    return path


def refusal(folder: Path, text: str, error: type[HoviError] = SceneError) -> str:
    with pytest.raises(error) as raised:
        load_task(write(folder, text))
    sentence = str(raised.value)
    assert "\n" not in sentence
    assert "pydantic" not in sentence
    return sentence


@pytest.mark.parametrize("name", example_scenes())
def test_every_shipped_scene_loads(name: str) -> None:
    task = load_task(example(name))
    assert task.name == name
    assert task.limits == "none"
    assert task.scene.effects[0].key == "gravity"


@pytest.mark.parametrize("name", ["two_link_swing_up", "two_link_elbow", "two_link_reach"])
def test_a_saved_task_is_read_back_as_the_same_task(name: str, tmp_path: Path) -> None:
    task = load_task(example(name))
    again = load_task(save_task(task, tmp_path / f"{name}.toml"))
    for key in ("duration", "scheme", "intervals", "starts", "seed", "limits", "name"):
        assert getattr(again, key) == getattr(task, key)
    for end in ("start", "goal"):
        ends = [getattr(each, end).on(each.scene.robot, end) for each in (task, again)]
        np.testing.assert_array_equal(ends[0], ends[1])
    assert again.scene.effects == task.scene.effects
    assert again.scene.to_dict() == task.scene.to_dict()


def test_saving_never_replaces_another_urdf(folder: Path) -> None:
    task = load_task(example("two_link_reach"))
    (folder / "two_link.urdf").write_text("<robot/>")
    with pytest.raises(SceneError, match="another URDF"):
        save_task(task, folder / "scene.toml")
    assert not (folder / "scene.toml").exists()


def test_a_shipped_robot_is_named_and_not_copied(tmp_path: Path) -> None:
    path = save_task(load_task(example("panda_reach")), tmp_path / "panda.toml")
    assert [each.name for each in tmp_path.iterdir()] == ["panda.toml"]
    assert load_task(path).scene.robot.nv == 7


def test_ends_may_be_given_by_joint_in_any_order(folder: Path) -> None:
    text = REACH.replace("q = [0.3, 0.7]", "q = { elbow = 0.7, shoulder = 0.3 }")
    text = text.replace("v = [0.5, -0.4]", "v = { elbow = -0.4 }")
    task = load_task(write(folder, text))
    q, v = task.goal.on(task.scene.robot, "goal")
    np.testing.assert_array_equal(q, [0.3, 0.7])
    np.testing.assert_array_equal(v, [0.0, -0.4])


def test_a_scene_without_effects_or_choices_takes_the_defaults(folder: Path) -> None:
    text = 'robot = "two_link.urdf"\nduration = 2\nstart.q = [0, 0]\ngoal.q = [1, 1]\n'
    task = load_task(write(folder, text))
    assert (task.scheme, task.intervals, task.starts, task.seed) == ("galerkin-2", 16, 1, 0)
    assert task.limits == "none"
    assert tuple(task.scene.effects) == ()


def test_whole_numbers_stand_for_real_ones(folder: Path) -> None:
    assert load_task(write(folder, REACH.replace("1.0  ", "1  "))).duration == 1.0


MISTAKES = {
    "unknown key": ("duration =", "durration =", ["line 5", "`durration`", "'duration'"]),
    "unknown key in a table": ("intervals =", "interval =", ["`scheme.interval`", "'intervals'"]),
    "unknown key of an effect": (
        "acceleration =",
        "aceleration =",
        ["`effects.gravity.aceleration`", "'acceleration'"],
    ),
    "unknown effect": ("[effects.gravity]", "[effects.gravty]", ["'gravty'", "'gravity'"]),
    "unknown scheme": ("galerkin-2", "galrkin-2", ["line 16", "'galrkin-2'", "'galerkin-2'"]),
    "string for a number": ("= 1.0", '= "one"', ["`duration`", "positive number", '"one"']),
    "boolean for a number": ("= 1.0", "= true", ["`duration`", "true"]),
    "T = 0": ("= 1.0", "= 0.0", ["line 5", "`duration`", "positive number", "0.0"]),
    "T < 0": ("= 1.0", "= -3.0", ["`duration`", "-3.0"]),
    "T = inf": ("= 1.0", "= inf", ["`duration`", "inf"]),
    "N = 0": ("intervals = 16", "intervals = 0", ["line 17", "`scheme.intervals`", "0"]),
    "N is no whole number": ("intervals = 16", "intervals = 1.5", ["whole number", "1.5"]),
    "N is too large": ("intervals = 16", "intervals = 99999999", ["1,000,000"]),
    "no starts": ('"none"', '"none"\nstarts = 0', ["`starts`", "1 or more", "0"]),
    "NaN": ("q = [0.3, 0.7]", "q = [0.3, nan]", ["line 12", "`goal.q[1]`", "finite", "nan"]),
    "string in a list": ("q = [0.3, 0.7]", 'q = [0.3, "x"]', ["`goal.q[1]`", "finite", '"x"']),
    "list of lists": ("q = [0.3, 0.7]", "q = [[0.3, 0.7]]", ["`goal.q[0]`", "finite"]),
    "q too short": ("q = [0.3, 0.7]", "q = [0.3]", ["line 12", "goal.q", "shoulder", "elbow"]),
    "v too long": ("v = [0.5, -0.4]", "v = [1, 2, 3]", ["line 13", "goal.v", "elbow"]),
    "unknown joint": ("q = [0.3, 0.7]", "q = { elbo = 1, shoulder = 0 }", ["'elbo'", "'elbow'"]),
    "left-out joint": ("q = [0.3, 0.7]", "q = { elbow = 1 }", ["leaves out", "'shoulder'"]),
    "joint with two numbers": (
        "q = [0.3, 0.7]",
        "q = { elbow = [1, 2], shoulder = 0 }",
        ["`goal.q.elbow`", "one number"],
    ),
    "no goal": ("[goal]", "[gaol]", ["`gaol`", "'goal'"]),
    "start without q": ("q = [-1.57", "v = [-1.57", ["line 8", "`start.q`", "missing"]),
    "limits": ('limits = "none"', "[limits]\nv = 3", ["not enforced yet", '"none"']),
    "robot of the wrong type": ('robot = "two_link.urdf"', "robot = 3", ["`robot`", "3"]),
    "locked of the wrong type": ('"none"', '"none"\nlocked = "elbow"', ["`locked`", "list"]),
    "syntax": ("duration = ", "duration ", ["line 5", "column", "not valid TOML"]),
    "key given twice": ("limits =", "duration = 1\nlimits =", ["line 6", "not valid TOML"]),
    "effect that is no table": ("[effects.gravity]", "[effects]", ["effects.acceleration"]),
    "NaN in an effect": ("acceleration = 9.8", "acceleration = nan", ["finite", "nan"]),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_named_with_its_place(mistake: str, folder: Path) -> None:
    old, new, expected = MISTAKES[mistake]
    assert REACH.count(old) >= 1
    sentence = refusal(folder, REACH.replace(old, new, 1))
    assert "scene.toml" in sentence
    for fragment in expected:
        assert fragment in sentence


def test_a_missing_table_is_named(folder: Path) -> None:
    text = REACH.replace("[start]", "[scheme]", 1).split("[scheme]")[0] + "goal.q = [0, 0]\n"
    assert "`start` is missing" in refusal(folder, text)


def test_an_empty_file_lacks_a_robot(folder: Path) -> None:
    assert "`robot` is missing" in refusal(folder, "")


def test_a_missing_urdf_is_named_with_the_line(folder: Path) -> None:
    sentence = refusal(folder, REACH.replace("two_link.urdf", "three_link.urdf"), ModelError)
    assert "line 4" in sentence
    assert "three_link.urdf" in sentence


def test_an_unknown_example_robot_gets_the_nearest_name(folder: Path) -> None:
    assert "'panda'" in refusal(folder, REACH.replace("two_link.urdf", "pandaa"), ModelError)


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"\xff\xfe\x00", "UTF-8"),
        (b"a = " + b"[" * 100_000, "nested"),
        (b"a = 1" + b"0" * 5000, ""),
    ],
)
def test_a_file_that_is_no_scene_is_refused(content: bytes, expected: str, tmp_path: Path) -> None:
    path = tmp_path / "strange.toml"
    path.write_bytes(content)
    with pytest.raises(SceneError, match=r"strange\.toml") as raised:
        load_task(path)
    assert expected in str(raised.value)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("name", ["nowhere.toml", "."])
def test_a_path_that_is_no_file_is_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(SceneError):
        load_task(tmp_path / name)


POTENTIAL = """
[effects.joint_limit_potential]
ranges = { elbow = [0.0, 2.0] }
"""


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("[0.0, 2.0]", "[0.0]", ["ranges", "elbow"]),
        ("[0.0, 2.0]", '[0.0, "2"]', ["ranges.elbow[1]", "finite number"]),
        ("[0.0, 2.0]", "[0.0, inf]", ["ranges.elbow[1]", "inf"]),
        ("[0.0, 2.0]", "[2.0, 0.0]", ["'elbow'", "line"]),
        ("elbow", "elbw", ["'elbw'", "'elbow'"]),
        ("ranges = {", "range = {", ["range", "'ranges'"]),
        (
            "ranges = { elbow = [0.0, 2.0] }",
            "width = 0.1",
            ["`effects.joint_limit_potential.ranges`"],
        ),
        ("ranges = { elbow = [0.0, 2.0] }", "ranges = 3", ["ranges", "table", "3"]),
    ],
)
def test_an_effect_is_checked_against_its_fields(
    old: str, new: str, expected: list[str], folder: Path
) -> None:
    sentence = refusal(folder, REACH + POTENTIAL.replace(old, new))
    for fragment in expected:
        assert fragment in sentence


def test_an_effect_takes_its_own_defaults(folder: Path) -> None:
    task = load_task(write(folder, REACH + POTENTIAL))
    expected = hovi.effects.JointLimitPotential({"elbow": (0.0, 2.0)})
    assert task.scene.effects[1] == expected


@pytest.mark.parametrize(
    ("change", "error"),
    [
        ({"duration": math.nan}, InputError),
        ({"duration": 0.0}, InputError),
        ({"intervals": 0}, InputError),
        ({"starts": 0}, InputError),
        ({"seed": -1}, InputError),
        ({"scheme": "simpson"}, SchemeError),
        ({"limits": "urdf"}, SceneError),
    ],
)
def test_a_task_is_valid_once_built(change: dict[str, Any], error: type[HoviError]) -> None:
    with pytest.raises(error):
        dataclasses.replace(load_task(example("two_link_reach")), **change)


def test_an_unknown_example_gets_the_nearest_names() -> None:
    with pytest.raises(SceneError, match="two_link_swing_up"):
        example("two_link_swingup")
