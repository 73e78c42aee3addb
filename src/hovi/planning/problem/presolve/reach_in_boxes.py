"""Whether a frame can be at its goal while every joint stays in a range: a proof that it cannot.

Let the joints be within w of a configuration. Changing them one after the other from the base to
the tip moves the frame's origin by at most

    sum_i 2 d_i sin(min(w_i, pi) / 2)   over rotations,  + sum_i w_i over translations,

with d_i the distance of the origin from the axis of joint i, which the joints before do not change;
and turns it by at most the sum of w_i over rotations. A box of configurations whose center misses
the goal by more is left out; the others are halved, where the joint contributes most.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.dynamics.kinematic_chain import KinematicChain
from hovi.planning.problem.frame_goal import FrameGoal

Array = npt.NDArray[np.float64]

MAX_BOXES = 60_000
"""Number of boxes after which there is no proof."""
BATCH = 2_000
"""Largest number of boxes that are looked at together."""
ROUNDING = 1e-6
"""Distance [m] and angle [rad] by which a miss has to exceed its bound."""


def proven_out_of_reach(chain: KinematicChain, goal: FrameGoal, lower: Array, upper: Array) -> bool:
    """Whether no configuration with the chain's joints in a box reaches the goal.

    lower, upper: of the box, shape (n,), in [rad] or [m]. False where no proof was found.
    """
    if not np.isfinite(upper - lower).all():
        return False
    centers, widths = (lower + upper)[None] / 2, (upper - lower)[None] / 2
    looked_at = 0
    while len(centers):
        looked_at += min(len(centers), BATCH)
        if looked_at > MAX_BOXES:
            return False
        now, later = slice(0, BATCH), slice(BATCH, None)
        kept, joint = _undecided(chain, goal, centers[now], widths[now])
        first, second = _halved(centers[now][kept], widths[now][kept], joint)
        centers = np.concatenate([first[0], second[0], centers[later]])
        widths = np.concatenate([first[1], second[1], widths[later]])
    return True


def _undecided(
    chain: KinematicChain, goal: FrameGoal, centers: Array, widths: Array
) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.intp]]:
    """Which boxes (M, n) may reach the goal, and where these are halved."""
    origin, rotation, arms = _placed(chain, centers)
    turns = np.where(chain.angular != 0, widths, 0.0)
    moves = 2 * arms * np.sin(np.minimum(turns, np.pi) / 2) + np.abs(chain.linear) * widths
    kept, fraction = np.ones(len(centers), dtype=bool), np.zeros_like(centers)
    if goal.position is not None:
        miss = np.linalg.norm(origin - np.asarray(goal.position), axis=1)
        kept &= miss <= moves.sum(axis=1) + ROUNDING
        fraction += moves / np.maximum(miss, ROUNDING)[:, None]
    angle = _angle(goal, rotation)
    if angle is not None:
        kept &= angle <= turns.sum(axis=1) + ROUNDING
        fraction += turns / np.maximum(angle, ROUNDING)[:, None]
    return kept, np.argmax(fraction[kept], axis=1)


def _angle(goal: FrameGoal, rotation: Array) -> Array | None:
    """The angles by which frames (M, 3, 3) miss the goal; None if it has no direction."""
    if goal.rotation is not None:
        chord = np.linalg.norm(rotation - np.asarray(goal.rotation), axis=(1, 2)) / np.sqrt(2)
    elif goal.directions is not None:
        inner, world = goal.directions
        chord = np.linalg.norm(rotation @ inner - world, axis=1)
    else:
        return None
    return np.asarray(2 * np.arcsin(np.minimum(chord / 2, 1.0)))


def _placed(chain: KinematicChain, angles: Array) -> tuple[Array, Array, Array]:
    """The frame's origin (M, 3) and axes (M, 3, 3), and its distance from each axis, (M, n)."""
    M, n = angles.shape
    R, p = np.broadcast_to(np.eye(3), (M, 3, 3)), np.zeros((M, 3))
    points, axes = np.empty((n, M, 3)), np.empty((n, M, 3))
    for i in range(n):
        p = p + R @ chain.translations[i]
        R = R @ chain.rotations[i]
        points[i], axes[i] = p, R[:, :, 2]
        p = p + R[:, :, 2] * (chain.linear[i] * angles[:, i])[:, None]
        R = R @ _about_z(chain.angular[i] * angles[:, i])
    origin = p + R @ chain.tip.translation
    arms = np.linalg.norm(np.cross(axes, origin - points), axis=2).T
    return origin, R @ chain.tip.rotation, arms


def _about_z(angle: Array) -> Array:
    """Rotations about z, (M, 3, 3)."""
    R = np.zeros((len(angle), 3, 3))
    R[:, 0, 0] = R[:, 1, 1] = np.cos(angle)
    R[:, 1, 0] = np.sin(angle)
    R[:, 0, 1] = -R[:, 1, 0]
    R[:, 2, 2] = 1.0
    return R


def _halved(
    centers: Array, widths: Array, joint: npt.NDArray[np.intp]
) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Both halves of boxes (M, n), as centers and widths."""
    rows = np.arange(len(centers))
    narrow = widths.copy()
    narrow[rows, joint] /= 2
    shift = np.zeros_like(centers)
    shift[rows, joint] = narrow[rows, joint]
    return (centers - shift, narrow), (centers + shift, narrow)
