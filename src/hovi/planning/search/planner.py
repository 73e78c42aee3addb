"""plan: one call from a scene and two states to an optimal motion."""

from __future__ import annotations

import dataclasses
import functools
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, ParamSpec, Protocol, cast

import numpy as np

from hovi.checks.arguments import check_arguments_except
from hovi.checks.units import Duration, as_duration
from hovi.discrete.output.caution import COLLISION, LEFT_OUT, STATUS, WARNED, Caution
from hovi.discrete.state import State, warn_of_degrees
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError, ModelError, expect, warn
from hovi.planning.clearance.distances import distances_between
from hovi.planning.clearance.hull_overlaps import HullOverlap, hull_overlaps, met_sentence
from hovi.planning.clearance.self_collisions import not_looked_at, pairs_left_out
from hovi.planning.problem.clock import Clock
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.goals import Via
from hovi.planning.problem.notation.ends import End, as_end, as_start
from hovi.planning.problem.notation.goal_turns import says_turns, turns_sentence
from hovi.planning.problem.notation.smoothing import smoothed
from hovi.planning.problem.presolve.assumptions import assumptions
from hovi.planning.problem.presolve.findings import findings
from hovi.planning.problem.presolve.length_slips import grasped_slips
from hovi.planning.refinement.error_estimate import with_metadata
from hovi.planning.refinement.faults.cautions import keeping_warnings, with_cautions_of_motion
from hovi.planning.refinement.resolution import with_check
from hovi.planning.search.branch_choice import Ends, chosen_ends, nearest_ends
from hovi.planning.search.free_duration import FreeDuration
from hovi.planning.search.group import in_group, with_others
from hovi.planning.search.guess_cautions import cautions_of_guess
from hovi.planning.search.job import Job, grid_of, split_for_charts, stops_of
from hovi.planning.search.least_duration import least_duration
from hovi.planning.search.option_fields import spell_out
from hovi.planning.search.options import PlanOptions
from hovi.planning.search.search import Search
from hovi.planning.solver.iterates import Cancel, OnIterate, watched
from hovi.planning.solver.outcome.self_collision import self_collision_sentence
from hovi.planning.solver.outcome.without_solve import infeasible_at_once, without_search
from hovi.planning.solver.solver import Solution
from hovi.planning.solver.status import Status
from hovi.robot.robot import Robot
from hovi.robot.space.angle_ranges import LOOKS_LIKE_DEGREES
from hovi.scene.scene import Scene
from hovi.system.blas_threads import one_blas_thread
from hovi.system.dataclass import dataclass
from hovi.system.deadline import Deadline
from hovi.system.interruption import interruptible
from hovi.system.progress import Progress, shows_progress, silent

Keywords = ParamSpec("Keywords")
ASKED_GOAL = "goal"
"""The key of a motion's metadata with the goal of a frame that it was planned to, as a table."""
LEAST_TIME = 1e-3
"""Time limit of a plan of several once that for all of them has passed, in [s]."""
UNSEEN = Status.INFEASIBLE, Status.DIVERGED, Status.TIME_LIMIT
"""Statuses of motions in which self-collision is not looked for."""


class _Plan(Protocol[Keywords]):
    """`plan` as type checkers see it: with the keywords of PlanOptions."""

    def __call__(
        self,
        scene: Scene,
        start: End,
        goal: End,
        duration: Duration,
        progress: Progress | None = None,
        options: PlanOptions | None = None,
        on_iterate: OnIterate | None = None,
        cancel: Cancel | None = None,
        *_: Keywords.args,
        **changes: Keywords.kwargs,
    ) -> Solution:
        """As `plan`."""
        ...


def _with_option_keywords(
    options: Callable[Keywords, PlanOptions],
) -> Callable[[Callable[..., Solution]], _Plan[Keywords]]:
    """A decorator that makes the options keywords of the function, for help and type checkers."""

    def taking(function: Callable[..., Solution]) -> _Plan[Keywords]:
        spell_out(function, PlanOptions)
        return cast(_Plan[Keywords], function)

    return taking


