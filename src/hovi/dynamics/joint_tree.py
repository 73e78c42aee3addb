"""A robot as arrays for the compiled kernel: joints with one axis each, and their bodies.

Every joint rotates about and translates along the z axis of its own frame, so one formula covers
revolute, prismatic and helical joints about any axis. A joint with several coordinates becomes a
chain of joints, of which the last moves its body. A first joint that is a free-flyer, spherical or
planar is the base: its components are the first joints of the tree and have no axis.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi._native import dynamics as native
from hovi.robot.space.groups import SE2, SO2, Group
from hovi.robot.space.joint_kinds import kind_of
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]

_UPPER = np.triu_indices(3)


@dataclass(frozen=True, eq=False)
class JointTree:
    """A tree of n joints, each after its parent; each array has one row per joint.

    nq: length of a configuration.
    gravity: spatial acceleration of free fall, linear and angular, shape (6,), in [m/s^2]; with
        a base, in its frame at the neutral configuration.
    parents: shape (n,); -1 is the world.
    coordinates: index of each joint's coordinate in a configuration, shape (n,).
    continuous: whether that coordinate is (cos, sin) of an angle, shape (n,).
    rotations: of each frame in its parent's at q = 0, shape (n, 3, 3).
    translations: of each frame in its parent's, shape (n, 3), in [m].
    angular: angle about z per unit of q, shape (n,): 1, or 0 for a prismatic joint.
    linear: displacement along z per unit of q, shape (n,), in [m].
    masses: of each joint's body, shape (n,), in [kg]; 0 without a body.
    centers: of mass, in the joint's frame, shape (n, 3), in [m].
    moments: integrals of x x^T dm about the center of mass, xx xy xz yy yz zz, shape (n, 6), in
        [kg m^2].
    armatures: shape (n,), in [kg m^2] or [kg].
    base_twist_indices: of the velocity components of the base in a twist (linear, angular), shape
        (6,) or (3,); (0,) without a base.
    base_coordinate: index of the base's quaternion in a configuration.
    planar_base: whether (cos, sin) is stored there instead of a quaternion.
    """

    nq: int
    gravity: Array
    parents: Index
    coordinates: Index
    continuous: npt.NDArray[np.bool_]
    rotations: Array
    translations: Array
    angular: Array
    linear: Array
    masses: Array
    centers: Array
    moments: Array
    armatures: Array
    base_twist_indices: Index
    base_coordinate: int
    planar_base: bool

    def compiled(self, portable: bool = False) -> native.InverseDynamicsKernel:
        """The kernel of this tree. portable: use the baseline instruction set.

        Raises ValueError for inconsistent arrays.
        """
        return native.InverseDynamicsKernel(**vars(self), portable=portable)


@dataclass(frozen=True, eq=False)
class _Row:
    """One joint of the tree. axis: linear and angular, in Pinocchio's frame of the joint."""

    parent: int
    coordinate: int
    continuous: bool
    axis: Array
    placement: pin.SE3
    body: pin.Inertia | None


def read_joint_tree(model: pin.Model) -> JointTree:
    """The tree of a model whose joints have axes that are fixed in their frames.

    model: the first joint may be a base that all other joints stand on.
    """
    base = _base_of(model)
    rows = _rows(model, base)
    parents = np.array([row.parent for row in rows], dtype=np.int64)
    axes = np.array([row.axis for row in rows]).reshape(-1, 6)
    rotating = np.any(np.abs(axes[:, 3:]) > 1e-12, axis=1)
    frames = frames_along(np.where(rotating[:, None], axes[:, 3:], axes[:, :3]))
    twist_indices = base.se3_indices if base else ()
    frames[: len(twist_indices)] = np.eye(3)
    parent_frames = np.concatenate([frames, np.eye(3)[None]])[parents]
    rotations = np.array([row.placement.rotation for row in rows]).reshape(-1, 3, 3)
    translations = np.array([row.placement.translation for row in rows]).reshape(-1, 3, 1)
    return JointTree(
        nq=model.nq,
        gravity=_gravity(model, base),
        parents=parents,
        coordinates=np.array([row.coordinate for row in rows], dtype=np.int64),
        continuous=np.array([row.continuous for row in rows], dtype=bool),
        rotations=_in_frames(parent_frames, rotations, frames),
        translations=_product(parent_frames.transpose(0, 2, 1), translations)[..., 0],
        angular=np.where(rotating, 1.0, 0.0),
        linear=_dot(frames[:, :, 2], axes[:, :3]),
        **_bodies(rows, frames),
        armatures=np.array(model.armature, dtype=np.float64),
        base_twist_indices=np.array(twist_indices, dtype=np.int64),
        base_coordinate=base.unit[0] if base else 0,
        planar_base=base is SE2,
    )


