"""A motion as a ROS 2 message trajectory_msgs/JointTrajectory, in YAML or JSON.

The YAML is what `ros2 topic pub` and `ros2 action send_goal` take on the command line.
"""

from __future__ import annotations

import itertools
import json
import os
from pathlib import Path
from typing import Any

from hovi.discrete.joined_motion import AnyMotion
from hovi.discrete.output.caution import caution_lines
from hovi.errors import InputError
from hovi.exchange.joint_motion import joint_motion
from hovi.exchange.whole_export import whole_export

NANO = 10**9


def joint_trajectory(
    trajectory: AnyMotion, rate: float = 100.0, *, efforts: bool = False
) -> dict[str, Any]:
    """The message trajectory_msgs/JointTrajectory as a dictionary of its fields.

    Joints that mimic others and locked joints are left out: controllers command neither. Positions
    of continuous joints go on beyond a full turn. The stamp is 0: the motion starts when the
    message arrives.
    rate: points per second. efforts: fill in the field `effort` too, which the
        joint_trajectory_controller of many ROS 2 releases refuses.
    Raises InputError for a robot with a base or joints of several coordinates, and for a rate at
    which two points have the same time in nanoseconds.
    """
    motion = joint_motion(trajectory, rate)
    if motion.others:
        raise InputError(
            f"a JointTrajectory has joints with one position each, and {motion.others[0]!r} has "
            "several coordinates: use the format 'mcap' or 'csv', or plan with it locked."
        )
    if efforts and not motion.tau.size:
        raise InputError("this motion has no torques to write as efforts: leave out `efforts`.")
    stamps = [round(t * NANO) for t in motion.times]
    if any(a >= b for a, b in itertools.pairwise(stamps)):
        raise InputError(
            f"at {rate:g} points per second two of them have the same time in nanoseconds: use a "
            "lower rate."
        )
    q, v, a, tau = (x.tolist() for x in (motion.q, motion.v, motion.a, motion.tau))
    points = [
        {
            "positions": q[i],
            "velocities": v[i],
            "accelerations": a[i],
            "effort": tau[i] if efforts else [],
            "time_from_start": {"sec": stamp // NANO, "nanosec": stamp % NANO},
        }
        for i, stamp in enumerate(stamps)
    ]
    header = {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    return {"header": header, "joint_names": list(motion.names), "points": points}


def write_joint_trajectory(
    trajectory: AnyMotion,
    path: str | os.PathLike[str],
    rate: float = 100.0,
    *,
    efforts: bool = False,
) -> None:
    """Write the message as JSON if the name ends in .json, as YAML otherwise.

    The YAML begins with the motion's cautions, as comments; a message has no place for them.
    Arguments and errors as in `joint_trajectory`; DisplayError when the file cannot be written.
    """
    message = joint_trajectory(trajectory, rate, efforts=efforts)
    as_json = Path(path).suffix.lower() == ".json"
    lines = (f"# {each}\n" for each in caution_lines([trajectory.metadata]))
    text = json.dumps(message, indent=1) + "\n" if as_json else "".join(lines) + as_yaml(message)
    with whole_export(path, "message") as stream:
        stream.write(text.encode())


def as_yaml(message: dict[str, Any]) -> str:
    """Block style with one line per field. A JSON string is one of YAML, too."""
    names = [json.dumps(name) for name in message["joint_names"]]
    lines = [
        "header: {stamp: {sec: 0, nanosec: 0}, frame_id: ''}",
        f"joint_names: [{', '.join(names)}]",
        "points:" if message["points"] else "points: []",
    ]
    for point in message["points"]:
        time = point["time_from_start"]
        fields = ("positions", "velocities", "accelerations", "effort")
        rows = [f"{field}: [{', '.join(map(_number, point[field]))}]" for field in fields]
        rows += [f"time_from_start: {{sec: {time['sec']}, nanosec: {time['nanosec']}}}"]
        lines += [f"- {rows[0]}", *(f"  {row}" for row in rows[1:])]
    return "\n".join(lines) + "\n"


def _number(x: float) -> str:
    """The shortest decimal that is read as x; YAML 1.1 takes 1e-05 for a text, and 1.0e-05 not."""
    digits, exponent, power = repr(x).partition("e")
    return repr(x) if "." in digits else f"{digits}.0{exponent}{power}"
