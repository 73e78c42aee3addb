"""Pictures of a motion: of the replay page in a browser, or of its links as bars."""

from __future__ import annotations

import base64
import io
import itertools
import json
import tempfile
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt

from hovi.discrete.output.caution import caution_lines
from hovi.discrete.trajectory import Trajectory
from hovi.errors import DisplayError, HoviWarning, InputError
from hovi.exchange.film.headless_browser import BrowserError, Tab, headless_tab
from hovi.exchange.film.shot import Shot
from hovi.exchange.link_poses import link_poses, links_of
from hovi.exchange.samples import times_of

Array = npt.NDArray[np.float64]
Picture = npt.NDArray[np.uint8]
"""Red, green and blue, shape (height, width, 3)."""

MAX_PICTURES = 20_000
_READY = (
    "typeof controls == 'object' && viewer.animator.actions.length > 0"
    " && viewer.scene_tree.children['meshcat'] !== undefined"
)
_SCENE_ALONE = "document.body.classList.add('bare'); stage.resize(); viewer.animator.pause(); 1"
_LOOK = "stage.look_from({direction}); 1"
_PLACE = "stage.stand({position}, {target}); 1"
_SEEK = "controls.seek({t}); viewer.render(); 1"
_MAX_LOADS = 40


def pictures(trajectory: Trajectory, rate: float, shot: Shot | None = None) -> Iterator[Picture]:
    """Pictures at multiples of speed/rate and at the end, made one by one.

    They are those of the replay page in a headless Chromium, with the motion's cautions. Without
    one they are drawn by matplotlib, with a warning: links as bars, no obstacles.
    rate: pictures per second of the film.
    Raises InputError for a rate that is not positive or gives more than MAX_PICTURES, DisplayError
    for a motion that was saved without its robot, and where the browser ends meanwhile.
    """
    shot = Shot() if shot is None else shot
    times = picture_times(trajectory, rate, shot)
    if trajectory.robot is None:
        raise DisplayError(
            "this motion was saved without its robot, which was a bare Pinocchio model, so it "
            "cannot be drawn; load the robot from a URDF and plan again."
        )
    filmed = _by_browser(trajectory, times, shot)
    try:
        first = next(filmed)
    except BrowserError as failure:
        warnings.warn(
            f"the replay page cannot be filmed, as {failure}: the robot is drawn by bars.",
            HoviWarning,
            stacklevel=2,
        )
        return _by_matplotlib(trajectory, times, shot)
    return itertools.chain([first], _without_browser_errors(filmed))


def picture_times(trajectory: Trajectory, rate: float, shot: Shot) -> Array:
    """Times of the motion in its pictures, in [s]. Raises InputError."""
    times = times_of(trajectory, rate / shot.speed)
    if len(times) > MAX_PICTURES:
        raise InputError(f"{rate:g} pictures per second are {len(times):,}; choose a lower rate.")
    return times


def _by_browser(trajectory: Trajectory, times: Array, shot: Shot) -> Iterator[Picture]:
    from hovi.viewing.replay_session import write_html

    width, height = shot.size
    metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
    with tempfile.TemporaryDirectory() as folder, headless_tab(shot.size) as tab:
        page = Path(folder) / "motion.html"
        write_html(trajectory, page)
        tab.call("Emulation.setDeviceMetricsOverride", **metrics)
        tab.call("Page.navigate", url=page.as_uri())
        tab.until(_READY)
        tab.value(_SCENE_ALONE)
        _place_camera(tab, shot)
        _wait_until_drawn(tab)
        for t in times.tolist():
            yield _decoded(_at(tab, t))


def _place_camera(tab: Tab, shot: Shot) -> None:
    if shot.direction is not None:
        tab.value(_LOOK.format(direction=json.dumps(shot.direction)))
    if shot.position is not None:
        ends = {"position": json.dumps(shot.position), "target": json.dumps(shot.target)}
        tab.value(_PLACE.format(**ends))


def _at(tab: Tab, t: float) -> bytes:
    tab.value(_SEEK.format(t=t))
    # a PNG that is packed less, in half the time
    shot = tab.call("Page.captureScreenshot", format="png", optimizeForSpeed=True)
    return base64.b64decode(shot["data"])


def _wait_until_drawn(tab: Tab) -> None:
    """Meshes are parsed one after the other: wait until three pictures are the same."""
    seen: list[bytes] = []
    for _ in range(_MAX_LOADS):
        seen.append(_at(tab, 0.0))
        if len(seen) > 3 and seen[-1] == seen[-2] == seen[-3]:
            return
        tab.value("new Promise(done => setTimeout(done, 50)) && 1")


def _decoded(png: bytes) -> Picture:
    from PIL import Image

    with Image.open(io.BytesIO(png)) as image:
        return np.asarray(image.convert("RGB"), dtype=np.uint8)


def _without_browser_errors(filmed: Iterator[Picture]) -> Iterator[Picture]:
    try:
        yield from filmed
    except BrowserError as failure:
        raise DisplayError(f"the film has no end, as {failure}; film the motion again.") from None


def _by_matplotlib(trajectory: Trajectory, times: Array, shot: Shot) -> Iterator[Picture]:
    from hovi.exchange.film.bars import Bars

    assert trajectory.robot is not None
    links = links_of(trajectory.robot)
    number = {link.name: i for i, link in enumerate(links)}
    bars = [(number[link.parent], i) for i, link in enumerate(links) if link.parent in number]
    places = link_poses(trajectory.robot, links, trajectory.configurations(times), in_world=True)
    canvas = Bars(places[:, :, :3], shot, caution_lines([trajectory.metadata]))
    return (canvas.draw([here[[a, b], :3] for a, b in bars]) for here in places)
