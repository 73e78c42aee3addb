"""Whether a task-space goal places the link of its frame in an obstacle.

Without a rotation the link may still turn about the frame's origin, and the triangle inequality
gives an upper bound,

    d(link, obstacle) <= d(origin, obstacle) + d(origin, link),

with signed distances, negative inside a shape.
"""

from __future__ import annotations

import coal
import numpy as np
import pinocchio as pin

from hovi.planning.clearance.clearance_violation import less_than_margin
from hovi.planning.clearance.distances import Distances, Pair
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.robot.model import frame_named

POINT = coal.Sphere(0.0)


def goal_distances(goal: FrameGoal, distances: Distances) -> dict[Pair, float]:
    """Upper bounds of the distances of the goal's link from obstacles, in [m], by pair.

    Of its own frame: exact for a pose, a bound for a position, none for others and for regions.
    """
    if goal.position is None or goal.bounds:
        return {}
    frame = frame_named(distances.robot.model, goal.frame)
    at = np.asarray(goal.position, dtype=float)
    objects, found = distances.geometry.geometryObjects, dict[Pair, float]()
    known = zip(distances.pairs, distances.ends, distances.parts, strict=True)
    for pair, (first, second), part in known:
        shape, obstacle = objects[first], objects[second]
        if part is not None or not pair.obstacle or pair.touching or second in distances.moving:
            continue
        if shape.parentJoint != frame.parentJoint:
            continue
        if goal.rotation is not None:
            placed = pin.SE3(np.asarray(goal.rotation), at) * frame.placement.inverse()
            d = _distance(shape.geometry, placed * shape.placement, obstacle)
        else:
            origin = pin.SE3(np.eye(3), frame.placement.translation)
            here = pin.SE3(np.eye(3), at)
            d = _distance(POINT, here, obstacle) + _distance(POINT, origin, shape)
        found[pair] = min(d, found.get(pair, np.inf))
    return found


def goal_in_obstacle(goal: FrameGoal, name: str, distances: Distances, margin: float) -> str:
    """The obstacle to which the goal's link violates the margin, as a sentence without its end.

    "" if there is none. name: of the goal in messages. margin: in [m].
    """
    found_of = (_own_frame_in_obstacle(x, name, distances, margin) for x in goal.parts)
    return next(filter(None, found_of), "")


def _own_frame_in_obstacle(goal: FrameGoal, name: str, distances: Distances, margin: float) -> str:
    """As `goal_in_obstacle`, of the goal's own frame."""
    found = goal_distances(goal, distances)
    if not found or min(found.values()) >= margin:
        return ""
    pair = min(found, key=lambda each: found[each])
    words = less_than_margin(found[pair], margin)
    least = "" if goal.rotation is not None else " or come closer"
    apart = words.replace(" apart", f" apart{least}", 1) if " apart" in words else words + least
    return (
        f"with frame {goal.frame!r} at the {name}, {pair} {apart}; change the {name} or move the "
        "obstacle"
    )


def _distance(
    shape: coal.CollisionGeometry, placement: pin.SE3, other: pin.GeometryObject
) -> float:
    """Signed distance of a shape from a geometry object, in [m]."""
    first = coal.Transform3s(placement.rotation, placement.translation)
    second = coal.Transform3s(other.placement.rotation, other.placement.translation)
    result = coal.DistanceResult()
    coal.distance(shape, first, other.geometry, second, coal.DistanceRequest(), result)
    return float(result.min_distance)
