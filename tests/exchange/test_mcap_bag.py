"""MCAP files, read back by the readers of mcap and of ROS 2 messages."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
import yaml
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from mcap_ros2.writer import Writer

import hovi
from hovi.discrete.output.stored_torque import StoredTorque
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.exchange.link_poses import links_of
from samples.cubic_motion import cubic_motion

START = 10**9


@pytest.fixture(scope="module")
def panda_motion() -> Trajectory:
    """A Panda with one finger that mimics the other, and one joint locked."""
    robot = hovi.load_robot("panda", mimic=True, locked={"panda_joint2": 0.3})
    return cubic_motion(hovi.Scene(robot, [hovi.effects.Gravity()]), duration=0.7)[0]


@pytest.fixture(scope="module")
def floating() -> Trajectory:
    robot = hovi.load_robot(hovi.example("spacecraft_arm.urdf"), free_flyer=True)
    grid = hovi.Grid.uniform(1.0, 2, hovi.schemes.galerkin(0))
    q = robot.integrate(robot.neutral(), np.linspace(0.1, 0.9, 9))
    still = np.tile(q, (3, 1)), np.zeros((3, 9)), np.zeros((2, 2, 9))
    path = hovi.DiscretePath(*still, np.zeros((2, 0, 9)))
    return Trajectory(grid, path, np.zeros((3, 2, 9)), hovi.Scene(robot))


def messages(path: Path) -> dict[str, list[Any]]:
    """The messages of each topic, in the order of the file."""
    found: dict[str, list[Any]] = {}
    for _, channel, message, decoded in decode(path):
        assert message.log_time == message.publish_time
        found.setdefault(channel.topic, []).append((message.log_time, decoded))
    return found


def decode(path: Path) -> list[Any]:
    """(schema, channel, message, decoded message) of every message."""
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        return list(reader.iter_decoded_messages())


def seconds(stamp: Any) -> float:
    return float(stamp.sec + 1e-9 * stamp.nanosec - 1.0)


def test_joint_states_are_the_samples(panda_motion: Trajectory, tmp_path: Path) -> None:
    panda_motion.to_mcap(tmp_path / "m.mcap", 50.0)
    states = messages(tmp_path / "m.mcap")["/joint_states"]
    times = np.append(np.arange(35) / 50.0, panda_motion.duration)
    assert [time - START for time, _ in states] == [round(1e9 * t) for t in times]
    assert [seconds(state.header.stamp) for _, state in states] == pytest.approx(times, abs=1e-9)
    q, v, _, tau = panda_motion.sample(times)
    n = q.shape[1]
    names = list(panda_motion.coordinate_names)
    for i, (_, state) in enumerate(states):
        assert state.name == [*names, "panda_finger_joint2", "panda_joint2"]
        np.testing.assert_array_equal(state.position[:n], q[i])
        np.testing.assert_array_equal(state.velocity[:n], v[i])
        np.testing.assert_array_equal(state.effort[:n], tau[i])
        finger = names.index("panda_finger_joint1")
        assert state.position[n:] == [q[i, finger], 0.3]
        assert state.velocity[n:] == [v[i, finger], 0.0]
        assert state.effort[n] == 0.0
        assert np.isnan(state.effort[n + 1])


def chained(parts: dict[str, tuple[str, pin.SE3]], link: str) -> pin.SE3:
    """The pose of a link in the world by the transforms of a file."""
    if link == "world":
        return pin.SE3.Identity()
    parent, pose = parts[link]
    return chained(parts, parent) * pose


def tree(found: dict[str, list[Any]], i: int) -> dict[str, tuple[str, pin.SE3]]:
    listed = list(found["/tf"][i][1].transforms)
    listed += found["/tf_static"][0][1].transforms if "/tf_static" in found else []
    parts = {}
    for each in listed:
        t, r = each.transform.translation, each.transform.rotation
        pose = pin.XYZQUATToSE3(np.array([t.x, t.y, t.z, r.x, r.y, r.z, r.w]))
        assert each.child_frame_id not in parts
        parts[each.child_frame_id] = each.header.frame_id, pose
    return parts


@pytest.mark.parametrize("which", ["panda_motion", "floating"])
def test_transforms_lead_to_every_link(
    which: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    motion = request.getfixturevalue(which)
    motion.to_mcap(tmp_path / "m.mcap", 5.0)
    found = messages(tmp_path / "m.mcap")
    data = motion.robot.model.createData()
    for i, (time, _) in enumerate(found["/tf"]):
        parts = tree(found, i)
        q = motion.configurations(min((time - START) * 1e-9, motion.duration))[0]
        pin.framesForwardKinematics(motion.robot.model, data, q)
        for k, frame in enumerate(motion.robot.model.frames):
            if frame.type == pin.FrameType.BODY:
                pose = chained(parts, frame.name)
                np.testing.assert_allclose(
                    pose.homogeneous, data.oMf[k].homogeneous, rtol=0, atol=1e-8
                )
    assert len(tree(found, 0)) == len(links_of(motion.robot))


def test_the_robot_is_described_by_its_urdf(panda_motion: Trajectory, tmp_path: Path) -> None:
    panda_motion.to_mcap(tmp_path / "m.mcap", 5.0)
    found = messages(tmp_path / "m.mcap")
    assert panda_motion.robot is not None
    assert found["/robot_description"][0][1].data == panda_motion.robot.source.urdf
    assert set(found) == {"/joint_states", "/tf", "/tf_static", "/robot_description"}


def test_bytes_are_those_of_another_encoder(panda_motion: Trajectory, tmp_path: Path) -> None:
    """Every message decoded, and written again by mcap-ros2-support."""
    panda_motion.to_mcap(tmp_path / "m.mcap", 5.0)
    again = io.BytesIO()
    with Writer(again) as writer:
        schemas: dict[str, Any] = {}
        for schema, channel, message, decoded in decode(tmp_path / "m.mcap"):
            if schema.name not in schemas:
                schemas[schema.name] = writer.register_msgdef(schema.name, schema.data.decode())
            writer.write_message(channel.topic, schemas[schema.name], decoded, message.log_time)
    again.seek(0)
    with (tmp_path / "m.mcap").open("rb") as stream:
        ours = [(c.topic, m.data) for _, c, m in make_reader(stream).iter_messages()]
    assert ours == [(c.topic, m.data) for _, c, m in make_reader(again).iter_messages()]


def test_channels_are_as_in_a_bag(panda_motion: Trajectory, tmp_path: Path) -> None:
    panda_motion.to_mcap(tmp_path / "m.mcap", 5.0)
    with (tmp_path / "m.mcap").open("rb") as stream:
        reader = make_reader(stream)
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
    assert summary is not None
    durability = {}
    for channel in summary.channels.values():
        assert channel.message_encoding == "cdr"
        assert summary.schemas[channel.schema_id].encoding == "ros2msg"
        (qos,) = yaml.safe_load(channel.metadata["offered_qos_profiles"])
        durability[channel.topic] = qos["durability"]
        assert qos["deadline"] == {"sec": 9223372036, "nsec": 854775807}
    latched = {topic for topic, kept in durability.items() if kept == 1}
    assert latched == {"/robot_description", "/tf_static"}


def test_the_same_motion_gives_the_same_bytes(panda_motion: Trajectory, tmp_path: Path) -> None:
    for name in ("a.mcap", "b.mcap"):
        panda_motion.to_mcap(tmp_path / name, 5.0)
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()


def test_a_motion_without_torques_has_states_without_efforts(tmp_path: Path) -> None:
    robot = hovi.load_robot(hovi.example("two_link.urdf"))
    motion, _ = cubic_motion(hovi.Scene(robot))
    without = Trajectory(
        motion.grid, motion.path, motion.momenta, motion.scene, torque=StoredTorque.none(7)
    )
    without.to_mcap(tmp_path / "m.mcap", 5.0)
    assert all(not s.effort for _, s in messages(tmp_path / "m.mcap")["/joint_states"])


def test_a_motion_without_its_robot_is_refused(tmp_path: Path) -> None:
    robot = hovi.load_robot(hovi.load_robot(hovi.example("two_link.urdf")).model)
    cubic_motion(hovi.Scene(robot))[0].save(tmp_path / "m.npz")
    loaded = Trajectory.load(tmp_path / "m.npz")
    with pytest.raises(InputError, match="saved without its robot"):
        loaded.to_mcap(tmp_path / "m.mcap")
    loaded.to_joint_trajectory(tmp_path / "m.json")
    assert not (tmp_path / "m.mcap").exists()


def test_a_bare_model_has_the_transforms_of_its_frames(tmp_path: Path) -> None:
    robot = hovi.load_robot(hovi.load_robot(hovi.example("two_link.urdf")).model)
    cubic_motion(hovi.Scene(robot))[0].to_mcap(tmp_path / "m.mcap", 5.0)
    found = messages(tmp_path / "m.mcap")
    assert "/robot_description" not in found
    assert found["/tf"]
