"""The tables of a study: plans.parquet, runs.parquet, and the samples of all motions.

plans.parquet has the cells in their order, whoever planned them and whenever: equal plans give
equal bytes.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import chain, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, TypeVar

import numpy as np
import numpy.typing as npt

from hovi.errors import StudyError
from hovi.study.cells.cells import Cells
from hovi.study.cells.parameters import Parameter, parameters_of
from hovi.study.storage.index import Index
from hovi.study.storage.journal import Stored
from hovi.study.storage.samples import HEAD_BYTES, SampleFormat, Samples
from hovi.study.storage.zarr_samples import SampledPlan, widest, write_zarr
from hovi.system.files import names_file, reason, whole_file

if TYPE_CHECKING:
    import pyarrow as pa

PLANS, RUNS = "plans.parquet", "runs.parquet"
SAMPLES: dict[SampleFormat, str] = {"parquet": "samples.parquet", "zarr": "samples.zarr.zip"}
ROWS = 5_000
"""Rows of a row group of plans.parquet and runs.parquet, which are in memory at once."""
SAMPLED_PLANS, SAMPLED_ROWS = 500, 50_000
"""Plans and samples that are a row group or a chunk, whichever are fewer."""
Keys = npt.NDArray[np.bytes_]
Row = dict[str, Any]
Item = TypeVar("Item")


def write_tables(
    folder: Path, cells: Cells, keys: Keys, index: Index, sample_format: SampleFormat
) -> None:
    """Write the tables, each as a whole; the samples only if the index is of plans with samples.

    keys: of the cells, empty where they are not known yet.
    Raises StudyError if they cannot be written.
    """
    for number in np.flatnonzero(keys == b""):
        keys[number] = cells.key(int(number)).encode()
    _write(folder / PLANS, plan_schema(cells), _batches(_plan_rows(cells, keys, index), ROWS))
    _write(folder / RUNS, _run_schema(), _batches(_run_rows(index), ROWS))
    if index.samples:
        _write_samples(folder, keys, index, sample_format)


def require_own(folder: Path, keys: Keys, index: Index) -> None:
    """Raise StudyError if a folder holds plans of other cells, which would leave the tables.

    keys: of all cells. index: of the folder, whose plans count where there is no table yet.
    """
    texts = _keys_in(folder / PLANS) if names_file(folder / PLANS) else index.keys()
    held = np.array(texts, dtype=keys.dtype)
    others = int(np.isin(held, keys, invert=True).sum())
    if others:
        raise StudyError(
            f"{folder} holds {len(held):,} plans, of which {others:,} are not among the "
            f"{len(keys):,} of this study and would leave {PLANS}: choose another folder, or use "
            "--replace (replace=True in Python)."
        )


def _keys_in(path: Path) -> list[str]:
    """The keys in plans.parquet. Raises StudyError where that is another kind of table."""
    table = read_table(path)
    if "key" not in table.column_names:
        raise StudyError(f"{path} is no table of a study: choose another folder.")
    return [str(key) for key in table["key"].to_pylist()]


def read_table(path: Path) -> pa.Table:
    """A table of a study. Raises StudyError."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    if not names_file(path):
        raise StudyError(f"there is no {path.name} in {path.parent}: run the study first.")
    try:
        return pq.read_table(path)
    except (pa.ArrowException, OSError, ValueError) as damaged:
        raise StudyError(f"{path} cannot be read: {damaged}.") from None


def plan_schema(cells: Cells) -> pa.Schema:
    """The columns of plans.parquet."""
    import pyarrow as pa

    numbers = pa.list_(pa.float64())
    kinds = {
        "number": pa.float64(),
        "whole": pa.int64(),
        "truth": pa.bool_(),
        "text": pa.string(),
        "json": pa.string(),
    }
    parameters = [pa.field(each.name, kinds[each.kind]) for each in parameters_of(cells.axes)]
    return pa.schema(
        [
            pa.field("cell", pa.int64()),
            pa.field("key", pa.string()),
            *parameters,
            pa.field("status", pa.string()),
            pa.field("success", pa.bool_()),
            pa.field("reason", pa.string()),
            pa.field("warnings", pa.string()),
            *(pa.field(name, pa.list_(pa.string())) for name in ("cautions", "excused")),
            *(pa.field(name, pa.float64()) for name in ("cost", "effort", "error_estimate")),
            *(pa.field(name, pa.int64()) for name in ("nit", "n_neg")),
            pa.field("motion_duration", pa.float64()),
            pa.field("motion_intervals", pa.int64()),
            *(pa.field(name, numbers) for name in ("peak_v", "peak_a", "peak_tau")),
            *(pa.field(name, pa.float64()) for name in ("margin", "least_distance")),
            *(pa.field(name, numbers) for name in ("q_start", "q_goal")),
            pa.field("reproducible", pa.bool_()),
            pa.field("parent", pa.string()),
            pa.field("scene", pa.string()),
            pa.field("version", pa.string()),
        ]
    )


