"""Guesses that pass through the places that frames are to reach on the way."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import Grid
from hovi.discrete.guess import Curve, moved_by
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.goals import Via, goal_state
from hovi.planning.problem.limits import Limits
from hovi.planning.problem.seams import Seam
from hovi.robot.space.coordinates import Coordinates

Array = npt.NDArray[np.float64]


def through_frames(
    curve: Curve, via: Sequence[Via], on: Coordinates, limits: Limits | None, grid: Grid
) -> Curve:
    """A curve plus a spline to near configurations in which frames are where they are to be.

    A straight way may pass by with a hand turned half around, from where no step turns it back. The
    cubic spline is at rest at both ends, and zero at seams and where no configuration is found.

    curve: q, v, a, up to the jerk on vector spaces. grid: whose nodes are at the via points.
    """
    none = np.zeros(on.nv)
    moved = {0.0: none, grid.duration: none}
    for each in via:
        time = float(grid.t[grid.node_at(each.time)])
        moved[time] = none
        if isinstance(each.goal, FrameGoal) and not isinstance(each, Seam):
            near = curve(np.array([time]))[0][0]
            bounds = None if limits is None else limits.until(each.time)
            reached = goal_state(each.goal, "via point", on, near, bounds)
            if not reached.reason:
                moved[time] = on.difference(near, reached.state.on(on, "via")[0])
    times = sorted(moved)
    if not any(moved[t].any() for t in times):
        return curve
    from scipy.interpolate import CubicSpline  # slow to import, and most motions pass no frames

    spline = CubicSpline(times, [moved[t] for t in times], bc_type="clamped")

    return lambda t: moved_by(on, curve(t), *(spline(t, order) for order in range(4)))
