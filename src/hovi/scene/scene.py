"""A scene: a robot and the effects that a person decided to simulate."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.dynamics.mimic_kernel import rnea_kernel, without_rnea_kernel
from hovi.dynamics.moving_base_torque import MovingBaseTorque, inverse_dynamics, on_base_joints
from hovi.dynamics.torque_model import AnalyticTorque, CasadiTorque, SummedTorque, TorqueModel
from hovi.effects import REGISTRY, Effect
from hovi.errors import ModelError, SceneError, nearest
from hovi.robot.mimic_model import PortableModel, check_coupling
from hovi.robot.robot import Robot
from hovi.scene.cost_terms import EffortTerm, PotentialTerm
from hovi.scene.effort_lagrangian import EffortLagrangian
from hovi.scene.evaluation_cost import SceneAccount, account
from hovi.scene.terms import SceneTerms

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Scene:
    """A robot with the effects that act on it; what is not named is not simulated.

    robot: the robot.
    effects: at most one of each kind.
    passive: joints that carry no torque, by name; every coordinate of a joint.
    compile: compile what is evaluated by CasADi to machine code, once: the libraries stay in the
        user's cache folder. It takes a C compiler and seconds, and changes no result.
    model: the scene's own copy of the robot's model, with gravity and armature as the effects
        say (none where no effect says so).
    Raises SceneError when an effect does not fit the robot, or is named twice; with compile,
    its functions raise CompilationError where they cannot be compiled or kept.
    """

    robot: Robot
    effects: Sequence[Effect] = ()
    passive: Sequence[str] = field(default=(), kw_only=True)
    compile: bool = field(default=False, kw_only=True)
    model: pin.Model = field(init=False, repr=False)

    def __post_init__(self) -> None:
        effects = _as_effects(self.effects)
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
        """tau(q, v, a, t): RNEA and what the effects add to it, with exact derivatives.

        Pinocchio's analytic derivatives where the joints have them, CasADi's otherwise.
        """
        symbols, added = self.terms.symbols, self.terms.torque
        space = self.robot.curved_space
        if not self.analytic:
            tau = inverse_dynamics(self.model, symbols.base, *symbols.columns())
            total = tau if added is None else tau + added
            return CasadiTorque(symbols.columns(), total, self.compile, space)
        main: TorqueModel
        if symbols.base is None:
            main = AnalyticTorque(rnea_kernel(self.model))
        else:
            main = MovingBaseTorque(self.model, symbols.base, symbols.t, self.compile)
        if added is None:
            return main
        return SummedTorque(main, CasadiTorque(symbols.columns(), added, self.compile, space))

    @cached_property
    def terms(self) -> SceneTerms:
        """What the effects add to RNEA and to the cost, as expressions."""
        return SceneTerms(self.robot, self.effects)

    @cached_property
    def passive_coordinates(self) -> npt.NDArray[np.intp]:
        """Places in v of the joints that carry no torque, ascending."""
        joints = [self.robot.model.joints[self.robot.model.getJointId(j)] for j in self.passive]
        places = [np.arange(joint.idx_v, joint.idx_v + joint.nv) for joint in joints]
        return np.sort(np.concatenate([np.zeros(0, dtype=np.intp), *places]))

    @property
    def analytic(self) -> bool:
        """Whether RNEA's derivatives are Pinocchio's analytic ones."""
        return not self._without_kernel

    def effort_lagrangian(self, weight: npt.ArrayLike | None = None) -> EffortLagrangian:
        """L~ = 1/2 tau^T diag(R) tau + V + phi(tau, v) on T^(2)Q.

        weight: R, shape (nv,); when not given, that of the effect `effort_weight`, or all ones;
            that of passive joints, whose torque vanishes, does not count and is set to zero.
            [ColomboFerraroMartin2016, section 5]
        Raises ModelError for joints whose configurations are not vectors.
        """
        require_known_joints(self.robot)
        R = self.terms.effort_weight if weight is None else np.asarray(weight, dtype=np.float64)
        passive = self._is_passive
        if R.shape != passive.shape or not (np.isfinite(R).all() and (R[~passive] > 0).all()):
            raise SceneError(
                f"weight needs {self.robot.nv} positive numbers, one per joint coordinate, got {R}."
            )
        R = np.where(passive, 0.0, R)
        return EffortLagrangian(self.torques, self, R, self._potential, self._effort_term)

    def inverse_dynamics(
        self, q: npt.ArrayLike, v: npt.ArrayLike, a: npt.ArrayLike, t: npt.ArrayLike | None = None
    ) -> Array:
        """tau = RNEA(q, v, a) + effects, shape (M, nv), in [N m] or [N].

        q: shape (M, nq). v, a: shape (M, nv). t: shape (M,), in [s].
        """
        q, v, a = (np.asarray(x, dtype=np.float64) for x in (q, v, a))
        return self.torques.torque(q, v, a, None if t is None else np.asarray(t, dtype=np.float64))

    def without(self, key: str) -> Scene:
        """The same scene without one of its effects."""
        kept = [effect for effect in self.effects if effect.key != key]
        return dataclasses.replace(self, effects=kept)

    def graph(self) -> ca.Function:
        """(q, v, a, t) -> (tau, L~): all that the scene names, as one expression graph."""
        symbols, added = self.terms.symbols, self.terms.torque
        tau = inverse_dynamics(self.model, symbols.base, *symbols.columns())
        tau = tau if added is None else tau + added
        weight = np.where(self._is_passive, 0.0, self.terms.effort_weight)
        cost = ca.dot(ca.DM(weight), tau**2) / 2
        for more in (self.terms.potential, self.terms.effort_cost(tau, symbols.v)):
            cost = cost if more is None else cost + more
        return ca.Function("scene", [*symbols.columns()], [tau, cost])

    def evaluation(self) -> Callable[..., Any]:
        """(q, v, a, t) -> L~ with its derivatives at a batch of points, as an optimiser asks."""
        lagrangian = self.effort_lagrangian()
        return lambda q, v, a, t: lagrangian.expand(q, v, a, t=t)

    def account(self) -> SceneAccount:
        """What each effect costs in instructions and in measured time."""
        return account(self)

    def describe(self) -> str:
        """What is simulated, what the URDF holds but the scene leaves out, and what it costs."""
        lines = [f"scene of robot {self.robot.name!r}", "simulated:"]
        lines += ["  rigid-body inertia (RNEA)", *(f"  {e.describe()}" for e in self.effects)]
        if self.passive:
            lines.append(f"  no torque at {', '.join(self.passive)}")
        lines.append("left out:")
        lines += [f"  {line}" for line in self._left_out()] or ["  nothing that the URDF holds"]
        lines.append(self._derivatives())
        if self.compile:
            lines.append("what CasADi evaluates is compiled to machine code")
        return "\n".join([*lines, *self.account().lines()])

    def to_dict(self) -> dict[str, Any]:
        """The scene as JSON-able data, the URDF's text included."""
        for effect in self.effects:
            if REGISTRY.get(effect.key) is not type(effect):
                raise SceneError(
                    f"effect {effect.key!r} is not registered, so that no file can hold it: put "
                    f"@hovi.effects.register before its class {type(effect).__name__}."
                )
        effects = {effect.key: dataclasses.asdict(effect) for effect in self.effects}
        passive = {"passive": list(self.passive)} if self.passive else {}
        return {"robot": self.robot.to_dict(), "effects": effects, **passive}

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Scene:
        """The scene that to_dict wrote. Raises SceneError for an unknown effect."""
        effects = []
        for key, values in data["effects"].items():
            if key not in REGISTRY:
                raise SceneError(f"there is no effect {key!r}: {nearest(key, REGISTRY)}")
            effects.append(REGISTRY[key](**values))
        robot = Robot.from_dict(data["robot"])
        return cls(robot, effects, passive=tuple(data.get("passive", ())))

    @cached_property
    def _without_kernel(self) -> tuple[str, ...]:
        moves = self.terms.symbols.base is not None
        return without_rnea_kernel(on_base_joints(self.model) if moves else self.model)

    @cached_property
    def _is_passive(self) -> npt.NDArray[np.bool_]:
        return np.isin(np.arange(self.robot.nv), self.passive_coordinates)

    @cached_property
    def _potential(self) -> PotentialTerm | None:
        V, columns = self.terms.potential, self.terms.symbols.columns()
        return (
            None if V is None else PotentialTerm(columns, V, self.compile, self.robot.curved_space)
        )

    @cached_property
    def _effort_term(self) -> EffortTerm | None:
        tau, v = ca.SX.sym("tau", self.robot.nv), self.terms.symbols.v
        phi = self.terms.effort_cost(tau, v)
        return None if phi is None else EffortTerm(tau, v, phi, self.compile)

    def _derivatives(self) -> str:
        if self.analytic:
            return "derivatives: Pinocchio's analytic ones (C++), since every joint has them"
        joints = ", ".join(map(repr, self._without_kernel))
        return f"derivatives: CasADi's, since there are no analytic second ones for {joints}"

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
        """Without what is cached, so that worker processes build their own functions."""
        names = ("robot", "effects", "passive", "compile", "model")
        state = {name: getattr(self, name) for name in names}
        return {**state, "model": PortableModel.of(self.model)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        for name, value in {**state, "model": state["model"].model()}.items():
            object.__setattr__(self, name, value)


def require_known_joints(robot: Robot) -> None:
    """Raise ModelError for a robot with joints on which nothing can be planned."""
    if robot.unplanned_joints:
        joints = ", ".join(repr(joint) for joint in robot.unplanned_joints)
        raise ModelError(
            f"robot {robot.name!r} cannot be planned on: it has joints of no known kind, {joints}: "
            "known ones move by numbers that add or on SO(2), SE(2), SO(3) or SE(3); lock these "
            "joints with load_robot(..., locked=[...])."
        )
    for coupling in robot.couplings:
        try:
            check_coupling(robot.model, coupling)
        except ModelError as wrong:
            raise ModelError(f"robot {robot.name!r} cannot be planned on: {wrong}") from None


def _as_effects(given: object) -> tuple[Effect, ...]:
    """Effects as a tuple. Raises SceneError for what is no effect, or stands without a list."""
    effects = tuple(given) if isinstance(given, Iterable) and not isinstance(given, str) else given
    if not isinstance(effects, tuple) or not all(isinstance(each, Effect) for each in effects):
        raise SceneError(f"effects is a list such as [hovi.effects.Gravity()], not {given!r}.")
    return effects


def _passive(robot: Robot, names: Sequence[str]) -> tuple[str, ...]:
    """The names of passive joints, checked."""
    if isinstance(names, str):
        raise SceneError(f"passive is a list of joint names, not the text {names!r}.")
    for name in names:
        if name not in robot.joint_names:
            raise SceneError(
                f"passive: robot {robot.name!r} has no joint {name!r}: {robot.hint(str(name))}"
            )
    chosen = tuple(name for name in robot.joint_names if name in names)
    if chosen and len(chosen) == len(robot.joint_names):
        raise SceneError("every joint is passive; a motion needs one that carries torque.")
    return chosen
