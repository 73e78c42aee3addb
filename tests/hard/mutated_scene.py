"""Mutated scene files, and the properties of those that load.

A scene that loads must be a task with finite numbers, and planning it for two iterations must end
in a solution or an error message.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import tomlkit

from hard.mutated_bytes import mutated_bytes
from hard.mutated_robots import grouped, half_a_group, no_robot, placed, shipped
from hard.verdict import Mutant, Verdict, judge
from hovi.discrete.state import State
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.task_file.reading import load_task
from hovi.planning.task_file.task import Task
from hovi.planning.task_file.task_plan import plan_task
from hovi.robot.bundled_models import example, example_scenes
from hovi.robot.robot import Robot

MAX_PLANNED_INTERVALS = 64  # larger scenes are loaded only
TOKENS = (
    *(
        b"nan",
        b"inf",
        b"-inf",
        b"-1",
        b"0",
        b"1e308",
        b"1e999",
        b"1,5",
        b"1_0",
        b"0x" + b"f" * 5000,
    ),
    *(b"9" * 5000, b"[" * 2000, b"a." * 500, b"{" * 50, b"true", b'""', b"'''", b'"""', b"#", b"="),
    *(b"[[start]]\n", b"[start]\n", b"[effects.gravity]\n", b"\0", b"\xff", b"\xef\xbb\xbf", b"\r"),
    *(b" " * 5000, b"1979-05-27T07:32:00Z", b"12:00", b'"\\u0000"', b'"\\ud800"', b"\n", b"]]"),
)
NOT_NUMBERS = (float("nan"), float("inf"), -float("inf"), "1", "", True, [], {})
UNUSUAL_VALUES = (
    *(*NOT_NUMBERS, 0, -1, 1, 2, 3, 10**6, 10**9, 10**30, -0.0, 1e308, -1e308, 1e-308, 5e-324),
    *([1e308] * 3, [-1e308, 1e308, 1.0], [5e-324] * 3, [1e308] * 2, [[1e308] * 3] * 2),
    *([0.0], [0.0, 0.0], [[0.0, 0.0]], [0.0, "x"], {"elbow": 1.0}, {"elbow": [0.0, 1.0]}, "none"),
    *(
        "urdf",
        "panda",
        "../../etc/passwd",
        "two_link.urdf",
        "x\0y",
        "taylor-midpoint",
        "galerkin-0",
    ),
    *("2 s", "500 ms", "0 s", "-1 s", "1e999 s", "1.5 mn", "2 mm", ".. s", "5e-324 us"),
    *("1 h " * 5_000, ["1 s", "2 s"], ["1 s", 2.0], ["2 s", "1 s"], [1.0, "2 sec"]),
    *("galerkin-9", "galerkin-99999999", "mean-difference", "a" * 10_000, "a\nb", "\x9b", 0.3, 2.5),
)
FORMULA_PARTS = (
    *("tau", "v", "a", "q", "t", "pi", "2", "1e308", "0", "+", "*", "-", "/", "**", "(", ")", ","),
    *('tau["elbow"]', 'q["elbow"]', 'acceleration["tip", "x"]', 'position["tip"]', "[", "]", "."),
    *("base_force", 'base_moment["z"]', "dot(", "sum(", "sqrt(", "log(", "abs(", "__class__", "'"),
)

Entry = tuple[dict[str, Any] | list[Any], Any]
Change = Callable[[dict[str, Any], Random], None]


@cache
def _originals() -> tuple[str, ...]:
    return tuple(example(f"{name}.toml").read_text() for name in example_scenes())


def mutate(random: Random) -> Mutant:
    """A changed scene: in its bytes, in its values, or with an invalidating change."""
    text = random.choice(_originals())
    kind = random.random()
    if kind < 0.35:
        return Mutant(mutated_bytes(text.encode(), random, TOKENS))
    if kind < 0.75:
        return Mutant(changed(text, random))
    scene = tomllib.loads(text)
    sequence = "segments" in scene
    change = random.choice(_SEGMENT_CHANGES if sequence else _INVALIDATING_CHANGES)
    change(scene, random)
    return Mutant(_written(scene), (change.__doc__ or "").split("\n")[0])


