"""Options of a plan: each is described once, and accepted wherever options are."""

from __future__ import annotations

import inspect
import re
from dataclasses import fields
from typing import Any

import numpy as np
import pytest

import hovi
from hovi import PlanOptions
from hovi.cli.application import main
from hovi.errors import InputError
from hovi.planning.clearance.obstacles import Sphere
from hovi.planning.problem.tolerance import Tolerance
from hovi.scene.scene import Scene
from samples.paper_arm import HANG, REACH_Q

BALL = Sphere([0.0, 0.0, 5.0], 0.1)


def test_every_option_is_a_keyword_of_plan_with_its_default_and_is_explained() -> None:
    parameters = inspect.signature(hovi.plan).parameters
    for option in fields(PlanOptions):
        keyword = parameters[option.name]
        assert keyword.kind is keyword.KEYWORD_ONLY
        assert (keyword.default, keyword.annotation) == (option.default, option.type)
        for documented in (hovi.plan, PlanOptions):
            assert f"\n{option.name}: " in (documented.__doc__ or "")
    assert "{options}" not in (hovi.plan.__doc__ or "")
    explained = (PlanOptions.__doc__ or "").split("\nRaises ")[0]
    texts = re.split(r"^(\w+): ", explained, flags=re.MULTILINE)[1:]
    assert texts[::2] == [option.name for option in fields(PlanOptions)]
    assert all(text.strip().endswith(".") for text in texts[1::2])


@pytest.mark.parametrize("taking", ["plan", "plan_task", "with_options", "with_changes"])
def test_an_unknown_option_is_refused_with_the_nearest_name(arm_scene: Scene, taking: str) -> None:
    task = hovi.Task(arm_scene, hovi.State(HANG), hovi.State(REACH_Q), 1.0)
    take = {
        "plan": lambda **given: hovi.plan(arm_scene, HANG, REACH_Q, 1.0, **given),
        "plan_task": lambda **given: hovi.plan_task(task, **given),
        "with_options": task.with_options,
        "with_changes": task.options.with_changes,
    }[taking]
    with pytest.raises(InputError, match="no option 'toleranse': did you mean 'tolerance'"):
        take(toleranse=1e-6)


def test_ready_options_accept_changes(arm_scene: Scene) -> None:
    options = PlanOptions(intervals=8, limits="none")
    ready = hovi.plan(arm_scene, HANG, REACH_Q, 1.0, options=options, scheme="galerkin-1")
    spelled = hovi.plan(
        arm_scene, HANG, REACH_Q, 1.0, intervals=8, limits="none", scheme="galerkin-1"
    )
    assert ready.cost == spelled.cost
    with pytest.raises(InputError, match="expected a PlanOptions"):
        hovi.plan(arm_scene, HANG, REACH_Q, 1.0, options={"intervals": 8})  # type: ignore[arg-type]


@pytest.mark.parametrize("limit", ["2 sec", "2", "-1 s", 0, "0 s", np.nan, []])
def test_a_time_limit_is_a_positive_time(limit: Any) -> None:
    with pytest.raises(InputError, match="time_limit"):
        PlanOptions(time_limit=limit)


def test_a_scheme_is_a_name_or_a_table() -> None:
    with pytest.raises(InputError, match="expected a Scheme, got a int"):
        PlanOptions(scheme=2)  # type: ignore[arg-type]


def test_a_tolerance_and_a_scheme_are_refused_together_as_by_the_command(
    arm_scene: Scene, capsys: pytest.CaptureFixture[str]
) -> None:
    rivals: dict[str, Any] = {"tolerance": 1e-6, "scheme": "galerkin-1"}
    task = hovi.Task(arm_scene, hovi.State(HANG), hovi.State(REACH_Q), 1.0)
    for take in (
        lambda: hovi.plan(arm_scene, HANG, REACH_Q, 1.0, **rivals),
        lambda: hovi.plan_task(task, **rivals),
        lambda: PlanOptions(**rivals),
    ):
        with pytest.raises(InputError) as refused:
            take()
        words = ["--tolerance", "1e-6", "--scheme", "galerkin-1"]
        assert main(["plan", "two_link_reach", *words]) == 2
        assert capsys.readouterr().err == f"error: --{refused.value}\n"


def test_a_tolerance_replaces_a_scheme_named_before_and_a_scheme_a_tolerance() -> None:
    by_scheme = PlanOptions(scheme="galerkin-1", intervals=5)
    by_tolerance = by_scheme.with_changes(tolerance="0.1 mm")
    assert (by_tolerance.scheme, by_tolerance.effective_tolerance) == (None, "0.1 mm")
    again = by_tolerance.with_changes(scheme="galerkin-3")
    assert (again.scheme, again.effective_tolerance, again.intervals) == ("galerkin-3", None, 5)
    assert again.with_changes(tolerance=None, starts=2).scheme == "galerkin-3"


def test_times_may_be_texts(arm_scene: Scene) -> None:
    fixed = {"limits": "none", "time_limit": "1.5 min"}
    one = hovi.plan(arm_scene, HANG, REACH_Q, "500 ms", **fixed)
    assert one.cost == hovi.plan(arm_scene, HANG, REACH_Q, 0.5, limits="none").cost
    free = hovi.plan(arm_scene, HANG, REACH_Q, ("300 ms", 0.6), **fixed)
    assert 0.3 <= free.trajectory.duration <= 0.6
    assert hovi.Via("500 ms", hovi.State(HANG)).time == 0.5  # type: ignore[arg-type]
    with pytest.raises(InputError, match="the duration '1 sec' has the unit 'sec'"):
        hovi.plan(arm_scene, HANG, REACH_Q, "1 sec")


def test_distances_of_a_clearance_are_built_once_whatever_else_changes() -> None:
    options = PlanOptions(obstacles=[BALL])
    assert options.obstacles[0].name == "sphere 1"
    assert options.with_changes(starts=3).clearance is options.clearance
    assert options.with_changes(margin=0.1).clearance.margin == 0.1


def test_options_are_resolved_for_a_scene(
    arm_scene: Scene,
) -> None:
    options = PlanOptions(tolerance="0.1 mm").on(arm_scene)
    assert isinstance(options.tolerance, Tolerance)
    assert isinstance(options.limits, hovi.Limits)
    with pytest.raises(InputError, match="no such frame"):
        PlanOptions(tolerance="1 mm at foot").on(arm_scene)


@pytest.mark.parametrize("via", [5, 0.5, [None], {"a": 1}, [hovi.State([0.0])]])
def test_via_points_are_a_list_of_them(via: Any) -> None:
    with pytest.raises(InputError, match="via"):
        PlanOptions(via=via)
