"""The rules of the stack that solves, each with the switch that turns it off: see rules.py.

A rule is a piece of logic that is not needed for a result to be right, but is there so that one is
found, or found in fewer steps. Checks against false successes, time limits and Ctrl-C are no rules.
"""

from __future__ import annotations

from dataclasses import dataclass

from switches import Edit


@dataclass(frozen=True)
class Rule:
    """A rule.

    name: in tables. mechanism: rules of one are turned off in pairs, too. meaning: a sentence that
    says what it does. edits: what turns it off.
    """

    name: str
    mechanism: str
    meaning: str
    edits: tuple[Edit, ...]

    @property
    def where(self) -> str:
        """File and function."""
        module, _, function = self.edits[0].where.partition(":")
        return f"{module.removeprefix('hovi.').replace('.', '/')}: {function}"


NOTICED = {
    "middle first": "test_a_narrow_room_is_used_and_held",
    "steps that take little of c away": "test_a_swing_up_in_one_interval_has_no_solution",
    "steps that equations bend too far": "test_both_hands_of_baxter_reach_their_poses",
    "reopen slacks": "test_example_runs_headless[06_seven_joints]",
    "search again on the new grid": "test_the_code_of_a_page_runs[from_drake]",
    "another branch clear of links": "test_links_that_would_meet_count_in_the_choice",
    "held ends": "test_random_poses_are_reached_in_the_cheapest_branch[11]",
    "neighbours are halved, too": "limited reach bravo7_no_ee 2 of side_by_side.py",
    "halved intervals from the motion": "limited reach bravo7_no_ee 2 of side_by_side.py",
    "several sides": "task xarm7_bin_to_bin",
    "nearly moved out": "examples/benchmarks/tasks.py",
    "fast joints evade": "task panda_out_of_bin",
    "infeasible on halved intervals": "test_smooth_motions_with_an_acceleration_limit",
    "continuation": "test_masses_of_a_million_to_one_are_solved_by_more_steps",
    "continued at its iteration limit": "limited reach bravo7_no_ee 1 of side_by_side.py",
}
"""What notices rules that change nothing on the corpus: a test that fails without, or a problem."""

RULES: list[Rule] = []
_HERE = ["", ""]
"""Mechanism and module of the rules that follow."""


def _at(mechanism: str, module: str) -> None:
    _HERE[:] = mechanism, f"hovi.{module}"


def _rule(
    name: str, meaning: str, function: str, on: str, off: str, probed: bool = True, times: int = 1
) -> None:
    """A rule whose switch replaces one expression of a function."""
    edit = Edit(f"{_HERE[1]}:{function}", on, off, probed, times)
    RULES.append(Rule(name, _HERE[0], meaning, (edit,)))


def _and(function: str, on: str, off: str) -> None:
    """One more expression of the last rule, in the same module."""
    last = RULES.pop()
    edit = Edit(f"{_HERE[1]}:{function}", on, off)
    RULES.append(Rule(last.name, last.mechanism, last.meaning, (*last.edits, edit)))


