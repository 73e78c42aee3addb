"""The scene of a motion as a MuJoCo model, in MJCF."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.discrete.trajectory import Trajectory
from hovi.dynamics.joint_tree import axes_of
from hovi.dynamics.mimic_kernel import rnea_kernel
from hovi.effects import Effect, MovingBase, ViscousFriction
from hovi.errors import InputError
from hovi.robot.space.joint_kinds import kind_of
from hovi.scene.scene import Scene

Array = npt.NDArray[np.float64]
Element = ElementTree.Element

STEP = 1e-4
"""Time step of the model, in [s]."""
MOTORED = "revolute", "continuous", "prismatic", "translation"
"""The kinds of joints that are hinges, or slides."""
_THICKNESS = 0.02  # of the bars, relative to the longest
_TINY = "1e-12"  # MuJoCo refuses bodies without mass, such as those between the axes of a wrist


def mujoco_scene(trajectory: Trajectory) -> Scene:
    """The scene of a motion that one model holds.

    Raises InputError as `mujoco_scenes` does, and for segments with different bodies.
    """
    scenes = [scene for scene, _ in mujoco_scenes(trajectory)]
    for scene in scenes:
        if not _same_bodies(scene.model, scenes[0].model) or damping_of(scene) != damping_of(
            scenes[0]
        ):
            raise InputError(
                "a MuJoCo model has the same bodies all the time, and the segments of this motion "
                "differ in mass, armature, damping or gravity: `hovi check` plays it back with a "
                "model for each segment, but it is not exported."
            )
    return scenes[0]


def mujoco_scenes(trajectory: Trajectory) -> list[tuple[Scene, int]]:
    """The scenes of the segments of a motion, and how many intervals each has.

    Raises InputError for what a MuJoCo model of joints with one coordinate each cannot hold: mimic
    joints, bases and ball joints, and a base with a prescribed motion.
    """
    scenes = [] if trajectory.scene is None else [(trajectory.scene, trajectory.grid.intervals)]
    if trajectory.segments is not None:
        parts = trajectory.segments
        scenes = list(zip(parts.scenes, parts.intervals, strict=True))
    if not scenes:
        raise InputError(
            "this motion was saved without its robot, which was a bare Pinocchio model: load the "
            "robot from a URDF and plan again."
        )
    for scene, _ in scenes:
        _require_supported(scene)
    return scenes


def left_out(scene: Scene) -> tuple[str, ...]:
    """Keys of the effects whose torques the model does not have, nor its controls."""
    known = (MovingBase, ViscousFriction)
    return tuple(
        each.key
        for each in scene.effects
        if type(each).torque is not Effect.torque and not isinstance(each, known)
    )


def controls(scene: Scene, q: Array, v: Array, a: Array) -> Array:
    """Torques of the motors at M points: RNEA and damping, shape (M, nv), in [N m] or [N]."""
    tau = rnea_kernel(scene.model).torque(q, v, a)
    return np.asarray(tau + np.array(damping_of(scene)) * v)


def damping_of(scene: Scene) -> tuple[float, ...]:
    """Damping of the joints, (nv,), in [N m s/rad] or [N s/m]."""
    found = np.zeros(scene.robot.nv)
    for each in scene.effects:
        if isinstance(each, ViscousFriction):
            found = found + each.values(scene.robot)
    return tuple(found.tolist())


def mjcf(scene: Scene) -> Element:
    """The model: bodies with Pinocchio's inertias, joints, motors, and bars that show them."""
    model, names = scene.model, scene.robot.coordinate_names
    root = ElementTree.Element("mujoco", model=scene.robot.name)
    compiler = {"angle": "radian", "autolimits": "false", "inertiafromgeom": "false"}
    ElementTree.SubElement(
        root, "compiler", {**compiler, "boundmass": _TINY, "boundinertia": _TINY}
    )
    gravity = _numbers(model.gravity.linear)
    ElementTree.SubElement(
        root, "option", timestep=repr(STEP), integrator="RK4", gravity=gravity, cone="elliptic"
    )
    bodies = {0: ElementTree.SubElement(root, "worldbody")}
    radius = _THICKNESS * _longest(model)
    damping = damping_of(scene)
    for i in range(1, model.njoints):
        parent = bodies[model.parents[i]]
        _add_bar(parent, model.jointPlacements[i].translation, radius)
        bodies[i] = _body(parent, model, i)
        _add_joints(bodies[i], scene, i, damping)
    for i in set(range(1, model.njoints)) - set(model.parents):
        _add_bar(bodies[i], 2 * model.inertias[i].lever, radius)
    actuators = ElementTree.SubElement(root, "actuator")
    for k, name in enumerate(names):
        if k not in scene.passive_coordinates:
            ElementTree.SubElement(actuators, "motor", name=name, joint=name)
    return root


