"""Mutated requests of MoveIt; those that load start and end where a second reader says so."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import yaml

import hovi
from hard.mutated_bytes import mutated_bytes
from hard.mutated_obstacles import TOKENS
from hard.verdict import Mutant, Verdict, judge
from samples.world_files import JOINT_REQUEST, LINK_REQUEST

TEXTS = JOINT_REQUEST, LINK_REQUEST
VALUES = (
    *(float("nan"), float("inf"), 1e308, 5e-324, -0.0, 0, 1, -1, 7, 3.2, 10**30, True, False, None),
    *("", "0", "a" * 10_000, "a\nb", "panda_joint1", "panda_finger_joint1", "panda_link8"),
    *("arm", "hand", "world", "panda_hand", "\ud7ff", "../x", [], {}, [0.0], [[]], [{}], {"x": 1}),
)
Change = Callable[[Any, Random], None]


@cache
def scene() -> hovi.Scene:
    """A Panda with locked fingers."""
    fingers = ["panda_finger_joint1", "panda_finger_joint2"]
    return hovi.Scene(hovi.load_robot("panda", locked=fingers))


def mutate(random: Random) -> Mutant:
    """A changed text, or a changed message."""
    text = random.choice(TEXTS)
    if random.random() < 0.3:
        return Mutant(mutated_bytes(text.encode(), random, TOKENS))
    message = yaml.safe_load(text.removesuffix("---\n"))
    if random.random() < 0.6:
        for _ in range(random.randint(1, 3)):
            holder, key = random.choice(_places(message))
            holder[key] = random.choice(VALUES)
        return Mutant(json.dumps(_wrapped(message, random)).encode())
    change = random.choice((_unknown_key, _not_finite, _unsupported, _no_goal))
    change(message, random)
    message = _wrapped(message, random)
    return Mutant(json.dumps(message).encode(), (change.__doc__ or "").split("\n")[0])


def verdict(mutant: Mutant, folder: Path) -> tuple[Verdict, str]:
    """Load it from a file in `folder`."""
    path = folder / "request.yaml"
    path.write_bytes(mutant.content)

    def load() -> hovi.Task:
        return hovi.load_motion_plan_request(path, scene(), 1.0, start="default")

    return judge(load, lambda task: _error_in(task, path), mutant.reason)


def _error_in(task: hovi.Task, path: Path) -> str:
    """The error in a loaded task; "" if there is none."""
    robot = task.scene.robot
    text = path.read_text().rstrip().removesuffix("\n---")
    message = yaml.load(text, Loader=yaml.CBaseLoader)  # all scalars as text
    message = message.get("request") or message.get("motion_plan_request") or message
    state = _table(_table(message.get("start_state")).get("joint_state"))
    names, numbers = (_list(state.get(key)) for key in ("name", "position"))
    wanted = robot.pose("default")
    for name, number in zip(names, numbers, strict=False):
        if name in robot.joint_names:
            wanted[robot.entries_of(name)] = float(number)
    if not np.array_equal(task.start_state.on(robot, "start")[0], wanted):
        return "the start is another one"
    constraints = message["goal_constraints"][0]
    if isinstance(task.goal, hovi.FrameGoal):
        numbers = [x for x in (task.goal.position, task.goal.rotation) if x is not None]
        if not all(np.isfinite(np.asarray(x)).all() for x in numbers):
            return "the goal is not finite"
        return "" if task.goal.equations else "the goal asks for nothing"
    q, _ = task.goal.on(robot, "goal")
    for each in constraints["joint_constraints"]:
        if each["joint_name"] in robot.joint_names:
            at = q[robot.entries_of(each["joint_name"])]
            if at[0] != float(each["position"]) or each["joint_name"] in task.goal.free:
                return "the goal is another one"
    return ""


def _table(given: Any) -> dict[str, Any]:
    """A table; an empty one for what is none, such as null."""
    return given if isinstance(given, dict) else {}


def _list(given: Any) -> list[Any]:
    """A list; an empty one for what is none."""
    return given if isinstance(given, list) else []


def _wrapped(message: Any, random: Random) -> Any:
    """The message, or the goal of an action or the request of a service with it."""
    name = random.choice(("request", "motion_plan_request", "", "", "", ""))
    return {name: message} if name else message


def _places(value: Any) -> list[tuple[Any, Any]]:
    """All entries of tables and lists, as pairs of a holder and a key."""
    keys = list(value) if isinstance(value, dict) else range(len(value))
    found = [(value, key) for key in keys]
    for key in keys:
        if isinstance(value[key], dict | list):
            found += _places(value[key])
    return found


def _unknown_key(message: Any, random: Random) -> None:
    """It has a key that no message has."""
    tables = [message] + [holder[key] for holder, key in _places(message)]
    # headers and what is empty are not looked into where they say nothing
    read = [
        each
        for each in tables
        if isinstance(each, dict)
        and {"joint_name", "start_state", "is_diff", "link_name", "joint_constraints", "primitives"}
        & each.keys()
    ]
    goal = message["goal_constraints"][0]
    table = random.choice([each for each in read if each is not message.get("path_constraints")])
    table[random.choice(("Position", "goal", "tolerance", "name_"))] = goal.get("name", 1)


def _not_finite(message: Any, random: Random) -> None:
    """A number of the goal is not finite."""
    places = [
        (holder, key)
        for holder, key in _places(message["goal_constraints"])
        if isinstance(holder[key], float) and key != "weight"
    ]
    holder, key = random.choice(places)
    holder[key] = random.choice((float("nan"), float("inf"), "x"))


def _unsupported(message: Any, random: Random) -> None:
    """It asks for what no task has."""
    key = random.choice(("path_constraints", "reference_trajectories", "max_cartesian_speed"))
    values = {"max_cartesian_speed": 0.3, "reference_trajectories": [{}]}
    message[key] = values.get(key, {"orientation_constraints": [{}]})


def _no_goal(message: Any, random: Random) -> None:
    """It has no goal, or one that says nothing."""
    message["goal_constraints"] = random.choice(([], [{}], [{"name": "x"}], None))