def changed(text: str, random: Random, count: int = 3) -> bytes:
    """A scene with one change or up to `count`, after which it may or may not be valid."""
    scene = tomllib.loads(text)
    for _ in range(random.randint(1, count)):
        random.choice(_CHANGES)(scene, random)
    return _written(scene)


def verdict(mutant: Mutant, folder: Path) -> tuple[Verdict, str]:
    """Load it from a file in `folder`, and plan for two iterations."""
    path = placed(mutant.content, folder)
    return judge(lambda: load_task(path), error_in, mutant.reason)


def error_in(task: Task) -> str:
    """The error in a loaded task; "" if there is none."""
    robot = task.scene.robot
    ends = [x for end in (task.start, task.goal) for x in _numbers_of(end, robot)]
    if not all(np.isfinite(x).all() for x in (*ends, task.duration)):
        return "it holds numbers that are not finite"
    intervals, starts = task.options.interval_count, task.options.starts
    if not (np.min(task.duration) > 0 and 1 <= intervals <= 10**6 and starts >= 1):
        return "its duration, intervals or starts are not positive"
    task.scene.describe()
    if intervals > MAX_PLANNED_INTERVALS:
        return ""
    once = task.with_options(starts=1, tolerance=None)
    solution = plan_task(once, max_iterations=2, time_limit=2.0, processes=1)
    if solution.success and not np.isfinite(solution.cost):
        return f"a minimum of cost {solution.cost} was reported"
    return "" if solution.message else "its plan says nothing"


def _numbers_of(end: State | FrameGoal, robot: Robot) -> list[Any]:
    """The numbers of a state, or of a frame's target."""
    if isinstance(end, State):
        return [*end.on(robot, "end")]
    parts = (end.position, end.rotation, *(end.axis or ()))
    return [np.asarray(part) for part in parts if part is not None]


def _written(scene: dict[str, Any]) -> bytes:
    try:
        return tomlkit.dumps(scene).encode("utf-8", "surrogatepass")
    except (ValueError, TypeError):  # not representable in TOML
        return repr(scene).encode("utf-8", "surrogatepass")


def _entries(table: dict[str, Any] | list[Any]) -> Iterator[Entry]:
    """Every (container, key) below a table."""
    keys = list(table) if isinstance(table, dict) else range(len(table))
    for key in keys:
        yield table, key
        if isinstance(table[key], dict | list):  # type: ignore[index]
            yield from _entries(table[key])  # type: ignore[index]


def _random_entry(scene: dict[str, Any], random: Random) -> Entry:
    return random.choice([*_entries(scene)] or [(scene, "robot")])


# Changes after which the file may or may not be valid


def _value(scene: dict[str, Any], random: Random) -> None:
    owner, key = _random_entry(scene, random)
    owner[key] = random.choice(UNUSUAL_VALUES)


def _remove(scene: dict[str, Any], random: Random) -> None:
    owner, key = _random_entry(scene, random)
    if len(owner) > 1 or owner is not scene:
        owner.pop(key) if isinstance(owner, list) else owner.pop(key, None)


def _rename(scene: dict[str, Any], random: Random) -> None:
    owner, key = _random_entry(scene, random)
    if isinstance(owner, dict):
        name = random.choice((f"{key}s", "", "q", "v", "elbow", "a" * 1_000, "gravity", "\n"))
        owner[name] = owner.pop(key, 0)


def _swap(scene: dict[str, Any], random: Random) -> None:
    (one, i), (other, j) = _random_entry(scene, random), _random_entry(scene, random)
    one[i] = other[j] if not isinstance(other[j], dict | list) else 1