def _body(parent: Element, model: pin.Model, i: int) -> Element:
    placement, inertia = model.jointPlacements[i], model.inertias[i]
    x, y, z, w = pin.Quaternion(placement.rotation).coeffs()
    quat = _numbers((w, x, y, z))
    name, pos = str(model.names[i]), _numbers(placement.translation)
    body = ElementTree.SubElement(parent, "body", name=name, pos=pos, quat=quat)
    tensor = inertia.inertia
    six = tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    if inertia.mass > 0:
        ElementTree.SubElement(
            body,
            "inertial",
            pos=_numbers(inertia.lever),
            mass=repr(float(inertia.mass)),
            fullinertia=_numbers(six),
        )
    else:
        ElementTree.SubElement(
            body, "inertial", pos="0 0 0", mass=_TINY, diaginertia=f"{_TINY} {_TINY} {_TINY}"
        )
    return body


def _add_joints(body: Element, scene: Scene, i: int, damping: Sequence[float]) -> None:
    joint = scene.model.joints[i]
    for k, axis in enumerate(axes_of(joint)):
        column = joint.idx_v + k
        hinge = bool(np.any(np.abs(axis[3:]) > 0))
        ElementTree.SubElement(
            body,
            "joint",
            name=scene.robot.coordinate_names[column],
            type="hinge" if hinge else "slide",
            axis=_numbers(axis[3:] if hinge else axis[:3]),
            armature=repr(float(scene.model.armature[column])),
            damping=repr(float(damping[column])),
        )


def _add_bar(body: Element, end: Array, radius: float) -> None:
    """A capsule from the frame of a body to a point in it, which touches nothing."""
    if np.linalg.norm(end) > radius:
        ends = _numbers((0.0, 0.0, 0.0, *end))
        ElementTree.SubElement(
            body, "geom", type="capsule", fromto=ends, size=f"{radius:.6g}", contype="0",
            conaffinity="0", rgba="0.2 0.45 0.7 1",
        )  # fmt: skip


def _longest(model: pin.Model) -> float:
    sizes = [float(np.linalg.norm(m.translation)) for m in list(model.jointPlacements)[1:]]
    return max(sizes, default=0.0) or 1.0


def _require_supported(scene: Scene) -> None:
    robot = scene.robot
    if any(isinstance(each, MovingBase) for each in scene.effects):
        raise InputError("a MuJoCo model stands still, and the base of this scene moves.")
    if robot.couplings:
        raise InputError(
            f"joint {robot.couplings[0].follower!r} mimics {robot.couplings[0].leader!r}, which "
            "MuJoCo holds by soft constraints only, so that it would move otherwise than planned: "
            "lock it."
        )
    for i in range(1, scene.model.njoints):
        joint, name = scene.model.joints[i], str(scene.model.names[i])
        kind = kind_of(joint).label
        if kind not in MOTORED:
            raise InputError(
                f"joint {name!r} is neither a hinge nor a slide ({kind}), and the motors of a "
                "MuJoCo model drive these alone: use the format 'mcap' or 'csv'."
            )


def _same_bodies(one: pin.Model, other: pin.Model) -> bool:
    return bool(
        all(a.isApprox(b) for a, b in zip(one.inertias, other.inertias, strict=True))
        and np.array_equal(one.gravity.vector, other.gravity.vector)
        and np.array_equal(one.armature, other.armature)
    )


def _numbers(values: Sequence[float] | Array) -> str:
    return " ".join(repr(float(x)) for x in values)
