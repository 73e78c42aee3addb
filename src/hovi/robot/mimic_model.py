"""Models with mimic joints, q_follower = m q_leader + o, in Pinocchio's representation.

Every such model has an uncoupled counterpart with all joints free, since some of Pinocchio's
algorithms, its archives and the kernel do not support mimic joints: q_all = G q + g, v_all = G v.
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.errors import ModelError
from hovi.robot.space.reordered_model import axis, continuous_joint, rebuilt
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

REMEDY = "; lock one of them, or load the robot without mimic=True."


@dataclass(frozen=True)
class Coupling:
    """q_follower = multiplier q_leader + offset, of two joints by name, in [rad] or [m].

    leader: "" if the follower is fixed at the offset.
    """

    follower: str
    leader: str
    multiplier: float = 1.0
    offset: float = 0.0

    def text(self) -> str:
        """The right-hand side as text."""
        factor = {1.0: "", -1.0: "-"}.get(self.multiplier, f"{self.multiplier:g} ")
        more = f" {'-' if self.offset < 0 else '+'} {abs(self.offset):g}" if self.offset else ""
        return f"{factor}{self.leader}{more}"


def couplings_of(model: pin.Model) -> tuple[Coupling, ...]:
    """The couplings of a model's mimic joints. Raises ModelError for a multiplier of 0."""
    found = []
    for follower, leader in zip(model.mimicking_joints, model.mimicked_joints, strict=True):
        joint = model.joints[follower].extract()
        names = str(model.names[follower]), str(model.names[leader])
        found.append(Coupling(*names, float(joint.scaling), float(joint.offset)))
        if found[-1].multiplier == 0.0:
            raise ModelError(
                f"joint {names[0]!r} mimics {names[1]!r} 0 times: make it a fixed joint."
            )
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
    """The matrix that adds followers' columns to their leaders' in Pinocchio's joint Jacobians.

    Shape (nv_all, nv), of zeros and ones; `pin.computeJointJacobians` gives (6, nv_all), with each
    follower's column times its multiplier.
    """
    return np.asarray(coupling_matrix(model) != 0.0, dtype=np.float64)


def coupled(model: pin.Model, couplings: Sequence[Coupling]) -> pin.Model:
    """A model of free joints with its followers turned into Pinocchio's mimic joints.

    Each leader comes before its followers. The followers lose limits, armature, damping, friction.
    """
    for coupling in couplings:
        ids = model.getJointId(coupling.leader), model.getJointId(coupling.follower)
        model = pin.transformJointIntoMimic(model, *ids, coupling.multiplier, coupling.offset)
    return model


def uncoupled(model: pin.Model) -> pin.Model:
    """A coupled model with all joints free, in the same order.

    Followers have as many coordinates as their leaders, and no armature, damping, friction or
    limits.
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
        angular = model.joints[leaders[joint.id]].nq == 2
        return (continuous_joint if angular else pin.JointModelRevoluteUnaligned)(about)

    return rebuilt(model, range(1, model.njoints), replacement)


@dataclass(frozen=True, eq=False)
class PortableModel:
    """A model that can be pickled: Pinocchio's archives do not restore mimic joints.

    free: the model with all joints free. couplings: of its joints.
    """

    free: pin.Model
    couplings: tuple[Coupling, ...]

    @classmethod
    def of(cls, model: pin.Model) -> PortableModel:
        """From any model."""
        couplings = couplings_of(model)
        return cls(uncoupled(model) if couplings else model, couplings)

    def model(self) -> pin.Model:
        """The coupled model."""
        return coupled(self.free, self.couplings)


@dataclass(frozen=True, eq=False)
class CoordinateMap:
    """The map from the coordinates of a coupled model to those of `uncoupled`.

    matrix: G of v_all = G v, shape (nv_all, nv).
    targets, sources: indices in q_all and in q of the independent joints' coordinates.
    followers, leaders: index of a follower's first coordinate in q_all, of its leader's in q.
    angular: which of them are (cos, sin) of an angle.
    multipliers, offsets: of the followers.
    """

    matrix: Array
    targets: Index
    sources: Index
    followers: Index
    leaders: Index
    angular: npt.NDArray[np.bool_]
    multipliers: Array
    offsets: Array

    @classmethod
    def of(cls, model: pin.Model, free: pin.Model) -> CoordinateMap:
        """From a coupled model and the same `uncoupled`."""
        own = [
            (other.idx_q + k, joint.idx_q + k)
            for joint, other in zip(list(model.joints)[1:], list(free.joints)[1:], strict=True)
            for k in range(joint.nq)  # none for a mimic joint
        ]
        targets, sources = np.array(own, dtype=np.intp).reshape(-1, 2).T
        leaders = [model.joints[i] for i in model.mimicked_joints]
        couplings = couplings_of(model)
        return cls(
            coupling_matrix(model),
            targets,
            sources,
            np.array([free.joints[i].idx_q for i in model.mimicking_joints], dtype=np.intp),
            np.array([joint.idx_q for joint in leaders], dtype=np.intp),
            np.array([joint.nq == 2 for joint in leaders], dtype=bool),
            np.array([coupling.multiplier for coupling in couplings]),
            np.array([coupling.offset for coupling in couplings]),
        )

    @property
    def size(self) -> int:
        """Length of q_all."""
        return len(self.targets) + len(self.followers) + int(self.angular.sum())

    def configurations(self, q: Array) -> Array:
        """q_all, shape (P, nq_all), of q, shape (P, nq)."""
        whole = np.empty((len(q), self.size))
        whole[:, self.targets] = q[:, self.sources]
        first, second = q[:, self.leaders], q[:, self.leaders + self.angular]
        leading = np.where(self.angular, np.arctan2(second, first), first)
        x = self.multipliers * leading + self.offsets
        whole[:, self.followers] = np.where(self.angular, np.cos(x), x)
        whole[:, self.followers[self.angular] + 1] = np.sin(x[:, self.angular])
        return whole

    def expression(self, q: ca.SX) -> ca.SX:
        """The same for expressions, (nq,) -> (nq_all,)."""
        whole = ca.SX.zeros(self.size)
        for target, source in zip(self.targets, self.sources, strict=True):
            whole[int(target)] = q[int(source)]
        for i, (target, first) in enumerate(zip(self.followers, self.leaders, strict=True)):
            k, j = int(target), int(first)
            leading = ca.atan2(q[j + 1], q[j]) if self.angular[i] else q[j]
            x = self.multipliers[i] * leading + self.offsets[i]
            if self.angular[i]:
                whole[k], whole[k + 1] = ca.cos(x), ca.sin(x)
            else:
                whole[k] = x
        return whole


def check_coupling(model: pin.Model, coupling: Coupling) -> None:
    """Raise ModelError for a coupling that is not possible."""
    leader, follower = (model.getJointId(n) for n in (coupling.leader, coupling.follower))
    what = f"joint {coupling.follower!r} mimics {coupling.leader!r}"
    for index in (leader, follower):
        if model.joints[index].nvExtended != 1:
            raise ModelError(
                f"{what}, but {model.names[index]!r} has more than one degree of freedom" + REMEDY
            )
    if leader in list(model.subtrees[follower]):
        raise ModelError(f"{what}, which comes after it in the chain" + REMEDY)
    if model.joints[leader].nq == 2 and not float(coupling.multiplier).is_integer():
        raise ModelError(
            f"{what}, a continuous joint, {coupling.multiplier:g} times: a full turn of "
            f"{coupling.leader!r} would not return the robot to the same configuration" + REMEDY
        )
