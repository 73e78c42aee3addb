"""The C++ kernel of ordinary joints, on robots with continuous joints and bases that move freely.

The kernel serves a twin of the robot: continuous joints become revolute ones of the same angle,
and a base on SE(3), SO(3) or SE(2) becomes three sliding and three turning joints that stand at
zero. That is exact, not an expansion: where the base is enters RNEA only through gravity, which
acts as an acceleration of the base against it, and at zero the twin's rates y' are the base's
twist (u, w) itself, while

    y'' = (u' + w x u - R^T g, w' - (w_y w_z, -w_x w_z, w_x w_y))

gives it the base's own acceleration (u', w') against gravity g, seen in its own axes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.configuration_space import ConfigurationSpace, configuration_space
from hovi.errors import ModelError
from hovi.lie_groups import conjugate, rotated
from hovi.rigid_body import InverseDynamicsKernel, joints_without_kernel

Array = npt.NDArray[np.float64]

_BASES = {
    "JointModelFreeFlyer": (0, 1, 2, 3, 4, 5),
    "JointModelSpherical": (3, 4, 5),
    "JointModelPlanar": (0, 1, 5),
}
"""Where the base's velocity stands in the twist of its body."""
_CONTINUOUS = ("JointModelRUB", "JointModelRevoluteUnbounded")
_FREE = (
    pin.JointModelPX,
    pin.JointModelPY,
    pin.JointModelPZ,
    pin.JointModelRX,
    pin.JointModelRY,
    pin.JointModelRZ,
)


def joints_without_twin(model: pin.Model) -> tuple[str, ...]:
    """Names of the joints for which the kernel has no twin."""
    based = _base_of(model) is not None
    missing = []
    for name in joints_without_kernel(model):
        index = model.getJointId(name)
        kind = model.joints[index].shortname()
        mimics = index in set(model.mimicking_joints)
        if mimics or not (kind.startswith(_CONTINUOUS) or (based and index == 1)):
            missing.append(name)
    return tuple(missing)


def _base_of(model: pin.Model) -> tuple[int, ...] | None:
    """Where the velocity of a base on a group stands in its twist; None where there is none."""
    if model.njoints < 2 or model.joints[1].shortname() not in _BASES:
        return None
    lonely = list(model.parents)[1:].count(0) == 1
    base = model.joints[1]
    if not lonely or np.any(np.array(model.armature)[base.idx_v : base.idx_v + base.nv]):
        return None
    return _BASES[base.shortname()]


def twin_model(model: pin.Model) -> pin.Model:
    """The twin: ordinary joints alone, in the same order; without gravity where a base moves."""
    twin = pin.Model()
    places = {0: 0}
    based = _base_of(model) is not None
    armature: list[float] = []
    for index in range(1, model.njoints):
        joint = model.joints[index]
        parent, placement = places[model.parents[index]], model.jointPlacements[index]
        name = str(model.names[index])
        if based and index == 1:
            for i, kind in enumerate(_FREE):
                parent = twin.addJoint(parent, kind(), placement, f"{name}[{i}]")
                placement = pin.SE3.Identity()
            armature += [0.0] * len(_FREE)
            places[index] = parent
        else:
            places[index] = twin.addJoint(parent, _ordinary(joint), placement, name)
            armature += list(np.array(model.armature)[joint.idx_v : joint.idx_v + joint.nv])
        twin.appendBodyToJoint(places[index], model.inertias[index], pin.SE3.Identity())
    twin.armature = np.array(armature)
    twin.gravity.linear = np.zeros(3) if based else np.array(model.gravity.linear)
    twin.gravity.angular = np.zeros(3)
    return twin


def _ordinary(joint: pin.JointModel) -> pin.JointModel:
    """The joint itself, a revolute one about the same axis for a continuous one."""
    if not joint.shortname().startswith(_CONTINUOUS):
        return joint
    data = joint.createData()
    q = np.zeros(joint.idx_q + joint.nq)
    q[joint.idx_q] = 1.0
    joint.calc(data, q)
    return pin.JointModelRevoluteUnaligned(np.array(data.S).reshape(6)[3:])


