"""The job of a sequence: its grid, its limits and its goals, put together as one problem."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from itertools import accumulate

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import Grid
from hovi.discrete.state import State
from hovi.errors import InputError, warn
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.seams import Seam
from hovi.planning.refinement.adaptive import MAX_FIRST_INTERVALS, first_grid
from hovi.planning.search.job import Acting, Job, JobSegment, stops_of
from hovi.planning.search.options import PlanOptions
from hovi.planning.sequence.branches import End, MoveToGoal, chosen_branches
from hovi.planning.sequence.segment import Segment, names_of
from hovi.planning.sequence.segment_findings import segment_findings
from hovi.planning.sequence.segment_smoothing import smoothed_segments
from hovi.scene.scene import Scene
from hovi.schemes import of_order

Array = npt.NDArray[np.float64]

LEAST_INTERVALS, LEAST_WITH_DISTANCES = 8, 4
"""Least number of intervals of a segment on the first grid of a refinement, and where distances are
kept, which takes more intervals where the robot moves."""


def job_of(
    scene: Scene,
    start: End,
    goals: Sequence[End | None],
    segments: Sequence[Segment],
    options: PlanOptions,
) -> Job:
    """The sequence as one job, with branches for goals of frames.

    goals: of the segments, two or more. options: resolved for the scene's robot.
    Raises InputError, SceneError or UnreachableError for what defines no sequence.
    """
    ends = tuple(accumulate(each.seconds for each in segments))
    job_segments = tuple(
        JobSegment(end / ends[-1], Acting(tuple(each.effects)))
        for each, end in zip(segments, ends, strict=True)
    )
    limits = limits_of(scene, segments, options)
    if any(each.grasped for each in segments):
        from hovi.planning.sequence.carried import parts_of_carried  # most carry nothing

        options = options.carrying(parts_of_carried(segments, ends))
    grid = sequence_grid(segments, options, scene.order)
    first = Job(scene, grid, State(()), State(()), options, job_segments)
    moves = _moves(goals, ends, limits, names_of(segments))
    begin = MoveToGoal((), 0.0, 0.0, start, (limits[0].lower[0], limits[0].upper[0]))
    known, reached = chosen_branches(
        scene.robot, first.lagrangian(), begin, moves, options.clearance
    )
    if options.keep or any(each.keep for each in segments):
        from hovi.planning.sequence.kept_segments import kept_in_segments  # most keep nothing

        kept = kept_in_segments(scene.robot, options.keep, segments, known, moves, reached)
        asked, reached = (*options.conditions, *kept.conditions), list(kept.goals)
        options = options.with_changes(keep=kept.kept, conditions=asked)
    moves = [
        dataclasses.replace(move, goal=goal) for move, goal in zip(moves, reached, strict=True)
    ]
    if options.smooth:
        scene, job_segments = smoothed_segments(scene, known, moves, segments, job_segments)
        grid = sequence_grid(segments, options, scene.order)
    job = Job(scene, grid, known, reached[-1], options, job_segments)
    found = segment_findings(job, moves, limits, names_of(segments))
    for sentence in found.warnings:
        warn(sentence)
    seams = [Seam(move.end, move.goal, unreachable=found.reason) for move in moves[:-1]]
    if any(each.limits is not None for each in segments):
        job = job.with_options(limits=Limits.of_segments(limits, ends[:-1]))
    job = job.with_options(via=(*seams, *options.via))
    if stops_of(options):
        job = job.on(grid.with_nodes(job.node_times, options.intervals is None))
    return job.on(job.graded(job.grid)).with_nodes_where_led_back()


def limits_of(
    scene: Scene, segments: Sequence[Segment], options: PlanOptions
) -> tuple[Limits, ...]:
    """The limits of every segment. Raises InputError for the torque rate, which jumps.

    Those on the power of the whole hold in segments with limits of their own, too.
    """
    found, whole = list[Limits](), options.limits_on(scene, options.limits)
    for name, each in zip(names_of(segments), segments, strict=True):
        given = options.limits if each.limits is None else each.limits
        found.append(options.limits_on(scene, given).with_conditions_of(whole))
        if found[-1].on_torque_rate:
            raise InputError(
                f"{name!r} has limits on the torque rate, but torques jump where the segments of a "
                "sequence meet: leave them out, or set torque_rate = 1e16 to have none where an "
                "arm's own limits have them."
            )
    return tuple(found)


def sequence_grid(segments: Sequence[Segment], options: PlanOptions, order: int) -> Grid:
    """The requested grid, or the first of a refinement, with nodes where the segments meet.

    Intervals are of nearly equal length, but every segment has one, or LEAST_INTERVALS where the
    grid is not given.
    """
    durations = np.array([each.seconds for each in segments])
    total, least = options.interval_count, 1
    if options.tolerance is not None:
        least = LEAST_INTERVALS
        if options.clearance.wanted:  # the longest has what it would have alone, for its rows
            least, total = LEAST_WITH_DISTANCES, round(total * durations.sum() / durations.max())
        total = min(total, MAX_FIRST_INTERVALS)
    elif total < len(segments):
        raise InputError(
            f"{total} intervals are too few for {len(segments)} segments: use one for each or more."
        )
    numbers = _distributed(max(total, least * len(segments)), durations, least)
    if options.tolerance is not None:
        grids = [
            first_grid(T, int(N), smooth=False, order=order)
            for T, N in zip(durations, numbers, strict=True)
        ]
    else:
        scheme = of_order(options.table, order)
        grids = [Grid.uniform(T, int(N), scheme) for T, N in zip(durations, numbers, strict=True)]
    return Grid.joined(grids)


def _distributed(total: int, weights: Array, least: int) -> npt.NDArray[np.intp]:
    """Whole numbers that sum to a total, `least` or more, nearly in proportion to weights.

    total: as large as can be distributed.
    """
    numbers = np.maximum(np.floor(total * weights / weights.sum()).astype(np.intp), least)
    while numbers.sum() > total:
        reducible = numbers > least
        numbers[np.argmax(np.where(reducible, numbers / weights, -np.inf))] -= 1
    while numbers.sum() < total:
        numbers[np.argmax(weights / numbers)] += 1
    return np.asarray(numbers)


def _moves(
    goals: Sequence[End | None],
    ends: Sequence[float],
    limits: Sequence[Limits],
    names: Sequence[str],
) -> list[MoveToGoal]:
    """From goal to goal; a goal has to be within the limits of the segments before and after it."""
    moves: list[MoveToGoal] = []
    first, begin = 0, 0.0
    for i, (goal, end) in enumerate(zip(goals, ends, strict=True)):
        if goal is None:
            continue
        both = limits[i : i + 2]
        lower = np.max([each.lower[0] for each in both], axis=0)
        upper = np.min([each.upper[0] for each in both], axis=0)
        numbers = tuple(range(first, i + 1))
        moves.append(MoveToGoal(numbers, begin, end, goal, (lower, upper), names[i]))
        first, begin = i + 1, end
    return moves
