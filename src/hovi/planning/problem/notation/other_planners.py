"""What to give instead of options, and of goals, that other planners take."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hovi.checks.shapes import numbers_of
from hovi.errors import InputError
from hovi.robot.robot import Robot
from hovi.robot.space.coordinates import Coordinates

PYTHON = {"v": 'limits={"v": "50 %"}', "a": 'limits={"base": "panda", "a": "50 %"}'}
"""Limits in per cent of those of the robot, and of those of an arm, as written in Python."""
TOML = {"v": 'limits = { v = "50 %" }', "a": 'limits = { base = "panda", a = "50 %" }'}
"""The same in scene files."""
COMMAND_LINE = {
    "v": "--limits \"{v = '50 %'}\"",
    "a": "--limits \"{base = 'panda', a = '50 %'}\"",
}
"""The same on the command line."""
_VELOCITIES = "give limits, such as {v} of those of the robot, or numbers in rad/s"
_ACCELERATIONS = (
    "give limits, such as {a} of those that the maker of an arm publishes, or numbers in rad/s^2"
)
_OPTIONS = {
    "conditions": "conditions are given in Python, as in hovi.plan_task(hovi.load_task(file), "
    'conditions=[hovi.Condition("tau * v", hovi.Between(-80, 80), name="power")]), but for '
    "`limits.power`: see docs/howto/limits.md",
    "constraints": "give hovi.plan conditions of your own, such as "
    'conditions=[hovi.Condition("tau * v", hovi.Between(-80, 80), name="power")]: see '
    "docs/howto/limits.md",
    "contacts": "contacts are not planned for: see docs/when_not.md",
    "velocity_scaling": _VELOCITIES,
    "max_velocity_scaling_factor": _VELOCITIES,
    "acceleration_scaling": _ACCELERATIONS,
    "max_acceleration_scaling_factor": _ACCELERATIONS,
}


def instead_of(option: object, limits: Mapping[str, str] = PYTHON) -> str:
    """What to give instead of an option of another planner, as a clause with its stop; "" if none.

    limits: examples as they are written there: PYTHON, TOML or COMMAND_LINE.
    """
    advice = _OPTIONS.get(option) if isinstance(option, str) else None
    return f"{advice.format_map(limits)}." if advice else ""


def refuse_pose(given: Any, on: Coordinates, name: str) -> None:
    """Raise InputError for a homogeneous matrix or a rotation, which are poses of no frame.

    name: of the end in messages, such as "goal".
    """
    try:
        what = {(4, 4): "pose", (3, 3): "rotation"}.get(numbers_of(name, given).shape)
    except InputError:  # what is no array of numbers is refused elsewhere
        return
    if what is not None and isinstance(on, Robot):
        raise InputError(
            f"the {name} is a {what} of no frame: give hovi.FrameGoal({on.tip_frame!r}, "
            f"{what}=...), with the name of the frame that is to be there."
        )
