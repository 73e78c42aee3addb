"""Extremes of accelerations and jerks: closed forms, and finite differences within intervals."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import hovi
from hovi.discrete.measures import motion_extremes
from hovi.discrete.trajectory import Trajectory
from hovi.effects import Gravity
from hovi.errors import InputError
from hovi.scene.scene import Scene
from samples.cubic_motion import cubic_motion
from samples.manifold_robots import configurations, with_arm

Array = npt.NDArray[np.float64]


def spline_motion(order: int, intervals: int = 5) -> Trajectory:
    """The spline of degree 2 k - 1 from 0 to 1 in one second, at rest at both ends."""
    grid = hovi.Grid.uniform(1.0, intervals, hovi.schemes.galerkin(2, order))
    ld = hovi.DiscreteLagrangian(hovi.spline(1, order), grid)
    problem = hovi.TrajectoryProblem(ld, hovi.State([0.0]), hovi.State([1.0]))
    return hovi.solve(problem).trajectory


def rough(trajectory: Trajectory, size: float = 0.3) -> Trajectory:
    """The motion with random inner modes, so that a jumps at nodes and is no line in between."""
    inner = np.random.default_rng(1).uniform(-size, size, trajectory.path.inner.shape)
    return dataclasses.replace(trajectory, path=dataclasses.replace(trajectory.path, inner=inner))


def sampled(trajectory: Trajectory, positions: Array) -> tuple[Array, Array]:
    """|a| and |jerk| by central differences, at positions within every interval, (nv,) maxima."""
    N, step = trajectory.grid.intervals, 1e-6
    k = np.repeat(np.arange(N), len(positions))
    s = np.tile(positions, N)
    a = trajectory.jet_intervals(k, s)[2]
    later, earlier = (trajectory.jet_intervals(k, np.clip(s + d, 0, 1))[2] for d in (step, -step))
    span = np.clip(s + step, 0, 1) - np.clip(s - step, 0, 1)
    jerk = (later - earlier) / (span * trajectory.grid.steps[k])[:, None]
    return np.abs(a).max(axis=0), np.abs(jerk).max(axis=0)


def test_the_quintic_from_rest_to_rest() -> None:
    """q = 10 t^3 - 15 t^4 + 6 t^5: |a| is 10 / sqrt(3) at (1 -+ 1 / sqrt(3)) / 2, |jerk| 60."""
    found = hovi.extremes(spline_motion(3))
    assert found.acceleration.value == pytest.approx(10 / np.sqrt(3), rel=1e-10)
    times = (1 + np.array([-1, 1]) / np.sqrt(3)) / 2
    assert np.abs(times - found.acceleration.t).min() < 1e-4
    assert np.abs([*found.acceleration.start, *found.acceleration.end]).max() < 1e-9
    assert found.jerk.value == pytest.approx(60.0, rel=1e-9)
    assert [*found.jerk.start, *found.jerk.end] == pytest.approx([60.0, 60.0], rel=1e-9)
    assert found.jerk.unit == "1/s^3"


def test_the_cubic_from_rest_to_rest() -> None:
    """q = 3 t^2 - 2 t^3: accelerations of 6 and -6 at the ends, jerk -12 throughout."""
    found = hovi.extremes(spline_motion(2))
    assert found.acceleration.value == pytest.approx(6.0, rel=1e-11)
    assert [*found.acceleration.start, *found.acceleration.end] == pytest.approx([6.0, -6.0])
    assert found.jerk.largest == pytest.approx([12.0])
    assert [*found.jerk.start, *found.jerk.end] == pytest.approx([-12.0, -12.0])


def test_a_line_has_neither() -> None:
    found = hovi.extremes(spline_motion(1))
    assert found.acceleration.value < 1e-9
    assert found.jerk.value < 1e-7


@pytest.mark.parametrize("scheme", ["galerkin-0", "galerkin-2", "galerkin-2x8", "galerkin-7"])
def test_motions_whose_acceleration_jumps_at_nodes(arm_scene: Scene, scheme: str) -> None:
    steps = np.array([0.2, 0.5, 0.1, 0.4])
    motion = rough(cubic_motion(arm_scene, schemes=(scheme,) * 4, steps=steps)[0])
    found = hovi.extremes(motion)
    a, jerk = sampled(motion, np.linspace(0, 1, 4001))
    assert found.acceleration.largest == pytest.approx(a, rel=1e-5)
    assert found.jerk.largest == pytest.approx(jerk, rel=1e-3)
    assert (found.acceleration.largest >= a * (1 - 1e-12)).all()


def test_where_the_largest_is(arm_scene: Scene) -> None:
    motion = rough(cubic_motion(arm_scene)[0])
    found = hovi.extremes(motion).acceleration
    assert found.joint in arm_scene.robot.joint_names
    assert found.unit == "rad/s^2"
    joint = found.names.index(found.joint)
    assert found.value == found.largest[joint] == found.largest.max()
    near = motion.jet(np.clip(found.t + np.array([-1e-9, 1e-9]), 0, motion.duration))[2]
    assert np.abs(near[:, joint]).max() == pytest.approx(found.value, rel=1e-6)


def test_ends_are_the_limits_from_inside(arm_scene: Scene) -> None:
    motion, cubic = cubic_motion(arm_scene, duration=2.0)
    found = hovi.extremes(motion)
    a = cubic([0.0, 2.0])[2]
    assert found.acceleration.start == pytest.approx(a[0], rel=1e-12)
    assert found.acceleration.end == pytest.approx(a[1], rel=1e-12)
    assert found.jerk.start == pytest.approx(6 * cubic.coefficients[3], rel=1e-11)
    assert found.jerk.end == pytest.approx(6 * cubic.coefficients[3], rel=1e-11)


@pytest.mark.parametrize("base", ["free-flyer", "spherical", "planar", "continuous"])
def test_motions_on_groups(base: str) -> None:
    robot = hovi.load_robot(with_arm(base))
    q0, q1 = configurations(robot, 2)
    goal = robot.integrate(q0, 0.5 * robot.difference(q0, q1))
    scene = Scene(robot, [Gravity()])
    motion = hovi.plan(scene, q0, goal, duration=1.0, limits="none", intervals=3).trajectory
    found = hovi.extremes(motion)
    a, jerk = sampled(motion, np.linspace(0, 1, 2001))
    assert found.acceleration.largest == pytest.approx(a, rel=1e-6)
    assert found.jerk.largest == pytest.approx(jerk, rel=1e-4)


def test_sliding_joints_have_their_own_units() -> None:
    robot = hovi.load_robot(with_arm("continuous"))
    (q0,) = configurations(robot, 1)
    scene = Scene(robot, [Gravity()])
    motion = hovi.plan(scene, q0, q0, duration=1.0, limits="none", intervals=8).trajectory
    found = hovi.extremes(motion)
    assert found.acceleration.units == ("rad/s^2", "rad/s^2", "rad/s^2", "m/s^2")
    assert found.jerk.units == ("rad/s^3", "rad/s^3", "rad/s^3", "m/s^3")


def test_the_largest_is_found_in_every_chunk(
    arm_scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    motion = rough(cubic_motion(arm_scene, schemes=("galerkin-2",) * 12)[0])
    whole = hovi.extremes(motion)
    monkeypatch.setattr(motion_extremes, "CHUNK", 5)
    parts = hovi.extremes(motion)
    for one, other in ((whole.acceleration, parts.acceleration), (whole.jerk, parts.jerk)):
        assert one.largest == pytest.approx(other.largest, rel=1e-13)
        assert (one.joint, one.t) == (other.joint, pytest.approx(other.t))


def test_something_else_than_a_motion_is_refused() -> None:
    wrong: Any = "motion.npz"
    with pytest.raises(InputError, match="trajectory"):
        hovi.extremes(wrong)