@_with_option_keywords(PlanOptions)
@check_arguments_except("scene", "start", "goal", "duration", "options")
@one_blas_thread
@interruptible
@shows_progress
@keeping_warnings
def plan(
    scene: Scene,
    start: End,
    goal: End,
    duration: Duration,
    progress: Progress | None = None,
    options: PlanOptions | None = None,
    on_iterate: OnIterate | None = None,
    cancel: Cancel | None = None,
    **changes: Any,
) -> Solution:
    """The motion of least 1/2 integral |tau|^2 from a state to a goal.

    Where a FrameGoal is reached in several configurations, coarse motions to the nearest ones are
    compared, and the one that costs least is chosen: a start is that configuration, a goal begins
    there and is free to change along all configurations that reach it.

    scene: the robot with its effects.
    start, goal: a State, a configuration of shape (nq,) at rest, the name of a pose, or a
        FrameGoal; or a table of joint positions, or one with the keys of a scene file's [goal],
        such as {"frame": "tool0", "position": [0.4, 0.2, 0.3]}; a list of FrameGoals, or of their
        tables, is for several frames at once.
    duration: T in [s], or a text such as "1.5 s", "500 ms" or "2 min"; or a pair (lower, upper)
        of these for a free duration.
    progress: called with a line of text and the completed fraction, in [0, 1]; in a notebook, a
        line under the cell by default.
    options: a PlanOptions; the following keywords override it.
    on_iterate: called with a hovi.Iterate after every step, whose `solution` is the motion so far.
        It sees no starts that run in worker processes: processes=1 keeps all of them here.
    cancel: a function without arguments, such as the `is_set` of a threading.Event: once it returns
        True, the plan ends as by Ctrl-C, with the best motion so far.
    {options}
    Raises InputError, ModelError, SceneError or SchemeError for invalid input, UnreachableError for
    a start that no configuration reaches, CancelledError if it is cancelled before it has a motion.
    """
    began = time.perf_counter()
    if not isinstance(scene, Scene):
        raise InputError(
            f"plan takes a hovi.Scene, such as hovi.Scene(robot, [...]), got {scene!r}."
        )
    options = PlanOptions() if options is None else options
    expect(options, PlanOptions, "hovi.PlanOptions(...), or its fields by keyword")
    options = options.with_changes(**changes)
    scene = options.holding(scene)
    first = as_start(start, scene.robot)
    goal = with_others(goal, options.group, scene.robot, first)
    given = first, _goal(goal, scene.robot, options)
    if options.group is not None:
        scene, start_end, goal_end = in_group(scene, options.group, *given)
        given = start_end, goal_end
    length = as_duration(duration)
    with watched(on_iterate, cancel):
        if options.repeat == 1:
            return _once(scene, *given, length, progress, options, began)
        from hovi.planning.search.repetition import goal_of_cycle, repeated  # most run once

        given = given[0], goal_of_cycle(*given, scene.robot)
        cycle = _once(scene, *given, length, progress, options, began)
        return repeated(cycle, options.repeat)


def _once(
    scene: Scene,
    start: State | FrameGoal,
    goal: State | FrameGoal,
    duration: float | tuple[float, float],
    progress: Progress | None,
    options: PlanOptions,
    began: float,
) -> Solution:
    """The plan of one cycle. began: when it did, by the clock."""
    given = options.aiming(scene), start, goal, duration, progress
    if not all(each.timed for each in options.via):
        if options.objective == "time":
            raise InputError(
                'objective = "time" does not choose the times of via points: give a free duration '
                "and a large time_weight instead."
            )
        return _through(*given, options)
    if options.objective == "time":
        return least_duration(functools.partial(_settled, *given), duration, options)
    return _settled(*given, options, began)


def _through(
    scene: Scene,
    start: State | FrameGoal,
    goal: State | FrameGoal,
    duration: float | tuple[float, float],
    progress: Progress | None,
    options: PlanOptions,
) -> Solution:
    """The plan through via points without times."""
    from hovi.planning.search.via_times import with_best_times  # most have times

    def planned(
        timed: PlanOptions, T: float, near: Trajectory | None, settled: State | FrameGoal | None
    ) -> Solution:
        timed = _in_time_left(timed, deadline)
        if near is None:
            return _settled(scene, start, goal, T, progress, timed)
        end = goal if settled is None else settled
        return _planned(scene, start, end, T, progress, timed, None, near)

    deadline = Deadline(options.time_limit_seconds)
    return with_best_times(planned, options, scene.robot, (start, goal), duration, deadline)


