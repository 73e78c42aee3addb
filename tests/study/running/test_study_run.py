"""Studies are resumed, and their table does not depend on how they were run."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from random import Random
from typing import Any

import pinocchio as pin
import pytest

from hovi import plan
from hovi.errors import StudyError
from hovi.planning.task_file.reading import load_task
from hovi.robot.bundled_models import example
from hovi.study.running import runner
from hovi.study.running.chunks import job_of
from hovi.study.running.progress import StudyProgress
from hovi.study.running.work import CellJob, StudyWork
from hovi.study.study import Study
from hovi.workers.pool import end_idle_workers
from oracles.processes import children, is_running
from samples.studies import digest, reaches

pa = pytest.importorskip("pyarrow")
pq = pytest.importorskip("pyarrow.parquet")
pytest.importorskip("pandas")


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("undisturbed")
    assert reaches(samples=5).run(folder, 1).complete
    return folder


@pytest.fixture(scope="module")
def undisturbed_warm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("undisturbed_warm")
    assert reaches(warm=True).run(folder, 1).complete
    return folder


def interrupt_after(count: int) -> Any:
    def stop(state: StudyProgress) -> None:
        if state.done - state.before >= count:
            raise KeyboardInterrupt

    return stop


def test_the_rows_are_the_plans_of_the_cells(undisturbed: Path) -> None:
    rows, task = Study.load(undisturbed), load_task(example("two_link_reach"))
    assert rows["cell"].tolist() == list(range(24))
    assert rows["success"].all()
    for _, row in rows.iloc[::7].iterrows():
        goal = task.goal.__class__([row["goal.q[0]"], row["goal.q[1]"]], task.goal.v)
        own = plan(task.scene, task.start, goal, task.duration, options=task.options)
        assert row["cost"] == own.cost
        assert row["q_goal"].tolist() == own.trajectory.q[-1].tolist()
        assert row["peak_v"][0] >= abs(own.trajectory.v[:, 0]).max()
        stored = Study.motion(undisturbed, row["key"])
        assert stored.path.q.tolist() == own.trajectory.path.q.tolist()


def test_the_table_has_the_same_bytes_for_any_number_of_workers(
    undisturbed: Path, tmp_path: Path
) -> None:
    reaches(samples=5).run(tmp_path, 3)
    assert digest(tmp_path) == digest(undisturbed)
    assert digest(tmp_path, "samples.parquet") == digest(undisturbed, "samples.parquet")


def test_a_second_start_does_what_is_missing_and_nothing_else(
    undisturbed: Path, tmp_path: Path
) -> None:
    first = reaches(samples=5).run(tmp_path, 2, progress=interrupt_after(7))
    assert first.interrupted
    assert 7 <= first.done < 24
    assert len(Study.load(tmp_path)) >= first.done
    second = reaches(samples=5).run(tmp_path, 2)
    assert second.complete
    runs = Study.load_runs(tmp_path)
    assert runs["key"].is_unique
    assert second.new < 24
    assert reaches(samples=5).run(tmp_path, 2).new == 0
    assert digest(tmp_path) == digest(undisturbed)


def test_killed_workers_cost_no_plan(undisturbed: Path, tmp_path: Path) -> None:
    random, killed = Random(1), []

    def kill(state: StudyProgress) -> None:
        workers = [pid for pid in children(os.getpid()) if pid not in killed]
        if workers and len(killed) < 2 and state.done % 4 == 0:
            killed.append(random.choice(workers))
            os.kill(killed[-1], signal.SIGKILL)

    end_idle_workers()
    assert reaches(samples=5).run(tmp_path, 2, progress=kill).complete
    assert killed
    assert digest(tmp_path) == digest(undisturbed)


def test_a_killed_run_leaves_what_was_finished(undisturbed: Path, tmp_path: Path) -> None:
    """The first run is ended by the system in the middle, with its workers."""
    program = f"""
import os, signal, sys
sys.path.insert(0, {str(Path(__file__).parents[2])!r})
from samples.studies import reaches
def stop(state):
    if state.done >= 9:
        os.kill(os.getpid(), signal.SIGKILL)
