"""Derivatives of CasADi expressions in (q, v, a) along q (+) d, for q on a manifold.

q (+) d is expanded to second order in d, so first and second derivatives at d = 0 are exact.
"""

from __future__ import annotations

import casadi as ca

from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.robot.space.groups import SE2, SE3, SO2, Group

Symbols = tuple[ca.SX, ca.SX, ca.SX, ca.SX]
"""(q, v, a, t)."""


def jacobian(expression: ca.SX, symbols: Symbols, space: ConfigurationSpace | None) -> ca.SX:
    """d expression / d(q, v, a) in the tangent space, 3 nv columns.

    space: the configuration space; None if it is a vector space.
    """
    q, v, a, _ = symbols
    if space is None:
        return ca.jacobian(expression, ca.vertcat(q, v, a))
    d = ca.SX.sym("d", space.nv)
    varied = ca.substitute(expression, q, moved(space, q, d))
    return _at_zero(ca.jacobian(varied, ca.vertcat(d, v, a)), d)


def hessian(
    expression: ca.SX, symbols: Symbols, space: ConfigurationSpace | None
) -> tuple[ca.SX, ca.SX]:
    """The Hessian (3 nv, 3 nv) and the gradient of a scalar, in the tangent space."""
    q, v, a, _ = symbols
    if space is None:
        H, g = ca.hessian(expression, ca.vertcat(q, v, a))
        return H, g
    d = ca.SX.sym("d", space.nv)
    varied = ca.substitute(expression, q, moved(space, q, d))
    H, g = ca.hessian(varied, ca.vertcat(d, v, a))
    return _at_zero(H, d), _at_zero(g, d)


def moved(space: ConfigurationSpace, q: ca.SX, d: ca.SX) -> ca.SX:
    """q (+) d to second order in d, a column of nq."""
    result = ca.SX(q)
    rows, columns = space.plain
    if len(rows):
        result[rows.tolist()] = q[rows.tolist()] + d[columns.tolist()]
    for factor in space.factors:
        result[factor.q] = _moved(factor.group, q[factor.q], d[factor.v])
    return result


def _moved(group: Group, g: ca.SX, d: ca.SX) -> ca.SX:
    if group is SO2:
        return _rotated_angle(g, d)
    if group is SE2:
        across = ca.vertcat(-d[1], d[0])
        local = d[:2] + 0.5 * d[2] * across
        p = ca.vertcat(g[2] * local[0] - g[3] * local[1], g[3] * local[0] + g[2] * local[1])
        return ca.vertcat(g[:2] + p, _rotated_angle(g[2:], d[2]))
    if group is SE3:
        local = d[:3] + 0.5 * ca.cross(d[3:], d[:3])
        u, w = g[3:6], g[6]
        t = 2 * ca.cross(u, local)
        return ca.vertcat(g[:3] + local + w * t + ca.cross(u, t), _rotated_quaternion(g[3:], d[3:]))
    return _rotated_quaternion(g, d)


def _rotated_angle(g: ca.SX, angle: ca.SX) -> ca.SX:
    c, s = 1 - 0.5 * angle**2, angle
    return ca.vertcat(g[0] * c - g[1] * s, g[1] * c + g[0] * s)


def _rotated_quaternion(g: ca.SX, w: ca.SX) -> ca.SX:
    """A quaternion times (w / 2, 1 - |w|^2 / 8)."""
    u, s = 0.5 * w, 1 - ca.sumsqr(w) / 8
    vector = g[3] * u + s * g[:3] + ca.cross(g[:3], u)
    return ca.vertcat(vector, g[3] * s - ca.dot(g[:3], u))


def _at_zero(expression: ca.SX, d: ca.SX) -> ca.SX:
    return ca.substitute(expression, d, ca.SX.zeros(d.shape[0]))
