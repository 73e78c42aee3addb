"""A motion as the table of joint positions that libfranka's example of trajectories reads.

The example `execute_trajectory` of [libfranka], up to its version 0.1.0, reads seven numbers with a
character after each, by `stream >> q[i] >> delimiter`, and commands a row a millisecond. So each
row but the last ends with a comma, too: without it, the first character of the next row, such as a
minus sign, would be read as the delimiter; with one after the last row, a row would be read that is
not there.
"""

from __future__ import annotations

import os

import numpy as np

from hovi.discrete.joined_motion import AnyMotion, JoinedMotion
from hovi.errors import InputError, warn
from hovi.exchange.arm_samples import FRANKA, arm_samples
from hovi.exchange.whole_export import whole_export

RATE = 1000.0
"""Rows per second that the control interface takes."""
STILL = 1e-3
"""Acceleration of a joint at an end below which none is reported, in [rad/s^2]."""


def write_franka(motion: AnyMotion, path: str | os.PathLike[str], rate: float = RATE) -> None:
    """Write q_1, ..., q_7 in [rad] in full precision, a row per millisecond.

    Warns of a motion whose acceleration is not zero at its ends, as the interface recommends.
    rate: 1000, and no other. Raises InputError for another one and for a motion that `arm_samples`
    refuses; DisplayError when the file cannot be written.
    """
    samples = arm_samples(motion, rate, FRANKA)
    if rate != RATE:
        raise InputError(
            f"the control interface of Franka takes 1000 rows per second, got a rate of {rate:g}: "
            "leave it out."
        )
    parts = motion.motions if isinstance(motion, JoinedMotion) else (motion,)
    jump = max(float(np.abs(each.sample([0.0, each.duration]).a).max()) for each in parts)
    if jump > STILL:
        warn(
            f"this motion begins or ends with an acceleration of {jump:.3g} rad/s^2, and the "
            "control interface of Franka recommends none: plan it with smooth=True."
        )
    rows = (",".join(map(repr, row)) for row in samples.q.tolist())
    with whole_export(path, "table") as stream:
        stream.write((",\n".join(rows) + "\n").encode())
