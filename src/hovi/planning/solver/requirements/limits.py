"""Limits on q, v, a and tau, the jerk and the torque rate, at all times."""

from __future__ import annotations

from typing import Any

import numpy as np

from hovi.discrete.trajectory import Trajectory
from hovi.planning.problem.limit_violation import excess_of, worst_sentence
from hovi.planning.problem.limits import Limits
from hovi.planning.solver.limits.limited_coordinates import LimitedCoordinates
from hovi.planning.solver.outcome.control_polygons import exceeds
from hovi.planning.solver.requirements.limit_margins import limit_margins
from hovi.planning.solver.requirements.requirement import SATISFIED, Requirement
from hovi.robot.space.coordinates import Coordinates
from hovi.system.dataclass import dataclass


@dataclass(frozen=True, eq=False)
class WithinLimits(Requirement):
    """lower <= (q, v, a, tau, jerk, d tau / dt) <= upper, to their own tolerance or SATISFIED."""

    limits: Limits
    coordinates: Coordinates

    def violation(self, motion: Trajectory) -> str:
        """The limit that is exceeded most: polynomials are compared exactly, torques sampled."""
        most = max(SATISFIED, self.limits.tolerance)
        limited = LimitedCoordinates.of(self.limits, motion.grid, motion.space)
        if not exceeds(motion, self.limits, limited, most):
            sampled = excess_of(motion, self.limits, limited.others(self.limits))
            if bool(np.max(sampled) <= most):
                return ""
        return worst_sentence(motion, self.limits, self.coordinates)

    def margins(self, motion: Trajectory) -> dict[str, Any]:
        """Margins of the whole motion and of its segments."""
        limits, segments = limit_margins(motion, self.limits)
        return {"limits": limits, "segments": segments}
