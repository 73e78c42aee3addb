"""The tips of a robot, at which lengths are measured if no frame is named.

The last link of a URDF may be a sensor that is fixed to the world. Users mean the tool of an arm,
the hands of a humanoid, the feet of a quadruped: the ends of the longest chains of joints, without
the fingers of a hand.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.robot.mimic_model import couplings_of
from hovi.robot.model import frame_named

END_EFFECTORS = {
    "tool",
    "tcp",
    "ee",
    "eef",
    "effector",
    "hand",
    "gripper",
    "palm",
    "foot",
    "sole",
}
"""Last word in the name of a tool, hand or foot."""
_IGNORED_WORDS = {"link", "frame", "body", "tip", "center", "point", "left", "right", "l", "r"}
"""Words that may follow it, as in "gripper_frame_link" or "hand_l"."""
_WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")
_LINKS = (pin.FrameType.BODY, pin.FrameType.OP_FRAME)
_MAX_NAMES = 2


def tip_frames(model: pin.Model) -> tuple[str, ...]:
    """The frames at the ends of a model's longest chains of joints.

    The length of a chain is its number of joints: a free-flyer and a mimic joint count as one each;
    the model has no fixed and locked joints. Each chain of the largest length has a tip, and
    chains that branch at a hand share it. Tips with the name of a tool, hand or foot come first,
    then the order is the model's. The last link if the model has no joint.
    """
    frames = _links_by_joint(model)
    chains = [list(support)[1:] for support in model.supports]
    longest = max(len(chain) for chain in chains)
    found = (_tip_of(chain, frames) for chain in chains if len(chain) == longest)
    tips = dict.fromkeys(name for name in found if name)
    if not tips:
        return (_last_link(model),)
    return tuple(sorted(tips, key=lambda name: not is_end_effector_name(name)))


def is_end_effector_name(frame: str) -> bool:
    """Whether a frame has the name of a tool, hand or foot, such as "tool0" or "leftHandLink".

    The last word decides: "hand_index_link" and "left_hand_camera" are not end effectors.
    """
    words = [word.lower() for word in _WORD.findall(frame)]
    while words and words[-1] in _IGNORED_WORDS:
        words.pop()
    return bool(words) and words[-1] in END_EFFECTORS


def is_moved(model: pin.Model, frame: str) -> bool:
    """Whether there is a joint between the world and a frame."""
    return bool(frame_named(model, frame).parentJoint > 0)


def moves_frame(model: pin.Model, frame: str) -> npt.NDArray[np.bool_]:
    """Which entries of v move a frame, (nv,); for a joint that mimics another, its leader's."""
    found = np.zeros(model.nv, dtype=bool)
    leaders = {coupling.follower: coupling.leader for coupling in couplings_of(model)}
    for joint in list(model.supports[frame_named(model, frame).parentJoint])[1:]:
        name = str(model.names[joint])
        member = model.joints[model.getJointId(leaders.get(name, name))]
        found[member.idx_v : member.idx_v + member.nv] = True
    return found


def names_in_words(frames: Sequence[str]) -> str:
    """Frames for a message: "left and right", "left and 3 more"."""
    if len(frames) <= _MAX_NAMES:
        return " and ".join(frames)
    return f"{frames[0]} and {len(frames) - 1} more"


def _tip_of(chain: Sequence[int], frames: Mapping[int, Sequence[str]]) -> str:
    """The tip of a chain of joints; "" if it has no frame.

    A hand is a tip only if at least half of the chain's joints move it: for a dexterous hand on a
    short wrist the fingers matter.
    """
    for joint in reversed(chain[(len(chain) - 1) // 2 :]):
        named = [name for name in frames.get(joint, ()) if is_end_effector_name(name)]
        if named:
            return named[-1]
    return next((frames[joint][-1] for joint in reversed(chain) if joint in frames), "")


def _links_by_joint(model: pin.Model) -> dict[int, list[str]]:
    """Names of the links and operational frames of each joint, or of its other frames if none."""
    links, others = (_by_joint(_frames(model, are_links)) for are_links in (True, False))
    return others | links


def _frames(model: pin.Model, are_links: bool) -> Iterator[pin.Frame]:
    return (frame for frame in model.frames if (frame.type in _LINKS) == are_links)


def _by_joint(frames: Iterable[pin.Frame]) -> dict[int, list[str]]:
    found: dict[int, list[str]] = {}
    for frame in frames:
        found.setdefault(int(frame.parentJoint), []).append(str(frame.name))
    return found


def _last_link(model: pin.Model) -> str:
    links = [str(frame.name) for frame in _frames(model, are_links=True)]
    return links[-1] if links else str(model.frames[-1].name)
