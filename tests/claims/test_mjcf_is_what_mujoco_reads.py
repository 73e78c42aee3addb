"""An MJCF has the masses, axes, ranges and frames that MuJoCo reads, in MuJoCo's coordinates."""

from __future__ import annotations

from pathlib import Path
from random import Random

import numpy as np
import pinocchio as pin
import pytest

import hovi
from samples.mesh_files import CUBE, CUBE_FACES, stl_binary
from samples.mjcf_family import mjcf

mujoco = pytest.importorskip("mujoco")
GRAVITY = 9.81


def both(text: str, folder: Path) -> tuple[hovi.Robot, object]:
    """The robot, and MuJoCo's model of the same file."""
    (folder / "cube.stl").write_bytes(stl_binary(CUBE, CUBE_FACES))
    path = folder / "made.xml"
    path.write_text(text)
    return hovi.load_robot(path), mujoco.MjModel.from_xml_path(str(path))


def transferred(robot: hovi.Robot, peer, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """MuJoCo's configuration, and the matrix of its velocities by those of Pinocchio."""
    theirs, matrix = np.array(q), np.eye(robot.nv)
    for joint in list(robot.model.joints)[1:]:
        at = joint.idx_q
        if joint.nq == 7:
            turn = pin.Quaternion(*q[[at + 6, at + 3, at + 4, at + 5]]).matrix()
            matrix[joint.idx_v : joint.idx_v + 3, joint.idx_v : joint.idx_v + 3] = turn
        if joint.nq in (4, 7):
            end = at + joint.nq
            theirs[end - 4 : end] = q[[end - 1, end - 4, end - 3, end - 2]]
    return theirs, matrix


def assert_same(robot: hovi.Robot, peer, random: np.random.Generator) -> None:
    """Mass matrix, gravity and poses at random configurations; ranges, losses and efforts."""
    model = robot.model
    assert (model.nq, model.nv) == (peer.nq, peer.nv)
    state, data = mujoco.MjData(peer), model.createData()
    for _ in range(3):
        q = pin.integrate(model, pin.neutral(model), random.uniform(-1.5, 1.5, model.nv))
        theirs, matrix = transferred(robot, peer, q)
        state.qpos[:], state.qvel[:] = theirs, 0.0
        mujoco.mj_forward(peer, state)
        dense = np.zeros((peer.nv, peer.nv))
        mujoco.mj_fullM(peer, state, dense)
        own = pin.crba(model, data, q)
        own = np.triu(own) + np.triu(own, 1).T
        scale = np.abs(own).max()
        np.testing.assert_allclose(own, matrix.T @ dense @ matrix, atol=1e-9 * scale)
        weight = pin.computeGeneralizedGravity(model, data, q)
        np.testing.assert_allclose(
            weight, matrix.T @ state.qfrc_bias, atol=1e-8 * max(np.abs(weight).max(), 1.0)
        )
        _assert_same_poses(robot, peer, state, q)
    for k in range(peer.njnt):
        name = mujoco.mj_id2name(peer, mujoco.mjtObj.mjOBJ_JOINT, k)
        joint = model.joints[model.getJointId(name)]
        assert joint.idx_v == peer.jnt_dofadr[k]
        if joint.nq == 1:
            own = robot.lower[joint.idx_q], robot.upper[joint.idx_q]
            wanted = peer.jnt_range[k] if peer.jnt_limited[k] else (-np.inf, np.inf)
            np.testing.assert_allclose(own, wanted, rtol=1e-12)
            effort = peer.jnt_actfrcrange[k][1] if peer.jnt_actfrclimited[k] else np.inf
            assert robot.effort_limit[joint.idx_v] == effort
    np.testing.assert_allclose(robot.armature, peer.dof_armature)
    np.testing.assert_allclose(robot.friction, peer.dof_frictionloss)
    damping = peer.dof_damping if peer.dof_damping.ndim == 1 else peer.dof_damping[:, 0]
    np.testing.assert_allclose(robot.damping, damping)


def _assert_same_poses(robot: hovi.Robot, peer, state, q: np.ndarray) -> None:
    kinds = (
        (mujoco.mjtObj.mjOBJ_BODY, peer.nbody, state.xpos, state.xmat),
        (mujoco.mjtObj.mjOBJ_SITE, peer.nsite, state.site_xpos, state.site_xmat),
    )
    for kind, count, places, turns in kinds:
        for k in range(kind == mujoco.mjtObj.mjOBJ_BODY, count):
            pose = robot.frame_pose(mujoco.mj_id2name(peer, kind, k), q)
            np.testing.assert_allclose(pose[:3, 3], places[k], atol=1e-9)
            np.testing.assert_allclose(pose[:3, :3], turns[k].reshape(3, 3), atol=1e-9)


@pytest.mark.parametrize("seed", range(60))
def test_a_random_robot_is_the_one_that_mujoco_reads(seed: int, tmp_path: Path) -> None:
    robot, peer = both(mjcf(Random(f"mjcf {seed}"), meshes=seed % 3 == 0), tmp_path)
    assert_same(robot, peer, np.random.default_rng(seed))


@pytest.mark.long
@pytest.mark.parametrize("seed", range(60, 1_000))
def test_more_random_robots(seed: int, tmp_path: Path) -> None:
    robot, peer = both(mjcf(Random(f"mjcf {seed}"), meshes=seed % 3 == 0), tmp_path)
    assert_same(robot, peer, np.random.default_rng(seed))
