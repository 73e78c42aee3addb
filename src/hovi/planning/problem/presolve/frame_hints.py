"""Why a frame probably misses its goal: millimetres for metres, or more equations than joints."""

from __future__ import annotations

import numpy as np

from hovi.planning.problem.frame_goal import FrameGoal
from hovi.robot.robot import Robot
from hovi.robot.tip_frame import moves_frame

MILLIMETRE = 1e-3
"""A millimetre, in [m]."""
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
    """The likely reason why no configuration meets a goal, as a clause; "" for none."""
    if goal.position is not None:
        position = np.asarray(goal.position)
        in_metres = MILLIMETRE * position
        away, reach = float(np.linalg.norm(position)), reach_of(robot)
        if away > max(FAR, 2 * reach) and np.linalg.norm(in_metres) <= 2 * reach:
            return (
                f"its position {_shown(position)} m looks like millimetres, which are "
                f"{_shown(in_metres)} m"
            )
    joints = int(moves_frame(robot.model, goal.frame).sum())
    if goal.equations > joints:
        return (
            f"it prescribes {goal.equations} coordinates of frame {goal.frame!r}, which only "
            f"{joints} joint coordinate{'s' * (joints > 1)} move{'s' * (joints == 1)}: prescribe a "
            "position or an axis alone, or leave the goal's joints to a State"
        )
    return ""


def _shown(values: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> str:
    return f"({', '.join(f'{each:.4g}' for each in values)})"