def _settled(
    scene: Scene,
    start: State | FrameGoal,
    goal: State | FrameGoal,
    duration: float | tuple[float, float],
    progress: Progress | None,
    options: PlanOptions,
    began: float | None = None,
) -> Solution:
    """As `_planned`, with the region of the goal settled if it has one."""
    planned = functools.partial(_planned, scene)
    if not (isinstance(goal, FrameGoal) and goal.regional):
        return planned(start, goal, duration, progress, options, began)
    from hovi.planning.search.settled_regions import begun, moved_to, settled  # most are exact

    deadline = Deadline(options.time_limit_seconds)
    goal = begun(goal, start, scene, options)
    found = planned(start, goal, duration, progress, options, began)

    def again(goals: Sequence[FrameGoal], last: Solution) -> Solution:
        assert last.problem is not None
        near, left = moved_to(goals, last), _in_time_left(options, deadline)
        return planned(last.problem.start, goals[0], duration, progress, left, None, near)

    return settled(found, again, deadline)


def _in_time_left(options: PlanOptions, deadline: Deadline) -> PlanOptions:
    """The options with the time that is left of a limit for several plans."""
    left = deadline.seconds_left
    return options if left is None else options.with_changes(time_limit=max(left, LEAST_TIME))


def _planned(
    scene: Scene,
    start: State | FrameGoal,
    goal: State | FrameGoal,
    duration: float | tuple[float, float],
    progress: Progress | None,
    options: PlanOptions,
    began: float | None = None,
    near: Trajectory | None = None,
) -> Solution:
    """The motion in a scene whose robot holds what is grasped, with the effects of the objective.

    began: when the plan did, by the clock; now by default. near: a motion of a similar plan, from
    which it begins in place of the guess.
    """
    began = time.perf_counter() if began is None else began
    if options.keep:
        from hovi.planning.search.kept import with_kept  # most motions keep nothing

        options, goal = with_kept(options, scene.robot, start, goal, duration)
    given = start, goal
    chosen, apart = kept_apart(options.on(scene), scene.robot, ends_of(*given, options.via))
    deadline, guess = Deadline(chosen.time_limit_seconds), chosen.guess
    if near is not None:
        chosen = chosen.with_changes(guess=near, starts=1)
    free, T = _time(duration, chosen)
    planning = _Planning(scene, *given, T, chosen, free)
    job = planning.job(nearest_ends(scene, *given, chosen), deadline)
    problem = longest = job.problem()  # raises for invalid input before the search
    if options.repeat > 1:
        from hovi.planning.search.repetition import require_alike

        require_alike(problem)
    if free is not None:
        job.lasting(free.clock, free.lower)  # raises for steps that are too short or too long
        longest = job.lasting(free.clock, free.upper).problem()
    known = findings(longest, *given)
    reason = known.reason if _says_the_same(job, free, known.reason) else ""
    warn_of_ends(scene.robot, job.start, job.goal, chosen, reason)
    for sentence in known.warnings:
        warn(sentence)
    fault = "" if reason else job.fault_of_time
    nothing = without_search(problem, longest, chosen.guess, reason, fault)
    if nothing is not None:
        seconds = time.perf_counter() - began
        return with_notes(nothing, [job.scene], job.options, apart, seconds)
    search = planning.search(job, deadline, progress or silent)
    reason = "" if search.ends is None else search.ends.reason
    found = infeasible_at_once(longest, chosen.guess, reason) if reason else search.run(began)
    if isinstance(goal, FrameGoal):
        motion = with_metadata(found.trajectory, **{ASKED_GOAL: goal.to_tables()})
        found = dataclasses.replace(found, trajectory=motion)
    options = search.fine.options.with_changes(guess=guess)
    return with_notes(found, [search.fine.scene], options, apart)


def _says_the_same(job: Job, free: FreeDuration | None, reason: str) -> bool:
    """Whether shorter durations have no motion either: bounds and obstacles may come in time."""
    if free is None or not reason:
        return True
    shorter = job.problem(), job.lasting(free.clock, free.lower).problem()
    return all(findings(each, job.start, job.goal).reason for each in shorter)


