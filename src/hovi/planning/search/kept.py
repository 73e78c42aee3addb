"""What a plan keeps: its conditions, the goal that a way along it leads to, and what files say."""

from __future__ import annotations

import dataclasses

import numpy as np

from hovi.conditions.kept.kinds import KINDS, as_kept
from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.inverse_kinematics import position_bounds
from hovi.planning.problem.kept_conditions import conditions_kept, goal_kept, kept_between
from hovi.planning.refinement.error_estimate import with_metadata
from hovi.planning.search.options import PlanOptions
from hovi.planning.solver.solver import Solution
from hovi.robot.robot import Robot


def with_kept(
    options: PlanOptions,
    robot: Robot,
    start: State | FrameGoal,
    goal: State | FrameGoal,
    duration: float | tuple[float, float],
) -> tuple[PlanOptions, State | FrameGoal]:
    """The options with the conditions of what is kept, and the goal to which a way along it leads.

    Raises InputError as `kept_between` and `conditions_kept` do.
    """
    bounds, longest = position_bounds(robot, options.limits), float(np.max(duration))
    kept = kept_between(as_kept(options.keep), robot, start, goal, longest)
    goal = goal_kept(kept, robot, start, goal, bounds, longest)
    conditions = *options.conditions, *conditions_kept(kept, robot, start, duration)
    return options.with_changes(keep=kept, conditions=conditions), goal


def saying_what_is_kept(found: Solution, options: PlanOptions) -> Trajectory:
    """The motion, whose metadata say what it keeps, with the parts in which it does."""
    asked = () if found.problem is None else found.problem.conditions
    parts = {each.name: each.during for each in asked}
    kept = [
        dataclasses.replace(each, during=parts.get(each.title, each.during)).to_dict()
        for each in as_kept(options.keep)
        if each.kind in KINDS
    ]
    return with_metadata(found.trajectory, keep=kept)
