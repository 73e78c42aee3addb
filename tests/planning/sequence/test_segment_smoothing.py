"""smooth = True of sequences: the cost on the jerk of each segment is that of its own motion."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

import hovi
from hovi import PlanOptions
from hovi.effects import Gravity, JerkCost
from hovi.planning.problem.notation.smoothing import smoothed
from hovi.planning.sequence.segment import Segment
from hovi.planning.sequence.segment_smoothing import smoothed_durations
from hovi.planning.sequence.sequence_job import job_of
from hovi.scene.jerk_lagrangian import JerkLagrangian
from hovi.scene.segmented_lagrangian import SegmentedLagrangian

THERE = [0.7, 0.9]


def test_what_stands_still_goes_by_the_longer_motion_beside_it() -> None:
    still = [False, True, True, False, True]
    assert smoothed_durations([1.0, 0.2, 0.3, 2.0, 0.4], still) == [1.0, 2.0, 2.0, 2.0, 2.0]
    assert smoothed_durations([0.2, 0.3], [True, True]) == [0.2, 0.3]
    assert smoothed_durations([3.0, 5.0, 1.0], [False, True, False]) == [3.0, 5.0, 1.0]


def weights_of(segments: list[Segment]) -> list[npt.NDArray[np.float64]]:
    scene = scene_of()
    goals = [hovi.State(each.goal) for each in segments]  # type: ignore[arg-type]
    options = PlanOptions(smooth=True, limits="none").on(scene)
    of = job_of(scene, hovi.State([0.0, 0.0]), goals, segments, options).lagrangian()
    assert isinstance(of, SegmentedLagrangian)
    return [each.jerk_weight for each in of.lagrangians if isinstance(each, JerkLagrangian)]


def scene_of() -> hovi.Scene:
    return hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")), [Gravity(9.8)])


def test_segments_have_the_weights_that_they_have_alone() -> None:
    found = weights_of([Segment(THERE, 0.6), Segment(THERE, 0.2), Segment([1.0, 0.0], 0.9)])
    for weight, T in zip(found, (0.6, 0.9, 0.9), strict=True):
        known = hovi.State([0.0, 0.0]), hovi.State([1.0, 0.0])
        alone = smoothed(scene_of(), *known, T).effort_lagrangian()
        assert isinstance(alone, JerkLagrangian)
        np.testing.assert_allclose(weight, alone.jerk_weight, rtol=1e-12)


def test_a_segment_keeps_a_cost_on_the_jerk_of_its_own() -> None:
    given = [0.125, 0.25]
    goals = zip(given, (THERE, [0.0, 0.0]), strict=True)
    found = weights_of([Segment(q, 0.6, effects=[JerkCost(w)]) for w, q in goals])
    np.testing.assert_allclose(np.array(found)[:, 0], given)
