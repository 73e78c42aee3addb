"""What a worker does: it plans the cells of a chunk, and writes down each as it is done."""

from __future__ import annotations

import dataclasses
import functools
import io
import os
import socket
import tempfile
import time
import warnings
from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.errors import HoviError, HoviWarning, UnreachableError
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.inverse_kinematics import inverse_kinematics
from hovi.planning.solver.solver import Solution
from hovi.planning.solver.status import Status
from hovi.planning.task_file.scene_cache import SceneCache
from hovi.planning.task_file.task import Task
from hovi.planning.task_file.task_plan import plan_task
from hovi.study.cells.field_path import FieldPath
from hovi.study.cells.template import Template
from hovi.study.running.guesses import GuessCosts, Motions
from hovi.study.running.measures import row_of
from hovi.study.storage.journal import JournalWriter, StorageError, Stored
from hovi.study.storage.rows import FAILED, REFUSED, UNREACHABLE, PlanRow
from hovi.study.storage.samples import SampleFormat, Samples
from hovi.system.blas_threads import one_blas_thread
from hovi.system.dataclass import dataclass
from hovi.version import __version__

LEAST_GAIN = 1e-6
"""Fraction by which a minimum from a plan's own guess has to cost less than one from a parent's."""


@dataclass(frozen=True)
class Output:
    """What is stored of each motion.

    motions: whether the whole motion. samples: number of samples, 0 for none.
    sample_format: of the file of all samples.
    """

    motions: bool = True
    samples: int = 0
    sample_format: SampleFormat = "parquet"


@dataclass(frozen=True)
class Guess:
    """The motion of another plan. key: of that plan. motion: where it is."""

    key: str
    motion: Stored


@dataclass(frozen=True)
class CellJob:
    """A cell to be planned: see Cell.

    attempt: 1 for the first one. guesses: of which it starts from the cheapest.
    own_guess: whether it starts from its own guess as well, and the lower minimum is taken.
    """

    number: int
    key: str
    values: tuple[tuple[FieldPath, Any], ...]
    ends: tuple[str, ...] = ()
    attempt: int = 1
    guesses: tuple[Guess, ...] = ()
    own_guess: bool = True


@dataclass(frozen=True)
class Receipt:
    """What the parent gets to know of a plan that is done and stored.

    reason: of a failure; "" for a success. motion: where it is, which its children start from.
    """

    number: int
    key: str
    status: str
    seconds: float
    reason: str = ""
    motion: Stored | None = None

    @property
    def success(self) -> bool:
        """Whether there is nothing to say about it."""
        return not self.reason


@dataclass(frozen=True, eq=False)
class StudyWork:
    """Plans chunks in a worker. folder: of the study, absolute. run: an id of this run."""

    template: Template
    folder: str
    output: Output
    run: str

    @one_blas_thread
    def __call__(self, chunk: tuple[CellJob, ...], left: float | None = None) -> list[Receipt]:
        """Plan the cells of a chunk. Raises StorageError, and MemoryError."""
        desk = _desk(self.folder, self.run, self.template.hash)
        receipts = [self._do(job, desk) for job in chunk]
        desk.writer.sync()
        return receipts

    def _do(self, job: CellJob, desk: _Desk) -> Receipt:
        began, wall, processor = datetime.now(UTC), time.perf_counter(), time.process_time()
        row, motion = self._planned(job, desk)
        seconds = time.perf_counter() - wall
        spent = {"seconds": seconds, "processor_seconds": time.process_time() - processor}
        stored = samples = None
        if motion is not None:
            stored = desk.writer.store(_bytes_of(motion)) if self.output.motions else None
            if self.output.samples:
                sampled = Samples.of(motion, self.output.samples)
                samples = desk.writer.store(sampled.to_bytes())
        entry = {
            "key": job.key,
            "row": row.to_dict(),
            "motion": None if stored is None else stored.to_list(),
            "samples": None if samples is None else samples.to_list(),
            "asked": [self.output.motions, self.output.samples],
            "run": {
                "attempt": job.attempt,
                "outcome": "done",
                "host": socket.gethostname(),
                "process": os.getpid(),
                "began": began.isoformat(),
                **spent,
                "version": __version__,
            },
        }
        desk.writer.add(entry)
        reason = "" if row.success else row.reason or row.status
        if motion is not None and stored is not None and row.success:
            desk.motions.put(stored, motion)
        return Receipt(job.number, job.key, row.status, seconds, reason, stored)

    def _planned(self, job: CellJob, desk: _Desk) -> tuple[PlanRow, Trajectory | None]:
        """The row of a cell and its motion."""
        began = time.perf_counter()
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                task = self._task(job, desk)
                solution, parent = _solved(task, job, desk)
            except UnreachableError as error:
                return self._without_motion(UNREACHABLE, error), None
            except HoviError as error:
                return self._without_motion(REFUSED, error), None
            except (MemoryError, StorageError):
                raise
            except Exception as error:  # what it is, the row says
                return self._without_motion(FAILED, f"{type(error).__name__}: {error}"), None
        if solution.status is Status.INTERRUPTED:
            raise KeyboardInterrupt
        texts = [str(each.message) for each in caught if issubclass(each.category, HoviWarning)]
        seconds, limit = time.perf_counter() - began, task.options.time_limit_seconds
        row = row_of(solution, " ".join(dict.fromkeys(texts)), seconds, limit)
        return dataclasses.replace(row, parent=parent), solution.trajectory

    def _without_motion(self, status: str, reason: Any) -> PlanRow:
        """The row of a cell without a motion; its reason names no folder of this machine."""
        folder = f"{self.template.toml.path.parent}/"
        return PlanRow(status, reason=str(reason).replace(folder, ""), version=__version__)

    def _task(self, job: CellJob, desk: _Desk) -> Task:
        """The task of a cell, with targets of frames replaced by configurations where asked for."""
        task = self.template.task(self.template.with_values(job.values), desk.cache)
        for end, other in (("start", "goal"), ("goal", "start")):
            target = getattr(task, end)
            if end in job.ends and isinstance(target, FrameGoal):
                ends: dict[str, Any] = {end: _met(task, target, getattr(task, other))}
                task = dataclasses.replace(task, **ends)
        return task