def _batches(items: Iterator[Item], size: int) -> Iterator[list[Item]]:
    """So many items at a time."""
    while batch := list(islice(items, size)):
        yield batch


def _plan_rows(cells: Cells, keys: Keys, index: Index) -> Iterator[Row]:
    """The rows of what is done, in the order of the cells."""
    parameters = parameters_of(cells.axes)
    for number, key in enumerate(keys):
        done = index.done(key.decode())
        if done is None:
            continue
        row = done.row.to_dict()
        row["motion_duration"] = row.pop("duration")
        row["motion_intervals"] = row.pop("intervals")
        own = {"cell": number, "key": key.decode(), "scene": cells.template.hash}
        yield row | own | _parameters(cells, number, parameters)


def _parameters(cells: Cells, number: int, columns: tuple[Parameter, ...]) -> Row:
    values = dict(cells.values(number))
    return {column.name: column.of(values[column.field]) for column in columns}


def _run_schema() -> pa.Schema:
    import pyarrow as pa

    return pa.schema(
        [
            pa.field("key", pa.string()),
            pa.field("attempt", pa.int64()),
            pa.field("outcome", pa.string()),
            pa.field("began", pa.timestamp("us", tz="UTC")),
            pa.field("seconds", pa.float64()),
            pa.field("processor_seconds", pa.float64()),
            pa.field("host", pa.string()),
            pa.field("process", pa.int64()),
            pa.field("version", pa.string()),
        ]
    )


def _run_rows(index: Index) -> Iterator[Row]:
    from datetime import datetime

    for run in index.runs():
        began = run.get("began")
        yield run | {"began": None if began is None else datetime.fromisoformat(began)}


def _sample_schema() -> pa.Schema:
    import pyarrow as pa

    names = ("q", "v", "a", "tau")
    lists = [pa.field(name, pa.list_(pa.float64())) for name in names]
    return pa.schema(
        [
            pa.field("cell", pa.int64()),
            pa.field("key", pa.string()),
            pa.field("t", pa.float64()),
            *lists,
        ]
    )


def _write_samples(folder: Path, keys: Keys, index: Index, sample_format: SampleFormat) -> None:
    size = max(1, min(SAMPLED_PLANS, SAMPLED_ROWS // index.samples))
    path, groups = folder / SAMPLES[sample_format], _batches(_sampled(folder, keys, index), size)
    if sample_format == "parquet":
        rows = (list(chain(*map(_sample_rows, group))) for group in groups)
        _write(path, _sample_schema(), rows)
        return
    heads = (replace(each, length=HEAD_BYTES) for _, _, each in _places(keys, index))
    shape = widest(Samples.shape_of(head.read(folder)) for head in heads)
    with _writing(path) as stream:
        write_zarr(stream, groups, shape, index.samples, size)


def _places(keys: Keys, index: Index) -> Iterator[tuple[int, str, Stored]]:
    """The cell and the key of each minimum, and where its samples are."""
    for number, key in enumerate(keys):
        done = index.done(key.decode())
        if done is not None and done.samples is not None and done.row.success:
            yield number, key.decode(), done.samples


def _sampled(folder: Path, keys: Keys, index: Index) -> Iterator[SampledPlan]:
    for number, key, stored in _places(keys, index):
        yield SampledPlan(number, key, Samples.from_bytes(stored.read(folder)))


def _sample_rows(plan: SampledPlan) -> Iterator[Row]:
    """A row for each time."""
    names = ("t", "q", "v", "a", "tau")
    columns = [getattr(plan.samples, name).tolist() for name in names]
    own = {"cell": plan.cell, "key": plan.key}
    for row in zip(*columns, strict=True):
        yield own | dict(zip(names, row, strict=True))


def _write(path: Path, schema: pa.Schema, groups: Iterator[list[Row]]) -> None:
    """Write a table of groups of rows."""
    import pyarrow as pa

    with _table_writer(path, schema) as writer:
        for rows in groups:
            writer.write_table(pa.Table.from_pylist(rows, schema), row_group_size=len(rows))


@contextmanager
def _table_writer(path: Path, schema: pa.Schema) -> Iterator[Any]:
    import pyarrow.parquet as pq

    with _writing(path) as stream, pq.ParquetWriter(stream, schema, compression="zstd") as to:
        yield to


@contextmanager
def _writing(path: Path) -> Iterator[BinaryIO]:
    """A file that is written whole. Raises StudyError."""
    try:
        with whole_file(path) as stream:
            yield stream
    except OSError as refused:
        raise StudyError(
            f"{path} cannot be written: {reason(refused)}; make room and start the study again."
        ) from None
