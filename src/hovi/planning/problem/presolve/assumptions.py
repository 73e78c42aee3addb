"""What a plan assumes without being asked: no gravity, driven bases, forces next to torques."""

from __future__ import annotations

import numpy as np

from hovi.discrete.trajectory import Trajectory
from hovi.robot.space.joint_kinds import FLOATING, kind_of
from hovi.scene.scene import Scene, without_inertia

SAMPLES = 257
"""Number of samples of a motion at which the force on a base is compared."""
PLAUSIBLE_EFFORT = 1e6
"""Effort limit from which a URDF means none, in [N] or [N m]."""

REPLACED_WEIGHT = "The option weight takes the place of the scene's effect 'effort_weight'."


def assumptions(
    scene: Scene, motion: Trajectory | None = None, weighted: bool = False
) -> list[str]:
    """What a scene leaves unsaid, a sentence each; none if it says everything.

    motion: whose force on a base without motors is quoted. weighted: whether torques have weights
        that the scene does not know, and that replace those of its effect.
    """
    keys = {effect.key for effect in scene.effects}
    bare = without_inertia(scene)
    if bare and not scene.effort_lagrangian(regular=False).needs_torques:
        return [f"Torques, and limits on them, are left out: there is no inertia at joint {bare}."]
    sentences = [] if "gravity" in keys else ["Gravity is left out, as the scene does not name it."]
    sentences += _driven_base(scene, motion)
    if weighted and "effort_weight" in keys:
        sentences.append(REPLACED_WEIGHT)
    if not weighted and "effort_weight" not in keys:
        sentences += _forces_beside_torques(scene)
    return sentences


def _driven_base(scene: Scene, motion: Trajectory | None) -> list[str]:
    """The floating base that is not passive."""
    robot = scene.robot
    base = robot.joint_names[0] if robot.joint_names else ""
    joint = robot.model.joints[robot.model.getJointId(base)] if base else None
    if joint is None or kind_of(joint) is not FLOATING or base in scene.passive:
        return []
    size = ""
    if motion is not None:
        part = slice(joint.idx_v, joint.idx_v + joint.nv)
        wrench = motion.sample(np.linspace(0.0, motion.duration, SAMPLES)).tau[:, part]
        force, moment = (np.linalg.norm(x, axis=1).max() for x in (wrench[:, :3], wrench[:, 3:]))
        size = f" of up to {force:.3g} N and {moment:.3g} N m"
    return [
        f"The base {base!r} has no motor that a URDF could name, but a force and a moment{size} "
        f"act on it: name it in `passive` if nothing drives it."
    ]


def _forces_beside_torques(scene: Scene) -> list[str]:
    """The forces of sliding joints whose squares are added to those of torques."""
    robot = scene.robot
    driven = np.ones(robot.nv, dtype=bool)
    driven[scene.passive_coordinates] = False
    units = np.array([each.tau for each in robot.coordinate_units])
    alone = np.array(
        [robot.entries_of(robot.joint_at(i)) == slice(i, i + 1) for i in range(robot.nv)]
    )
    forces, torques = (driven & alone & (units == unit) for unit in ("N", "N m"))
    if not (forces.any() and torques.any()):
        return []
    names = [robot.coordinate_names[int(np.flatnonzero(each)[0])] for each in (forces, torques)]
    limits, chosen = robot.effort_limit, forces | torques
    known = (limits[chosen] > 0).all() and (limits[chosen] < PLAUSIBLE_EFFORT).all()
    how = (
        "hovi.effects.EffortWeight(from_urdf=True) or, in a scene file, "
        "[effects.effort_weight] from_urdf = true divides each by its effort limit"
        if known
        else "give weights with the effect effort_weight"
    )
    return [
        f"The cost adds up squares of forces in N, as of {names[0]!r}, and of torques in N m, as "
        f"of {names[1]!r}, with weight one: {how}."
    ]
