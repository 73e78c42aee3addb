"""What can be seen on a replay page, on a desktop and on a phone."""

from __future__ import annotations

import dataclasses
import itertools
import json
import os
import pty
import re
import select
import signal
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

from hovi.discrete.trajectory import Trajectory
from hovi.effects import Gravity, Payload
from hovi.errors import InputError
from hovi.exchange.film.shot import VIEWS
from hovi.planning.problem.limits import as_limits
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.robot.urdf.planar_chain import chain
from hovi.scene.scene import Scene
from hovi.viewing.panel.panel import Panel
from hovi.viewing.payloads import Payloads
from hovi.viewing.replay_session import replay, serve
from hovi.viewing.skeleton import skeleton
from oracles.headless_browser import CHROMIUM, Tab, headless_browser
from samples.cubic_motion import cubic_motion

needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")
DESKTOP, PHONE = (1280, 800), (390, 844)
Array = npt.NDArray[np.float64]


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    """A chain of five hinges, drawn as a skeleton: quick to draw without a graphics card."""
    path = tmp_path_factory.mktemp("arm") / "arm.urdf"
    path.write_text(chain(5))
    return load_robot(path)


@pytest.fixture(scope="module")
def motion(arm: Robot) -> Trajectory:
    scene = Scene(arm, [Gravity(9.81), Payload(arm.tip_frame, 1.0)])
    limits = as_limits(arm, {"base": "none", "q": 2.0, "tau": 500.0})
    return dataclasses.replace(
        cubic_motion(scene, seed=3)[0], metadata={"limits": limits.to_dict()}
    )


@pytest.fixture(scope="module")
def page(motion: Trajectory, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("page") / "arm.html"
    replay(motion, html=path)
    return path


@pytest.fixture(scope="module", params=[DESKTOP, PHONE], ids=["desktop", "phone"])
def tab(request: pytest.FixtureRequest, page: Path) -> Iterator[Tab]:
    """The page in a window of each size."""
    width, height = request.param
    with headless_browser() as opened:
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1}
        opened.call("Emulation.setDeviceMetricsOverride", mobile=width < 500, **metrics)
        opened.open(page.as_uri())
        opened.until("viewer.animator.actions.length > 0")
        yield opened
        assert not opened.errors


@pytest.fixture(scope="module")
def other_tab() -> Iterator[Tab]:
    """A window for other pages."""
    with headless_browser() as opened:
        yield opened


def press(tab: Tab, chip: str, on: bool = True) -> None:
    """Switch one of the buttons below the scene on or off."""
    button = f"document.getElementById('chip-{chip}')"
    tab.value(
        f"if ({button}.getAttribute('aria-pressed') != '{on}'.toLowerCase()) {button}.click(); 1"
    )


def window(tab: Tab) -> list[int]:
    """Width and height."""
    return list(tab.value("[innerWidth, innerHeight]"))


def seek(tab: Tab, t: float) -> None:
    tab.value(f"controls.seek({t}); viewer.render(); 1")


def boxes(tab: Tab, selector: str) -> dict[str, Array]:
    """Left, top, right and bottom of the shown elements with a text, by that text."""
    found = tab.value(
        f"[...document.querySelectorAll('{selector}')].filter(e => e.offsetWidth > 0)"
        ".map((e, i) => { const b = e.getBoundingClientRect();"
        "return [`${i} ${e.textContent}`, [b.left, b.top, b.right, b.bottom]]; })"
    )
    return {name: np.array(box) for name, box in found}


def boxes_after(tab: Tab, change: str, selector: str) -> dict[str, Array]:
    """The boxes right after a change, before the page draws again."""
    list_boxes = (
        f"[...document.querySelectorAll('{selector}')].map((e, i) => {{"
        "const b = e.getBoundingClientRect();"
        "return [`${i}`, [b.left, b.top, b.right, b.bottom]]; })"
    )
    found = tab.value(f"(() => {{ {change} return {list_boxes}; }})()")
    return {name: np.array(box) for name, box in found}


def overlapping(shown: dict[str, Array]) -> list[tuple[str, str]]:
    pairs = itertools.combinations(shown.items(), 2)
    return [
        (one, two)
        for (one, a), (two, b) in pairs
        if (np.minimum(a[2:], b[2:]) - np.maximum(a[:2], b[:2]) > 0.5).all()
    ]


