"""Films of a motion, read back by Pillow and ffmpeg."""

from __future__ import annotations

import dataclasses
import itertools
import os
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import hovi
from hovi.discrete.trajectory import Trajectory
from hovi.errors import DisplayError, HoviWarning, InputError
from hovi.exchange.film import headless_browser
from hovi.exchange.film.shot import SIZE, Shot
from oracles.processes import (
    arguments,
    descendants,
    is_running,
    listening_addresses,
    wait_until,
)
from samples.cubic_motion import cubic_motion

with_browser = pytest.mark.skipif(headless_browser.browser() is None, reason="needs Chromium")


@pytest.fixture(scope="module")
def motion(arm_scene: hovi.Scene) -> Trajectory:
    return cubic_motion(arm_scene, duration=0.8, schemes=["galerkin-2"] * 3)[0]


@pytest.fixture
def no_browser(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(headless_browser, "NAMES", ())


def pictures_of(path: Path) -> tuple[list[Any], list[int]]:
    """The pictures of a GIF, and how long each lasts, in [ms]."""
    with Image.open(path) as film:
        found, times = [], []
        for i in range(film.n_frames):
            film.seek(i)
            found.append(np.asarray(film.convert("RGB"), dtype=float))
            times.append(film.info["duration"])
    return found, times


def changed(one: Any, other: Any) -> float:
    """The fraction of pixels that differ visibly."""
    return float((np.abs(one - other).max(axis=2) > 40).mean())


@with_browser
def test_a_gif_shows_the_replay_page_without_its_controls(
    motion: Trajectory, tmp_path: Path
) -> None:
    motion.to_gif(tmp_path / "motion.gif", 4.0)
    found, times = pictures_of(tmp_path / "motion.gif")
    assert len(found) == 5  # at 0, 0.25, 0.5, 0.75 and 0.8 s
    assert set(times) == {250}
    assert found[0].shape == (SIZE[1], SIZE[0], 3)
    assert changed(found[0], found[2]) > 0.002
    assert changed(found[2], found[-1]) > 0.002
    dark = found[0][:, SIZE[0] * 2 // 3 :, :].max(axis=2) < 60  # the page's panel is dark
    assert dark.mean() < 0.05


@pytest.mark.parametrize("page", [pytest.param(True, marks=with_browser), False])
def test_a_film_has_the_size_the_speed_and_the_camera_that_are_given(
    motion: Trajectory, tmp_path: Path, page: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not page:
        monkeypatch.setattr(headless_browser, "NAMES", ())
    films = []
    for k, camera in enumerate(("side", "0.0,-8,0:0,0,1")):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", HoviWarning)
            motion.to_gif(tmp_path / f"{k}.gif", 4.0, size="320x240", speed=2.0, camera=camera)
        found, _ = pictures_of(tmp_path / f"{k}.gif")
        assert len(found) == 3  # 0, 0.5 and 0.8 s of the motion
        assert found[0].shape == (240, 320, 3)
        films.append(found[0])
    for one, other in itertools.pairwise(films):
        assert changed(one, other) > 0.002


def test_a_size_a_camera_and_a_speed_are_checked(motion: Trajectory, tmp_path: Path) -> None:
    for given in ("640", "640x", (640, 481), "126x480", "1922x1080", [640, 480, 3], 640, "640.5x2"):
        with pytest.raises(InputError, match="size of a film must be"):
            Shot.of(size=given)
    for given in (
        "1,2",
        "1,2,3:4,5",
        "1,2,nan",
        [1, 2],
        [[1, 2, 3]] * 3,
        [1, 2, 3j],
        [True] * 3,
        "1,2,3:4,5,6:7,8,9",
        7,
    ):
        with pytest.raises(InputError, match="camera of a film is a view"):
            Shot.of(camera=given)
    with pytest.raises(InputError, match="there is no view 'tpo': did you mean 'top'"):
        Shot.of(camera="tpo")
    with pytest.raises(InputError, match="looks at where it is"):
        Shot.of(camera="1,2,3:1,2,3")
    for speed in (0.0, -1.0, np.inf):
        with pytest.raises(InputError, match="speed of a film must be a positive number"):
            Shot.of(speed=speed)
    with pytest.raises(InputError, match="`speed` is for the formats video and gif, not 'csv'"):
        hovi.export(motion, tmp_path / "m.csv", speed=2.0)
    with pytest.raises(InputError, match="choose a lower rate"):
        motion.to_gif(tmp_path / "motion.gif", 50.0, speed=1e-4)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("page", [pytest.param(True, marks=with_browser), False])
def test_a_film_has_the_cautions_of_its_motion_at_the_top(
    motion: Trajectory, tmp_path: Path, page: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A line of text there, and nothing else that a motion without cautions does not have."""
    if not page:
        monkeypatch.setattr(headless_browser, "NAMES", ())
    said = [["coarse", "The grid is coarse, and the curve costs more than its points."]]
    cautious = dataclasses.replace(motion, metadata={**motion.metadata, "cautions": said})
    films = []
    for k, each in enumerate((motion, cautious)):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", HoviWarning)
            each.to_gif(tmp_path / f"{k}.gif", 2.0)
        films.append(pictures_of(tmp_path / f"{k}.gif")[0][0])
    top = 40
    assert changed(films[0][:top], films[1][:top]) > 0.01
    assert changed(films[0][top:], films[1][top:]) < 0.002


def test_without_a_browser_the_robot_is_drawn_by_bars(
    motion: Trajectory, no_browser: None, tmp_path: Path
) -> None:
    with pytest.warns(HoviWarning, match="cannot be filmed, as there is no Chromium: the robot is"):
        motion.to_gif(tmp_path / "motion.gif", 4.0)
    found, _ = pictures_of(tmp_path / "motion.gif")
    assert len(found) == 5
    assert changed(found[0], found[-1]) > 0.002


@with_browser
def test_no_other_user_can_drive_the_browser_that_films(motion: Trajectory) -> None:
    others = set(descendants(os.getpid()))  # such as workers that wait for another plan
    with headless_browser.headless_tab(SIZE) as tab:
        assert tab.value("1 + 1") == 2
        browsers = [each for each in descendants(os.getpid()) if each not in others]
        assert len(browsers) >= 2
        assert listening_addresses(browsers) == []
        given = {argument for pid in browsers for argument in arguments(pid)}
        assert not any(each.startswith("--remote-debugging-port") for each in given)
    wait_until(lambda: not any(map(is_running, browsers)))


def test_a_browser_that_does_not_start_is_told(
    motion: Trajectory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(headless_browser, "NAMES", ("false",))
    with pytest.warns(HoviWarning, match="as Chromium does not start"):
        motion.to_gif(tmp_path / "motion.gif", 4.0)
    assert (tmp_path / "motion.gif").exists()


# imageio-ffmpeg's reader leaves its pipes to the garbage collector
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_video_has_its_rate_and_pictures(
    motion: Trajectory, no_browser: None, tmp_path: Path
) -> None:
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    with pytest.warns(HoviWarning, match="cannot be filmed"):
        motion.to_video(tmp_path / "motion.mp4", 10.0)
    reader = ffmpeg.read_frames(str(tmp_path / "motion.mp4"))
    about = next(reader)
    read = [np.frombuffer(data, np.uint8).reshape(SIZE[1], SIZE[0], 3) for data in reader]
    assert about["fps"] == 10.0
    assert about["size"] == SIZE
    assert len(read) == 9
    assert changed(read[0].astype(float), read[-1].astype(float)) > 0.002


def test_a_gif_is_at_most_as_fast_as_viewers_play_it(motion: Trajectory, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="at most 50 pictures per second"):
        motion.to_gif(tmp_path / "motion.gif", 60.0)
    with pytest.raises(InputError, match="choose a lower rate"):
        motion.to_gif(tmp_path / "motion.gif", 1e6)


def test_a_motion_without_its_robot_cannot_be_drawn(tmp_path: Path) -> None:
    robot = hovi.load_robot(hovi.load_robot(hovi.example("two_link.urdf")).model)
    cubic_motion(hovi.Scene(robot))[0].save(tmp_path / "m.npz")
    with pytest.raises(DisplayError, match="saved without its robot"):
        Trajectory.load(tmp_path / "m.npz").to_gif(tmp_path / "m.gif")
    assert not (tmp_path / "m.gif").exists()
