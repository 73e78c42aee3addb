"""Reading a study file: TOML -> validated tables -> template and axes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import Field, ValidationError

from hovi.errors import HoviError, SceneError
from hovi.planning.task_file.messages import TomlText, first_sentence
from hovi.planning.task_file.scene_cache import SceneCache
from hovi.planning.task_file.schema import Table
from hovi.robot.bundled_models import example
from hovi.study.axes.axis_table import AxisContext, VaryTable, axis_of
from hovi.study.cells.cells import Cells
from hovi.study.cells.template import Template
from hovi.study.running.work import Output
from hovi.study.storage.samples import SampleFormat
from hovi.system.files import names_file

MAX_SAMPLES = 100_000
"""Maximum number of samples of a motion."""


class OutputTable(Table):
    """[output]."""

    motions: bool = Field(default=True, description="true or false")
    samples: int = Field(
        default=0, ge=0, le=MAX_SAMPLES, description=f"a whole number from 0 to {MAX_SAMPLES:,}"
    )
    sample_format: SampleFormat = Field(default="parquet", description='"parquet" or "zarr"')


class StudyTable(Table):
    """The whole file."""

    scene: str = Field(
        description="the path of a scene file relative to this file, or the name of a shipped one"
    )
    seed: int = Field(default=0, ge=0, le=2**63, description="a whole number, 0 or more")
    warm: bool = Field(default=False, description="true or false")
    output: OutputTable = Field(default=OutputTable(), description="a table [output]")
    vary: list[VaryTable] = Field(default=[], description="tables [[vary]]")


def validated(data: Mapping[str, Any], toml: TomlText) -> StudyTable:
    """The table of a study file. toml: its text, for messages, and its path.

    Raises SceneError with file, line, key, expected and given value.
    """
    try:
        return StudyTable.model_validate(data)
    except ValidationError as invalid:
        raise first_sentence(invalid, StudyTable, toml) from None


def cells_of(table: StudyTable, toml: TomlText) -> tuple[Cells, Output]:
    """The cells of a study, and what is stored of each motion.

    toml: as for `validated`. Raises SceneError.
    """
    template = Template.read(_scene_path(table.scene, toml))
    cache = SceneCache()
    axes = []
    for number, each in enumerate(table.vary):
        context = AxisContext(
            toml.path.parent,
            lambda: template.task(template.table, cache).scene.robot,
            table.seed + number,
        )
        try:
            axes.append(axis_of(each, context))
        except HoviError as wrong:
            raise toml.error(("vary", number), str(wrong)) from None
    try:
        cells = Cells(template, tuple(axes), table.warm)
    except SceneError as wrong:
        raise toml.error(("vary",), str(wrong)) from None
    _check_first_cell(cells, cache, toml)
    motions = table.output.motions or table.warm  # a resumed run starts from stored motions
    return cells, Output(motions, table.output.samples, table.output.sample_format)


def _check_first_cell(cells: Cells, cache: SceneCache, toml: TomlText) -> None:
    """Raise SceneError if a field has no place in a scene file, so that no cell can be planned."""
    values = cells.values(0)
    try:
        cells.template.task(cells.template.with_values(values), cache)
    except SceneError as wrong:
        missing = "unknown key" in str(wrong) or "the study's field" in str(wrong)
        if missing:
            fields = ", ".join(repr(path.text) for path, _ in values)
            raise toml.error(("vary",), f"with the study's fields {fields}: {wrong}") from None
    except HoviError:
        pass  # other cells may do: the row of this one will say it


def _scene_path(text: str, toml: TomlText) -> Path:
    path = toml.path.parent / text
    if text.endswith(".toml") or names_file(path):
        return path
    try:
        return example(f"{text}.toml")
    except SceneError as unknown:
        raise toml.error(("scene",), str(unknown)) from None