@needs_chromium
def test_pixels_of_the_scene_and_of_the_strips_change_as_it_plays(
    motion: Trajectory, tab: Tab
) -> None:
    pictures = []
    for t in (0.0, 0.5 * motion.duration, motion.duration):
        seek(tab, t)
        pictures.append(tab.screenshot())
    for part in ("#scene", "#torque", "#joints"):  # the strip at the lower edge of a phone
        (box,) = boxes(tab, part).values()
        left, top, right, bottom = np.clip(box, 0, [*window(tab), *window(tab)]).astype(int)
        crops = [picture[top:bottom, left:right] for picture in pictures]
        assert crops[0].size > 0, part
        for before, after in itertools.pairwise(crops):
            assert (np.abs(before - after).max(axis=2) > 30).mean() > 1e-3, part


@needs_chromium
def test_labels_do_not_overlap(motion: Trajectory, tab: Tab) -> None:
    press(tab, "names")
    names = {f"{name}" for name in motion.coordinate_names}
    for t in np.linspace(0.0, motion.duration, 5):
        seek(tab, float(t))
        for selector in (
            "#names .label",
            "#side .label, #side .number",
            "#bar button, #clock, #time",
        ):
            shown = boxes(tab, selector)
            assert len(shown) >= 2
            assert not overlapping(shown)
        labels = boxes(tab, "#names .label")
        assert names <= {label.partition(" ")[2] for label in labels}
        scene = boxes(tab, "#scene")
        inside = next(iter(scene.values()))
        for box in labels.values():
            assert (box[:2] >= inside[:2]).all()
            assert (box[2:] <= inside[2:]).all()


@needs_chromium
def test_two_labels_at_the_same_place_are_found(tab: Tab) -> None:
    press(tab, "names")
    tab.value(
        "for (const e of document.querySelectorAll('#names .label')) e.style.transform = ''; 1"
    )
    assert overlapping(boxes(tab, "#names .label"))


@needs_chromium
def test_the_robot_and_its_path_are_inside_the_view(motion: Trajectory, tab: Tab) -> None:
    for t in np.linspace(0.0, motion.duration, 4):
        seek(tab, float(t))
        corners = tab.value(
            "(() => { const T = MeshCat.THREE, out = [];"
            "viewer.scene_tree.find(['meshcat']).object.updateMatrixWorld(true);"
            "viewer.scene_tree.find(['meshcat']).object.traverse(o => { if (!o.geometry) return;"
            "o.geometry.computeBoundingBox(); const b = o.geometry.boundingBox;"
            "for (let i = 0; i < 8; i++) { const p = new T.Vector3(i & 1 ? b.min.x : b.max.x,"
            "i & 2 ? b.min.y : b.max.y, i & 4 ? b.min.z : b.max.z).applyMatrix4(o.matrixWorld);"
            "p.project(viewer.camera); out.push([p.x, p.y]); } }); return out; })()"
        )
        across, up = np.abs(np.array(corners)).max(axis=0)
        assert across < 1.0
        assert up < 1.0
        assert max(across, up) > 0.3  # and not lost in it


@needs_chromium
def test_everything_on_a_page_can_be_reached(tab: Tab) -> None:
    """Controls are inside the window; what is beside the scene may scroll, but not sideways."""
    for name, box in boxes(tab, "#bar button, #bar select, #bar input, #clock").items():
        assert (box >= 0).all(), name
        assert (box[2:] <= window(tab)).all(), name
        assert min(box[2:] - box[:2]) >= 15, name
    side = "document.getElementById('side')"
    assert tab.value(f"{side}.scrollWidth <= {side}.clientWidth")


@needs_chromium
def test_no_request_leaves_a_page(tab: Tab) -> None:
    for _ in range(2):
        tab.value("for (const e of document.querySelectorAll('#chips button')) e.click(); 1")
    assert all(url.startswith(("file:", "data:", "blob:")) for url in tab.requests), tab.requests
    assert not tab.errors


@needs_chromium
def test_a_click_plays_from_where_the_slider_is_and_another_stops(
    motion: Trajectory, tab: Tab
) -> None:
    half = 0.5 * motion.duration
    tab.value("controls.speed.value = '0.1'; controls.speed.onchange(); 1")
    seek(tab, half)
    tab.value("document.getElementById('play').click(); 1")
    tab.until(f"controls.t > {half} + 0.02")
    tab.value("document.getElementById('play').click(); 1")
    assert not tab.value("viewer.animator.playing")
    stopped = tab.value("[controls.t, Number(document.getElementById('time').value)]")
    assert stopped[0] == pytest.approx(stopped[1], abs=1e-9)
    assert half < stopped[0] <= motion.duration


