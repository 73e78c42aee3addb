"""The rate of change of a configuration, q' = G(q) v, for every kind of joint.

It is d/ds of q (+) s v at s = 0, with Pinocchio's `integrate`.
"""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca
import pinocchio as pin

from hovi.errors import SceneError
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.robot.space.groups import SE2, SE3, SO2, SO3
from hovi.robot.space.joint_kinds import kind_of


def configuration_rate(model: pin.Model, q: ca.SX, v: ca.SX) -> ca.SX:
    """q' as an expression of q (nq,) and v (nv,), shape (nq,).

    Raises SceneError for a joint of an unsupported kind.
    """
    rates = []
    for name, joint in list(zip(model.names, model.joints, strict=True))[1:]:
        here = q[joint.idx_q : joint.idx_q + joint.nq]
        rate = v[joint.idx_v : joint.idx_v + joint.nv]
        rates.append(_rate(str(name), joint, here, rate))
    return ca.vertcat(*rates)


def rate_on(space: ConfigurationSpace, q: ca.SX, v: ca.SX) -> ca.SX:
    """The same on a product of vector spaces and groups."""
    rate = ca.SX(space.nq, 1)
    rows, columns = space.plain
    if len(rows):
        rate[rows.tolist()] = v[columns.tolist()]
    for factor in space.factors:
        rate[factor.q] = _RATES[factor.group.name](q[factor.q], v[factor.v])
    return rate


def bracket_on(space: ConfigurationSpace, x: ca.SX, y: ca.SX) -> ca.SX:
    """The Lie bracket [x, y] of left-invariant tangent vectors, columns of nv."""
    result = ca.SX(space.nv, 1)
    for factor in space.curved:
        indices = list(factor.group.se3_indices)
        a, b, c = ca.SX(6, 1), ca.SX(6, 1), ca.SX(6, 1)
        a[indices], b[indices] = x[factor.v], y[factor.v]
        c[:3] = ca.cross(a[3:], b[:3]) + ca.cross(a[:3], b[3:])
        c[3:] = ca.cross(a[3:], b[3:])
        result[factor.v] = c[indices]
    return result


def _rate(name: str, joint: pin.JointModel, q: ca.SX, v: ca.SX) -> ca.SX:
    if joint.nq == joint.nv:
        return v
    kind = kind_of(joint)
    if kind.group is None:
        raise SceneError(
            f"joint {name!r} is of a kind ({kind.label}) that effects on frames do not support."
        )
    return _RATES[kind.group.name](q, v)


def _angle_rate(q: ca.SX, v: ca.SX) -> ca.SX:
    """The rate of (cos, sin)."""
    return ca.vertcat(-q[1], q[0]) * v


def _plane_rate(q: ca.SX, v: ca.SX) -> ca.SX:
    """The rate of (x, y, cos, sin)."""
    moved = ca.vertcat(q[2] * v[0] - q[3] * v[1], q[3] * v[0] + q[2] * v[1])
    return ca.vertcat(moved, -q[3] * v[2], q[2] * v[2])


def _pose_rate(q: ca.SX, v: ca.SX) -> ca.SX:
    """The rate of (position, quaternion)."""
    return ca.vertcat(_rotated(q[3:], v[:3]), _quaternion_rate(q[3:], v[3:]))


def _quaternion_rate(q: ca.SX, spin: ca.SX) -> ca.SX:
    """1/2 q * (spin, 0) for q = (x, y, z, w) and an angular velocity in the body frame."""
    vector = q[3] * spin + ca.cross(q[:3], spin)
    return ca.vertcat(vector, -ca.dot(q[:3], spin)) / 2


def _rotated(q: ca.SX, x: ca.SX) -> ca.SX:
    """x rotated from the body frame to its parent frame by the unit quaternion (x, y, z, w)."""
    twice = 2 * ca.cross(q[:3], x)
    return x + q[3] * twice + ca.cross(q[:3], twice)


_RATES: dict[str, Callable[[ca.SX, ca.SX], ca.SX]] = {
    SO2.name: _angle_rate,
    SE2.name: _plane_rate,
    SO3.name: _quaternion_rate,
    SE3.name: _pose_rate,
}
