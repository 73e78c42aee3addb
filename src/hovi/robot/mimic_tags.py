"""Joints with a <mimic> tag: read from a URDF, and coupled in a model of free joints.

Pinocchio's URDF parser couples only joints that come after their leader, and drops the limits,
damping and friction of mimic joints. Here the model is built with all joints free, then reordered
such that leaders come first, and then coupled.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

import numpy as np
import pinocchio as pin

from hovi.errors import ModelError
from hovi.robot.mimic_model import REMEDY, Coupling, check_coupling, coupled
from hovi.robot.space.reordered_model import axis, continuous_joint, rebuilt
from hovi.robot.urdf.check import checked_urdf

_NO_LIMIT = float(np.finfo(float).max)
"""Pinocchio's limit where a URDF states none."""


def read_couplings(
    text: str, name: str = "robot.urdf", locked: Collection[str] = ()
) -> tuple[Coupling, ...]:
    """The <mimic> tags of a URDF's movable joints, with chains resolved to their first leader.

    name: of the URDF, for messages. locked: joints that are fixed even if they mimic others; chains
    end there. Raises ModelError for a leader that does not exist and for cyclic couplings.
    """
    joints = {joint.get("name", ""): joint for joint in checked_urdf(text, name).iterfind("joint")}
    stated = {}
    for follower, joint in joints.items():
        mimic = joint.find("mimic")
        if mimic is None or joint.get("type") == "fixed":
            continue
        leader = mimic.get("joint", "")
        if leader not in joints:
            raise ModelError(
                f"URDF {name!r}: joint {follower!r} mimics {leader!r}, which does not exist: "
                "correct that name, or load the robot without mimic=True."
            )
        factor, offset = float(mimic.get("multiplier", 1.0)), float(mimic.get("offset", 0.0))
        if joints[leader].get("type") == "fixed" or factor == 0.0:
            leader, factor = "", 0.0
        stated[follower] = Coupling(follower, leader, factor, offset)
    following = {name: coupling for name, coupling in stated.items() if name not in locked}
    return tuple(_resolved(coupling, following) for coupling in stated.values())


def _resolved(coupling: Coupling, following: Mapping[str, Coupling]) -> Coupling:
    """The coupling with the first leader of its chain."""
    for _ in following:
        if coupling.leader not in following:
            return coupling
        before = following[coupling.leader]
        factor = coupling.multiplier * before.multiplier
        offset = coupling.multiplier * before.offset + coupling.offset
        coupling = Coupling(coupling.follower, before.leader, factor, offset)
    if coupling.leader not in following:
        return coupling
    raise ModelError(f"joint {coupling.follower!r} mimics itself through others: break that cycle.")


def held_values(couplings: Iterable[Coupling], locked: Mapping[str, float]) -> dict[str, float]:
    """Positions of fixed joints: of the locked ones, and of their followers, which follow them."""
    held = dict(locked)
    for coupling in couplings:
        if coupling.leader == "" or coupling.leader in locked:
            at = locked.get(coupling.leader, 0.0)
            held.setdefault(coupling.follower, coupling.multiplier * at + coupling.offset)
    return held


def with_mimics(model: pin.Model, couplings: Sequence[Coupling]) -> pin.Model:
    """A model of free joints, leaders first, with its followers turned into mimic joints.

    The limits of a leader are tightened to those of its followers, and the followers' armature and
    damping are added with the factor multiplier^2, their dry friction with |multiplier|.
    """
    model = model.copy()
    for coupling in couplings:
        _transfer_properties(model, coupling)
    return coupled(model, couplings)


def leaders_first(model: pin.Model, couplings: Sequence[Coupling]) -> pin.Model:
    """The model with its joints reordered such that leaders come before their followers.

    A follower gets the coordinates of its leader: (cos, sin) or an angle.
    Raises ModelError if there is no such order, or a coupling is not possible.
    """
    by_id = {model.getJointId(c.follower): c for c in couplings}
    for coupling in couplings:
        check_coupling(model, coupling)
    pairs = [(model.getJointId(c.leader), follower) for follower, c in by_id.items()]
    order = list(_order(model, pairs))

    def replacement(joint: pin.JointModel) -> pin.JointModel:
        coupling = by_id.get(joint.id)
        if coupling is None:
            return joint
        return _matching_joint(joint, model.joints[model.getJointId(coupling.leader)], coupling)

    same = order == list(range(1, model.njoints))
    if same and all(replacement(joint) is joint for joint in list(model.joints)[1:]):
        return model
    return rebuilt(model, order, replacement)


