"""A motion as a recording of the Rerun viewer: curves of the joints, and the robot as bars."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.discrete.output.caution import caution_lines
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.exchange.joint_motion import joint_motion
from hovi.exchange.libraries import library
from hovi.exchange.link_poses import link_poses, links_of
from hovi.exchange.whole_export import written_elsewhere
from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]

TIMELINE = "motion"
KINDS = ("position", "velocity", "acceleration", "effort")


def write_rerun(trajectory: Trajectory, path: str | os.PathLike[str], rate: float = 100.0) -> None:
    """Write curves under /joints/NAME/position, velocity, acceleration and effort.

    Poses of the links in the world are under /robot/LINK, bars between them at /robot/bars. Times
    are on the timeline "motion", in nanoseconds; a motion without its robot has the curves alone.
    Its cautions are a text under /cautions.
    rate: samples per second.
    Raises InputError for an invalid rate, DisplayError when the file cannot be written or rerun-sdk
    is missing.
    """
    motion = joint_motion(trajectory, rate)
    if len(np.unique(np.round(motion.times * 1e9))) < len(motion.times):
        raise InputError(
            f"at {rate:g} samples per second two of them have the same time in nanoseconds: use a "
            "lower rate."
        )
    rerun = library("rerun", "rerun-sdk", "the format 'rerun'")
    with written_elsewhere(path, "recording") as elsewhere:
        stream = rerun.RecordingStream("hovi", recording_id=f"motion of {motion.times[-1]!r} s")
        stream.save(elsewhere)
        times = rerun.TimeColumn(TIMELINE, duration=motion.times)
        for kind, values in zip(KINDS, (motion.q, motion.v, motion.a, motion.tau), strict=True):
            for name, column in zip(motion.names, values.T, strict=False):
                curve = rerun.Scalars.columns(scalars=column)
                stream.send_columns(f"joints/{name}/{kind}", indexes=[times], columns=curve)
        cautions = caution_lines([trajectory.metadata])
        if cautions:
            stream.log("cautions", rerun.TextDocument("\n".join(cautions)), static=True)
        if trajectory.robot is not None:
            q = trajectory.configurations(motion.times)
            _draw(rerun, stream, trajectory.robot, q, times)
        stream.flush()
        stream.disconnect()


def _draw(rerun: Any, stream: Any, robot: Robot, q: Array, times: Any) -> None:
    links = links_of(robot)
    poses = link_poses(robot, links, q, in_world=True)
    for i, link in enumerate(links):
        columns = rerun.Transform3D.columns(translation=poses[:, i, :3], quaternion=poses[:, i, 3:])
        stream.send_columns(f"robot/{link.name}", indexes=[times], columns=columns)
    number = {link.name: i for i, link in enumerate(links)}
    bars = [(number[link.parent], i) for i, link in enumerate(links) if link.parent in number]
    ends = np.array(bars, dtype=int).reshape(-1, 2)
    strips = poses[:, ends, :3].reshape(-1, 2, 3)  # (M bars, 2 ends, 3)
    columns = rerun.LineStrips3D.columns(strips=list(strips))
    stream.send_columns(
        "robot/bars", indexes=[times], columns=columns.partition([len(bars)] * len(q))
    )
