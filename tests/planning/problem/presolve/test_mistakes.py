"""Mistakes in a task are told before it is solved, in the same words in Python and in a file.

Each task is a table: written as TOML it is a scene file, and its values are the arguments of
`hovi.plan`.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
import tomlkit

import hovi
from hovi.cli.application import main
from hovi.errors import HoviWarning

TWO_LINK, CART, BODY = (
    str(hovi.example(f"{name}.urdf")) for name in ("two_link", "cart_pole", "flying_body")
)
GRAVITY = {"gravity": {"acceleration": 9.81}}
COARSE = {"name": "galerkin-2x8", "intervals": 4}
Q0, Q1 = [0.0, -1.2, 1.2, -0.5, 0.3, 0.1], [1.2, -0.6, 0.4, 0.7, -0.8, 1.0]
UR5: dict[str, Any] = {
    "robot": "ur5",
    "duration": 1.5,
    "scheme": COARSE,
    "start": {"q": Q0},
    "goal": {"q": Q1},
    "effects": GRAVITY,
}
ARM: dict[str, Any] = UR5 | {"robot": TWO_LINK, "start": {"q": [0, 0]}, "goal": {"q": [0.4, 0.3]}}
HANDLE = {"frame": "tool0", "position": [0.45, 0.25, 0.25]}
LOAD = {"payload": {"frame": "tool0", "mass": 30.0}}
HEAVY = GRAVITY | LOAD
BALL = {"kind": "sphere", "name": "ball", "radius": 0.1}
WALL = {"kind": "box", "name": "wall", "size": [0.1, 0.1, 0.1], "position": [5.0, 5.0, 0.0]}
FLIGHT = {"times": [0.0, 1.0], "positions": [[400.0, -100.0, 0.0], [400.0, 100.0, 0.0]]}
HELD: dict[str, Any] = {
    "name": "tin",
    "frame": "tool0",
    "mass": 0.1,
    "shape": {"kind": "sphere", "radius": 0.02, "position": [0.0, 0.0, 0.0]},
}
BRIEF = {"time_limit": 0.2}
REACH: dict[str, Any] = {"duration": "500 ms", "goal": {"q": [0.4, 0.3]}}
BACK: dict[str, Any] = {"duration": 1.0, "goal": {"q": [0.0, 0.0]}}
PICK: dict[str, Any] = {
    "robot": TWO_LINK,
    "start": {"q": [0, 0]},
    "segments": [REACH, BACK],
    "scheme": COARSE,
    "effects": GRAVITY,
}
STRETCHED = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
FAR_SIDE = HANDLE | {"position": [-0.45, -0.25, 0.25]}
LIFT: dict[str, Any] = {
    "robot": "ur5",
    "start": {"q": Q0},
    "scheme": COARSE,
    "effects": GRAVITY,
}
OUT: dict[str, Any] = {"name": "out", "duration": 1.5, "goal": {"q": Q1}}


def limited(**kinds: Any) -> dict[str, Any]:
    return {"limits": {"base": "urdf", **kinds}}


REFUSED: dict[str, tuple[dict[str, Any], tuple[str, ...]]] = {
    "a goal in degrees": (
        UR5 | {"goal": {"q": [60.0, -30.0, 20.0, 40.0, -50.0, 60.0]}},
        (
            "'shoulder_pan_joint' at the goal is 60 rad, outside its limits [-6.28319, 6.28319]",
            "which looks like degrees: 60 degrees are 1.047 rad",
        ),
    ),
    "a position in millimetres": (
        UR5 | {"goal": HANDLE | {"position": [457.0, 191.0, 300.0]}},
        ("(457, 191, 300) m looks like millimetres, which are (0.457, 0.191, 0.3) m",),
    ),
    "more equations than joints": (
        ARM | {"goal": {"frame": "tip", "position": [0.5, 0.5, 0.0], "rpy": [0.0, 0.0, 0.0]}},
        ("6 coordinates of frame 'tip', which only 2 joint coordinates move",),
    ),
    "too little time for a joint": (
        UR5 | {"duration": "200 ms"},
        ("'shoulder_pan_joint' has to move by 1.2 rad, which takes 0.381 s", "the duration"),
    ),
    "too little time for a frame": (
        UR5 | {"duration": 0.2, "goal": HANDLE | {"position": [-0.45, -0.25, 0.25]}},
        (
            "frame 'tool0' cannot move from the start to the goal within 0.2 s",
            "takes 0.69",
            "velocity limits",
        ),
    ),
    "too little time to a via point": (
        UR5 | {"via": [{"time": "100 ms", "q": Q1}], "goal": {"q": Q0}},
        ("has to move by 1.2 rad from the start to the via point at 0.1 s", "0.381 s"),
    ),
    "too little time by the acceleration": (
        UR5 | {"duration": 0.5} | limited(a=5.0),
        ("takes 0.9798 s", "acceleration limit of 5 rad/s^2", "increase the duration"),
    ),
    "a torque that no acceleration avoids": (
        UR5 | {"start": {"q": STRETCHED}, "effects": HEAVY, "duration": 3} | limited(a=2.0),
        ("'shoulder_lift_joint' at the start is at best -", "outside its limits [-150, 150]"),
    ),
    "a load that a smooth start cannot hold": (
        UR5 | {"start": {"q": STRETCHED}, "effects": HEAVY, "smooth": True},
        ("the torque of joint 'shoulder_lift_joint' at the start is -299.7 N m", "[-150, 150]"),
    ),
    "a goal in an obstacle": (
        UR5 | {"obstacles": [BALL | {"position": [0.8, 0.19, 0.0]}], "goal": {"q": STRETCHED}},
        ("at the goal link 'wrist_3_link' and obstacle 'ball' overlap by 0.", "change the goal"),
    ),
    "a start in an obstacle": (
        UR5 | {"obstacles": [BALL | {"position": [0.3, 0.1, 0.1]}], "start": {"q": STRETCHED}},
        ("at the start link 'upper_arm_link' and obstacle 'ball' overlap by 0.",),
    ),
    "a goal in which links overlap": (
        UR5 | {"self_collision": True, "goal": {"q": [0.0, 0.0, 3.1, 0.0, 0.0, 0.0]}},
        ("at the goal link 'upper_arm_link' and link 'wrist_1_link' overlap by 0.078 m",),
    ),
    "too little time for a segment": (
        LIFT | {"segments": [OUT, {"name": "rush", "duration": 0.2, "goal": {"q": Q0}}]},
        ("in 'rush' joint 'shoulder_pan_joint' has to move by 1.2 rad, which takes 0.381 s",),
    ),
    "too little time for a frame of a segment": (
        LIFT
        | {
            "segments": [
                {"name": "rush", "duration": 0.2, "goal": FAR_SIDE},
                {"duration": 2.0, "goal": {"q": Q0}},
            ]
        },
        ("in 'rush' frame 'tool0' cannot move from the start to the goal within 0.2 s",),
    ),
    "a goal of a segment in an obstacle": (
        LIFT
        | {
            "obstacles": [BALL | {"position": [0.8, 0.19, 0.0]}],
            "segments": [OUT | {"goal": {"q": STRETCHED}}, {"duration": 2.0, "goal": {"q": Q0}}],
        },
        ("in 'out' at the goal link 'wrist_3_link' and obstacle 'ball' overlap by 0.",),
    ),
    "a margin in millimetres": (
        UR5 | {"margin": 10.0, "obstacles": [BALL | {"position": [1.0, 1.0, 1.0]}]},
        ("at the start link", "less than the margin of 10 m"),
    ),
}
"""Tasks without a motion: infeasible in Python, exit code 1 on the command line."""

WRONG: dict[str, tuple[dict[str, Any], tuple[str, ...]]] = {
    "a negative mass": (
        UR5 | {"effects": GRAVITY | {"payload": {"frame": "tool0", "mass": -2.0}}},
        ("effect 'payload': mass must be finite and 0 or more, got -2 kg.",),
    ),
    "a negative duration": (UR5 | {"duration": -1}, ("`duration` must be a positive number",)),
    "a falling pair of durations": (
        UR5 | {"duration": [2.0, 1.0]},
        ("`duration` must be a list [lower, upper] whose lower bound", "but it is [2, 1]."),
    ),
    "a unit of time": (UR5 | {"duration": "1 sec"}, ("the duration '1 sec' has the unit 'sec'",)),
    "a joint that is left out": (
        ARM | {"start": {"q": {"elbow": 0.3}}},
        ("`start.q` leaves out joint 'shoulder'; it needs every joint.",),
    ),
    "an unknown joint": (
        ARM | {"goal": {"q": {"elbo": 0.3, "shoulder": 0.1}}},
        ("`goal.q` names joint 'elbo'", "did you mean 'elbow'?"),
    ),
    "two numbers for one joint": (
        ARM | {"goal": {"q": {"elbow": [0.3, 1.0], "shoulder": 0.1}}},
        ("`goal.q.elbow` must be one number, but it has 2.",),
    ),
    "a state of a frame": (
        UR5 | {"goal": HANDLE | {"q": Q1}},
        ("a goal of a `frame` takes no `q`: leave it out.",),
    ),
    "a position without a frame": (
        UR5 | {"start": {"q": Q0, "position": [0.1, 0.2, 0.3]}},
        ("`position` needs a `frame`.",),
    ),
    "a start without q": (UR5 | {"start": {"v": Q0}}, ("`start` needs q, or a frame and its",)),
    "an unknown effect": (
        UR5 | {"effects": {"gravty": {}}},
        ("there is no effect 'gravty'; did you mean 'gravity'?",),
    ),
    "an unknown key of an effect": (
        UR5 | {"effects": {"gravity": {"aceleration": 9.81}}},
        ("unknown key `effects.gravity.aceleration`; did you mean 'acceleration'",),
    ),
    "a key of an effect that is missing": (
        UR5 | {"effects": {"payload": {"frame": "tool0"}}},
        ("`effects.payload.mass` is missing",),
    ),
    "an acceleration at a via point": (
        UR5 | {"via": [{"time": 0.7, "q": Q1, "a": Q0}]},
        ("a via point takes no `a`: leave it out.",),
    ),
    "an unknown key of a segment": (
        PICK | {"segments": [REACH | {"time": 1.0}, BACK]},
        ("unknown key `segments[0].time`; did you mean 'name'?",),
    ),
    "a segment without a duration": (
        PICK | {"segments": [REACH, {"goal": {"q": [0.0, 0.0]}}]},
        ("`segments[1].duration` is missing; it must be a positive number of seconds, a text",),
    ),
    "a negative duration of a segment": (
        PICK | {"segments": [REACH | {"duration": -1.0}, BACK]},
        ("`segments[0].duration` must be a positive number of seconds, a text", "it is -1.0"),
    ),
    "a goal of a segment that names a frame twice": (
        PICK | {"segments": [REACH, BACK | {"goal": {"position": [0.1, 0.2, 0.3]}}]},
        ("`position` needs a `frame`.",),
    ),
    "a goal of a segment without a joint": (
        PICK | {"segments": [REACH, BACK | {"goal": {"q": {"elbow": 0.2}}}]},
        ("`segments[1].goal.q` leaves out joint 'shoulder'; it needs every joint.",),
    ),
    "an unknown key of a payload in a segment": (
        PICK | {"segments": [REACH, BACK | {"effects": {"payload": {"frame": "tip", "mas": 1.0}}}]},
        ("unknown key `segments[1].effects.payload.mas`; did you mean 'mass'?",),
    ),
    "a negative limit in a segment": (
        PICK | {"segments": [REACH | {"limits": {"v": {"elbow": -2.0}}}, BACK]},
        ("limits.v of 'elbow' must be a positive number",),
    ),
    "a last segment without a goal": (
        PICK | {"segments": [REACH, {"duration": 1.0}]},
        ("the last segment, 'segment 2', needs a goal.",),
    ),
    "an acceleration where segments meet": (
        PICK | {"segments": [REACH | {"goal": {"q": [0.4, 0.3], "a": [1.0, 0.0]}}, BACK]},
        ("the goal of 'segment 1' takes no `a`",),
    ),
    "an unknown kind of obstacle": (
        UR5 | {"obstacles": [WALL | {"kind": "boks"}]},
        ("obstacle 'wall': there is no obstacle of kind 'boks': did you mean 'box'?",),
    ),
    "an obstacle without a kind": (
        UR5 | {"obstacles": [{key: value for key, value in WALL.items() if key != "kind"}]},
        ("obstacle 'wall': an obstacle needs `kind`: valid names are 'box', ",),
    ),
    "an unknown key of an obstacle": (
        UR5 | {"obstacles": [{**WALL, "centre": [0, 0, 0]}]},
        ("obstacle 'wall': a box has no `centre`: ",),
    ),
    "an obstacle without a size": (
        UR5 | {"obstacles": [{"kind": "box", "position": [0, 0, 3]}]},
        ("obstacle 'number 1': a box needs `size`.",),
    ),
    "a file of obstacles that is no such file": (
        UR5 | {"obstacles": [{"kind": "file", "name": "hall", "file": "hall.step"}]},
        ("obstacle 'hall': obstacles are read from .urdf, .yaml, .yml files",),
    ),
    "a grasped object without a mass": (
        UR5 | {"grasped": [{"frame": "tool0", "shape": BALL}]},
        ("`grasped[0].mass` is missing; it must be a positive number of kilograms",),
    ),
    "an unknown key of a grasped object": (
        UR5 | {"grasped": [{"frame": "tool0", "mass": 1.0, "shape": BALL, "rot": 1.0}]},
        ("unknown key `grasped[0].rot`; ",),
    ),
    "a grasped object of an unknown kind": (
        UR5 | {"grasped": [{"frame": "tool0", "mass": 1.0, "shape": {"kind": "bal"}}]},
        ("`shape` of grasped object 'grasped': there is no obstacle of kind 'bal'",),
    ),
    "one direction of an axis": (
        UR5 | {"goal": HANDLE | {"axis": {"frame": [0.0, 0.0, 1.0]}}},
        ("axis",),
    ),
    "an unknown kind of limits": (
        UR5 | {"limits": {"base": "urdf", "speed": 1.0}},
        ("unknown key `limits.speed`; ",),
    ),
    "a number of intervals given twice": (
        UR5 | {"intervals": 7},
        ("`intervals` and `scheme.intervals` are the same: leave one of them out.",),
    ),
}
"""Tasks that are refused: an error in Python, exit code 2 on the command line."""

POSSIBLE: dict[str, tuple[dict[str, Any], tuple[str, ...]]] = {
    "a goal in degrees without limits": (
        ARM | {"limits": "none", "goal": {"q": [90.0, -45.0]}},
        ("shoulder is 90 rad in a given configuration", "looks like degrees", "1.571 rad"),
    ),
    "a duration in milliseconds": (
        UR5 | {"duration": 1500.0} | BRIEF,
        ("the duration of 1500 s looks like milliseconds, which are 1.5 s", "take 0.38 s"),
    ),
    "a payload in grams": (
        UR5 | {"effects": GRAVITY | {"payload": {"frame": "tool0", "mass": 500.0}}} | BRIEF,
        ("the payload of 500 kg looks like grams, which are 0.5 kg", "moving links weigh 17 kg"),
    ),
    "gravity in millimetres": (
        UR5 | {"effects": {"gravity": {"acceleration": 9810.0}}} | BRIEF,
        ("a gravity of 9810 m/s^2 looks like mm/s^2, which is 9.81 m/s^2",),
    ),
    "an orientation in degrees": (
        UR5 | {"goal": HANDLE | {"rpy": [180.0, 0.0, 90.0]}} | BRIEF,
        ("a frame goal's rpy = (180, 0, 90) rad looks like degrees", "(3.142, 0, 1.571) rad"),
    ),
    "an obstacle in millimetres": (
        UR5 | {"obstacles": [BALL | {"position": [457.0, 191.0, 300.0]}]} | BRIEF,
        ("obstacle 'ball' is 579 m", "away from the robot's base", "lengths are in metres"),
    ),
    "a box turned in degrees": (
        UR5 | {"obstacles": [WALL | {"rpy": [0.0, 0.0, 45.0]}]} | BRIEF,
        ("obstacle 'wall': rpy = (0, 0, 45) rad looks like degrees",),
    ),
    "the size of a box in millimetres": (
        UR5 | {"obstacles": [WALL | {"size": [457.0, 300.0, 200.0], "position": [1, 1, 2]}]},
        ("obstacle 'wall' measures 457 x 300 x 200 m, which looks like millimetres, 0.457 x 0.3",),
    ),
    "the radius of a sphere in millimetres": (
        UR5 | {"obstacles": [BALL | {"radius": 100.0, "position": [1.0, 1.0, 2.0]}]},
        ("obstacle 'ball' measures 200 x 200 x 200 m, which looks like millimetres, 0.2 x 0.2",),
    ),
    "a path of an obstacle in millimetres": (
        UR5 | BRIEF | {"obstacles": [BALL | {"position": [0, 0, 0], "path": FLIGHT}]},
        ("obstacle 'ball' is 412.3 m away from the robot's base", "lengths are in metres"),
    ),
    "the size of a grasped object in millimetres": (
        UR5 | BRIEF | {"grasped": [HELD | {"shape": WALL | {"size": [50.0, 50.0, 200.0]}}]},
        ("grasped object 'tin' measures 200 x 50 x 50 m, which looks like millimetres, 0.2 x",),
    ),
    "the position of a grasped object in millimetres": (
        UR5 | BRIEF | {"grasped": [HELD | {"position": [0.0, 0.0, 80.0]}]},
        ("the position (0, 0, 80) m of grasped object 'tin' is far from link 'tool0'",),
    ),
    "a grasped object turned in degrees": (
        UR5 | BRIEF | {"grasped": [HELD | {"rpy": [0.0, 0.0, 90.0]}]},
        ("grasped object 'tin': rpy = (0, 0, 90) rad looks like degrees",),
    ),
    "ranges of joints in degrees": (
        UR5 | BRIEF | limited(q=170.0),
        ("the position range of shoulder_pan_joint and of 5 more, -170 to 170 rad, looks like",),
    ),
    "velocities of joints in degrees": (
        UR5 | BRIEF | limited(v={"elbow_joint": 180.0}),
        (
            "the velocity limit of elbow_joint, 180 rad/s, looks like degrees: 180 degrees per",
            "3.142 rad/s, and the robot states 3.15 rad/s; limits are in radians.",
        ),
    ),
    "a payload's center in millimetres": (
        UR5
        | {"limits": "none"}
        | {"effects": {"payload": {"frame": "tool0", "mass": 0.1, "center": [0.0, 0.0, 80.0]}}},
        ("the payload's center (0, 0, 80) m is far from frame 'tool0'",),
    ),
    "a slide in millimetres": (
        ARM | {"robot": CART, "limits": "none", "goal": {"q": [457.0, 0.0]}},
        ("moves by 457 m, which looks like millimetres: 457 mm are 0.457 m",),
    ),
    "a load that cannot be held at the start": (
        UR5 | {"start": {"q": STRETCHED}, "effects": HEAVY} | BRIEF,
        (
            "holding the robot still at the start takes -299.7 N m at joint 'shoulder_lift_joint'",
            "whose limit is -150",
        ),
    ),
    "a load of a segment that cannot be held": (
        LIFT
        | BRIEF
        | {
            "segments": [
                OUT | {"goal": {"q": STRETCHED}},
                {"name": "lift", "duration": 2.0, "goal": {"q": Q0}, "effects": LOAD},
            ]
        },
        (
            "in 'lift' holding the robot still at the start takes -299.7 N m at joint",
            "whose limit is -150",
        ),
    ),
    "an obstacle in millimetres beside a sequence": (
        LIFT
        | BRIEF
        | {
            "obstacles": [BALL | {"position": [457.0, 191.0, 300.0]}],
            "segments": [OUT, {"duration": 2.0, "goal": {"q": Q0}}],
        },
        ("obstacle 'ball' is 579 m", "away from the robot's base", "lengths are in metres"),
    ),
    "a load that cannot be held at any configuration of the goal": (
        UR5
        | {"start": {"q": [0.0, -1.57, 0.0, -1.57, 0.0, 0.0]}, "effects": HEAVY}
        | BRIEF
        | {"goal": {"frame": "tool0", "position": [0.85, 0.15, 0.1]}},
        ("holding the robot still at the goal", "configurations, takes", "whose limit is -150"),
    ),
}
"""Tasks that may be meant: a warning, and the plan goes on."""

ASSUMED: dict[str, tuple[dict[str, Any], tuple[str, ...]]] = {
    "gravity that is not named": (
        ARM | {"effects": {}},
        ("Gravity is left out, as the scene does not name it.",),
    ),
    "gravity that no segment names": (
        PICK | {"effects": {}},
        ("Gravity is left out, as the scene does not name it.",),
    ),
    "a base without motors": (
        ARM
        | {"robot": BODY, "free_flyer": True, "limits": "none", "effects": {}}
        | {
            "start": {"q": [0, 0, 0, 0, 0, 0, 1]},
            "goal": {"q": [0.1, 0, 0, 0, 0, 0, 1]},
        },
        ("a force and a moment", "name it in `passive`"),
    ),
    "newtons next to newton metres": (
        ARM | {"robot": CART, "limits": "none", "goal": {"q": [0.2, 0.1]}},
        ("squares of forces in N", "torques in N m", "effort_weight"),
    ),
}
"""Tasks that leave something unsaid: a note before the plan, and in its message."""


def planned(task: Mapping[str, Any]) -> hovi.Solution:
    """The plan of a table in Python, by the same words."""
    rest = dict(task)
    free = rest.pop("free_flyer", False)
    robot, effects = hovi.load_robot(rest.pop("robot"), free_flyer=free), rest.pop("effects")
    scene, start = hovi.Scene(robot, effects), rest.pop("start")
    if "segments" in rest:
        return hovi.plan_sequence(
            scene, start, rest.pop("segments"), **({"self_collision": False} | rest)
        )
    return hovi.plan(
        scene, start, rest.pop("goal"), rest.pop("duration"), **({"self_collision": False} | rest)
    )


def sentences(task: Mapping[str, Any]) -> tuple[str, list[str], str]:
    """The error, the warnings and the message of a plan."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", HoviWarning)
        try:
            found = planned(task)
        except hovi.HoviError as error:
            return str(error), [str(each.message) for each in caught], ""
    return "", [str(each.message) for each in caught], found.message