def _matching_joint(
    joint: pin.JointModel, leader: pin.JointModel, coupling: Coupling
) -> pin.JointModel:
    """A joint like the follower that has as many coordinates in q as its leader."""
    if joint.nq == leader.nq:
        return joint
    about = axis(joint)[1]
    if leader.nq == 1:
        return pin.JointModelRevoluteUnaligned(about)
    if not about.any():
        raise ModelError(
            f"joint {coupling.follower!r} is prismatic and mimics {coupling.leader!r}, a "
            "continuous joint, whose angle is not unique" + REMEDY
        )
    return continuous_joint(about)


def _order(model: pin.Model, pairs: Sequence[tuple[int, int]]) -> Iterator[int]:
    """Joints depth first, leaders before followers, otherwise in their original order."""
    waiting = [0]
    while waiting:
        joint = waiting.pop()
        if joint:
            yield joint
        children = [i for i in range(1, model.njoints) if model.parents[i] == joint]
        waiting += reversed(_sorted(model, children, pairs))


def _sorted(model: pin.Model, children: list[int], pairs: Sequence[tuple[int, int]]) -> list[int]:
    """The branches at a joint, each after the branches with the leaders of its followers."""
    branches = {child: set(model.subtrees[child]) for child in children}
    done: list[int] = []
    while len(done) < len(children):
        left = [child for child in children if child not in done]
        ready = [
            child
            for child in left
            if not any(
                follower in branches[child] and leader in branches[other]
                for leader, follower in pairs
                for other in left
                if other != child
            )
        ]
        if not ready:
            names = " and ".join(repr(str(model.names[child])) for child in left[:2])
            raise ModelError(f"the branches of {names} mimic joints of each other" + REMEDY)
        done.append(ready[0])
    return done


def _transfer_properties(model: pin.Model, coupling: Coupling) -> None:
    """Apply the limits, armature, damping and friction of a follower to its leader."""
    ends = coupling.leader, coupling.follower
    leader, follower = (model.joints[model.getJointId(name)] for name in ends)
    i, j, size = leader.idx_v, follower.idx_v, abs(coupling.multiplier)
    factors = dict.fromkeys(("armature", "damping"), size**2)
    factors |= dict.fromkeys(("lowerDryFrictionLimit", "upperDryFrictionLimit"), size)
    for key, factor in factors.items():
        values = getattr(model, key)
        _set_entry(model, key, i, values[i] + factor * values[j])
    own, speed = model.upperVelocityLimit[i], model.upperVelocityLimit[j] / size
    if speed > 0.0 and (own == 0.0 or speed < own):
        _set_entry(model, "upperVelocityLimit", i, speed)
        _set_entry(model, "lowerVelocityLimit", i, -speed)
    if leader.nq == 1:
        _tighten_range(model, leader.idx_q, follower.idx_q, coupling)


def _tighten_range(model: pin.Model, i: int, j: int, coupling: Coupling) -> None:
    """Tighten the range of q[i], the leader, such that q[j], the follower, keeps its own.

    In published robots the two may be disjoint (a follower at -1 times its leader with the
    leader's own range): then the leader keeps its range.
    """
    ends = []
    for end in (model.lowerPositionLimit[j], model.upperPositionLimit[j]):
        free = abs(end) >= _NO_LIMIT
        sign = np.sign(end) * np.sign(coupling.multiplier)
        ends.append(sign * _NO_LIMIT if free else (end - coupling.offset) / coupling.multiplier)
    lower = max(model.lowerPositionLimit[i], min(ends))
    upper = min(model.upperPositionLimit[i], max(ends))
    if lower < upper:
        _set_entry(model, "lowerPositionLimit", i, lower)
        _set_entry(model, "upperPositionLimit", i, upper)


def _set_entry(model: pin.Model, key: str, index: int, value: float) -> None:
    values = np.array(getattr(model, key))
    values[index] = value
    setattr(model, key, values)
