"""Boundary data of a motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hovi.robot import Robot

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class State:
    """A point (q, v) of TQ: where a motion starts or ends.

    q: configuration, shape (nq,), in [rad] or [m].
    v: velocity, shape (nv,), per [s]; zero when not given.
    """

    q: npt.ArrayLike
    v: npt.ArrayLike | None = None

    def on(self, robot: Robot, name: str) -> tuple[Array, Array]:
        """q and v as arrays that fit the robot.

        name: what the state is called in an error, "start" for instance.
        Raises InputError when the shapes do not fit or a number is not finite.
        """
        q = robot.check_configuration(self.q, name)
        v = np.zeros(robot.nv) if self.v is None else self.v
        return q, robot.check_velocity(v, name)


def as_state(state: State | npt.ArrayLike) -> State:
    """A configuration at rest as a State; a State as it is."""
    return state if isinstance(state, State) else State(state)
