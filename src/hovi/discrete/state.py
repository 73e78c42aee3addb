"""Boundary data of a motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments_except
from hovi.checks.shapes import require_shape
from hovi.errors import InputError, nearest, warn
from hovi.robot.robot import Robot
from hovi.robot.space.angle_ranges import angles_in_degrees
from hovi.robot.space.coordinates import Coordinates
from hovi.robot.space.joint_table import angles_in, configuration_of, rates_of, with_angles
from hovi.robot.space.turns import known_or, nearest_angles, remainder
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

MAX_TURNS = 1_000_000
"""Largest number of full turns of an initial guess."""
_FREE = "free", "free_velocity", "free_acceleration", "free_jerk"
Configuration = npt.ArrayLike | str | Mapping[str, Any]
"""A configuration (nq,), the name of a pose, or a table of joints."""
Rates = npt.ArrayLike | Mapping[str, Any]
"""A velocity, acceleration or jerk (nv,), or a table of joints."""
ALL = "all"
"""Stands for all joints in a list of joint names."""


@check_arguments_except("q", "v", "a", "jerk", "turns")
@dataclass(frozen=True, eq=False)
class State:
    """A point (q, v) of TQ: where a motion starts or ends.

    For Lagrangians of order k it is a point (q, q', ..., q^(k-1)): with an acceleration for k = 3,
    and with a jerk for k = 4; for k = 1 it has no velocity.

    q: configuration, shape (nq,), in [rad] or [m]; or the name of a pose of the robot, or a table
        of all joints, in which a continuous joint takes its angle; or one number per joint, (nv,),
        where continuous joints are the only ones with nq > nv. A start keeps the full turns of such
        angles; a goal beyond (-pi, pi] is reached at its angle, another one the shortest way.
    v, a, jerk: velocity, acceleration and its rate, shape (nv,), per [s], [s^2], [s^3]; zero by
        default; or tables of joints, of which those that are left out have zero.
    free, free_velocity, free_acceleration, free_jerk: joints whose configuration, velocity, ... is
        optimized, by name; what is given is the initial guess. ALL stands for all joints,
        "joint[i]" for one coordinate: 0 to 2 of a floating base translate it along its own axes, 3
        to 5 rotate it.
    turns: of a goal, full turns of the initial guess in addition to the shortest path, by joint: an
        integer for one angle, for orientations a rotation vector in the body frame whose length is
        an integer.
    Raises InputError for turns that are not given by joint.
    """

    q: Configuration
    v: Rates | None = None
    _: KW_ONLY
    free: Sequence[str] = ()
    free_velocity: Sequence[str] = ()
    a: Rates | None = None
    free_acceleration: Sequence[str] = ()
    jerk: Rates | None = None
    free_jerk: Sequence[str] = ()
    turns: Mapping[str, int | Sequence[int]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for key in _FREE:
            if isinstance(getattr(self, key), str):
                object.__setattr__(self, key, (getattr(self, key),))
        for key in ("q", "v", "a", "jerk"):
            given = getattr(self, key)
            if isinstance(given, np.ndarray):  # which may change later
                object.__setattr__(self, key, given.copy())
        if not isinstance(self.turns, Mapping):
            raise InputError(
                "turns are given by joint, such as {'wrist': 1} or {'root_joint': [0, 0, 1]}, not "
                f"{self.turns!r}."
            )

    def on(self, coordinates: Coordinates, name: str) -> tuple[Array, Array]:
        """q and v as checked arrays.

        name: of the state in messages, such as "start".
        Raises InputError for wrong shapes and numbers that are not finite.
        """
        given = configuration_of(self.q, coordinates, f"{name}.q")
        q = coordinates.check_configuration(given, name)
        return q, self._rate("v", coordinates, name)

    def _rate(self, key: str, coordinates: Coordinates, name: str) -> Array:
        """v, a or jerk as a checked array, zero if it is not given."""
        given = rates_of(getattr(self, key), coordinates, f"{name}.{key}")
        rate = np.zeros(coordinates.nv) if given is None else given
        return coordinates.check_velocity(rate, f"{name}.{key}")

    def angles_on(self, coordinates: Coordinates) -> Array:
        """The angles that q gives of continuous joints, NaN elsewhere, shape (nv,), in [rad]."""
        return angles_in(self.q, coordinates)

    def turns_made(self, coordinates: Coordinates, reached: Array) -> dict[str, int]:
        """Full turns of the continuous joints, of those that have made any.

        reached: configuration (nq,) of the state, which is another one where joints are free.
        """
        require_shape("reached", reached, coordinates.nq)
        rest, space = remainder(reached, coordinates.space), coordinates.space
        angles = nearest_angles(reached, known_or(self.angles_on(coordinates), rest), space)
        turns = np.round((angles - rest) / (2 * np.pi))
        return {coordinates.coordinate_names[i]: int(turns[i]) for i in np.flatnonzero(turns)}

    def resolved(self, coordinates: Coordinates, name: str) -> State:
        """The state with arrays in place of tables and names of poses. Raises as `on` does.

        Angles of continuous joints stay in a table.
        """
        if not any(isinstance(x, str | Mapping) for x in (self.q, self.v, self.a, self.jerk)):
            return self
        rates = {
            key: None if getattr(self, key) is None else self._rate(key, coordinates, name)
            for key in ("v", "a", "jerk")
        }
        q = with_angles(self.on(coordinates, name)[0], self.angles_on(coordinates), coordinates)
        return replace(self, q=q, **rates)  # type: ignore[arg-type]

    def require_order(self, order: int, name: str) -> None:
        """Raise InputError for derivatives that an end of a motion of this order does not have."""
        given = {"v": self.v, "a": self.a, "jerk": self.jerk}
        for i, (key, value) in enumerate(given.items()):
            if i >= order - 1 and (value is not None or len(getattr(self, _FREE[i + 1])) > 0):
                raise InputError(
                    f"{name} has {key} or {_FREE[i + 1]}, but motions of order {order} end at "
                    f"values of {', '.join(['q', *given][:order])} only: leave them out."
                )

    def jet_on(self, coordinates: Coordinates, name: str) -> list[Array]:
        """(q, v, a, jerk), q of shape (nq,) and the rest (nv,), zero where none is given.

        Raises InputError as `on` does.
        """
        rates = [self._rate(key, coordinates, name) for key in ("a", "jerk")]
        return [*self.on(coordinates, name), *rates]

    def free_on(self, coordinates: Coordinates, name: str, order: int = 2) -> Mask:
        """Which components of q (in the tangent space), v, ... are free, shape (k, nv).

        order: k.

        Raises InputError for an unknown joint, and for parts of a joint's configuration that cannot
        be free by themselves.
        """
        rows = [
            _chosen_coordinates(coordinates, name, key, joints)
            for key, joints in ((key, getattr(self, key)) for key in _FREE[:order])
        ]
        for factor in coordinates.space.factors:
            _check_part(coordinates, name, factor.v.start, rows[0][factor.v], factor.group.angular)
        return np.stack(rows)

    def turns_on(self, coordinates: Coordinates, name: str) -> Array:
        """Rotation vectors over 2 pi in the tangent space, shape (nv,).

        Raises InputError for a joint without full turns, or turns that are not integers.
        """
        full = np.zeros(coordinates.nv)
        for joint, turns in self.turns.items():
            indices = _rotation_indices(coordinates, name, joint)
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


@check_arguments_except("displacement")
@dataclass(frozen=True, eq=False)
class Periodic:
    """A goal: q(T) = q(0) + displacement, and the same q', ..., q^(k-1) at both ends.

    The start is then a guess of the motion at t = 0, and all of it is optimized but for the
    positions of some joints, which are held. If the Lagrangian does not depend on time, a periodic
    motion can be shifted along itself, and a joint is held to choose the phase: the motion has to
    pass its position with a velocity other than zero, so that nothing is held but the phase.

    displacement: of a period, shape (nv,), in [rad] or [m]; zero if None. In a full turn of a
        revolute joint it is 2 pi.
    held: names of the joints that are held at the start's position. By default, if the Lagrangian
        does not depend on time, the one with the largest displacement; without any the one with the
        largest velocity at the start. Where the Lagrangian is the same for translated
        configurations, one more for each direction.
    For vector spaces.
    """

    displacement: npt.ArrayLike | None = None
    _: KW_ONLY
    held: Sequence[str] = ()

    def __post_init__(self) -> None:
        if isinstance(self.held, str):
            object.__setattr__(self, "held", (self.held,))

    def ends(
        self, start: State, coordinates: Coordinates, order: int, timed: bool
    ) -> tuple[State, State]:
        """Both ends of a motion as states, free but for the joints that are held.

        order: k. timed: whether the Lagrangian depends on time.
        Raises InputError for groups, unknown joints, a displacement of another shape, and where
        the phase is not determined.
        """
        if not coordinates.vector_joints:
            raise InputError(
                "periodic motions need joints with nq = nv: lock the others with load_robot(..., "
                "locked=[...])."
            )
        q, v = start.on(coordinates, "start")
        shift = np.zeros(coordinates.nv)
        if self.displacement is not None:
            shift = coordinates.check_velocity(self.displacement, "the displacement of a period")
        held = _chosen_coordinates(coordinates, "Periodic", "held", self.held)
        if not timed and not held.any():
            held[_phase_coordinate(coordinates, shift, v if order > 1 else 0 * v)] = True
        names = coordinates.coordinate_names
        free = tuple(name for name, is_held in zip(names, held, strict=True) if not is_held)
        rest = dict.fromkeys(_FREE[1:order], ALL)
        given = {"v": start.v, "a": start.a, "jerk": start.jerk}
        one, other = (State(each, **given, free=free, **rest) for each in (q, q + shift))  # type: ignore[arg-type]
        return one, other


def _phase_coordinate(coordinates: Coordinates, shift: Array, v: Array) -> int:
    """The coordinate that chooses the phase of a periodic motion; raises InputError if none."""
    for size in (np.abs(shift), np.abs(v)):
        if size.any():
            return int(np.argmax(size))
    raise InputError(
        "the Lagrangian does not depend on time, so that a periodic motion can be shifted along "
        "itself: name a joint that passes the start's position with a velocity, such as "
        f"Periodic(held=[{coordinates.coordinate_names[0]!r}]), or give a displacement, or the "
        "start a velocity where it has one."
    )


def _check_part(
    coordinates: Coordinates, state: str, first: int, free: Mask, angular: Sequence[int]
) -> None:
    """Raise InputError for free parts of a configuration that are not invariant under motion.

    The position, one rotation, all rotations or everything can be free; other parts are coupled to
    fixed coordinates.
    """
    turns = free[list(angular)]
    linear = np.delete(free, list(angular))
    if turns.any() and not free.all() and (linear.any() or 1 < turns.sum() < len(turns)):
        raise InputError(
            f"{state}.free: of joint {coordinates.joint_at(first)!r} only the position, one "
            "rotation, all rotations or everything can be free."
        )


def _rotation_indices(coordinates: Coordinates, state: str, joint: str) -> list[int]:
    """Indices in v of the rotation of a joint that can make full turns."""
    rotations = {}
    for factor in coordinates.space.factors:
        name = coordinates.joint_at(factor.v.start)
        rotations[name] = [factor.v.start + i for i in factor.group.angular]
    if joint not in rotations:
        known = nearest(str(joint), rotations) if rotations else "it has none."
        raise InputError(
            f"{state}.turns: {coordinates.owner} has no joint {joint!r} that can make full turns: "
            f"{known}"
        )
    return rotations[joint]


def _chosen_coordinates(
    coordinates: Coordinates, state: str, key: str, joints: Sequence[str]
) -> Mask:
    chosen = np.zeros(coordinates.nv, dtype=bool)
    for joint in joints:
        if joint == ALL:
            return np.ones(coordinates.nv, dtype=bool)
        if joint in coordinates.coordinate_names:
            chosen[coordinates.coordinate_names.index(joint)] = True
            continue
        if joint not in coordinates.joint_names:
            hint = coordinates.hint(str(joint), (*coordinates.joint_names, ALL))
            raise InputError(f"{state}.{key}: {coordinates.owner} has no joint {joint!r}: {hint}")
        chosen[coordinates.entries_of(joint)] = True
    return chosen


def as_state(state: State | Configuration, coordinates: Coordinates, name: str = "state") -> State:
    """A State: of a configuration at rest, the name of a pose, or a table of joints.

    name: of the state in messages, such as "start".
    Raises InputError for an unknown pose or joint.
    """
    whole = state if isinstance(state, State) else State(state)
    return whole.resolved(coordinates, name)


def warn_of_degrees(
    robot: Robot, configurations: Sequence[Array], turned: Sequence[Array] = ()
) -> None:
    """Warn if angles of successive configurations (nq,) of a motion look like degrees.

    turned: angles that they give of continuous joints, (nv,) each, NaN elsewhere.
    """
    index, coordinates = robot.space.plain
    q, lower, upper = np.zeros((len(configurations), robot.nv)), *np.full((2, robot.nv), np.inf)
    lower *= -1.0
    q[:, coordinates] = np.stack(configurations)[:, index]
    lower[coordinates], upper[coordinates] = robot.lower[index], robot.upper[index]
    for row, angles in zip(q, turned, strict=False):
        row[~np.isnan(angles)] = angles[~np.isnan(angles)]
    note = angles_in_degrees(robot.coordinate_names, ~robot.sliding, q, lower, upper)
    if note:
        warn(f"{note}; configurations are in radians.")
