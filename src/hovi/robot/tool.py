"""Frames that are added to a robot: the point of a tool, at an offset from the flange."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pinocchio as pin

from hovi.checks.kinds import shown
from hovi.checks.shapes import numbers_of
from hovi.errors import InputError, ModelError, nearest
from hovi.robot.space.orientation import ORIENTATIONS, rotation_from
from hovi.system.dataclass import dataclass

MAX_TOOLS = 100
"""Largest number of tools of a robot."""
KEYS = ("frame", "position", *ORIENTATIONS)
"""What is said of a tool."""
_EXAMPLE = '{"tcp": {"frame": "tool0", "position": [0, 0, 0.12]}}'


@dataclass(frozen=True)
class Tool:
    """A frame of a tool.

    name: of it. frame: of the robot, in which it is. position: of its origin there, (3,), in [m].
    rpy: of its axes there, in [rad].
    """

    name: str
    frame: str
    position: tuple[float, ...] = (0.0, 0.0, 0.0)
    rpy: tuple[float, ...] = (0.0, 0.0, 0.0)

    @property
    def placement(self) -> pin.SE3:
        """Its pose in the frame."""
        return pin.SE3(pin.rpy.rpyToMatrix(np.array(self.rpy)), np.array(self.position))

    def to_dict(self) -> dict[str, Any]:
        """Its table, as `as_tools` takes it."""
        given = {key: list(getattr(self, key)) for key in ("position", "rpy")}
        return {"frame": self.frame, **{key: x for key, x in given.items() if any(x)}}


def as_tools(given: Any) -> tuple[Tool, ...]:
    """Tools from tables by name. Raises InputError for anything else."""
    if not isinstance(given, Mapping) or len(given) > MAX_TOOLS:
        raise InputError(
            f"tools must map up to {MAX_TOOLS} names to tables, such as {_EXAMPLE}, got "
            f"{shown(given)}."
        )
    return tuple(_tool(name, table) for name, table in given.items())


def _tool(name: Any, table: Any) -> Tool:
    what = f"tool {name!r}"
    if not isinstance(name, str) or not name:
        raise InputError(f"a tool needs a name, got {name!r}.")
    if not isinstance(table, Mapping) or not isinstance(table.get("frame"), str):
        raise InputError(f"{what} needs the `frame` in which it is, got {shown(table)}.")
    for key in table:
        if key not in KEYS:
            raise InputError(f"{what} has no `{key}`: {nearest(str(key), KEYS)}")
    turns = [key for key in ORIENTATIONS if table.get(key) is not None]
    if len(turns) > 1:
        raise InputError(f"{what} takes one rotation: leave out {turns[0]} or {turns[1]}.")
    position = numbers_of(f"the position of {what}", table.get("position", (0.0, 0.0, 0.0)))
    if position.shape != (3,) or not np.isfinite(position).all():
        raise InputError(
            f"the position of {what} must be three finite numbers in m, got {shown(position)}."
        )
    R = rotation_from(turns[0], table[turns[0]], what) if turns else np.eye(3)
    rpy = pin.rpy.matrixToRpy(R)
    return Tool(name, table["frame"], tuple(position.tolist()), tuple(rpy.tolist()))


def with_tools(model: pin.Model, tools: Sequence[Tool]) -> pin.Model:
    """A model to which the frames of tools are added, in place; they may be in each other's.

    Raises ModelError for a frame that the model does not have, and for a name that it has.
    """
    for each in tools:
        if model.existFrame(each.name):
            raise ModelError(
                f"the robot has a frame {each.name!r} already: give the tool another name."
            )
        if not model.existFrame(each.frame):
            names = [str(frame.name) for frame in model.frames]
            raise ModelError(
                f"tool {each.name!r} is in frame {each.frame!r}, which the robot does not have: "
                f"{nearest(each.frame, names)}"
            )
        index = model.getFrameId(each.frame)
        parent = model.frames[index]
        placement = parent.placement * each.placement
        kind = pin.FrameType.OP_FRAME
        model.addFrame(pin.Frame(each.name, parent.parentJoint, index, placement, kind), False)
    return model
