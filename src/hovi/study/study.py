"""Study: many plans of one scene with fields that vary."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Self

from hovi.checks.arguments import check_arguments_except
from hovi.discrete.trajectory import Trajectory
from hovi.errors import HoviError, InputError, StudyError
from hovi.planning.task_file.messages import TomlText
from hovi.planning.task_file.reading import parsed, read_toml
from hovi.planning.task_file.scene_cache import SceneCache
from hovi.study.cells.cells import Cells
from hovi.study.cells.extras import require_extra
from hovi.study.running.progress import OnProgress, run_reported
from hovi.study.running.runner import StudyRun
from hovi.study.running.work import Output, motion_from
from hovi.study.storage.folder import About, used_alone
from hovi.study.storage.index import Index
from hovi.study.storage.samples import SampleFormat
from hovi.study.storage.tables import PLANS, RUNS, read_table
from hovi.study.study_file import cells_of, validated
from hovi.system.dataclass import dataclass
from hovi.version import __version__

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl

    from hovi.study.showing.state import StudyState
    from hovi.viewing.curves.shown_figure import ShownFigure

FrameKind = Literal["pandas", "polars"]
LOCAL = "local"
"""The scheduler that a run starts on this machine."""
MAX_WORKERS = 1000
"""Largest number of worker processes."""


@dataclass(frozen=True)
class StudyReport:
    """What a run of a study has done.

    folder: where the tables are, next to the given one if that held another study.
    count: of all plans. done: of those that are done. new: of those that this run has done.
    failures: of those that this run has done, by status, such as {"infeasible": 3}.
    lost: reasons for which plans were given up in this run, as their workers died each time.
    interrupted: whether Ctrl-C ended the run.
    """

    folder: Path
    count: int
    done: int
    new: int
    failures: dict[str, int]
    lost: tuple[str, ...]
    interrupted: bool

    @property
    def complete(self) -> bool:
        """Whether all plans are done."""
        return self.done == self.count


@check_arguments_except("package_dirs")
@dataclass(frozen=True, eq=False)
class Study:
    """Many plans of one scene, with fields that vary.

    scene: the path of a scene file, or the name of a shipped one.
    vary: the axes, whose combinations are planned: tables as in a study file, such as
        {"field": "goal.q[0]", "grid": {"lower": 0.0, "upper": 1.0, "count": 5}}.
    seed: of samples.
    warm: whether each plan starts from the motion of a neighbour on the grid.
    motions: whether the motions are stored. samples: how many samples of each are, besides.
    sample_format: of their file, samples.parquet or samples.zarr.zip.
    cells, output: what is planned, and what is stored of it.
    Raises SceneError for fields that scene files do not have, and for axes without values.
    """

    scene: str | Path
    vary: Sequence[Mapping[str, Any]] = ()
    seed: int = 0
    warm: bool = False
    motions: bool = True
    samples: int = 0
    sample_format: SampleFormat = "parquet"
    _toml: TomlText | None = field(default=None, repr=False)
    cells: Cells = field(init=False, repr=False)
    output: Output = field(init=False, repr=False)

    def __post_init__(self) -> None:
        output = {name: getattr(self, name) for name in ("motions", "samples", "sample_format")}
        table = {
            "scene": str(self.scene),
            "seed": self.seed,
            "warm": self.warm,
            "output": output,
            "vary": [dict(each) for each in self.vary],
        }
        toml = self._toml or TomlText(Path("study").absolute(), json.dumps(table, default=str))
        cells, stored = cells_of(validated(table, toml), toml)
        for name, value in (("_toml", toml), ("cells", cells), ("output", stored)):
            object.__setattr__(self, name, value)

    @classmethod
    def read(cls, path: str | Path) -> Self:
        """The study of a file. Raises SceneError with file, line, expected and given value."""
        toml = read_toml(Path(path).absolute())
        data = parsed(toml)
        table = validated(data, toml)
        return cls(
            scene=table.scene,
            vary=data.get("vary", ()),
            seed=table.seed,
            warm=table.warm,
            motions=table.output.motions,
            samples=table.output.samples,
            sample_format=table.output.sample_format,
            _toml=toml,
        )

    @property
    def count(self) -> int:
        """The number of plans."""
        return self.cells.count

    @property
    def note(self) -> str:
        """What is assumed of its scene file, as a sentence; "" if nothing is known to be."""
        template = self.cells.template
        try:
            return template.task(template.table, SceneCache()).note
        except HoviError:  # as where an axis gives what the file lacks
            return ""

    def run(
        self,
        folder: str | Path,
        workers: int = 1,
        *,
        scheduler: str | None = None,
        replace: bool = False,
        progress: OnProgress | None = None,
    ) -> StudyReport:
        """Plan what is missing in a folder, and write plans.parquet and runs.parquet there.

        Rows have the order of the cells, so that plans.parquet has the same bytes whatever the
        workers, and however often it was interrupted. Ctrl-C ends the run, with what is done.
        folder: created if need be. One that holds the study of another scene, or of another
            version of hovi, is left as it is: the new one goes to a folder next to it.
        workers: number of worker processes.
        scheduler: the address of a Dask scheduler, such as "tcp://127.0.0.1:8786", whose workers
            see the same files; or "local" for one on this machine with as many workers.
        replace: continue in the folder whatever it holds; plans of other cells leave the tables.
        progress: called with a StudyProgress after each chunk and each failure; in a notebook, a
            line under the cell by default.
        Raises StudyError if the folder cannot be written, is in use, or holds plans of another
        study of the same scene.
        """
        require_extra("pyarrow", "study")
        if self.samples and self.sample_format == "zarr":
            require_extra("zarr", "zarr")
        if not 1 <= workers <= MAX_WORKERS:
            raise InputError(f"workers must be from 1 to {MAX_WORKERS}, got {workers}.")
        if scheduler is not None:
            if scheduler != LOCAL and "://" not in scheduler:
                raise InputError(
                    f'scheduler must be "local" or an address such as "tcp://127.0.0.1:8786", got '
                    f"{scheduler!r}."
                )
            require_extra("distributed", "cluster")
        about = self._about()
        chosen = Path(folder).absolute()
        if not replace:
            chosen = _own_folder(chosen, about)
        with used_alone(chosen), run_reported(progress) as on_progress:
            run = StudyRun(
                *(self.cells, about, chosen, self.output, workers, scheduler, on_progress, replace)
            )
            run.run()
        return StudyReport(
            chosen,
            self.count,
            run.progress.done,
            run.progress.done - run.progress.before,
            dict(sorted(run.progress.failures.items())),
            tuple(why for _, why in run.given_up),
            run.interrupted,
        )

    def _about(self) -> About:
        assert self._toml is not None
        template = self.cells.template
        known = template.hash, __version__, self._toml.text, str(template.toml.path)
        return About(*known, self.count, self._coordinates())

    def _coordinates(self) -> tuple[str, ...]:
        """See About."""
        fields = (path.text for axis in self.cells.axes for path in axis.fields)
        if any(text.startswith("robot") for text in fields):
            return ()
        template = self.cells.template
        try:
            robot = template.task(template.table, SceneCache()).scene.robot
        except HoviError:  # as where an axis gives what the file lacks
            return ()
        if robot.nq != robot.nv:
            return ()
        units = zip(robot.coordinate_names, robot.coordinate_units, strict=True)
        return tuple(f"{name} [{unit.q}]" for name, unit in units)

    @staticmethod
    def load(folder: str | Path, frame: FrameKind = "pandas") -> pd.DataFrame | pl.DataFrame:
        """plans.parquet of a study as a frame of pandas or polars.

        Raises StudyError if there is none.
        """
        require_extra(frame, "study")
        table = read_table(Path(folder) / PLANS)
        if frame == "polars":
            import polars as pl

            found: pl.DataFrame = pl.from_arrow(table)
            return found
        return table.to_pandas()

    @staticmethod
    def load_runs(folder: str | Path) -> pd.DataFrame:
        """runs.parquet of a study: when, where and how long each plan was computed."""
        require_extra("pandas", "study")
        return read_table(Path(folder) / RUNS).to_pandas()

    @staticmethod
    def state(folder: str | Path) -> StudyState:
        """How far a study is, while it runs or later: `text()` says it in a line.

        The folder is only read, so that a run is not disturbed. Raises StudyError if it holds none.
        """
        from hovi.study.showing.state import StudyState

        return StudyState.read(Path(folder))

    @staticmethod
    def map(
        folder: str | Path, over: tuple[str, str] | None = None, value: str = "cost"
    ) -> ShownFigure:
        """A column of plans.parquet over two parameters, as a figure that a notebook shows.

        over: names of the parameters, along x and y; the first two that vary by default. Where
            several plans have the same values of both, the best one is drawn. value: the column.
        Raises StudyError without a table, and InputError for columns that it has not, or that are
        no numbers.
        """
        from hovi.study.showing.charts import map_of
        from hovi.study.showing.plans import Plans

        return map_of(Plans.read(Path(folder)), over, value)

    @staticmethod
    def histograms(folder: str | Path) -> ShownFigure:
        """How plans ended, and what minima cost and took, as a figure that a notebook shows.

        Raises StudyError without a table.
        """
        from hovi.study.showing.charts import histograms_of
        from hovi.study.showing.plans import Plans

        return histograms_of(Plans.read(Path(folder)))

    @staticmethod
    def motion(folder: str | Path, key: str, package_dirs: Iterable[str | Path] = ()) -> Trajectory:
        """The motion of a plan. Raises StudyError if there is none.

        key: of the plan. package_dirs: folders with the packages of the meshes of a robot that was
            loaded from a file, which a study does not store.
        """
        index = Index(Path(folder))
        index.read_new()
        done = index.done(key)
        if done is None or done.motion is None:
            why = "no plan" if done is None else "no motion of the plan"
            raise StudyError(f"the study in {folder} has {why} with the key {key!r}.")
        try:
            return motion_from(done.motion.read(Path(folder)), package_dirs)
        except (OSError, ValueError) as damaged:
            raise StudyError(f"the motion {key!r} in {folder} is damaged: {damaged}.") from None


def _own_folder(folder: Path, about: About) -> Path:
    """The folder, or one next to it that is named by the study, if it holds another one."""
    held = About.read(folder)
    if held is None or held.identity == about.identity:
        return folder
    neighbor = folder.with_name(f"{folder.name}-{about.scene[:8]}")
    held = About.read(neighbor)
    if held is None or held.identity == about.identity:
        return neighbor
    return folder.with_name(f"{folder.name}-{about.scene[:8]}-{about.version}")
