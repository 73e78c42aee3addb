"""Ready-made Lagrangians on T^(k)Q: splines, mechanics, Riemannian cubics."""

from __future__ import annotations

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments
from hovi.dynamics.symbolic_dynamics import casadi_functions
from hovi.errors import InputError
from hovi.scene.added_inertia import added_inertia
from hovi.scene.casadi_lagrangian import CasadiLagrangian
from hovi.scene.scene import Scene, require_known_joints

Array = npt.NDArray[np.float64]


MAX_DIMENSION, MAX_ORDER = 1_000, 20
"""Of a spline."""


@check_arguments
def spline(n: int, derivatives: int = 2) -> CasadiLagrangian:
    """L = 1/2 |q^(k)|^2 on R^n: cubic splines for k = 2, quintic ones (minimum jerk) for k = 3.

    n: dimension, 1 to 1,000. derivatives: k, 1 to 20. Raises InputError otherwise.
    [ColomboFerraroMartin2016, examples of sections 3 and 4]
    """
    if not (1 <= n <= MAX_DIMENSION and 1 <= derivatives <= MAX_ORDER):
        raise InputError(
            f"a spline needs n >= 1 and k >= 1, at most {MAX_DIMENSION} and {MAX_ORDER}, got "
            f"n = {n}, k = {derivatives}."
        )
    jet = [ca.SX.sym(f"q{j}", n) for j in range(derivatives + 1)]
    return CasadiLagrangian(jet, ca.sumsqr(jet[-1]) / 2)


@check_arguments
def mechanics(scene: Scene) -> CasadiLagrangian:
    """L = 1/2 v^T (M(q) + A(q)) v - V(q) on TQ, in [J]: the robot under gravity, k = 1.

    A: the inertia of effects whose torque has a term A(q) a. Other torques of effects and those of
    a moving base are not included: see `scene_force`.
    Raises ModelError for joints of an unsupported kind, SceneError for effects whose torque
    depends on the acceleration in another way.
    """
    require_known_joints(scene.robot)
    functions = casadi_functions(scene.model)
    q, v = ca.SX.sym("q", scene.robot.nq), ca.SX.sym("v", scene.robot.nv)
    L = functions.kinetic_energy(q, v) - functions.potential_energy(q)
    inertia = added_inertia(scene)
    if inertia is not None:
        A = ca.Function("A", [scene.terms.symbols.q], [inertia])(q)
        L += ca.bilin(A, v, v) / 2
    return CasadiLagrangian([q, v], L, scene.robot.curved_space, scene=scene)


@check_arguments
def riemannian_cubic(scene: Scene) -> CasadiLagrangian:
    """L = 1/2 g(D_t v, D_t v) for the robot's own metric g = M(q), k = 2.

    D_t v = M^-1 (M a + C(q, v) v) is the covariant acceleration, zero along geodesics.
    Only effects that change the mass matrix of the model count.
    Raises ModelError for joints of an unsupported kind.
    [NoakesHeinzingerPaden1989; ColomboFerraroMartin2016, equation of special Lagrangians]
    """
    model = scene.model.copy()
    model.gravity.linear = np.zeros(3)
    functions = casadi_functions(model)
    require_known_joints(scene.robot)
    q, (v, a) = ca.SX.sym("q", scene.robot.nq), (ca.SX.sym(x, scene.robot.nv) for x in "va")
    force = functions.inverse_dynamics(q, v, a)
    covariant = ca.solve(functions.mass_matrix(q), force)
    L = ca.dot(force, covariant) / 2
    return CasadiLagrangian([q, v, a], L, scene.robot.curved_space, scene=scene)
