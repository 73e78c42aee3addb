"""Joints with a <mimic> tag: read from a URDF, and coupled in a model of free joints.

Pinocchio reads from a URDF only those whose leader it meets first, and drops the limits and
losses of all. Here a model is built with every joint on its own, then put in an order in which
leaders come first, and then coupled.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

import numpy as np
import pinocchio as pin

from hovi.errors import ModelError
from hovi.robot.mimic_model import CURE, Coupling, check_coupling, coupled
from hovi.robot.reordered_model import axis, continuous_joint, rebuilt
from hovi.robot.urdf.check import checked_urdf

_LARGEST = float(np.finfo(float).max)
"""Pinocchio's limit where a URDF states none."""


def read_couplings(
    text: str, name: str = "robot.urdf", locked: Collection[str] = ()
) -> tuple[Coupling, ...]:
    """The <mimic> tags of a URDF's movable joints, followed to joints that mimic no other.

    name: what to call the URDF in a message. locked: joints that stand still although they mimic
    others, where chains end too. Raises ModelError for a leader that does not exist
    and for joints that mimic each other in a ring.
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
                f"URDF {name!r}: joint {follower!r} mimics {leader!r}, which is no joint of it: "
                "correct that name, or load the robot without mimic=True."
            )
        factor, offset = float(mimic.get("multiplier", 1.0)), float(mimic.get("offset", 0.0))
        if joints[leader].get("type") == "fixed" or factor == 0.0:
            leader, factor = "", 0.0
        stated[follower] = Coupling(follower, leader, factor, offset)
    following = {name: coupling for name, coupling in stated.items() if name not in locked}
    return tuple(_to_the_end(coupling, following) for coupling in stated.values())


def _to_the_end(coupling: Coupling, following: Mapping[str, Coupling]) -> Coupling:
    """The coupling with a leader that follows no other joint."""
    for _ in following:
        if coupling.leader not in following:
            return coupling
        before = following[coupling.leader]
        factor = coupling.multiplier * before.multiplier
        offset = coupling.multiplier * before.offset + coupling.offset
        coupling = Coupling(coupling.follower, before.leader, factor, offset)
    if coupling.leader not in following:
        return coupling
    raise ModelError(f"joint {coupling.follower!r} mimics itself in the end: break that ring.")


def held_values(couplings: Iterable[Coupling], locked: Sequence[str]) -> dict[str, float]:
    """Where joints stand that cannot move: locked ones at 0, followers of such at their offset."""
    held = dict.fromkeys(locked, 0.0)
    for coupling in couplings:
        if coupling.leader == "" or coupling.leader in locked:
            held.setdefault(coupling.follower, coupling.offset)
    return held


def with_mimics(model: pin.Model, couplings: Sequence[Coupling]) -> pin.Model:
    """A model of free joints, leaders first, with followers that follow.

    Its limits keep followers in their own, too, and its armature and losses hold their share:
    those of a follower count multiplier^2 times at the leader, dry friction |multiplier| times.
    """
    model = model.copy()
    for coupling in couplings:
        _hand_over(model, coupling)
    return coupled(model, couplings)


def leaders_first(model: pin.Model, couplings: Sequence[Coupling]) -> pin.Model:
    """The model with joints in an order in which leaders come before their followers.

    A follower becomes a joint of as many numbers as its leader: (cos, sin) or an angle.
    Raises ModelError for couplings that no such model has.
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
        return _like(joint, model.joints[model.getJointId(coupling.leader)], coupling)

    same = order == list(range(1, model.njoints))
    if same and all(replacement(joint) is joint for joint in list(model.joints)[1:]):
        return model
    return rebuilt(model, order, replacement)


def _like(joint: pin.JointModel, leader: pin.JointModel, coupling: Coupling) -> pin.JointModel:
    """A follower with as many numbers in q as its leader."""
    if joint.nq == leader.nq:
        return joint
    about = axis(joint)[1]
    if leader.nq == 1:
        return pin.JointModelRevoluteUnaligned(about)
    if not about.any():
        raise ModelError(
            f"joint {coupling.follower!r} slides and mimics {coupling.leader!r}, a continuous "
            "joint, which has no angle to count" + CURE
        )
    return continuous_joint(about)


def _order(model: pin.Model, pairs: Sequence[tuple[int, int]]) -> Iterator[int]:
    """Joints depth first, (leader, follower) in this order, otherwise as they were."""
    waiting = [0]
    while waiting:
        joint = waiting.pop()
        if joint:
            yield joint
        children = [i for i in range(1, model.njoints) if model.parents[i] == joint]
        waiting += reversed(_sorted(model, children, pairs))


def _sorted(model: pin.Model, children: list[int], pairs: Sequence[tuple[int, int]]) -> list[int]:
    """Branches of a joint, each after those with leaders of its followers."""
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
            raise ModelError(f"the branches of {names} mimic joints of each other" + CURE)
        done.append(ready[0])
    return done


def _hand_over(model: pin.Model, coupling: Coupling) -> None:
    """Put the limits, armature and losses of a follower upon its leader, in place."""
    ends = coupling.leader, coupling.follower
    leader, follower = (model.joints[model.getJointId(name)] for name in ends)
    i, j, size = leader.idx_v, follower.idx_v, abs(coupling.multiplier)
    shares = dict.fromkeys(("armature", "damping"), size**2)
    shares |= dict.fromkeys(("lowerDryFrictionLimit", "upperDryFrictionLimit"), size)
    for key, share in shares.items():
        values = getattr(model, key)
        _put(model, key, i, values[i] + share * values[j])
    own, speed = model.upperVelocityLimit[i], model.upperVelocityLimit[j] / size
    if speed > 0.0 and (own == 0.0 or speed < own):
        _put(model, "upperVelocityLimit", i, speed)
        _put(model, "lowerVelocityLimit", i, -speed)
    if leader.nq == 1:
        _narrow(model, leader.idx_q, follower.idx_q, coupling)


def _narrow(model: pin.Model, i: int, j: int, coupling: Coupling) -> None:
    """Keep place i of q where place j stays within its range, too.

    Published robots state ranges that exclude each other (a follower at -1 times its leader with
    the leader's own range): then that of the leader counts.
    """
    ends = []
    for end in (model.lowerPositionLimit[j], model.upperPositionLimit[j]):
        free = abs(end) >= _LARGEST
        sign = np.sign(end) * np.sign(coupling.multiplier)
        ends.append(sign * _LARGEST if free else (end - coupling.offset) / coupling.multiplier)
    lower = max(model.lowerPositionLimit[i], min(ends))
    upper = min(model.upperPositionLimit[i], max(ends))
    if lower < upper:
        _put(model, "lowerPositionLimit", i, lower)
        _put(model, "upperPositionLimit", i, upper)


def _put(model: pin.Model, key: str, place: int, value: float) -> None:
    values = np.array(getattr(model, key))
    values[place] = value
    setattr(model, key, values)