def with_notes(
    found: Solution,
    scenes: Sequence[Scene],
    options: PlanOptions,
    apart: Apart,
    setup_seconds: float | None = None,
) -> Solution:
    """The solution with its check, and a message that ends with what was left unsaid.

    scenes: of its segments; what one of them says is said. apart: see `kept_apart`.
    """
    notes = [*_notes(found, scenes, options), *apart.cautions(found)]
    said = [each.sentence for each in notes if each.word in (LEFT_OUT, COLLISION)]
    if found.problem is not None:
        on, turns = found.problem.coordinates, [each.turns for each in found.problem.holds]
        stops = zip(found.problem.goals, [*turns, found.problem.turns], strict=False)
        said += filter(None, (turns_sentence(goal, on, made) for goal, made in stops))
    cautions = notes if found.success else [Caution(STATUS, found.message), *notes]
    setup = found.setup_seconds if setup_seconds is None else setup_seconds
    message = " ".join([found.message, *said])
    if options.keep:
        from hovi.planning.search.kept import saying_what_is_kept

        found = dataclasses.replace(found, trajectory=saying_what_is_kept(found, options))
    found = dataclasses.replace(with_check(found), message=message, setup_seconds=setup)
    return with_cautions_of_motion(found, cautions)


def _notes(found: Solution, scenes: Sequence[Scene], options: PlanOptions) -> Iterator[Caution]:
    """What the scenes and the options leave unsaid or out."""
    weighted, problem = options.weight is not None, found.problem
    of_scenes = [assumptions(scene, found.trajectory, weighted) for scene in scenes]
    for each in of_scenes[0]:
        if all(each in others for others in of_scenes):
            yield Caution(LEFT_OUT, each)
    if isinstance(options.guess, Trajectory) and problem is not None:
        yield from cautions_of_guess(options.guess, problem, found.trajectory)
    looked_for = not options.self_collision and found.status not in UNSEEN
    clearance = None if problem is None else problem.clearance
    carried = frozenset(name for name, *_ in clearance.during) if clearance else frozenset[str]()
    if looked_for and (entered := self_collision_sentence(found.trajectory, carried)):
        yield Caution(COLLISION, entered)
    if problem is None or problem.clearance is None:
        return
    if options.self_collision:
        for each in pairs_left_out(problem.robot, tuple(problem.clearance.may_touch)):
            yield Caution(WARNED, each)
    for link, other, gap in problem.clearance.gaps:
        yield Caution(
            LEFT_OUT,
            f"{link!r} and {other!r} are {gap:.2g} m nearer than the margin at an end, and may be "
            "so all along.",
        )


@dataclass(frozen=True, eq=False)
class Apart:
    """What is not kept apart.

    overlaps: pairs of links that are left out. reason: why no links are, as a sentence.
    """

    overlaps: tuple[HullOverlap, ...] = ()
    reason: str = ""

    def cautions(self, found: Solution) -> Iterator[Caution]:
        """What is said of it after a solution, and of a motion in which such a pair meets."""
        if self.reason:
            yield Caution(LEFT_OUT, self.reason)
        for each in self.overlaps:
            yield Caution(LEFT_OUT, str(each))
            if found.status not in UNSEEN and (met := met_sentence(found.trajectory, each)):
                yield Caution(COLLISION, met)


def ends_of(
    start: State | FrameGoal, goal: State | FrameGoal | None, via: Sequence[Via]
) -> dict[str, State | FrameGoal | None]:
    """The ends of a motion, by what they are in messages."""
    stops = {f"the via point at {each.time:g} s": each.goal for each in via}
    return {"the start": start, **stops, "the goal": goal}


def kept_apart(
    options: PlanOptions, robot: Robot, ends: Mapping[str, State | FrameGoal | None]
) -> tuple[PlanOptions, Apart]:
    """The options with self-collision decided, and what is not kept apart.

    ends: by what they are, such as "the start"; configurations that are given wholly are looked at.
    """
    decided = options.decided(robot)
    if not decided.self_collision:
        return decided, Apart((), not_looked_at(robot) if options.self_collision is None else "")
    whole = {
        name: end.on(robot, name)[0]
        for name, end in ends.items()
        if isinstance(end, State) and not end.free
    }
    overlaps = hull_overlaps(robot, decided.clearance, whole)
    left = decided.leaving_out([each.links for each in overlaps])
    try:
        distances_between(robot, left.clearance)
    except ModelError:  # all pairs are left out
        left = decided.with_changes(self_collision=False)
    return left, Apart(overlaps)


