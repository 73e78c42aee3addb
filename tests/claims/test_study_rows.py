"""The rows of a study are the plans of `hovi.plan`: successes, failures and every number."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hovi
from hovi.cli.application import main

pq = pytest.importorskip("pyarrow.parquet")

SCENE = """robot = "ball.urdf"
duration = 0.8
margin = 0.01
self_collision = false
start.q = [-1.0]
goal.q = [1.2]
effects.gravity.acceleration = 0.0
effects.viscous_friction.coefficient = 0.4
effects.effort_weight.weight = [2.0]
scheme = { name = "galerkin-8", intervals = 5 }
[[obstacles]]
kind = "sphere"
position = [1.2, 0.0, 0.0]
radius = 0.05
"""
ROBOT = """<robot name="ball"><link name="base"/><link name="arm"><inertial>
<origin xyz="0.5 0 0"/><mass value="1"/>
<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
<collision><origin xyz="1.0 0 0"/><geometry><sphere radius="0.05"/></geometry></collision></link>
<joint name="hinge" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" velocity="3.6" effort="500"/></joint></robot>"""
DURATIONS = (0.8, 1.1, 0.2, 0.0)
"""A motion at its velocity limit and one within, one that is too fast, and one that is none."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("rows")
    (folder / "scene.toml").write_text(SCENE)
    (folder / "ball.urdf").write_text(ROBOT)
    (folder / "study.toml").write_text(
        f'scene = "scene.toml"\n[[vary]]\nfield = "duration"\nvalues = {list(DURATIONS)}\n'
    )
    options = ["--out", str(folder / "out"), "--workers", "1"]
    assert main(["study", "run", str(folder / "study.toml"), *options]) == 0
    return folder


@pytest.fixture(scope="module")
def rows(folder: Path) -> list[dict[str, Any]]:
    return list(pq.read_table(folder / "out" / "plans.parquet").to_pylist())


def planned(folder: Path, duration: float) -> hovi.Solution:
    task = hovi.load_task(folder / "scene.toml")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return hovi.plan(
            task.scene, task.start, task.goal, duration, options=task.options, processes=1
        )


def test_success_is_that_of_each_plan(rows: list[dict[str, Any]]) -> None:
    assert [row["success"] for row in rows] == [True, True, False, False]
    assert [row["status"] for row in rows] == ["minimum", "minimum", "infeasible", "refused"]
    assert rows[2]["reason"] and rows[3]["reason"]  # noqa: PT018


@pytest.mark.parametrize("cell", [0, 1, 2])
def test_numbers_are_those_of_the_plan(rows: list[dict[str, Any]], folder: Path, cell: int) -> None:
    row, solution = rows[cell], planned(folder, DURATIONS[cell])
    assert row["success"] == solution.success
    assert row["reason"] == solution.message
    for name in ("cost", "effort", "error_estimate"):
        expected = getattr(solution, name)
        assert row[name] == (None if expected is None else pytest.approx(expected, rel=1e-9)), name
    assert (row["nit"], row["n_neg"]) == (solution.nit, solution.n_neg)
    assert row["motion_duration"] == solution.trajectory.duration == DURATIONS[cell]
    assert row["motion_intervals"] == solution.trajectory.grid.intervals
    np.testing.assert_allclose(row["q_start"], solution.trajectory.q[0])
    np.testing.assert_allclose(row["q_goal"], solution.trajectory.q[-1])
    assert row["cautions"] is not None
    assert row["excused"] == []


def test_what_a_start_exceeds_is_in_its_row(tmp_path: Path) -> None:
    scene = SCENE.replace("start.q = [-1.0]", "start = { q = [-1.0], v = [3.61] }")
    (tmp_path / "scene.toml").write_text(scene)
    (tmp_path / "ball.urdf").write_text(ROBOT)
    study = hovi.Study(tmp_path / "scene.toml", [{"field": "duration", "values": [1.2]}])
    study.run(tmp_path / "out")
    (row,) = pq.read_table(tmp_path / "out" / "plans.parquet").to_pylist()
    assert row["success"], row["reason"]
    task = hovi.load_task(tmp_path / "scene.toml")
    excused = hovi.plan(task.scene, task.start, task.goal, 1.2, options=task.options).excused
    assert row["excused"] == [str(each) for each in excused]
    assert "'hinge' by up to 0.01 until" in row["excused"][0]


@pytest.mark.parametrize("cell", [0, 1])
def test_peaks_margins_and_distances_are_those_of_dense_samples(
    rows: list[dict[str, Any]], folder: Path, cell: int
) -> None:
    row, motion = rows[cell], planned(folder, DURATIONS[cell]).trajectory
    dense = motion.sample(np.linspace(0.0, motion.duration, 20_001))
    for kind in ("v", "a", "tau"):
        most = np.abs(getattr(dense, kind)).max(axis=0)
        np.testing.assert_allclose(row[f"peak_{kind}"], most, rtol=1e-3)
    bounds = {"q": 3.0, "v": 3.6, "tau": 500.0}
    margins = [(x - np.abs(getattr(dense, kind)).max()) / (2 * x) for kind, x in bounds.items()]
    assert row["margin"] == pytest.approx(min(margins), abs=1e-4)
    ball = np.stack([np.cos(dense.q[:, 0]), np.sin(dense.q[:, 0])])
    least = np.linalg.norm(ball - [[1.2], [0.0]], axis=0).min() - 0.1
    assert row["least_distance"] == pytest.approx(least, abs=1e-6)
    effort = np.trapezoid(0.5 * np.square(dense.tau).sum(axis=1), dx=motion.duration / 20_000)
    assert row["effort"] == pytest.approx(effort, rel=1e-3)
    assert row["cost"] == pytest.approx(2.0 * effort, rel=1e-3)


def test_the_error_of_a_row_is_at_least_the_true_one(
    rows: list[dict[str, Any]], folder: Path
) -> None:
    for row, duration in zip(rows[:2], DURATIONS, strict=False):
        task = hovi.load_task(folder / "scene.toml")
        ends = task.scene, task.start, task.goal, duration
        grid = {"scheme": None, "intervals": None, "tolerance": 1e-6}
        fine = hovi.plan(*ends, options=task.options, processes=1, **grid)
        assert fine.success
        assert row["error_estimate"] >= abs(row["cost"] / fine.cost - 1) - 1e-6


@pytest.mark.parametrize(("line", "said"), [("", True), ("format = 2\n", False)])
def test_a_study_of_a_scene_without_a_format_says_that_links_may_meet(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], line: str, said: bool
) -> None:
    (tmp_path / "scene.toml").write_text(
        f'{line}robot = "ur5"\nduration = 1.0\nstart = [0, -1, 1, 0, 0, 0]\n'
        "goal = [0.1, -1, 1, 0, 0, 0]\neffects.gravity.acceleration = 9.81\n"
    )
    study = tmp_path / "study.toml"
    study.write_text('scene = "scene.toml"\n[[vary]]\nfield = "duration"\nvalues = [1.0]\n')
    assert main(["study", "run", str(study), "--out", str(tmp_path / "out"), "--workers", "1"]) == 0
    told = capsys.readouterr().err
    assert ("note: scene.toml has no `format`, so links may meet" in told) is said
