"""Via points without times are passed when that costs least, beside plans for given times."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import hovi
from hovi.errors import InputError

Array = npt.NDArray[np.float64]

T, PASSED = 1.5, 1e-7
WEIGHT, SCANNED = 400.0, np.array([0.9, 0.97, 1.0, 1.03, 1.1])
BEGIN = np.array([0.0, -1.2, 1.5, -1.8, -1.57, 0.0])
BETWEEN = BEGIN + np.array([0.8, 0.3, -0.5, 0.2, 0.1, 0.4])
SECOND = BEGIN + np.array([0.7, -0.2, 0.2, 0.4, 0.3, -0.2])
END = BEGIN + np.array([0.4, -0.3, 0.3, 0.2, 0.3, -0.4])
OPTIONS: dict[str, Any] = {"self_collision": False, "limits": "none"}


@cache
def scene() -> hovi.Scene:
    return hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])


def planned(*via: tuple[Any, Any], duration: Any = T, **options: Any) -> hovi.Solution:
    points = [hovi.Via(*each) for each in via]
    return hovi.plan(scene(), BEGIN, END, duration, via=points, **OPTIONS | options)


def times(found: hovi.Solution) -> list[float]:
    assert found.problem is not None
    return [each.time for each in found.problem.via]


def test_no_time_of_a_scan_costs_less() -> None:
    """In the valley where it begins: far away another motion may cost less."""
    found = planned(("free", BETWEEN), tolerance=1e-5)
    assert found.success, found.message
    costs = {t: planned((t, BETWEEN), tolerance=1e-5).cost for t in np.linspace(0.6, 0.95, 8)}
    assert found.cost <= min(costs.values()) * (1.0 + 2e-5)
    assert found.cost < 0.97 * max(costs.values())
    assert abs(times(found)[0] - min(costs, key=lambda t: costs[t])) < 0.1


def test_no_time_and_no_duration_of_a_scan_cost_less() -> None:
    options: dict[str, Any] = {"limits": "urdf", "tolerance": 1e-5}
    found = planned(("free", BETWEEN), duration=(0.5, 4.0), time_weight=WEIGHT, **options)
    assert found.success, found.message
    (t,), D = times(found), found.trajectory.duration
    assert 0.5 < D < 4.0
    costs = np.zeros((5, 5))
    for i, a in enumerate(t * SCANNED):
        for j, b in enumerate((D - t) * SCANNED):
            given = planned((a, BETWEEN), duration=a + b, **options)
            costs[i, j] = given.cost + WEIGHT * (a + b)
    assert found.cost <= costs.min() * (1.0 + 2e-5)
    assert np.unravel_index(int(np.argmin(costs)), costs.shape) == (2, 2)
    assert found.cost < 0.99 * costs.max()


def test_its_cost_has_the_price_of_time() -> None:
    found = planned(("free", BETWEEN), duration=(0.5, 4.0), time_weight=WEIGHT, limits="urdf")
    D = found.trajectory.duration
    assert found.effort is not None
    assert found.cost == pytest.approx(found.effort + WEIGHT * D, rel=1e-9)
    assert found.duration_derivative == pytest.approx(-WEIGHT, rel=1e-2)
    assert found.replan().cost == pytest.approx(found.cost, rel=1e-6)
    assert f"{WEIGHT * D:.6g} of it for time" in found.message
    assert f"The best duration is {D:.6g} s" in found.message


@pytest.mark.parametrize(("bounds", "weight"), [((0.5, 0.7), 100.0), ((0.8, 2.0), 4000.0)])
def test_a_duration_at_its_bound_is_kept_there(bounds: Any, weight: float) -> None:
    options: dict[str, Any] = {"limits": "urdf", "tolerance": 1e-5}
    found = planned(("free", BETWEEN), duration=bounds, time_weight=weight, **options)
    assert found.success, found.message
    end = bounds[0] if weight > WEIGHT else bounds[1]
    assert found.trajectory.duration == pytest.approx(end, rel=1e-9)
    (t,) = times(found)
    for other in (t - 0.03, t + 0.03):
        given = planned((other, BETWEEN), duration=end, **options)
        assert found.cost < (given.cost + weight * end) * (1.0 + 1e-5)


def test_it_is_passed_at_the_time_that_is_said() -> None:
    found = planned(("free", BETWEEN))
    (t,) = times(found)
    assert np.abs(found.trajectory.sample([t]).q[0] - BETWEEN).max() < PASSED
    assert f"passes its via points at {t:.4g} s" in found.message


def test_the_times_of_two_are_stationary() -> None:
    found = planned(("free", BETWEEN), ("free", SECOND), tolerance=1e-6)
    assert found.success, found.message
    first, second = times(found)
    for a, b in ((0.03, 0.0), (-0.03, 0.0), (0.0, 0.03), (0.0, -0.03)):
        other = planned((first + a, BETWEEN), (second + b, SECOND), tolerance=1e-6)
        assert other.cost > found.cost * (1.0 + 1e-6)


def test_a_frame_may_be_passed_within_limits() -> None:
    tip = scene().robot.frame_pose("tool0", BETWEEN)[:3, 3]
    found = planned(("free", hovi.FrameGoal("tool0", position=tip)), limits="urdf")
    assert found.success, found.message
    q = found.trajectory.sample(times(found)).q[0]
    assert np.abs(scene().robot.frame_pose("tool0", q)[:3, 3] - tip).max() < PASSED
    given = planned((T / 2, hovi.FrameGoal("tool0", position=tip)), limits="urdf")
    assert found.cost <= given.cost * (1.0 + 1e-3)


def test_a_goal_may_have_a_region_as_well() -> None:
    tip = scene().robot.frame_pose("tool0", END)[:3, 3]
    goal = hovi.FrameGoal("tool0", position=tip, within="30 mm", guess=END)
    via = [hovi.Via("free", BETWEEN)]
    found = hovi.plan(scene(), BEGIN, goal, T, via=via, **OPTIONS)
    assert found.success, found.message
    p = scene().robot.frame_pose("tool0", found.trajectory.q[-1])[:3, 3]
    assert np.linalg.norm(p - tip) <= 0.03 + PASSED


def test_files_say_free(tmp_path: Path) -> None:
    text = hovi.example("ur5_reach").read_text()
    path = tmp_path / "scene.toml"
    path.write_text(f'{text}\n[[via]]\ntime = "free"\nq = {BETWEEN.tolist()}\n')
    task = hovi.load_task(path)
    again = hovi.load_task(hovi.save_task(task, tmp_path / "again.toml"))
    for each in (task, again):
        assert [via.timed for via in each.options.via] == [False]


def test_a_price_of_a_given_time_and_the_least_time_are_refused() -> None:
    with pytest.raises(InputError, match="time_weight needs a free duration"):
        planned(("free", BETWEEN), time_weight=1.0)
    with pytest.raises(InputError, match="does not choose the times of via points"):
        planned(("free", BETWEEN), duration=(0.5, 2.0), objective="time")


@pytest.mark.parametrize(
    ("via", "duration", "said"),
    [
        ([("free", BETWEEN), (0.5, BETWEEN)], T, "all via points times"),
        ([("never", BETWEEN)], T, "time of a via point"),
        ([(-1.0, BETWEEN)], T, "must be positive"),
    ],
)
def test_what_is_no_time_is_refused(via: list[tuple[Any, Any]], duration: Any, said: str) -> None:
    tables = [{"time": time, "q": q.tolist()} for time, q in via]
    with pytest.raises(InputError, match=said):
        hovi.plan(scene(), BEGIN, END, duration, via=tables, **OPTIONS)


def test_sequences_have_segments_instead() -> None:
    segments = [hovi.Segment(BETWEEN, 0.7), hovi.Segment(END, 0.8)]
    with pytest.raises(InputError, match=r"for hovi\.plan"):
        hovi.plan_sequence(scene(), BEGIN, segments, via=[hovi.Via("free", BETWEEN)], **OPTIONS)