def _settings(scene: dict[str, Any], random: Random) -> None:
    choices: dict[str, tuple[Any, ...]] = {
        "intervals": (1, 2, 5, 33, 64),
        "name": ("taylor-midpoint", "galerkin-0", "galerkin-1", "hermite-simpson"),
    }
    table = scene.setdefault("scheme", {})
    if isinstance(table, dict):
        table.update({key: random.choice(values) for key, values in choices.items()})
    numbers = (1e-300, 1e-9, 1e-3, 0.3, 7.0, 1e4, 1e100, 1e308)
    texts = ("1e-300 s", "300 ms", "0.5min", "1e307 h", "1e-324 s", ["1 s", "2 s"])
    scene["duration"] = random.choice((*numbers, *texts))


def _passed(scene: dict[str, Any], random: Random) -> None:
    times = (0.1, "100 ms", "0.1 s", "1 h", "0 s", "0.1", "0.1 sec", "nan s", [], True)
    goal = {"frame": "tip", "position": [0.5, 0.0, 0.5]}
    scene["via"] = [goal | {"time": random.choice(times)}, {"time": "200 ms", "q": [0.0, 0.0]}]
    if random.random() < 0.5:
        scene["via"].pop()


def _framed(scene: dict[str, Any], random: Random) -> None:
    """An end by the target of a frame: few of them are within reach."""
    numbers = (0.0, 0.3, -0.5, 1.0, 1e308, float("nan"), "1")
    sizes = {"position": 3, "rpy": 3, "quaternion_xyzw": 4, "quaternion_wxyz": 4, "q": 2}
    chosen = random.sample([*sizes], random.randint(1, 3))
    end: dict[str, Any] = {"frame": random.choice(("tip", "tip", "tip", "world", ""))}
    for key in chosen:
        plain = random.choice(([0.6, 0.8, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], [0.5] * 4))
        some = [random.choice(numbers) for _ in range(random.choice((sizes[key], 1)))]
        end[key] = plain[: sizes[key]] if random.random() < 0.7 else some
    scene[random.choice(("start", "goal"))] = end


def _held(scene: dict[str, Any], random: Random) -> None:
    """Joints that are locked at positions, and a group that no example has."""
    joint = random.choice(("elbow", "shoulder", "slide", "wrist", ""))
    scene["locked"] = {joint: random.choice((0, 0.0, 0.3, -9.0, 1e308, float("nan"), "1", True))}
    if random.random() < 0.2:
        scene["group"] = random.choice(("arm", "", 1, [], "a" * 1_000))


def _spelled(scene: dict[str, Any], random: Random) -> None:
    """Options that few files have, and a scheme by its name alone."""
    strange = (0, 1, 2, True, "", "1 s", "cubic", "minimum-jerk", "galerkin-2", -1.0, 1e300, [])
    keys = ("time_limit", "max_iterations", "continuation", "guess", "scheme", "intervals")
    for key in random.sample(keys, random.randint(1, 3)):
        scene[key] = random.choice(strange)


def _cost(scene: dict[str, Any], random: Random) -> None:
    """Random formulas and weights: few of them are valid."""
    text = "".join(random.choice(FORMULA_PARTS) for _ in range(random.randint(1, 9)))
    formula = random.choice((text, "dot(tau, tau)", f"dot({text}, tau)", f"sum({text})"))
    effects = scene.setdefault("effects", {})
    if isinstance(effects, dict):
        effects["running_cost"] = {"terms": {"first": formula, "second": 1e-3}}
        weight = random.choice((0.0, 1.0, 1e300, {"elbow": 0.0}, formula))
        matrix = random.choice(([[1.0, 0.0], [0.0, 0.0]], [[formula, 0.0], [0.0, 1.0]], [[1.0]]))
        effects["effort_weight"] = random.choice(({"weight": weight}, {"matrix": matrix}, {}))


