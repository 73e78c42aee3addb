"""Mutated study files and tables of values; those that load have cells with finite numbers."""

from __future__ import annotations

import io
import json
import math
import tomllib
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from random import Random
from typing import Any

import tomlkit

from hard.mutated_bytes import mutated_bytes
from hard.mutated_scene import TOKENS, UNUSUAL_VALUES
from hard.verdict import Mutant, Verdict, judge
from hovi.study.axes.table_columns import table_columns
from hovi.study.study import Study

STUDY = """
scene = "two_link_reach"
seed = 3
warm = false

[output]
motions = true
samples = 10
sample_format = "zarr"

[[vary]]
field = "goal.q"
sample = { sampler = "sobol", lower = [0.0, 0.0], upper = [1.0, 1.0], count = 8 }

[[vary]]
field = "duration"
grid = { lower = 1.0, upper = 2.0, count = 3 }

[[vary]]
fields = ["effects.payload.frame", "effects.payload.mass"]
values = [["tip", 1.0], ["tip", 2.0]]

[[vary]]
field = "start.q"
configurations = { count = 4, share = 0.5, sampler = "latin-hypercube", seed = 7 }
"""
POSES = """
scene = "two_link_reach"
warm = true

[[vary]]
field = "goal"
poses = { frame = "tip", lower = [0.5, 0.0, 0.0], upper = [1.0, 1.0, 0.0], grid = [2, 3, 1] }
"""
CSV = b"T,q0,name,on\n1.5,0.25,a,true\n2.5,-1e-3,b,false\n3,4,c,true\n"
LARGEST = 100_000
"""Cells of which the last is looked at; more are counted only."""


@cache
def parquet() -> bytes:
    """A table of numbers, lists and texts."""
    if find_spec("pyarrow") is None:
        return CSV
    import pyarrow as pa
    import pyarrow.parquet as pq

    stream = io.BytesIO()
    table = pa.table({"T": [1.5, 2.5], "q0": [[0.0, 1.0], [1.0, 2.0]], "name": ["a", "b"]})
    pq.write_table(table, stream)
    return stream.getvalue()


def mutate(random: Random) -> Mutant:
    """A changed study file, .csv or .parquet file, in its bytes or in its values."""
    kind = random.random()
    if kind < 0.15:
        return Mutant(b"csv:" + mutated_bytes(CSV, random, TOKENS))
    if kind < 0.35:
        return Mutant(b"parquet:" + mutated_bytes(parquet(), random, TOKENS))
    text = random.choice((STUDY, STUDY, POSES))
    if kind < 0.5:
        return Mutant(b"toml:" + mutated_bytes(text.encode(), random, TOKENS))
    study = tomllib.loads(text)
    for _ in range(random.randint(1, 3)):
        _change(study, random)
    return Mutant(b"toml:" + _written(study, random).encode("utf-8", "surrogateescape"))


def verdict(mutant: Mutant, folder: Path) -> tuple[Verdict, str]:
    """Load it from a file in `folder`."""
    suffix, _, content = mutant.content.partition(b":")
    path = folder / f"study.{suffix.decode()}"
    path.write_bytes(content)
    if suffix == b"toml":
        return judge(lambda: Study.read(path), error_in, mutant.reason)
    columns = {"duration": "T", "goal.q[0]": "q0", "robot": "name"}
    return judge(lambda: table_columns(path, columns), _error_in_axis, mutant.reason)


def error_in(study: Study) -> str:
    """The error in a loaded study; "" if there is none."""
    if study.count < 1:
        return "it has no cells"
    for number in {0, study.count - 1} if study.count <= LARGEST else {0}:
        cell = study.cells.cell(number)
        if not _is_finite([value for _, value in cell.values]):
            return f"cell {number} holds numbers that are not finite"
        json.dumps(cell.values, default=str)
    return ""


def _error_in_axis(axis: Any) -> str:
    return "" if _is_finite(list(axis.values)) else "it holds numbers that are not finite"


def _is_finite(value: Any) -> bool:
    if isinstance(value, float):
        return math.isfinite(value)
    if isinstance(value, dict):
        return all(map(_is_finite, value.values()))
    return not isinstance(value, list | tuple) or all(map(_is_finite, value))


def _change(study: dict[str, Any], random: Random) -> None:
    """Another value somewhere, or a key less or more."""
    at: Any = study
    while True:
        keys = list(at) if isinstance(at, dict) else list(range(len(at)))
        if not keys:
            return
        key = random.choice(keys)
        if not isinstance(at[key], dict | list) or random.random() < 0.3:
            break
        at = at[key]
    if random.random() < 0.2:
        del at[key]
    elif random.random() < 0.1 and isinstance(at, dict):
        at[random.choice(("grid", "table", "values", "fields", "columns", "x"))] = at[key]
    else:
        at[key] = random.choice(UNUSUAL_VALUES)


def _written(study: dict[str, Any], random: Random) -> str:
    try:
        return tomlkit.dumps(study)
    except Exception:  # a value that TOML does not have
        return STUDY.replace("count", str(random.choice(("cuont", "count = 1\ncount"))))
