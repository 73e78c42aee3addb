"""A motion as a Parquet table."""

from __future__ import annotations

import json
import os

from hovi.discrete.joined_motion import AnyMotion
from hovi.discrete.output.caution import caution_lines
from hovi.exchange.libraries import library
from hovi.exchange.samples import times_of
from hovi.exchange.whole_export import whole_export
from hovi.viewing.csv_table import angle_indices, column_names


def write_parquet(trajectory: AnyMotion, path: str | os.PathLike[str], rate: float) -> None:
    """Write one row per sample with the columns of the CSV table, as doubles.

    The metadata of the schema has the units, the motion's duration and its cautions, as JSON.
    rate: samples per second.
    Raises InputError for an invalid rate, DisplayError when the file cannot be written or pyarrow
    is missing.
    """
    times = times_of(trajectory, rate)
    pyarrow = library("pyarrow", "pyarrow", "the format 'parquet'")
    parquet = library("pyarrow.parquet", "pyarrow", "the format 'parquet'")
    angles = trajectory.positions(times)[:, angle_indices(trajectory)]
    columns = [times, *(column for x in (*trajectory.sample(times), angles) for column in x.T)]
    metadata = {
        "units": "SI, radians",
        "duration": repr(trajectory.duration),
        "cautions": json.dumps(caution_lines([trajectory.metadata])),
    }
    names = column_names(trajectory)[: len(columns)]
    table = pyarrow.table(columns, names=names).replace_schema_metadata(metadata)
    with whole_export(path, "table") as stream:
        parquet.write_table(table, stream)
