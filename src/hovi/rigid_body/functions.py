"""Pinocchio's algorithms as CasADi functions: exact expressions, derivatives of any order."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi
import pinocchio as pin

from hovi.errors import ModelError, nearest
from hovi.rigid_body import _core
from hovi.rigid_body.extension import archive


@dataclass(frozen=True, eq=False)
class RigidBodyFunctions:
    """The dynamics of one model as CasADi functions, each built when it is first asked for.

    Inputs are named `q` (nq,), `v` (nv,) in [rad/s] and `a` (nv,) in [rad/s^2] (metres for sliding
    joints). Gravity and armature are those of the model as it stood when this was made. Outputs
    are dense.

    text: Pinocchio's archive of the model.
    frames: the model's frame names, in Pinocchio's order.
    """

    text: str
    frames: tuple[str, ...]

    @cached_property
    def inverse_dynamics(self) -> casadi.Function:
        """tau = M(q) a + b(q, v) [Featherstone2008, sec. 5.3]: (q, v, a) -> tau (nv,) in [N m]."""
        return casadi.Function.deserialize(self._model.inverse_dynamics())

    @cached_property
    def mass_matrix(self) -> casadi.Function:
        """q -> M (nv, nv) in [kg m^2], both triangles, armature included."""
        return casadi.Function.deserialize(self._model.mass_matrix())

    @cached_property
    def generalized_gravity(self) -> casadi.Function:
        """g = dV/dq: q -> g (nv,) in [N m], the torque that holds the robot still."""
        return casadi.Function.deserialize(self._model.generalized_gravity())

    @cached_property
    def kinetic_energy(self) -> casadi.Function:
        """K = 1/2 v^T M(q) v: (q, v) -> K in [J]."""
        return casadi.Function.deserialize(self._model.kinetic_energy())

    @cached_property
    def potential_energy(self) -> casadi.Function:
        """V = -sum m g^T c(q): q -> V in [J]."""
        return casadi.Function.deserialize(self._model.potential_energy())

    def frame_placement(self, frame_name: str) -> casadi.Function:
        """q -> R (3, 3), p (3,) in [m]: the frame's axes and origin in the world.

        Raises ModelError when the model has no frame of this name.
        """
        if frame_name not in self.frames:
            raise ModelError(
                f"the robot has no frame {frame_name!r}: {nearest(frame_name, self.frames)}"
            )
        index = self.frames.index(frame_name)
        return casadi.Function.deserialize(self._model.frame_placement(index))

    @cached_property
    def _model(self) -> _core.SymbolicModel:
        return _core.SymbolicModel(self.text)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickled as the archive: the functions are built again on the other side."""
        return type(self), (self.text, self.frames)


def casadi_functions(model: pin.Model) -> RigidBodyFunctions:
    """The dynamics of a model as CasADi functions.

    model: any model without closed loops; read here, so that later changes to it have no effect.

    Raises ModelError when the model has mimic joints, and BuildMismatchError when the installed
    Pinocchio is not the one hovi was compiled against.
    """
    if len(model.mimicking_joints):
        names = ", ".join(repr(model.names[i]) for i in model.mimicking_joints)
        raise ModelError(
            f"joint {names} mimics another joint, which hovi does not support: lock it, or "
            "remove its <mimic> tag."
        )
    return RigidBodyFunctions(archive(model), tuple(frame.name for frame in model.frames))
