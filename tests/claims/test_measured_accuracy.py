"""What `hovi accuracy` says of a run's errors is so, in the units that it names."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.accuracy.tables import COLUMNS, cheapest_rows


@pytest.fixture(scope="module")
def task(arm_scene: hovi.Scene) -> hovi.Task:
    options = hovi.PlanOptions(limits="none", self_collision=False)
    return hovi.Task(arm_scene, [-0.7, 0.2], [0.8, 0.9], 0.8, options, "a reach")


@pytest.fixture(scope="module")
def diagram(task: hovi.Task) -> hovi.accuracy.Diagram:
    return hovi.accuracy.work_precision(
        task, schemes=["galerkin-0", "galerkin-1"], budget=10.0, repeats=1
    )


def test_errors_are_those_of_the_same_grid_planned_alone(
    diagram: hovi.accuracy.Diagram, task: hovi.Task
) -> None:
    ends = task.scene, task.start, task.goal, task.duration
    options = {"options": task.options}
    fine = hovi.plan(*ends, **options, tolerance=1e-11)
    t = np.linspace(0.0, 0.8, 2001)
    q = fine.trajectory.sample(t).q
    judged = 0
    for run in diagram.runs:
        if run.intervals not in (8, 16) or not run.counts:
            continue
        grid = {"scheme": run.method, "intervals": run.intervals, "guess": fine.trajectory}
        alone = hovi.plan(*ends, **options, **grid).trajectory
        other = alone.sample(t).q
        found = run.to_dict()
        true = abs(run.cost / fine.cost - 1)
        assert found["cost_error"] == pytest.approx(true, rel=1e-3)
        assert found["joints_error"] == pytest.approx(np.abs(q - other).max(), rel=0.02)
        tips = np.linalg.norm(tip(task.scene.robot, q) - tip(task.scene.robot, other), axis=1)
        assert found["tip_error_mm"] == pytest.approx(1e3 * tips.max(), rel=0.02)  # in mm
        judged += 1
    assert judged >= 3


def tip(robot: hovi.Robot, q: np.ndarray) -> np.ndarray:
    data, points = robot.model.createData(), []
    frame = robot.model.getFrameId(robot.tip_frame)
    for each in q:
        pin.framesForwardKinematics(robot.model, data, each)
        points.append(data.oMf[frame].translation.copy())
    return np.array(points)


def test_times_are_processor_times_and_every_table_says_so(
    diagram: hovi.accuracy.Diagram, task: hovi.Task
) -> None:
    assert diagram.clock == "processor"
    assert diagram.to_dict()["clock"] == "processor"
    assert all(0 < run.seconds < 10.0 for run in diagram.runs)
    with pytest.raises(hovi.HoviError, match="there is no clock"):
        hovi.accuracy.work_precision(task, budget=1.0, clock="sun")


def test_the_rows_of_the_table_are_runs_that_are_as_accurate_as_they_say(
    diagram: hovi.accuracy.Diagram,
) -> None:
    for row in cheapest_rows(diagram):
        cells = dict(zip(COLUMNS, row, strict=True))
        if not cells["intervals"] or cells["cost error"] == "default":
            continue
        runs = diagram.of(cells["method"])
        (run,) = [each for each in runs if str(each.intervals) == cells["intervals"]]
        assert run.error.cost <= float(cells["cost error"])
        assert float(cells["tip [mm]"]) == pytest.approx(1e3 * run.error.largest_tip, rel=0.5)
        assert float(cells["warm [ms]"]) == pytest.approx(1e3 * run.seconds, rel=1e-2)
        finer = [each for each in runs if each.intervals > run.intervals and each.counts]
        assert all(each.error.cost <= float(cells["cost error"]) for each in finer)
