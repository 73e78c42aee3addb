"""Peaks of a motion against closed forms and dense samples."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from hovi.discrete.measures.motion_segments import SEGMENT_NAMES
from hovi.discrete.trajectory import Trajectory
from hovi.effects import Gravity, ViscousFriction
from hovi.planning.problem.limits import Limits, as_limits
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.scene.segment_scenes import SegmentScenes
from hovi.viewing.documents.motion_peaks import motion_peaks
from samples.cubic_motion import Cubic, cubic_motion

TIMES = np.linspace(0.0, 2.0, 40_001)


@pytest.fixture(scope="module")
def given(two_link: Robot) -> tuple[Trajectory, Cubic]:
    return cubic_motion(Scene(two_link, [Gravity(9.8), ViscousFriction(0.3)]), seed=4)


def within(motion: Trajectory, limits: Limits) -> Trajectory:
    return dataclasses.replace(motion, metadata={"limits": limits.to_dict()})


def test_a_peak_is_the_largest_value_and_has_its_time(given: tuple[Trajectory, Cubic]) -> None:
    motion, cubic = given
    (whole,) = motion_peaks(motion)
    _, v, a = cubic(TIMES)
    tau = motion.sample(TIMES).tau
    for quantity, values in {"v": v, "a": a, "tau": tau, "power": tau * v}.items():
        for i, peak in enumerate(whole.peaks[quantity]):
            best = int(np.argmax(np.abs(values[:, i])))
            assert peak.joint == motion.coordinate_names[i]
            assert peak.value == pytest.approx(values[best, i], rel=1e-6)
            assert peak.t == pytest.approx(TIMES[best], abs=1e-4)


def test_the_position_of_a_joint_is_that_nearest_to_its_limit(
    given: tuple[Trajectory, Cubic],
) -> None:
    """Where the largest |q| is another one."""
    motion, cubic = given
    q = cubic(TIMES)[0]
    low, high = q.min(axis=0) - 0.1, q.max(axis=0) + 5.0
    free = np.full((3, 2), np.inf)
    limits = Limits(np.vstack([low, -free]), np.vstack([high, free]))
    (whole,) = motion_peaks(within(motion, limits))
    for i, peak in enumerate(whole.peaks["q"]):
        assert peak.value == pytest.approx(q[:, i].min(), abs=1e-6)
        assert peak.margin == pytest.approx(0.1 / (high - low)[i], rel=1e-3)


def test_limits_that_were_imposed_are_told_from_those_of_the_urdf(
    given: tuple[Trajectory, Cubic],
) -> None:
    motion, cubic = given
    (free,) = motion_peaks(motion)
    assert not free.imposed
    assert {each.limit for each in free.peaks["tau"]} == {"±1000"}
    fast = np.abs(cubic(TIMES)[1]).max(axis=0)
    limits = as_limits(motion.robot, {"base": "none", "v": [float(fast[0]), 2 * float(fast[1])]})
    (kept,) = motion_peaks(within(motion, limits))
    assert kept.imposed
    assert [each.at_limit for each in kept.peaks["v"]] == [True, False]
    assert kept.peaks["v"][1].margin == pytest.approx(0.25, rel=1e-6)
    assert all(np.isinf(each.margin) and each.limit == "none" for each in kept.peaks["tau"])


def test_a_limit_on_the_power_has_its_margin(given: tuple[Trajectory, Cubic]) -> None:
    motion, _ = given
    sample = motion.sample(TIMES)
    most = np.abs(sample.tau * sample.v).max(axis=0)
    limits = as_limits(motion.robot, {"base": "none", "power": {"elbow": 2 * float(most[1])}})
    (whole,) = motion_peaks(within(motion, limits))
    shoulder, elbow = whole.peaks["power"]
    assert np.isinf(shoulder.margin)
    assert elbow.margin == pytest.approx(0.25, rel=1e-5)


def test_each_segment_has_its_own_peaks_and_limits(given: tuple[Trajectory, Cubic]) -> None:
    motion, cubic = given
    assert motion.scene is not None
    bounds = [as_limits(motion.robot, {"base": "none", "v": v}) for v in (20.0, 40.0)]
    parted = dataclasses.replace(
        motion,
        scene=None,
        segments=SegmentScenes((motion.scene,) * 2, (3, 4)),
        metadata={
            SEGMENT_NAMES: ["reach", "carry"],
            "segment_limits": [each.to_dict() for each in bounds],
        },
    )
    seam = 2.0 * 3 / 7
    for segment, bound in zip(motion_peaks(parted), (20.0, 40.0), strict=True):
        own = (segment.begin <= TIMES) & (segment.end >= TIMES)
        fast = np.abs(cubic(TIMES[own])[1]).max(axis=0)
        for i, peak in enumerate(segment.peaks["v"]):
            assert abs(peak.value) == pytest.approx(fast[i], rel=1e-3)
            assert peak.margin == pytest.approx(0.5 * (1 - fast[i] / bound), rel=1e-3)
            assert peak.limit == f"±{bound:g}"
    assert [(x.name, x.begin) for x in motion_peaks(parted)] == [
        ("reach", 0.0),
        ("carry", pytest.approx(seam)),
    ]
