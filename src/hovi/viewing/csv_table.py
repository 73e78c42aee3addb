"""A motion as a CSV table for other programs."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments_except
from hovi.discrete.joined_motion import AnyMotion, JoinedMotion
from hovi.discrete.trajectory import Sample, Trajectory
from hovi.errors import DisplayError, InputError, expect
from hovi.system.files import reason, whole_file

Array = npt.NDArray[np.float64]

MAX_ROWS = 50_000_000
"""Maximum number of rows of a table."""
_ROWS_PER_BATCH = 10_000


@check_arguments_except("trajectory")
def write_csv(trajectory: AnyMotion, path: str | os.PathLike[str], rate: float = 1000.0) -> None:
    """Write t, q, v, a and tau as comma-separated values in full precision, SI units.

    The first line names the columns: t, then q_, v_, a_ and tau_ with the coordinate's name; a
    continuous joint's q has the columns [cos] and [sin], a quaternion's [qx] to [qw]. The last
    columns, angle_ with a name, are angles of continuous joints with their full turns. Rows are
    1/rate apart; the last is at exactly T, where the limits from the left are taken (from the
    right elsewhere).

    path: the file; it is written completely or not at all.
    rate: samples per second, positive.
    Raises InputError for an invalid rate, DisplayError when the file cannot be written.
    """
    if not isinstance(trajectory, JoinedMotion):
        expect(trajectory, Trajectory, "the trajectory of a solution")
    times = sample_times(trajectory.duration, rate)
    try:
        with whole_file(path) as stream:
            stream.write(_header(trajectory).encode())
            for t, sample in _batches(trajectory, times):
                angles = trajectory.positions(t)[:, angle_indices(trajectory)]
                table = np.column_stack([t, *sample, angles])
                lines = (",".join(map(repr, row)) for row in table.tolist())
                stream.write("".join(line + "\n" for line in lines).encode())
    except OSError as error:
        raise DisplayError(f"cannot write the table {str(path)!r}: {reason(error)}.") from error


def sample_times(duration: float, rate: float) -> Array:
    """Multiples of 1/rate below T, and T, shape (M,), in [s]. Raises InputError for a bad rate.

    duration: T in [s]. rate: samples per second, positive.
    """
    if not (math.isfinite(rate) and rate > 0):
        raise InputError(f"the rate must be a positive number of samples per second, got {rate}.")
    if duration * rate > MAX_ROWS:
        raise InputError(
            f"a rate of {rate:g} gives {duration * rate:.3g} rows, more than {MAX_ROWS:,}; choose "
            "a lower rate."
        )
    times = np.arange(math.ceil(duration * rate)) / rate
    # A multiple that differs from T by rounding only counts as T.
    earlier = times[times < duration * (1 - 1e-12)]
    return np.append(earlier, duration)


def q_names(trajectory: AnyMotion) -> list[str]:
    """Names of the entries of q, (nq,)."""
    names = list(trajectory.coordinate_names)
    return names if trajectory.space is None else list(trajectory.space.names(names))


def column_names(trajectory: AnyMotion) -> list[str]:
    """Names of the columns t, q, v, a, tau and angle: the kind and the joint, as in q_elbow."""
    columns = ["t", *(f"q_{name}" for name in q_names(trajectory))]
    names, stored = trajectory.coordinate_names, trajectory.torque
    without = stored is not None and stored.values.shape[2] == 0  # of a Lagrangian without torques
    kinds = ("v", "a") if without else ("v", "a", "tau")
    columns += [f"{kind}_{name}" for kind in kinds for name in names]
    return columns + [f"angle_{names[i]}" for i in angle_indices(trajectory)]


def angle_indices(trajectory: AnyMotion) -> list[int]:
    """Indices in v of the continuous joints."""
    space = trajectory.space
    return [] if space is None else [factor.v.start for factor in space.angles]


def _header(trajectory: AnyMotion) -> str:
    """The first line; commas and quotes in names become underscores."""
    names = (each.replace(",", "_").replace('"', "_") for each in column_names(trajectory))
    return ",".join(names) + "\n"


def _batches(trajectory: AnyMotion, times: Array) -> Iterator[tuple[Array, Sample]]:
    for start in range(0, len(times), _ROWS_PER_BATCH):
        t = times[start : start + _ROWS_PER_BATCH]
        yield t, trajectory.sample(t)