reaches(samples=5).run({str(tmp_path)!r}, 2, progress=stop)
"""
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True)
    assert ended.returncode == -signal.SIGKILL
    assert not (tmp_path / "plans.parquet").exists()
    report = reaches(samples=5).run(tmp_path, 2)
    assert report.complete
    assert report.new <= 24 - 9
    assert digest(tmp_path) == digest(undisturbed)


@pytest.mark.long
def test_a_cell_that_ends_its_workers_is_given_up_and_tried_again_later(
    undisturbed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Deadly(StudyWork):
        def _do(self, job: CellJob, desk: Any) -> Any:
            if job.number == 5:
                os.kill(os.getpid(), signal.SIGSEGV)
            return super()._do(job, desk)

    Deadly.__module__ = "__main__"  # sent by its code
    monkeypatch.setattr(runner, "StudyWork", Deadly)
    report = reaches(samples=5).run(tmp_path, 2)
    assert report.done == 23
    assert [each.split(" (")[0] for each in report.lost] == [
        "a worker process was ended by SIGSEGV"
    ]
    attempts = Study.load_runs(tmp_path)
    lost = attempts[attempts["outcome"] != "done"]
    assert lost["attempt"].tolist() == [1, 2, 3]
    assert 5 not in Study.load(tmp_path)["cell"].tolist()
    monkeypatch.undo()
    assert reaches(samples=5).run(tmp_path, 2).new == 1
    assert digest(tmp_path) == digest(undisturbed)


@pytest.mark.parametrize("workers", [1, pytest.param(2, marks=pytest.mark.long)])
def test_plans_from_neighbours_do_not_depend_on_interruptions(
    undisturbed_warm: Path, tmp_path: Path, workers: int
) -> None:
    done = 0
    for stop in (5, 8) if workers == 1 else (3, 5, 1, 6):
        report = reaches(warm=True).run(tmp_path, workers, progress=interrupt_after(stop))
        assert report.done > done
        done = report.done
    assert reaches(warm=True).run(tmp_path, workers).complete
    assert digest(tmp_path) == digest(undisturbed_warm)


@pytest.mark.long
def test_plans_from_neighbours_survive_killed_workers(
    undisturbed_warm: Path, tmp_path: Path
) -> None:
    killed: list[int] = []

    def kill(state: StudyProgress) -> None:
        if state.done > 3 * len(killed) and len(killed) < 4:
            killed.extend(children(os.getpid())[:1])
            os.kill(killed[-1], signal.SIGKILL)

    end_idle_workers()
    assert reaches(warm=True).run(tmp_path, 2, progress=kill).complete
    assert digest(tmp_path) == digest(undisturbed_warm)


def test_warm_plans_find_the_cold_minima(undisturbed: Path, undisturbed_warm: Path) -> None:
    cold, warm = Study.load(undisturbed), Study.load(undisturbed_warm)
    assert (warm["cost"] <= cold["cost"] * (1 + 1e-6)).all()
    assert warm["nit"].sum() < cold["nit"].sum()
    assert warm["parent"].isna().sum() == 1


def test_a_parent_of_another_robot_gives_no_guess(tmp_path: Path) -> None:
    joints = ["wrist_1_joint", "wrist_2_joint", "wrist_3_joint"]
    values = [[joints[i:], [0.0] * (3 + i), [0.3] * (3 + i)] for i in (0, 0, 1)]
    study = Study(
        "ur5_reach", [{"fields": ["locked", "start.q", "goal.q"], "values": values}], warm=True
    )
    study.run(tmp_path, 1)
    rows = Study.load(tmp_path)
    assert "refused" not in rows["status"].tolist()
    assert rows["success"][:2].all()
    assert [key if isinstance(key, str) else None for key in rows["parent"]] == [
        None,
        rows["key"][0],
        None,
    ]


def test_no_failure_stops_a_study(tmp_path: Path) -> None:
    fields = [
        {"field": "goal.q", "values": [[0.3, 0.7], [0.3], [float(10**9), 0.0]]},
        {"field": "limits", "values": ["none", {"base": "none", "tau": 0.5}]},
    ]
    told = []

    def tell(state: StudyProgress) -> None:
        if state.failed is not None:
            told.append((state.failed.number, state.failed.status))

    report = Study("two_link_reach", fields).run(tmp_path, 2, progress=tell)
    rows = Study.load(tmp_path)
    assert report.complete
    assert rows["status"].tolist()[:4] == ["minimum", "infeasible", "refused", "refused"]
    assert "goal.q" in rows["reason"][2]
    assert str(example("two_link_reach").parent) not in " ".join(rows["reason"])
    assert sorted(number for number, _ in told) == rows.index[~rows["success"]].tolist()


def test_poses_are_met_by_inverse_kinematics_or_unreachable(tmp_path: Path) -> None:
    poses = {"frame": "tip", "lower": [1.2, 0, 0], "upper": [2.8, 0, 0], "grid": [3, 1, 1]}
    study = Study("two_link_reach", [{"field": "goal", "poses": poses}])
    study.run(tmp_path, 1)
    rows = Study.load(tmp_path)
    assert rows["goal.position[0]"].tolist() == pytest.approx([1.2, 2.0, 2.8])
    task = load_task(example("two_link_reach"))
    model, frame = task.scene.model, task.scene.model.getFrameId("tip")
    data = model.createData()
    for _, row in rows.iterrows():
        if row["status"] == "unreachable":
            assert row["q_goal"] is None
            continue
        pin.framesForwardKinematics(model, data, row["q_goal"])
        at = data.oMf[frame].translation
        assert at[0] == pytest.approx(row["goal.position[0]"], abs=1e-9)
    assert rows["status"].tolist()[-1] == "unreachable"


def test_a_time_limit_that_was_felt_marks_the_row(tmp_path: Path) -> None:
    study = Study("ur5_reach", [{"field": "time_limit", "values": [0.001, 600.0]}])
    study.run(tmp_path, 1)
    rows = Study.load(tmp_path)
    assert rows["reproducible"].tolist() == [False, True]


def test_another_scene_goes_to_a_folder_beside(tmp_path: Path) -> None:
    for name in ("two_link.urdf", "two_link_reach.toml"):
        (tmp_path / name).write_text(example(name).read_text())
    scene, out = tmp_path / "two_link_reach.toml", tmp_path / "out"

    def run(replace: bool = False) -> Any:
        return Study(scene, [{"field": "duration", "values": [1.0, 1.1]}]).run(
            out, 1, replace=replace
        )

    assert run().folder == out
    before = digest(out)
    scene.write_text(scene.read_text().replace("9.8 ", "9.7 "))
    other = run()
    assert other.folder.parent == tmp_path
    assert other.folder != out
    assert other.new == 2
    assert digest(out) == before
    assert run().folder == other.folder
    assert run().new == 0
    assert run(replace=True).folder == out
    assert digest(out) == digest(other.folder)


def goals(count: int) -> Study:
    axis = {"field": "goal.q[0]", "values": [0.1 * i for i in range(count)]}
    return Study("two_link_reach", [axis])


def test_another_study_of_the_scene_does_not_replace_the_plans_of_a_folder(tmp_path: Path) -> None:
    goals(9).run(tmp_path, 1)
    before, about = digest(tmp_path), (tmp_path / "study.json").read_bytes()
    with pytest.raises(StudyError, match="holds 9 plans, of which 7 are not among the 2 of this"):
        goals(2).run(tmp_path, 1)
    durations = Study("two_link_reach", [{"field": "duration", "values": [1.0, 1.1]}])
    with pytest.raises(StudyError, match="of which 9 are not among the 2 of this study and would"):
        durations.run(tmp_path, 1)
    assert (digest(tmp_path), (tmp_path / "study.json").read_bytes()) == (before, about)
    assert goals(11).run(tmp_path, 1).new == 2  # more values are no other study
    assert durations.run(tmp_path, 1, replace=True).new == 2
    assert durations.run(tmp_path, 1).new == 0
    assert len(Study.load(tmp_path)) == 2


def test_another_study_does_not_continue_one_that_was_killed(tmp_path: Path) -> None:
    goals(3).run(tmp_path, 1)
    (tmp_path / "plans.parquet").unlink()  # written at the end
    with pytest.raises(StudyError, match="holds 3 plans, of which 2 are not"):
        goals(1).run(tmp_path, 1)
    assert goals(3).run(tmp_path, 1).new == 0


def test_the_plans_of_another_study_are_kept_without_its_journal(tmp_path: Path) -> None:
    goals(3).run(tmp_path, 1)
    shutil.rmtree(tmp_path / "journal")
    with pytest.raises(StudyError, match="holds 3 plans, of which 1 are not"):
        goals(2).run(tmp_path, 1)
    pq.write_table(pa.table({"mine": [1.0]}), tmp_path / "plans.parquet")
    with pytest.raises(StudyError, match="is no table of a study"):
        goals(2).run(tmp_path, 1)


def test_a_plan_is_on_the_disk_before_it_counts_as_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Motions before the lines that refer to them, lines before the parent is told, and names."""
    study, unsynced = goals(2), set[str]()
    (tmp_path / "journal").mkdir()
    write, fsync = os.write, os.fsync

    def name(descriptor: int) -> str:
        return Path(f"/proc/self/fd/{descriptor}").readlink().name

    def writing(descriptor: int, content: Any) -> int:
        if name(descriptor).endswith(".lines"):
            assert not [each for each in unsynced if each.endswith(".bytes")]
        if name(descriptor).endswith((".lines", ".bytes")):
            unsynced.add(name(descriptor))
        return write(descriptor, content)

    def syncing(descriptor: int) -> None:
        synced.append(name(descriptor))
        unsynced.discard(synced[-1])
        fsync(descriptor)

    synced: list[str] = []
    monkeypatch.setattr(os, "write", writing)
    monkeypatch.setattr(os, "fsync", syncing)
    work = StudyWork(study.cells.template, str(tmp_path), study.output, "run")
    work(tuple(job_of(study.cells.cell(number)) for number in range(2)))
    assert [Path(each).suffix for each in synced] == ["", ".bytes", "", ".bytes", ".lines"]
    assert not unsynced


def test_two_runs_do_not_use_one_folder(tmp_path: Path) -> None:
    def again(state: StudyProgress) -> None:
        with pytest.raises(StudyError, match="another run is working"):
            reaches().run(tmp_path, 1)
        raise KeyboardInterrupt

    assert reaches().run(tmp_path, 1, progress=again).interrupted


def test_workers_end_with_a_study_that_is_killed(tmp_path: Path) -> None:
    program = f"""
import os, sys
sys.path.insert(0, {str(Path(__file__).parents[2])!r})
from oracles.processes import children
from samples.studies import reaches
def stop(state):
    if state.done >= 2:
        print(*children(os.getpid()), flush=True)
        os.kill(os.getpid(), 9)
reaches().run({str(tmp_path)!r}, 2, progress=stop)
"""
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    workers = [int(each) for each in ended.stdout.split()]
    assert workers
    from oracles.processes import wait_until

    wait_until(lambda: not any(map(is_running, workers)))
