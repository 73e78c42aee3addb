"""State shared by the stages of a solve under limits: problem, bounds, budgets and multipliers."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.optimize.banded_model import BandModel
from hovi.optimize.barrier import Barrier
from hovi.optimize.interior_point import BoundedOutcome, Outputs, minimize_bounded
from hovi.optimize.merge_tree import MergeTreeModel
from hovi.optimize.trust_region import Iteration, Options, Stop
from hovi.planning.clearance.clearance import DISTANCE_SCALE
from hovi.planning.clearance.clearance_violation import approach_along, approach_sentence
from hovi.planning.problem.contradictions import static_sentence
from hovi.planning.problem.limit_violation import excess_along, worst_sentence
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.augmented_lagrangian_rounds import minimize_constrained
from hovi.planning.solver.bounded_action import BoundedAction
from hovi.planning.solver.clearance_outputs import EXTRA_CLEARANCE, ClearanceOutputs
from hovi.planning.solver.methods.method import Report
from hovi.planning.solver.multipliers import Multipliers
from hovi.scene.lagrangian import PointTerms
from hovi.system.deadline import Deadline, raise_if_late

Array = npt.NDArray[np.float64]
Bounded = BoundedOutcome[DiscretePath]

STOPPED = Stop.TIME_LIMIT, Stop.INTERRUPTED
"""Reasons that end the whole search."""
WARM_MU_RANGE = 1e-7, 1e-4
"""Range of the initial barrier parameter of a warm start, relative to the mean density."""


@dataclass(eq=False)
class BoundedSearch:
    """The current problem of a search, and the resources used so far.

    problem: on the current grid; its intervals are halved where limits do not hold.
    guess: the initial guess, on the problem's grid.
    iterations: steps of all solves.
    margins: share of its range by which each bound is tightened in each interval, shape
        (2, N, kinds nv + pairs). clearance: bounded distances, or None.
    tightened: the margins before the last tightening and the excess then, if there was one on this
        grid.
    multipliers, unmet: of the constraints, and why they cannot be met, or "".
    last: the problem and the motion of the last solve.
    """

    problem: TrajectoryProblem
    limits: Limits
    options: Options
    report: Report | None
    guess: DiscretePath
    iterations: int = 0
    multipliers: Multipliers | None = None
    unmet: str = ""

    def __post_init__(self) -> None:
        self.deadline = Deadline(self.options.time_limit)
        self.last = self.problem, self.guess
        self.history: list[Iteration] = []
        distances = self.problem.distances
        self.clearance: ClearanceOutputs | None = None
        if distances is not None:
            self.clearance = ClearanceOutputs(
                distances, self.least_distance + EXTRA_CLEARANCE * DISTANCE_SCALE
            )
        self.margins = self.no_margins()
        self.tightened: tuple[Array, Array] | None = None

    @property
    def least_distance(self) -> float:
        """Margin plus tolerance, in [m]: violated by up to the tolerance, it keeps the margin."""
        assert self.problem.clearance is not None
        return float(self.problem.clearance.margin) + self.limits.tolerance * DISTANCE_SCALE

    def no_margins(self) -> Array:
        """Zero margins, shape (2, N, kinds nv + pairs)."""
        pairs = 0 if self.clearance is None else self.clearance.size
        return np.zeros((2, self.problem.grid.intervals, self.limits.lower.size + pairs))

    def objective(self, known: Multipliers | None) -> BoundedAction:
        """The action with the tightened bounds. known: multipliers of the constraints."""
        return BoundedAction(
            self.problem, self.limits, self.margins, multipliers=known, more=self.clearance
        )

    def remaining_options(self) -> Options:
        """The options with the remaining time as time limit."""
        return dataclasses.replace(self.options, time_limit=self.deadline.seconds_left)

    def solve(self, path: DiscretePath, start: Barrier | None = None) -> Bounded:
        """Solve with bounds at the quadrature points, in rounds if there are constraints."""
        if not self.problem.constrained:
            return self._minimized(self.objective(None), path, self.remaining_options(), start)

        def minimize_round(known: Multipliers, x: DiscretePath, decrease: float) -> Bounded:
            nonlocal start
            objective, options = self.objective(known), self.remaining_options()
            options = dataclasses.replace(options, decrease=max(decrease, options.decrease))
            outcome = self._minimized(objective, x, options, start)
            mu = WARM_MU_RANGE[1] * mean_density(outcome.outputs, objective)
            start = outcome.barrier.warm(objective.bounds, outcome.outputs.y, mu)
            return outcome

        rounds = minimize_constrained(self.problem, path, minimize_round, self.multipliers)
        self.multipliers, self.unmet = rounds.multipliers, rounds.reason
        return rounds.result

    def _minimized(
        self, objective: BoundedAction, path: DiscretePath, options: Options, start: Barrier | None
    ) -> Bounded:
        raise_if_late()  # the outputs at the guess alone may take seconds
        outcome = minimize_bounded(objective, path, options, self.report, start)
        self.iterations += outcome.iterations
        self.history += outcome.history
        self.last = self.problem, outcome.x
        return outcome

    def forces(self, outcome: Bounded) -> list[PointTerms]:
        """Multipliers of limits and constraints, penalty terms of the constraints included."""
        known = self.multipliers
        if known is not None:
            action = self.objective(known).action
            known = known.updated(action.residuals(outcome.x), self.problem.passive)
        return self.objective(known).forces(outcome.x, outcome.barrier.multipliers)

    def negative_eigenvalues(self, outcome: Bounded) -> int:
        """n_neg of the condensed system, which is positive definite at a minimum."""
        if outcome.stop is not Stop.STATIONARY or outcome.model is None:
            return -1
        if outcome.model.factor(0.0) is not None:
            return 0
        mergeable = self.problem.plain and self.problem.ld.k == 2
        if not mergeable and isinstance(outcome.model, BandModel):
            return outcome.model.negative_eigenvalues()
        objective = BoundedAction(
            self.problem, self.limits, self.margins, "tree", more=self.clearance
        )
        barrier: Barrier = outcome.barrier
        model = objective.model(outcome.x, barrier.sigma, barrier.gradient, barrier.multipliers)
        return model.negative_eigenvalues() if isinstance(model, MergeTreeModel) else -1

    def excess(self, path: DiscretePath) -> Array:
        """Excess over lower and upper bounds in every interval, shape (2, N, kinds nv + pairs)."""
        trajectory = self.problem.trajectory(path)
        excess = excess_along(trajectory, self.limits)
        sides = np.stack([excess.lower, excess.upper]).reshape(2, len(excess.lower), -1)
        if self.clearance is None:
            return sides
        least = self.least_distance
        approach = approach_along(trajectory, self.clearance.distances, least)
        short = (least - approach.distance) / DISTANCE_SCALE
        return np.concatenate([sides, np.stack([short, np.full_like(short, -np.inf)])], axis=2)

    def worst(self, path: DiscretePath) -> str:
        """The limit or distance that is violated most: joint or pair, and time."""
        trajectory = self.problem.trajectory(path)
        if self.clearance is not None:
            sides, first = self.excess(path), self.limits.lower.size
            if sides[:, :, first:].max() >= sides[:, :, :first].max():
                distances, least = self.clearance.distances, self.least_distance
                approach = approach_along(trajectory, distances, least)
                margin = least - self.limits.tolerance * DISTANCE_SCALE
                return approach_sentence(trajectory, distances, approach, margin)
        sentence = worst_sentence(trajectory, self.limits, self.problem.coordinates)
        return sentence + static_sentence(self.problem, self.limits)


def mean_density(outputs: Outputs, objective: BoundedAction) -> float:
    """|objective| / sum of all weights: its mean density."""
    return max(abs(outputs.value), 1e-12) / float(np.sum(objective.bounds.weights))
