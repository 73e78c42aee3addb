"""MuJoCo models and playback, with MuJoCo itself and its own reader of URDFs as the oracles."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import hovi
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.exchange import mujoco_check
from hovi.exchange.mujoco_model import mjcf, mujoco_scene, mujoco_scenes
from hovi.scene.segment_scenes import SegmentScenes
from samples.cubic_motion import cubic_motion

mujoco: Any = pytest.importorskip("mujoco")

ARMS = {"ur5": [], "panda": ["panda_finger_joint1", "panda_finger_joint2"], "z1": []}


def arm(name: str, *effects: hovi.effects.Effect) -> hovi.Scene:
    robot = hovi.load_robot(name, locked=ARMS[name])
    return hovi.Scene(robot, [hovi.effects.Gravity(), *effects])


def compiled(scene: hovi.Scene) -> Any:
    return mujoco.MjModel.from_xml_string(ElementTree.tostring(mjcf(scene), encoding="unicode"))


def mass_and_bias(model: Any, q: Any, v: Any) -> tuple[Any, Any]:
    """M by unit accelerations in MuJoCo's inverse dynamics, and C v + g."""
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = q, v
    columns = []
    for a in (np.zeros(model.nv), *np.eye(model.nv)):
        data.qacc[:] = a
        mujoco.mj_inverse(model, data)
        columns.append(data.qfrc_inverse.copy())
    return np.array(columns[1:]).T - columns[0][:, None], columns[0]


@pytest.mark.parametrize("name", ["ur5", "z1"])
def test_the_bodies_are_those_that_mujoco_reads_from_the_urdf(name: str) -> None:
    """Without meshes, which MuJoCo would look for, and with all joints."""
    scene = arm(name)
    urdf = str(scene.robot.source.urdf)
    bare = re.sub(r"<(visual|collision)\b.*?</\1>", "", urdf, flags=re.DOTALL)
    theirs = mujoco.MjModel.from_xml_string(bare)
    theirs.dof_damping[:] = theirs.dof_frictionloss[:] = 0.0  # the scene has no friction
    theirs.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT  # nor limits
    ours = compiled(scene)
    random = np.random.default_rng(2)
    for _ in range(5):
        q, v = random.uniform(-2.0, 2.0, (2, scene.robot.nv))
        for got, wanted in zip(mass_and_bias(ours, q, v), mass_and_bias(theirs, q, v), strict=True):
            np.testing.assert_allclose(got, wanted, rtol=0, atol=1e-6 * np.abs(wanted).max())


@pytest.mark.parametrize("rotors", [(), (hovi.effects.Armature(0.1),)], ids=["", "rotors"])
@pytest.mark.parametrize("name", ARMS)
def test_mujoco_follows_the_planned_torques(
    name: str, rotors: tuple[hovi.effects.Effect, ...]
) -> None:
    scene = arm(name, *rotors)
    robot = scene.robot
    start = np.clip(robot.neutral(), robot.lower + 0.1, robot.upper - 0.1)
    goal = np.clip(start + 0.5, robot.lower + 0.1, robot.upper - 0.1)
    motion = hovi.plan(scene, start, goal, 1.5, self_collision=False).trajectory
    played = hovi.replay_in_mujoco(motion)
    assert np.diff(played.times).max() <= 1e-4 * (1 + 1e-12)
    assert played.error.max() < 1e-6
    assert played.success
    assert not played.left_out
    assert repr(played).startswith("MujocoReplay in 15,0")
    assert repr(played).count("\n") == 2


def test_errors_fall_with_the_fourth_power_of_the_step() -> None:
    damping = hovi.effects.ViscousFriction(0.4)
    motion = cubic_motion(arm("ur5", damping), schemes=["galerkin-2"] * 3, duration=0.5)[0]
    errors = [hovi.replay_in_mujoco(motion, step).error.max() for step in (4e-3, 2e-3, 1e-3)]
    slopes = -np.diff(np.log2(errors))
    assert np.all(np.abs(slopes - 4.0) < 0.3), errors


def test_a_wrong_torque_leaves_the_plan() -> None:
    scene = arm("ur5")
    motion = cubic_motion(scene, schemes=["galerkin-2"] * 3, duration=0.5)[0]
    path = dataclasses.replace(motion.path, inner=motion.path.inner + 20.0)
    other = dataclasses.replace(motion, path=path)
    played = hovi.replay_in_mujoco(motion)
    assert played.success
    moved = dataclasses.replace(played, planned=other.configurations(played.times))
    assert not moved.success
    assert not dataclasses.replace(played, q=np.full_like(played.q, np.nan)).success


