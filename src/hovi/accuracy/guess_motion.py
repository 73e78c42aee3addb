"""The initial guess of all methods of a diagram."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.guess import Curve, cubic, stretched
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError, nearest
from hovi.planning.problem.problem import TrajectoryProblem

Array = npt.NDArray[np.float64]

GUESSES = ("near", "cubic")
RESOLVED_SHARE = 0.9
"""Fraction of the resolved motion in the near guess; the rest is the cubic."""
NEARER_RESOLVED_SHARE = 0.99
"""The same for methods that converge to other minima from the near guess."""


def guess_curve(
    name: str, problem: TrajectoryProblem, resolved: Trajectory, share: float = RESOLVED_SHARE
) -> Curve:
    """The guess as a curve: times -> q, v and a.

    name: "near" (nine tenths of the resolved motion and one tenth of the cubic between its ends,
        so that all methods converge to the same minimum) or "cubic".
    resolved: the motion to be found. share: its fraction in the near guess.
    Raises InputError for an unknown name.
    """
    robot, T = problem.robot, problem.grid.duration
    cubic_curve = cubic(robot, problem.boundary, T)
    if name == "cubic":
        return cubic_curve
    if name != "near":
        raise InputError(f"there is no guess {name!r}: {nearest(name, GUESSES)}")
    motion = stretched(resolved, T)

    def curve(t: Array) -> tuple[Array, Array, Array]:
        (q1, v1, a1), (q0, v0, a0) = motion(t), cubic_curve(t)
        q = robot.integrate(q0, share * robot.difference(q0, q1))
        return q, v0 + share * (v1 - v0), a0 + share * (a1 - a0)

    return curve