@pytest.fixture
def command(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> Any:
    """`hovi plan` of a table as a file: the exit code and all that is printed."""

    def run(task: Mapping[str, Any]) -> tuple[int, str]:
        path = tmp_path / "scene.toml"
        path.write_text(tomlkit.dumps(task))
        code = main(["plan", str(path), "--no-certificate"])
        printed = capfd.readouterr()
        return code, printed.out + printed.err

    return run


@pytest.mark.parametrize("mistake", REFUSED)
def test_a_task_without_a_motion_is_refused_with_the_reason(mistake: str, command: Any) -> None:
    task, fragments = REFUSED[mistake]
    error, _, message = sentences(task)
    assert not error
    assert message.startswith("no motion within the limits was found: ")
    assert all(fragment in message for fragment in fragments), message
    code, printed = command(task)
    assert code == 1
    assert message in printed


def test_degrees_outside_limits_are_reported_once(command: Any) -> None:
    task, _ = REFUSED["a goal in degrees"]
    _, warnings, message = sentences(task)
    assert "degrees" in message
    assert not any("degrees" in warning for warning in warnings)
    assert command(task)[1].count("degrees are") == 1


@pytest.mark.parametrize("mistake", WRONG)
def test_invalid_input_has_the_same_sentence_in_python_and_in_a_file(
    mistake: str, command: Any
) -> None:
    task, fragments = WRONG[mistake]
    error, _, _ = sentences(task)
    code, printed = command(task)
    assert code == 2
    for fragment in fragments:
        assert fragment in error
        assert fragment in printed


@pytest.mark.parametrize("mistake", POSSIBLE)
def test_what_may_be_meant_is_a_warning(mistake: str, command: Any) -> None:
    task, fragments = POSSIBLE[mistake]
    error, told, _ = sentences(task)
    assert not error
    sentence = next((each for each in told if fragments[0] in each), "")
    assert all(fragment in sentence for fragment in fragments), told
    code, printed = command(task)
    assert code in (0, 1)
    assert f"warning: {sentence}" in printed


@pytest.mark.parametrize("mistake", ASSUMED)
def test_what_a_scene_leaves_unsaid_is_noted_and_in_the_message(mistake: str, command: Any) -> None:
    task, fragments = ASSUMED[mistake]
    error, told, message = sentences(task)
    assert (error, told) == ("", [])
    assert all(fragment in message for fragment in fragments), message
    _, printed = command(task)
    notes = [line for line in printed.splitlines() if line.startswith("note: ")]
    assert any(all(fragment in note for fragment in fragments) for note in notes)
    assert message in printed


def test_a_task_without_mistakes_is_planned_without_a_word(command: Any) -> None:
    error, told, message = sentences(ARM)
    assert (error, told) == ("", [])
    assert message.startswith("a minimum of cost")
    code, printed = command({"format": 2, **ARM})
    assert code == 0
    assert "note: " not in printed
    assert "warning: " not in printed
