"""The formats of `hovi export --format NAME`, as one list."""

from __future__ import annotations

import importlib
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy.typing as npt

from hovi.checks.arguments import check_arguments_except
from hovi.discrete.joined_motion import AnyMotion, joined
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
    of_samples: whether it holds samples alone, so that it takes several motions, joined.
    has_suffix: whether files with its extensions are of this format if none is named.
    options: names of what `export` takes for this format alone.
    """

    name: str
    suffixes: tuple[str, ...]
    rate: float
    writer: str
    of_samples: bool = False
    has_suffix: bool = True
    options: tuple[str, ...] = ()

    @property
    def suffix(self) -> str:
        """The default extension."""
        return self.suffixes[0]

    def write(
        self, trajectory: AnyMotion, path: Path, rate: float | None = None, **options: Any
    ) -> None:
        """Write a motion, completely or not at all.

        rate: samples per second; that of the format when None. options: of the writer.
        Warns of a motion that its plan called no minimum, or in which links enter each other.
        Raises InputError for an invalid rate, for a motion that the format cannot hold and for
        joined motions where it does not hold samples alone, DisplayError when the file cannot be
        written or an optional library is missing.
        """
        if not (self.of_samples or isinstance(trajectory, Trajectory)):
            names = ", ".join(each.name for each in FORMATS if each.of_samples)
            raise InputError(
                f"the format {self.name!r} holds one motion: export each by itself, or join them "
                f"in one of the formats {names}."
            )
        warn_of_cautions(trajectory.metadata)
        module, name = self.writer.split(":")
        write = getattr(importlib.import_module(module), name)
        write(trajectory, path, self.rate if rate is None else rate, **options)


_EXCHANGE = "hovi.exchange"
_OF_FILMS = ("size", "camera", "speed")
"""What says how a film is made."""
FORMATS = (
    ExportFormat("csv", (".csv",), 1000.0, "hovi.viewing.csv_table:write_csv", of_samples=True),
    ExportFormat(
        *("numpy", (".npz",), 1000.0, f"{_EXCHANGE}.numpy_archive:write_numpy"), of_samples=True
    ),
    ExportFormat(
        "joint-trajectory",
        (".yaml", ".yml", ".json"),
        100.0,
        f"{_EXCHANGE}.joint_trajectory:write_joint_trajectory",
        of_samples=True,
        options=("efforts",),
    ),
    ExportFormat(
        "robot-trajectory",
        (".yaml", ".yml", ".json"),
        100.0,
        f"{_EXCHANGE}.robot_trajectory:write_robot_trajectory",
        of_samples=True,
        has_suffix=False,
    ),
    ExportFormat(
        "urscript",
        (".script",),
        125.0,
        f"{_EXCHANGE}.urscript:write_urscript",
        of_samples=True,
        options=("lookahead_time", "gain"),
    ),
    ExportFormat(
        "franka",
        (".csv",),
        1000.0,
        f"{_EXCHANGE}.franka_table:write_franka",
        of_samples=True,
        has_suffix=False,
    ),
    ExportFormat("mcap", (".mcap",), 100.0, f"{_EXCHANGE}.mcap_bag:write_mcap"),
    ExportFormat("mujoco", (".xml",), 50.0, f"{_EXCHANGE}.mujoco_keyframes:write_mujoco"),
    ExportFormat("rerun", (".rrd",), 100.0, f"{_EXCHANGE}.rerun_recording:write_rerun"),
    ExportFormat("video", (".mp4",), 30.0, f"{_EXCHANGE}.film.film:write_video", options=_OF_FILMS),
    ExportFormat("gif", (".gif",), 15.0, f"{_EXCHANGE}.film.film:write_gif", options=_OF_FILMS),
    ExportFormat(
        *("parquet", (".parquet",), 1000.0, f"{_EXCHANGE}.parquet_table:write_parquet"),
        of_samples=True,
    ),
)


def export_format(name: str) -> ExportFormat:
    """The format with this name. Raises InputError for an unknown name."""
    by_name = {each.name: each for each in FORMATS}
    if name not in by_name:
        raise InputError(f"there is no export format {name!r}: {nearest(name, by_name)}")
    return by_name[name]


def format_of_file(path: Path) -> ExportFormat:
    """The format of a file by its extension. Raises InputError for one of no format."""
    by_suffix = {
        each: chosen for chosen in FORMATS if chosen.has_suffix for each in chosen.suffixes
    }
    suffix = path.suffix.lower()
    if suffix not in by_suffix:
        raise InputError(
            f"the file {path.name!r} has the extension of no export format: "
            f"{nearest(suffix, by_suffix)}"
        )
    return by_suffix[suffix]


@check_arguments_except("trajectory", "size", "camera", "speed")
def export(
    trajectory: Trajectory | Solution | Sequence[Trajectory | Solution],
    path: str | os.PathLike[str],
    format: str | None = None,
    rate: float | None = None,
    *,
    efforts: bool = False,
    gap: float = 0.0,
    lookahead_time: float | None = None,
    gain: float | None = None,
    size: str | tuple[int, int] | None = None,
    camera: str | npt.ArrayLike | None = None,
    speed: float | None = None,
) -> None:
    """Write a motion in the file format of another program, completely or not at all.

    trajectory: a motion, or several that follow each other at rest, for the formats of samples:
        csv, numpy, parquet, joint-trajectory, robot-trajectory, urscript and franka.
    path: the file. format: csv, numpy, joint-trajectory, robot-trajectory, urscript, franka,
        parquet, mcap, mujoco, rerun, video or gif; by the extension of the file when None.
    rate: samples per second, or pictures of a film; that of the format when None.
    efforts: fill in the field `effort` of a joint-trajectory.
    gap: time for which the robot rests between two motions, in [s].
    lookahead_time, gain: of servoj in a urscript, 0.03 to 0.2 in [s] and 100 to 2000; 0.1 and 300
        when None.
    size, camera, speed: of a film: width and height up to 1920x1080; a view (front, side, top, iso)
        or the position of the camera in [m], perhaps with the point that it looks at; seconds of
        the motion per second.
    Raises InputError for an unknown format or extension, an invalid rate, a motion that the format
    cannot hold, and motions that do not follow each other; DisplayError when the file cannot be
    written or an optional library is missing.
    """
    given = trajectory if isinstance(trajectory, list | tuple) else [trajectory]
    motions = [motion_in(each) for each in given]
    if gap != 0 and len(motions) < 2:
        raise InputError("a gap is between motions, and there is one: leave it out.")
    chosen = _format(Path(path), format)
    asked: dict[str, Any] = {
        "lookahead_time": lookahead_time,
        "gain": gain,
        "efforts": efforts or None,
    }
    asked |= {"size": size, "camera": camera, "speed": speed}
    options = {key: value for key, value in asked.items() if value is not None}
    for key in options:
        if key not in chosen.options:
            names = [each.name for each in FORMATS if key in each.options]
            of = f"the format {names[0]!r}"
            if len(names) > 1:
                of = f"the formats {' and '.join(names)}, not {chosen.name!r}"
            more = "; the others have them" if key == "efforts" else ""
            raise InputError(f"`{key}` is for {of}{more}: leave it out.")
    chosen.write(joined(motions, gap), Path(path), rate, **options)


def _format(path: Path, name: str | None) -> ExportFormat:
    """The format of a name, or of a file's extension. Raises InputError."""
    if name is None:
        return format_of_file(path)
    chosen = export_format(name)
    if path.suffix.lower() not in chosen.suffixes:
        raise InputError(
            f"a file of the format {name!r} must end in {' or '.join(chosen.suffixes)}, not "
            f"{path.name!r}."
        )
    return chosen
