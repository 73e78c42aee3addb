"""The joints that move a frame, as arrays for the compiled inverse kinematics.

Every joint rotates about and translates along the z axis of its own frame, as in a `JointTree`.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi._native import kinematics as native
from hovi.dynamics.joint_tree import axes_of, frames_along
from hovi.robot.model import frame_named
from hovi.robot.space.groups import SO2
from hovi.robot.space.joint_kinds import kind_of
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class KinematicChain:
    """A chain of n joints from the world to a frame; each array has one row per joint.

    velocities: index of each joint in v, shape (n,). coordinates: that of its coordinate in q.
    continuous: whether that coordinate is (cos, sin) of an angle, shape (n,).
    rotations, translations: placement of each frame in the one before, (n, 3, 3) and (n, 3), in
        [m].
    angular, linear: angle about z and displacement along it per unit of q, shape (n,).
    tip: placement of the frame in that of the last joint.
    """

    velocities: Index
    coordinates: Index
    continuous: npt.NDArray[np.bool_]
    rotations: Array
    translations: Array
    angular: Array
    linear: Array
    tip: pin.SE3

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.velocities)

    @property
    def reach(self) -> float:
        """Largest distance of the frame from the first joint, if no joint slides, in [m]."""
        arms = np.linalg.norm(np.vstack([self.translations[1:], self.tip.translation]), axis=1)
        return np.inf if self.linear.any() else float(arms.sum())

    def compiled(self, lower: Array, upper: Array) -> native.InverseKinematicsKernel:
        """The kernel of this chain. lower, upper: bounds of its joints, shape (n,).

        Raises ValueError for a lower bound above the upper one.
        """
        return native.InverseKinematicsKernel(
            self.rotations,
            self.translations,
            self.angular,
            self.linear,
            np.ascontiguousarray(self.tip.rotation),
            np.array(self.tip.translation),
            lower,
            upper,
        )

    def angles(self, q: Array) -> Array:
        """The coordinates of the chain's joints in configurations (..., nq), shape (..., n)."""
        first = q[..., self.coordinates]
        if not self.continuous.any():
            return np.ascontiguousarray(first)
        sines = q[..., self.coordinates + self.continuous]
        return np.where(self.continuous, np.arctan2(sines, first), first)

    def configurations(self, angles: Array, q: Array) -> Array:
        """Configurations with these coordinates (M, n) of the chain, otherwise as q: (M, nq)."""
        full = np.tile(q, (len(angles), 1))
        if not self.continuous.any():
            full[:, self.coordinates] = angles
            return full
        at = self.coordinates[self.continuous]
        full[:, self.coordinates] = angles
        full[:, at], full[:, at + 1] = (f(angles[:, self.continuous]) for f in (np.cos, np.sin))
        return full


def read_kinematic_chain(model: pin.Model, frame: str) -> KinematicChain | None:
    """The chain of a frame; None if one of its joints has no fixed axis, or mimics another."""
    tip = frame_named(model, frame)
    joints = list(model.supports[tip.parentJoint])[1:]
    if not joints or any(kind_of(model.joints[i]).kernel != "anywhere" for i in joints):
        return None
    rows = [
        (model.joints[i], axis, k)
        for i in joints
        for k, axis in enumerate(axes_of(model.joints[i]))
    ]
    placements = [
        model.jointPlacements[i] if k == 0 else pin.SE3.Identity()
        for i in joints
        for k in range(model.joints[i].nv)
    ]
    axes = np.array([axis for _, axis, _ in rows])
    rotating = np.any(np.abs(axes[:, 3:]) > 1e-12, axis=1)
    frames = frames_along(np.where(rotating[:, None], axes[:, 3:], axes[:, :3]))
    before = np.concatenate([np.eye(3)[None], frames[:-1]]).transpose(0, 2, 1)
    last = pin.SE3(frames[-1], np.zeros(3))
    return KinematicChain(
        velocities=np.array([joint.idx_v + k for joint, _, k in rows]),
        coordinates=np.array([joint.idx_q + k for joint, _, k in rows]),
        continuous=np.array([kind_of(joint).group is SO2 for joint, _, _ in rows]),
        rotations=np.ascontiguousarray(
            before @ np.array([p.rotation for p in placements]) @ frames
        ),
        translations=np.ascontiguousarray(
            (before @ np.array([p.translation for p in placements])[:, :, None])[..., 0]
        ),
        angular=np.where(rotating, 1.0, 0.0),
        linear=np.sum(frames[:, :, 2] * axes[:, :3], axis=1),
        tip=last.inverse() * tip.placement,
    )
