"""Marks of what a motion keeps lie where it is kept, around the path of the frame."""

from __future__ import annotations

import dataclasses
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import hovi
from hovi.viewing.kept_marks import kept_marks

Array = npt.NDArray[np.float64]
SPACING = 0.01
D = np.array([3.0, 0.0, 4.0])


@cache
def motion() -> hovi.Trajectory:
    robot = hovi.load_robot(hovi.example("two_link.urdf"))
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    asked: dict[str, Any] = {"limits": "none", "self_collision": False}
    return hovi.plan(scene, [0.1, 0.3], [0.5, 1.2], 1.0, intervals=4, **asked).trajectory


def keeping(*kept: Any) -> hovi.Trajectory:
    return dataclasses.replace(motion(), metadata={**motion().metadata, "keep": list(kept)})


def marks(*kept: Any) -> Array:
    robot = motion().robot
    assert robot is not None
    return kept_marks(keeping(*kept), robot, SPACING)


def path(part: tuple[float, float]) -> Array:
    robot = motion().robot
    assert robot is not None
    t = np.linspace(*part, 50)
    return robot.frame_positions(["tip"], motion().configurations(t))[:, 0]


LINE: dict[str, Any] = {
    "kind": "on_line",
    "frame": "tip",
    "point": [0.2, 0.0, 0.1],
    "direction": D.tolist(),
}
PLANE: dict[str, Any] = {"kind": "on_plane", "frame": "tip", "point": [0, 0, 0.3]}


@pytest.mark.parametrize("part", [(0.0, 1.0), (0.25, 0.5)])
def test_a_line_is_drawn_along_the_part_that_is_on_it(part: tuple[float, float]) -> None:
    found = marks({**LINE, "during": list(part)})
    d = D / 5.0
    away = found - LINE["point"]
    assert np.abs(away - np.outer(away @ d, d)).max() < 1e-12
    along, wanted = away @ d, (path(part) - LINE["point"]) @ d
    assert along.min() < wanted.min()
    assert along.max() > wanted.max()
    assert along.max() - along.min() < 1.5 * max(np.ptp(wanted), 0.1)
    assert np.linalg.norm(np.diff(found, axis=0), axis=1).max() <= SPACING


def test_a_plane_is_outlined_around_the_path() -> None:
    found = marks(PLANE)
    assert np.allclose(found[:, 2], 0.3)
    reached = path((0.0, 1.0))
    assert (found.min(axis=0)[:2] < reached.min(axis=0)[:2]).all()
    assert (found.max(axis=0)[:2] > reached.max(axis=0)[:2]).all()


@pytest.mark.parametrize(
    "kept",
    [
        *("nothing", 3, {"kind": "on_line"}, {"kind": "unknown"}, {**LINE, "frame": "none"}),
        *({**LINE, "direction": [0, 0, 0]}, {**LINE, "point": None}, {**PLANE, "during": [2, 1]}),
        {"kind": "upright", "frame": "tip"},
    ],
)
def test_what_no_mark_is_known_for_is_left_out(kept: Any) -> None:
    assert marks(kept).shape == (0, 3)
    if isinstance(kept, dict):
        assert len(marks(kept, LINE)) == len(marks(LINE)) > 0
