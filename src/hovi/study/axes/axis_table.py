"""The tables [[vary]] of a study file: one axis each, of the kind that its keys say."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, FiniteFloat

from hovi.errors import SceneError
from hovi.planning.task_file.schema import Direction, Table
from hovi.robot.robot import Robot
from hovi.study.axes.configurations import configurations
from hovi.study.axes.listed import grid, listed
from hovi.study.axes.poses import points_in_box, points_on_grid, poses
from hovi.study.axes.samplers import SamplerName, sampled
from hovi.study.axes.table_columns import table_columns
from hovi.study.cells.axis import MAX_VALUES, Axis
from hovi.study.cells.field_path import FieldPath
from hovi.system.dataclass import dataclass

Count = Annotated[int, Field(ge=1, le=MAX_VALUES)]
_COUNT = f"a whole number from 1 to {MAX_VALUES:,}"
_CORNER = "a number, or a list of numbers"
Numbers = FiniteFloat | list[FiniteFloat]


class GridTable(Table):
    """grid = {lower = 0.0, upper = 1.0, count = 5}."""

    lower: FiniteFloat = Field(description="a finite number, the first value")
    upper: FiniteFloat = Field(description="a finite number, the last value")
    count: Count = Field(description=_COUNT)


class SampleTable(Table):
    """sample = {lower = [...], upper = [...], count = 100}."""

    sampler: SamplerName = Field(
        default="sobol", description='"uniform", "sobol" or "latin-hypercube"'
    )
    lower: Numbers = Field(description=_CORNER)
    upper: Numbers = Field(description=_CORNER)
    count: Count = Field(description=_COUNT)
    seed: int | None = Field(default=None, ge=0, description="a whole number, 0 or more")


class ConfigurationsTable(Table):
    """configurations = {count = 100}."""

    count: Count = Field(description=_COUNT)
    share: FiniteFloat = Field(
        default=1.0, gt=0, le=1, description="a fraction of the joints' ranges, above 0 up to 1"
    )
    sampler: SamplerName = Field(
        default="uniform", description='"uniform", "sobol" or "latin-hypercube"'
    )
    seed: int | None = Field(default=None, ge=0, description="a whole number, 0 or more")


class PosesTable(Table):
    """poses = {frame = "tool0", lower = [...], upper = [...], grid = [10, 10, 1]}."""

    frame: str = Field(description="the name of a frame of the robot")
    lower: Direction = Field(description="a list of three finite numbers, in metres")
    upper: Direction = Field(description="a list of three finite numbers, in metres")
    grid: Annotated[list[Count], Field(min_length=3, max_length=3)] | None = Field(
        default=None, description="a list of three whole numbers: of points along x, y and z"
    )
    count: Count | None = Field(default=None, description=_COUNT)
    sampler: SamplerName = Field(
        default="sobol", description='"uniform", "sobol" or "latin-hypercube"'
    )
    seed: int | None = Field(default=None, ge=0, description="a whole number, 0 or more")
    rpy: Direction | None = Field(
        default=None, description="a list of three finite numbers: roll, pitch and yaw in radians"
    )
    axis: dict[str, Direction] | None = Field(
        default=None, description="a table with two directions, `frame` and `world`"
    )
    inverse_kinematics: bool = Field(default=True, description="true or false")


class VaryTable(Table):
    """[[vary]]: fields, and one of the keys that say what they are."""

    field: str | None = Field(default=None, description="a field such as goal.q")
    fields: list[str] | None = Field(
        default=None, min_length=1, description="a list of fields such as goal.q[0]"
    )
    values: list[Any] | None = Field(default=None, description="a list of values")
    grid: GridTable | None = Field(
        default=None, description="a table with `lower`, `upper` and `count`"
    )
    sample: SampleTable | None = Field(
        default=None, description="a table with `lower`, `upper` and `count`"
    )
    configurations: ConfigurationsTable | None = Field(
        default=None, description="a table with `count`"
    )
    poses: PosesTable | None = Field(
        default=None, description="a table with `frame`, `lower`, `upper` and `grid` or `count`"
    )
    table: str | None = Field(
        default=None, description="the path of a .csv or .parquet file, relative to this file"
    )
    columns: dict[str, str] | None = Field(
        default=None, description="a table of fields with the names of their columns"
    )


@dataclass(frozen=True, eq=False)
class AxisContext:
    """What an axis may depend on besides its table.

    folder: to which paths are relative. robot: of the template, loaded when it is asked for.
    seed: for an axis that has none of its own.
    """

    folder: Path
    robot: Callable[[], Robot]
    seed: int


def axis_of(table: VaryTable, context: AxisContext) -> Axis:
    """The axis of a table. Raises SceneError."""
    kinds = [kind for kind in _KINDS if getattr(table, kind) is not None]
    if len(kinds) != 1:
        found = " and ".join(f"`{kind}`" for kind in kinds) or "none of them"
        raise SceneError(f"each [[vary]] takes one of {', '.join(_KINDS)}; this has {found}.")
    if (table.columns is None) != (table.table is None):
        raise SceneError("`table` and `columns` of a [[vary]] belong together: give both.")
    return _KINDS[kinds[0]](table, context)


def _fields(table: VaryTable) -> list[FieldPath]:
    if (table.field is None) == (table.fields is None):
        raise SceneError('each [[vary]] needs `field` or `fields`, such as field = "goal.q".')
    texts = [table.field] if table.fields is None else table.fields
    return [FieldPath.of(str(text)) for text in texts]


def _listed(table: VaryTable, context: AxisContext) -> Axis:
    return listed(_fields(table), table.values or [])


def _grid(table: VaryTable, context: AxisContext) -> Axis:
    assert table.grid is not None
    return grid(_fields(table), table.grid.lower, table.grid.upper, table.grid.count)


def _sample(table: VaryTable, context: AxisContext) -> Axis:
    given = table.sample
    assert given is not None
    corners = given.lower, given.upper
    return sampled(_fields(table), given.sampler, *corners, given.count, _seed(given, context))


def _configurations(table: VaryTable, context: AxisContext) -> Axis:
    given = table.configurations
    assert given is not None
    how = given.share, given.count, _seed(given, context), given.sampler
    return configurations(_fields(table), context.robot(), *how)


def _poses(table: VaryTable, context: AxisContext) -> Axis:
    given = table.poses
    assert given is not None
    if (given.grid is None) == (given.count is None):
        raise SceneError("`poses` of a [[vary]] needs `grid` or `count`, such as grid = [9, 9, 1].")
    if given.grid is not None:
        points = points_on_grid(given.lower, given.upper, given.grid)
    else:
        assert given.count is not None
        box = given.lower, given.upper
        points = points_in_box(given.sampler, *box, given.count, _seed(given, context))
    orientation: Mapping[str, Any] = {
        key: value for key, value in (("rpy", given.rpy), ("axis", given.axis)) if value is not None
    }
    return poses(_fields(table), given.frame, points, orientation, given.inverse_kinematics)


def _table(table: VaryTable, context: AxisContext) -> Axis:
    assert table.table is not None
    if table.field is not None or table.fields is not None:
        raise SceneError("a [[vary]] with `table` names its fields in `columns`, not in `field`.")
    return table_columns(context.folder / table.table, table.columns or {})


def _seed(given: Any, context: AxisContext) -> int:
    return context.seed if given.seed is None else int(given.seed)


_KINDS: dict[str, Callable[[VaryTable, AxisContext], Axis]] = {
    "values": _listed,
    "grid": _grid,
    "sample": _sample,
    "configurations": _configurations,
    "poses": _poses,
    "table": _table,
}
