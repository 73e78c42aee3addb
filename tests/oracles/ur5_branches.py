"""The number of configurations of a UR5 for a pose of its tool, from the geometry of its axes.

The axes of joints 2 to 4 are parallel, along a horizontal unit vector n; that of joint 5 is
orthogonal to them and to that of joint 6, the z axis of the tool. The wrist centre lies at a known
distance along n, which leaves two n; two directions of axis 5 belong to each; and then the elbow
goes up or down if the links reach.
"""

from __future__ import annotations

import numpy as np

HEIGHT, ASIDE, LINKS = 0.089159, 0.10915, (0.425, 0.39225)
LAST = 0.09465, 0.0823
"""Lengths along the axes of joints 5 and 6, in [m]."""


def branch_count(pose: np.ndarray, margin: float = 1e-3) -> int | None:
    """Number of configurations up to full turns; None closer than `margin` [m] to a change of it.

    pose: of tool0 in the base, shape (4, 4).
    """
    z6 = pose[:3, 2]
    center = pose[:3, 3] - LAST[1] * z6
    radius, angle = np.hypot(center[0], center[1]), np.arctan2(center[1], center[0])
    if abs(radius - ASIDE) < margin:
        return None
    if radius < ASIDE:
        return 0
    count = 0
    for turn in (1, -1):
        n_angle = angle + turn * np.arccos(ASIDE / radius)
        n = np.array([np.cos(n_angle), np.sin(n_angle), 0.0])
        z5 = np.cross(n, z6)
        if np.linalg.norm(z5) < 10 * margin:
            return None
        for sign in (1, -1):
            wrist = center - sign * LAST[0] * z5 / np.linalg.norm(z5) - ASIDE * n
            reach = float(np.linalg.norm(wrist - [0, 0, HEIGHT]))
            shortest, longest = abs(LINKS[0] - LINKS[1]), sum(LINKS)
            if min(abs(reach - shortest), abs(reach - longest)) < margin:
                return None
            count += 2 * (shortest < reach < longest)
    return count
