"""Motions under limits: solve at the quadrature points, then tighten until they hold between."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath
from hovi.discrete.guess import stretched, with_bump
from hovi.discrete.trajectory import Trajectory
from hovi.optimize.banded_model import BandModel
from hovi.optimize.barrier import Barrier
from hovi.optimize.interior_point import BoundedOutcome, minimize_bounded
from hovi.optimize.merge_tree import MergeTreeModel
from hovi.optimize.trust_region import Iteration, Options, Stop, minimize
from hovi.planning.clearance.clearance import SCALE
from hovi.planning.clearance.violation import approach_along, approach_sentence
from hovi.planning.problem.contradictions import contradiction, static_sentence
from hovi.planning.problem.limit_violation import excess_along, worst_sentence
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.planning.solver.action_objective import ActionObjective
from hovi.planning.solver.augmented_lagrangian import first_multipliers, satisfy
from hovi.planning.solver.bounded_action import LimitedAction
from hovi.planning.solver.clearance_outputs import CUSHION, ClearanceOutputs
from hovi.planning.solver.limited_outcome import LimitedOutcome
from hovi.planning.solver.multipliers import Multipliers
from hovi.planning.solver.penalized_action import PenalizedAction
from hovi.system.deadline import Deadline
from hovi.system.interruption import remember

Array = npt.NDArray[np.float64]
Report = Callable[[int, float], None]

ENDED = Stop.TIME_LIMIT, Stop.INTERRUPTED
"""What ends a search whatever is left to try."""
ROUNDS = 40
"""Times that limits are tightened or intervals halved before giving up."""
PATIENCE = 9
"""Times that limits are tightened on one grid."""
HALVINGS = 14
"""Times that intervals are halved when limits do not hold between their points."""
SPLIT = 0.05
"""Excess, as a share of the range, beyond which intervals are halved instead of tightened."""
SPLIT_TOO = 0.01
"""Excess beyond which an interval is halved together with the worst."""
OVERSHOOT = 1.5
"""How much further than the excess a bound is drawn in: motions lean on what is left to them."""
ROOM = 5.0
"""What a bound is drawn in besides, in tolerances, so that the last rounds are few."""
SPARE = 1e-3
"""Unused share of a range beyond which a bound that was drawn in is let out again."""
WARM_MU = 1e-7, 1e-4
"""Range of the first barrier parameter of a tightened problem, relative to the mean density."""
PENALTIES = 1.0, 1e2, 1e4, 1e6
"""Penalties of violated limits, relative to the same, when the interior point finds no way."""
PENALTY_STEPS = 150
"""Steps with each penalty."""
BUMPED_GUESSES = 3
"""Perturbed guesses that are tried before limits are called infeasible."""
STAGE = 0.04
"""Depth by which a motion is moved out of obstacles at a time, in [m]."""
MOST_STAGES = 8
"""Most times that it is."""
STAGE_STEPS = 80
"""Steps of each, whose result is only a guess."""
HELD = 1e-3
"""Violation, as a share of the range, below which the larger penalty counts as having found one."""


def solve_limited(
    problem: TrajectoryProblem,
    limits: Limits,
    path: DiscretePath,
    options: Options,
    report: Report | None = None,
) -> LimitedOutcome:
    """Minimise the action between limits, which hold everywhere to their tolerance.

    path: the guess, which may violate everything.
    """
    reason = contradiction(problem, limits)
    if reason:
        value = problem.ld.action(path)
        return LimitedOutcome(problem, path, value, Stop.DIVERGED, 0, [], -1, reason=reason)
    search = _Search(problem, limits, options, Deadline(options.time_limit), report, path)
    try:
        return search.run(path)
    except KeyboardInterrupt:  # between two solves, each of which hears its own
        remember()
        return search.interrupted()


@dataclass(eq=False)
class _Search:
    """The stages of a solve, which share a problem and its budgets."""

    problem: TrajectoryProblem
    limits: Limits
    options: Options
    deadline: Deadline
    report: Report | None
    guess: DiscretePath
    iterations: int = 0
    halvings: int = 0
    multipliers: Multipliers | None = None
    unmet: str = ""

    def __post_init__(self) -> None:
        self.last = self.problem, self.guess
        self.history: list[Iteration] = []
        distances = self.problem.distances
        self.kept_clear = None
        if distances is not None:
            self.kept_clear = ClearanceOutputs(distances, self._margin() + CUSHION * SCALE)
        self.margins = self._no_margins()

    def run(self, path: DiscretePath) -> LimitedOutcome:
        """All stages."""
        outcome, reason = self.found(path)
        reason = reason or self.unmet
        if reason or not _usable(outcome):
            return self.finished(outcome, reason, 0.0)
        return self.tightened(outcome)

    def interrupted(self) -> LimitedOutcome:
        """Where the last solve ended, and nothing else."""
        problem, path = self.last
        value, steps = problem.ld.action(path), self.iterations
        return LimitedOutcome(problem, path, value, Stop.INTERRUPTED, steps, self.history, -1)

    def _margin(self) -> float:
        """The distance that counts as held to the tolerance where it is kept exactly, in [m]."""
        assert self.problem.clearance is not None
        return float(self.problem.clearance.margin) + self.limits.tolerance * SCALE

    def _no_margins(self) -> Array:
        """Bounds where they are, in every interval: (2, N, 4 nv + pairs)."""
        pairs = 0 if self.kept_clear is None else self.kept_clear.size
        return np.zeros((2, self.problem.grid.intervals, self.limits.lower.size + pairs))

    def found(self, path: DiscretePath) -> tuple[BoundedOutcome[DiscretePath], str]:
        """What a guess leads to at the quadrature points, and why there is no motion, or ""."""
        if self.kept_clear is not None:
            path = self._eased(path, self.kept_clear)
        outcome = self._interior_point(path)
        if outcome.feasible or outcome.stop is not Stop.DIVERGED:
            return outcome, ""
        return self._restored(outcome)

    def _eased(self, path: DiscretePath, wanted: ClearanceOutputs) -> DiscretePath:
        """A guess: the least action without obstacles, moved out of them little by little.

        A guess that runs deep into obstacles is pushed out on other sides at other times.
        """
        options, self.kept_clear = self.options, None
        path = self._without_distances(path)
        approach = approach_along(self._trajectory(path), wanted.distances, wanted.least)
        depth = wanted.least - float(approach.distance.min())
        stages = int(np.clip(np.ceil(depth / STAGE), 1, MOST_STAGES))
        self.options = dataclasses.replace(options, max_iterations=STAGE_STEPS)
        for share in np.arange(1, stages) / stages:
            least = wanted.least - (1.0 - share) * depth
            self.kept_clear = ClearanceOutputs(wanted.distances, least)
            outcome = self._interior_point(path)
            path = outcome.x
            if outcome.stop in ENDED:
                break
        self.options, self.kept_clear = options, wanted
        return path

    def _without_distances(self, path: DiscretePath) -> DiscretePath:
        """The motion that knows of no obstacle, or the guess where none is found."""
        if self.limits.bounded.any():
            outcome = self._interior_point(path)
            return outcome.x if outcome.feasible else path
        if self.problem.constrained:
            return path
        result = minimize(ActionObjective(self.problem), path, self._options(), self.report)
        self.iterations += result.iterations
        return result.x if np.isfinite(result.value) else path

    def _interior_point(
        self, path: DiscretePath, start: Barrier | None = None
    ) -> BoundedOutcome[DiscretePath]:
        """Between the bounds as they are drawn in, in rounds where equations have to be met."""
        if not self.problem.constrained:
            objective = self._objective(None)
            return self._count(
                minimize_bounded(objective, path, self._options(), self.report, start)
            )

        def round_(
            known: Multipliers, x: DiscretePath, decrease: float
        ) -> BoundedOutcome[DiscretePath]:
            nonlocal start
            objective = self._objective(known)
            options = dataclasses.replace(
                self._options(), decrease=max(decrease, self.options.decrease)
            )
            outcome = self._count(minimize_bounded(objective, x, options, self.report, start))
            mu = WARM_MU[1] * _density(outcome, objective)
            start = outcome.barrier.warm(objective.bounds, outcome.outputs.y, mu)
            return outcome

        rounds = satisfy(self.problem, path, round_, self.multipliers)
        self.multipliers, self.unmet = rounds.multipliers, rounds.reason
        return rounds.result

    def _objective(self, known: Multipliers | None) -> LimitedAction:
        return LimitedAction(
            self.problem, self.limits, self.margins, multipliers=known, more=self.kept_clear
        )

    def _restored(
        self, outcome: BoundedOutcome[DiscretePath]
    ) -> tuple[BoundedOutcome[DiscretePath], str]:
        """More tries, from motions that violate little, or the reason why there is none."""
        known = first_multipliers(self.problem, outcome.x) if self.problem.constrained else None
        objective = self._objective(known)
        density = _density(outcome, objective)
        least = np.inf
        for guess in self._guesses():
            path, violation, stop = self._penalized(objective, guess, density)
            if stop in ENDED:
                outcome.stop = stop
                return outcome, ""
            if violation <= HELD:
                self.multipliers = None
                again = self._interior_point(path)
                if again.feasible or again.stop in ENDED:
                    return again, ""
            if violation < least:
                least, outcome.x = violation, path
        outcome.outputs = objective.outputs(outcome.x)
        return outcome, self._why(outcome.x)

    def _guesses(self) -> Iterator[DiscretePath]:
        """The guess, and perturbations of it."""
        yield self.guess
        problem = self.problem
        T = problem.grid.duration
        base = stretched(self._trajectory(self.guess), T)
        for seed in range(BUMPED_GUESSES):
            curve = with_bump(base, problem.robot, T, seed)
            yield problem.path(curve)

    def _penalized(
        self, objective: LimitedAction, path: DiscretePath, density: float
    ) -> tuple[DiscretePath, float, Stop]:
        """A motion of little violation, by penalties that grow, its violation, and why it ended."""
        for penalty in PENALTIES:
            penalized = PenalizedAction(objective, penalty * density)
            options = dataclasses.replace(self._options(), max_iterations=PENALTY_STEPS)
            result = minimize(penalized, path, options, None)
            path = result.x
            self.iterations += result.iterations
            if result.stop in ENDED:
                break
        return path, penalized.violation(path), result.stop

    def tightened(self, outcome: BoundedOutcome[DiscretePath]) -> LimitedOutcome:
        """Draw bounds in where the interpolant exceeds them, and solve again, until they hold."""
        tightened, tolerance, reason = 0, self.limits.tolerance, ""
        for rounds in range(ROUNDS + 1):
            sides = self._sides(outcome.x)
            excess = float(sides.max())
            if excess <= tolerance or rounds == ROUNDS:
                break
            tightened += 1
            finer = self.halvings < HALVINGS
            coarse = excess > SPLIT or (finer and tightened > PATIENCE)
            again = None if coarse else self._again(outcome, sides)
            lost = again is None or not (_usable(again) or again.stop in ENDED)
            if lost and finer:
                (again, reason), tightened = self._halved(sides), 0
            if again is None:
                break
            outcome = again
            if not _usable(again):
                break
        if not reason and excess > tolerance and outcome.stop in (Stop.STATIONARY, Stop.DIVERGED):
            reason = (
                f"{self._why(outcome.x)}, between the points where limits are imposed; use more "
                "intervals"
            )
        return self.finished(outcome, reason, excess)

    def _sides(self, path: DiscretePath) -> Array:
        """Excess over lower and upper bounds in every interval, (2, N, 4 nv + pairs)."""
        trajectory = self._trajectory(path)
        excess = excess_along(trajectory, self.limits)
        sides = np.stack([excess.lower, excess.upper]).reshape(2, len(excess.lower), -1)
        if self.kept_clear is None:
            return sides
        approach = approach_along(trajectory, self.kept_clear.distances, self._margin())
        short = (self._margin() - approach.distance) / SCALE
        return np.concatenate([sides, np.stack([short, np.full_like(short, -np.inf)])], axis=2)

    def finished(
        self, outcome: BoundedOutcome[DiscretePath], reason: str, excess: float
    ) -> LimitedOutcome:
        """The result of the stages."""
        objective = self._objective(self._exerted(outcome.x))
        return LimitedOutcome(
            self.problem,
            outcome.x,
            self.problem.ld.action(outcome.x),
            outcome.stop,
            self.iterations,
            self.history,
            self._inertia(outcome),
            objective.forces(outcome.x, outcome.barrier.multipliers),
            reason or self.unmet,
            excess,
        )

    def _exerted(self, path: DiscretePath) -> Multipliers | None:
        """The multipliers of the equations, with what their penalties exert besides."""
        if self.multipliers is None:
            return None
        action = self._objective(self.multipliers).action
        return self.multipliers.updated(action.residuals(path), self.problem.passive)

    def _halved(self, sides: Array) -> tuple[BoundedOutcome[DiscretePath], str]:
        """Solve again with the intervals halved in which a limit is exceeded, and their neighbours.

        From the first guess: a motion that far exceeds a limit between the points lives in the
        gaps between them, and leads the interior point astray on a finer grid.
        """
        self.halvings += 1
        grid = self.problem.grid
        by_interval = sides.max(axis=(0, 2))
        chosen = by_interval > min(SPLIT_TOO, 0.5 * float(by_interval.max()))
        worst = chosen.copy()
        chosen[1:] |= worst[:-1]
        chosen[:-1] |= worst[1:]
        curve = stretched(self._trajectory(self.guess), grid.duration)
        problem = self.problem.on(grid.halved(chosen))
        self.guess = problem.path(curve)
        self.problem = problem
        self.multipliers = None
        self.margins = self._no_margins()
        return self.found(self.guess)

    def _again(
        self, outcome: BoundedOutcome[DiscretePath], sides: Array
    ) -> BoundedOutcome[DiscretePath]:
        """Solve again with the bounds drawn in by what the interpolant exceeds them."""
        tighter = np.where(sides > 0, OVERSHOOT * sides + ROOM * self.limits.tolerance, 0.0)
        looser = np.where(np.isfinite(sides) & (sides < -SPARE), sides + 0.5 * SPARE, 0.0)
        self.margins = np.clip(self.margins + tighter + looser, 0.0, 0.45)
        objective = self._objective(self.multipliers)
        mu = float(np.clip(1e-2 * float(sides.max()), *WARM_MU)) * _density(outcome, objective)
        start = outcome.barrier.warm(objective.bounds, outcome.outputs.y, mu)
        return self._interior_point(outcome.x, start)

    def _count(self, outcome: BoundedOutcome[DiscretePath]) -> BoundedOutcome[DiscretePath]:
        self.iterations += outcome.iterations
        self.history += outcome.history
        self.last = self.problem, outcome.x
        return outcome

    def _options(self) -> Options:
        return dataclasses.replace(self.options, time_limit=self.deadline.seconds_left)

    def _inertia(self, outcome: BoundedOutcome[DiscretePath]) -> int:
        """n_neg of the condensed system, which is positive definite at a minimum."""
        if outcome.stop is not Stop.STATIONARY or outcome.model is None:
            return -1
        if outcome.model.factor(0.0) is not None:
            return 0
        if not self.problem.plain and isinstance(outcome.model, BandModel):
            return outcome.model.negative_eigenvalues()
        objective = LimitedAction(
            self.problem, self.limits, self.margins, "tree", more=self.kept_clear
        )
        barrier: Barrier = outcome.barrier
        model = objective.model(outcome.x, barrier.sigma, barrier.gradient, barrier.multipliers)
        return model.negative_eigenvalues() if isinstance(model, MergeTreeModel) else -1

    def _trajectory(self, path: DiscretePath) -> Trajectory:
        momenta = np.zeros((path.intervals + 1, 2, path.v.shape[1]))
        return Trajectory(self.problem.grid, path, momenta, self.problem.scene)

    def _why(self, path: DiscretePath) -> str:
        trajectory = self._trajectory(path)
        if self.kept_clear is not None:
            distances, sides = self.kept_clear.distances, self._sides(path)
            first = self.limits.lower.size
            if sides[:, :, first:].max() >= sides[:, :, :first].max():
                approach = approach_along(trajectory, distances, self._margin())
                margin = self._margin() - self.limits.tolerance * SCALE
                return approach_sentence(trajectory, distances, approach, margin)
        sentence = worst_sentence(trajectory, self.limits, self.problem.robot)
        return sentence + static_sentence(self.problem, self.limits)


def _usable(outcome: BoundedOutcome[DiscretePath]) -> bool:
    """Whether it tells which intervals to halve: between bounds at the points, if unfinished."""
    return outcome.feasible and outcome.stop in (Stop.STATIONARY, Stop.ITERATION_LIMIT)


def _density(outcome: BoundedOutcome[DiscretePath], objective: LimitedAction) -> float:
    return max(abs(outcome.outputs.value), 1e-12) / float(np.sum(objective.bounds.weights))
