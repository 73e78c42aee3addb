"""Weights by effort limits: torques and forces count as fractions of their limits."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hovi
from hovi.effects import EffortWeight
from hovi.errors import SceneError


def two_link_with(tmp_path: Path, first: str, second: str) -> hovi.Robot:
    """The two-link arm with other effort limits."""
    parts = hovi.example("two_link.urdf").read_text().split('effort="1000"')
    assert len(parts) == 3
    path = tmp_path / "arm.urdf"
    path.write_text(f'{parts[0]}effort="{first}"{parts[1]}effort="{second}"{parts[2]}')
    return hovi.load_robot(path)


def test_every_limit_counts_the_same(panda: hovi.Robot) -> None:
    scene = hovi.Scene(panda, [EffortWeight(from_urdf=True)])
    R, limits = scene.terms.effort_weight, panda.effort_limit
    assert R * limits**2 == pytest.approx(np.ones(panda.nv))
    given = hovi.Scene(panda, [EffortWeight(tuple(R))])
    q, v, a = np.random.default_rng(0).uniform(-1.0, 1.0, (3, 4, panda.nv))
    costs = [each.effort_lagrangian().expand(q, v, a).value for each in (scene, given)]
    assert np.array_equal(*costs)


def test_a_joint_without_a_limit_has_no_weight(tmp_path: Path) -> None:
    robot = two_link_with(tmp_path, "4", "0")
    scene = hovi.Scene(robot, [EffortWeight(from_urdf=True)], passive=["elbow"])
    assert scene.terms.effort_weight.tolist() == [1 / 16, 0.0]
    with pytest.raises(SceneError, match="acceleration of joint 'elbow'"):
        hovi.Scene(robot, [EffortWeight(from_urdf=True)]).effort_lagrangian()


def test_a_robot_without_limits_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="states no effort limits; give the numbers here"):
        hovi.Scene(two_link_with(tmp_path, "0", "0"), [EffortWeight(from_urdf=True)])


@pytest.mark.parametrize(
    ("sources", "count"),
    [
        ({}, "none was"),
        ({"weight": 1.0, "from_urdf": True}, "two were"),
        ({"weight": 1.0, "matrix": ((1.0, 0.0), (0.0, 1.0)), "from_urdf": True}, "all were"),
    ],
)
def test_one_source_is_needed(sources: dict[str, Any], count: str) -> None:
    sentence = f"needs one of weight, matrix and from_urdf = true; {count} given"
    with pytest.raises(SceneError, match=sentence):
        EffortWeight(**sources)
