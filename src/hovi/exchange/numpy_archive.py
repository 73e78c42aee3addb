"""A motion as an npz archive of plain arrays."""

from __future__ import annotations

import os

import numpy as np

from hovi.discrete.output.caution import caution_lines
from hovi.discrete.trajectory import Trajectory
from hovi.exchange.samples import times_of
from hovi.exchange.whole_export import whole_export
from hovi.viewing.csv_table import q_names


def write_numpy(trajectory: Trajectory, path: str | os.PathLike[str], rate: float) -> None:
    """Write t (M,), q (M, nq), v, a and tau (M, nv), and the names of their columns.

    The arrays `q_names` and `names` hold the columns of q and of the others, and `cautions` those
    of the motion. SI units; limits from
    the left at the end, from the right elsewhere. `numpy.load(path)` reads it without pickle.
    rate: samples per second.
    Raises InputError for an invalid rate, DisplayError when the file cannot be written.
    """
    times = times_of(trajectory, rate)
    q, v, a, tau = trajectory.sample(times)
    names, of_q = np.array(trajectory.coordinate_names), np.array(q_names(trajectory))
    said = np.array(caution_lines([trajectory.metadata]), dtype=np.str_)
    with whole_export(path, "archive") as stream:
        np.savez(stream, t=times, q=q, v=v, a=a, tau=tau, q_names=of_q, names=names, cautions=said)
