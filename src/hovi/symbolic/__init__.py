"""CasADi functions for people who write their own: dynamics, torques, costs, discrete Lagrangians.

    body = hovi.symbolic.rigid_body(scene)             # RNEA, M, bias, energies, frames, momenta
    f = hovi.symbolic.torques(scene)                   # (q, v, a, t) -> tau with every effect
    L = hovi.symbolic.lagrangian(scene)                # (q, v, a, t) -> L~
    Ld = hovi.symbolic.discrete_lagrangian(lagrangian, scheme, h)
    F = hovi.symbolic.euler_lagrange(lagrangian, scheme, h)

All are `casadi.Function`s that take CasADi's SX, MX and DM and can be differentiated further. A
cost written with them comes back as a `hovi.CasadiLagrangian`.
"""

from hovi.symbolic.discrete_functions import discrete_lagrangian, euler_lagrange
from hovi.symbolic.rigid_body import RigidBody, rigid_body
from hovi.symbolic.scene_functions import lagrangian, torques

__all__ = [
    "RigidBody",
    "discrete_lagrangian",
    "euler_lagrange",
    "lagrangian",
    "rigid_body",
    "torques",
]