_at("trust region", "optimize.trust_region")
_rule(
    "exact before the last step",
    "Models are exact once a Newton step predicts a relative decrease of 1e-5.",
    "_iterate",
    "settled or before <= EXACT_MODEL_DECREASE * abs(value)",
    "settled",
)
_rule(
    "chord steps",
    "The last digits come by gradients with the last factorisation.",
    "_iterate",
    "settled and accepted and exact and not last",
    "False",
)
_rule(
    "stationary by size",
    "A step that is small relative to the data ends a solve whose decrease is not small.",
    "_is_stationary",
    "short and objective.relative_size(ended.x, trial.step, model) <= criteria.step",
    "False",
)
_rule(
    "shift carries over",
    "The shift of the last subproblem is the first guess of the next.",
    "_iterate",
    "next_shift(trial.shift, trial.norm, radius)",
    "0.0",
)
_rule(
    "small shift at first",
    "A search that began with a shift goes on from a smaller one after a failed factorisation.",
    "_ShiftSearch.after_failure",
    "NEAR_SHIFT if self.reached else FAR_SHIFT",
    "FAR_SHIFT",
)
_rule(
    "hard case",
    "A step that no shift makes long enough is extended along the lowest eigenvector.",
    "solve_subproblem",
    "trial.norm < radius and search.is_hard_case(shift)",
    "False",
)
_and(
    "solve_subproblem",
    "last is not None and last[1].norm < radius and search.is_hard_case(last[1].shift)",
    "False",
)
_rule(
    "end where stalled",
    "A search for least violation ends where five steps decrease it by less than a tenth.",
    "_iterate",
    "len(values) > STALLED_STEPS and gained < enough and enough > 0.0",
    "False",
)
_at("trust region", "optimize.quadratic_model")
_rule(
    "parabola after a failure",
    "After a refused step the radius is that of the least value of a parabola along it.",
    "next_radius",
    "max(LEAST_SHRINKAGE, fraction)",
    "LEAST_SHRINKAGE",
)
_rule(
    "two ways to grow",
    "The radius grows by 1.4 instead of 2 where the model was only fairly good.",
    "next_radius",
    "2.0 if ratio > BEST_RATIO else SMALL_GROWTH",
    "2.0",
)
_rule(
    "rounding counts as agreement",
    "Decreases that are rounding, actual and predicted, count as a good step.",
    "decrease_ratio",
    "abs(actual) <= noise and abs(predicted) <= PREDICTED_NOISE * noise",
    "False",
)
_at("trust region", "planning.solver.action_objective")
_rule(
    "predicted curvature",
    "The curvature of torques is weighted by the torques that the last step predicted.",
    "ActionObjective.model",
    "previous is not None and step is not None and self._expansion is not None",
    "False",
)
_rule(
    "merge tree on many intervals",
    "Beyond 1,000 intervals steps are solved by merging intervals instead of a band.",
    "ActionObjective.__init__",
    "mergeable and problem.ld.chart is None and not small",
    "False",
)
_at("interior steps", "planning.solver.bounded_action")
_rule(
    "predicted curvature within limits",
    "The same within limits.",
    "BoundedAction._slope",
    "self._predicted is not None",
    "False",
)
_at("interior steps", "optimize.bounded_steps")
_rule(
    "corrected steps",
    "Where the model is convex, a step aims at a smaller mu (Mehrotra).",
    "BoundedSteps.step",
    "trial.newton and not self.cautious and ahead",
    "False",
)
_rule(
    "second-order correction",
    "Its second-order terms are corrected.",
    "BoundedSteps._corrected",
    "barrier.corrected_targets(y, affine, mu)",
    "barrier.with_mu(mu).central_targets()",
)
_rule(
    "Gondzio corrections",
    "Outliers among the products are corrected, up to three times.",
    "BoundedSteps._corrected",
    "min(along.primal, along.dual) > LONG_STEP",
    "True",
)
_rule(
    "corrected steps within the radius",
    "A corrected step beyond 1.5 radii is replaced by a plain one.",
    "BoundedSteps.step",
    "step.fraction * step.trial.norm <= MAX_STRETCH * self.radius",
    "True",
)
_rule(
    "shorter shares",
    "A shorter part of a step is taken where that predicts more.",
    "BoundedSteps._shortened",
    "abs(predicted) <= PREDICTED_NOISE * self.noise or (pulled is not None and predicted > 0)",
    "True",
)
_rule(
    "radius grows fourfold",
    "Among obstacles the radius grows by four where the model predicted the decrease to 5 %.",
    "BoundedSteps.radius_after",
    "alike and reopens and length > AT_RADIUS * last",
    "False",
)
_rule(
    "radius follows cut steps",
    "A step at the radius that bounds cut to less than a tenth shortens the radius.",
    "BoundedSteps.radius_after",
    "min(radius, max(CUT_RADIUS * length, LEAST_CUT_RADIUS))",
    "radius",
)
_rule(
    "radius grows where bounds cut",
    "It doubles at a step that bounds cut, while outputs differ from their slacks.",
    "BoundedSteps.radius_after",
    "alike and unmatched and not (reopens or step.trial.newton)",
    "False",
)
_rule(
    "radius shortened while unmatched",
    "The same by 0.3, or 0.09, while outputs differ from their slacks among obstacles.",
    "BoundedSteps.radius_after",
    "not reopens",
    "True",
)
_rule(
    "last mu by the present cost",
    "The last barrier parameter falls with the cost where the guess cost far more.",
    "BoundedSteps.final_mu",
    "min(max(fraction, LEAST_DENSITY), 1.0)",
    "1.0",
)
_rule(
    "leave out concavity",
    "A model that is not convex is replaced by one without the rows' negative curvature.",
    "BoundedSteps.model",
    "self.exact_from_now_on or not self.objective.may_be_concave",
    "True",
)
_at("interior steps", "optimize.interior_point")
_rule(
    "same radius for the plain step",
    "After a refused corrected step the plain one has the same radius.",
    "_Iteration._try",
    "not self.cautious",
    "False",
)
_rule(
    "wide radius of warm starts",
    "A warm start within limits has a first radius of 1000 instead of 50.",
    "minimize_bounded",
    "cold if start.z is None else warm",
    "cold",
)
_rule(
    "unit of a cost near zero",
    "Where the guess costs next to nothing, 1 is the unit of the barrier.",
    "minimize_bounded",
    "density < DENSITY_FLOOR",
    "False",
)
_rule(
    "end without equations",
    "Four steps that predict nothing end a solve although equations do not hold.",
    "_Iteration._finished",
    "self.unmet % MAX_UNMET == 0",
    "self.unmet == 0",
)
_at("interior barrier", "optimize.interior_point")
_rule(
    "raise mu when bounds cut",
    "After four steps in a row that bounds cut, mu is raised tenfold.",
    "_Iteration._raise_mu",
    "self.cut < MOST_CUT or mu <= ended.z.mu",
    "True",
)
_rule(
    "reopen slacks",
    "Among obstacles a stalled solve moves its slacks inside and goes on.",
    "_Iteration._reopened",
    "not objective.reopens or self.reopenings >= MAX_REOPENINGS or outside > LARGEST_REOPENED",
    "True",
)
_rule(
    "leave saddles within limits",
    "A saddle at the end is left along negative curvature, up to five times.",
    "_Iteration.run",
    "exact and (definite or not self._leave_saddle())",
    "exact",
)
_rule(
    "room at a saddle",
    "From a saddle of an inexact model a solve goes on with slacks inside and a larger mu.",
    "_Iteration.run",
    "not (exact or definite)",
    "False",
)
_rule(
    "end where stalled within limits",
    "Twelve refused steps end a solve as diverged.",
    "_Iteration._is_hopeless",
    "stalled or forced",
    "False",
)
_rule(
    "end at huge multipliers",
    "Multipliers above 1e12 densities end a solve as diverged.",
    "_Iteration._is_hopeless",
    "self.penalty > MAX_FORCE * self.density",
    "False",
)
_rule(
    "save again",
    "A later iterate takes the place of a saved one up to 1.5 times its product.",
    "_Iteration._save",
    "product <= SAVED_AGAIN * self.first_product",
    "False",
)
_rule(
    "drop saved iterates",
    "Saved iterates with a smaller mu are dropped where mu is raised.",
    "_Iteration._drop_saved",
    "each[0] > mu",
    "True",
)
_rule(
    "refine while mu falls",
    "Control points are halved and rows added at every tenth of mu, not at the end alone.",
    "_Iteration._refined",
    "early and not at_end",
    "not at_end",
)
_rule(
    "rows at once",
    "Rows of distances are added after any step that brings a pair near.",
    "_Iteration._refined",
    "self.objective.refine_at_once(ended.x)",
    "None",
    False,
)
_rule(
    "radius cut where outputs are added outside",
    "Outputs that are added outside their bounds cut the radius to 3.",
    "_Iteration._replaced",
    "outside > 0.0",
    "False",
)
_rule(
    "room for new outputs",
    "Outputs that are added outside their bounds raise mu and move other slacks inside.",
    "_Iteration._replaced",
    "mu > barrier.mu",
    "False",
)
_rule(
    "mu not below the mean product",
    "After new outputs mu is at least the mean product.",
    "_Iteration._replaced",
    "max(barrier.mu, self.product)",
    "barrier.mu",
)
_at("interior barrier", "optimize.barrier")
_rule(
    "slacks move with their outputs",
    "Slacks of outputs that refined rows move away from a single bound move along.",
    "Barrier.refined",
    "self._moved_inside(y[:old] - before, kept)",
    "0.0",
)
_rule(
    "multipliers of former rows",
    "New rows begin with the multiplier of the row that was at their place.",
    "Barrier.refined",
    "origin >= 0",
    "origin < -1",
)
_rule(
    "fraction to the boundary grows",
    "The largest share of a gap in one step grows as mu falls.",
    "Barrier.boundary_fraction",
    "min(max(FRACTION_TO_BOUNDARY, 1.0 - self.mu / self.scale), LARGEST_FRACTION)",
    "FRACTION_TO_BOUNDARY",
)
_at("equations", "optimize.interior_point")
_rule(
    "corrections for curved equations",
    "A step whose merit falls by less than half of what it predicts is corrected.",
    "_Iteration._corrected_step",
    "self._ratio(step, before, there) < CURVED",
    "False",
)
_rule(
    "steps that equations bend too far",
    "A step is refused whose correction leaves more than half of what it misses of c.",
    "_Iteration._corrected_step",
    "size_of(left) < CORRECTED * size_of(missed)",
    "True",
)
_rule(
    "what a correction undoes",
    "A step is refused whose correction costs more than the step gained.",
    "_Iteration._try",
    "there.merit < corrected.merit < before",
    "there.merit < corrected.merit",
)
_rule(
    "steps that take little of c away",
    "Where twelve steps in a row could take next to nothing of c away, a solve has failed.",
    "_Iteration._count_idle",
    "moving or size <= LITTLE * self.first_residual",
    "True",
)
_at("equations", "optimize.bounded_steps")
_rule(
    "weight of the residual",
    "A step under equations that predicts no decrease gets one by a weight of |c|^2.",
    "BoundedSteps._shortened",
    "self._weight(predicted - weight * gain, gain)",
    "weight",
)
_rule(
    "multipliers without the barrier",
    "Multipliers of a shortened step are those for the forces of the bounds as they are.",
    "BoundedSteps._reaction",
    "self.objective.pull(self.force - self.rho, model)",
    "0.0",
)
_at("equations", "optimize.equation_model")
_rule(
    "curvature of what takes c away",
    "Shortened steps are measured by |c|^2 with the curvature of what takes c away.",
    "EquationModel.residual_weight",
    "factor.weight",
    "0.0",
)
_rule(
    "least-squares multipliers of shortened steps",
    "A step that is kept within a radius has the multipliers of one that keeps c.",
    "EquationModel.reaction",
    "factor.shift == 0.0",
    "True",
)
_rule(
    "a part of the radius for the equations",
    "What takes c away has at most 0.8 of the radius.",
    "EquationModel.descend",
    "factor.shift > 0.0",
    "False",
)
_at("warm starts", "planning.solver.methods.feasibility")
_rule(
    "level of equations",
    "The level of a near start is also that of the step that satisfies its equations.",
    "_shift",
    "len(residual) > 0",
    "False",
)
_at("equations", "planning.solver.methods.bounded_search")
_rule(
    "least-squares multipliers of a near guess",
    "A guess near a minimum begins with least-squares multipliers.",
    "BoundedSearch.known_multipliers",
    "self.start.near",
    "False",
)
_at("equations", "planning.solver.methods.middle_first")
_rule(
    "middle first",
    "What is kept within a narrow room is kept in its middle first.",
    "MiddleFirst.supports",
    "has_values",
    "False",
)
_at("warm starts", "planning.solver.methods.bounded_search")
_rule(
    "points of earlier solves",
    "A central path keeps the points of earlier solves with a larger barrier.",
    "BoundedSearch._add_points",
    "self.points or ([] if self.along is None else self.along.points)",
    "[]",
)
_rule(
    "look around",
    "Pairs within 2 cm of a known motion get rows at once.",
    "BoundedSearch.look_around",
    "self.near is not None",
    "False",
)
_rule(
    "wide radius at a level",
    "A solve that begins on a central path has a wide first radius among obstacles.",
    "BoundedSearch._objective",
    "(BoundedAction if self.at_level else ClearedAction).radii",
    "ClearedAction.radii",
)
_at("warm starts", "planning.solver.central_path")
_rule(
    "saved iterates",
    "A solve for other ends begins at a point where the barrier was larger.",
    "CentralPath.at",
    "large[-1] if large else self.points[0]",
    "self.points[-1]",
)
_at("warm starts", "planning.solver.methods.feasibility")
_rule(
    "solve nearby",
    "A guess that is the motion of a similar problem begins with a small barrier.",
    "feasible_motion",
    "_solved_nearby(search)",
    "None",
    False,
)
_rule(
    "follow the solution",
    "Whole Newton steps from the last solution within limits.",
    "_followed",
    "known is None or search.near is not None or search.problem.constrained",
    "True",
)
_rule(
    "warm at the solution",
    "Ends that moved little begin at the solution with its multipliers.",
    "_solved_along",
    "along.barrier is not None and shift <= WARM_SHIFT",
    "False",
)
_rule(
    "barrier by the move",
    "The first barrier parameter is proportional to the move of the ends.",
    "_solved_along",
    "float(np.clip(SHIFT_LEVEL * shift, *SHIFT_LEVELS))",
    "SHIFT_LEVELS[1]",
)
_rule(
    "adopt multipliers of conditions",
    "Multipliers of conditions are those of the similar problem.",
    "_adopt",
    "along.conditions is not None",
    "False",
)
_rule(
    "adopt rows of distances",
    "So are rows of distances.",
    "_adopt",
    "along.near is not None and search.near is not None",
    "False",
)
_rule(
    "close points among obstacles",
    "Among obstacles a solve for other ends begins within 0.1 rad of the solution.",
    "_solved_from_level",
    "along.close(level, problem.coordinates) if other_ends else along.at(level)",
    "along.at(level)",
)
_rule(
    "refine rows at a level",
    "On another grid control points are halved before the first step.",
    "_solved_from_level",
    "along.rows is None",
    "False",
)
_rule(
    "refine rows near a solution",
    "From a motion that nearly is a solution control points are halved before the first step.",
    "solved_from",
    "search.rows.refine(path, NEARBY_MU)",
    "None",
)
_at("warm starts", "planning.solver.warm_start")
_rule(
    "predict the replanned motion",
    "A motion without limits is replanned from its first-order prediction.",
    "follow",
    "not problem.plain",
    "True",
)
_rule(
    "predict by the last Hessian",
    "The prediction uses the last model instead of a new one.",
    "follow",
    "not (isinstance(known, BandModel) and known.layout is problem.structure.layout)",
    "True",
)
_at("warm starts", "planning.solver.solver")
_rule(
    "replan on the central path",
    "A motion within limits is replanned from its central path.",
    "_Again._solved",
    "self.central if problem.limited else None",
    "None",
)
_rule(
    "replan to a far frame goal by guesses",
    "A frame goal far from the old end begins at a guess of inverse kinematics.",
    "_Again._solved",
    "isinstance(goal, FrameGoal) and not is_near(goal, problem, path)",
    "False",
)
_at("warm starts", "planning.solver.receding.remainder")
_rule(
    "short rests are merged",
    "Less than a twentieth of an interval becomes one with the next.",
    "Remainder.after",
    "int(short)",
    "0",
)
_at("distances", "planning.solver.methods.free_first")
_rule(
    "free first",
    "What distances alone limit is solved without them first, by a method without limits.",
    "FreeFirst.supports",
    "problem.distances is not None and not problem.with_clearance(None).limited",
    "False",
)
_at("distances", "planning.solver.methods.cleared_motion")
_rule(
    "without distances first",
    "A solve ends at the first motion that does not keep its distances, to be moved out.",
    "_without_distances",
    "True",
    "False",
)
_rule(
    "push out of obstacles",
    "A rough motion is moved out of obstacles without its dynamics.",
    "_rough_with_distances",
    "pushed_out(problem, path, distances, search.near.least)",
    "path",
)
_rule(
    "detours are compared",
    "Where the moved motion is a detour or none, the guess is moved out as well.",
    "cleared_motion",
    "rough[0] is None or rough[0].rank > (False, DETOUR * abs(free.outputs.value))",
    "False",
)
_rule(
    "rows ahead",
    "Pairs within 6 cm get rows before a rough motion is solved.",
    "_rough_with_distances",
    "search.near.extend(problem, moved, AHEAD)",
    "search.near.extend(problem, moved, 0.0)",
    False,
)
_rule(
    "watch from the first",
    "A rough motion is watched for near pairs before it has any rows.",
    "_rough_with_distances",
    "True",
    "False",
)
_rule(
    "rows of far pairs are dropped",
    "After a rough motion pairs beyond 3 cm lose their rows.",
    "_Rough.solved",
    "self.near.thinned(x, KEPT)",
    "self.near.thinned(x, 1e9)",
)
_at("distances", "planning.solver.near.push_out")
_rule(
    "several sides",
    "A motion that cannot be moved out of obstacles is tried from random bumps.",
    "pushed_out",
    "range(TRIES)",
    "range(1)",
)
_rule(
    "nearly moved out",
    "Motions that stay too close by at most 5 mm count as moved out.",
    "_Deformation.solved",
    "float(lowest.min()) >= self.least - NEARLY",
    "False",
)
_rule(
    "fast joints evade",
    "Changes of joints that are slow by their limits cost more.",
    "_Deformation._stiffness",
    "self._prices",
    "np.ones(self.problem.coordinates.nv)",
)
_at("distances", "planning.solver.near.approaches")
_rule(
    "rows around touches",
    "A least distance that touches its bound gets rows around it.",
    "approaches_along",
    "wanted & (lowest[2] < least + TOUCHING)",
    "wanted & False",
)
_rule(
    "spread rows",
    "Near pairs get rows at four positions of each interval.",
    "approaches_along",
    "chosen[:, None] & (d < least + ahead) & ~_allowed(d, least)",
    "chosen[:, None] & (d < least + ahead) & False",
)
_rule(
    "rows not where allowed",
    "No row is added where a distance is below its bound by what is allowed between rows.",
    "_allowed",
    "(d < least) & (d >= least - USED)",
    "(d < least) & False",
)
_rule(
    "closer samples at least distances",
    "Least distances are found by closer samples, four times.",
    "_refined",
    "PASSES if len(at) else 0",
    "0",
)
_at("distances", "planning.solver.near.clearance_rows")
_rule(
    "rounded shapes",
    "Shapes are rounded the more, the farther a pair is from its bound.",
    "_rounding_of",
    "np.clip(ROUNDED_FRACTION * DISTANCE_SCALE * y, LEAST_ROUNDING, MOST_ROUNDING)",
    "np.full(np.shape(y), LEAST_ROUNDING)",
)
_at("distances", "planning.solver.near.cleared_action")
_rule(
    "refuse depth",
    "A step whose deepest pair is deeper than before, and more than 5 mm, is refused.",
    "ClearedAction.outputs",
    "self.near.depth(x) > self._deepest",
    "False",
)
_rule(
    "sharpen shapes at once",
    "Shapes are rounded less after any step that brings a row nearer to its bound.",
    "ClearedAction.refine_at_once",
    "self.near.sharpen(x)",
    "False",
    False,
)
_at("limits", "planning.solver.limits.limit_rows")
_rule(
    "halve several times",
    "Parts are halved up to four times at once.",
    "LimitRows.refine",
    "range(MAX_HALVINGS)",
    "range(1)",
)
_rule(
    "no halving below a total",
    "No part is halved while all control points together cost less than 1e-5.",
    "LimitRows._coarse",
    "loss.sum() > self.max_loss",
    "True",
)
_at("limits", "planning.solver.limits.graded_parts")
_rule(
    "short parts where led back",
    "Parts across the end of a way back are short.",
    "_short_across",
    "not long.any()",
    "True",
)
_at("limits", "planning.solver.between_points")
_rule(
    "margins follow",
    "Bounds at points are tightened for what a motion exceeds between them as it is found.",
    "MarginsBetweenPoints.follow",
    "not near.any()",
    "True",
)
_rule(
    "unused margins",
    "A margin that is not used is relaxed, once at each barrier parameter.",
    "MarginsBetweenPoints.follow",
    "(wanted < self.values - UNUSED * self.tolerance) & ~self._firm",
    "(wanted < self.values) & False",
)
_rule(
    "margins by secants",
    "A margin changes as its last two values extrapolate, not by the whole excess.",
    "MarginsBetweenPoints.follow",
    "np.clip(slope, -STEEPEST, 0.0)",
    "0.0 * slope",
)
_at("limits", "planning.solver.methods.limits_between_points")
_rule(
    "neighbours are halved, too",
    "Intervals next to one that is halved are halved.",
    "_solved_on_halves",
    "worst[:-1]",
    "worst[:-1] & False",
)
_and("_solved_on_halves", "worst[1:]", "worst[1:] & False")
_rule(
    "halved intervals from the motion",
    "A solve on halved intervals begins at the motion.",
    "_solved_on_halves",
    "usable(ended) and by_interval.max() <= WARM_EXCESS",
    "False",
)
_at("attempts", "planning.solver.methods.feasibility")
_rule(
    "end at least violations",
    "A search ends where three guesses lead to nonzero minima of the violation.",
    "feasible_motion",
    "locally_infeasible(search, ended)",
    '""',
    False,
)
_at("attempts", "planning.solver.limits.restored_motion")
_rule(
    "restored motions",
    "After a failure motions of small violation are solved from.",
    "restored_motion",
    "violation <= SMALL_VIOLATION",
    "False",
)
_rule(
    "bumped guess for restoring",
    "Such a motion is looked for from a perturbed guess, too.",
    "restored_motion",
    "chain([search.guess], bumped)",
    "[search.guess]",
    False,
)
_at("durations", "planning.search.joint_duration")
_rule(
    "joint solve",
    "Motion and duration are solved for together where that is supported.",
    "joint_minimum",
    "not solves_jointly(problem, price.clock, lengths, near)",
    "True",
)
_rule(
    "search again on the new grid",
    "A search whose duration is not the best on its grid is repeated there.",
    "best_on_its_grid",
    "not found.solution.success or is_best(found)",
    "True",
)
_at("durations", "planning.solver.free_duration.timed_search")
_rule(
    "first for the given duration",
    "A distant guess first becomes a motion of its own duration.",
    "_at_the_points",
    "not search.start.near",
    "False",
)
_at("durations", "planning.search.free_duration")
_rule(
    "jumps end a bracket",
    "A jump of the cost within a narrow bracket ends the search for a root.",
    "_jumps",
    "a.gap_to(b) <= JUMP_BRACKET and abs(a.total - b.total) > explained",
    "False",
)
_at("durations", "planning.search.search")
_rule(
    "other first durations",
    "Where the first duration has no motion, six others are tried.",
    "Search._run",
    "self.free is None or explored.minima[0].success",
    "True",
)
_at("durations", "planning.search.least_duration")
_rule(
    "jumps of the weight of time",
    "For the least time the weight grows by up to 30 while the effort is much of the cost.",
    "_Search._next",
    "float(np.clip(wanted, LEAST_JUMP * self.weight, factor * self.weight))",
    "LEAST_JUMP * self.weight",
)
_at("refinement", "planning.refinement.adaptive")
_rule(
    "central path on another grid",
    "Among obstacles a solve on another grid begins on the last central path.",
    "_along",
    "central is None or problem.distances is None",
    "True",
)
_rule(
    "guess first, then near",
    "Within limits a solve on another grid begins as from a guess, then as near a solution.",
    "Refinement._solved",
    "(True,) if problem.distances is not None else (guessed, True)",
    "(True,)",
)
_rule(
    "continued at its iteration limit",
    "Within limits a solve at its iteration limit is continued once.",
    "Refinement._solved",
    "solution.status is Status.ITERATION_LIMIT and problem.limited",
    "False",
)
_rule(
    "end where grids do not help",
    "Two grids that do not halve the error end the refinement.",
    "Refinement._stop_reason",
    "stalled >= MAX_STALLED_ROUNDS",
    "False",
)
_at("refinement", "planning.refinement.next_grid")
_rule(
    "grid of the finer motion",
    "The grid of the error estimate is the next one if it is nearly fine enough.",
    "next_grid",
    "usable and all(demand.remaining(change) <= FINER_GRID_RATIO for demand in demands)",
    "False",
)
_rule(
    "few points once resolved",
    "A resolved motion goes on with fewer points per interval.",
    "next_grid",
    "error <= CURVE_TOLERANCE",
    "False",
)
_at("refinement", "planning.refinement.hp_refinement")
_rule(
    "few modes while unresolved",
    "Intervals have at most six modes while the decay is not known.",
    "refined",
    "MODES if decay_known else MODES[MODES <= UNRESOLVED_MODES]",
    "MODES",
)
_rule(
    "two schemes on a grid",
    "Intervals of one grid may have two numbers of modes.",
    "_cheapest",
    "np.triu_indices(more.shape[1])",
    "(np.arange(more.shape[1]), np.arange(more.shape[1]))",
)
_at("refinement", "planning.refinement.error_estimate")
_rule(
    "richer motion within limits",
    "Within limits the finer motion has two more modes and the same rows.",
    "finer_than",
    "problem.limited and solution.central is not None",
    "False",
)
_rule(
    "finer motion by Newton steps",
    "Without limits the finer motion comes by Newton steps with reused Hessians.",
    "finer_solution",
    "nearby_minimum(objective, start, model, known)",
    "None",
    False,
)
_rule(
    "interpolated torques as weights",
    "Its first Hessian is weighted by interpolated torques.",
    "finer_solution",
    "interpolated_slopes(problem.ld, path, fine.ld)",
    "None",
    False,
)
_rule(
    "finer motion taken as it is",
    "A finer motion that was solved to the end is not solved again when it is finished.",
    "_finished",
    "known.central.level <= SAME_LEVEL * barrier "
    "and satisfies(known.problem, known.trajectory.path)",
    "False",
)
_at("refinement", "planning.refinement.nearby_minimum")
_rule(
    "reused Hessians",
    "Up to two more steps with one Hessian.",
    "nearby_minimum",
    "length > LONG_STEP or correction == MAX_CORRECTIONS",
    "True",
)
_at("refinement", "planning.refinement.resolution")
_rule(
    "estimates are kept",
    "A replanned motion near one that passed keeps its error estimate.",
    "Resolution.__call__",
    "self._kept_for(solution) if solution.success else None",
    "None",
)
_at("refinement", "planning.search.final_stages")
_rule(
    "refine without far limits",
    "A motion far from its limits is refined without them.",
    "FinalStages.refined",
    "far_from_limits(known)",
    "False",
)
_at("search", "planning.search.search")
_rule(
    "coarse grid first",
    "Grids of more than 160 intervals are begun on 80.",
    "Search._coarse",
    "grid.intervals <= 2 * COARSE_INTERVALS or continued",
    "True",
)
_rule(
    "nodes where joints speed up",
    "Where a duration seems too short, nodes are put where joints speed up and slow down.",
    "Search._on_finer_grid",
    "graded_to_ramps(fine.problem())",
    "fine.grid",
    False,
)
_rule(
    "infeasible on halved intervals",
    "What is infeasible on a grid that hovi chose is tried once more on halved intervals.",
    "Search._on_finer_grid",
    "self.halved or fine.tolerance is None or fine.options.clearance.wanted",
    "True",
)
_rule(
    "finer tolerances where unresolved",
    "A motion that its tolerance did not resolve is refined to finer ones.",
    "Search._at_finer_tolerances",
    "given is None or self._free or refused.status is not Status.UNRESOLVED",
    "True",
)
_rule(
    "grids that see narrow features",
    "Nodes are put where effects have narrow features.",
    "Search._seeing_features",
    "tolerance is None or self._free or NARROW not in refused.message",
    "True",
)
_rule(
    "without self-collision first",
    "The motion without self-collision is planned first and kept if links stay apart.",
    "Search.run",
    "self.without is None",
    "True",
)
_rule(
    "another branch clear of links",
    "Where links meet, branches are compared again by motions clear of them.",
    "Search._over_branches",
    "self.ends.cheaper_clear(cost, self.deadline)",
    "None",
    False,
)
_at("search", "planning.search.job")
_rule(
    "grid of the guess",
    "A refinement begins on the grid of a given motion if that is finer.",
    "grid_of",
    "isinstance(guess, Trajectory) and _is_first_grid(guess.grid, options, scene.order)",
    "False",
)
_at("search", "planning.search.multistart")
_rule(
    "held ends",
    "The end is held where a frame goal is reached, if that fails with a free end.",
    "_attempts",
    "job.held_at(attempt.guess.q[-1]) if first.isolated or to_branch else None",
    "None",
)
_rule(
    "basin hopping",
    "Later rounds of starts perturb the best minima.",
    "_round",
    "done > STARTS_PER_ROUND",
    "False",
)
_rule(
    "random turns",
    "Starts of continuous joints are given random full turns.",
    "_round",
    "robot.space.angles",
    "()",
)
_at("search", "planning.search.branch_choice")
_rule(
    "branches compared by motions",
    "Branches of a frame goal are compared by motions on four intervals.",
    "_Choice.ends",
    "self._solved(pairs) if known and len(pairs) > 1 else ()",
    "()",
    False,
)
_rule(
    "rough motions rank branches",
    "Which branches these are is decided by rough motions.",
    "_Choice._guesses",
    "not robot.space.flat or self.scene.terms.timed",
    "True",
)
_rule(
    "three rough motions",
    "Rough motions begin from three random bumps instead of one.",
    "_Choice._guesses",
    "range(ROUGH)",
    "range(1)",
)
_rule(
    "solve from rough motions",
    "Six branches are solved for from their rough motion, too.",
    "_Choice._guesses",
    "rank < FROM_ROUGH",
    "False",
)
_at("continuation", "planning.search.search")
_rule(
    "continuation",
    "A solve without a minimum goes on, or begins with more time among obstacles.",
    "Search._continued",
    "not may_help(job, found[0])",
    "True",
)
