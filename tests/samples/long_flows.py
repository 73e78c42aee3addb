"""Flows over many steps with known errors: conservation laws and rounding."""

from __future__ import annotations

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.flows.legendre_transforms import legendre
from hovi.flows.scheme_lagrangian import SchemeLagrangian
from hovi.flows.stepper import Flow, flow
from hovi.flows.symmetry import base_rotation
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.scene.scene import Scene
from hovi.scene.standard_lagrangians import mechanics, spline
from hovi.schemes import by_name, galerkin

Array = npt.NDArray[np.float64]

JET = np.array([[0.4, -0.3], [0.6, -0.8], [0.5, 0.2], [-0.4, 0.6]])  # q, v, a, jerk


def cubic(t: float, x0: Array, p0: Array) -> tuple[Array, Array]:
    """a = p~, p~' = -p: (q, v) and (p, p~) at t, exactly."""
    (q, v), (p, pt) = x0, p0
    end = [q + v * t + pt * t**2 / 2 - p * t**3 / 6, v + pt * t - p * t**2 / 2]
    return np.array(end), np.array([p, pt - p * t])


def spline_error(steps: int, h: float) -> float:
    x0, p0 = np.array([[0.3, -0.2], [0.7, 0.4]]), np.array([[1.1, -0.6], [0.5, 0.9]])
    motion = flow(SchemeLagrangian(spline(2), galerkin(0), h), x0, p0, steps, force=True)
    x, p = cubic(steps * h, x0, p0)
    return float(max(np.abs(motion.x[-1] - x).max(), np.abs(motion.p[-1] - p).max()))


def quartic() -> CasadiLagrangian:
    """(d^2 + 1)(d^2 + 4) q + q^3 = 0: two oscillators in a quartic potential, bounded near rest."""
    q, v, a = (ca.SX.sym(c, 1) for c in "qva")
    return CasadiLagrangian(
        [q, v, a], (ca.sumsqr(a) - 5 * ca.sumsqr(v) + 4 * ca.sumsqr(q)) / 2 + q**4 / 4
    )


def quarters(error: Array) -> tuple[float, float]:
    """The largest error of the first and of the last quarter."""
    parts = np.array_split(np.abs(error), 4)
    return float(parts[0].max()), float(parts[-1].max())


def quartic_energy(name: str, steps: int) -> tuple[float, float]:
    x, p = legendre(quartic(), [0.3], [0.1], [0.0], [0.05])
    motion = flow(SchemeLagrangian(quartic(), by_name(name), 0.05), x, p, steps, force=True)
    return quarters(motion.energy - motion.energy[0])


def arm_energy(scene: Scene, r: int, steps: int) -> tuple[float, float]:
    """Mechanics of the arm, released from horizontal, h = 0.02."""
    L = mechanics(scene)
    x, p = legendre(L, np.zeros(2), np.zeros(2))
    motion = flow(SchemeLagrangian(L, galerkin(r, 1), 0.02), x, p, steps, force=True)
    return quarters(motion.energy - motion.energy[0])


def noether_errors(scene: Scene, N: int) -> tuple[float, float, float]:
    """Range of J along the flow, and errors of D_1, D_2 and D_3, D_4 as momenta of the flow."""
    L = scene.effort_lagrangian()
    x, p = legendre(L, *JET)
    ld = SchemeLagrangian(L, galerkin(2), 1.0 / N)
    motion = flow(ld, x, p, N, symmetries={"turn": base_rotation(scene, [0, 1, 0])}, force=True)
    J = motion.momentum_maps["turn"]
    minus, plus = motion.reevaluated_momenta
    size = np.abs(motion.p).max()
    return (
        float(np.ptp(J) / np.abs(J).max()),
        float(np.abs(minus - motion.p[:-1]).max() / size),
        float(np.abs(plus - motion.p[1:]).max() / size),
    )


def costless(scene: Scene, steps: int, v0: list[float]) -> Flow:
    """A motion without torques under the flow of the effort, h = 0.02."""
    L = scene.effort_lagrangian()
    n = L.nv
    x = np.array([np.full(n, 0.4), v0])
    return flow(SchemeLagrangian(L, galerkin(0), 0.02), x, np.zeros((2, n)), steps, force=True)
