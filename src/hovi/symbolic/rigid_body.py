"""The rigid-body dynamics of a scene's robot as CasADi functions, from Pinocchio's own expressions.

Pinocchio gives RNEA, M, g, the energies and the placements of frames; the rest is derived from them
by CasADi.
"""

from __future__ import annotations

from functools import cached_property

import casadi as ca
import pinocchio as pin

from hovi.checks.arguments import check_arguments
from hovi.dynamics.symbolic_dynamics import RigidBodyFunctions, casadi_functions
from hovi.errors import InputError, nearest
from hovi.robot.space import tangent
from hovi.scene.scene import Scene, require_known_joints
from hovi.system.dataclass import dataclass


@check_arguments
@dataclass(frozen=True, eq=False)
class RigidBody:
    """Functions of q (nq,), v, a and tau (nv,), in SI units, each built on first use.

    Gravity and armature are those of the scene: zero without these effects. Its other effects are
    in `hovi.symbolic.torques`. Derivatives in q are in the tangent space: along q (+) d.

    scene: with the robot.
    """

    scene: Scene

    @property
    def inverse_dynamics(self) -> ca.Function:
        """tau = M(q) a + b(q, v), by RNEA: (q, v, a) -> (nv,). [Featherstone2008, sec. 5.3]"""
        return self._functions.inverse_dynamics

    @property
    def mass_matrix(self) -> ca.Function:
        """q -> M (nv, nv), symmetric."""
        return self._functions.mass_matrix

    @cached_property
    def bias(self) -> ca.Function:
        """b = C(q, v) v + g(q): (q, v) -> (nv,)."""
        q, v, _ = self._symbols
        b = self.inverse_dynamics(q, v, ca.SX.zeros(self.scene.robot.nv))
        return ca.Function("bias", [q, v], [b], ["q", "v"], ["b"])

    @property
    def generalized_gravity(self) -> ca.Function:
        """g = dV/dq: q -> (nv,)."""
        return self._functions.generalized_gravity

    @property
    def kinetic_energy(self) -> ca.Function:
        """K = 1/2 v^T M(q) v: (q, v) -> K, in [J]."""
        return self._functions.kinetic_energy

    @property
    def potential_energy(self) -> ca.Function:
        """V = -sum m g^T c(q): q -> V, in [J]."""
        return self._functions.potential_energy

    @cached_property
    def forward_dynamics(self) -> ca.Function:
        """a = M(q)^-1 (tau - b(q, v)), by a solve with M: (q, v, tau) -> (nv,)."""
        q, v, tau = self._symbols
        a = ca.solve(self.mass_matrix(q), tau - self.bias(q, v))
        return ca.Function("forward_dynamics", [q, v, tau], [a], ["q", "v", "tau"], ["a"])

    def frame_placement(self, frame: str) -> ca.Function:
        """q -> R (3, 3), p (3,) in [m]: rotation and origin of a frame in the world.

        Raises InputError for an unknown frame.
        """
        if frame not in self.scene.robot.frame_names:
            raise InputError(
                f"robot {self.scene.robot.name!r} has no frame {frame!r}: "
                f"{nearest(frame, self.scene.robot.frame_names)}"
            )
        return self._functions.frame_placement(frame)

    def frame_jacobian(self, frame: str) -> ca.Function:
        """q -> J (6, nv) with (dp/dt, omega) = J v, in the axes of the world.

        Pinocchio's LOCAL_WORLD_ALIGNED: the velocity of the frame's origin, and its angular
        velocity. Raises InputError for an unknown frame.
        """
        q = self._symbols[0]
        R, p = self.frame_placement(frame)(q)
        J = ca.vertcat(self._slope(p), *self._rotation_slope(R))
        return ca.Function("frame_jacobian", [q], [J], ["q"], ["J"])

    @cached_property
    def center_of_mass(self) -> ca.Function:
        """q -> c (3,), in [m]."""
        q = self._symbols[0]
        moments, mass = ca.SX.zeros(3), 0.0
        for frame, inertia in self._bodies:
            R, p = self.frame_placement(frame)(q)
            moments += inertia.mass * (p + R @ ca.DM(inertia.lever))
            mass += inertia.mass
        return ca.Function("center_of_mass", [q], [moments / mass], ["q"], ["c"])

    @cached_property
    def centroidal_momentum(self) -> ca.Function:
        """(q, v) -> (P, L) (6,): linear, and angular about the center of mass, in the world.

        P = sum m c_i', L = sum (c_i - c) x m c_i' + R_i I_i R_i^T omega_i. Rotors add nothing.
        """
        q, v, _ = self._symbols
        center, linear, angular = self.center_of_mass(q), ca.SX.zeros(3), ca.SX.zeros(3)
        for frame, inertia in self._bodies:
            R, p = self.frame_placement(frame)(q)
            at = p + R @ ca.DM(inertia.lever)
            omega = ca.vertcat(*self._rotation_slope(R)) @ v
            momentum = inertia.mass * (self._slope(at) @ v)
            linear += momentum
            angular += ca.cross(at - center, momentum)
            angular += R @ (ca.DM(inertia.inertia) @ (R.T @ omega))
        h = ca.vertcat(linear, angular)
        return ca.Function("centroidal_momentum", [q, v], [h], ["q", "v"], ["h"])

    @property
    def _bodies(self) -> list[tuple[str, pin.Inertia]]:
        """The name and inertia of every moving joint's body."""
        model = self.scene.model
        pairs = zip(model.names, model.inertias, strict=True)
        return [(str(name), inertia) for name, inertia in list(pairs)[1:] if inertia.mass > 0]

    def _slope(self, x: ca.SX) -> ca.SX:
        """dx/dq of a column x(q) in the tangent space, (len(x), nv)."""
        q, v, a = self._symbols
        space = self.scene.robot.curved_space
        return tangent.jacobian(x, (q, v, a, ca.SX.sym("t")), space)[:, : self.scene.robot.nv]

    def _rotation_slope(self, R: ca.SX) -> list[ca.SX]:
        """Rows of the matrix from v to omega, with R' = omega^ R."""
        rate = self._slope(ca.vec(R))  # columns of R, one after the other
        pairs = (2, 1), (0, 2), (1, 0)  # of omega^ = R' R^T
        return [R[j, :] @ rate[[i, i + 3, i + 6], :] for i, j in pairs]

    @cached_property
    def _symbols(self) -> tuple[ca.SX, ca.SX, ca.SX]:
        robot = self.scene.robot
        return ca.SX.sym("q", robot.nq), ca.SX.sym("v", robot.nv), ca.SX.sym("a", robot.nv)

    @cached_property
    def _functions(self) -> RigidBodyFunctions:
        return casadi_functions(self.scene.model)


@check_arguments
def rigid_body(scene: Scene) -> RigidBody:
    """The rigid-body dynamics of a scene's robot: see RigidBody.

    Raises ModelError for joints of an unsupported kind.
    """
    require_known_joints(scene.robot)
    return RigidBody(scene)
