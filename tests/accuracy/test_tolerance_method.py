"""Runs of `plan` in a diagram: its default and its tolerances, with limits and without."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from hovi import PlanOptions, plan
from hovi.accuracy import work_precision
from hovi.accuracy.diagram import Diagram
from hovi.accuracy.measures import shown_size
from hovi.accuracy.picture import work_precision_figure
from hovi.accuracy.tables import cheapest_rows
from hovi.accuracy.tolerance_method import Choice
from hovi.discrete.state import State
from hovi.planning.problem.limits import Limits
from hovi.planning.task_file.task import Task
from hovi.scene.scene import Scene
from samples import paper_arm

ENDS = State(paper_arm.HANG), State(paper_arm.REACH_Q, paper_arm.REACH_V)
MOST = np.array([7.2, 8.0])
"""Torque limits, nine tenths of what the motion needs without them, in [N m]."""
TOLERANCE = 1e-4
"""Of the limits, so large that a reference is soon resolved."""


def diagram_of(scene: Scene, limits: str | Limits, scheme: str) -> Diagram:
    options = PlanOptions(limits=limits, scheme="galerkin-0", intervals=7)
    task = Task(scene, *ENDS, 1.0, options)
    return work_precision(task, schemes=[scheme], budget=60.0, repeats=1)


@pytest.fixture(scope="module")
def free(arm_scene: Scene) -> Diagram:
    return diagram_of(arm_scene, "none", "galerkin-3")


@pytest.fixture(scope="module")
def limited(arm_scene: Scene) -> Diagram:
    return diagram_of(arm_scene, torque_limits(), "galerkin-2x8")


def torque_limits() -> Limits:
    lower = np.full((4, 2), -np.inf)
    lower[3] = -MOST
    return Limits(lower, -lower, TOLERANCE)


def default_of(diagram: Diagram) -> Choice:
    assert diagram.default is not None
    return diagram.default


def test_the_default_is_that_of_plan_whatever_the_task_names(
    arm_scene: Scene, free: Diagram
) -> None:
    default, found = default_of(free), plan(arm_scene, *ENDS, 1.0, limits="none")
    assert default.counts
    assert default.success
    assert default.tolerance == 1e-3
    assert default.error.cost <= 1e-3
    assert default.intervals == found.trajectory.grid.intervals
    assert default.cost == pytest.approx(found.cost, rel=1e-6)
    assert len(default.repeats) == 2


def test_within_limits_the_default_and_all_runs_hold_them(limited: Diagram) -> None:
    default = default_of(limited)
    assert limited.limited
    assert limited.resolved.limit_effect > 0
    assert default.counts
    assert default.error.cost <= default.tolerance
    least = limited.resolved.cost * (1 - 2 * limited.resolved.limit_effect)
    assert least > 1.002 * paper_arm.REACH_COST
    for each in (*limited.runs, default, *limited.choices):
        assert each.cost > least  # less would take larger torques


def test_within_limits_no_tolerance_is_below_their_effect(limited: Diagram) -> None:
    effect = limited.resolved.limit_effect
    asked = [choice.tolerance for choice in limited.choices]
    assert asked == [each for each in (1e-2, 1e-3, 1e-4, 1e-5) if each >= effect]
    for choice in limited.choices:
        assert choice.error.cost <= choice.tolerance


def test_within_limits_no_finer_grid_than_their_effect_is_tried(limited: Diagram) -> None:
    *coarse, finest = limited.of("galerkin-2x8")
    assert coarse[0].intervals >= 8
    assert finest.error.cost <= max(
        limited.resolved.limit_effect, limited.resolved.uncertainty.cost
    )
    assert all(run.error.cost > limited.resolved.limit_effect for run in coarse)


def test_the_default_is_a_star_in_every_panel_of_warm_times(free: Diagram) -> None:
    default, figure = default_of(free), work_precision_figure(free)
    for ax, measure in zip(figure.axes, ("cost", "joints", "tip"), strict=False):
        (star,) = [line for line in ax.lines if line.get_label() == "plan's default, 1e-03"]
        assert star.get_marker() == "*"
        x, y = np.ravel(star.get_xdata()), np.ravel(star.get_ydata())
        assert x == pytest.approx([1e3 * default.seconds])
        assert y == pytest.approx([shown_size(default.error, measure)])
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "plan's default, 1e-03" in legend


def test_a_default_without_a_star_is_told(free: Diagram) -> None:
    far = dataclasses.replace(default_of(free), minimum=False, message="it spins")
    diagram = dataclasses.replace(free, default=far)
    figure = work_precision_figure(diagram)
    told = figure.get_suptitle()
    assert "plan's default found no minimum" in told
    assert "plan's default" not in work_precision_figure(free).get_suptitle()
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert not any("default" in text for text in legend)
    assert cheapest_rows(diagram)[-1][0] != "default"


def test_the_default_is_a_row_and_in_the_json(free: Diagram) -> None:
    default, row = default_of(free), cheapest_rows(free)[-1]
    assert row[:3] == ("default", f"plan: {default.scheme}", str(default.intervals))
    assert row[3] == f"{default.error.cost:.0e}"
    written = free.to_dict()["default"]
    assert written["seconds"] == default.seconds
    assert written["error"]["tip"] == 1e3 * default.error.largest_tip


def test_a_far_motion_counts_if_it_is_as_cheap_as_the_tolerance_asks(free: Diagram) -> None:
    default = default_of(free)
    q, cost = np.full_like(default.error.q, 0.4), default.tolerance
    far = dataclasses.replace(default.error, q=q)
    cheap = dataclasses.replace(default, error=dataclasses.replace(far, cost=0.9 * cost))
    dear = dataclasses.replace(default, error=dataclasses.replace(far, cost=1.1 * cost))
    assert cheap.counts
    assert not dear.counts
    assert dear.found == "another motion"
    assert not dataclasses.replace(cheap, minimum=False).counts


def test_the_figure_within_limits_shows_the_least_errors(limited: Diagram) -> None:
    figure, resolved = work_precision_figure(limited), limited.resolved
    assert "within limits" in figure.get_suptitle()
    heights = {line.get_label(): line.get_ydata() for line in figure.axes[0].lines}
    assert list(heights["error of the reference"]) == [resolved.uncertainty.cost] * 2
    assert list(heights["effect of the limits' tolerance"]) == [resolved.limit_effect] * 2
    assert not any("order" in str(label) for label in heights)


def test_within_limits_no_error_is_drawn_below_that_of_the_reference(limited: Diagram) -> None:
    errors = [each.error.cost for each in (*limited.runs, *limited.choices)]
    larger = dataclasses.replace(limited.resolved.uncertainty, cost=float(np.median(errors)))
    resolved = dataclasses.replace(limited.resolved, uncertainty=larger)
    panel = work_precision_figure(dataclasses.replace(limited, resolved=resolved)).axes[0]
    effect = "effect of the limits' tolerance"
    drawn = [np.ravel(line.get_ydata()) for line in panel.lines if line.get_label() != effect]
    assert np.concatenate(drawn).min() == larger.cost


def test_a_cheaper_motion_within_limits_makes_the_reference_uncertain(limited: Diagram) -> None:
    resolved = limited.resolved
    effect = resolved.limit_effect
    doubted = resolved.doubted(resolved.cost * (1 - 1e-3 - effect))
    assert doubted.uncertainty.cost == pytest.approx(1e-3, rel=1e-6)
    assert not doubted.converged
    assert resolved.doubted(resolved.cost * (1 - effect / 2)) is resolved
    without = dataclasses.replace(resolved, limit_effect=0.0)
    assert without.doubted(0.9 * resolved.cost) is without
