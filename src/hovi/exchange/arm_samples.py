"""Samples of the joints of a maker's arm at a fixed rate, in the order of its controller."""

from __future__ import annotations

import re

import numpy as np
import numpy.typing as npt

from hovi.discrete.joined_motion import REST, SAME, AnyMotion
from hovi.errors import InputError, warn
from hovi.exchange.joint_motion import JointMotion, joint_motion
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

RADIAN = "rad"


@dataclass(frozen=True)
class Arm:
    """The joints that programs of a maker move.

    maker: in messages. joints: a pattern of each joint's name, in the order of the controller.
    """

    maker: str
    joints: tuple[str, ...]


UNIVERSAL_ROBOTS = Arm(
    "Universal Robots",
    tuple(
        rf"(.*_)?{name}(_joint)?"
        for name in ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
    ),
)
FRANKA = Arm("Franka", tuple(rf"(.*_)?(panda|fer|fr3)_joint{k}" for k in range(1, 8)))


@dataclass(frozen=True, eq=False)
class ArmSamples:
    """The joints of an arm at multiples of a step, from rest to rest.

    names: of the J joints, in the order of the controller. times: of the samples in the motion,
    shape (M,), in [s]. q: shape (M, J), in [rad]. The last sample is the end, which is reached
    within M - 1 steps.
    """

    names: tuple[str, ...]
    times: Array
    q: Array


def arm_samples(motion: AnyMotion, rate: float, arm: Arm) -> ArmSamples:
    """The samples of a motion that moves an arm's joints alone.

    Joints are known by the maker's names; a robot with as many joints of other names has them in
    its own order, of which hovi warns. Other joints are left out where they do not move.
    rate: samples per second.
    Raises InputError for an invalid rate, a robot with other joints, a joint that slides, has no
    motor or has several coordinates, and for a motion that is not at rest at its ends.
    """
    found = joint_motion(motion, rate)
    chosen = _chosen(found, arm)
    names = tuple(found.names[i] for i in chosen)
    _require_motors(motion, names)
    rest = [i for i in range(len(found.names)) if i not in chosen]
    for i in rest:
        if np.ptp(found.q[:, i]) > SAME:
            raise InputError(
                f"a program for an arm of {arm.maker} moves its {len(arm.joints)} joints, and this "
                f"motion moves {found.names[i]!r}, too: plan it with that joint locked."
            )
    for at, what in ((0, "begins"), (-1, "ends")):
        i = int(np.argmax(np.abs(found.v[at])))
        if abs(found.v[at, i]) > REST:
            raise InputError(
                f"this motion {what} at {abs(found.v[at, i]):.3g} rad/s of {found.names[i]!r}, and "
                "a program begins and ends at rest: plan it with zero velocity there."
            )
    return ArmSamples(names, found.times, found.q[:, chosen])


def _chosen(found: JointMotion, arm: Arm) -> list[int]:
    """The columns of the arm's joints. Raises InputError for a robot that has other joints."""
    matches = [
        [i for i, name in enumerate(found.names) if re.fullmatch(pattern, name)]
        for pattern in arm.joints
    ]
    if all(len(each) == 1 for each in matches) and not found.others:
        return [each[0] for each in matches]
    count, listed = len(found.names), ", ".join(found.names[:10])
    if found.others or count != len(arm.joints):
        listed = ", ".join((found.others + found.names)[:10])
        raise InputError(
            f"a program for an arm of {arm.maker} moves {len(arm.joints)} joints that turn, and "
            f"this motion has {count + len(found.others)} ({listed}): use the format "
            "'joint-trajectory' or 'csv'."
        )
    warn(
        f"the joints of this robot do not have the names of an arm of {arm.maker}: they are "
        f"written in the robot's order, {listed}."
    )
    return list(range(count))


def _require_motors(motion: AnyMotion, names: tuple[str, ...]) -> None:
    """Raise InputError for a joint that slides or has no motor."""
    robot = motion.robot
    if robot is not None:
        units = dict(zip(robot.coordinate_names, robot.coordinate_units, strict=True))
        for name in names:
            if units[name].q != RADIAN:
                raise InputError(
                    f"joint {name!r} slides, and a program of this format has angles: use the "
                    "format 'joint-trajectory'."
                )
    passive = {joint for scene in motion.scenes for joint in scene.passive}
    for name in names:
        if name in passive:
            raise InputError(
                f"joint {name!r} is passive in this motion, and a program moves every joint by its "
                "motor: plan it with a motor there."
            )