@needs_chromium
def test_numbers_beside_the_scene_are_those_of_the_motion(motion: Trajectory, tab: Tab) -> None:
    t = 0.37 * motion.duration
    seek(tab, t)
    shown = tab.value(
        "[...document.querySelectorAll('#side .number')].map(e => Number(e.textContent))"
    )
    sample = motion.sample([t])
    np.testing.assert_allclose(shown[::2], np.degrees(sample.q[0]), atol=0.06 + 0.05)
    np.testing.assert_allclose(shown[1::2], sample.tau[0], rtol=0.02, atol=0.02)
    share = (sample.q[0] + 2.0) / 4.0
    bars = tab.value(
        "[...document.querySelectorAll('.meter.point i')].map(e => parseFloat(e.style.left))"
    )
    np.testing.assert_allclose(bars, 100 * np.clip(share, 0, 1), atol=0.2)


@needs_chromium
def test_a_line_at_a_limit_has_the_color_of_its_joint_unless_it_is_that_of_all(
    arm: Robot, motion: Trajectory, other_tab: Tab, tmp_path: Path
) -> None:
    first, second, *_ = names = arm.joint_names
    large = 1.1 * float(np.abs(motion.sample(np.linspace(0.0, motion.duration, 99)).tau).max())
    table = {name: large if name in (first, second) else 1e6 for name in names}
    limits = as_limits(arm, {"base": "none", "tau": table, "v": 1e-3})
    shown = dataclasses.replace(motion, metadata={"limits": limits.to_dict()})
    replay(shown, html=tmp_path / "arm.html")
    other_tab.open((tmp_path / "arm.html").as_uri())
    other_tab.until("viewer.animator.actions.length > 0")
    lines = other_tab.value(
        "[...document.querySelectorAll('#torque .limit')].map(line => [Number(line.dataset.joint),"
        " getComputedStyle(line).stroke === getComputedStyle(document.querySelector("
        "`#torque .curve[data-joint='${line.dataset.joint}']`)).stroke])"
    )
    assert len(lines) in (2, 4)  # at one end of the range, or at both
    assert {joint for joint, _ in lines} == {0, 1}
    assert all(same for _, same in lines)
    shared = "[...document.querySelectorAll('#velocity .limit')].map(line => line.dataset.joint)"
    assert other_tab.value(f"{shared}.map(joint => joint === undefined)") == [True, True]


@needs_chromium
def test_curves_of_eighteen_joints_differ_and_look_as_next_to_their_names(
    other_tab: Tab, tmp_path: Path
) -> None:
    (tmp_path / "arm.urdf").write_text(chain(18))
    arm = load_robot(tmp_path / "arm.urdf")
    replay(cubic_motion(Scene(arm, [Gravity(9.81)]))[0], html=tmp_path / "arm.html")
    other_tab.open((tmp_path / "arm.html").as_uri())
    other_tab.until("viewer.animator.actions.length > 0")
    looks = (
        "[...document.querySelectorAll('{}')].map(path => [getComputedStyle(path).stroke,"
        " getComputedStyle(path).strokeDasharray.split(',').length,"
        " parseFloat(getComputedStyle(path).strokeDasharray) > 4])"
    )
    curves = other_tab.value(looks.format("#torque .curve"))
    assert len({tuple(each) for each in curves}) == len(curves) == 18
    assert other_tab.value(looks.format(".joint path")) == curves


NDC = (
    "(p => new MeshCat.THREE.Vector3(...p.map((x, i) => x + PANEL.shift[i]))"
    ".applyMatrix4(viewer.scene.matrixWorld).project(viewer.camera).toArray())({})"
)
"""Where a point of the world is in the picture, from -1 to 1 in both directions."""


@needs_chromium
def test_a_camera_stands_where_it_is_put_and_looks_at_its_target(tab: Tab) -> None:
    position, target, above = [1.0, -2.0, 1.5], [0.2, 0.3, 0.1], [0.2, 0.3, 0.4]
    tab.value(f"stage.stand({position}, {target}); viewer.render(); 1")
    at = tab.value(
        "[viewer.camera.position.x, -viewer.camera.position.z, viewer.camera.position.y]"
    )
    shift = np.array(tab.value("PANEL.shift"))
    np.testing.assert_allclose(np.array(at) - shift, position, atol=1e-6)
    np.testing.assert_allclose(tab.value(NDC.format(target))[:2], [0.0, 0.0], atol=1e-5)
    x, y, _ = tab.value(NDC.format(above))
    assert abs(x) < 1e-5
    assert y > 0.05
    tab.value("stage.resize(); viewer.render(); 1")
    np.testing.assert_allclose(tab.value(NDC.format(target))[:2], [0.0, 0.0], atol=1e-5)
    tab.value("stage.turned = false; stage.look(); 1")


