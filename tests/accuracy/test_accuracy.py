"""Work-precision diagrams: units of errors, orders, Pareto fronts, budgets, reference motions."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import math
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import hovi
import hovi.accuracy
from hovi import PlanOptions
from hovi.accuracy import Run, Thresholds, work_precision
from hovi.accuracy.budget import Budget
from hovi.accuracy.diagram import Diagram
from hovi.accuracy.measuring import INTERVALS
from hovi.accuracy.method import Stopwatch
from hovi.accuracy.picture import work_precision_figure
from hovi.accuracy.reference_motion import ReferenceMotion
from hovi.accuracy.tables import as_csv
from hovi.cli.application import main
from hovi.discrete.state import State
from hovi.errors import InputError
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.task_file.reading import load_task
from hovi.planning.task_file.task import Task
from hovi.robot.bundled_models import example
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from samples import paper_arm

Array = npt.NDArray[np.float64]
SCHEMES = ("galerkin-0", "galerkin-1", "hermite-simpson")


@pytest.fixture(scope="module")
def reach() -> Diagram:
    """Without the rule that ends a slow method, as times on a busy machine say little."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("hovi.accuracy.measuring.DOMINANCE", math.inf)
        task = load_task(example("two_link_reach"))
        return work_precision(task, schemes=SCHEMES, repeats=1, clock="processor")


def error_of(cost: float, joints: float, tip: float) -> hovi.MotionError:
    """The error of a robot with one revolute joint, constant along the motion."""
    q, one = np.full((2, 1), joints), np.full(2, tip)
    unknown, sliding = np.full((1, 1), np.nan), np.zeros(1, dtype=bool)
    return hovi.MotionError(cost, q[:1], unknown, unknown, one[:1], q, one, "tip", sliding)


def run(method: str, intervals: int, cost: float, seconds: float, joints: float = 1e-3) -> Run:
    error = error_of(cost, joints, 1e-3)
    return Run(method, "hovi", 4, intervals, True, "", 1.0, 3, error, 0.1, 1.0, (seconds,))


def diagram_of(reach: Diagram, *runs: Run) -> Diagram:
    return Diagram("synthetic", "near", reach.resolved, runs)


def test_errors_are_in_radians_and_metres(pendulum: Robot) -> None:
    turn, T = 1e-3, 2.0

    def still(t: Array) -> Array:
        return np.zeros((len(t), 1))

    def turned(t: Array) -> Array:
        return np.where(t[:, None] > T / 2, turn, 0.0)

    length = np.linalg.norm(pendulum.frame_position(pendulum.tip_frame, np.zeros((1, 1))))
    error = ReferenceMotion(pendulum, T, still, 2.0).error(2.0 * (1 + 1e-5), turned)
    assert error.cost == pytest.approx(1e-5, rel=1e-9)
    assert error.angle == error.largest_q == turn
    assert error.largest_tip == pytest.approx(2 * length * math.sin(turn / 2), rel=1e-9)
    np.testing.assert_array_equal(error.q_at_nodes, [[0.0], [turn]])
    assert error.frame == pendulum.tip_frame


def test_of_several_tips_the_largest_error_counts(two_arms: Robot) -> None:
    def still(t: Array) -> Array:
        return np.zeros((len(t), 4))

    def turned(t: Array) -> Array:
        return np.where(t[:, None] > 0.5, [1e-3, 0.0, 0.0, 2e-3], 0.0)

    error = ReferenceMotion(two_arms, 1.0, still, 1.0).error(1.0, turned)
    ends = still(np.ones(1)), turned(np.ones(1))
    left, right = (
        np.linalg.norm(np.subtract(*(two_arms.frame_position(frame, q) for q in ends)))
        for frame in ("left_gripper", "right_gripper")
    )
    worst = "left_gripper" if left > right else "right_gripper"
    assert (error.frame, error.largest_tip) == (worst, pytest.approx(max(left, right), rel=1e-12))
    assert error.tip_at_nodes == pytest.approx([0.0, max(left, right)], rel=1e-12)


@pytest.mark.parametrize("cost", [math.inf, math.nan])
def test_a_non_finite_cost_has_infinite_errors(pendulum: Robot, cost: float) -> None:
    reference = ReferenceMotion(pendulum, 1.0, lambda t: np.zeros((len(t), 1)), 1.0)
    error = reference.error(cost, lambda t: np.full((len(t), 1), np.nan))
    assert error.cost == error.largest_q == error.largest_tip == math.inf


def test_the_old_name_of_motion_error_warns() -> None:
    with pytest.warns(DeprecationWarning, match=r"hovi\.accuracy\.Thresholds"):
        assert hovi.accuracy.MotionError is hovi.MotionError


