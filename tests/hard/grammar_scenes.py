"""Scenes by a grammar: tables, keys and values of a scene file, of which a few are odd.

A grammar of leaves says which types of TOML a value may have. A scene in which a value has another
type must be refused; of all others, those that load are planned for two iterations.
"""

from __future__ import annotations

import copy
import datetime
import time
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

from hard.mutated_robots import placed
from hard.mutated_scene import error_in
from hard.verdict import Mutant, Verdict, judge
from hovi.planning.task_file.reading import load_task
from samples.meshes import channel

MAX_SECONDS = 10.0
"""Processor time in [s] of an input beyond which it counts as a hang."""
_DAY = datetime.date(1979, 5, 27)
_CLOCK = datetime.time(7, 32)
_DEEP: Any = [1.0]
for _ in range(60):
    _DEEP = [_DEEP]
ODD: dict[str, tuple[Any, ...]] = {
    "boolean": (True, False),
    "integer": (0, 1, -1, 2, 7, 2**63 - 1, -(2**63), 10**30, 10**300),
    "float": (0.0, -0.0, 1e308, -1e308, 1e-300, 5e-324, 1e17, 0.1, -1.0, 1e-9, 1e9),
    "nonfinite": (float("nan"), float("inf"), -float("inf")),
    "text": (
        *("", " ", "0", "1", "nan", "true", "none", "\0", "a\0b", "a\nb", "\x1b[31m", "\u202e"),
        *("é", "\U0001f916", "x" * 10_000, "../..", "/dev/zero", "elbow", "tip", "1 s", "0.1 mm"),
    ),
    "date": (_DAY, _CLOCK, datetime.datetime.combine(_DAY, _CLOCK, datetime.UTC)),
    "list": ([], [[]], [{}], [True], [0.5], [0.5, 0.5], [1] * 20_000, ["elbow"], _DEEP),
    "table": ({}, {"": 1.0}, {"a": {"b": {}}}, {"elbow": 0.1}, {"elbow": True}, {"\0": 1.0}),
}
"""Odd values by their type."""
REAL = frozenset(("integer", "float"))


@dataclass(frozen=True)
class Leaf:
    """A value. valid: such values. types: of TOML. items: types of a list's; lengths: of lists."""

    valid: tuple[Any, ...]
    types: frozenset[str] = REAL
    items: frozenset[str] = REAL
    lengths: tuple[int, ...] = ()


def _leaf(*valid: Any, types: str = "integer float") -> Leaf:
    return Leaf(valid, frozenset(types.split()))


def _row(
    *valid: Any, items: str = "integer float", types: str = "list", open_: bool = False
) -> Leaf:
    """Lists of a fixed length unless `open_`."""
    lengths = () if open_ else tuple({len(each) for each in valid if isinstance(each, list)})
    return Leaf(valid, frozenset(types.split()), frozenset(items.split()), lengths)


