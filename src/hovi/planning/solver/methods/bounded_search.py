"""State shared by the stages of a solve under limits: problem, bounds, budgets and multipliers."""

from __future__ import annotations

import dataclasses
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from hovi.conditions.excess import excess_of, worst
from hovi.conditions.places import AtPoints
from hovi.discrete.grid import DiscretePath
from hovi.discrete.instants import Instants
from hovi.methods.judged_end import minimized_by
from hovi.methods.method import Method
from hovi.optimize.banded_model import BandModel
from hovi.optimize.barrier import INITIAL_MARGIN, Barrier
from hovi.optimize.criteria import Criteria
from hovi.optimize.ended import Ended, Iteration, Reason
from hovi.optimize.equation_model import EquationModel
from hovi.optimize.interior_point import minimize_bounded
from hovi.optimize.merge_tree import MergeTreeModel
from hovi.optimize.nearby_bounded import follow_bounded
from hovi.optimize.start import Start
from hovi.planning.clearance.clearance import DISTANCE_SCALE
from hovi.planning.clearance.clearance_violation import (
    approach_along,
    approach_sentence,
    near_pairs,
)
from hovi.planning.problem.limit_conditions import LimitRange, limit_conditions
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.presolve.end_torques import static_sentence
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective, LinearAlgebra
from hovi.planning.solver.answer import Answer
from hovi.planning.solver.between_points import MarginsBetweenPoints
from hovi.planning.solver.bounded_action import BoundedAction
from hovi.planning.solver.central_path import CentralPath
from hovi.planning.solver.condition_outputs import ConditionOutputs
from hovi.planning.solver.first_multipliers import (
    first_multipliers,
    least_squares_multipliers,
)
from hovi.planning.solver.limits.limit_rows import LimitRows
from hovi.planning.solver.limits.row_forces import by_segment, forces_of, joined
from hovi.planning.solver.methods.method import Guess, Report
from hovi.planning.solver.missed_equations import (
    CONDITION_TOLERANCE,
    TORQUE_TOLERANCE,
    unmet_sentence,
)
from hovi.planning.solver.multipliers import Multipliers
from hovi.planning.solver.near.approaches import EXTRA_CLEARANCE
from hovi.planning.solver.near.clearance_rows import ClearanceRows
from hovi.planning.solver.near.cleared_action import ClearedAction
from hovi.planning.solver.outcome.solution_factor import SolvedBounds
from hovi.scene.lagrangian import PointTerms
from hovi.system.dataclass import dataclass
from hovi.system.deadline import Deadline, raise_if_late

Array = npt.NDArray[np.float64]
Bounded = Ended[DiscretePath, Barrier]
Begun = Start[DiscretePath, Barrier]

FIRST_HALVINGS = 0, 1
"""Number of halvings of intervals for limits on positions, and on their derivatives."""
FINE_HALVINGS = 2, 3
"""Number of halvings of intervals for limits on positions, and on their derivatives, where no
motion within those of FIRST_HALVINGS was found."""
WARM_MU_RANGE = 1e-7, 1e-4
"""Range of the initial barrier parameter of a warm start, relative to the mean density."""
LEVEL_MARGIN = 0.1
"""Distance of slacks from their bounds at a point of a central path, relative to its parameter."""
EXACT_TOLERANCES = TORQUE_TOLERANCE, CONDITION_TOLERANCE
"""Residuals of equations at the end of a solve: see BoundedAction."""
ROUGH_TOLERANCES = np.inf, 1e-4
"""Residuals of equations at the end of a rough solve: see BoundedAction."""
LOOK_AROUND = 0.02
"""Distance beyond the least one up to which pairs near a known motion get rows, in [m]."""


