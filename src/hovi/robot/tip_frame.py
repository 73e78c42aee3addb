"""The frames in which a robot ends: where a length is measured when no frame is named.

The last link of a file may be a sensor that is bolted to the world. What a person means is the tool
of an arm, the hands of a humanoid, the feet of a quadruped: the ends of the longest chains of
joints, up to the fingers of a hand that is named as one.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence

import pinocchio as pin

from hovi.robot.model import frame_id

END_WORDS = {"tool", "tcp", "ee", "eef", "effector", "hand", "gripper", "palm", "foot", "sole"}
"""The word with which the name of a tool, a hand or a foot ends."""
_PASSED_OVER = {"link", "frame", "body", "tip", "center", "point", "left", "right", "l", "r"}
"""Words that may follow it: "gripper_frame_link", "hand_l"."""
_WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")
_LINKS = (pin.FrameType.BODY, pin.FrameType.OP_FRAME)
_NAMED_IN_SENTENCES = 2


def tip_frames(model: pin.Model) -> tuple[str, ...]:
    """The frames at the ends of a model's longest chains of joints, the foremost one first.

    A chain is as long as the number of joints that move its end: a free-flyer and a joint that
    mimics another count as one each; fixed and locked joints are none of a model. Chains of the
    same length each have an end, and those named as tools come first; chains of fingers that part
    at one hand share that hand. The last link of a model in which nothing moves.
    """
    frames = _links_by_joint(model)
    chains = [list(support)[1:] for support in model.supports]
    longest = max(len(chain) for chain in chains)
    found = (_end_of(chain, frames) for chain in chains if len(chain) == longest)
    ends = dict.fromkeys(name for name in found if name)
    if not ends:
        return (_last_link(model),)
    return tuple(sorted(ends, key=lambda name: not named_as_end(name)))


def named_as_end(frame: str) -> bool:
    """Whether a frame's name says that it is a tool, a hand or a foot: "tool0", "leftHandLink".

    A word in the middle says nothing of the kind: "hand_index_link", "left_hand_camera".
    """
    words = [word.lower() for word in _WORD.findall(frame)]
    while words and words[-1] in _PASSED_OVER:
        words.pop()
    return bool(words) and words[-1] in END_WORDS


def is_moved(model: pin.Model, frame: str) -> bool:
    """Whether a joint stands between the world and a frame of the model."""
    return bool(model.frames[frame_id(model, frame)].parentJoint > 0)


def names_in_words(frames: Sequence[str]) -> str:
    """Frames in a sentence: "left and right", "left and 3 more"."""
    if len(frames) <= _NAMED_IN_SENTENCES:
        return " and ".join(frames)
    return f"{frames[0]} and {len(frames) - 1} more"


def _end_of(chain: Sequence[int], frames: Mapping[int, Sequence[str]]) -> str:
    """The end of a chain of joints; "" where it carries no frame.

    A hand counts if at least half of the chain moves it: beyond a wrist of two joints it is the
    long fingers that matter.
    """
    for joint in reversed(chain[(len(chain) - 1) // 2 :]):
        named = [name for name in frames.get(joint, ()) if named_as_end(name)]
        if named:
            return named[-1]
    return next((frames[joint][-1] for joint in reversed(chain) if joint in frames), "")


def _links_by_joint(model: pin.Model) -> dict[int, list[str]]:
    """Names of what a joint carries: links and operational frames, or what else there is."""
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
