"""Whether a cost bounds the acceleration of every joint: L~ has to be regular in a."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.errors import SceneError
from hovi.robot.robot import Robot
from hovi.scene.effort_lagrangian import EffortLagrangian

Array = npt.NDArray[np.float64]

POINTS = 6
"""Random points at which the curvature is examined, half of them at rest."""
SINGULAR = 1e-12
"""Singular value of the scaled curvature that counts as zero."""


def require_regular(
    lagrangian: EffortLagrangian, robot: Robot, active: npt.NDArray[np.bool_]
) -> None:
    """Raise SceneError where L~ is singular in a, its highest derivative.

    The curvature of L~ along the torques of the active joints is W = R + C_tautau + C_taua X +
    (C_taua X)^T + X^T (V_aa + C_aa) X with X = M^-1, and has to be invertible
    [ColomboFerraroMartin2016, section 2]. In the rounding of d2 L~/da2 = M W M a weight of zero
    might be lost, so that W is computed from its parts.
    Where torques have no cost, W = V_aa + C_aa, which needs no inertia.

    lagrangian: of the robot. active: whether each coordinate has a motor, shape (nv,).
    """
    jet, t = _points(robot)
    W = _curvature(lagrangian, jet, t)[:, active][:, :, active]
    if not np.isfinite(W).all():
        return  # such costs are reported where they occur, with the time
    size = np.sqrt(np.abs(np.diagonal(W, axis1=1, axis2=2)))
    size[size == 0] = 1.0
    _, values, directions = np.linalg.svd(W / size[:, None] / size[:, :, None])
    singular = values[:, -1] <= SINGULAR
    if not singular.any():
        return
    names = np.array(robot.coordinate_names)[active]
    name = str(names[np.abs(directions[singular.argmax(), -1]).argmax()])
    state = "" if singular[POINTS // 2 :].any() else "at rest "
    raise SceneError(
        f"the cost is singular in its highest derivative: {state}the acceleration of joint "
        f"{name!r} has no weight, neither directly nor by its torque; give this joint a weight in "
        "effort_weight (it may be small), or a cost on its acceleration or jerk."
    )


def _points(robot: Robot) -> tuple[tuple[Array, Array, Array], Array]:
    """Random (q, v, a) and t, the first half of them at rest."""
    random = np.random.default_rng(1)
    dq, v, a = random.normal(size=(3, POINTS, robot.nv))
    v[: POINTS // 2] = 0.0
    q = robot.integrate(np.tile(robot.neutral(), (POINTS, 1)), dq)
    return (q, v, a), random.uniform(0.0, 1.0, POINTS)


def _curvature(lagrangian: EffortLagrangian, jet: tuple[Array, Array, Array], t: Array) -> Array:
    """W, shape (P, nv, nv)."""
    n = lagrangian.nv
    W = np.tile(np.diag(lagrangian.weight), (len(t), 1, 1))
    tau, J = lagrangian.torque(*jet, t)
    X: Array = np.tile(np.eye(n), (len(t), 1, 1))
    if lagrangian.needs_torques:
        try:
            X = np.asarray(np.linalg.inv(J[:, :, 2 * n :]))
        except np.linalg.LinAlgError:
            return np.full_like(W, np.nan)
    direct = np.zeros((len(t), n, n))
    if lagrangian.potential is not None:
        direct += lagrangian.potential.expand(*jet, t=t)[2][:, 2 * n :, 2 * n :]
    if lagrangian.running_cost is not None:
        C_tautau, C_taua, C_aa = lagrangian.running_cost.curvature(*jet, tau=tau, t=t)
        mixed = C_taua @ X
        W += C_tautau + mixed + mixed.transpose(0, 2, 1)
        direct += C_aa
    result: Array = W + X.transpose(0, 2, 1) @ direct @ X
    return result
