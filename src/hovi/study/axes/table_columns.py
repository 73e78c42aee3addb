"""An axis of the rows of a table: columns of a CSV or Parquet file."""

from __future__ import annotations

import csv
import io
import math
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hovi.errors import HoviError, SceneError, nearest
from hovi.study.cells.axis import MAX_VALUES, Axis
from hovi.study.cells.extras import require_extra
from hovi.study.cells.field_path import FieldPath
from hovi.system.files import reason, require_file

MAX_BYTES = 1_000_000_000
"""Maximum size of a table."""
MAX_UNPACKED = 8_000_000_000
"""Maximum size of the columns of a Parquet file in memory."""


def table_columns(path: Path, columns: Mapping[str, str]) -> Axis:
    """The rows of a table, one after the other.

    path: a .csv file in UTF-8 with a line of names, or a .parquet file.
    columns: the name of a column for each field of the scene, by the field's path.
    Raises SceneError for a file that cannot be read and for unknown columns.
    """
    fields = tuple(FieldPath.of(text) for text in columns)
    read = _READERS.get(path.suffix.lower())
    if read is None or not fields:
        raise SceneError(
            f"the study's table {path.name!r} must be a .csv or a .parquet file, with the columns "
            'of fields, such as columns = {duration = "T"}.'
        )
    try:
        require_file(path, MAX_BYTES)
        values = read(path, list(columns.values()))
    except OSError as refused:
        raise SceneError(f"{path} cannot be read: {reason(refused)}.") from None
    if len(values[0]) > MAX_VALUES:
        raise SceneError(f"{path} has more than {MAX_VALUES:,} rows: take fewer.")
    return Axis(fields, list(zip(*values, strict=True)))


def _from_csv(path: Path, names: list[str]) -> list[list[Any]]:
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise SceneError(f"{path} is not UTF-8 text, as a .csv file must be.") from None
    try:
        rows = list(csv.reader(io.StringIO(text, newline=""), strict=True))
    except csv.Error as invalid:
        raise SceneError(f"{path} is no .csv file: {invalid}.") from None
    header = [name.strip() for name in rows[0]] if rows else []
    places = [_place(name, header, path) for name in names]
    values: list[list[Any]] = [[] for _ in names]
    lines = []
    for number, row in enumerate(rows[1:], start=2):
        if not row:
            continue  # a blank line
        if len(row) != len(header):
            raise SceneError(
                f"{path}, line {number}: {len(row)} values under {len(header)} names of columns."
            )
        lines.append(number)
        for column, place in zip(values, places, strict=True):
            column.append(_number_or_text(row[place].strip()))
    for name, column in zip(names, values, strict=True):
        _require_one_kind(name, column, lines, path)
    return values


def _require_one_kind(name: str, column: list[Any], lines: list[int], path: Path) -> None:
    """Raise SceneError if one value is a text where others are numbers, or the like.

    The column of the study's table would have only texts then.
    """
    kinds = ["truth values" if isinstance(x, bool) else _WORDS[type(x)] for x in column]
    usual = max(kinds, key=Counter(kinds).__getitem__, default="")
    for line, value, kind in zip(lines, column, kinds, strict=True):
        if kind != usual:
            raise SceneError(
                f"{path}, line {line}: the other values of column {name!r} are {usual}, but this "
                f"one is {value!r}: correct it, or take the line out."
            )


def _number_or_text(text: str) -> Any:
    """A whole number, a number, a truth value or a text, as it looks."""
    if text in ("true", "false"):
        return text == "true"
    if len(text) > 40 or not text or text[0] not in "+-.0123456789" or "_" in text:
        return text
    for kind in (int, float):
        try:
            number = kind(text)
        except ValueError:
            continue
        return number if math.isfinite(number) else text
    return text


def _from_parquet(path: Path, names: list[str]) -> list[list[Any]]:
    require_extra("pyarrow", "study")
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        file = pq.ParquetFile(path)
        header = file.schema_arrow.names
        for name in names:
            _place(name, header, path)
        if file.metadata.num_rows > MAX_VALUES or _unpacked(file) > MAX_UNPACKED:
            raise SceneError(f"{path} has more rows than the {MAX_VALUES:,} that are read.")
        table = file.read(columns=names)
        return [_plain(table.column(name).to_pylist(), name, path) for name in names]
    except HoviError:
        raise
    except (pa.ArrowException, ValueError, OSError, KeyError, OverflowError) as invalid:
        raise SceneError(f"{path} is no .parquet file that can be read: {invalid}.") from None


def _unpacked(file: Any) -> int:
    metadata = file.metadata
    return sum(metadata.row_group(i).total_byte_size for i in range(metadata.num_row_groups))


def _plain(values: list[Any], name: str, path: Path) -> list[Any]:
    """The values, if they are what TOML has."""
    for number, value in enumerate(values):
        entries = value if isinstance(value, list) else [value]
        for each in entries:
            if not isinstance(each, bool | int | float | str) or (
                isinstance(each, float) and not math.isfinite(each)
            ):
                raise SceneError(
                    f"{path}: row {number} of column {name!r} must be a finite number, a text, a "
                    f"truth value or a list of these, but it is {each!r}."
                )
    return values


def _place(name: str, header: list[str], path: Path) -> int:
    if header.count(name) != 1:
        twice = "two columns" if name in header else "no column"
        raise SceneError(f"{path} has {twice} {name!r}; {nearest(name, header)}")
    return header.index(name)


_WORDS = {int: "numbers", float: "numbers", str: "texts"}
_READERS = {".csv": _from_csv, ".parquet": _from_parquet}
