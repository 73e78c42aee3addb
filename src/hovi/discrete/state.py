"""Boundary data of a motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments_except
from hovi.errors import InputError, nearest
from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

MAX_TURNS = 1_000_000
"""Largest number of full turns of an initial guess."""

ALL = "all"
"""Stands for all joints in a list of joint names."""


@check_arguments_except("q", "v", "turns")
@dataclass(frozen=True, eq=False)
class State:
    """A point (q, v) of TQ: where a motion starts or ends.

    q: configuration, shape (nq,), in [rad] or [m].
    v: velocity, shape (nv,), per [s]; zero by default.
    free, free_velocity: joints whose configuration or velocity is optimized, by name; q and v are
        the initial guess. ALL stands for all joints, "joint[i]" for one coordinate: 0 to 2 of a
        floating base translate it along its own axes, 3 to 5 rotate it.
    turns: of a goal, full turns of the initial guess in addition to the shortest path, by joint: an
        integer for one angle, for orientations a rotation vector in the body frame whose length is
        an integer.
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
        """q and v as checked arrays.

        name: of the state in messages, such as "start".
        Raises InputError for wrong shapes and numbers that are not finite.
        """
        q = robot.check_configuration(self.q, name)
        v = np.zeros(robot.nv) if self.v is None else self.v
        return q, robot.check_velocity(v, f"{name}.v")

    def free_on(self, robot: Robot, name: str) -> Mask:
        """Which components of q (in the tangent space) and of v are free, shape (2, nv).

        Raises InputError for an unknown joint, and for parts of a joint's configuration that cannot
        be free by themselves.
        """
        rows = [
            _chosen_coordinates(robot, name, key, joints)
            for key, joints in (("free", self.free), ("free_velocity", self.free_velocity))
        ]
        for factor in robot.space.factors:
            _check_part(robot, name, factor.v.start, rows[0][factor.v], factor.group.angular)
        return np.stack(rows)

    def turns_on(self, robot: Robot, name: str) -> Array:
        """Rotation vectors over 2 pi in the tangent space, shape (nv,).

        Raises InputError for a joint without full turns, or turns that are not integers.
        """
        full = np.zeros(robot.nv)
        for joint, turns in self.turns.items():
            indices = _rotation_indices(robot, name, joint)
            given = np.atleast_1d(np.asarray(turns, dtype=np.float64))
            size = float(np.linalg.norm(given)) if (abs(given) <= MAX_TURNS).all() else 0.5
            if given.shape != (len(indices),) or abs(size - round(size)) > 1e-9:
                expected = "an integer" if len(indices) == 1 else "three numbers of integer length"
                raise InputError(
                    f"{name}.turns: {joint!r} takes {expected}, at most {MAX_TURNS:,} turns, "
                    f"got {turns!r}."
                )
            full[indices] = given
        return full


def _check_part(robot: Robot, state: str, first: int, free: Mask, angular: Sequence[int]) -> None:
    """Raise InputError for free parts of a configuration that are not invariant under motion.

    The position, one rotation, all rotations or everything can be free; other parts are coupled to
    fixed coordinates.
    """
    turns = free[list(angular)]
    linear = np.delete(free, list(angular))
    if turns.any() and not free.all() and (linear.any() or 1 < turns.sum() < len(turns)):
        raise InputError(
            f"{state}.free: of joint {robot.joint_at(first)!r} only the position, one rotation, "
            "all rotations or everything can be free."
        )


def _rotation_indices(robot: Robot, state: str, joint: str) -> list[int]:
    """Indices in v of the rotation of a joint that can make full turns."""
    rotations = {}
    for factor in robot.space.factors:
        name = robot.joint_at(factor.v.start)
        rotations[name] = [factor.v.start + i for i in factor.group.angular]
    if joint not in rotations:
        known = nearest(str(joint), rotations) if rotations else "it has none."
        raise InputError(
            f"{state}.turns: robot {robot.name!r} has no joint {joint!r} that can make full turns: "
            f"{known}"
        )
    return rotations[joint]


def _chosen_coordinates(robot: Robot, state: str, key: str, joints: Sequence[str]) -> Mask:
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
        member = robot.model.joints[robot.model.getJointId(joint)]
        chosen[member.idx_v : member.idx_v + member.nv] = True
    return chosen


def as_state(state: State | npt.ArrayLike | str, robot: Robot) -> State:
    """A configuration at rest or the name of a pose of the robot as a State; a State unchanged.

    Raises InputError for an unknown pose.
    """
    if isinstance(state, str):
        return State(robot.pose(state))
    return state if isinstance(state, State) else State(state)
