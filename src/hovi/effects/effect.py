"""What an effect is: something a scene simulates because it was named."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, fields
from enum import StrEnum
from typing import TYPE_CHECKING, Any, ClassVar

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.effects.expressions.symbols import SceneSymbols

if TYPE_CHECKING:
    import pinocchio as pin

    from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]


class Touch(StrEnum):
    """What an effect may touch."""

    MODEL = "model"
    """The scene's own rigid bodies: costs nothing more than RNEA does anyway."""
    TORQUE = "torque"
    """The balance of torques: it adds to tau, in plans and in simulations."""
    COST = "cost"
    """What is minimised: plans alone."""


@dataclass(frozen=True)
class Effect(ABC):
    """An opt-in part of a scene; a field of the dataclass is a key in the scene file."""

    key: ClassVar[str]
    """Name of the effect's table in a scene file."""
    touches: ClassVar[tuple[Touch, ...]] = (Touch.TORQUE,)
    """All that it may touch; a scene refuses an effect that touches more."""

    def __post_init__(self) -> None:
        """Lists become tuples, so that an effect read from a file equals the one written."""
        for field in fields(self):
            object.__setattr__(self, field.name, _frozen(getattr(self, field.name)))

    def check(self, robot: Robot) -> None:
        """Raise SceneError when the effect does not fit the robot."""

    def configure(self, model: pin.Model, robot: Robot) -> None:
        """Change the scene's own copy of the model, for what Pinocchio simulates itself."""

    def base(self, robot: Robot, symbols: SceneSymbols) -> ca.SX | None:
        """Where it puts the base at time t, (x, y, z, yaw, pitch, roll); or None."""
        return None

    def torque(self, robot: Robot, symbols: SceneSymbols) -> ca.SX | None:
        """What it adds to tau = M a + C + g + ..., a column of nv in [N m] or [N]; or None."""
        return None

    def potential(self, robot: Robot, symbols: SceneSymbols) -> ca.SX | None:
        """What it adds to the cost, V of L~ = 1/2 tau^T R tau + V, a number; or None."""
        return None

    def effort_cost(self, robot: Robot, tau: ca.SX, v: ca.SX) -> ca.SX | None:
        """What it adds to the cost that depends on the torque, a number; or None."""
        return None

    def effort_weight(self, robot: Robot) -> Array | None:
        """R of the cost 1/2 tau^T diag(R) tau, shape (nv,); or None."""
        return None

    @abstractmethod
    def describe(self) -> str:
        """One line: the effect and its numbers with units."""


def _frozen(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _frozen(each) for key, each in value.items()}
    return tuple(_frozen(each) for each in value) if isinstance(value, (list, tuple)) else value