def test_keyframes_are_the_samples(tmp_path: Path) -> None:
    scene = arm("ur5", hovi.effects.ViscousFriction(0.4), hovi.effects.DryFriction(0.1))
    motion = cubic_motion(scene, schemes=["galerkin-2"] * 3, duration=0.5)[0]
    motion.to_mujoco(tmp_path / "motion.xml", 20.0)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "motion.xml"))
    assert model.nkey == 11
    times = model.key_time
    assert np.diff(times).min() > 0
    q, v, _, _ = motion.sample(times)
    np.testing.assert_allclose(model.key_qpos, q, rtol=0, atol=1e-12)
    np.testing.assert_allclose(model.key_qvel, v, rtol=0, atol=1e-12)
    plain = scene.without("dry_friction").inverse_dynamics(*motion.jet(times))
    np.testing.assert_allclose(model.key_ctrl, plain, rtol=0, atol=1e-11)
    assert "not in this model: dry_friction" in (tmp_path / "motion.xml").read_text()
    names = [model.joint(i).name for i in range(model.njnt)]
    assert tuple(names) == motion.coordinate_names


def test_passive_joints_have_no_motor(models: Path) -> None:
    robot = hovi.load_robot(models / "two_link.urdf")
    scene = hovi.Scene(robot, [hovi.effects.Gravity()], passive=["shoulder"])
    model = compiled(scene)
    assert [model.actuator(i).name for i in range(model.nu)] == ["elbow"]


def test_a_locked_joint_is_part_of_the_body_it_hangs_on() -> None:
    robot = hovi.load_robot("ur5", locked={"elbow_joint": 0.7})
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    q, v = np.random.default_rng(1).uniform(-1.0, 1.0, (2, robot.nv))
    M, bias = mass_and_bias(compiled(scene), q, v)
    zero = np.zeros((1, robot.nv))
    np.testing.assert_allclose(bias, scene.inverse_dynamics([q], [v], zero)[0], atol=1e-9)
    unit = scene.inverse_dynamics([q], [v], [np.eye(robot.nv)[2]])[0]
    np.testing.assert_allclose(M[:, 2] + bias, unit, atol=1e-9)


def test_what_a_model_cannot_hold_is_refused_in_a_sentence(tmp_path: Path) -> None:
    two_link = hovi.load_robot(hovi.example("two_link.urdf"))
    flying = hovi.load_robot(hovi.example("spacecraft_arm.urdf"), free_flyer=True)
    fingers = hovi.load_robot("panda", mimic=True)
    moving = hovi.effects.MovingBase(position=["0.1*sin(t)", "0", "0"])
    for scene, why in (
        (hovi.Scene(fingers), "'panda_finger_joint2' mimics 'panda_finger_joint1'"),
        (hovi.Scene(two_link, [moving]), "the base of this scene moves"),
    ):
        with pytest.raises(InputError, match=why):
            cubic_motion(scene)[0].to_mujoco(tmp_path / "m.xml")
    grid = hovi.Grid.uniform(1.0, 2, hovi.schemes.galerkin(0))
    still = np.tile(flying.neutral(), (3, 1)), np.zeros((3, 9)), np.zeros((2, 2, 9))
    path = hovi.DiscretePath(*still, np.zeros((2, 0, 9)))
    motion = Trajectory(grid, path, np.zeros((3, 2, 9)), hovi.Scene(flying))
    with pytest.raises(InputError, match="'root_joint' is neither a hinge nor a slide"):
        motion.to_mujoco(tmp_path / "m.xml")
    assert not list(tmp_path.iterdir())
    for step in (0.0, -1.0, np.nan, 1e-12):
        with pytest.raises(InputError, match="the step must be positive"):
            hovi.replay_in_mujoco(cubic_motion(hovi.Scene(two_link))[0], step)


def test_segments_are_one_model_only_if_their_bodies_are_the_same(ur5: hovi.Robot) -> None:
    gravity = hovi.effects.Gravity()
    scene = hovi.Scene(ur5, [gravity])
    loaded = hovi.Scene(ur5, [gravity, hovi.effects.Payload(mass=2.0, frame="tool0")])
    motion = cubic_motion(scene, schemes=["galerkin-1"] * 3)[0]
    same = dataclasses.replace(motion, scene=None, segments=SegmentScenes((scene, scene), (1, 2)))
    assert mujoco_scene(same) is scene
    other = dataclasses.replace(same, segments=SegmentScenes((scene, loaded), (1, 2)))
    with pytest.raises(InputError, match="the segments of this motion differ"):
        mujoco_scene(other)


def test_a_grasped_body_moves_with_the_model_of_its_segment(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    motion = hovi.plan_task(hovi.load_task(hovi.example("two_link_pick"))).trajectory
    played = hovi.replay_in_mujoco(motion, step=1e-3)
    assert played.error.max() < 1e-6
    assert played.times[-1] == motion.duration
    assert len(played.times) == len(played.q) == len(played.planned)
    empty_handed = mujoco_scenes(motion)[0][0]
    monkeypatch.setattr(mujoco_check, "mjcf", lambda scene: mjcf(empty_handed))
    assert hovi.replay_in_mujoco(motion, step=1e-3).error.max() > 0.1
