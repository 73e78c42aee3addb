"""Pages draw what is carried while it is carried, and at rest where it is taken and released."""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

import hovi
from hovi.viewing.highlights import Highlights
from hovi.viewing.replay_session import Replay, serve

Array = npt.NDArray[np.float64]

HOME = [0.0, -1.2, 1.5, -1.87, -1.57, 0.0]
THERE = [0.6, -1.2, 1.5, -1.87, -1.57, 0.0]
BACK = [-0.5, -1.2, 1.5, -1.87, -1.57, 0.0]
OFFSET = np.array([0.0, 0.0, 0.1])


@cache
def planned(self_collision: bool = True, repeat: int = 1) -> hovi.Trajectory:
    scene = hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])
    ball = hovi.Grasped(hovi.Sphere(OFFSET, 0.03), "tool0", 1.0, "ball", may_touch=["wrist_3_link"])
    segments = [
        hovi.Segment(THERE, 1.0, name="reach"),
        hovi.Segment(BACK, 1.5, grasped=[ball], name="carry"),
        hovi.Segment(HOME, 1.0, name="home"),
    ]
    found = hovi.plan_sequence(
        scene,
        HOME,
        segments,
        self_collision=self_collision,
        repeat=repeat,
        objective="acceleration",
    )
    assert found.success, found.message
    return found.trajectory


def place(q: Array | list[float]) -> Array:
    """Where the ball is in the hand, by Pinocchio alone."""
    model = hovi.load_robot("ur5").model
    data = model.createData()
    pin.framesForwardKinematics(model, data, np.asarray(q))
    found: Array = data.oMf[model.getFrameId("tool0")].act(OFFSET)
    return found


def shown(page: Replay, t: float) -> list[Array]:
    """The places of all balls of its radius that the page shows at a time."""
    visual = page.visualizer.visual_model
    data, visual_data = page.visualizer.model.createData(), visual.createData()
    q = page.trajectory.configurations(t)[0]
    pin.updateGeometryPlacements(page.visualizer.model, data, visual, visual_data, q)
    found = []
    for number, item in enumerate(visual.geometryObjects):
        node = page.visualizer.getViewerNodeName(item, pin.GeometryType.VISUAL)
        times, flags = page.tracks.get(node, (np.zeros(1), np.ones(1, dtype=bool)))
        is_ball = getattr(item.geometry, "radius", 0.0) == pytest.approx(0.03)
        if is_ball and flags[np.searchsorted(times, t, side="right") - 1]:
            found.append(visual_data.oMg[number].translation.copy())
    return found


@pytest.mark.parametrize("self_collision", [True, False])
def test_it_is_where_it_was_taken_then_in_the_hand_and_where_it_was_released(
    self_collision: bool,
) -> None:
    motion = planned(self_collision)
    with serve(motion, announce=lambda text: None) as page:
        for t, q in ((0.0, THERE), (0.7, THERE), (2.6, BACK), (3.5, BACK)):
            (at,) = shown(page, t)
            np.testing.assert_allclose(at, place(q), atol=1e-6)
        for t in (1.01, 1.6, 2.2):
            (at,) = shown(page, t)
            np.testing.assert_allclose(at, place(motion.configurations(t)[0]), atol=1e-9)


def test_each_repetition_takes_another_one() -> None:
    motion = planned(repeat=2)
    with serve(motion, announce=lambda text: None) as page:
        assert len(shown(page, 0.5)) == 1
        assert len(shown(page, 1.5)) == 1
        both = shown(page, 3.6)
        assert len(both) == 2
        for q in (THERE, BACK):
            assert min(np.linalg.norm(at - place(q)) for at in both) < 1e-6
        assert len(shown(page, 7.0)) == 2


def test_a_file_shows_the_same(tmp_path: pytest.TempPathFactory) -> None:
    path = f"{tmp_path}/motion.npz"
    planned().save(path)
    with serve(hovi.Trajectory.load(path), announce=lambda text: None) as page:
        for t in (0.5, 1.5, 3.0):
            assert len(shown(page, t)) == 1


def test_what_a_file_says_wrongly_is_not_drawn(tmp_path: pytest.TempPathFactory) -> None:
    motion = planned()
    for during in ([["none", 0.0, 1.0]], [["ball", 2.0, 1.0]], [["ball", "x", 1.0]], 3):
        metadata = {**motion.metadata, "clearance": {**motion.metadata["clearance"]}}
        metadata["clearance"]["during"] = during
        changed = hovi.Trajectory(
            motion.grid, motion.path, motion.momenta, None, metadata, segments=motion.segments
        )
        with serve(changed, announce=lambda text: None) as page:
            assert len(shown(page, 0.5)) == 1  # with the link, as it is


def test_highlights_leave_it_out() -> None:
    motion = planned()
    flags = np.ones((2, motion.robot.model.njoints), dtype=bool)  # type: ignore[union-attr]
    always = Highlights(np.array([0.0, motion.duration]), flags)
    robot = motion.robot
    assert robot is not None
    both = always.with_highlighted_copies(robot.visual, [robot.model.getFrameId("ball")])
    names = [each.name for each in both.geometryObjects]
    assert not any(name.startswith("ball") and name.endswith("its limit") for name in names)
    assert any(name.endswith("its limit") for name in names)
