"""The menu of demonstrations."""

from __future__ import annotations

import base64
import http.client
import re
import threading
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest
from PIL import Image

from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.task_file.reading import load_task
from hovi.planning.task_file.task_plan import plan_task
from hovi.robot.bundled_models import example
from hovi.viewing.documents.demo import FIRST, MOTIONS, DemoServer, menu_html
from oracles.headless_browser import CHROMIUM, Tab, headless_browser

needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")
QUICK = "spacecraft_reorients"


@pytest.fixture(scope="module")
def demo() -> Iterator[DemoServer]:
    server = DemoServer()
    planner = threading.Thread(target=server.plan_what_is_chosen, args=(lambda line: None,))
    planner.start()
    yield server
    server.close()
    planner.join()


def test_there_are_eight_motions() -> None:
    assert len({each.scene for each in MOTIONS}) == 8


@pytest.mark.parametrize("scene", [each.scene for each in MOTIONS])
def test_a_copied_scene_file_plans_a_minimum_without_a_caution(scene: str, tmp_path: Path) -> None:
    copy = tmp_path / "my_scene.toml"
    copy.write_text(next(each.text() for each in MOTIONS if each.scene == scene))
    solution = plan_task(load_task(copy))
    assert solution.success, solution.message
    assert "into each other" not in solution.message


def test_the_menu_has_every_scene_file_to_copy() -> None:
    menu = menu_html()
    for each in MOTIONS:
        assert f'id="{each.scene}"' in menu
    assert menu.count('class="copy"') == 8
    assert "default-src 'none'" in menu
    assert not re.search(r"(src|href)=\"(?!data:)", menu)


def test_every_motion_has_a_picture() -> None:
    menu = menu_html()
    for each in MOTIONS:
        with Image.open(each.picture) as picture:
            assert picture.size == (320, 180)
        assert base64.b64encode(each.picture.read_bytes()).decode() in menu


def test_the_first_motion_is_that_of_its_scene_and_is_not_planned() -> None:
    first, task = Trajectory.load(FIRST), load_task(example(f"{MOTIONS[0].scene}.toml"))
    assert first.metadata["status"] == "minimum"
    assert isinstance(task.start, State)
    np.testing.assert_allclose(first.q[0], task.start.q, atol=1e-12)
    assert isinstance(task.goal, FrameGoal)
    assert first.robot is not None
    pose = first.robot.frame_pose(task.goal.frame, first.q[-1])
    np.testing.assert_allclose(pose[:3, 3], task.goal.position, atol=1e-6)
    assert first.duration == task.duration
    told: list[str] = []
    server = DemoServer()
    planner = threading.Thread(target=server.plan_what_is_chosen, args=(told.append,))
    planner.start()
    with urllib.request.urlopen(f"{server.url}motion/{MOTIONS[0].scene}", timeout=60) as answer:
        assert "const PANEL" in answer.read().decode()
    server.close()
    planner.join()
    assert told == []


def test_a_motion_is_planned_when_it_is_asked_for(demo: DemoServer) -> None:
    with urllib.request.urlopen(f"{demo.url}motion/{QUICK}", timeout=120) as answer:
        page = answer.read().decode()
    assert "const PANEL" in page


def test_other_names_and_other_hosts_are_refused(demo: DemoServer) -> None:
    address = urlsplit(demo.url).netloc
    for path, host, status in (
        ("/motion/no_such_scene", address, 404),
        ("/motion/..%2fsecret", address, 403),
        ("/", "example.org", 403),
        ("/", address, 200),
    ):
        connection = http.client.HTTPConnection(address, timeout=30)
        connection.request("GET", path, headers={"Host": host})
        assert connection.getresponse().status == status
        connection.close()


@needs_chromium
def test_the_first_motion_plays_at_once_next_to_the_menu_and_a_phone_shows_the_menu(
    demo: DemoServer,
) -> None:
    frame = "document.querySelector('iframe')"
    with headless_browser((1280, 800)) as tab:
        tab.call("Page.navigate", url=demo.url)
        tab.until(f"{frame}?.contentWindow?.viewer?.animator?.actions?.length > 0")
        assert tab.value(f"{frame}.src").endswith(MOTIONS[0].scene)
        assert tab.value("document.querySelector('.chosen').id") == MOTIONS[0].scene
        metrics = {"width": 390, "height": 844, "deviceScaleFactor": 1}
        tab.call("Emulation.setDeviceMetricsOverride", mobile=True, **metrics)
        tab.call("Page.navigate", url=demo.url)
        tab.until("document.querySelectorAll('.card img').length == 8")
        assert tab.value(f"{frame} === null")
        loaded = "[...document.querySelectorAll('.card img')].every(each => each.naturalWidth > 0)"
        tab.until(loaded)
        assert not tab.errors


@needs_chromium
@pytest.mark.parametrize("size", [(1280, 800), (390, 844)])
def test_a_click_on_a_card_shows_its_motion(demo: DemoServer, size: tuple[int, int]) -> None:
    with headless_browser() as tab:
        metrics = {"width": size[0], "height": size[1], "deviceScaleFactor": 1}
        tab.call("Emulation.setDeviceMetricsOverride", mobile=size[0] < 500, **metrics)
        tab.call("Page.navigate", url=demo.url)
        tab.until("document.querySelectorAll('.card').length == 8")
        _copies_the_scene_file(tab)
        tab.value(f"document.querySelector('#{QUICK} .play').click(); 1")
        tab.until(
            "document.querySelector('iframe')?.contentWindow?.viewer?.animator?.actions?.length > 0"
        )
        shown = tab.value("document.querySelector('iframe').getBoundingClientRect().width")
        assert shown >= 0.6 * size[0]
        assert all(url.startswith((demo.url, "data:", "blob:")) for url in tab.requests)
        assert not tab.errors


def _copies_the_scene_file(tab: Tab) -> None:
    """The text that is marked where the clipboard is not available is the scene file."""
    shown = tab.value(f"document.querySelector('#{QUICK} pre').textContent")
    assert shown == example(f"{QUICK}.toml").read_text()
