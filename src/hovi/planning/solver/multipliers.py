"""Multipliers and penalties of the equality constraints: an augmented Lagrangian.

For the constraints tau = 0 of passive joints at the quadrature points, with weights w, and the
conditions c = 0, the action is replaced by

    action + sum w (lambda tau + rho tau^2/2) + sum (mu c + rho c^2/2).

It keeps the block structure. For rho large enough constrained minima are minima of it, and its
negative eigenvalues are those of the Hessian on the tangent space of the constraints.
[NocedalWright2006, section 17.3]
"""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from hovi.planning.solver.equations import Equations
from hovi.scene.lagrangian import PointTerms
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Residuals:
    """Residuals of the equality constraints.

    torque: of the passive joints at the quadrature points, (P, passive) per batch, in [N m].
    conditions: c, see `Equations.conditions`. largest_torque: of any joint at any point, in [N m],
        bounded below where torques are rounding errors.
    """

    torque: list[Array]
    conditions: list[Array]
    largest_torque: float

    @property
    def torque_fraction(self) -> float:
        """The largest torque of a passive joint, relative to `largest_torque`."""
        passive = max((float(np.max(np.abs(t), initial=0.0)) for t in self.torque), default=0.0)
        return passive / max(self.largest_torque, 1e-300)

    @property
    def condition_error(self) -> float:
        """The largest component of a condition, in the unit of y, of rates times a step."""
        return max((float(np.max(np.abs(c), initial=0.0)) for c in self.conditions), default=0.0)


@dataclass(frozen=True, eq=False)
class Multipliers:
    """The multipliers lambda and mu, and their penalties.

    torque: lambda of every joint at the quadrature points, (P, nv) per batch, zero where a joint
        is not passive. conditions: mu, see `Equations.conditions`.
    torque_penalty, penalty: rho of torques and of conditions. jet_size: numbers (k+1) nv of the jet
        at a point.
    """

    torque: list[Array]
    conditions: list[Array]
    torque_penalty: float
    penalty: float
    jet_size: int

    @classmethod
    def zero(cls, equations: Equations, torque_penalty: float, penalty: float) -> Multipliers:
        """Zero multipliers of a problem's equations, with given penalties."""
        problem = equations.problem
        lagrangian = problem.ld.lagrangian
        outputs = len(lagrangian.output_weight)
        torque = [np.zeros((len(t), outputs)) for t in problem.ld.point_times]
        conditions = [np.zeros(size) for size in equations.sizes]
        jet_size = (lagrangian.order + 1) * lagrangian.nv
        return cls(torque, conditions, torque_penalty, penalty, jet_size)

    def updated(self, residuals: Residuals, passive: npt.NDArray[np.intp]) -> Multipliers:
        """lambda + rho c, the first-order estimate of the multipliers."""
        torques = zip(self.torque, residuals.torque, strict=True)
        torque = [self.plus_penalty(force, tau, passive) for force, tau in torques]
        return dataclasses.replace(
            self, torque=torque, conditions=self.forces_of_conditions(residuals.conditions)
        )

    def forces_of_conditions(self, c: list[Array]) -> list[Array]:
        """mu + rho c of the conditions."""
        return [mu + self.penalty * each for mu, each in zip(self.conditions, c, strict=True)]

    def plus_penalty(self, force: Array, tau: Array, passive: npt.NDArray[np.intp]) -> Array:
        """A force at points (P, nv) plus rho tau of the passive joints (P, passive)."""
        force = force.copy()
        force[:, passive] += self.torque_penalty * tau
        return force

    @property
    def forces(self) -> list[PointTerms]:
        """The multipliers as terms at the quadrature points."""
        return self.added_to(None)

    def added_to(self, terms: list[PointTerms] | None) -> list[PointTerms]:
        """The terms of limits at the points, plus the multipliers of the torques."""
        if terms is None:
            return [PointTerms.on_outputs(force, self.jet_size) for force in self.torque]
        return [
            dataclasses.replace(term, output_gradient=term.output_gradient + force)
            for term, force in zip(terms, self.torque, strict=True)
        ]

    def with_scaled_penalties(self, torque: float, conditions: float) -> Multipliers:
        """The same multipliers with penalties scaled by the given factors."""
        return dataclasses.replace(
            self,
            torque_penalty=self.torque_penalty * torque,
            penalty=self.penalty * conditions,
        )
