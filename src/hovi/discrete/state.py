"""Boundary data of a motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from hovi.errors import InputError, nearest
from hovi.robot.robot import Robot

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
        what q and v say of them is the first guess. ALL stands for every joint, "joint[i]" for one
        coordinate: 0 to 2 of a free base move its place along its own axes, 3 to 5 turn it.
    turns: of a goal, full turns that the first guess makes on top of the shortest way, by joint: a
        whole number where one coordinate turns, a rotation vector in the body's axes whose length
        is a whole number for orientations.
    Raises InputError for turns that are not given by joint.
    """

    q: npt.ArrayLike
    v: npt.ArrayLike | None = None
    free: Sequence[str] = ()
    free_velocity: Sequence[str] = ()
    turns: Mapping[str, int | Sequence[int]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for key in ("free", "free_velocity"):
            if isinstance(getattr(self, key), str):
                object.__setattr__(self, key, (getattr(self, key),))
        if not isinstance(self.turns, Mapping):
            raise InputError(
                "turns are given by joint, such as {'wrist': 1} or {'root_joint': [0, 0, 1]}, not "
                f"{self.turns!r}."
            )

    def on(self, robot: Robot, name: str) -> tuple[Array, Array]:
        """q and v as arrays that fit the robot.

        name: what the state is called in an error, "start" for instance.
        Raises InputError when the shapes do not fit or a number is not finite.
        """
        q = robot.check_configuration(self.q, name)
        v = np.zeros(robot.nv) if self.v is None else self.v
        return q, robot.check_velocity(v, f"{name}.v")

    def free_on(self, robot: Robot, name: str) -> Mask:
        """Which components of q (in the tangent space) and of v are free, shape (2, nv).

        Raises InputError for a joint that the robot does not have, or for parts of a joint's
        configuration that cannot be free alone.
        """
        rows = [
            _places(robot, name, key, joints)
            for key, joints in (("free", self.free), ("free_velocity", self.free_velocity))
        ]
        for factor in robot.space.factors:
            _check_part(robot, name, factor.v.start, rows[0][factor.v], factor.group.angular)
        return np.stack(rows)

    def turns_on(self, robot: Robot, name: str) -> Array:
        """Rotation vectors over 2 pi in the tangent space, shape (nv,).

        Raises InputError for a joint that makes no full turns, or turns that are not full.
        """
        full = np.zeros(robot.nv)
        for joint, turns in self.turns.items():
            places = _turning_places(robot, name, joint)
            given = np.atleast_1d(np.asarray(turns, dtype=np.float64))
            size = float(np.linalg.norm(given)) if np.isfinite(given).all() else 0.5
            if given.shape != (len(places),) or abs(size - round(size)) > 1e-9:
                wanted = "a whole number" if len(places) == 1 else "three numbers of whole length"
                raise InputError(f"{name}.turns: {joint!r} takes {wanted}, got {turns!r}.")
            full[places] = given
        return full


def _check_part(robot: Robot, state: str, first: int, free: Mask, angular: Sequence[int]) -> None:
    """Refuse free parts of a configuration that would not stay parts when it moves.

    Places can be free, one turn, all turns, or all: others bend into what is held.
    """
    turns = free[list(angular)]
    places = np.delete(free, list(angular))
    if turns.any() and not free.all() and (places.any() or 1 < turns.sum() < len(turns)):
        raise InputError(
            f"{state}.free: of joint {robot.joint_at(first)!r} the place, one turn, all turns or "
            "everything can be free, not other parts."
        )


def _turning_places(robot: Robot, state: str, joint: str) -> list[int]:
    """Places in v of the rotation of a joint that can make full turns."""
    turning = {}
    for factor in robot.space.factors:
        name = robot.joint_at(factor.v.start)
        turning[name] = [factor.v.start + i for i in factor.group.angular]
    if joint not in turning:
        known = nearest(str(joint), turning) if turning else "it has none."
        raise InputError(
            f"{state}.turns: robot {robot.name!r} has no joint {joint!r} that makes full turns and "
            f"comes back: {known}"
        )
    return turning[joint]


def _places(robot: Robot, state: str, key: str, joints: Sequence[str]) -> Mask:
    chosen = np.zeros(robot.nv, dtype=bool)
    for joint in joints:
        if joint == ALL:
            return np.ones(robot.nv, dtype=bool)
        if joint in robot.coordinate_names:
            chosen[robot.coordinate_names.index(joint)] = True
            continue
        if joint not in robot.joint_names:
            hint = robot.hint(str(joint), (*robot.joint_names, ALL))
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
