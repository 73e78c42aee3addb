"""A motion as MoveIt's message moveit_msgs/RobotTrajectory, in YAML or JSON."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from hovi.discrete.joined_motion import AnyMotion
from hovi.discrete.output.caution import caution_lines
from hovi.exchange.joint_trajectory import as_yaml, joint_trajectory
from hovi.exchange.whole_export import whole_export


def robot_trajectory(motion: AnyMotion, rate: float = 100.0) -> dict[str, Any]:
    """The message as a dictionary of its fields: a JointTrajectory, and no other joints.

    Arguments and errors as for `joint_trajectory`.
    """
    message = joint_trajectory(motion, rate)
    nothing = {"header": message["header"], "joint_names": [], "points": []}
    return {"joint_trajectory": message, "multi_dof_joint_trajectory": nothing}


def write_robot_trajectory(
    motion: AnyMotion, path: str | os.PathLike[str], rate: float = 100.0
) -> None:
    """Write the message as JSON if the name ends in .json, as YAML otherwise.

    The YAML begins with the motion's cautions, as comments. Arguments and errors as for
    `joint_trajectory`; DisplayError when the file cannot be written.
    """
    message = robot_trajectory(motion, rate)
    if Path(path).suffix.lower() == ".json":
        text = json.dumps(message, indent=1) + "\n"
    else:
        parts = ((key, as_yaml(part)) for key, part in message.items())
        body = "".join(f"{key}:\n{_indented(part)}" for key, part in parts)
        text = "".join(f"# {each}\n" for each in caution_lines([motion.metadata])) + body
    with whole_export(path, "message") as stream:
        stream.write(text.encode())


def _indented(text: str) -> str:
    return "".join(f"  {line}\n" for line in text.splitlines())
