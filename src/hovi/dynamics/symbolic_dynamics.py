"""Pinocchio's algorithms as CasADi functions: exact expressions, derivatives of any order."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi
import pinocchio as pin

from hovi.dynamics.extension import SymbolicModel, archive
from hovi.errors import ModelError, nearest
from hovi.robot.mimic_model import CoordinateMap, uncoupled

_Back = Callable[[casadi.SX, casadi.SX], list[casadi.SX]]


@dataclass(frozen=True, eq=False)
class RigidBodyFunctions:
    """The dynamics of one model as CasADi functions, each built when it is first asked for.

    Inputs are named `q` (nq,), `v` (nv,) in [rad/s] and `a` (nv,) in [rad/s^2] (metres for sliding
    joints). Gravity and armature are those of the model as it stood when this was made. Outputs
    are dense.

    text: Pinocchio's archive of the model; where joints mimic others, with every joint on its own:
        an archive of Pinocchio 4.1 loses the size of mimic joints.
    frames: the model's frame names, in Pinocchio's order.
    pull: from the model's coordinates to those of all joints; None where no joint mimics another.
    """

    text: str
    frames: tuple[str, ...]
    pull: CoordinateMap | None = None

    @cached_property
    def inverse_dynamics(self) -> casadi.Function:
        """tau = M(q) a + b(q, v) [Featherstone2008, sec. 5.3]: (q, v, a) -> tau (nv,) in [N m]."""
        whole = casadi.Function.deserialize(self._model.inverse_dynamics())
        return self._pulled(whole, lambda tau, G: [casadi.mtimes(G.T, tau)])

    @cached_property
    def mass_matrix(self) -> casadi.Function:
        """q -> M (nv, nv) in [kg m^2], both triangles, armature included."""
        whole = casadi.Function.deserialize(self._model.mass_matrix())
        return self._pulled(whole, lambda M, G: [casadi.mtimes([G.T, M, G])])

    @cached_property
    def generalized_gravity(self) -> casadi.Function:
        """g = dV/dq: q -> g (nv,) in [N m], the torque that holds the robot still."""
        whole = casadi.Function.deserialize(self._model.generalized_gravity())
        return self._pulled(whole, lambda g, G: [casadi.mtimes(G.T, g)])

    @cached_property
    def kinetic_energy(self) -> casadi.Function:
        """K = 1/2 v^T M(q) v: (q, v) -> K in [J]."""
        return self._pulled(casadi.Function.deserialize(self._model.kinetic_energy()))

    @cached_property
    def potential_energy(self) -> casadi.Function:
        """V = -sum m g^T c(q): q -> V in [J]."""
        return self._pulled(casadi.Function.deserialize(self._model.potential_energy()))

    def frame_placement(self, frame_name: str) -> casadi.Function:
        """q -> R (3, 3), p (3,) in [m]: the frame's axes and origin in the world.

        Raises ModelError when the model has no frame of this name.
        """
        if frame_name not in self.frames:
            raise ModelError(
                f"the robot has no frame {frame_name!r}: {nearest(frame_name, self.frames)}"
            )
        index = self.frames.index(frame_name)
        return self._pulled(casadi.Function.deserialize(self._model.frame_placement(index)))

    def _pulled(self, whole: casadi.Function, back: _Back | None = None) -> casadi.Function:
        """A function of (q_all, v_all, ...) as one of (q, v, ...).

        back: from its output and G to the output in the model's coordinates; the same when None.
        """
        if self.pull is None:
            return whole
        G = casadi.SX(casadi.sparsify(casadi.DM(self.pull.matrix)))
        names, outputs = whole.name_in(), whole.name_out()
        nq = len(self.pull.sources)
        inputs = [casadi.SX.sym(n, nq if n == "q" else G.shape[1]) for n in names]
        q, *rates = inputs
        made = whole.call([self.pull.expression(q), *(casadi.mtimes(G, x) for x in rates)])
        if back is not None:
            made = [casadi.densify(x) for x in back(made[0], G)]
        return casadi.Function(whole.name(), inputs, made, names, outputs)

    @cached_property
    def _model(self) -> SymbolicModel:
        return SymbolicModel(self.text)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickled as the archive: the functions are built again on the other side."""
        return type(self), (self.text, self.frames, self.pull)


def casadi_functions(model: pin.Model) -> RigidBodyFunctions:
    """The dynamics of a model as CasADi functions.

    model: any model without closed loops; read here, so that later changes to it have no effect.

    Raises BuildMismatchError when the installed Pinocchio is not the one hovi was compiled against.
    """
    frames = tuple(frame.name for frame in model.frames)
    if not len(model.mimicking_joints):
        return RigidBodyFunctions(archive(model), frames)
    free = uncoupled(model)
    return RigidBodyFunctions(archive(free), frames, CoordinateMap.of(model, free))