@dataclass(eq=False)
class BoundedSearch:
    """The current problem of a search, and the resources used so far.

    problem: on the current grid; its intervals are halved where limits do not hold.
    start: the initial guess; guess: the same on the problem's grid.
    iterations: steps of all solves.
    margins: by which bounds at the points are tightened.
    multipliers, unmet: of the constraints, and why they cannot be satisfied, or "".
    last: the problem and the motion of the last solve. solved: how it ended, and its objective.
    free: a motion that was found without distances, if there is one.
    points: of the central path, with a larger barrier than that of the last solution. at_level:
        whether a solve begins on one. free_duration: whether the duration is free.
    along, level: central path of a similar problem, if there is one on as many intervals, and the
        barrier parameter at which it is begun: see Start.
    lengths: of the free parts of the problem, in [s]; none where its times are given.
    method: which minimises instead of the interior point; None for that.
    """

    free_duration: ClassVar[bool] = False
    problem: TrajectoryProblem
    limits: Limits
    criteria: Criteria
    report: Report | None
    start: Guess
    iterations: int = 0
    multipliers: Multipliers | None = None
    unmet: str = ""
    at_level: bool = False
    lengths: Array = dataclasses.field(default_factory=lambda: np.zeros(0))
    method: Method | None = None

    def __post_init__(self) -> None:
        self.deadline = Deadline(self.criteria.time_limit)
        self.guess, self.along, self.level = self.start.x, self.start.z, self.start.mu
        self.last = self.problem, self.guess
        self.history: list[Iteration] = []
        self.free: DiscretePath | None = None
        apart = self.problem.distances is None
        self.near: ClearanceRows | None = None if apart else self.no_near_rows()
        self.margins = self.no_margins()
        if self.along is not None and not self.along.fits(self.problem.grid):
            self.along = None  # a round before has halved intervals
        if self.method is not None:
            self.along = None  # which is one of the interior point
        self.along = self.along and self.along.from_ends_of(self.problem)
        known = self.along and self.along.rows
        self.rows = known.copied() if known else self.coarse_rows()
        self.points: list[tuple[float, DiscretePath]] = []
        self.solved: tuple[Bounded, BoundedAction] | None = None

    @property
    def least_distance(self) -> float:
        """Margin plus tolerance, in [m]: violated by up to the tolerance, it keeps the margin."""
        assert self.problem.clearance is not None
        return float(self.problem.clearance.margin) + self.limits.tolerance * DISTANCE_SCALE

    @property
    def bounded_distance(self) -> float:
        """The least distance with the extra clearance where it is bounded, in [m]."""
        return self.least_distance + EXTRA_CLEARANCE * DISTANCE_SCALE

    def no_margins(self) -> MarginsBetweenPoints:
        """Zero margins, (2, N, kinds nv + values of conditions)."""
        more = self.more
        size = self.limits.lower.size + (0 if more is None else more.size)
        shape = 2, self.problem.grid.intervals, size
        return MarginsBetweenPoints(self.excess_of, self.limits.tolerance, shape)

    @property
    def more(self) -> ConditionOutputs | None:
        """What is bounded at the points next to limits: conditions."""
        found = ConditionOutputs(self.problem) if self.problem.bounds else None
        return found if found is not None and found.size > 0 else None

    def coarse_rows(self) -> LimitRows:
        """Limits at all times, by few control points."""
        return self._rows(FIRST_HALVINGS)

    def fine_rows(self) -> LimitRows:
        """Limits at all times, by more control points, which are nearer to the motion."""
        return self._rows(FINE_HALVINGS)

    def _rows(self, halvings: tuple[int, int]) -> LimitRows:
        problem, limits, barrier = self.problem, self.limits, self.criteria.barrier
        ends = problem.free_ends, halvings, barrier, problem.given_between
        return LimitRows(problem.grid, limits, problem.coordinates.curved_space, *ends)

    def no_near_rows(self) -> ClearanceRows:
        """No rows of distances yet."""
        assert self.problem.distances is not None
        return ClearanceRows(self.problem, self.problem.distances, self.bounded_distance)

    def goes_on_from(self, free: Answer) -> None:
        """Count the steps of an answer without distances, and begin at its motion."""
        self.iterations, self.history, self.free = free.nit, list(free.history), free.path

    def look_around(self, path: DiscretePath) -> None:
        """Add rows for pairs that are near along a motion that nearly is a solution."""
        if self.near is not None:
            self.near.extend(self.problem, path, LOOK_AROUND)

    def objective(
        self,
        known: Multipliers | None,
        algebra: LinearAlgebra | None = None,
        tolerances: tuple[float, float] | None = None,
    ) -> BoundedAction:
        """The action with the tightened bounds.

        known: multipliers of the constraints. tolerances: see BoundedAction.
        """
        objective = self._objective(known, algebra)
        objective.tolerances = None if known is None else tolerances
        if not self.rows.fixed:
            self.margins.begin()
            objective.between = self.margins
        return objective

    def _objective(self, known: Multipliers | None, algebra: LinearAlgebra | None) -> BoundedAction:
        more = self.more
        if self.near is not None:
            common = self.problem, self.limits, self.margins.values, algebra, known, more
            cleared = ClearedAction(*common, self.rows, self.near)
            cleared.radii = (BoundedAction if self.at_level else ClearedAction).radii
            return cleared
        return BoundedAction(
            self.problem, self.limits, self.margins.values, algebra, known, more, self.rows
        )

    def central_path(self, ended: Bounded) -> CentralPath:
        """The points at which the barrier of a solve was larger, and its solution."""
        density = ended.outputs.density(self.problem.grid.duration)
        last = ended.z.mu / density
        before = [(level, x) for level, x in self.points if level > last]
        points = (*before, (last, ended.x))
        apart = self.problem.distances is None or (self.near is not None and self.near.size == 0)
        barrier = ended.z if apart else None
        known = None if len(self.problem.passive) > 0 else self.multipliers
        conditions = None if known is None else tuple(known.conditions)
        margins = self.margins.values
        return CentralPath(points, self.rows, barrier, self.near, conditions, margins)

    def solved_bounds(self, ended: Bounded) -> SolvedBounds | None:
        """Where a solve ended, with its objective; None if it was not the last one."""
        if self.solved is None or self.solved[0] is not ended:
            return None
        objective = self.solved[1]
        objective.between = None  # it is solved, and this search is no part of it
        return SolvedBounds(objective, ended.z)

    def _add_points(self, ended: Bounded, objective: BoundedAction) -> None:
        """Add the points at which the barrier of a solve was larger to those of earlier solves.

        These are on the central path of a similar problem only, perhaps between other ends, but the
        next solve may need room.
        """
        density = ended.outputs.density(objective.bounds.measure)
        points = [(product / density, x) for product, x in ended.saved]
        first, like = points[0]
        before = [
            (level, x)
            for level, x in self.points or ([] if self.along is None else self.along.points)
            if level > first and x.inner.shape == like.inner.shape
        ]
        self.points = before + points

    def back_to(self, lengths: Array) -> None:
        """Continue from a motion with these lengths of the free parts."""

    def remaining_criteria(self) -> Criteria:
        """The criteria with the remaining time as time limit."""
        return dataclasses.replace(self.criteria, time_limit=self.deadline.seconds_left)

    def solve(self, start: Begun) -> Bounded:
        """Solve with bounds at the quadrature points; steps satisfy equations to first order."""
        known = self.known_multipliers(start.x)
        objective = self.objective(known, tolerances=EXACT_TOLERANCES)
        ended = self.minimized(objective, start, self.remaining_criteria())
        if known is None:
            return ended
        if ended.why is not Reason.DIVERGED:
            self.multipliers = objective.action.multipliers
        self.unmet = ""
        if ended.why is Reason.STATIONARY:
            self.unmet = self.unsatisfied(ended.x)
        return ended

    def start_at(
        self, path: DiscretePath, level: float, objective: BoundedAction, central: bool = False
    ) -> Begun:
        """A start with slacks at the outputs, and multipliers on the central path.

        level: barrier parameter, relative to the mean density of the objective. central: whether
        the path is near its point of the central path.
        """
        outputs = objective.outputs(path)
        density = outputs.density(objective.bounds.measure)
        scale, margin = None, INITIAL_MARGIN
        if central:
            scale, margin = density, min(INITIAL_MARGIN, LEVEL_MARGIN * level)
        z = Barrier.central(objective.bounds, outputs.y, level * density, scale, margin)
        return Start(path, z)

    def unsatisfied(self, path: DiscretePath) -> str:
        """Which equations a motion does not satisfy, a sentence without its end; "" for none."""
        if not self.problem.constrained:
            return ""
        return unmet_sentence(self.problem, path, ActionObjective(self.problem).residuals(path))

    def known_multipliers(self, path: DiscretePath) -> Multipliers | None:
        """Known multipliers of the constraints, or first ones at a path; None without any."""
        if not self.problem.constrained:
            return None
        first = least_squares_multipliers if self.start.near else first_multipliers
        return self.multipliers or first(self.problem, path)

    def minimized(self, objective: BoundedAction, start: Begun, criteria: Criteria) -> Bounded:
        """One solve of an objective. start: see minimize_bounded."""
        raise_if_late()  # the outputs at the guess alone may take seconds
        if start.z is not None and len(start.z.s) != len(objective.bounds.lower):
            start = Start(start.x)  # rows were added in a solve that failed
        if self.method is None:
            ended = minimize_bounded(objective, start, criteria, self.report)
        else:
            ended = minimized_by(self.method, objective, start, criteria, self.report)
        return self._noted(ended, objective)

    def followed(self, objective: BoundedAction, start: Begun, criteria: Criteria) -> Bounded:
        """A solve of an objective from the solution of a similar problem: see follow_bounded."""
        raise_if_late()
        return self._noted(follow_bounded(objective, start, criteria, self.report), objective)

    def _noted(self, ended: Bounded, objective: BoundedAction) -> Bounded:
        """How a solve ended, after its steps and its motion were noted."""
        self.iterations += len(ended.steps)
        self.history += ended.steps
        self.last, self.solved = (self.problem, ended.x), (ended, objective)
        if ended.why is Reason.STATIONARY and ended.saved:
            self._add_points(ended, objective)
        return ended

    def forces(self, ended: Bounded) -> tuple[Instants | None, list[PointTerms]]:
        """The instants between the points at which limits act, and all multipliers.

        Those of limits and of constraints.
        """
        multipliers = self._objective_of(ended).plain(ended.z.multipliers)
        limits = len(multipliers) - (0 if self.near is None else self.near.size)
        rows = multipliers[limits - self.rows.size : limits]
        instants, further = forces_of(self.problem, self.rows, rows)
        if self.near is not None and self.near.size > 0:
            others, more = self.near.forces(ended.x, multipliers[limits:])
            instants, further = joined(instants, further, others, more)
        further = by_segment(self.problem, instants, further)
        return instants, self._forces_at_points(ended) + further

    def prices(self, ended: Bounded) -> Array:
        """How far every bound moves the cost: see BoundedAction.prices."""
        return self._objective_of(ended).prices(ended.z.multipliers)

    def _forces_at_points(self, ended: Bounded) -> list[PointTerms]:
        """Those of limits at the quadrature points and of constraints."""
        known = self.multipliers
        if known is not None:
            return self.objective(known).forces(ended.x, ended.z.multipliers)
        return self._objective_of(ended).forces(ended.x, ended.z.multipliers)

    def _objective_of(self, ended: Bounded) -> BoundedAction:
        """The objective of a solve without multipliers of constraints."""
        last, objective = self.solved or (None, None)
        if objective is None or last is not ended or self.near is not None:
            return self.objective(None)
        return self.objective(None) if objective.action.multipliers is not None else objective

    def negative_eigenvalues(self, ended: Bounded) -> int:
        """n_neg of the condensed system, which is positive definite at a minimum."""
        if ended.why is not Reason.STATIONARY or ended.model is None:
            return -1
        if ended.model.factor(0.0) is not None:
            return 0
        mergeable = self.problem.plain and self.problem.ld.k == 2
        if not mergeable and isinstance(ended.model, BandModel | EquationModel):
            return ended.model.negative_eigenvalues()
        objective = self.objective(None, "tree")
        model = objective.model(ended.x, *ended.z.condensed(ended.outputs.y))
        return model.negative_eigenvalues() if isinstance(model, MergeTreeModel) else -1

    def excess(self, path: DiscretePath) -> Array:
        """As excess_of, of a motion of the present problem."""
        return self.excess_of(self.problem, path)

    def excess_of(self, problem: TrajectoryProblem, path: DiscretePath) -> Array:
        """Excess over lower and upper bounds in every interval, shaped as the margins.

        -inf for what rows bound, which holds by construction.
        """
        trajectory, limits = problem.trajectory(path), problem.limits or self.limits
        sides = np.full((2, trajectory.grid.intervals, *limits.lower.shape), -np.inf)
        for each in limit_conditions(limits, trajectory.grid.order, trajectory.space):
            if isinstance(each.where, AtPoints) and isinstance(each.on, LimitRange):
                sides[:, :, each.on.row, each.on.joints] = excess_of(trajectory, each)
        sides = sides.reshape(2, len(sides[0]), -1)
        if self.more is None:
            return sides
        more = ConditionOutputs(problem).excess(trajectory, limits.tolerance)
        return np.concatenate([sides, more], axis=2)

    def too_close(self, path: DiscretePath) -> str:
        """Which pair comes closer than the margin where there are rows of distances; "" if none."""
        if self.near is None:
            return ""
        trajectory, distances = self.problem.trajectory(path), self.near.distances
        least = self.least_distance - self.limits.tolerance * DISTANCE_SCALE
        pairs = near_pairs(trajectory, distances, least)
        if len(pairs) == 0:
            return ""
        some = distances.restricted(pairs.tolist())
        return approach_sentence(trajectory, some, approach_along(trajectory, some, least), least)

    def worst(self, path: DiscretePath) -> str:
        """The limit, distance or condition that is violated most: what, and when."""
        trajectory, more = self.problem.trajectory(path), self.more
        order, on = trajectory.grid.order, self.problem.coordinates
        others = [] if more is None else [more.worst(trajectory, self.limits.tolerance)]
        limits = limit_conditions(self.limits, order, trajectory.space, on)
        found = [*others, *(worst(trajectory, each) for each in limits)]
        if not found:  # distances alone, which have rows
            return self.too_close(path)
        i = int(np.argmax([excess for excess, _ in found]))  # what is no number comes first
        return found[i][1] + (
            static_sentence(self.problem, self.limits) if i >= len(others) else ""
        )