@dataclass(frozen=True, eq=False)
class _Planning:
    """What jobs are made of: see `plan`. duration: of the first solve, in [s]."""

    scene: Scene
    start: State | FrameGoal
    goal: State | FrameGoal
    duration: float
    options: PlanOptions
    free: FreeDuration | None

    def job(
        self, ends: tuple[State, State | FrameGoal], deadline: Deadline, scene: Scene | None = None
    ) -> Job:
        """The job between two ends. scene: with the cost on the jerk, if it is known."""
        T, options = self.duration, self.options
        if scene is None:
            scene = smoothed(self.scene, *ends, T) if options.smooth else self.scene
        grid = grid_of(T, options, scene)
        with deadline.in_force():
            scene.effort_lagrangian(options.weight)  # its functions may have to be compiled
            job = Job(scene, grid, *ends, options)
        job = job.on(job.graded(grid)).with_nodes_where_led_back()
        return split_for_charts(job, options.guess)

    def search(self, job: Job, deadline: Deadline, progress: Progress) -> Search:
        """The search from a job between the nearest ends, or from the best branches of frames.

        With self-collision it begins with the job without.
        """
        ends, options = Ends(job.start, job.goal), self.options
        if FrameGoal in map(type, (self.start, self.goal)):
            given = self.start, self.goal, self.duration
            ends = chosen_ends(self.scene, *given, options, deadline)
            known = job.scene if ends.start is job.start else None
            job = self.job((ends.start, ends.goal), deadline, known)
        without = None
        if options.self_collision:
            loose = dataclasses.replace(self, options=options.with_changes(self_collision=False))
            without = loose.job((job.start, job.goal), deadline, job.scene)
        return Search(job, deadline, progress, self.free, without, ends)


def _time(
    T: float | tuple[float, float], options: PlanOptions
) -> tuple[FreeDuration | None, float]:
    """The bounds of a free duration or None, and the duration of the first solve, in [s].

    What is after the last via point is free.
    """
    if not isinstance(T, tuple):
        if options.time_weight != 0:
            raise InputError("time_weight needs a free duration: give a pair (lower, upper).")
        return None, T
    clock = Clock((max(stops_of(options), default=0.0), 0.0))
    if clock.before >= T[0]:
        raise InputError(
            f"a via point or condition at {clock.before:g} s is not before the least duration, "
            f"{T[0]:g} s: choose an earlier time, or longer durations."
        )
    lower, upper = (bound - clock.before for bound in T)
    free = FreeDuration(lower, upper, options.time_weight, clock)
    return free, clock.duration(free.first)


def _goal(goal: End, robot: Robot, options: PlanOptions) -> State | FrameGoal:
    """The goal, with the turns of the initial guess."""
    state = as_end(goal, robot, "goal")
    if isinstance(state, FrameGoal):
        if options.turns is not None:
            raise InputError("turns need a joint goal: give a State instead of a FrameGoal.")
        return state
    return state if options.turns is None else dataclasses.replace(state, turns=options.turns)


def warn_of_ends(
    robot: Robot, start: State, goal: State | FrameGoal, options: PlanOptions, reason: str = ""
) -> None:
    """Warn if the given configurations, in order of time, or what is grasped look like degrees or
    millimetres.

    reason: why there is no motion, if that is known. If it mentions degrees, no warning does.
    """
    for sentence in grasped_slips(options.grasped):
        warn(sentence)
    stops = sorted(options.via, key=lambda via: via.time)
    given = [start, *(via.goal for via in stops), goal]
    states = [each for each in given if isinstance(each, State)]
    if LOOKS_LIKE_DEGREES not in reason:
        said = says_turns(goal, robot) if isinstance(goal, State) else False
        angles = [np.where(said, state.angles_on(robot), np.nan) for state in states]
        warn_of_degrees(robot, [state.on(robot, "state")[0] for state in states], angles)
