"""The JSON schema of scene files agrees with the code."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from hovi.cli.application import main
from hovi.discrete.state import State
from hovi.effects import REGISTRY
from hovi.planning.task_file.json_schema import json_schema
from hovi.planning.task_file.task import Task
from hovi.planning.task_file.writing import save_task
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from samples.sample_effects import sample_effects

MODELS = Path(__file__).resolve().parents[3] / "models"
SCENES = sorted(MODELS.glob("*.toml"))
SCHEMA = json_schema()
WORDS = {"title", "description", "default", "$defs", "$schema"}
TYPES: dict[str, tuple[type, ...]] = {
    "number": (int, float),
    "integer": (int,),
    "string": (str,),
    "boolean": (bool,),
    "array": (list,),
    "object": (dict,),
}


def valid(value: Any, schema: dict[str, Any] | bool) -> bool:
    """Validate by the rules of JSON Schema that this schema uses; other keywords are an error."""
    if isinstance(schema, bool):  # true accepts everything, false nothing
        return schema
    return all(rule(key, each, value, schema) for key, each in schema.items() if key not in WORDS)


def rule(key: str, given: Any, value: Any, schema: dict[str, Any]) -> bool:
    match key:
        case "$ref":
            return valid(value, SCHEMA["$defs"][given.rsplit("/", 1)[1]])
        case "type":
            right = isinstance(value, TYPES[given])
            return right and (given == "boolean" or not isinstance(value, bool))
        case "enum":
            return value in given
        case "const":
            return bool(value == given)
        case "oneOf":
            return sum(valid(value, each) for each in given) == 1
        case "anyOf":
            return any(valid(value, each) for each in given)
    about, holds = RULES[key]
    return not isinstance(value, about) or holds(value, given, schema)


def others(value: dict[str, Any], schema: dict[str, Any]) -> list[Any]:
    return [each for name, each in value.items() if name not in schema.get("properties", {})]


NUMBERS = (int, float)
RULES: dict[str, tuple[Any, Callable[[Any, Any, dict[str, Any]], bool]]] = {
    "minimum": (NUMBERS, lambda value, given, _: value >= given),
    "maximum": (NUMBERS, lambda value, given, _: value <= given),
    "exclusiveMinimum": (NUMBERS, lambda value, given, _: value > given),
    "exclusiveMaximum": (NUMBERS, lambda value, given, _: value < given),
    "pattern": (str, lambda value, given, _: re.search(given, value) is not None),
    "items": (list, lambda value, given, _: all(valid(each, given) for each in value)),
    "prefixItems": (list, lambda value, given, _: all(map(valid, value, given))),
    "minItems": (list, lambda value, given, _: len(value) >= given),
    "maxItems": (list, lambda value, given, _: len(value) <= given),
    "required": (dict, lambda value, given, _: set(given) <= set(value)),
    "properties": (
        dict,
        lambda value, given, _: all(valid(value[k], x) for k, x in given.items() if k in value),
    ),
    "additionalProperties": (
        dict,
        lambda value, given, schema: (
            all(valid(each, given) for each in others(value, schema))
            if given
            else not others(value, schema)
        ),
    ),
}
"""Per keyword: the type to which it applies, and its check of (value, argument, schema)."""


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_every_shipped_scene_is_valid(path: Path) -> None:
    assert valid(tomllib.loads(path.read_text()), SCHEMA)


@pytest.mark.parametrize("key", REGISTRY)
def test_a_written_effect_is_valid_and_each_of_its_keys_is_known(
    two_link: Robot, tmp_path: Path, key: str
) -> None:
    scene = Scene(two_link, [sample_effects(two_link)[key]])
    path = save_task(
        Task(scene, State([0.0, 0.0]), State([1.0, 0.5]), 1.0), tmp_path / "scene.toml"
    )
    data = tomllib.loads(path.read_text())
    assert valid(data, SCHEMA)
    for name in data["effects"][key]:
        wrong = json.loads(json.dumps(data))
        wrong["effects"][key][f"{name}_"] = wrong["effects"][key].pop(name)
        assert not valid(wrong, SCHEMA)
        wrong["effects"][key] = data["effects"][key] | {name: {"a": [{}]}}
        assert not valid(wrong, SCHEMA)


@pytest.mark.parametrize(
    "wrong",
    [
        {"duration": "long"},
        {"duration": "2"},
        {"duration": ["1 s", "later"]},
        {"duration": None},
        {"limits": "all"},
        {"limits": {"base": "nothing"}},
        {"effects": {"gravitation": {}}},
        {"effects": {"payload": {"mass": 1.0}}},
        {"effects": {"wrench": {"frame": "tip", "force": [1.0, 2.0]}}},
        {"scheme": {"intervals": 0}},
        {"starts": 1.5},
        {"goal": {"q": True}},
        {"colour": "red"},
    ],
    ids=str,
)
def test_the_schema_refuses_what_the_code_refuses(wrong: dict[str, Any]) -> None:
    data = tomllib.loads((MODELS / "panda_reach.toml").read_text())
    assert not valid(data | wrong, SCHEMA)


@pytest.mark.parametrize(
    "short",
    [
        {"goal": [0.1, 0.2]},
        {"start": {"panda_joint1": 0.1}},
        {"start": "default"},
        {"obstacles": {"kind": "sphere"}},
        {"grasped": {"frame": "panda_hand", "mass": 1.0, "shape": {"kind": "sphere"}}},
    ],
    ids=str,
)
def test_the_schema_takes_values_by_themselves(short: dict[str, Any]) -> None:
    data = tomllib.loads((MODELS / "panda_reach.toml").read_text())
    assert valid(data | short, SCHEMA)


def test_every_key_is_described_and_defaults_are_the_effects_own() -> None:
    for name, table in SCHEMA["properties"].items():
        assert table.get("description"), name
    gravity = SCHEMA["$defs"]["Gravity"]["properties"]["acceleration"]
    assert (gravity["type"], gravity["default"]) == ("number", 9.81)
    assert "null" not in json.dumps(SCHEMA)


def test_the_command_writes_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads(json.dumps(SCHEMA))
    assert main(["schema", "--out", str(tmp_path / "scene.json")]) == 0
    assert json.loads((tmp_path / "scene.json").read_text())["title"] == "SceneFile"
    assert main(["schema", "--out", str(tmp_path / "scene.txt")]) == 2