_CHANGES: tuple[Change, ...] = (
    *(_value, _value, _remove, _rename, _swap, _settings, _passed),
    *(_cost, _framed, _held, _spelled, grouped, shipped),
)

# Changes that make the file invalid; the docstring is the reason


def _duration(scene: dict[str, Any], random: Random) -> None:
    """the duration is not a positive number"""
    texts = ("2", "2 sec", "0 s", "-1 s", "2 mm", "1.2.3 s", "1e999 s", "2 s 3", "1e-400 s", "s")
    pairs = (["2 s", "1 s"], ["1 s", "2 sec"], [1.0, "0 s"], ["1 s"])
    scene["duration"] = random.choice((*NOT_NUMBERS[:6], 0, -1, -1e-9, 0.0, *texts, *pairs))


def _intervals(scene: dict[str, Any], random: Random) -> None:
    """the number of intervals is impossible"""
    impossible = (0, -1, 10**9, 10**30, 1.5, "16", True)
    scene.setdefault("scheme", {})["intervals"] = random.choice(impossible)


def _end(scene: dict[str, Any], random: Random) -> None:
    """an end is not a state of the robot"""
    bad: tuple[Any, ...] = (float("nan"), float("inf"), "0", True)
    q = random.choice(([random.choice(bad), 0.0], [0.0], [0.0] * 3, [], {"elbow": 0.0}, 0.0))
    scene[random.choice(("start", "goal"))]["q"] = q


def _unknown(scene: dict[str, Any], random: Random) -> None:
    """a key, effect, scheme or robot is unknown"""
    where, key, value = random.choice(
        (
            (scene, "durration", 1.0),
            (scene.setdefault("effects", {}), "gravitas", {}),
            (scene.setdefault("scheme", {}), "name", "galerkin"),
            (scene, "robot", "no_such_robot"),
            (scene["start"], "w", [0.0, 0.0]),
        )
    )
    where[key] = value


def _gravity(scene: dict[str, Any], random: Random) -> None:
    """gravity is not a finite number of 0 or more"""
    value = random.choice((*NOT_NUMBERS, -9.81, -1e-9))
    scene.setdefault("effects", {})["gravity"] = {"acceleration": value}


def _lacking(scene: dict[str, Any], random: Random) -> None:
    """something that is needed is missing"""
    scene.pop(random.choice(("robot", "duration", "start", "goal")))


def _segment_duration(scene: dict[str, Any], random: Random) -> None:
    """a segment's duration is not a positive number"""
    wrong = (*NOT_NUMBERS[:6], 0, -1, -1e-9, 0.0, "2 parsecs", "-1 s", [1.0, 2.0])
    random.choice(scene["segments"])["duration"] = random.choice(wrong)


def _segment_lacking(scene: dict[str, Any], random: Random) -> None:
    """a segment lacks its duration, or the last one its goal"""
    if random.random() < 0.5:
        random.choice(scene["segments"]).pop("duration")
    else:
        scene["segments"][-1].pop("goal")


def _segment_unknown(scene: dict[str, Any], random: Random) -> None:
    """a segment has an unknown key, or one of the whole motion"""
    key = random.choice(("start", "via", "intervals", "tolerance", "durration"))
    random.choice(scene["segments"])[key] = 1.0


def _beside_segments(scene: dict[str, Any], random: Random) -> None:
    """a file with segments has a duration or a goal, too"""
    key = random.choice(("duration", "goal"))
    scene[key] = 1.0 if key == "duration" else dict(scene["start"])


_SEGMENT_CHANGES: tuple[Change, ...] = (
    _segment_duration,
    _segment_lacking,
    _segment_unknown,
    _beside_segments,
)
_INVALIDATING_CHANGES: tuple[Change, ...] = (
    _duration,
    _intervals,
    _end,
    _unknown,
    _gravity,
    _lacking,
    no_robot,
    half_a_group,
)
