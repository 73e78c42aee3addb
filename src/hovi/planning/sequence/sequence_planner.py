"""plan_sequence: several motions, one after the other, as one optimisation on one time axis."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, ParamSpec, Protocol, cast

from hovi.checks.arguments import check_arguments_except
from hovi.discrete.measures.motion_segments import SEGMENT_NAMES, motion_segments
from hovi.errors import InputError, expect
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.notation.ends import End as Start
from hovi.planning.problem.notation.ends import as_start
from hovi.planning.refinement.faults.cautions import keeping_warnings
from hovi.planning.search.free_segments import FreeSegments
from hovi.planning.search.group import in_group, with_others
from hovi.planning.search.job import Acting, Job
from hovi.planning.search.option_fields import spell_out
from hovi.planning.search.options import PlanOptions
from hovi.planning.search.planner import (
    ends_of,
    kept_apart,
    plan,
    warn_of_ends,
    with_notes,
)
from hovi.planning.search.search import Search
from hovi.planning.sequence.branches import End
from hovi.planning.sequence.segment import (
    Segment,
    Table,
    checked_segments,
    durations_of,
    goals_of,
    names_of,
    with_durations,
)
from hovi.planning.sequence.sequence_job import job_of
from hovi.planning.solver.iterates import Cancel, OnIterate, watched
from hovi.planning.solver.outcome.without_solve import unresolved_at_once
from hovi.planning.solver.solver import Solution
from hovi.planning.solver.status import STOPPED
from hovi.scene.scene import Scene
from hovi.system.blas_threads import one_blas_thread
from hovi.system.deadline import Deadline
from hovi.system.interruption import interruptible
from hovi.system.progress import Progress, shows_progress, silent

Keywords = ParamSpec("Keywords")


class _PlanSequence(Protocol[Keywords]):
    """`plan_sequence` as type checkers see it: with the keywords of PlanOptions."""

    def __call__(
        self,
        scene: Scene,
        start: Start,
        segments: Sequence[Table],
        progress: Progress | None = None,
        options: PlanOptions | None = None,
        on_iterate: OnIterate | None = None,
        cancel: Cancel | None = None,
        *_: Keywords.args,
        **changes: Keywords.kwargs,
    ) -> Solution:
        """As `plan_sequence`."""
        ...


def _with_option_keywords(
    options: Callable[Keywords, PlanOptions],
) -> Callable[[Callable[..., Solution]], _PlanSequence[Keywords]]:
    """A decorator that makes the options keywords of the function, for help and type checkers."""

    def taking(function: Callable[..., Solution]) -> _PlanSequence[Keywords]:
        spell_out(function, PlanOptions)
        return cast(_PlanSequence[Keywords], function)

    return taking


@_with_option_keywords(PlanOptions)
@check_arguments_except("scene", "start", "segments", "options")
@one_blas_thread
@interruptible
@shows_progress
@keeping_warnings
def plan_sequence(
    scene: Scene,
    start: Start,
    segments: Sequence[Table],
    progress: Progress | None = None,
    options: PlanOptions | None = None,
    on_iterate: OnIterate | None = None,
    cancel: Cancel | None = None,
    **changes: Any,
) -> Solution:
    """Motions one after the other, such as move, grasp, move, release, of least cost together.

    The sum of the segments' costs is minimised on one time axis. q and v are continuous where
    segments meet, and torques jump there if what acts changes: `Trajectory.sample` returns those of
    the later segment. There are no impacts: what is grasped is at rest, or moves along.
    Where goals are targets of frames, the branches of inverse kinematics are chosen for all of
    them together, by the cost of the cubics between them.

    scene: the robot with the effects that act all the time.
    start: as for `plan`.
    segments: hovi.Segment(goal, duration, effects=..., grasped=..., name=...), or tables as in a
        scene file, {"goal": {"q": ...}, "duration": "1 s", ...}, in order of time; the last one
        needs a goal.
    progress, on_iterate, cancel: as for `plan`.
    options: a PlanOptions; the following keywords override it. The `intervals` are those of all
        segments together, and the times of `via` count from the start of the first.
    {options}
    Raises InputError, ModelError, SceneError or SchemeError for invalid input, UnreachableError for
    a start that no configuration reaches, CancelledError if it is cancelled before it has a motion.
    """
    began = time.perf_counter()
    if not isinstance(scene, Scene):
        raise InputError(
            f"plan_sequence takes a hovi.Scene, such as hovi.Scene(robot, [...]), got {scene!r}."
        )
    chosen = PlanOptions() if options is None else options
    expect(chosen, PlanOptions, "hovi.PlanOptions(...), or its fields by keyword")
    chosen = chosen.with_changes(**changes)
    with watched(on_iterate, cancel):
        return _of_segments(scene, start, segments, progress, chosen, began)


def _of_segments(
    scene: Scene,
    start: Start,
    segments: Sequence[Table],
    progress: Progress | None,
    chosen: PlanOptions,
    began: float,
) -> Solution:
    """The motion in segments. began: when the plan did, by the clock."""
    checked = checked_segments(segments, chosen)
    if len(checked) == 1:
        return _alone(scene, start, checked[0], progress, chosen)
    if chosen.objective == "time":
        raise InputError(
            'objective = "time" is for a single motion: for the segments of a sequence, give them '
            "free durations and a large time_weight."
        )
    scene = chosen.holding(scene)
    if any(each.grasped for each in checked):
        scene, checked, chosen = _carrying(scene, checked, chosen)
    scene, begin, goals = _in_group(scene, start, checked, chosen)
    if chosen.repeat > 1:
        from hovi.planning.search.repetition import goal_of_cycle  # most sequences run once

        goals = (*goals[:-1], goal_of_cycle(begin, goals[-1], scene.robot))
    scene = chosen.aiming(scene)
    deadline = Deadline(chosen.time_limit_seconds)
    names = (f"the goal of {name!r}" for name in names_of(checked))
    stops = ends_of(begin, None, chosen.via) | dict(zip(names, goals, strict=True))
    chosen, apart = kept_apart(chosen.on(scene), scene.robot, stops)
    free = FreeSegments.of(durations_of(checked), chosen.time_weight)
    planned = partial(_planned, scene, begin, goals, checked, chosen, deadline, progress or silent)
    found, job = planned(free, free.first[0], began)
    for durations in free.first[1:]:
        done = found.success and (chosen.starts == 1 or deadline.passed)
        if done or found.status in STOPPED:
            break
        other, its_job = planned(free, durations, began)
        steps = found.nit + other.nit
        if not found.success or (other.success and other.cost < found.cost):
            found, job = other, its_job
        found = dataclasses.replace(found, nit=steps)
    if any(isinstance(goal, FrameGoal) and goal.regional for goal in goals):
        found = _settled(found, scene, goals, checked, chosen, deadline, progress or silent, free)
    scenes = [each.acting.on(job.scene) for each in job.segments]
    cycle = _named(with_notes(found, scenes, job.options, apart), checked)
    if chosen.repeat == 1:
        return cycle
    from hovi.planning.search.repetition import repeated

    return repeated(cycle, chosen.repeat)


def _settled(
    found: Solution,
    scene: Scene,
    goals: Sequence[End | None],
    segments: Sequence[Segment],
    options: PlanOptions,
    deadline: Deadline,
    progress: Progress,
    free: FreeSegments,
) -> Solution:
    """The motion with the bounds of the regions of its goals settled. found: without."""
    from hovi.planning.search.settled_regions import settled  # most goals are exact

    def again(chosen: Sequence[FrameGoal], last: Solution) -> Solution:
        assert last.problem is not None
        left = iter(chosen)
        new = [next(left) if isinstance(x, FrameGoal) and x.regional else x for x in goals]
        times = [each.end - each.begin for each in motion_segments(last.trajectory)]
        known = scene, last.problem.start, new, segments, options, deadline, progress, free
        return _planned(*known, times, time.perf_counter())[0]

    return settled(found, again, deadline)


def _planned(
    scene: Scene,
    start: End,
    goals: Sequence[End | None],
    segments: Sequence[Segment],
    options: PlanOptions,
    deadline: Deadline,
    progress: Progress,
    free: FreeSegments,
    durations: Sequence[float],
    began: float,
) -> tuple[Solution, Job]:
    """The motion in several segments from given durations on, and its job."""
    job = job_of(scene, start, goals, with_durations(segments, durations), options)
    problem = job.problem()  # raises for invalid input before the search
    if options.repeat > 1:
        from hovi.planning.search.repetition import require_alike

        require_alike(problem)
    warn_of_ends(scene.robot, job.start, job.goal, job.options)
    without = job.with_options(self_collision=False) if options.self_collision else None
    if fault := job.fault_of_time:
        return unresolved_at_once(job.problem(), job.options.guess, fault), job
    return Search(job, deadline, progress, None, without, None, free).run(began), job


def _alone(
    scene: Scene,
    start: Start,
    segment: Segment,
    progress: Progress | None,
    options: PlanOptions,
) -> Solution:
    """The motion of a single segment."""
    acting = Acting(tuple(segment.effects)).on(scene)
    if segment.limits is not None:
        whole = options.limits_on(acting, options.limits)
        own = options.limits_on(acting, segment.limits)
        options = options.with_changes(limits=own.with_conditions_of(whole))
    assert segment.goal is not None
    if segment.grasped:
        options = options.with_changes(grasped=(*options.grasped, *segment.grasped))
    if segment.keep:
        options = options.with_changes(keep=(*options.keep, *segment.keep))
    return plan(acting, start, segment.goal, segment.duration, progress, options)


def _carrying(
    scene: Scene, segments: Sequence[Segment], options: PlanOptions
) -> tuple[Scene, tuple[Segment, ...], PlanOptions]:
    """The scene, the segments and the options with what segments carry."""
    from hovi.planning.sequence.carried import carried_objects, scene_carrying, with_payloads

    objects = carried_objects(segments)
    options = options.with_changes(grasped=(*options.grasped, *objects))
    scene = scene_carrying(scene, segments)
    return scene, with_payloads(scene, segments), options


def _in_group(
    scene: Scene, start: Start, segments: Sequence[Segment], options: PlanOptions
) -> tuple[Scene, End, tuple[End | None, ...]]:
    """The scene, the start and the goals, of the chosen group of joints if there is one."""
    begin = as_start(start, scene.robot)
    whole = [
        dataclasses.replace(each, goal=with_others(each.goal, options.group, scene.robot, begin))
        for each in segments
    ]
    goals = goals_of(whole, scene.robot)
    if options.group is None:
        return scene, begin, goals
    small, first = scene, begin
    found: list[End | None] = []
    for goal in goals:
        if goal is not None:
            small, first, goal = in_group(scene, options.group, begin, goal)
        found.append(goal)
    return small, first, tuple(found)


def _named(solution: Solution, segments: Sequence[Segment]) -> Solution:
    """The solution with the names of the segments in its motion."""
    motion = solution.trajectory
    metadata = {**motion.metadata, SEGMENT_NAMES: list(names_of(segments))}
    return dataclasses.replace(solution, trajectory=dataclasses.replace(motion, metadata=metadata))
