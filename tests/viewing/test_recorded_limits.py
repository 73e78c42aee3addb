"""The obstacles recorded in a motion are saved, drawn, and used for distances."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
import umsgpack

import hovi
from hovi.cli.reports.limit_margins import nearest_pair
from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.obstacles import Box, Capsule, Sphere
from hovi.planning.problem.limits import as_limits
from hovi.viewing.plotting import motion_figure
from hovi.viewing.recorded_limits import imposed_clearance, imposed_limits, with_obstacles
from hovi.viewing.replay_session import write_html

BALL = Sphere([0.7, 0.0, -1.65], 0.15, name="ball")
OBSTACLES = [
    BALL,
    Box([0.2, 0.2, 0.2], [9, 0, 0]),
    Capsule([[8, 0, 0], [9, 0, 0]], 0.1),
]


@pytest.fixture(scope="module")
def motion(arm_scene: hovi.Scene) -> Trajectory:
    """A reach planned without obstacles, with three obstacles added to its metadata."""
    solution = hovi.plan(arm_scene, [-np.pi / 2, 0.0], [0.3, 0.7], 1.5, limits="none")
    clearance = Clearance(OBSTACLES, 0.05)
    metadata = {**solution.trajectory.metadata, "clearance": clearance.to_dict()}
    return dataclasses.replace(solution.trajectory, metadata=metadata)


def test_the_clearance_is_saved_with_the_motion(motion: Trajectory, tmp_path: Path) -> None:
    motion.save(tmp_path / "motion.npz")
    loaded = imposed_clearance(Trajectory.load(tmp_path / "motion.npz"))
    assert loaded is not None
    assert loaded.to_dict() == motion.metadata["clearance"]


def test_a_motion_in_segments_is_within_the_loosest_of_their_limits(motion: Trajectory) -> None:
    assert motion.robot is not None
    two = [as_limits(motion.robot, {"base": "none", "v": v}).to_dict() for v in (2.0, 0.1)]
    free = as_limits(motion.robot, {"base": "none", "tau": 9.0}).to_dict()

    def recorded(*parts: Any) -> Any:
        return imposed_limits(dataclasses.replace(motion, metadata={"segment_limits": [*parts]}))

    np.testing.assert_array_equal(recorded(*two).upper, recorded(two[0]).upper)
    assert recorded(*two, free) is None  # no bound that holds in all of them
    for wrong in ((), (None,), ({},), (two[0], 3), ({**two[0], "lower": [[0.0]]},)):
        assert recorded(*wrong) is None


WEDGE = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
KINDS = [
    *OBSTACLES,
    hovi.Cylinder(0.1, 0.4, [1, 0, 0]),
    hovi.HalfSpace([0, 0, 1], [0, 0, -3]),
    hovi.ConvexHull(WEDGE),
    hovi.ConvexParts([WEDGE, WEDGE], 0.01, [2, 0, 0]),
    hovi.PointCloud([[3, 0, 0], [3, 1, 0]], 0.1),
]


def test_every_kind_of_obstacle_is_on_the_page(motion: Trajectory, tmp_path: Path) -> None:
    """By the messages to the browser; those of hulls and capsules are triangles."""
    data = Clearance(KINDS).to_dict()
    shown = dataclasses.replace(motion, metadata={**motion.metadata, "clearance": data})
    page = write_html(shown, tmp_path / "page.html").page
    drawn = {
        message.path: umsgpack.unpackb(message.packed)["object"]["geometries"][0]["type"]
        for message in page.messages.all()
        if message.kind == "set_object" and "obstacle" in message.path
    }
    balls, boxes = ["SphereGeometry"] * 2, ["BoxGeometry"]
    assert list(drawn.values()) == [
        *("SphereGeometry", "BoxGeometry", "BufferGeometry", "CylinderGeometry"),
        *(*boxes, *["BufferGeometry"] * 3, *balls),
    ]


def test_a_recorded_clearance_opens_no_files(motion: Trajectory) -> None:
    mesh = {"kind": "mesh", "file": "/etc/passwd", "name": "stolen"}
    with pytest.raises(InputError, match="names no files"):
        Clearance.from_dict({"obstacles": [mesh], "margin": 0.0, "self_collision": False})


@pytest.mark.parametrize("data", [None, 3, {}, {"obstacles": [1]}, {"obstacles": [{"kind": 2}]}])
def test_an_invalid_clearance_in_metadata_counts_as_none(motion: Trajectory, data: Any) -> None:
    metadata = {**motion.metadata, "clearance": data}
    assert imposed_clearance(dataclasses.replace(motion, metadata=metadata)) is None


def test_obstacles_are_drawn_at_their_positions(motion: Trajectory) -> None:
    drawn = list(with_obstacles(pin.GeometryModel(), motion).geometryObjects)
    assert len(drawn) == 3
    np.testing.assert_allclose(drawn[0].placement.translation, BALL.position)


def test_the_least_distance_is_between_the_tip_and_the_ball(
    motion: Trajectory, arm_scene: hovi.Scene
) -> None:
    q = motion.configurations(np.linspace(0.0, 1.5, 50_001))
    tip = arm_scene.robot.frame_position("tip", q)
    nearest = np.linalg.norm(tip - np.asarray(BALL.position), axis=1).min() - 0.15 - 0.06
    assert nearest_pair(motion)[0] == pytest.approx(nearest, abs=1e-6)
    assert nearest_pair(dataclasses.replace(motion, metadata={}))[0] is None


def test_distances_get_a_panel_of_their_own(motion: Trajectory) -> None:
    figure = motion_figure(motion)
    assert [ax.get_ylabel() for ax in figure.axes][-1] == "distance [m]"
    labels = [line.get_label() for line in figure.axes[-1].lines]
    assert "tip to ball" in labels
    assert "margin" in labels
    assert len(motion_figure(dataclasses.replace(motion, metadata={})).axes) == 3
