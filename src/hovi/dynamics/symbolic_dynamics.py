"""Pinocchio's algorithms as CasADi functions: exact expressions, derivatives of any order."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property, lru_cache
from typing import Any

import casadi
import pinocchio as pin

from hovi.dynamics.extension import SymbolicModel, archive
from hovi.errors import ModelError, nearest
from hovi.robot.mimic_model import CoordinateMap, uncoupled
from hovi.robot.model import frame_ids
from hovi.robot.robot import Robot
from hovi.system.dataclass import dataclass

_OutputMap = Callable[[casadi.SX, casadi.SX], list[casadi.SX]]


@dataclass(frozen=True, eq=False)
class RigidBodyFunctions:
    """The dynamics of one model as CasADi functions, each built on first access.

    Inputs are named `q` (nq,), `v` (nv,) in [rad/s] and `a` (nv,) in [rad/s^2] (metres for
    prismatic joints). Gravity and armature are those of the model when this was created. Outputs
    are dense.

    text: Pinocchio's archive of the model; of the uncoupled model if there are mimic joints, which
        archives of Pinocchio 4.1 do not restore.
    frames: Pinocchio's index of each frame, by name.
    coordinate_map: from the model's coordinates to those of the uncoupled model; None without mimic
        joints.
    """

    text: str
    frames: Mapping[str, int]
    coordinate_map: CoordinateMap | None = None

    @cached_property
    def inverse_dynamics(self) -> casadi.Function:
        """tau = M(q) a + b(q, v) [Featherstone2008, sec. 5.3]: (q, v, a) -> tau (nv,) in [N m]."""
        whole = casadi.Function.deserialize(self._model.inverse_dynamics())
        return self._reduced(whole, lambda tau, G: [casadi.mtimes(G.T, tau)])

    @cached_property
    def mass_matrix(self) -> casadi.Function:
        """q -> M (nv, nv) in [kg m^2], symmetric, with armature."""
        whole = casadi.Function.deserialize(self._model.mass_matrix())
        return self._reduced(whole, lambda M, G: [casadi.mtimes([G.T, M, G])])

    @cached_property
    def generalized_gravity(self) -> casadi.Function:
        """g = dV/dq: q -> g (nv,) in [N m], the static holding torque."""
        whole = casadi.Function.deserialize(self._model.generalized_gravity())
        return self._reduced(whole, lambda g, G: [casadi.mtimes(G.T, g)])

    @cached_property
    def kinetic_energy(self) -> casadi.Function:
        """K = 1/2 v^T M(q) v: (q, v) -> K in [J]."""
        return self._reduced(casadi.Function.deserialize(self._model.kinetic_energy()))

    @cached_property
    def potential_energy(self) -> casadi.Function:
        """V = -sum m g^T c(q): q -> V in [J]."""
        return self._reduced(casadi.Function.deserialize(self._model.potential_energy()))

    def frame_placement(self, frame_name: str) -> casadi.Function:
        """q -> R (3, 3), p (3,) in [m]: rotation and origin of a frame in the world.

        Raises ModelError for an unknown frame.
        """
        if frame_name not in self.frames:
            raise ModelError(
                f"the robot has no frame {frame_name!r}: {nearest(frame_name, self.frames)}"
            )
        known = self._placements
        if frame_name not in known:
            whole = casadi.Function.deserialize(
                self._model.frame_placement(self.frames[frame_name])
            )
            known[frame_name] = self._reduced(whole)
        return known[frame_name]

    @cached_property
    def _placements(self) -> dict[str, casadi.Function]:
        return {}

    def _reduced(
        self, whole: casadi.Function, output_map: _OutputMap | None = None
    ) -> casadi.Function:
        """A function of (q_all, v_all, ...) as one of (q, v, ...).

        output_map: from its output and G to the output in the model's coordinates; or None.
        """
        if self.coordinate_map is None:
            return whole
        G = casadi.SX(casadi.sparsify(casadi.DM(self.coordinate_map.matrix)))
        names, outputs = whole.name_in(), whole.name_out()
        nq = len(self.coordinate_map.sources)
        inputs = [casadi.SX.sym(n, nq if n == "q" else G.shape[1]) for n in names]
        q, *rates = inputs
        results = whole.call(
            [self.coordinate_map.expression(q), *(casadi.mtimes(G, x) for x in rates)]
        )
        if output_map is not None:
            results = [casadi.densify(x) for x in output_map(results[0], G)]
        return casadi.Function(whole.name(), inputs, results, names, outputs)

    @cached_property
    def _model(self) -> SymbolicModel:
        return SymbolicModel(self.text)

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickled as the archive; the functions are built again when used."""
        return type(self), (self.text, self.frames, self.coordinate_map)


@lru_cache(maxsize=16)
def functions_of(robot: Robot) -> RigidBodyFunctions:
    """The dynamics of a robot as CasADi functions, which are built once."""
    return casadi_functions(robot.model)


def casadi_functions(model: pin.Model) -> RigidBodyFunctions:
    """The dynamics of a model as CasADi functions.

    model: any model without closed loops; later changes to it have no effect.

    Raises BuildMismatchError unless the installed Pinocchio is the version hovi was compiled with.
    """
    frames = frame_ids(model)
    if not len(model.mimicking_joints):
        return RigidBodyFunctions(archive(model), frames)
    free = uncoupled(model)
    return RigidBodyFunctions(archive(free), frames, CoordinateMap.of(model, free))
