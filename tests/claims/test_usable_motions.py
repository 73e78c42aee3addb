"""What a solution says of its limits and distances holds at all times, by dense samples alone.

Motions without limits or obstacles are held against bounds that they just exceed, or just keep, at
an instant between the samples of any check.
"""

from __future__ import annotations

import dataclasses
import itertools
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import hovi
from hovi.errors import InputError

Array = npt.NDArray[np.float64]
KINDS = ("q", "v", "a", "tau")
DENSE = 200_001
FREE: dict[str, Any] = {"limits": "none", "self_collision": False}


def peaks(motion: hovi.Trajectory) -> Array:
    """The largest absolute value of q, v, a and tau of each joint, (4, nv)."""
    dense = motion.sample(np.linspace(0.0, motion.duration, DENSE))
    return np.array([np.abs(getattr(dense, kind)).max(axis=0) for kind in KINDS])


def held_to(solution: hovi.Solution, bound: Array, **more: Any) -> hovi.Solution:
    """The solution as one of the problem with the bounds -bound and bound, (4, nv)."""
    assert solution.problem is not None
    problem = dataclasses.replace(solution.problem, limits=hovi.Limits(-bound, bound, **more))
    return dataclasses.replace(solution, problem=problem)


def led_back(solution: hovi.Solution, kind: int, joint: int) -> bool:
    """Whether the motion starts at its peak, so that the bound is excused there and says so."""
    first = solution.trajectory.sample(np.zeros(1))
    at_start = abs(getattr(first, KINDS[kind])[0, joint])
    if at_start < peaks(solution.trajectory)[kind, joint] or KINDS[kind] not in ("q", "v"):
        return False
    assert [each.limit for each in solution.excused] == [KINDS[kind]]
    return True


@pytest.fixture(scope="module")
def motions(arm_scene: hovi.Scene) -> list[hovi.Solution]:
    rng, found = np.random.default_rng(3), []
    for intervals in (4, 7, 12):
        ends = rng.uniform(-1.5, 1.5, (2, 2))
        grid = {"scheme": "galerkin-4", "intervals": intervals}
        found.append(hovi.plan(arm_scene, *ends, 1.0, **grid, **FREE))
    assert all(each.success for each in found)
    return found


@pytest.mark.parametrize("kind", range(4), ids=KINDS)
def test_a_bound_that_is_exceeded_between_samples_makes_a_motion_unusable(
    motions: list[hovi.Solution], kind: int
) -> None:
    """By 3e-6 of its range, of which checks at a few hundred samples see nothing."""
    for solution in motions:
        most = peaks(solution.trajectory)
        for joint in range(2):
            over, under = np.full((2, 4, 2), np.inf)
            over[kind, joint] = most[kind, joint] / (1 + 6e-6)
            under[kind, joint] = most[kind, joint] * (1 + 6e-6)
            beyond, inside = held_to(solution, over), held_to(solution, under)
            if led_back(beyond, kind, joint):
                continue  # the peak is at the start, which is excused
            assert not beyond.usable
            assert beyond.violation
            assert inside.usable, inside.violation
            assert inside.violation == ""


@pytest.mark.parametrize("kind", range(4), ids=KINDS)
def test_margins_are_those_of_dense_samples(motions: list[hovi.Solution], kind: int) -> None:
    for solution in motions:
        most = peaks(solution.trajectory)
        for joint, share in ((0, 0.8), (1, 1.02)):  # bound over peak: beyond, and near within
            bound = np.full((4, 2), np.inf)
            bound[kind, joint] = share * most[kind, joint]
            margins = held_to(solution, bound).margins().limits
            assert margins is not None
            expected = (share - 1) / (2 * share)
            assert margins.margin[kind, joint] == pytest.approx(expected, abs=1e-6)
            assert np.isinf(np.delete(margins.margin.ravel(), 2 * kind + joint)).all()
            assert margins.tightest[:2] == (KINDS[kind], margins.names[joint])
            assert margins.excess == pytest.approx(max(0.0, -expected), abs=1e-6)
            assert margins.exceeded == (share < 1)
            by_kind = margins.by_kind()[KINDS[kind]]
            assert by_kind[margins.names[joint]] == margins.margin[kind, joint]


@pytest.mark.parametrize("end", ["start", "goal"])
@pytest.mark.parametrize("miss", [3e-6, 1e-2])
def test_a_motion_that_misses_an_end_is_unusable(
    motions: list[hovi.Solution], end: str, miss: float
) -> None:
    for solution in motions:
        problem = solution.problem
        assert problem is not None
        path = solution.trajectory.path
        k = 0 if end == "start" else -1
        for q, v in ((path.q[k] + [miss, 0.0], path.v[k]), (path.q[k], path.v[k] + [0.0, miss])):
            other = dataclasses.replace(problem, **{end: hovi.State(q, v)})
            assert not dataclasses.replace(solution, problem=other).usable
        same = dataclasses.replace(problem, **{end: hovi.State(path.q[k], path.v[k])})
        assert dataclasses.replace(solution, problem=same).usable


@pytest.mark.parametrize("end", [0, -1])
@pytest.mark.parametrize("side", [-1.0, 1.0], ids=["lower", "upper"])
def test_the_excess_at_an_end_counts(motions: list[hovi.Solution], end: int, side: float) -> None:
    """Of the acceleration, of which the problem says nothing there, where it is the extreme."""
    judged = 0
    for solution, joint in itertools.product(motions, range(2)):
        a = solution.trajectory.sample(np.linspace(0.0, 1.0, DENSE)).a[:, joint]
        if side * a[end] < (side * a).max():
            continue
        bounds = np.full((2, 4, 2), np.inf)
        largest = np.abs(a).max()
        bounds[:, 2, joint] = 10 * largest
        bounds[int(side > 0), 2, joint] = side * a[end] - 1e-4 * largest
        assert solution.problem is not None
        limits = hovi.Limits(-bounds[0], bounds[1])
        problem = dataclasses.replace(solution.problem, limits=limits)
        found = dataclasses.replace(solution, problem=problem)
        margins = found.margins().limits
        assert margins is not None
        assert margins.excess == pytest.approx(1e-4 * largest / bounds[:, 2, joint].sum(), rel=1e-3)
        assert not found.usable
        judged += 1
    assert judged


