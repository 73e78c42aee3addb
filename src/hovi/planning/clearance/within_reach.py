"""Obstacles that a robot whose joints all turn can never come near."""

from __future__ import annotations

import dataclasses
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from hovi.planning.clearance.clearance import MOST_GAP, Clearance
from hovi.planning.clearance.convex_shapes import convex_geometry
from hovi.planning.clearance.distances import Distances, distances_between
from hovi.planning.obstacles.obstacle import Body, Obstacle
from hovi.robot.robot import Robot
from hovi.robot.space.joint_kinds import kind_of

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

NEVER_NEAR = 0.5
"""Distance beyond the margin, in [m], at which rows are constant, and obstacles are left out."""
ROUNDING = 1e-9
"""By which a pair may be nearer than it is at an end, in [m]."""
ROTARY = "revolute", "continuous", "spherical"
"""Kinds of joints that turn about a point of the link before."""


@lru_cache(maxsize=16)
def distances_within_reach(robot: Robot, clearance: Clearance) -> Distances | None:
    """The distances that a clearance bounds, without obstacles that are never near; None for none.

    Raises as Distances does.
    """
    if not clearance.wanted:
        return None
    every = distances_between(robot, clearance)
    reach = reach_of(robot) + float(clearance.margin) + NEVER_NEAR
    if not np.isfinite(reach):
        return every
    far = {each.name for each in clearance.obstacles if _distance_from_origin(each) > reach}
    kept = [k for k, pair in enumerate(every.pairs) if not (pair.obstacle and pair.other in far)]
    if len(kept) == len(every.pairs):
        return every
    return every.restricted(kept) if kept else None


def with_gaps(
    robot: Robot,
    clearance: Clearance,
    q: Array,
    free: Mask,
    duration: float,
) -> Clearance:
    """The clearance, by which pairs may be as near as they are at an end, up to MOST_GAP.

    An end that is measured, or computed by another program, at the margin is not exactly there.
    q: at both ends, (2, nq). free: which components of (q, v, ...) are free there, (2, k, nv).
    duration: T, in [s].
    Raises as Distances does.
    """
    distances, margin = distances_within_reach(robot, clearance), float(clearance.margin)
    if distances is None:
        return clearance
    found = dict[tuple[str, str], float]()
    touching = np.array([pair.touching for pair in distances.pairs])
    known = np.where(touching, 0.0, distances.allowance)  # the gaps of the clearance itself
    for i in (0, 1) if margin > MOST_GAP else ():
        if free[i, 0].any():
            continue
        at = distances.at(q[i : i + 1], i * duration)
        d = distances.values(at, margin + float(known.max(initial=0.0)))[0] - known
        for k in np.flatnonzero((d < margin) & (d >= margin - MOST_GAP)):
            pair = distances.pairs[k].link, distances.pairs[k].other
            found[pair] = max(found.get(pair, 0.0), margin - float(d[k]) + ROUNDING)
    gaps = tuple((*pair, gap) for pair, gap in found.items())
    if gaps == tuple(clearance.gaps):
        return clearance
    return dataclasses.replace(clearance, gaps=gaps)


@lru_cache(maxsize=16)
def reach_of(robot: Robot) -> float:
    """Upper bound of the distance of any point of a link from the world's origin, in [m].

    The sum of the lengths between joints that turn, plus the size of the shapes; infinite where
    another joint moves a shape.
    """
    model = robot.model
    reach = [0.0]
    for j in range(1, model.njoints):
        rotary = kind_of(model.joints[j]).label in ROTARY
        length = float(np.linalg.norm(model.jointPlacements[j].translation))
        reach.append(reach[model.parents[j]] + length if rotary else np.inf)
    bounds = [0.0]
    for shape in convex_geometry(robot).geometryObjects:
        if shape.parentJoint != 0:
            center, radius = ball_of(Body(shape.geometry, shape.placement))
            bounds.append(reach[shape.parentJoint] + float(np.linalg.norm(center)) + radius)
    return max(bounds)


def _distance_from_origin(obstacle: Obstacle) -> float:
    """Lower bound of an obstacle's distance from the world's origin; 0 if it moves."""
    if obstacle.motion is not None:
        return 0.0
    balls = map(ball_of, obstacle.bodies())
    return min(float(np.linalg.norm(center)) - radius for center, radius in balls)


def ball_of(body: Body) -> tuple[Array, float]:
    """Center and radius of a ball that contains a body, in [m]."""
    body.shape.computeLocalAABB()
    center = body.placement.act(np.asarray(body.shape.aabb_center))
    radius = float(body.shape.aabb_radius)
    return center, radius if np.isfinite(center).all() and np.isfinite(radius) else np.inf
