"""Boundary data of a motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hovi.errors import InputError, nearest
from hovi.robot import Robot

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

ALL = "all"
"""Stands for every joint where joints are named."""


@dataclass(frozen=True, eq=False)
class State:
    """A point (q, v) of TQ: where a motion starts or ends.

    q: configuration, shape (nq,), in [rad] or [m].
    v: velocity, shape (nv,), per [s]; zero when not given.
    free, free_velocity: joints whose configuration or velocity is left to the optimiser, by name;
        what q and v say of them is the first guess. ALL stands for every joint.
    """

    q: npt.ArrayLike
    v: npt.ArrayLike | None = None
    free: Sequence[str] = ()
    free_velocity: Sequence[str] = ()

    def on(self, robot: Robot, name: str) -> tuple[Array, Array]:
        """q and v as arrays that fit the robot.

        name: what the state is called in an error, "start" for instance.
        Raises InputError when the shapes do not fit or a number is not finite.
        """
        q = robot.check_configuration(self.q, name)
        v = np.zeros(robot.nv) if self.v is None else self.v
        return q, robot.check_velocity(v, name)

    def free_on(self, robot: Robot, name: str) -> Mask:
        """Which components of q (in the tangent space) and of v are free, shape (2, nv).

        Raises InputError for a joint that the robot does not have.
        """
        rows = [
            _places(robot, name, key, joints)
            for key, joints in (("free", self.free), ("free_velocity", self.free_velocity))
        ]
        return np.stack(rows)


def _places(robot: Robot, state: str, key: str, joints: Sequence[str]) -> Mask:
    chosen = np.zeros(robot.nv, dtype=bool)
    for joint in (joints,) if isinstance(joints, str) else joints:
        if joint == ALL:
            return np.ones(robot.nv, dtype=bool)
        if joint not in robot.joint_names:
            hint = nearest(str(joint), (*robot.joint_names, ALL))
            raise InputError(f"{state}.{key}: robot {robot.name!r} has no joint {joint!r}: {hint}")
        place = robot.model.joints[robot.model.getJointId(joint)]
        chosen[place.idx_v : place.idx_v + place.nv] = True
    return chosen


def as_state(state: State | npt.ArrayLike | str, robot: Robot) -> State:
    """A configuration at rest, or the name of a pose of the robot, as a State; a State as it is.

    Raises InputError for a pose that the robot does not have.
    """
    if isinstance(state, str):
        return State(robot.pose(state))
    return state if isinstance(state, State) else State(state)
