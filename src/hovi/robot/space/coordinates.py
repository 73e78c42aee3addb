"""Coordinates of a motion: its configuration space, with names and units."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from functools import cached_property

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments, check_arguments_except
from hovi.errors import InputError, nearest
from hovi.robot.space.chart import Chart
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.robot.space.joint_kinds import LENGTH, Units
from hovi.robot.space.pinocchio_configurations import UNIT_TOLERANCE, check_vector
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]

NO_UNITS = Units("", "1/s", "1/s^2", "", "1/s^3", "1/s")
"""Units of coordinates that are nobody's joints."""


class Coordinates(ABC):
    """A configuration space Q with a name for each coordinate: a robot's, or a Lagrangian's own."""

    @property
    @abstractmethod
    def owner(self) -> str:
        """What has these coordinates, for messages, such as "robot 'ur5'"."""

    @property
    @abstractmethod
    def space(self) -> ConfigurationSpace:
        """Q as a product of vector spaces and groups."""

    @property
    @abstractmethod
    def coordinate_names(self) -> tuple[str, ...]:
        """One name per velocity, (nv,)."""

    @property
    @abstractmethod
    def coordinate_units(self) -> tuple[Units, ...]:
        """Units of q, v, a, tau, the jerk and d tau / dt at each coordinate, (nv,)."""

    @property
    def nq(self) -> int:
        """Length of a configuration q."""
        return self.space.nq

    @property
    def nv(self) -> int:
        """Number of degrees of freedom: length of v and a."""
        return self.space.nv

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints; of the coordinates if there are none."""
        return self.coordinate_names

    @property
    def sliding(self) -> npt.NDArray[np.bool_]:
        """Which coordinates are lengths rather than angles, (nv,)."""
        return np.array([units == LENGTH for units in self.coordinate_units], dtype=bool)

    @cached_property
    def chart(self) -> Chart:
        """The charts q0 (+) x of the configuration space."""
        return Chart(self.space)

    @property
    def vector_joints(self) -> bool:
        """Whether configurations form a vector space."""
        return self.space.vector

    @property
    def curved_space(self) -> ConfigurationSpace | None:
        """The configuration space; None if it is a vector space."""
        return None if self.vector_joints else self.space

    def integrate(self, q: Array, dq: Array) -> Array:
        """q (+) dq: move configurations (..., nq) by tangent vectors (..., nv) -> (..., nq).

        Raises InputError for other shapes.
        """
        return self.space.integrate(q, dq)

    def difference(self, q0: Array, q1: Array) -> Array:
        """q1 (-) q0: the tangent vector (..., nv) that moves q0 (..., nq) to q1 (..., nq).

        Raises InputError for other shapes.
        """
        return self.space.difference(q0, q1)

    @check_arguments_except("q")
    def check_configuration(self, q: npt.ArrayLike, name: str) -> Array:
        """`q` as a float array (nq,), finite and with unit quaternions and angles.

        name: of the argument, for the message. Raises InputError.
        """
        checked = check_vector(q, name, self.space.names(self.coordinate_names))
        normalized = self.space.normalized(checked)
        if not np.abs(normalized - checked).max() <= UNIT_TOLERANCE:
            raise InputError(
                f"{name} is {checked.tolist()}, whose quaternions, or pairs (cos, sin), are not of "
                "unit norm; normalize them."
            )
        return normalized

    @check_arguments_except("v")
    def check_velocity(self, v: npt.ArrayLike, name: str) -> Array:
        """`v` as a finite float array (nv,). Raises InputError naming the coordinate."""
        return check_vector(v, name, self.coordinate_names)

    def joint_at(self, index: int) -> str:
        """The joint, or coordinate, that the entry of v at an index belongs to."""
        return self.coordinate_names[index]

    def entries_of(self, joint: str) -> slice:
        """The entries of v of one of the `joint_names`."""
        first = self.joint_names.index(joint)
        return slice(first, first + 1)

    def hint(self, name: str, valid: Iterable[str] | None = None) -> str:
        """The end of a message about a joint that does not exist.

        valid: the accepted names; `joint_names` when None.
        """
        return nearest(name, self.joint_names if valid is None else valid)

    def pose(self, name: str) -> Array:
        """A named configuration, (nq,). Raises InputError if there is none."""
        raise InputError(f"{self.owner} has no poses, so none named {name!r}: give q itself.")


@check_arguments
@dataclass(frozen=True, eq=False)
class NamedCoordinates(Coordinates):
    """Coordinates that are nobody's joints.

    names: one per velocity, (nv,). parts: see ConfigurationSpace.
    """

    names: tuple[str, ...]
    parts: ConfigurationSpace

    @property
    def owner(self) -> str:
        """The Lagrangian whose arguments they are."""
        return "the Lagrangian"

    @property
    def space(self) -> ConfigurationSpace:
        """Q as given."""
        return self.parts

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        """The names as given."""
        return self.names

    @property
    def coordinate_units(self) -> tuple[Units, ...]:
        """No units, but those of time."""
        return (NO_UNITS,) * len(self.names)
