"""Margins of a motion, against samples of it and its limits."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

import hovi

SPEED, WAIT = 6.0, 1e-3
BALL = hovi.Sphere([0.0, 2.8, 0.0], 0.1, name="ball")
Array = npt.NDArray[np.float64]


@pytest.fixture(scope="module")
def scene() -> hovi.Scene:
    robot = hovi.load_robot(hovi.example("two_link.urdf"))
    return hovi.Scene(robot, [hovi.effects.Gravity(9.8)])


@pytest.fixture(scope="module")
def sequence(scene: hovi.Scene) -> hovi.Solution:
    segments = [
        {"name": "reach", "goal": {"q": [0.7, 0.9]}, "duration": 0.8},
        {"name": "wait", "goal": {"q": [0.7, 0.9]}, "duration": 0.2, "limits": {"v": WAIT}},
        {"name": "return", "goal": {"q": [0.0, 0.0]}, "duration": 0.8},
    ]
    limits = {"base": "none", "v": SPEED, "tau": 300.0}
    return hovi.plan_sequence(scene, [0.0, 0.0], segments, limits=limits, intervals=12)


def fastest(motion: hovi.Trajectory, begin: float, end: float) -> Array:
    """Largest |v| of each joint between two times."""
    v = motion.sample(np.linspace(begin, end, 5_001)).v
    return np.asarray(np.abs(v).max(axis=0))


def test_margins_are_what_is_left_of_the_range(scene: hovi.Scene) -> None:
    limits = {"base": "none", "v": 3.0}
    found = hovi.plan(scene, [0.0, 0.0], [0.7, 0.9], 1.0, limits=limits, intervals=8)
    margins = found.margins()
    assert margins.limits is not None
    assert (margins.distance, dict(margins.segments)) == (None, {})
    left = (3.0 - fastest(found.trajectory, 0.0, 1.0)) / 6.0
    np.testing.assert_allclose(list(margins.limits.by_kind()["v"].values()), left, atol=1e-6)
    assert np.isinf(list(margins.limits.by_kind()["q"].values())).all()
    kind, joint, least = margins.limits.tightest
    assert (kind, joint) == ("v", ("shoulder", "elbow")[int(np.argmin(left))])
    assert least == pytest.approx(left.min(), abs=1e-6)


def test_margins_of_a_segment_are_in_its_own_range(sequence: hovi.Solution) -> None:
    margins = sequence.margins()
    assert list(margins.segments) == ["reach", "wait", "return"]
    spans = {"reach": (0.0, 0.8, SPEED), "wait": (0.8, 1.0, WAIT), "return": (1.0, 1.8, SPEED)}
    for name, (begin, end, most) in spans.items():
        v = fastest(sequence.trajectory, begin + 1e-9, end - 1e-9)
        own = list(margins.segments[name].by_kind()["v"].values())
        np.testing.assert_allclose(own, (most - v) / (2 * most), atol=1e-4)
    assert margins.limits is not None
    each = [margin.margin for margin in margins.segments.values()]
    np.testing.assert_array_equal(margins.limits.margin, np.min(each, axis=0))


def test_the_distance_is_the_least_along_the_motion(scene: hovi.Scene) -> None:
    found = hovi.plan(scene, [0.0, 0.0], [0.3, 0.2], 1.0, limits="none", obstacles=[BALL])
    margins = found.margins()
    assert margins.limits is None
    assert margins.distance is not None
    assert found.problem is not None
    assert found.problem.distances is not None
    q = found.trajectory.sample(np.linspace(0.0, 1.0, 2_001)).q
    assert margins.distance == pytest.approx(found.problem.distances.values(q).min(), abs=1e-5)


def test_margins_are_printed_in_a_few_lines(sequence: hovi.Solution) -> None:
    first, *others = str(sequence.margins()).splitlines()
    assert first.startswith("tightest limit v of '")
    assert [line.split(":")[0] for line in others] == ["'reach'", "'wait'", "'return'"]
    assert len(repr(sequence.margins())) < 500
