"""The guess that every method of a diagram starts from."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.guess import Curve, cubic, stretched
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError, nearest
from hovi.planning.problem.problem import TrajectoryProblem

Array = npt.NDArray[np.float64]

GUESSES = ("near", "cubic")
NEARNESS = 0.9
"""Share of the resolved motion in the near guess; the rest is the cubic."""
NEARER = 0.99
"""The same for a method that would leave for other minima from the near guess."""


def guess_curve(
    name: str, problem: TrajectoryProblem, resolved: Trajectory, nearness: float = NEARNESS
) -> Curve:
    """q, v and a of a guess at any times.

    name: "near" (nine tenths of the resolved motion and one tenth of the cubic between its ends,
        so that all methods work on the same minimum) or "cubic".
    resolved: the motion that is looked for. nearness: its share of the near guess.
    Raises InputError for an unknown name.
    """
    robot, T = problem.robot, problem.grid.duration
    straight = cubic(robot, problem.boundary, T)
    if name == "cubic":
        return straight
    if name != "near":
        raise InputError(f"there is no guess {name!r}: {nearest(name, GUESSES)}")
    found = stretched(resolved, T)

    def curve(t: Array) -> tuple[Array, Array, Array]:
        (q1, v1, a1), (q0, v0, a0) = found(t), straight(t)
        q = robot.integrate(q0, nearness * robot.difference(q0, q1))
        return q, v0 + nearness * (v1 - v0), a0 + nearness * (a1 - a0)

    return curve
