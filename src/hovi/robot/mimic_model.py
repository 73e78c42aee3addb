"""Models with joints that mimic others, as Pinocchio has them: q_follower = m q_leader + o.

Beside every such model stands the same robot with all joints on their own, of which Pinocchio's
other algorithms, its archives and the kernel know more: q_all = G q + g, v_all = G v.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.errors import ModelError
from hovi.robot.reordered_model import axis, continuous_joint, rebuilt

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

CURE = "; lock one of them, or load the robot without mimic=True."


@dataclass(frozen=True)
class Coupling:
    """q_follower = multiplier q_leader + offset, of two joints by name, in [rad] or [m].

    leader: "" where the follower is held at the offset.
    """

    follower: str
    leader: str
    multiplier: float = 1.0
    offset: float = 0.0

    def text(self) -> str:
        """The right-hand side in words."""
        factor = {1.0: "", -1.0: "-"}.get(self.multiplier, f"{self.multiplier:g} ")
        more = f" {'-' if self.offset < 0 else '+'} {abs(self.offset):g}" if self.offset else ""
        return f"{factor}{self.leader}{more}"


def couplings_of(model: pin.Model) -> tuple[Coupling, ...]:
    """The couplings of a model's mimic joints. Raises ModelError for one that never moves."""
    found = []
    for follower, leader in zip(model.mimicking_joints, model.mimicked_joints, strict=True):
        joint = model.joints[follower].extract()
        names = str(model.names[follower]), str(model.names[leader])
        found.append(Coupling(*names, float(joint.scaling), float(joint.offset)))
        if found[-1].multiplier == 0.0:
            raise ModelError(f"joint {names[0]!r} mimics {names[1]!r} 0 times: make it fixed.")
    return tuple(found)


def coupling_matrix(model: pin.Model) -> Array:
    """G of v_all = G v, shape (nv_all, nv): v_all is that of `uncoupled`, in the same order."""
    factors = {c.follower: c.multiplier for c in couplings_of(model)}
    rows = []
    for name, joint in zip(list(model.names)[1:], list(model.joints)[1:], strict=True):
        block = np.zeros((joint.nvExtended, model.nv))
        block[:, joint.idx_v : joint.idx_v + joint.nvExtended] = np.eye(joint.nvExtended)
        rows.append(factors.get(str(name), 1.0) * block)
    return np.concatenate(rows)


def column_sums(model: pin.Model) -> Array:
    """What adds a follower's columns to its leader's in Pinocchio's joint Jacobians.

    Shape (nv_all, nv), of ones: `pin.computeJointJacobians` gives (6, nv_all), a follower's
    column times its multiplier.
    """
    return np.asarray(coupling_matrix(model) != 0.0, dtype=np.float64)


def coupled(model: pin.Model, couplings: Sequence[Coupling]) -> pin.Model:
    """A model of free joints with its followers turned into Pinocchio's mimic joints.

    Each leader comes before its followers. Limits, armature and losses of followers are gone.
    """
    for coupling in couplings:
        ids = model.getJointId(coupling.leader), model.getJointId(coupling.follower)
        model = pin.transformJointIntoMimic(model, *ids, coupling.multiplier, coupling.offset)
    return model


def uncoupled(model: pin.Model) -> pin.Model:
    """A coupled model with every joint on its own, in the same order.

    Followers have an axis of their own, as many numbers as their leaders, no armature, no losses
    and no limits.
    """
    leaders = dict(zip(model.mimicking_joints, model.mimicked_joints, strict=True))

    def replacement(joint: pin.JointModel) -> pin.JointModel:
        if joint.id not in leaders:
            return joint
        along, about = (part / joint.extract().scaling for part in axis(joint))
        if not about.any():
            return pin.JointModelPrismaticUnaligned(along)
        if along.any():
            return pin.JointModelHelicalUnaligned(about, float(along @ about))
        turning = model.joints[leaders[joint.id]].nq == 2
        return (continuous_joint if turning else pin.JointModelRevoluteUnaligned)(about)

    return rebuilt(model, range(1, model.njoints), replacement)


