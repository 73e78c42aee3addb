"""Why a frame probably misses its goal: other units of length, or more equations than joints."""

from __future__ import annotations

import math

import numpy as np

from hovi.planning.problem.frame_goal import FrameGoal
from hovi.robot.robot import Robot
from hovi.robot.tip_frame import moves_frame

MILLIMETRE = 1e-3
"""A millimetre, in [m]."""
CENTIMETRE = 1e-2
"""A centimetre, in [m]."""
NEAR_BASE = 0.05
"""Fraction of the reach below which a goal is unlikely, as it is in the base: ten times as far, in
centimetres, it is still within half of the reach."""
FAR = 20.0
"""Distance from which a length may have been meant in millimetres, in [m]."""


def reach_of(robot: Robot) -> float:
    """Upper bound of the distance of any joint from the world's origin, in [m].

    Infinite for a floating base and for joints that slide without limits.
    """
    model, far = robot.model, [0.0]
    for i in range(1, model.njoints):
        joint = model.joints[i]
        slide = 0.0
        for k in range(joint.nv):
            if robot.coordinate_units[joint.idx_v + k].q == "m":
                ends = (robot.lower[joint.idx_q + k], robot.upper[joint.idx_q + k])
                slide += float(np.abs(ends).max()) if joint.nq == joint.nv else np.inf
        placement = float(np.linalg.norm(model.jointPlacements[i].translation))
        far.append(far[model.parents[i]] + placement + slide)
    return max(far)


def hint_on_frame(robot: Robot, goal: FrameGoal) -> str:
    """The likely reason why no configuration reaches a goal, as a clause; "" for none."""
    return next(filter(None, (_hint_on_one(robot, each) for each in goal.parts)), "")


def _hint_on_one(robot: Robot, goal: FrameGoal) -> str:
    """That of the goal's own frame."""
    if goal.position is not None:
        position = np.asarray(goal.position)
        unit, metres = _likely_unit(math.hypot(*position), reach_of(robot))
        if unit:
            return (
                f"its position {_shown(position)} m looks like {unit}, which are "
                f"{_shown(metres * position)} m"
            )
    joints = int(moves_frame(robot.model, goal.frame).sum())
    equations = goal.equations - sum(each.equations for each in goal.also)
    if equations > joints:
        return (
            f"it prescribes {equations} coordinates of frame {goal.frame!r}, which only "
            f"{joints} joint coordinate{'s' * (joints > 1)} move{'s' * (joints == 1)}: prescribe a "
            "position or an axis alone, or leave the goal's joints to a State"
        )
    return ""


def _likely_unit(away: float, reach: float) -> tuple[str, float]:
    """The unit in which a position was probably meant, and its length in [m]; "" if in metres.

    away, reach: distances from the world's origin, of the position in its unit and of joints.
    """
    if away <= max(FAR, 2 * reach):
        return "", 1.0
    if MILLIMETRE * away < NEAR_BASE * reach:
        return "centimetres", CENTIMETRE
    if MILLIMETRE * away <= 2 * reach:
        return "millimetres", MILLIMETRE
    return "", 1.0


def _shown(values: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> str:
    return f"({', '.join(f'{each:.4g}' for each in values)})"