FLAG = _leaf(True, False, types="boolean")
WORD = _leaf("a", "elbow", types="text")
WHOLE = _leaf(1, 2, types="integer")
VECTOR = _row([0.1, 0.2, 0.3], [5.0, 0.0, 0.0])
NAMES = _row(["elbow"], ["shoulder"], [], items="text", open_=True)
CONFIGURATION = _row([0.1, 0.2], {"elbow": 0.2, "shoulder": 0.1}, types="list table text")
RATES = _row([0.1, 0.0], {"elbow": 0.1}, types="list table")
SECONDS = _leaf(0.5, "500 ms", types="integer float text")
VALUES = _row(0.5, [0.5, 0.1], {"elbow": 0.2}, types="integer float list table")
BOUND = _row(5.0, [5.0, 9.0], {"elbow": 4.0}, types="integer float list table nonfinite")
SHARE = _row(
    *("50 %", {"elbow": "80 %"}, ["5e1 %", 9.0]),
    types="integer float list table text nonfinite",
    items="integer float text",
)
FORMULA = _leaf("t", 'q["elbow"]', 0.1, types="integer float text")
POINTS = _row([[5.0, 0, 0], [6.0, 0, 0], [5.0, 1, 0], [5.0, 0, 1]], items="list", open_=True)
PATH = {"times": _row([0.0, 1.0]), "positions": _row([[5.0, 0, 0], [6.0, 0, 0]], items="list")}
FRAME = _leaf("tip", "forearm", types="text")
END = {
    "q": CONFIGURATION,
    "v": RATES,
    "free": NAMES,
    "free_velocity": NAMES,
    "frame": FRAME,
    "position": VECTOR,
    "rpy": VECTOR,
    "quaternion_xyzw": _row([0.0, 0.0, 0.0, 1.0]),
    "axis": {"frame": VECTOR, "world": VECTOR},
}
REGION = {
    **{key: END[key] for key in ("frame", "position", "axis")},
    "within": _row(
        *(0.01, "10 mm", [0.01, "5 mm", 0.02]),
        **{"types": "integer float text list", "items": "integer float text"},
    ),
    "within_angle": _leaf(0.1, "5 deg", types="integer float text"),
    "velocity": VECTOR,
}
SHAPES: tuple[dict[str, Any], ...] = (
    {"kind": "sphere", "position": VECTOR, "radius": _leaf(0.1)},
    {"kind": "box", "position": VECTOR, "size": _row([0.1, 0.2, 0.3]), "rpy": VECTOR},
    {"kind": "cylinder", "position": VECTOR, "radius": _leaf(0.1), "length": _leaf(0.4)},
    {
        "kind": "capsule",
        "ends": _row([[5.0, 0.0, 0.0], [5.0, 0.0, 1.0]], items="list"),
        "radius": _leaf(0.1),
    },
)
OBSTACLES: tuple[dict[str, Any], ...] = (
    *SHAPES,
    SHAPES[0] | {"path": PATH},
    {"kind": "half_space", "normal": _row([0.0, 0.0, 1.0]), "position": _row([0.0, 0.0, -3.0])},
    {"kind": "convex_hull", "points": POINTS, "position": VECTOR},
    {"kind": "point_cloud", "points": POINTS, "radius": _leaf(0.01), "cell": _leaf(0.05)},
    {
        "kind": "mesh",
        "file": _leaf("channel.obj", types="text"),
        "position": VECTOR,
        "scale": _row(0.5, [1.0, 1.0, 2.0], types="integer float list"),
        "convex_parts": _leaf(False, types="boolean"),
    },
)
EFFECTS: dict[str, Any] = {
    "gravity": {"acceleration": _leaf(9.8), "direction": _row([0.0, 0.0, -1.0])},
    "viscous_friction": {"coefficient": VALUES},
    "dry_friction": {
        "coulomb": VALUES,
        "static": VALUES,
        "stribeck_velocity": _leaf(0.1),
        "width": _leaf(0.05),
    },
    "armature": {"inertia": VALUES},
    "joint_springs": {"stiffness": VALUES, "rest": VALUES},
    "drag": {"frame": FRAME, "area": _leaf(0.1), "density": _leaf(1.2), "wind": VECTOR},
    "payload": {"frame": FRAME, "mass": _leaf(0.5), "center": VECTOR},
    "wrench": {"frame": FRAME, "force": _row([1.0, 0.0, "t"], items="integer float text")},
    "effort_weight": {"weight": VALUES},
    "velocity_cost": {"weight": VALUES},
    "acceleration_cost": {"weight": VALUES},
    "power_cost": {"weight": VALUES, "width": _leaf(0.1)},
    "reference_cost": {"reference": {"elbow": FORMULA}, "weight": _leaf(1.0)},
    "joint_limit_potential": {
        "ranges": {"elbow": _row([-2.0, 2.0])},
        "slope": _leaf(10.0),
        "width": _leaf(0.01),
    },
    "moving_base": {"position": _row([0.0, 0.0, "t"], items="integer float text")},
    "running_cost": {"terms": {"first": FORMULA}},
    "custom": {"torque_of": {"elbow": FORMULA}, "cost": FORMULA},
}
LIMITS = {
    "base": _leaf("none", "urdf", types="text"),
    **dict.fromkeys(("q", "v", "a", "tau"), BOUND),
    "margin": _leaf(0.1, 0.0),
    "tolerance": _leaf(1e-6),
}
SHARES_OF_LIMITS = {"base": _leaf("urdf", types="text"), "v": SHARE, "tau": SHARE}
GRASPED = {
    "frame": _leaf("forearm", types="text"),
    "mass": _leaf(0.5),
    "name": _leaf("apple", types="text"),
    "position": VECTOR,
    "rpy": VECTOR,
    "center": VECTOR,
    "inertia": _row([0.1, 0.1, 0.1, 0.0, 0.0, 0.0]),
    "may_touch": _row(["forearm"], items="text", open_=True),
}
OPTIONS: dict[str, Any] = {
    "starts": WHOLE,
    "seed": WHOLE,
    "margin": _leaf(0.01),
    "self_collision": FLAG,
    "guess": _leaf("cubic", "minimum-jerk", types="text"),
    "max_iterations": WHOLE,
    "time_limit": SECONDS,
    "continuation": FLAG,
    "objective": _leaf("effort", "acceleration", "jerk", types="text"),
    "smooth": FLAG,
    "tolerance": _leaf(1e-3, "1 mm", types="integer float text"),
    "passive": NAMES,
    "begin": _leaf(0.5),
    "free_flyer": _leaf(False, types="boolean"),
    "mimic": FLAG,
    "locked": _row(["elbow"], {"elbow": 0.1}, items="text", types="list table", open_=True),
    "time_weight": _leaf(0.1),
    "repeat": _leaf(1, types="integer"),
}


def mutate(random: Random) -> Mutant:
    """A scene with a few optional keys, and one odd value or two."""
    grammar = _grammar(random)
    scene = _valid(grammar, random)
    reasons = [_spoil(scene, grammar, random) for _ in range(random.choice((1, 1, 1, 2)))]
    text = "".join(f"{_key(key)} = {_written(value)}\n" for key, value in scene.items())
    return Mutant(text.encode(), reasons[-1])


