"""The formats of `hovi export --format NAME`, as one list."""

from __future__ import annotations

import importlib
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy.typing as npt

from hovi.checks.arguments import check_arguments_except
from hovi.discrete.output.caution import warn_of_cautions
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError, nearest
from hovi.system.dataclass import dataclass
from hovi.viewing.curves.given_motion import motion_in

if TYPE_CHECKING:
    from hovi.planning.solver.solver import Solution


@dataclass(frozen=True)
class ExportFormat:
    """A file format that other programs read.

    name: on the command line. suffixes: file name extensions, the default one first.
    rate: samples per second by default. writer: module and function that writes it, imported when
        it is used.
    """

    name: str
    suffixes: tuple[str, ...]
    rate: float
    writer: str

    @property
    def suffix(self) -> str:
        """The default extension."""
        return self.suffixes[0]

    def write(
        self, trajectory: Trajectory, path: Path, rate: float | None = None, **options: Any
    ) -> None:
        """Write a motion, completely or not at all.

        rate: samples per second; that of the format when None. options: of the writer.
        Warns of a motion that its plan called no minimum, or in which links enter each other.
        Raises InputError for an invalid rate and for a motion that the format cannot hold,
        DisplayError when the file cannot be written or an optional library is missing.
        """
        warn_of_cautions(trajectory.metadata)
        module, name = self.writer.split(":")
        write = getattr(importlib.import_module(module), name)
        write(trajectory, path, self.rate if rate is None else rate, **options)


_EXCHANGE = "hovi.exchange"
FORMATS = (
    ExportFormat("csv", (".csv",), 1000.0, "hovi.viewing.csv_table:write_csv"),
    ExportFormat("numpy", (".npz",), 1000.0, f"{_EXCHANGE}.numpy_archive:write_numpy"),
    ExportFormat(
        "joint-trajectory",
        (".yaml", ".yml", ".json"),
        100.0,
        f"{_EXCHANGE}.joint_trajectory:write_joint_trajectory",
    ),
    ExportFormat("mcap", (".mcap",), 100.0, f"{_EXCHANGE}.mcap_bag:write_mcap"),
    ExportFormat("mujoco", (".xml",), 50.0, f"{_EXCHANGE}.mujoco_keyframes:write_mujoco"),
    ExportFormat("rerun", (".rrd",), 100.0, f"{_EXCHANGE}.rerun_recording:write_rerun"),
    ExportFormat("video", (".mp4",), 30.0, f"{_EXCHANGE}.film.film:write_video"),
    ExportFormat("gif", (".gif",), 15.0, f"{_EXCHANGE}.film.film:write_gif"),
    ExportFormat("parquet", (".parquet",), 1000.0, f"{_EXCHANGE}.parquet_table:write_parquet"),
)

FILMS = ("video", "gif")
"""The formats that have a size, a camera and a speed."""


def export_format(name: str) -> ExportFormat:
    """The format with this name. Raises InputError for an unknown name."""
    by_name = {each.name: each for each in FORMATS}
    if name not in by_name:
        raise InputError(f"there is no export format {name!r}: {nearest(name, by_name)}")
    return by_name[name]


def format_of_file(path: Path) -> ExportFormat:
    """The format of a file by its extension. Raises InputError for one of no format."""
    by_suffix = {each: chosen for chosen in FORMATS for each in chosen.suffixes}
    suffix = path.suffix.lower()
    if suffix not in by_suffix:
        raise InputError(
            f"the file {path.name!r} has the extension of no export format: "
            f"{nearest(suffix, by_suffix)}"
        )
    return by_suffix[suffix]


@check_arguments_except("trajectory", "size", "camera", "speed")
def export(
    trajectory: Trajectory | Solution,
    path: str | os.PathLike[str],
    format: str | None = None,
    rate: float | None = None,
    *,
    efforts: bool = False,
    size: str | tuple[int, int] | None = None,
    camera: str | npt.ArrayLike | None = None,
    speed: float | None = None,
) -> None:
    """Write a motion in the file format of another program, completely or not at all.

    path: the file. format: csv, numpy, joint-trajectory, parquet, mcap, mujoco, rerun, video or
        gif; by the extension of the file when None.
    rate: samples per second, or pictures of a film; that of the format when None.
    efforts: fill in the field `effort` of a joint-trajectory.
    size, camera, speed: of a film: width and height up to 1920x1080; a view (front, side, top, iso)
        or the position of the camera in [m], perhaps with the point that it looks at; seconds of
        the motion per second.
    Raises InputError for an unknown format or extension, an invalid rate and a motion that the
    format cannot hold, DisplayError when the file cannot be written or an optional library is
    missing.
    """
    trajectory = motion_in(trajectory)
    if format is None:
        chosen = format_of_file(Path(path))
    else:
        chosen = export_format(format)
        if Path(path).suffix.lower() not in chosen.suffixes:
            raise InputError(
                f"a file of the format {format!r} must end in {' or '.join(chosen.suffixes)}, not "
                f"{Path(path).name!r}."
            )
    if efforts and chosen.name != "joint-trajectory":
        raise InputError("`efforts` is for the format 'joint-trajectory'; the others have them.")
    film = film_options(chosen, size, camera, speed)
    chosen.write(trajectory, Path(path), rate, **({"efforts": True} if efforts else {}), **film)


def film_options(chosen: ExportFormat, size: Any, camera: Any, speed: Any) -> dict[str, Any]:
    """What is given of how a film is made. Raises InputError for a format that is no film."""
    options = {"size": size, "camera": camera, "speed": speed}
    given = {key: value for key, value in options.items() if value is not None}
    if given and chosen.name not in FILMS:
        raise InputError(
            f"`{next(iter(given))}` is for the formats {' and '.join(FILMS)}, not {chosen.name!r}: "
            "leave it out."
        )
    return given
