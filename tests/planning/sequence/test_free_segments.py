"""Segments with free durations: the best ones, by formulas and by plans for given durations."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.cli.application import main
from hovi.errors import InputError
from samples.small_robots import arm

MASS, BOUNDS = 0.5, (0.1, 9.0)
LIMITED = {"base": "none", "v": 2.0, "tau": 8.0}
GRAVITY = hovi.effects.Gravity()
UR5_START = [0.3, -1.3, 1.7, -1.97, -1.57, 0.0]


def lengths(found: hovi.Solution) -> list[float]:
    """The durations of the segments, by the message."""
    said = re.search(r"The segments last (.*?) s\.", found.message)
    assert said is not None
    each = [float(T) for T in re.split(", | and ", said[1])]
    assert sum(each) == pytest.approx(found.trajectory.duration, rel=1e-9)
    np.testing.assert_allclose(found.trajectory.segment_durations, each, rtol=1e-9)
    return each


@pytest.mark.parametrize("grid", [{}, {"intervals": 30, "scheme": "galerkin-2"}])
def test_a_mass_slides_as_long_as_the_formula_says(grid: dict[str, Any]) -> None:
    """From rest to rest over d, J + w T = 6 m^2 d^2 / T^3 + w T is least at T^4 = 18 m^2 d^2/w."""
    ways, weight = (0.8, 0.5, 0.2), 3.0
    goals = np.cumsum([ways[0], -ways[1], ways[2]])
    durations = (BOUNDS, BOUNDS, 1.0)
    segments = [hovi.Segment([q], T) for q, T in zip(goals, durations, strict=True)]
    scene = hovi.Scene(arm("rail", ("prismatic",)))
    given = {"limits": "none", "self_collision": False, "time_weight": weight} | grid
    found = hovi.plan_sequence(scene, [0.0], segments, **given)
    best = [(18 * MASS**2 * d**2 / weight) ** 0.25 for d in ways[:2]]
    assert found.success, found.message
    np.testing.assert_allclose(lengths(found), [*best, 1.0], rtol=1e-6)
    costs = [6 * MASS**2 * d**2 / T**3 for d, T in zip(ways, lengths(found), strict=True)]
    assert found.cost == pytest.approx(sum(costs) + weight * sum(lengths(found)), rel=1e-9)


ASKED = {
    "at rest between them": (True, "none", ()),
    "at rest between them within limits": (True, LIMITED, ()),
    "without a stop": (False, "none", (hovi.effects.ViscousFriction(0.3),)),
    "without a stop within limits": (False, LIMITED, (hovi.effects.ViscousFriction(0.3),)),
}


@pytest.mark.parametrize("asked", ASKED)
def test_no_other_durations_cost_less(asked: str) -> None:
    stops, limits, effects = ASKED[asked]
    robot, weight = hovi.load_robot("double_pendulum"), 0.3
    free = () if stops else robot.coordinate_names
    scene, middle = hovi.Scene(robot, [GRAVITY]), hovi.State([0.9, 0.3], free_velocity=free)

    def planned(first: Any, last: Any, **more: Any) -> hovi.Solution:
        segments = hovi.Segment(middle, first), hovi.Segment([1.5, 1.0], last, effects=effects)
        grid = {"intervals": 30, "scheme": "galerkin-4x10", "self_collision": False}
        return hovi.plan_sequence(scene, [0.3, -0.2], segments, limits=limits, **grid, **more)

    found = planned(BOUNDS, BOUNDS, time_weight=weight)
    assert found.success, found.message
    first, last = lengths(found)
    for change in ((0.92, 1.0), (1.08, 1.0), (1.0, 0.92), (1.0, 1.08)):
        T = first * change[0], last * change[1]
        other = planned(*T, guess=found.trajectory)
        cost = other.cost + weight * sum(T) if other.success else np.inf
        assert cost > found.cost * (1 + 1e-5)


def test_a_line_that_is_passed_at_a_speed_lasts_as_long_as_is_best() -> None:
    """Down on a line, slowly in its last part: no other durations cost less."""
    scene, start = (
        hovi.Scene(hovi.load_robot("ur5"), [GRAVITY]),
        [0.3, -1.3, 1.7, -1.97, -1.57, 0.0],
    )
    x, y, z = scene.robot.frame_pose("tool0", start)[:3, 3]
    line, slow = hovi.conditions.OnLine("tool0"), hovi.conditions.ToolSpeed("tool0", "250 mm/s")
    down = hovi.FrameGoal("tool0", position=[x, y, z - 0.1], free_velocity=["all"])
    there, weight = hovi.FrameGoal("tool0", position=[x, y, z - 0.15]), 200.0

    def planned(first: Any, last: Any, **more: Any) -> hovi.Solution:
        segments = [
            hovi.Segment(down, first, keep=[line]),
            hovi.Segment(there, last, keep=[line, slow]),
        ]
        return hovi.plan_sequence(scene, start, segments, self_collision=False, **more)

    found = planned((0.1, 2.0), (0.1, 2.0), time_weight=weight)
    assert found.success, found.message
    best = np.array(lengths(found))
    seam = found.trajectory.sample(best[:1])
    J = pin.computeFrameJacobian(
        scene.robot.model.copy(),
        scene.robot.model.createData(),
        seam.q[0],
        scene.robot.model.getFrameId("tool0"),
        pin.ReferenceFrame.LOCAL_WORLD_ALIGNED,
    )
    speed = np.linalg.norm((J @ seam.v[0])[:3])
    assert 0.1 < speed < 0.25 * (1 + 1e-5)
    for change in ((0.92, 1.0), (1.08, 1.0), (1.0, 0.92), (1.0, 1.08)):
        T = best * change
        other = planned(*T.tolist(), guess=found.trajectory)
        cost = other.cost + weight * T.sum() if other.success else np.inf
        assert cost > found.cost * (1 + 1e-5)


def test_a_segment_whose_start_does_not_say_what_is_kept_is_named() -> None:
    scene, start = (
        hovi.Scene(hovi.load_robot("ur5"), [GRAVITY]),
        [0.3, -1.3, 1.7, -1.97, -1.57, 0.0],
    )
    goal = hovi.FrameGoal("tool0", position=scene.robot.frame_pose("tool0", start)[:3, 3])
    upright = [hovi.conditions.Upright("tool0")]
    segments = [hovi.Segment(goal, 1.0), hovi.Segment(start, 1.0, name="back", keep=upright)]
    with pytest.raises(InputError, match=r"in 'back', keep 'upright tool0' needs its `axis`"):
        hovi.plan_sequence(scene, start, segments)


def test_segments_that_are_too_short_in_the_mean_are_planned_from_the_longest() -> None:
    segments = [hovi.Segment([q], (0.01, 9.0)) for q in (0.8, 0.0)]
    scene = hovi.Scene(arm("rail", ("prismatic",)))
    slow = {"base": "none", "v": 0.5}
    found = hovi.plan_sequence(scene, [0.0], segments, limits=slow, time_weight=0.5)
    assert found.success, found.message
    assert min(lengths(found)) > 0.8 / 0.5


def test_bounds_that_hold_are_kept() -> None:
    segments = [hovi.Segment([0.8], (2.0, 3.0)), hovi.Segment([0.0], (0.1, 0.2))]
    scene = hovi.Scene(arm("rail", ("prismatic",)))
    found = hovi.plan_sequence(scene, [0.0], segments, limits="none", time_weight=3.0)
    assert found.success, found.message
    np.testing.assert_allclose(lengths(found), [2.0, 0.2], rtol=1e-9)


def test_a_file_says_them_too(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(
        'robot = "double_pendulum"\nlimits = "none"\nself_collision = false\ntime_weight = 0.1\n'
        '[start]\nq = [0.3, -0.2]\n[[segments]]\nduration = [0.2, "9 s"]\n'
        "goal = { q = [0.9, 0.3] }\n[[segments]]\nduration = 0.5\ngoal = { q = [1.5, 1.0] }\n"
    )
    task = hovi.load_task(path)
    assert task.duration == (0.7, 9.5)
    assert lengths(hovi.plan_task(task))[1] == pytest.approx(0.5)
    again = tmp_path / "again.toml"
    hovi.save_task(task, again)
    assert hovi.load_task(again).segments[0].duration == (0.2, 9.0)
    assert main(["info", str(path)]) == 0
    assert "segment 'segment 1': 0.2 to 9 s" in capsys.readouterr().out


def test_what_has_times_of_its_own_is_refused() -> None:
    segments = [hovi.Segment([0.8], (0.2, 3.0)), hovi.Segment([0.0], 1.0)]
    scene = hovi.Scene(arm("rail", ("prismatic",)))
    via = [hovi.Via(0.5, hovi.State([0.3]))]
    with pytest.raises(InputError, match="via points and conditions at given times need segments"):
        hovi.plan_sequence(scene, [0.0], segments, via=via)
    with pytest.raises(InputError, match="lower bound is below the upper one"):
        hovi.Segment([0.8], (3.0, 0.2))


@pytest.mark.parametrize("tolerance", [1e-3, 1e-4, 1e-5])
def test_durations_are_free_on_a_grid_that_has_more_points(tolerance: float) -> None:
    """The first motion is refined by more points, on as many intervals."""
    scene = hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")), [hovi.effects.Gravity()])
    segments = [hovi.Segment(q, (0.3, 2.0)) for q in ([0.5, 0.6], [1.0, -0.4])]
    options = {"time_weight": 20.0, "tolerance": tolerance, "self_collision": False}
    limits = {"base": "none", "v": 3.0}
    found = hovi.plan_sequence(scene, [-0.5, 0.3], segments, limits=limits, **options)
    assert found.success, found.message
