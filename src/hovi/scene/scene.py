"""A scene: a robot and the effects that act on it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import field
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.checks.arguments import check_arguments_except
from hovi.checks.kinds import is_number
from hovi.checks.shapes import numbers_of
from hovi.dynamics.mimic_kernel import rnea_kernel, without_rnea_kernel
from hovi.dynamics.moving_base_torque import MovingBaseTorque, inverse_dynamics, on_base_joints
from hovi.dynamics.torque_model import AnalyticTorque, CasadiTorque, SummedTorque, TorqueModel
from hovi.effects.effect import Effect
from hovi.effects.registration import REGISTRY, as_effects, effect_of_table
from hovi.errors import ModelError, SceneError, warn
from hovi.robot.mass_matrix import check_mass_matrix, joints_without_inertia, named_joints
from hovi.robot.meshes.stored_meshes import StoredMeshes
from hovi.robot.mimic_model import PortableModel, check_coupling
from hovi.robot.robot import Robot
from hovi.scene.cost_terms import PotentialTerm, RunningCostTerm
from hovi.scene.effort_lagrangian import EffortLagrangian
from hovi.scene.evaluation_cost import SceneAccount, account
from hovi.scene.jerk_lagrangian import JerkLagrangian
from hovi.scene.regular_cost import require_regular
from hovi.scene.terms import SceneTerms
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


WITHOUT_COMPILING = "`compile` has no effect any more: expressions are as fast without it."


@check_arguments_except("effects", "passive", "package_dirs")
@dataclass(frozen=True, eq=False)
class Scene:
    """A robot with the effects that act on it; nothing else is simulated.

    robot: the robot.
    effects: at most one of each kind; or a table of their keys as in a scene file, such as
        {"gravity": {"acceleration": 9.81}}.
    passive: names of unactuated joints, with all their coordinates.
    begin: what the time t of the effects' formulas is at the start of a motion, in [s].
    compile: without effect, and to be removed: expressions are evaluated as fast without.
    model: the scene's own copy of the robot's model, with gravity and armature set by effects and
        zero by default.
    Raises SceneError if an effect is not valid for the robot, or given twice.
    """

    robot: Robot
    effects: Sequence[Effect] = ()
    passive: Sequence[str] = field(default=(), kw_only=True)
    begin: float = field(default=0.0, kw_only=True)
    compile: bool = field(default=False, kw_only=True)
    model: pin.Model = field(init=False, repr=False)

    def __post_init__(self) -> None:
        effects = as_effects(self.effects)
        if not np.isfinite(self.begin):
            raise SceneError(f"`begin` of a scene must be a finite time in [s], got {self.begin}.")
        if self.compile:
            warn(WITHOUT_COMPILING)
            object.__setattr__(self, "compile", False)
        keys = [effect.key for effect in effects]
        for key in set(keys):
            if keys.count(key) > 1:
                raise SceneError(f"the effect {key!r} is named twice; a scene takes one of each.")
        model = self.robot.model.copy()
        model.gravity.linear = np.zeros(3)
        model.armature = np.zeros(model.nv)
        for effect in effects:
            effect.check(self.robot)
            effect.configure(model, self.robot)
        object.__setattr__(self, "effects", effects)
        object.__setattr__(self, "passive", _passive(self.robot, self.passive))
        object.__setattr__(self, "model", model)

    @cached_property
    def torques(self) -> TorqueModel:
        """tau(q, v, a, t): RNEA plus the torques of effects, with exact derivatives.

        Derivatives of RNEA are analytic if the kernel supports all joints, CasADi's otherwise.
        """
        symbols, added, base = self.terms.symbols, self.terms.torque, self.terms.base
        space = self.robot.curved_space
        if not self.analytic:
            tau = inverse_dynamics(self.model, base, *symbols.columns())
            total = tau if added is None else tau + added
            return CasadiTorque(symbols.columns(), total, space)
        main: TorqueModel
        if base is None:
            main = AnalyticTorque(rnea_kernel(self.model))
        else:
            main = MovingBaseTorque(self.model, base, symbols.t)
        if added is None:
            return main
        return SummedTorque(main, CasadiTorque(symbols.columns(), added, space))

    @cached_property
    def terms(self) -> SceneTerms:
        """The terms that effects add to RNEA and to the cost, as expressions."""
        return SceneTerms(self.robot, self.effects, self.model, self.begin)

    @cached_property
    def passive_coordinates(self) -> npt.NDArray[np.intp]:
        """Indices in v of the passive joints, ascending."""
        joints = [self.robot.model.joints[self.robot.model.getJointId(j)] for j in self.passive]
        indices = [np.arange(joint.idx_v, joint.idx_v + joint.nv) for joint in joints]
        return np.sort(np.concatenate([np.zeros(0, dtype=np.intp), *indices]))

    @property
    def order(self) -> int:
        """The order of its effort Lagrangian: 2, or 3 with a cost on the jerk."""
        return 2 if self.terms.jerk_weight is None else 3

    @property
    def analytic(self) -> bool:
        """Whether the derivatives of RNEA are analytic."""
        return not self._without_kernel

    def effort_lagrangian(
        self, weight: npt.ArrayLike | None = None, *, regular: bool = True
    ) -> EffortLagrangian | JerkLagrangian:
        """L~ = 1/2 tau^T diag(R) tau + V(q, v, a, t) + C(q, v, a, tau, t) on T^(2)Q.

        With the effect `jerk_cost` it is L~ + 1/2 j^T diag(W) j on T^(3)Q.

        weight: R, shape (nv,), 0 or more; by default that of the effect `effort_weight`, or ones.
            Weights of passive joints are set to zero, since their torque vanishes.
            [ColomboFerraroMartin2016, section 5]
        regular: refuse a cost that is singular in a. A cost with a jerk need not be regular in a.
        Raises SceneError for invalid weights and singular costs, ModelError for joints of an
        unsupported kind.
        """
        require_known_joints(self.robot)
        active = ~self._is_passive
        R = np.where(active, self._effort_weight(weight), 0.0)
        found, W = self.effort(R), self.terms.jerk_weight
        if W is not None:
            return JerkLagrangian(found, W)
        if regular and (self._running_cost is not None or not R[active].all()):
            require_regular(found, self.robot, active)
        return found

    def effort(self, weight: Array) -> EffortLagrangian:
        """L~ of `effort_lagrangian`, unchecked and without a cost on the jerk; weight: R."""
        return EffortLagrangian(self.torques, self, weight, self._potential, self._running_cost)

    @property
    def _has_effort_matrix(self) -> bool:
        from hovi.effects.effort_weight import EffortWeight  # most scenes have none

        return any(isinstance(each, EffortWeight) and bool(each.matrix) for each in self.effects)

    def _effort_weight(self, given: npt.ArrayLike | None) -> Array:
        """R, or the one of the effects."""
        R = self.terms.effort_weight if given is None else numbers_of("weight", given)
        if R.shape != (self.robot.nv,) or not (np.isfinite(R).all() and (R >= 0).all()):
            raise SceneError(
                f"weight needs {self.robot.nv} numbers of 0 or more, one per joint coordinate, "
                f"got {R}."
            )
        if given is not None and self._has_effort_matrix:
            raise SceneError(
                "weight cannot replace the matrix of the scene's effect 'effort_weight': leave out "
                "one of them."
            )
        return R

    def inverse_dynamics(
        self, q: npt.ArrayLike, v: npt.ArrayLike, a: npt.ArrayLike, t: npt.ArrayLike | None = None
    ) -> Array:
        """tau = RNEA(q, v, a) + effects, shape (M, nv), in [N m] or [N].

        q: shape (M, nq). v, a: shape (M, nv). t: shape (M,), in [s].
        """
        jet = numbers_of("q", q), numbers_of("v", v), numbers_of("a", a)
        return self.torques.torque(*jet, None if t is None else numbers_of("t", t))

    def without(self, key: str) -> Scene:
        """The same scene without one of its effects."""
        kept = [effect for effect in self.effects if effect.key != key]
        return dataclasses.replace(self, effects=kept)

    def from_time(self, time: float) -> Scene:
        """The scene by a clock that starts at a time, in [s]: itself if no effect depends on it."""
        if time == 0.0 or not self.terms.timed:
            return self
        return dataclasses.replace(self, begin=self.begin + time)

    def graph(self) -> ca.Function:
        """(q, v, a, t) -> (tau, L~), as one expression graph, without a cost on the jerk."""
        symbols, added = self.terms.symbols, self.terms.torque
        tau = inverse_dynamics(self.model, self.terms.base, *symbols.columns())
        tau = tau if added is None else tau + added
        weight = np.where(self._is_passive, 0.0, self.terms.effort_weight)
        cost = ca.dot(ca.DM(weight), tau**2) / 2
        for more in (self.terms.potential, self._cost_of(tau)):
            cost = cost if more is None else cost + more
        return ca.Function("scene", [*symbols.columns()], [tau, cost])

    def evaluation(self) -> Callable[..., Any]:
        """(q, v, a, t) -> L~ with its derivatives at a batch of points, as in an optimiser step."""
        lagrangian = self.effort_lagrangian(regular=False)
        more = lagrangian.order - 2
        return lambda q, v, a, t: lagrangian.expand(q, v, a, *[np.zeros_like(a)] * more, t=t)

    def account(self) -> SceneAccount:
        """The cost of each effect in instructions and in measured time."""
        return account(self)

    def describe(self) -> str:
        """A text: what is simulated, which properties of the URDF are not, and the costs."""
        lines = [f"scene of robot {self.robot.name!r}", "simulated:"]
        lines += ["  rigid-body inertia (RNEA)", *(f"  {e.describe()}" for e in self.effects)]
        if self.begin:
            lines.append(f"  motions begin at t = {self.begin:g} s of the effects' time")
        if self.passive:
            lines.append(f"  no torque at {', '.join(self.passive)}")
        lines.append("left out:")
        lines += [f"  {line}" for line in self._left_out()] or ["  nothing in the URDF"]
        lines.append(self._derivatives())
        return "\n".join([*lines, *self.account().lines()])

    def to_dict(self) -> dict[str, Any]:
        """The scene as JSON-compatible data, including the text of the URDF."""
        for effect in self.effects:
            if not effect.storable:
                raise SceneError(
                    f"effect {effect.key!r} holds a function, which files do not contain: write it "
                    "as formulas of hovi.effects.RunningCost, or as an effect of your own with "
                    "@hovi.effects.register."
                )
            if REGISTRY.get(effect.key) is not type(effect):
                raise SceneError(
                    f"effect {effect.key!r} is not registered, so it cannot be stored: put "
                    f"@hovi.effects.register before its class {type(effect).__name__}."
                )
        effects = {effect.key: dataclasses.asdict(effect) for effect in self.effects}
        passive = {"passive": list(self.passive)} if self.passive else {}
        begin = {"begin": float(self.begin)} if self.begin else {}
        return {"robot": self.robot.to_dict(), "effects": effects, **passive, **begin}

    @classmethod
    def from_dict(
        cls,
        data: dict[str, Any],
        package_dirs: Iterable[str | Path] = (),
        meshes: Mapping[str, StoredMeshes] | None = None,
    ) -> Scene:
        """The scene from the result of `to_dict`.

        package_dirs, meshes: see `Robot.from_dict`.
        Raises SceneError for an unknown effect, ModelError for a robot that cannot be read.
        """
        tables = data.get("effects"), data.get("robot")
        if not all(isinstance(table, dict) for table in tables):
            raise SceneError("a stored scene needs the tables 'robot' and 'effects'.")
        effects = [effect_of_table(key, values) for key, values in data["effects"].items()]
        robot = Robot.from_dict(data["robot"], package_dirs, meshes)
        passive, begin = _passive_names(data.get("passive", ())), data.get("begin", 0.0)
        if not is_number(begin):
            raise SceneError(f"the `begin` of a stored scene is a time in [s], not {begin!r:.80}.")
        return cls(robot, effects, passive=passive, begin=float(begin))

    @cached_property
    def _without_kernel(self) -> tuple[str, ...]:
        moves = self.terms.base is not None
        return without_rnea_kernel(on_base_joints(self.model) if moves else self.model)

    @cached_property
    def _is_passive(self) -> npt.NDArray[np.bool_]:
        return np.isin(np.arange(self.robot.nv), self.passive_coordinates)

    @cached_property
    def _potential(self) -> PotentialTerm | None:
        V, columns = self.terms.potential, self.terms.symbols.columns()
        return None if V is None else PotentialTerm(columns, V, self.robot.curved_space)

    @cached_property
    def _running_cost(self) -> RunningCostTerm | None:
        tau, columns = ca.SX.sym("tau", self.robot.nv), self.terms.symbols.columns()
        C, space = self._cost_of(tau), self.robot.curved_space
        return None if C is None else RunningCostTerm(columns, tau, C, space)

    def _cost_of(self, tau: ca.SX) -> ca.SX | None:
        """C(q, v, a, tau, t): what is left of a passive joint's torque has no cost."""
        return self.terms.running_cost(ca.DM(np.where(self._is_passive, 0.0, 1.0)) * tau)

    def _derivatives(self) -> str:
        if self.analytic:
            return "derivatives: analytic (C++), which all joints support"
        joints = ", ".join(map(repr, self._without_kernel))
        return f"derivatives: CasADi's, since there are no analytic second derivatives for {joints}"

    def _left_out(self) -> list[str]:
        robot, keys = self.robot, {effect.key for effect in self.effects}
        lines = [] if "gravity" in keys else ["gravity"]
        held = (
            ("damping", "viscous_friction", robot.damping),
            ("friction", "dry_friction", robot.friction),
            ("armature", "armature", robot.armature),
        )
        for name, effect, values in held:
            joints = [j for j, x in zip(robot.coordinate_names, values, strict=True) if x != 0]
            if joints and effect not in keys:
                lines.append(f"{name} of {', '.join(joints)}")
        return lines

    def __getstate__(self) -> dict[str, Any]:
        """The fields without cached functions, which worker processes build themselves."""
        names = ("robot", "effects", "passive", "begin", "model")
        state = {name: getattr(self, name) for name in names}
        return {**state, "model": PortableModel.of(self.model)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        for name, value in {**state, "model": state["model"].model()}.items():
            object.__setattr__(self, name, value)


def require_known_joints(robot: Robot) -> None:
    """Raise ModelError for a robot with joints that do not support planning."""
    if robot.unplanned_joints:
        joints = ", ".join(repr(joint) for joint in robot.unplanned_joints)
        raise ModelError(
            f"robot {robot.name!r} does not support planning: it has joints of an unknown kind, "
            f"{joints}; supported ones move on a vector space, SO(2), SE(2), SO(3) or SE(3): lock "
            "these joints with load_robot(..., locked=[...])."
        )
    for coupling in robot.couplings:
        try:
            check_coupling(robot.model, coupling)
        except ModelError as wrong:
            raise ModelError(f"robot {robot.name!r} does not support planning: {wrong}") from None


@lru_cache(maxsize=64)
def without_inertia(scene: Scene) -> str:
    """The joints without inertia, in words; "" if the mass matrix is regular."""
    return named_joints(scene.model, joints_without_inertia(scene.model))


@lru_cache(maxsize=64)
def require_plannable(scene: Scene, torques: bool = True) -> None:
    """Raise ModelError for a robot without moving joints, or without inertia at one of them.

    torques: whether they are needed; without them, no inertia is.
    """
    robot = scene.robot
    require_known_joints(robot)
    if robot.nv == 0:
        raise ModelError(
            f"robot {robot.name!r} has no joint that moves; load it with fewer joints locked."
        )
    if torques and without_inertia(scene):  # which is cached
        check_mass_matrix(scene.model)


def require_inertia(scene: Scene, what: str) -> None:
    """Raise ModelError for what needs torques if a joint of the scene has no inertia.

    what: the subject of the message, such as "a simulation".
    """
    if bare := without_inertia(scene):
        raise ModelError(
            f"{what} needs torques, and robot {scene.robot.name!r} has none, as there is no "
            f"inertia at joint {bare}: give the links that it moves a mass and an inertia, or the "
            "joint a rotor by the effect armature, and plan again."
        )


def _passive_names(names: object) -> tuple[str, ...]:
    """Names as a tuple. Raises SceneError for anything but a list of texts."""
    if not isinstance(names, Sequence) or not all(isinstance(name, str) for name in names):
        raise SceneError(f"passive is a list of joint names, not {names!r}.")
    return tuple(names)


def _passive(robot: Robot, names: Sequence[str]) -> tuple[str, ...]:
    """The names of passive joints, checked."""
    if isinstance(names, str):
        raise SceneError(f"passive is a list of joint names, not the string {names!r}.")
    names = _passive_names(names)
    for name in names:
        if name not in robot.joint_names:
            hint = robot.hint(str(name))
            if name == "root_joint":
                hint = "it is that of a base that floats, as with `free_flyer` true."
            raise SceneError(f"passive: robot {robot.name!r} has no joint {name!r}: {hint}")
    chosen = tuple(name for name in robot.joint_names if name in names)
    if chosen and len(chosen) == len(robot.joint_names):
        raise SceneError("every joint is passive; a motion needs at least one actuated joint.")
    return chosen