def verdict(mutant: Mutant, folder: Path) -> tuple[Verdict, str]:
    """Load it from a file in `folder`, and plan for two iterations."""
    path = placed(mutant.content, folder)
    (path.parent / "channel.obj").write_text(channel())
    began = time.process_time()
    found = judge(lambda: load_task(path), error_in, mutant.reason)
    took = time.process_time() - began
    return found if took < MAX_SECONDS else (Verdict.HANG, f"it took {took:.1f} s")


def _written(value: Any) -> str:
    """A value as TOML, tables inline."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(k)} = {_written(x)}" for k, x in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_written, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    return _key(value) if isinstance(value, str) else str(value)


def _key(text: str) -> str:
    """A text in quotes, with what TOML does not allow there as escapes."""
    escaped = (c if c.isprintable() and c not in '"\\' else f"\\u{ord(c):04x}" for c in text)
    return '"' + "".join(escaped) + '"'


def _grammar(random: Random) -> dict[str, Any]:
    """What a scene of a few tables consists of."""
    ends = {key: END[key] for key in ("q", "v")}
    framed = {key: END[key] for key in ("frame", random.choice(("position", "rpy", "axis")))}
    chosen: dict[str, Any] = {
        "robot": _leaf("two_link.urdf", types="text"),
        "duration": _row(
            1.0, "1 s", [0.5, 1.0], items="integer float text", types="integer float text list"
        ),
        "start": ends,
        "goal": random.choice(
            (
                *(ends, framed, {**ends, "free": NAMES, "free_velocity": NAMES}),
                *(REGION, [REGION, framed | {"frame": _leaf("upper_arm", types="text")}]),
            )
        ),
        "scheme": {
            "name": _leaf("galerkin-2", types="text"),
            "intervals": _leaf(4, types="integer"),
        },
        "effects": {key: EFFECTS[key] for key in random.sample([*EFFECTS], random.randint(0, 2))},
    }
    if random.random() < 0.2:
        chosen["tools"] = {"tcp": {"frame": FRAME, "position": VECTOR, "rpy": VECTOR}}
    for key in random.sample([*OPTIONS], random.randint(0, 2)):
        chosen[key] = OPTIONS[key]
    shape = random.choice(SHAPES)
    tables = {
        "limits": random.choice((LIMITS, SHARES_OF_LIMITS)),
        "obstacles": [random.choice(OBSTACLES) | {"name": _leaf("ball", types="text")}],
        "grasped": [GRASPED | {"shape": shape}],
        "via": [{"time": SECONDS, **random.choice((ends, framed))}],
    }
    for key in random.sample([*tables], random.randint(0, 2)):
        chosen[key] = tables[key]
    return chosen


def _valid(grammar: Any, random: Random) -> Any:
    if isinstance(grammar, Leaf):
        return copy.deepcopy(random.choice(grammar.valid))
    if isinstance(grammar, dict):
        return {key: _valid(each, random) for key, each in grammar.items()}
    if isinstance(grammar, list):
        return [_valid(each, random) for each in grammar]
    return grammar


def _spoil(scene: Any, grammar: Any, random: Random) -> str:
    """Put an odd value at a leaf; returns why the scene must be refused, or ""."""
    above, key, leaf, where = random.choice([*_leaves(scene, grammar, "")])
    value = above[key]
    if isinstance(value, list) and value and random.random() < 0.6:
        return _spoil_list(value, leaf, where, random)
    kind, above[key] = _odd(random)
    wrong = kind not in leaf.types
    return f"`{where}` is a value of type {kind}" if wrong else ""


def _spoil_list(values: list[Any], leaf: Leaf, where: str, random: Random) -> str:
    """Change an entry, or the length."""
    place = random.randrange(len(values))
    if random.random() < 0.2:
        more = random.choice((1, 1, 5_000))
        values.extend([values[place]] * more)
        return f"`{where}` has {len(values)} entries" if leaf.lengths else ""
    if isinstance(values[place], list) and values[place]:
        return _spoil_list(values[place], _row([0.0] * 3), f"{where}[{place}]", random)
    kind, values[place] = _odd(random)
    wrong = kind not in leaf.items and not (kind == "nonfinite" and "nonfinite" in leaf.types)
    return f"`{where}[{place}]` is a value of type {kind}" if wrong else ""


def _odd(random: Random) -> tuple[str, Any]:
    kind = random.choice([*ODD])
    return kind, copy.deepcopy(random.choice(ODD[kind]))


def _leaves(scene: Any, grammar: Any, where: str) -> Any:
    """The container, key, leaf and path of each value of a scene."""
    if isinstance(grammar, dict):
        items: Any = grammar.items()
    else:
        items = enumerate(grammar)
    for key, each in items:
        path = f"{where}[{key}]" if isinstance(grammar, list) else f"{where}.{key}".lstrip(".")
        if isinstance(each, Leaf):
            if isinstance(scene, dict | list) and _has(scene, key):
                yield scene, key, each, path
        elif isinstance(each, dict | list) and _has(scene, key):
            yield from _leaves(scene[key], each, path)


def _has(scene: Any, key: Any) -> bool:
    """Whether an earlier change has left the place."""
    return key in scene if isinstance(scene, dict) else isinstance(scene, list) and key < len(scene)
