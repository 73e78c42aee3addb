"""The base class of effects."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import fields
from enum import StrEnum
from typing import TYPE_CHECKING, Any, ClassVar

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments, check_fields
from hovi.effects.expressions.symbols import SceneSymbols
from hovi.errors import SceneError
from hovi.system.dataclass import dataclass

if TYPE_CHECKING:
    import pinocchio as pin

    from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]


class Touch(StrEnum):
    """What an effect modifies."""

    MODEL = "model"
    """The rigid-body model of the scene: no cost beyond RNEA."""
    TORQUE = "torque"
    """The torque balance: it adds to tau, in planning and in simulation."""
    COST = "cost"
    """The cost: in planning only."""


@dataclass(frozen=True)
class Effect(ABC):
    """An opt-in part of a scene; the fields of the dataclass are keys in scene files."""

    key: ClassVar[str]
    """Name of the effect's table in a scene file."""
    touches: ClassVar[tuple[Touch, ...]] = (Touch.TORQUE,)
    """What it modifies; a scene refuses an effect that modifies anything else."""
    storable: ClassVar[bool] = True
    """Whether its fields are data that files contain."""

    @check_arguments  # keeps the tracebacks of its errors short
    def __post_init__(self) -> None:
        """Convert lists to tuples, so that effects read from a file equal those written.

        Raises SceneError for a field of another type than its annotation, and as `check_values`.
        """
        check_fields(self, f"effect {self.key!r}", SceneError)
        for field in fields(self):
            object.__setattr__(self, field.name, _frozen(getattr(self, field.name)))
        self.check_values()

    def check_values(self) -> None:
        """Raise SceneError for values that are invalid for every robot."""

    def check(self, robot: Robot) -> None:
        """Raise SceneError if the effect is not valid for the robot."""

    def configure(self, model: pin.Model, robot: Robot) -> None:
        """Modify the scene's own copy of the model, for properties that RNEA includes."""

    def base(self, robot: Robot, symbols: SceneSymbols) -> ca.SX | None:
        """Prescribed pose of the base at time t, (x, y, z, yaw, pitch, roll); or None."""
        return None

    def torque(self, robot: Robot, symbols: SceneSymbols) -> ca.SX | None:
        """Its term in tau = M a + C + g + ..., a column of nv in [N m] or [N]; or None."""
        return None

    def potential(self, robot: Robot, symbols: SceneSymbols) -> ca.SX | None:
        """Its term V(q, v, a, t) in the cost L~ = 1/2 tau^T R tau + V + C, a scalar; or None."""
        return None

    def running_cost(self, robot: Robot, symbols: SceneSymbols, tau: ca.SX) -> ca.SX | None:
        """Its term C(q, v, a, tau, t) in the cost, a scalar; or None.

        tau: the joint torques as symbols of their own, (nv,) in [N m] or [N]. A cost that does not
        depend on them is better a potential, which is evaluated without their derivatives.
        """
        return None

    def effort_weight(self, robot: Robot) -> Array | None:
        """R of the cost 1/2 tau^T diag(R) tau, shape (nv,); or None."""
        return None

    def jerk_weight(self, robot: Robot) -> Array | None:
        """W of the cost 1/2 j^T diag(W) j on the jerk, shape (nv,), positive; or None."""
        return None

    @abstractmethod
    def describe(self) -> str:
        """One line: the effect and its parameters with units."""


def bracketed(numbers: Iterable[float]) -> str:
    """Numbers in a message, whether they were given as integers or not."""
    return f"[{', '.join(f'{x:g}' for x in numbers)}]"


def _frozen(value: Any) -> Any:
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {key: _frozen(each) for key, each in value.items()}
    return tuple(_frozen(each) for each in value) if isinstance(value, (list, tuple)) else value