@dataclass(frozen=True, eq=False)
class _Desk:
    """What a worker keeps between chunks."""

    writer: JournalWriter
    cache: SceneCache
    motions: Motions
    costs: GuessCosts


@functools.lru_cache(maxsize=4)
def _desk(folder: str, run: str, template: str) -> _Desk:
    return _Desk(JournalWriter(Path(folder)), SceneCache(), Motions(Path(folder)), GuessCosts())


def _solved(task: Task, job: CellJob, desk: _Desk) -> tuple[Solution, str | None]:
    """The plan, and the key of the one from whose motion it started.

    From the cheapest guess, and from the task's own one where that finds no minimum, or where the
    job asks for both, of which the lower minimum is taken.
    """
    several: dict[str, Any] = {"processes": 1} if task.options.starts > 1 else {}
    known = _guesses(task, job, desk)
    warm = None
    if known:
        parent, motion = known[desk.costs.cheapest(task, [motion for _, motion in known])]
        warm = plan_task(task, guess=motion, **several)
        if warm.status is Status.INTERRUPTED or (warm.success and not job.own_guess):
            return warm, parent
    own = plan_task(task, **several)
    if warm is None or not warm.success or own.status is Status.INTERRUPTED:
        return own, None
    least = warm.cost - LEAST_GAIN * abs(warm.cost)
    return (own, None) if own.success and own.cost < least else (warm, parent)


def _guesses(task: Task, job: CellJob, desk: _Desk) -> list[tuple[str, Trajectory]]:
    """The motions of parents with their keys. Raises StorageError: the fault is not the cell's."""
    try:
        read = [
            (each.key, desk.motions.get(each.motion, task.planned_scene)) for each in job.guesses
        ]
    except (OSError, ValueError, HoviError) as error:
        raise StorageError(f"the motion of a parent could not be read: {error}") from error
    return [(key, motion) for key, motion in read if motion is not None]


def _met(task: Task, target: FrameGoal, other: State | FrameGoal) -> State:
    """At rest where a frame reaches its target, as near to the other end as was found."""
    robot = task.held_scene.robot
    options = task.options.decided(robot)
    near = None
    if isinstance(other, State):
        near = other.resolved(robot, "the other end").on(robot, "it")[0]
    found = inverse_kinematics(
        robot,
        target,
        near=near,
        limits=options.limits,
        obstacles=options.obstacles,
        margin=options.margin,
        self_collision=bool(options.self_collision),
    )
    return State(found[0])


def _bytes_of(motion: Trajectory) -> bytes:
    """The file of a motion, without the meshes that all motions of a study have in common."""
    stream = io.BytesIO()
    motion.save(stream, meshes=False)
    return stream.getvalue()


def motion_from(content: bytes, package_dirs: Iterable[str | Path] = ()) -> Trajectory:
    """The motion of an npz file's bytes. Raises TrajectoryFileError.

    package_dirs: folders with the packages of its meshes.
    """
    with tempfile.NamedTemporaryFile(suffix=".npz") as file:
        file.write(content)
        file.flush()
        return Trajectory.load(file.name, package_dirs)
