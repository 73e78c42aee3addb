"""Pictures of a motion: of the replay page in a browser, or of its links as bars."""

from __future__ import annotations

import io
import tempfile
import warnings
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import numpy.typing as npt

from hovi.discrete.output.caution import caution_lines
from hovi.discrete.trajectory import Trajectory
from hovi.errors import DisplayError, HoviWarning, InputError
from hovi.exchange.film.headless_browser import BrowserError, Tab, headless_tab
from hovi.exchange.link_poses import link_poses, links_of
from hovi.exchange.samples import times_of

Array = npt.NDArray[np.float64]
Picture = npt.NDArray[np.uint8]
"""Red, green and blue, shape (height, width, 3)."""

SIZE = 640, 480
"""Width and height, in pixels."""
MAX_PICTURES = 20_000
_READY = (
    "typeof controls == 'object' && viewer.animator.actions.length > 0"
    " && viewer.scene_tree.children['meshcat'] !== undefined"
)
_SCENE_ALONE = "document.body.classList.add('bare'); stage.resize(); viewer.animator.pause(); 1"
_SEEK = "controls.seek({t}); viewer.render(); 1"
_MAX_LOADS = 40


def pictures(trajectory: Trajectory, rate: float) -> list[Picture]:
    """Pictures at multiples of 1/rate and at the end.

    They are those of the replay page in a headless Chromium, with the motion's cautions. Without
    one they are drawn by matplotlib, with a warning: links as bars, no obstacles.
    rate: pictures per second.
    Raises InputError for a rate that is not positive or gives more than MAX_PICTURES, DisplayError
    for a motion that was saved without its robot.
    """
    times = times_of(trajectory, rate)
    if len(times) > MAX_PICTURES:
        raise InputError(f"{rate:g} pictures per second are {len(times):,}; choose a lower rate.")
    if trajectory.robot is None:
        raise DisplayError(
            "this motion was saved without its robot, which was a bare Pinocchio model, so it "
            "cannot be drawn; load the robot from a URDF and plan again."
        )
    try:
        # in a thread, since the loop of a notebook runs in this one
        with ThreadPoolExecutor(1) as pool:
            return pool.submit(_by_browser, trajectory, times).result()
    except BrowserError as failure:
        warnings.warn(
            f"the replay page cannot be filmed, as {failure}: the robot is drawn by bars.",
            HoviWarning,
            stacklevel=2,
        )
    return _by_matplotlib(trajectory, times)


def _by_browser(trajectory: Trajectory, times: Array) -> list[Picture]:
    from hovi.viewing.replay_session import write_html

    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "motion.html"
        with headless_tab(SIZE) as tab:
            write_html(trajectory, page)
            tab.call("Emulation.setDeviceMetricsOverride", **_METRICS)
            tab.call("Page.navigate", url=page.as_uri())
            tab.until(_READY)
            tab.value(_SCENE_ALONE)
            _wait_until_drawn(tab)
            return [_decoded(_at(tab, float(t))) for t in times]


_METRICS = {"width": SIZE[0], "height": SIZE[1], "deviceScaleFactor": 1, "mobile": False}


def _at(tab: Tab, t: float) -> bytes:
    tab.value(_SEEK.format(t=t))
    return tab.screenshot()


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


def _by_matplotlib(trajectory: Trajectory, times: Array) -> list[Picture]:
    from hovi.exchange.film.bars import Bars

    assert trajectory.robot is not None
    links = links_of(trajectory.robot)
    number = {link.name: i for i, link in enumerate(links)}
    bars = [(number[link.parent], i) for i, link in enumerate(links) if link.parent in number]
    places = link_poses(trajectory.robot, links, trajectory.configurations(times), in_world=True)
    canvas = Bars(places[:, :, :3], SIZE, caution_lines([trajectory.metadata]))
    return [canvas.draw([here[[a, b], :3] for a, b in bars]) for here in places]
