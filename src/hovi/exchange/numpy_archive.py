"""A motion as an npz archive of plain arrays."""

from __future__ import annotations

import os

import numpy as np

from hovi.discrete.joined_motion import AnyMotion
from hovi.discrete.output.caution import caution_lines
from hovi.exchange.samples import times_of
from hovi.exchange.whole_export import whole_export
from hovi.viewing.csv_table import q_names


def write_numpy(trajectory: AnyMotion, path: str | os.PathLike[str], rate: float) -> None:
    """Write t (M,), q (M, nq), positions, v, a and tau (M, nv), and the names of their columns.

    The arrays `q_names` and `names` hold the columns of q and of the others, and `cautions` those
    of the motion; `positions` are one number per joint, with the full turns of continuous ones. SI
    units; limits from the left at the end, from the right elsewhere. `numpy.load(path)` reads it
    without pickle.
    rate: samples per second.
    Raises InputError for an invalid rate, DisplayError when the file cannot be written.
    """
    times = times_of(trajectory, rate)
    said = np.array(caution_lines([trajectory.metadata]), dtype=np.str_)
    arrays = {
        "t": times,
        **trajectory.sample(times)._asdict(),
        "positions": trajectory.positions(times),
        "q_names": np.array(q_names(trajectory)),
        "names": np.array(trajectory.coordinate_names),
        "cautions": said,
    }
    with whole_export(path, "archive") as stream:
        np.savez(stream, **arrays)
