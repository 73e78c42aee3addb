"""Lengths that look like millimetres, and angles of obstacles that look like degrees: warnings.

All of them may be meant, so that nothing is refused: what is far beyond a robot changes nothing.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import coal
import numpy as np
import numpy.typing as npt

from hovi.planning.clearance.clearance import Clearance
from hovi.planning.obstacles.obstacle import Body, Obstacle
from hovi.planning.problem.presolve.frame_hints import FAR, MILLIMETRE, reach_of
from hovi.robot.space.angle_ranges import rpy_in_degrees
from hovi.scene.scene import Scene

if TYPE_CHECKING:
    from hovi.effects import Payload
    from hovi.planning.obstacles.grasped import Grasped

Array = npt.NDArray[np.float64]

MANY_REACHES = 10.0
"""Ratio to the robot's reach from which the distance of an obstacle is suspicious."""
WIDE_MARGIN = 1.0
"""Margin from which it may have been meant in millimetres, in [m]."""
LONG_SLIDE = 50.0
"""Displacement of a sliding joint from which it may have been meant in millimetres, in [m]."""
HUGE, THICK = 50.0, 2.0
"""Length and thickness of an obstacle, in [m], from which both may have been meant in millimetres:
floors and walls are thinner."""
FAR_CENTER = 5.0
"""Distance of a payload's center from its frame, and size of what a gripper holds, from which they
may have been meant in millimetres, in [m]."""


def length_slips(scene: Scene, clearance: Clearance, q: Sequence[Array]) -> Iterator[str]:
    """Sentences about lengths that look like millimetres.

    q: successive configurations of the motion, each of shape (nq,).
    """
    reach = reach_of(scene.robot)
    for obstacle in clearance.obstacles:
        yield from _obstacle_slips(obstacle, reach)
    if clearance.wanted and clearance.margin >= WIDE_MARGIN:
        yield (
            f"the margin of {clearance.margin:g} m looks like millimetres: {clearance.margin:g} mm "
            f"are {MILLIMETRE * clearance.margin:g} m."
        )
    yield from _long_slides(scene, q)
    yield from _far_payloads(scene)


def payloads_of(scene: Scene) -> list[Payload]:
    """The payloads of a scene, whose module is loaded with the first one."""
    if not any(effect.key == "payload" for effect in scene.effects):
        return []
    from hovi.effects import Payload

    return [effect for effect in scene.effects if isinstance(effect, Payload)]


def _far_payloads(scene: Scene) -> Iterator[str]:
    for payload in payloads_of(scene):
        if np.linalg.norm(payload.center) > FAR_CENTER:
            shown = ", ".join(f"{x:g}" for x in payload.center)
            yield (
                f"the payload's center ({shown}) m is far from frame {payload.frame!r}: lengths "
                "are in metres."
            )


def _obstacle_slips(obstacle: Obstacle, reach: float) -> Iterator[str]:
    from hovi.planning.obstacles.primitives import HalfSpace  # loaded with the first obstacle

    nearest = _distance_from_origin(obstacle)
    if nearest > max(FAR, MANY_REACHES * reach):
        yield (
            f"obstacle {obstacle.name!r} is {nearest:.4g} m away from the robot's base, which "
            f"reaches about {reach:.2g} m: lengths are in metres."
        )
    elif not isinstance(obstacle, HalfSpace):
        size = _size(obstacle.bodies())
        if size.max() > HUGE and size.min() > THICK:
            yield f"obstacle {obstacle.name!r} measures {_measures(size)}: lengths are in metres."
    turned = getattr(obstacle, "rpy", None)
    note = "" if turned is None else rpy_in_degrees(np.asarray(turned, dtype=float))
    if note:
        yield f"obstacle {obstacle.name!r}: {note}."


def grasped_slips(grasped: Sequence[Grasped]) -> Iterator[str]:
    """Sentences about what is grasped: lengths in millimetres, angles in degrees."""
    for each in grasped:
        size = max((_size(shape.bodies()) for shape in each.shapes), key=np.max)
        if size.max() > FAR_CENTER:
            yield f"grasped object {each.name!r} measures {_measures(size)}: lengths are in metres."
        if np.linalg.norm(each.position) > FAR_CENTER:
            shown = ", ".join(f"{x:g}" for x in np.asarray(each.position))
            yield (
                f"the position ({shown}) m of grasped object {each.name!r} is far from link "
                f"{each.frame!r}: lengths are in metres."
            )
        note = rpy_in_degrees(np.asarray(each.rpy, dtype=float))
        if note:
            yield f"grasped object {each.name!r}: {note}."


def _size(bodies: Sequence[Body]) -> Array:
    """The edges of the boxes around bodies along their own axes, the largest of each, (3,)."""
    edges = []
    for body in bodies:
        body.shape.computeLocalAABB()
        edges.append(np.sort(np.asarray(body.shape.aabb_local.max_ - body.shape.aabb_local.min_)))
    return np.asarray(np.max(edges, axis=0))


def _measures(size: Array) -> str:
    """The size of something in metres, in a sentence that says what the same are in millimetres."""
    metres, millimetres = (
        " x ".join(f"{x:.4g}" for x in np.sort(each)[::-1]) for each in (size, MILLIMETRE * size)
    )
    return f"{metres} m, which looks like millimetres, {millimetres} m"


def _distance_from_origin(obstacle: Obstacle) -> float:
    """Signed distance of an obstacle from the world's origin, in [m]; 0 if it is near.

    Of one that moves, the least distance of its path's positions.
    """
    if obstacle.motion is not None:
        return float(np.linalg.norm(np.asarray(obstacle.motion.positions), axis=1).min())
    bodies = obstacle.bodies()
    endless = any(isinstance(body.shape, coal.Halfspace | coal.Plane) for body in bodies)
    near = any(np.linalg.norm(body.placement.translation) <= FAR for body in bodies)
    if endless or near or not bodies:
        return 0.0
    return min(_distance(body) for body in bodies)


def _distance(body: Body) -> float:
    """Signed distance of a body from the world's origin, in [m]."""
    placement, here = body.placement, coal.Transform3s.Identity()
    there = coal.Transform3s(placement.rotation, placement.translation)
    result = coal.DistanceResult()
    shapes = (coal.Sphere(0.0), here, body.shape, there)
    coal.distance(*shapes, coal.DistanceRequest(), result)
    return float(result.min_distance)


def _long_slides(scene: Scene, q: Sequence[Array]) -> Iterator[str]:
    robot = scene.robot
    index, coordinates = robot.space.plain
    slides = np.flatnonzero(robot.sliding[coordinates])
    values = np.stack(q)[:, index]
    moved = np.abs(np.diff(values, axis=0)).max(axis=0, initial=0.0)
    for i in slides[moved[slides] > LONG_SLIDE]:
        yield (
            f"{robot.coordinate_names[coordinates[i]]} moves by {moved[i]:.4g} m, which looks like "
            f"millimetres: {moved[i]:.4g} mm are {MILLIMETRE * moved[i]:.4g} m."
        )