@dataclass(frozen=True, eq=False)
class _Base:
    """A base on a group: where it is, and how its acceleration enters the twin's.

    places: of its velocity in its twist. turn: of the joint's frame in the world, (3, 3).
    gravity: in the world, (3,).
    """

    places: tuple[int, ...]
    turn: Array
    gravity: Array

    def lift(self, q: Array) -> Array:
        """-R^T g at configurations of the base, shape (P, 3)."""
        g = np.broadcast_to(-self.turn.T @ self.gravity, (len(q), 3))
        if self.places == _BASES["JointModelPlanar"]:
            c, s = q[:, 2], q[:, 3]
            return np.stack([c * g[:, 0] + s * g[:, 1], c * g[:, 1] - s * g[:, 0], g[:, 2]], axis=1)
        return rotated(conjugate(q[:, -4:]), g)


class TwinKernel:
    """As InverseDynamicsKernel, for robots with nq != nv; derivatives are in the tangent space.

    model: gravity and armature included. Raises ModelError where a joint has no twin.
    """

    def __init__(self, model: pin.Model) -> None:
        missing = joints_without_twin(model)
        if missing:
            raise ModelError(
                f"the kernel has no twin of {', '.join(map(repr, missing))}; use "
                "hovi.rigid_body.casadi_functions."
            )
        places = _base_of(model)
        self.space: ConfigurationSpace = configuration_space(model)[0]
        self.kernel = InverseDynamicsKernel(twin_model(model))
        self.base: _Base | None = None
        if places is not None:
            turn = np.array(model.jointPlacements[1].rotation)
            self.base = _Base(places, turn, np.array(model.gravity.linear))
        extra = 0 if places is None else 6 - len(places)
        inner = np.arange(len(places or ()), self.space.nv) + extra
        self._v = np.concatenate([np.array(places or (), dtype=np.intp), inner])

    def torque(self, q: Array, v: Array, a: Array, threads: int = 1) -> Array:
        """tau at P points, shape (P, nv): q (P, nq), v and a (P, nv)."""
        if self.base is None:
            return self.kernel.torque(self._angles(q), v, a, threads)
        return self.kernel.torque(*self._twin(q, v, a), threads)[:, self._v]

    def linearize(self, q: Array, v: Array, a: Array, threads: int = 1) -> tuple[Array, Array]:
        """tau and d tau / d(q, v, a), shape (P, nv, 3 nv)."""
        if self.base is None:
            return self.kernel.linearize(self._angles(q), v, a, threads)
        y, dy, ddy = self._twin(q, v, a)
        tau, J = self.kernel.linearize(y, dy, ddy, threads)
        return tau[:, self._v], self._pulled(J, q, dy)[:, self._v]

    def expand(
        self,
        q: Array,
        v: Array,
        a: Array,
        weight: Array,
        curvature: Array | None = None,
        threads: int = 1,
    ) -> tuple[Array, Array, Array]:
        """tau, J and J^T diag(weight) J + sum_i curvature_i d2 tau_i, shape (P, 3 nv, 3 nv)."""
        if self.base is None:
            return self.kernel.expand(self._angles(q), v, a, weight, curvature, threads)
        y, dy, ddy = self._twin(q, v, a)
        bending = None if curvature is None else self._full(curvature, len(q))
        tau, J, H = self.kernel.expand(y, dy, ddy, self._full(weight, len(q)), bending, threads)
        half = self._pulled(H, q, dy).transpose(0, 2, 1)
        H = np.ascontiguousarray(self._pulled(half, q, dy))
        if bending is not None:
            by_ddy = J[:, :, 2 * y.shape[1] :][:, :, :6]
            force = np.matmul(bending[:, None], by_ddy)[:, 0]
            self._add_bend(H, force, self.base.lift(q[:, : self._base_width]))
        return tau[:, self._v], self._pulled(J, q, dy)[:, self._v], H

    @property
    def _base_width(self) -> int:
        return int(self.space.factors[0].q.stop)

    def _full(self, x: Array, points: int) -> Array:
        """Numbers per joint coordinate as those of the twin."""
        full = np.zeros((points, self.kernel.n))
        full[:, self._v] = x
        return full

    def _angles(self, q: Array) -> Array:
        """Configurations with an angle for every (cos, sin), and nothing for a base, (P, nv)."""
        iq, iv = self.space.plain
        y = np.zeros((len(q), self.space.nv))
        y[:, iv] = q[:, iq]
        for factor in self.space.angles:
            i = factor.q.start
            y[:, factor.v.start] = np.arctan2(q[:, i + 1], q[:, i])
        return y

    def _twin(self, q: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """(y, y', y'') of the twin, shape (P, n) each."""
        assert self.base is not None
        y, dy, ddy = (np.zeros((len(q), self.kernel.n)) for _ in range(3))
        y[:, self._v] = self._angles(q)
        dy[:, self._v], ddy[:, self._v] = v, a
        u, w = dy[:, :3], dy[:, 3:6]
        ddy[:, :3] += np.cross(w, u) + self.base.lift(q[:, : self._base_width])
        ddy[:, 3:6] -= np.stack([w[:, 1] * w[:, 2], -w[:, 0] * w[:, 2], w[:, 0] * w[:, 1]], 1)
        return y, dy, ddy

    def _pulled(self, covector: Array, q: Array, dy: Array) -> Array:
        """Derivatives by (y, y', y''), (P, r, 3 n), as those by (q, v, a), (P, r, 3 nv)."""
        assert self.base is not None
        parts = np.moveaxis(covector.reshape(*covector.shape[:2], 3, -1), 2, 0)
        by_y, by_dy, by_ddy = parts[0].copy(), parts[1].copy(), parts[2]
        u, w = dy[:, :3], dy[:, 3:6]
        force = by_ddy[..., :6]
        by_y[..., :6] = 0.0
        by_y[..., 3:6] = force[..., :3] @ _skew(self.base.lift(q[:, : self._base_width]))
        by_dy[..., :3] += force[..., :3] @ _skew(w)
        by_dy[..., 3:6] -= force[..., :3] @ _skew(u)
        by_dy[..., 3:6] += np.matmul(force[..., 3:], _gyration(w))
        return np.concatenate([part[..., self._v] for part in (by_y, by_dy, by_ddy)], axis=-1)

    def _add_bend(self, H: Array, force: Array, lift: Array) -> None:
        """What the bending of y'' adds; force: the weighted torques by it, (P, 6)."""
        assert self.base is not None
        n, k = self.space.nv, len(self.base.places)
        full = np.zeros((len(H), 2, 6, 6))
        f, t = force[:, :3], force[:, 3:]
        # lift(d) = lift - d x lift + d x (d x lift) / 2
        outer = f[:, :, None] * lift[:, None, :]
        dot = np.sum(f * lift, axis=1)[:, None, None]
        full[:, 0, 3:, 3:] = 0.5 * (outer + outer.transpose(0, 2, 1)) - dot * np.eye(3)
        # f . (w x u) and t . (-w_y w_z, w_x w_z, -w_x w_y)
        full[:, 1, :3, 3:] = -_skew(f).transpose(0, 2, 1)
        full[:, 1, 3:, :3] = -_skew(f)
        for i, j, sign in ((0, (1, 2), -1.0), (1, (0, 2), 1.0), (2, (0, 1), -1.0)):
            full[:, 1, 3 + j[0], 3 + j[1]] = full[:, 1, 3 + j[1], 3 + j[0]] = sign * t[:, i]
        places = np.array(self.base.places)
        full = full[:, :, places[:, None], places]
        H[:, :k, :k] += full[:, 0]
        H[:, n : n + k, n : n + k] += full[:, 1]


def _skew(x: Array) -> Array:
    """The matrices of y -> x x y, (P, 3, 3)."""
    S = np.zeros((len(x), 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        S[:, j, i], S[:, i, j] = x[:, k], -x[:, k]
    return S


def _gyration(w: Array) -> Array:
    """d/dw of (-w_y w_z, w_x w_z, -w_x w_y), (P, 3, 3)."""
    D = np.zeros((len(w), 3, 3))
    D[:, 0, 1], D[:, 0, 2] = -w[:, 2], -w[:, 1]
    D[:, 1, 0], D[:, 1, 2] = w[:, 2], w[:, 0]
    D[:, 2, 0], D[:, 2, 1] = -w[:, 1], -w[:, 0]
    return D
