"""What stays to be said of a motion that was found: see hovi.discrete.output.caution."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Iterable, Iterator
from typing import ParamSpec

import numpy as np

from hovi.conditions.joint_quantity import QUANTITIES
from hovi.discrete.output.caution import (
    COARSE,
    LIMITS,
    SPINS,
    WARNED,
    Caution,
    with_cautions,
)
from hovi.errors import HoviError, recorded_warnings
from hovi.planning.problem.limit_conditions import closeness
from hovi.planning.problem.limits import KINDS, urdf_limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.refinement.faults.on_curve import (
    RESOLVED,
    costs_on_curve,
    has_own_curve,
)
from hovi.planning.refinement.spinning import spin_without_limits
from hovi.planning.solver.solver import Solution
from hovi.system.deadline import OutOfTimeError

Keywords = ParamSpec("Keywords")


def keeping_warnings(planned: Callable[Keywords, Solution]) -> Callable[Keywords, Solution]:
    """A decorator of functions that plan: what they warn of stays with the motion."""

    @functools.wraps(planned)
    def keeping(*args: Keywords.args, **kwargs: Keywords.kwargs) -> Solution:
        with recorded_warnings() as sentences:
            solution = planned(*args, **kwargs)
        return _with(solution, [Caution(WARNED, each) for each in sentences])

    return keeping


def with_cautions_of_motion(solution: Solution, others: Iterable[Caution]) -> Solution:
    """The solution with what its motion shows, and the others, in the metadata of its motion."""
    return _with(solution, [*others, *_shown_by(solution)])


def _with(solution: Solution, cautions: Iterable[Caution]) -> Solution:
    motion = solution.trajectory
    metadata = with_cautions(motion.metadata, cautions)
    if metadata == motion.metadata:
        return solution
    return dataclasses.replace(solution, trajectory=dataclasses.replace(motion, metadata=metadata))


def _shown_by(solution: Solution) -> Iterator[Caution]:
    """Cautions of a success: others violate or miss more than these say."""
    problem = solution.problem
    if problem is None or not solution.success:
        return
    try:
        yield from _of_grid(solution, problem)
        yield from _of_speed(solution)
        yield from _of_limits(solution, problem)
    except (HoviError, OutOfTimeError):  # what cannot be sampled shows nothing
        return


def _of_grid(solution: Solution, problem: TrajectoryProblem) -> Iterator[Caution]:
    """The cost along the curve, if it differs by more than RESOLVED from that at the points.

    With Galerkin tables it does not, as the motion were no success.
    """
    if has_own_curve(problem):
        return
    action, integral = costs_on_curve(solution, problem)
    gap = abs(integral - action)
    if gap <= RESOLVED * max(abs(integral), problem.negligible_cost):
        return
    more = "more" if integral > action else "less"
    yield Caution(
        COARSE,
        f"The motion's curve costs {100 * gap / abs(action):.2g} % {more} than the points of its "
        f"grid, {integral:.6g} instead of {action:.6g}: plan to a tolerance, or use more "
        "intervals.",
    )


def _of_speed(solution: Solution) -> Iterator[Caution]:
    """The light joint that spins without a limit, if one does."""
    spinning = spin_without_limits(solution)
    if spinning is not None:
        yield Caution(
            SPINS,
            f"Joint {spinning.joint!r} spins at up to {spinning.speed:.3g} rad/s with an inertia "
            f"of {spinning.inertia:.2g} kg m^2: set limits, or add the effect armature or "
            "acceleration_cost to the scene.",
        )


def _of_limits(solution: Solution, problem: TrajectoryProblem) -> Iterator[Caution]:
    """The limits of the URDF that a motion without limits exceeds, a joint of each kind."""
    if problem.has_limits or not problem.about_robot:
        return
    limits = urdf_limits(problem.robot)
    most = -closeness(solution.trajectory, limits)
    found = []
    for kind, row in zip(KINDS, most, strict=False):
        joint, more = int(np.argmax(row)), int((row > limits.tolerance).sum()) - 1
        if more >= 0:
            others = f" and {more} more" if more else ""
            name = problem.coordinates.coordinate_names[joint]
            found.append(f"the {QUANTITIES[kind]} of joint {name!r}{others}")
    if found:
        yield Caution(
            LIMITS,
            "Planned without limits, the motion is beyond those of the URDF on "
            f"{', '.join(found)}.",
        )