def _base_of(model: pin.Model) -> Group | None:
    """The group of the base; None without a base."""
    kind = kind_of(model.joints[1]) if model.njoints > 1 else None
    return kind.group if kind and kind.kernel == "as base" else None


def _gravity(model: pin.Model, base: Group | None) -> Array:
    gravity = model.jointPlacements[1].actInv(model.gravity) if base else model.gravity
    return np.array(gravity.vector, dtype=np.float64)


def _rows(model: pin.Model, base: Group | None) -> list[_Row]:
    """The joints of the tree in the order of the velocities."""
    identity = pin.SE3.Identity()
    rows = []
    last = [-1]  # the row of each of Pinocchio's joints that moves its body
    for index in range(1, model.njoints):
        joint = model.joints[index]
        is_base = index == 1 and base is not None
        axes = np.zeros((joint.nv, 6)) if is_base else axes_of(joint)
        parent, placement = last[model.parents[index]], model.jointPlacements[index]
        continuous = kind_of(joint).group is SO2
        for k, axis in enumerate(axes):
            body = model.inertias[index] if k + 1 == len(axes) else None
            coordinate = 0 if is_base else joint.idx_q + k
            rows.append(_Row(parent, coordinate, continuous, axis, placement, body))
            parent, placement = len(rows) - 1, identity
        last.append(parent)
    return rows


def axes_of(joint: pin.JointModel) -> Array:
    """One row (linear, angular) for each coordinate, shape (nv, 6), at any configuration."""
    data = joint.createData()
    joint.calc(data, np.zeros(joint.idx_q + joint.nq))
    return np.asarray(data.S, dtype=np.float64).reshape(6, -1).T


def frames_along(axes: Array) -> Array:
    """Rotations that map z to each axis, shape (n, 3, 3): permutations if that is x, y or z."""
    z = _normalized(axes)
    least = np.argmin(np.abs(z), axis=1)
    x = _normalized(np.eye(3)[least] - z[np.arange(len(z)), least][:, None] * z)
    return np.stack([x, np.cross(z, x), z], axis=2)


def _bodies(rows: list[_Row], frames: Array) -> dict[str, Array]:
    """Masses, centers and moments in the joints' frames."""
    bodies = [pin.Inertia.Zero() if row.body is None else row.body for row in rows]
    inertias = np.array([body.inertia for body in bodies]).reshape(-1, 3, 3)
    levers = np.array([body.lever for body in bodies]).reshape(-1, 3, 1)
    trace = inertias[:, 0, 0] + (inertias[:, 1, 1] + inertias[:, 2, 2])
    second = (0.5 * trace)[:, None, None] * np.eye(3) - inertias
    moments = _in_frames(frames, second, frames)
    return {
        "masses": np.array([body.mass for body in bodies], dtype=np.float64),
        "centers": _product(frames.transpose(0, 2, 1), levers)[..., 0],
        "moments": np.ascontiguousarray(moments[:, *_UPPER]),
    }


def _in_frames(left: Array, A: Array, right: Array) -> Array:
    """left^T A right, shape (n, 3, 3)."""
    half = _product(left.transpose(0, 2, 1), A)
    whole = _product(half, right)
    # In the order of Eigen's sums, so that earlier motions are reproduced to the last bit.
    whole[:, 2] = half[:, 2, :1] * right[:, 0] + (
        half[:, 2, 1:2] * right[:, 1] + half[:, 2, 2:] * right[:, 2]
    )
    return whole


# The order of sums and the fused products of BLAS depend on the processor.
def _product(A: Array, B: Array) -> Array:
    """Products of matrices with inner dimension 3."""
    first, second, third = (A[:, :, k, None] * B[:, k, None, :] for k in range(3))
    return np.asarray(first + second + third)


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2])


def _normalized(axes: Array) -> Array:
    size = np.sqrt(_dot(axes, axes))[:, None]
    return np.divide(axes, size, out=np.zeros_like(axes), where=size > 0.0)
