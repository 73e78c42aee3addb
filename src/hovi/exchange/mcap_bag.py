"""A motion as an MCAP file of ROS 2 messages, as `ros2 bag record` writes them.

Foxglove shows it: the robot from /robot_description and /tf, curves from /joint_states.
"""

from __future__ import annotations

import json
import os
from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.discrete.output.caution import caution_lines
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.exchange import ros_messages
from hovi.exchange.joint_motion import JointMotion, joint_motion
from hovi.exchange.libraries import library
from hovi.exchange.link_poses import Link, link_poses, links_of
from hovi.exchange.whole_export import whole_export
from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]

START = ros_messages.NANO
"""Time of the start, in [ns]: a stamp of 0 means "the latest" to tf2."""
_FOREVER = "sec: 9223372036\n    nsec: 854775807"
_QOS = """- history: 1
  depth: {depth}
  reliability: 1
  durability: {durability}
  deadline:
    {forever}
  lifespan:
    {forever}
  liveliness: 1
  liveliness_lease_duration:
    {forever}
  avoid_ros_namespace_conventions: false"""
_LATCHED, _VOLATILE = 1, 2
_TOPICS = {
    "/robot_description": ("std_msgs/msg/String", _LATCHED),
    "/tf_static": ("tf2_msgs/msg/TFMessage", _LATCHED),
    "/tf": ("tf2_msgs/msg/TFMessage", _VOLATILE),
    "/joint_states": ("sensor_msgs/msg/JointState", _VOLATILE),
}


def write_mcap(trajectory: Trajectory, path: str | os.PathLike[str], rate: float = 100.0) -> None:
    """Write /joint_states, /tf, /tf_static and /robot_description, the last with the URDF's text.

    Joint states include joints that mimic others, with an effort of 0, which their leader bears,
    and locked joints, whose effort is not known (NaN). A base is a transform from "world". The
    motion begins at 1 s. The metadata "hovi" have its cautions, as JSON.
    rate: messages per second.
    Raises InputError for an invalid rate and a motion without its robot, DisplayError when the file
    cannot be written or a library is missing.
    """
    motion, robot = joint_motion(trajectory, rate), trajectory.robot
    if robot is None:
        raise InputError(
            "this motion was saved without its robot, which was a bare Pinocchio model: use the "
            "format 'joint-trajectory', or load the robot from a URDF and plan again."
        )
    writer_of = library("mcap.writer", "mcap-ros2-support", "the format 'mcap'")
    with whole_export(path, "MCAP file") as stream:
        writer = writer_of.Writer(stream)
        writer.start(profile="ros2", library="hovi")
        cautions = json.dumps(caution_lines([trajectory.metadata]))
        writer.add_metadata("hovi", {"cautions": cautions})
        _write(_Topics(writer), motion, robot, trajectory.configurations(motion.times))
        writer.finish()


class _Topics:
    """The topics of a file, each registered when it is first used."""

    def __init__(self, writer: Any) -> None:
        self._writer = writer
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._count: dict[str, int] = {}

    def write(self, topic: str, time: int, data: bytes) -> None:
        """Write one message. time: in [ns]."""
        if topic not in self._channels:
            self._channels[topic] = self._channel(topic)
        self._count[topic] = self._count.get(topic, 0) + 1
        self._writer.add_message(
            channel_id=self._channels[topic],
            log_time=time,
            publish_time=time,
            sequence=self._count[topic],
            data=data,
        )

    def _channel(self, topic: str) -> int:
        kind, durability = _TOPICS[topic]
        if kind not in self._schemas:
            self._schemas[kind] = self._writer.register_schema(
                name=kind, encoding="ros2msg", data=ros_messages.DEFINITIONS[kind].encode()
            )
        depth = 1 if durability == _LATCHED else 10
        qos = _QOS.format(depth=depth, durability=durability, forever=_FOREVER)
        return int(
            self._writer.register_channel(
                topic=topic,
                message_encoding="cdr",
                schema_id=self._schemas[kind],
                metadata={"offered_qos_profiles": qos},
            )
        )


def _write(topics: _Topics, motion: JointMotion, robot: Robot, q: Array) -> None:
    links = links_of(robot)
    poses = link_poses(robot, links, q)
    fixed = [i for i, link in enumerate(links) if not link.moving]
    moving = [i for i, link in enumerate(links) if link.moving]
    if robot.source.urdf is not None:
        topics.write("/robot_description", START, ros_messages.string(robot.source.urdf))
    if fixed:
        topics.write("/tf_static", START, _transforms(START, links, poses[0], fixed))
    names, states = _all_joints(motion, robot)
    for m, t in enumerate(motion.times):
        time = START + round(t * ros_messages.NANO)
        state = ros_messages.joint_state(time, names, *(x[m] for x in states))
        topics.write("/joint_states", time, state)
        if moving:
            topics.write("/tf", time, _transforms(time, links, poses[m], moving))


def _transforms(time: int, links: tuple[Link, ...], poses: Array, chosen: list[int]) -> bytes:
    parts = [(links[i].parent, links[i].name, poses[i]) for i in chosen]
    return ros_messages.transforms(time, parts)


def _all_joints(motion: JointMotion, robot: Robot) -> tuple[list[str], tuple[Array, Array, Array]]:
    """Names, and q, v and tau (M, J): followers and locked joints come after the others."""
    names, q, v, tau = list(motion.names), [motion.q], [motion.v], [motion.tau]
    rows, known = len(motion.times), motion.tau.size > 0
    for coupling in robot.couplings:
        of_leader = [name == coupling.leader for name in motion.names]  # none if it is fixed
        factor = coupling.multiplier * np.array(of_leader, dtype=float)[:, None]
        names.append(coupling.follower)
        q.append(motion.q @ factor + coupling.offset)
        v.append(motion.v @ factor)
        tau.append(np.zeros((rows, int(known))))
    for joint, position in robot.source.held.items():
        names.append(joint)
        q.append(np.full((rows, 1), position))
        v.append(np.zeros((rows, 1)))
        tau.append(np.full((rows, int(known)), np.nan))
    return names, (np.hstack(q), np.hstack(v), np.hstack(tau))