def test_thresholds_are_met_if_no_error_is_larger() -> None:
    small = Thresholds(cost=1e-6, joints=1e-4, tip=1e-3)
    assert small.met_by(error_of(1e-6, 1e-4, 1e-3))
    for error in (error_of(2e-6, 0, 0), error_of(0, 2e-4, 0), error_of(0, 0, 2e-3)):
        assert not small.met_by(error)


def test_files_and_figures_show_tip_errors_in_millimetres(reach: Diagram) -> None:
    data, resolved = reach.to_dict(), reach.resolved.uncertainty
    assert data["resolved"]["uncertainty"]["tip"] == 1e3 * resolved.largest_tip
    for row, each in zip(data["runs"], reach.runs, strict=True):
        assert row["tip_error_mm"] == 1e3 * each.error.largest_tip
    for choice, each in zip(data["choices"], reach.choices, strict=True):
        assert choice["error"]["tip"] == 1e3 * each.error.largest_tip
    panel = work_precision_figure(reach).axes[2]
    assert panel.get_ylabel() == "largest error at tip [mm]"
    shown = panel.lines[0].get_ydata()
    counted = [1e3 * each.error.largest_tip for each in reach.of(SCHEMES[0]) if each.counts]
    np.testing.assert_array_equal(shown, np.maximum(counted, 1e-16))


def test_the_reference_motion_solves_pontryagins_equations(
    reach: Diagram,
) -> None:
    motion = reach.resolved.trajectory
    y = np.concatenate([motion.q, motion.v, motion.momenta[:, 0], motion.momenta[:, 1]], axis=1).T
    ends = (paper_arm.HANG, paper_arm.REST, paper_arm.REACH_Q, paper_arm.REACH_V)
    true = paper_arm.extremal(ends, 1.0, (motion.t, y), tolerance=1e-9)
    assert reach.resolved.cost == pytest.approx(true.cost, rel=1e-9)
    t = reach.resolved.reference.times
    np.testing.assert_allclose(motion.configurations(t), true.at(t)[0], rtol=0, atol=1e-8)


@pytest.mark.parametrize("method", SCHEMES)
def test_the_cost_converges_with_the_order_of_the_scheme(reach: Diagram, method: str) -> None:
    fine = [r for r in reach.of(method) if 1e-10 < r.error.cost < 1e-5 and r.intervals >= 24]
    assert len(fine) >= 3
    slope = np.polyfit(
        np.log([r.intervals for r in fine]), np.log([r.error.cost for r in fine]), 1
    )[0]
    assert fine[0].order is not None
    assert -slope == pytest.approx(fine[0].order, abs=0.3)


def test_every_run_has_valid_times_and_repeats(reach: Diagram) -> None:
    assert reach.methods == SCHEMES
    assert reach.complete
    for each in reach.runs:
        assert each.intervals in INTERVALS
        assert each.counts == (each.success and each.error.largest_q <= 0.1)
        assert each.setup_seconds > 0
        assert each.first_seconds > 0
        assert len(each.repeats) == (1 if each.counts else 0)
        assert each.cold_seconds == each.setup_seconds + each.first_seconds
    finest = reach.of("galerkin-1")[-1]
    assert finest.cost == pytest.approx(reach.resolved.cost, rel=1e-11)


def test_choices_meet_their_tolerance(reach: Diagram) -> None:
    assert [choice.tolerance for choice in reach.choices] == [1e-3, 1e-5, 1e-7, 1e-9]
    for choice in reach.choices:
        assert choice.success
        assert choice.error.cost <= choice.tolerance
        assert choice.estimate is not None
        assert choice.estimate <= choice.tolerance
        assert choice.intervals >= 1


def test_a_frame_goal_has_a_diagram(arm_scene: Scene) -> None:
    goal = FrameGoal(arm_scene.robot.tip_frame, position=(1.5, 0.0, 1.0))
    task = Task(arm_scene, State(paper_arm.HANG), goal, 1.0, PlanOptions(limits="none"))
    diagram = work_precision(task, schemes=["galerkin-3"], repeats=1, budget=10.0)
    assert min(run.error.cost for run in diagram.runs) < 1e-9


def test_an_error_counts_only_if_finer_grids_keep_it(reach: Diagram) -> None:
    lucky = run("a", 8, 1e-9, 1.0)
    diagram = diagram_of(reach, lucky, run("a", 16, 1e-5, 2.0), run("a", 32, 1e-7, 3.0))
    assert [error for _, error in diagram.kept("a")] == [1e-5, 1e-5, 1e-7]
    cheapest = diagram.cheapest(1e-6)
    assert cheapest is not None
    assert cheapest.intervals == 32
    assert diagram.cheapest(1e-8) is None


