"""Multipliers of the equality constraints, and what these miss.

For the constraints tau = 0 of passive joints at the quadrature points, with weights w, and the
conditions c = 0, the Lagrangian is action + sum w lambda tau + sum mu c, which keeps the block
structure.
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
    """The multipliers lambda and mu.

    torque: lambda of every joint at the quadrature points, (P, nv) per batch, zero where a joint
        is not passive. conditions: mu, see `Equations.conditions`.
    scale: of conditions next to torques, see `Equations`. jet_size: numbers (k+1) nv of the jet at
        a point.
    """

    torque: list[Array]
    conditions: list[Array]
    scale: float
    jet_size: int

    @classmethod
    def zero(cls, equations: Equations) -> Multipliers:
        """Zero multipliers of a problem's equations."""
        problem = equations.problem
        lagrangian = problem.ld.lagrangian
        outputs = len(lagrangian.output_weight)
        torque = [np.zeros((len(t), outputs)) for t in problem.ld.point_times]
        conditions = [np.zeros(size) for size in equations.sizes]
        jet_size = (lagrangian.order + 1) * lagrangian.nv
        return cls(torque, conditions, equations.scale, jet_size)

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