# Distances

BALL, REACH = 0.05, 1.0
"""Radius of the ball at the end of the arm, and its distance from the joint, in [m]."""


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> hovi.Scene:
    """A joint that turns about z, with a ball at the end of its arm."""
    path = tmp_path_factory.mktemp("ball") / "ball.urdf"
    path.write_text(
        f"""<robot name="ball"><link name="base"/><link name="arm"><inertial>
        <origin xyz="{REACH / 2} 0 0"/><mass value="1"/>
        <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
        <collision><origin xyz="{REACH} 0 0"/><geometry><sphere radius="{BALL}"/></geometry>
        </collision></link><joint name="hinge" type="revolute"><parent link="base"/>
        <child link="arm"/><axis xyz="0 0 1"/>
        <limit lower="-3" upper="3" velocity="50" effort="500"/></joint></robot>"""
    )
    return hovi.Scene(hovi.load_robot(path), [hovi.effects.Gravity(acceleration=0.0)])


@pytest.mark.parametrize("gap", [2e-5, 1e-3, 9e-3])
@pytest.mark.parametrize("at", [0.0, 0.37, -0.61])
def test_a_motion_that_comes_too_close_is_unusable_by_however_little(
    ball: hovi.Scene, gap: float, at: float
) -> None:
    """The ball passes a sphere and a farther one at distances of closed form."""
    near = hovi.Sphere((0.14 + REACH) * np.array([np.cos(at), np.sin(at), 0.0]), 0.05, name="near")
    far = hovi.Sphere((0.3 + REACH) * np.array([np.cos(0.9), np.sin(0.9), 0.0]), 0.05, name="far")
    least = 0.14 - BALL - 0.05
    options = {"obstacles": [far, near], "margin": 0.01, **FREE}
    solution = hovi.plan(ball, [-1.3], [1.2], 1.0, **options)
    assert solution.success
    margins = solution.margins()
    assert margins.distance == pytest.approx(least, abs=1e-6)
    assert margins.nearest_pair is not None
    assert "near" in margins.nearest_pair
    assert "arm" in margins.nearest_pair
    for margin, keeps in ((least + gap, False), (least - gap, True)):
        assert solution.problem is not None
        clearance = dataclasses.replace(solution.problem.clearance, margin=margin)
        problem = dataclasses.replace(solution.problem, clearance=clearance)
        found = dataclasses.replace(solution, problem=problem)
        assert found.usable == keeps, found.violation
        assert bool(found.violation) != keeps


def test_a_planned_motion_keeps_its_margin(ball: hovi.Scene) -> None:
    """Around nothing it cannot go: the ball may only pass a sphere that is far enough away."""
    for gap, possible in ((0.02, True), (0.009, False)):
        sphere = hovi.Sphere([REACH + BALL + gap + 0.05, 0.0, 0.0], 0.05)
        options = {"obstacles": [sphere], "margin": 0.01, **FREE}
        solution = hovi.plan(ball, [-1.3], [1.2], 1.0, time_limit=5.0, **options)
        assert solution.success == possible
        assert solution.usable == possible


def test_the_file_of_a_motion_keeps_what_its_margins_need(ball: hovi.Scene, tmp_path: Path) -> None:
    sphere = hovi.Sphere([1.14, 0.0, 0.0], 0.05)
    solution = hovi.plan(ball, [-1.3], [1.2], 1.0, obstacles=[sphere], margin=0.01, **FREE)
    solution.trajectory.save(tmp_path / "motion.npz")
    again = hovi.Trajectory.load(tmp_path / "motion.npz")
    assert again.metadata["clearance"] == solution.trajectory.metadata["clearance"]


@pytest.mark.parametrize("seed", range(6))
def test_success_and_usable_do_not_differ(arm_scene: hovi.Scene, seed: int) -> None:
    """Between random ends, of which most are at a bound, or beyond, with derivatives either way."""
    rng, planned = np.random.default_rng(seed), 0
    for _ in range(20):
        most = float(rng.choice([1.0, 3.0]))
        limits: dict[str, Any] = {"q": 1.0, "v": most}
        if rng.random() < 0.4:
            limits["a"] = float(rng.choice([5.0, 20.0]))
        ends = [_end_at_a_bound(rng, most) for _ in range(2)]
        try:
            found = hovi.plan(arm_scene, *ends, float(rng.choice([0.3, 1.0, 3.0])), limits=limits)
        except InputError:
            continue
        planned += 1
        assert found.success == found.usable, found.message
    assert planned > 15


def _end_at_a_bound(rng: np.random.Generator, most: float) -> hovi.State:
    q, v, joint = rng.uniform(-1.0, 1.0, 2), np.zeros(2), rng.integers(2)
    if rng.random() < 0.6:
        q[joint] = rng.choice([-1.0, 1.0]) * (1.0 + rng.choice([0.0, 0.0, 1e-7, 1e-5, 1e-3]))
        v[joint] = rng.choice([0.0, 1.0, -1.0]) * rng.choice([1e-6, 1e-3, 0.3, 1.0])
    elif rng.random() < 0.5:
        v[joint] = most * rng.choice([-1.0, 1.0]) * (1.0 + rng.choice([0.0, 1e-7, 1e-4]))
    return hovi.State(q, v)