@needs_chromium
@pytest.mark.parametrize("view", VIEWS)
def test_a_view_shows_all_of_the_motion_from_its_side(tab: Tab, view: str) -> None:
    before = tab.value("PANEL.view")
    tab.value(f"stage.look_from({list(VIEWS[view])}); viewer.render(); 1")
    camera = tab.value(
        "[viewer.camera.position.x, -viewer.camera.position.z, viewer.camera.position.y]"
    )
    toward = np.array(camera) / np.linalg.norm(camera)
    np.testing.assert_allclose(toward, VIEWS[view] / np.linalg.norm(VIEWS[view]), atol=1e-5)
    places = tab.value("PANEL.joints.flatMap(joint => joint.at.map(pose => pose.slice(0, 3)))")
    seen = np.array([tab.value(NDC.format(place)) for place in places[:: len(places) // 20]])
    assert (np.abs(seen[:, :2]) <= 1.0).all()
    assert np.abs(seen[:, :2]).max() > 0.3
    tab.value(f"stage.look_from({before}); viewer.render(); 1")


@needs_chromium
def test_frames_of_the_tip_are_drawn_at_the_start_and_at_the_goal(
    motion: Trajectory, tab: Tab
) -> None:
    robot = motion.robot
    assert robot is not None
    ends = "stage.node(['Ends']).children.map(end => end.children[0])"
    for k, (position, quaternion) in enumerate(
        tab.value(f"{ends}.map(x => [x.position.toArray(), x.quaternion.toArray()])")
    ):
        pose = robot.frame_pose(robot.tip_frame, motion.q[-k])
        np.testing.assert_allclose(position, pose[:3, 3], atol=1e-5)
        turned = pin.Quaternion(np.array(quaternion)).matrix()
        np.testing.assert_allclose(turned, pose[:3, :3], atol=1e-4)
    assert tab.value(f"{ends}.length") == 2
    seek(tab, 0.5 * motion.duration)
    shown = tab.screenshot()
    press(tab, "ends", on=False)
    seek(tab, 0.5 * motion.duration)
    changed = np.abs(tab.screenshot() - shown).max(axis=2) > 30
    press(tab, "ends")
    assert 1e-4 < changed.mean() < 0.05


@needs_chromium
def test_frames_follow_the_joints(motion: Trajectory, tab: Tab) -> None:
    press(tab, "frames")
    t = 0.5 * motion.duration
    seek(tab, t)
    robot = motion.robot
    assert robot is not None
    hand = robot.frame_position(robot.tip_frame, motion.configurations(t))[0]
    at = tab.value("stage.frames.at(-1).frame.position.toArray()")
    np.testing.assert_allclose(at, hand, atol=1e-3)


@needs_chromium
def test_a_compared_motion_is_a_translucent_robot(
    motion: Trajectory, tmp_path: Path, other_tab: Tab
) -> None:
    tab = other_tab
    other = cubic_motion(Scene(motion.robot, [Gravity(9.81)]), seed=5)[0]  # type: ignore[arg-type]
    shown = replay(motion, compare=[other], html=tmp_path / "two.html")
    assert len(shown.ghosts) == 1
    tab.open((tmp_path / "two.html").as_uri())
    tab.until("viewer.animator.actions.length > 0")
    seek(tab, 0.5 * motion.duration)
    both = tab.screenshot()
    tab.value("viewer.set_property(['meshcat', 'ghost 1'], 'visible', false); viewer.render(); 1")
    assert (np.abs(both - tab.screenshot()).max(axis=2) > 20).mean() > 5e-4
    labels = boxes(tab, ".motion")
    assert len(labels) == 2
    assert not overlapping(labels)
    assert tab.value("document.querySelectorAll('#torque .other').length") == 5


def test_a_payload_is_drawn_where_it_is_carried(motion: Trajectory) -> None:
    payloads, robot = Payloads.of(motion), motion.robot
    assert robot is not None
    assert [item[:2] for item in payloads.items] == [(robot.tip_frame, 1.0)]
    visual = payloads.added_to(skeleton(robot.model), robot)
    radius = visual.geometryObjects[-1].geometry.radius
    assert 4 / 3 * np.pi * radius**3 * 500.0 == pytest.approx(1.0)


def test_a_panel_has_no_markup_of_its_text() -> None:
    labels = (("</script><img src=x>", "#000000"),)
    text = Panel(labels=labels).to_json()
    assert "<" not in text
    assert json.loads(text)["motions"][0]["label"] == labels[0][0]


@pytest.mark.parametrize("wrong", [3, ["x"]])
def test_what_is_compared_must_be_motions(motion: Trajectory, wrong: Any) -> None:
    with pytest.raises(InputError, match="motion"):
        replay(motion, compare=wrong)


@needs_chromium
def test_the_slider_follows_when_python_moves_the_robot(two_link: Robot, other_tab: Tab) -> None:
    motion = cubic_motion(Scene(two_link), seed=4)[0]
    with serve(motion, announce=lambda address: None) as shown:
        other_tab.open(shown.url)
        other_tab.until("viewer.animator.actions.length > 0")
        shown.play(speed=20.0)
        at_the_end = f"Math.abs(controls.t - {motion.duration}) < 1e-9"
        other_tab.until(f"{at_the_end} && !viewer.animator.playing")


# Scripts

SCRIPT = """
import sys
sys.path.insert(0, {tests!r})
from hovi.robot.bundled_models import example
from hovi.robot.loading import load_robot
from hovi.scene.scene import Scene
from hovi.viewing.replay_session import replay
from samples.cubic_motion import cubic_motion
motion = cubic_motion(Scene(load_robot(example("two_link.urdf"))))[0]
shown = replay(motion{keywords})
print("after", flush=True)
{then}
"""


def script(tmp_path: Path, keywords: str = "", then: str = "") -> list[str]:
    file = tmp_path / "shown"
    tests = str(Path(__file__).parents[1])
    file.write_text(SCRIPT.format(tests=tests, keywords=keywords, then=then))
    return [sys.executable, str(file)]


def output_until(terminal: int, pattern: str, seconds: float = 60.0) -> str:
    text, deadline = "", time.monotonic() + seconds
    while re.search(pattern, text) is None:
        assert time.monotonic() < deadline, text
        if select.select([terminal], [], [], 0.1)[0]:
            try:
                text += os.read(terminal, 4096).decode()
            except OSError:
                break
    return text


def in_a_terminal(command: list[str]) -> tuple[subprocess.Popen[bytes], int]:
    terminal, inner = pty.openpty()
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "BROWSER")}
    process = subprocess.Popen(
        command, stdin=inner, stdout=inner, stderr=inner, env=environment, start_new_session=True
    )
    os.close(inner)
    return process, terminal


def test_a_script_in_a_terminal_keeps_its_page_until_ctrl_c(tmp_path: Path) -> None:
    process, terminal = in_a_terminal(script(tmp_path))
    try:
        text = output_until(terminal, r"Ctrl-C ends it")
        assert "after" in text  # the script goes on
        address = re.search(r"http://\S+/view/", text)
        assert address is not None
        with urllib.request.urlopen(address[0], timeout=10) as page:
            assert page.status == 200
        assert process.poll() is None
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=60) == 0
    finally:
        process.kill()
        process.wait()
        os.close(terminal)


@pytest.mark.parametrize(
    ("keywords", "then"),
    [(", wait=False", ""), ("", "shown.close()"), ("", "raise SystemError('as it may')")],
)
def test_a_script_in_a_terminal_ends_when_nothing_is_left_to_see(
    tmp_path: Path, keywords: str, then: str
) -> None:
    process, terminal = in_a_terminal(script(tmp_path, keywords, then))
    try:
        output_until(terminal, "after")
        assert process.wait(timeout=30) == (1 if "raise" in then else 0)
    finally:
        process.kill()
        process.wait()
        os.close(terminal)


def test_a_script_without_a_terminal_ends_by_itself(tmp_path: Path) -> None:
    done = subprocess.run(script(tmp_path), capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert "after" in done.stdout
    assert "Ctrl-C" not in done.stdout


def test_nothing_is_drawn_before_all_meshes_are_there(page: Path) -> None:
    """A page that waits between messages draws parts of a robot meanwhile, which takes seconds."""
    handled = page.read_text().partition("for (const numbers of")[2].partition("timeScale")[0]
    assert "viewer.handle_command_bytearray(" in handled
    assert "await" not in handled
