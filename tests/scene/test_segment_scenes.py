"""The scenes of a motion's segments, in memory and as the tables of a file."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import hovi
from hovi.errors import HoviError, InputError
from hovi.scene.segment_scenes import SegmentScenes

ROBOT = hovi.load_robot(hovi.example("two_link.urdf"))
EMPTY = hovi.Scene(ROBOT, [hovi.effects.Gravity()])
LOADED = hovi.Scene(ROBOT, [hovi.effects.Gravity(), hovi.effects.Payload(frame="tip", mass=1.0)])
SEGMENTS = SegmentScenes((EMPTY, LOADED, EMPTY), (3, 1, 2))


def test_every_interval_has_the_torques_of_its_scene() -> None:
    k = np.array([5, 3, 0, 4, 2, 3])
    q, v, a = np.random.default_rng(0).standard_normal((3, 6, 2))
    found = SEGMENTS.inverse_dynamics(k, (q, v, a), np.zeros(6))
    for scene, here in ((LOADED, k == 3), (EMPTY, k != 3)):
        np.testing.assert_array_equal(found[here], scene.inverse_dynamics(q, v, a)[here])


def test_a_scene_that_occurs_twice_is_written_once() -> None:
    tables = SEGMENTS.to_tables()
    assert tables["segments"] == [[0, 3], [1, 1], [0, 2]]
    assert len(tables["scenes"]) == 2
    again = SegmentScenes.from_tables(tables)
    assert again.to_tables() == tables
    assert again.scenes[0] is again.scenes[2]


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda x: x["scenes"].pop(), "scenes do not match the stored SHA-256"),
        (lambda x: x.update(scenes={}), "scenes do not match"),
        (lambda x: x["segments"].append([2, 1]), r"not a list of \[number of a scene, intervals\]"),
        (lambda x: x["segments"].append([-1, 1]), "not a list of"),
        (lambda x: x["segments"].append([0, 0]), "not a list of"),
        (lambda x: x["segments"].append([0, True]), "not a list of"),
        (lambda x: x["segments"].append([0, 10**30]), "not a list of"),
        (lambda x: x.update(segments=[[0, 3]]), "do not use every one of its scenes"),
        (lambda x: x.update(segments=7), "not a list of"),
    ],
)
def test_other_tables_are_refused(change: Callable[[Any], object], reason: str) -> None:
    tables = copy.deepcopy(SEGMENTS.to_tables())
    change(tables)
    with pytest.raises(InputError, match=reason):
        SegmentScenes.from_tables(tables)


def test_scenes_of_other_joints_are_refused() -> None:
    pendulum = hovi.Scene(hovi.load_robot(hovi.example("pendulum.urdf")))
    with pytest.raises(HoviError, match="must move the same joints"):
        SegmentScenes((EMPTY, pendulum), (1, 1))
    for counts in ((1,), (1, 0)):
        with pytest.raises(InputError, match="interval"):
            SegmentScenes((EMPTY, LOADED), counts)


def test_a_motion_has_a_scene_or_segments_of_all_its_intervals() -> None:
    motion = hovi.plan(EMPTY, [0, 0], [0.3, 0.7], 1.0, intervals=6, processes=1).trajectory
    for scene, segments in ((EMPTY, SEGMENTS), (None, SegmentScenes((EMPTY, LOADED), (3, 2)))):
        with pytest.raises(InputError, match="its segments need 6 intervals"):
            hovi.Trajectory(motion.grid, motion.path, motion.momenta, scene, segments=segments)
