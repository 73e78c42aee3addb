"""How configurations change at a velocity: q' = G(q) v for every kind of joint.

The expression that belongs to Pinocchio's `integrate`: d/ds of q (+) s v at s = 0.
"""

from __future__ import annotations

import casadi as ca
import pinocchio as pin

from hovi.errors import SceneError


def configuration_rate(model: pin.Model, q: ca.SX, v: ca.SX) -> ca.SX:
    """q' as an expression of q (nq,) and v (nv,), shape (nq,).

    Raises SceneError for a joint of a kind that has no formula here.
    """
    rates = []
    for name, joint in list(zip(model.names, model.joints, strict=True))[1:]:
        here = q[joint.idx_q : joint.idx_q + joint.nq]
        rate = v[joint.idx_v : joint.idx_v + joint.nv]
        rates.append(_rate(str(name), joint.shortname(), here, rate))
    return ca.vertcat(*rates)


def _rate(name: str, kind: str, q: ca.SX, v: ca.SX) -> ca.SX:
    if q.shape == v.shape:
        return v
    if kind.startswith(("JointModelRUB", "JointModelRevoluteUnbounded")):
        return ca.vertcat(-q[1], q[0]) * v  # (cos, sin)
    if kind == "JointModelPlanar":
        moved = ca.vertcat(q[2] * v[0] - q[3] * v[1], q[3] * v[0] + q[2] * v[1])
        return ca.vertcat(moved, -q[3] * v[2], q[2] * v[2])
    if kind == "JointModelSpherical":
        return _quaternion_rate(q, v)
    if kind == "JointModelFreeFlyer":
        moved = _rotated(q[3:], v[:3])
        return ca.vertcat(moved, _quaternion_rate(q[3:], v[3:]))
    raise SceneError(f"joint {name!r} is of a kind ({kind}) whose frames no effect can follow.")


def _quaternion_rate(q: ca.SX, spin: ca.SX) -> ca.SX:
    """1/2 q * (spin, 0) for q = (x, y, z, w) and a spin in the body's axes."""
    vector = q[3] * spin + ca.cross(q[:3], spin)
    return ca.vertcat(vector, -ca.dot(q[:3], spin)) / 2


def _rotated(q: ca.SX, x: ca.SX) -> ca.SX:
    """x from the body's axes into its parent's, by the unit quaternion (x, y, z, w)."""
    twice = 2 * ca.cross(q[:3], x)
    return x + q[3] * twice + ca.cross(q[:3], twice)
