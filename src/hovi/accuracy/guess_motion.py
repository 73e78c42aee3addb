"""The initial guess of all methods of a diagram."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.guess import Curve, named_curve, stretched, with_turns
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError, nearest
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]

GUESSES = ("near", "cubic")
RESOLVED_FRACTION = 0.9
"""Fraction of the resolved motion in the near guess; the rest is the cubic."""
MAX_DISTANCE = 0.3
"""Largest distance of the near guess from the resolved motion, in [rad] or [m]."""
SAMPLES = 4001
"""Times at which the distance is measured, and turns are counted."""
NEARER_RESOLVED_FRACTION = 0.99
"""The same for methods that converge to other minima from the near guess."""


def guess_curve(
    name: str, problem: TrajectoryProblem, resolved: Trajectory, fraction: float = RESOLVED_FRACTION
) -> Curve:
    """The guess as a curve: times -> q, v and a, and the jerk for order 3.

    name: "near" (nine tenths of the resolved motion and one tenth of the cubic between its ends, at
        most MAX_DISTANCE away, so that all methods converge to the same minimum) or "cubic", which
        is a quintic for order 3.
    resolved: the motion to be found. fraction: how much of it is in the near guess.
    Raises InputError for an unknown name.
    """
    robot, T = problem.robot, problem.grid.duration
    k = problem.ld.k
    plain = named_curve("cubic", robot, problem.ends, T)
    if name == "cubic":
        return with_turns(plain, robot, T, problem.turns) if problem.turns.any() else plain
    if name != "near":
        raise InputError(f"there is no guess {name!r}: {nearest(name, GUESSES)}")
    motion = stretched(resolved, T, k)
    turns = _Apart(robot, plain, motion, T).turns
    base = with_turns(plain, robot, T, turns) if turns.any() else plain
    apart = _Apart(robot, base, motion, T)
    fraction = max(fraction, 1 - MAX_DISTANCE / max(apart.largest, MAX_DISTANCE))

    def curve(t: Array) -> tuple[Array, ...]:
        (q, *rates), (_, *others) = base(t), motion(t)
        moved = robot.integrate(q, fraction * apart(t))
        return moved, *(x + fraction * (y - x) for x, y in zip(rates, others, strict=True))

    return curve


class _Apart:
    """The difference of two curves, continuous at half turns of continuous joints.

    base, motion: the curves. duration: T, in [s].
    """

    def __init__(self, robot: Robot, base: Curve, motion: Curve, duration: float) -> None:
        self._robot, self._base, self._motion = robot, base, motion
        self._columns = [i for factor in robot.space.angles for i in _indices(factor.v)]
        self._t = np.linspace(0.0, duration, SAMPLES)
        self._sampled = self._modulo(self._t)
        self._sampled[:, self._columns] = np.unwrap(self._sampled[:, self._columns], axis=0)

    @property
    def largest(self) -> float:
        """The largest difference of a joint, in [rad] or [m]."""
        return float(np.abs(self._sampled).max())

    @property
    def turns(self) -> Array:
        """Full turns of each coordinate by which the motion is ahead at its end, shape (nv,)."""
        turns = np.zeros(self._robot.nv)
        turns[self._columns] = np.round(self._sampled[-1, self._columns] / (2 * np.pi))
        return turns

    def __call__(self, t: Array) -> Array:
        """The difference at times (M,), shape (M, nv)."""
        x = self._modulo(t)
        for i in self._columns:
            known = np.interp(t, self._t, self._sampled[:, i])
            x[:, i] += 2 * np.pi * np.round((known - x[:, i]) / (2 * np.pi))
        return x

    def _modulo(self, t: Array) -> Array:
        return np.array(self._robot.difference(self._base(t)[0], self._motion(t)[0]))


def _indices(part: slice) -> range:
    return range(part.start, part.stop)