@dataclass(frozen=True, eq=False)
class PortableModel:
    """What of a model goes to another process: Pinocchio's archives lose the size of mimic joints.

    free: the model with every joint on its own. couplings: of its joints.
    """

    free: pin.Model
    couplings: tuple[Coupling, ...]

    @classmethod
    def of(cls, model: pin.Model) -> PortableModel:
        """From any model."""
        couplings = couplings_of(model)
        return cls(uncoupled(model) if couplings else model, couplings)

    def model(self) -> pin.Model:
        """The model again."""
        return coupled(self.free, self.couplings)


@dataclass(frozen=True, eq=False)
class Pull:
    """The map from the coordinates of a coupled model to those of `uncoupled`.

    matrix: G of v_all = G v, shape (nv_all, nv).
    places, sources: where what leads stands in q_all and in q.
    followers, leaders: where q_all and q hold the first number of a follower and of its leader.
    turning: which of them hold (cos, sin) of an angle.
    multipliers, offsets: of the followers.
    """

    matrix: Array
    places: Index
    sources: Index
    followers: Index
    leaders: Index
    turning: npt.NDArray[np.bool_]
    multipliers: Array
    offsets: Array

    @classmethod
    def of(cls, model: pin.Model, free: pin.Model) -> Pull:
        """From a coupled model and the same `uncoupled`."""
        own = [
            (other.idx_q + k, joint.idx_q + k)
            for joint, other in zip(list(model.joints)[1:], list(free.joints)[1:], strict=True)
            for k in range(joint.nq)  # none where it mimics
        ]
        places, sources = np.array(own, dtype=np.intp).reshape(-1, 2).T
        leaders = [model.joints[i] for i in model.mimicked_joints]
        couplings = couplings_of(model)
        return cls(
            coupling_matrix(model),
            places,
            sources,
            np.array([free.joints[i].idx_q for i in model.mimicking_joints], dtype=np.intp),
            np.array([joint.idx_q for joint in leaders], dtype=np.intp),
            np.array([joint.nq == 2 for joint in leaders], dtype=bool),
            np.array([coupling.multiplier for coupling in couplings]),
            np.array([coupling.offset for coupling in couplings]),
        )

    @property
    def size(self) -> int:
        """Numbers in q_all."""
        return len(self.places) + len(self.followers) + int(self.turning.sum())

    def configurations(self, q: Array) -> Array:
        """q_all, shape (P, nq_all), of q, shape (P, nq)."""
        whole = np.empty((len(q), self.size))
        whole[:, self.places] = q[:, self.sources]
        first, second = q[:, self.leaders], q[:, self.leaders + self.turning]
        leading = np.where(self.turning, np.arctan2(second, first), first)
        x = self.multipliers * leading + self.offsets
        whole[:, self.followers] = np.where(self.turning, np.cos(x), x)
        whole[:, self.followers[self.turning] + 1] = np.sin(x[:, self.turning])
        return whole

    def expression(self, q: ca.SX) -> ca.SX:
        """The same of expressions, (nq,) -> (nq_all,)."""
        whole = ca.SX.zeros(self.size)
        for place, source in zip(self.places, self.sources, strict=True):
            whole[int(place)] = q[int(source)]
        for i, (place, first) in enumerate(zip(self.followers, self.leaders, strict=True)):
            k, j = int(place), int(first)
            leading = ca.atan2(q[j + 1], q[j]) if self.turning[i] else q[j]
            x = self.multipliers[i] * leading + self.offsets[i]
            if self.turning[i]:
                whole[k], whole[k + 1] = ca.cos(x), ca.sin(x)
            else:
                whole[k] = x
        return whole


def check_coupling(model: pin.Model, coupling: Coupling) -> None:
    """Raise ModelError for a coupling that makes no sense."""
    leader, follower = (model.getJointId(n) for n in (coupling.leader, coupling.follower))
    what = f"joint {coupling.follower!r} mimics {coupling.leader!r}"
    for index in (leader, follower):
        if model.joints[index].nvExtended != 1:
            raise ModelError(
                f"{what}, but {model.names[index]!r} does not move by one number" + CURE
            )
    if leader in list(model.subtrees[follower]):
        raise ModelError(f"{what}, which it carries itself" + CURE)
    if model.joints[leader].nq == 2 and not float(coupling.multiplier).is_integer():
        raise ModelError(
            f"{what}, a continuous joint, {coupling.multiplier:g} times: after a full turn of "
            f"{coupling.leader!r} the robot would not be where it was" + CURE
        )