def test_the_front_is_the_pareto_front_of_valid_runs(reach: Diagram) -> None:
    fast, accurate = run("a", 8, 1e-3, 1.0), run("b", 8, 1e-6, 2.0)
    beaten, wrong_minimum = run("c", 8, 1e-4, 3.0), run("d", 8, 0.0, 0.1, joints=2.0)
    assert not wrong_minimum.counts
    assert diagram_of(reach, fast, accurate, beaten, wrong_minimum).front() == (fast, accurate)


def test_processor_time_excludes_waiting_and_includes_children() -> None:
    watch = Stopwatch("processor")
    time.sleep(0.3)
    assert watch.seconds < 0.2
    subprocess.run([sys.executable, "-c", "sum(range(5_000_000))"], check=True)
    assert watch.seconds > 0.01  # a child process counts


def test_a_budget_of_zero_raises() -> None:
    with pytest.raises(InputError, match="positive number of seconds, not 0"):
        Budget(0.0)


def test_the_figure_has_a_curve_for_every_scheme(reach: Diagram) -> None:
    figure = work_precision_figure(reach)
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert legend[:3] == [
        "galerkin-0, order 4",
        "galerkin-1, order 6",
        "hermite-simpson, order 4",
    ]
    assert len(figure.axes) == 4
    named = [text.get_text() for text in figure.axes[0].texts]
    assert named[0].startswith("1e-03")
    assert named[-1].endswith("1e-09")
    assert all(ax.get_yscale() == "log" for ax in figure.axes)


def test_coincident_stars_share_one_label(reach: Diagram) -> None:
    errors = (1e-3, 1.1e-3, 1e-6, 1e-9)
    chosen = tuple(
        dataclasses.replace(choice, error=dataclasses.replace(choice.error, cost=error))
        for choice, error in zip(reach.choices, errors, strict=True)
    )
    apart = dataclasses.replace(reach, choices=chosen)
    named = [text.get_text() for text in work_precision_figure(apart).axes[0].texts]
    assert named == ["1e-03 to 1e-05", "1e-07", "1e-09"]


def test_the_csv_has_a_line_per_run(reach: Diagram) -> None:
    rows = list(csv.DictReader(io.StringIO(as_csv(reach))))
    assert len(rows) == len(reach.runs)
    for row, each in zip(rows, reach.runs, strict=True):
        assert float(row["cost_error"]) == each.error.cost
        assert float(row["setup_seconds"]) == each.setup_seconds


def test_the_command_writes_a_figure_and_both_tables(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["accuracy", "two_link_reach", "--budget", "3", "--out", str(tmp_path / "new")]
    assert main([*arguments, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    names = sorted(path.name for path in (tmp_path / "new").iterdir())
    assert names == [f"two_link_reach_accuracy.{ending}" for ending in ("csv", "json", "png")]
    assert json.loads((tmp_path / "new" / names[1]).read_text()) == found
    assert found["resolved"]["cost"] == pytest.approx(paper_arm.REACH_COST, rel=1e-10)
    assert any("cost" in run["front"] for run in found["runs"])


def test_without_a_reference_motion_the_command_says_why_in_one_sentence(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["accuracy", "two_link_reach", "--budget", "1e-3"]) == 1
    told = capsys.readouterr().err.strip().splitlines()[-1]
    assert told.startswith("nothing was measured: no reference motion of two_link_reach was found")
    assert told.endswith("A larger budget allows a longer search.")


def test_the_table_ends_with_the_default(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["accuracy", "two_link_reach", "--budget", "3"]) == 0
    assert "plan: galerkin-" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--budget", "0"], "positive number of seconds"),
        (["--guess", "qubic"], "did you mean 'cubic'"),
        (["--clock", "well"], "did you mean 'wall'"),
        (["--out", __file__], "is a file; name a folder"),
        (["--peer", "drak=python"], "did you mean 'drake'"),
    ],
)
def test_invalid_options_are_refused(
    arguments: list[str], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["accuracy", "two_link_reach", *arguments]) == 2
    assert sentence in capsys.readouterr().err


def test_motions_with_a_cost_on_the_jerk_are_measured_on_tables_of_their_order() -> None:
    task = hovi.load_task(hovi.example("two_link_reach"))
    effects = [*task.scene.effects, hovi.effects.JerkCost(0.01)]
    task = dataclasses.replace(task, scene=hovi.Scene(task.scene.robot, effects))
    diagram = work_precision(
        task, schemes=["galerkin-2", "hermite-simpson"], repeats=1, budget=10.0
    )
    assert {run.method for run in diagram.runs if run.family == "hovi"} >= {"galerkin-2"}
    assert min(run.error.cost for run in diagram.runs) < 1e-8
    assert any("hermite-simpson is no scheme for the jerk" in note for note in diagram.notes)
