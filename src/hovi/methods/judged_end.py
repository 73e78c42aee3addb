"""Programs minimised by a method of a user, whose ends are judged apart from it.

What a method returns is a minimum only where the conditions of Karush, Kuhn and Tucker hold.
"""

from __future__ import annotations

import dataclasses
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from hovi.errors import InputError
from hovi.methods.method import Method, Report
from hovi.optimize.barrier import Barrier
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import (
    FEASIBILITY_TOLERANCE,
    LEAST_VALUE,
    Ended,
    Iteration,
    Outputs,
    Reason,
)
from hovi.optimize.program import Program
from hovi.optimize.start import Start
from hovi.system.deadline import Deadline

Array = npt.NDArray[np.float64]
X = TypeVar("X")

REMAINING = 1e-8
"""Largest decrease of the Lagrangian that a Newton step predicts at a minimum, and largest sum of
the products of forces and gaps, relative to the objective."""
MAX_REFINEMENTS = 40
"""Maximum number of times that outputs are replaced by others, and the program is solved again."""


def minimized_by(
    method: Method,
    program: Program[X],
    start: Start[X, Barrier],
    criteria: Criteria,
    report: Report | None = None,
) -> Ended[X, Barrier]:
    """A minimum by a method, again from there as long as the program's outputs become finer."""
    x, z = start.x, None if start.z is None else start.z.multipliers
    steps: list[Iteration] = []
    with Deadline(criteria.time_limit).in_force():
        for _ in range(MAX_REFINEMENTS):
            left = dataclasses.replace(
                criteria, max_iterations=max(criteria.max_iterations - len(steps), 0)
            )
            ended = method.minimize(program, Start(x, z), left, report)
            _require_forces(method, ended, len(program.bounds.lower))
            steps += ended.steps
            found = judged_end(program, ended, criteria)
            if found.why is not Reason.STATIONARY:
                break
            density = found.outputs.density(program.bounds.measure)
            refined = program.refine(found.x, criteria.barrier, np.abs(ended.z) / density)
            if refined is None:
                break
            more = np.where(refined.origin < 0, 0.0, ended.z[refined.origin])
            x, z = found.x, np.append(ended.z[refined.kept], more)
    found.steps = steps
    return found


def _require_forces(method: Method, ended: Ended[X, Array], outputs: int) -> None:
    """Raise InputError unless a method returned finite forces of all outputs."""
    shape = np.shape(ended.z) if isinstance(ended, Ended) else None
    if shape != (outputs,) or not np.isfinite(ended.z).all():
        raise InputError(
            f"{type(method).__name__}.minimize has to return an Ended with finite forces z of "
            f"shape ({outputs},), one for each output, got {shape or ended!r:.60}; see Method."
        )


def judged_end(
    program: Program[X], ended: Ended[X, Array], criteria: Criteria
) -> Ended[X, Barrier]:
    """What a method returned, with slacks and multipliers, as STATIONARY only where it is.

    Its outputs are computed again. Bounds and equations hold to their tolerances, forces act at
    bounds that are reached and away from them, and next to nothing remains to be gained by a Newton
    step of the Lagrangian in which these bounds are stiff, and whose matrix is positive definite.
    Else a claim of STATIONARY becomes ITERATION_LIMIT.
    """
    outputs, z = program.outputs(ended.x), ended.z
    density = outputs.density(program.bounds.measure)
    mu = criteria.barrier * density
    barrier = Barrier.of_forces(program.bounds, outputs.y, z, mu, density)
    found = Ended(ended.x, outputs, barrier, ended.why, ended.steps)
    if ended.why is not Reason.STATIONARY:
        return found
    found.why = Reason.ITERATION_LIMIT
    if not np.isfinite(outputs.value):
        found.why = Reason.DIVERGED
    elif _keeps_bounds(program, outputs, z) and program.satisfies_equations(ended.x):
        model = program.model(ended.x, z**2 / mu, z, z)
        factor = model.factor(0.0)
        if factor is not None and -0.5 * model.descend(factor)[1] <= REMAINING * _scale(outputs):
            found.why, found.model, found.convex = Reason.STATIONARY, model, True
    return found


def _keeps_bounds(program: Program[X], outputs: Outputs, z: Array) -> bool:
    """Whether outputs keep their bounds, and forces act at bounds that are reached alone."""
    bounds, y = program.bounds, outputs.y
    held = z != 0.0
    gap = np.where(z > 0.0, bounds.upper - y, y - bounds.lower)[held]
    products = float(bounds.weights[held] @ np.abs(z[held] * gap))
    kept = bounds.excess(y).max(initial=0.0) <= FEASIBILITY_TOLERANCE
    return bool(kept and products <= REMAINING * _scale(outputs))


def _scale(outputs: Outputs) -> float:
    """Magnitude of the objective; positive."""
    return max(abs(outputs.value), LEAST_VALUE)
