from __future__ import annotations

import contextlib
import dataclasses
import http.client
import itertools
import math
import re
import socket
import threading
import webbrowser
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest
import umsgpack

from hovi.discrete.trajectory import Trajectory
from hovi.errors import DisplayError
from hovi.planning.problem.limits import as_limits
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.robot.urdf.planar_chain import chain
from hovi.scene.scene import Scene
from hovi.viewing import replay_session
from hovi.viewing.highlights import _without_short_gaps
from hovi.viewing.replay_session import Replay, replay
from hovi.viewing.skeleton import skeleton
from oracles.headless_browser import CHROMIUM, Tab, headless_browser
from oracles.offline_pages import messages_of
from samples.cubic_motion import cubic_motion

Array = npt.NDArray[np.float64]

needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")


@pytest.fixture(scope="module")
def motion(two_link: Robot) -> Trajectory:
    return cubic_motion(Scene(two_link), seed=4)[0]


def _speed_limit(motion: Trajectory, bound: float) -> dict[str, Any]:
    assert motion.robot is not None
    return as_limits(motion.robot, {"base": "none", "v": {"elbow": bound}}).to_dict()


@pytest.fixture(scope="module")
def limited_motion(motion: Trajectory) -> Trajectory:
    """The same motion with a velocity limit of the elbow that it reaches after 1.3 s."""
    return dataclasses.replace(motion, metadata={"limits": _speed_limit(motion, 5.0)})


@pytest.fixture(scope="module")
def bare_motion(two_link: Robot) -> Trajectory:
    """The same arm as a Pinocchio model without shapes."""
    return cubic_motion(Scene(load_robot(two_link.model)), seed=4)[0]


@pytest.fixture(scope="module")
def tab() -> Iterator[Tab]:
    with headless_browser() as opened:
        yield opened


def quiet(text: str) -> None:
    """Discard the address."""


def messages(page: Path) -> list[dict[str, Any]]:
    """The messages stored in a written page."""
    return messages_of(page.read_text())


def opened(tab: Tab, page: Path) -> None:
    """Open a written page and wait for its scene."""
    tab.open(page.as_uri())
    tab.until("typeof viewer == 'object' && viewer.animator.actions.length > 0")


def seek(tab: Tab, t: float) -> Array:
    """A screenshot of the page's scene alone at time t of its animation, in [s]."""
    tab.value(
        "document.body.classList.add('bare'); stage.resize();"
        f"controls.seek({t}); viewer.render(); 1"
    )
    return tab.screenshot().astype(float)


def colored(picture: Array) -> npt.NDArray[np.bool_]:
    """Pixels that are neither background nor grid nor the path of the tip."""
    blue_or_orange = np.abs(picture[..., 0] - picture[..., 2]) > 60
    return blue_or_orange


def yellow(picture: Array) -> npt.NDArray[np.bool_]:
    """Pixels in the color of links whose joint is at a limit."""
    red, green, blue = np.moveaxis(picture, -1, 0)
    found: npt.NDArray[np.bool_] = (red > 120) & (green > 0.75 * red) & (blue < 0.4 * red)
    return found


# The page in a file


def test_pages_are_reproducible_bit_by_bit(motion: Trajectory, tmp_path: Path) -> None:
    for name in ("1.html", "2.html"):
        replay(motion, html=tmp_path / name)
    assert (tmp_path / "1.html").read_bytes() == (tmp_path / "2.html").read_bytes()
    assert len(list(tmp_path.iterdir())) == 2


def test_a_page_loads_no_external_resource(motion: Trajectory, tmp_path: Path) -> None:
    replay(motion, html=tmp_path / "motion.html")
    text = (tmp_path / "motion.html").read_text()
    assert not re.search(r"<(script|img|link|iframe)[^>]+(src|href)=\"(?!data:)", text)
    assert "default-src 'none'" in text


def test_animation_keyframes_match_forward_kinematics(motion: Trajectory, tmp_path: Path) -> None:
    shown = replay(motion, html=tmp_path / "motion.html")
    (animation,) = (m for m in messages(tmp_path / "motion.html") if m["type"] == "set_animation")
    assert animation["options"] == {"play": True, "repetitions": 1}
    visual = motion.robot.visual  # type: ignore[union-attr]
    assert len(animation["animations"]) == visual.ngeoms
    model, data, shapes = motion.robot.model, motion.robot.model.createData(), visual.createData()  # type: ignore[union-attr]
    tracks = {
        a["path"]: {t["name"]: t["keys"] for t in a["clip"]["tracks"]}
        for a in animation["animations"]
    }
    for item in visual.geometryObjects:
        name = shown.visualizer.getViewerNodeName(item, pin.GeometryType.VISUAL)
        keys = tracks["/meshcat/" + name]
        times = [key["time"] for key in keys[".position"]]
        assert (times[0], times[-1]) == (0.0, motion.duration)
        for i in (0, len(times) // 2, -1):
            q = motion.configurations(times[i])[0]
            pin.updateGeometryPlacements(model, data, visual, shapes, q)
            pose = shapes.oMg[visual.getGeometryId(item.name)]
            rotation = pin.Quaternion(*np.roll(keys[".quaternion"][i]["value"], 1)).matrix()
            np.testing.assert_allclose(keys[".position"][i]["value"], pose.translation, atol=1e-12)
            np.testing.assert_allclose(rotation, pose.rotation, atol=1e-12)


def test_loop_repeats_without_end(motion: Trajectory, tmp_path: Path) -> None:
    replay(motion, html=tmp_path / "motion.html", loop=True, speed=0.5)
    (animation,) = (m for m in messages(tmp_path / "motion.html") if m["type"] == "set_animation")
    assert math.isinf(animation["options"]["repetitions"])
    assert "timeScale = 0.5;" in (tmp_path / "motion.html").read_text()


def visibility(page: Path) -> dict[str, list[dict[str, Any]]]:
    """Keyframes of the visibility tracks, by node path."""
    (animation,) = (m for m in messages(page) if m["type"] == "set_animation")
    return {
        a["path"]: track["keys"]
        for a in animation["animations"]
        for track in a["clip"]["tracks"]
        if track["name"] == ".visible"
    }


def test_links_are_highlighted_while_their_joint_is_at_a_limit(
    limited_motion: Trajectory, tmp_path: Path
) -> None:
    shown = replay(limited_motion, html=tmp_path / "motion.html")
    assert "at a limit" in (tmp_path / "motion.html").read_text()
    robot, highlights = limited_motion.robot, shown.highlights
    assert robot is not None
    assert highlights is not None
    elbow = robot.model.getJointId("elbow")
    assert set(np.flatnonzero(highlights.flags.any(axis=0))) == {elbow}
    tracks = visibility(tmp_path / "motion.html")
    links = [item for item in robot.visual.geometryObjects if item.parentJoint == elbow]  # type: ignore[union-attr]
    assert len(tracks) == 2 * len(links)
    motion = limited_motion.sample(highlights.times)
    at_bound = np.abs(motion.v[:, 1]) >= 5.0 - 1e-3 * 10.0
    at_bound[-1] = False
    np.testing.assert_array_equal(highlights.flags[:, elbow], at_bound)
    for path, keys in tracks.items():
        highlighted = path.endswith("at its limit")
        assert [key["value"] for key in keys] == [not highlighted, highlighted, not highlighted]


def test_no_link_is_highlighted_at_the_end(limited_motion: Trajectory, tmp_path: Path) -> None:
    shown = replay(limited_motion, html=tmp_path / "motion.html")
    assert shown.highlights is not None
    assert not shown.highlights.at(limited_motion.duration).any()


def test_short_gaps_between_highlights_are_closed() -> None:
    flags = np.zeros((60, 1), dtype=bool)
    flags[[10, 14, 15, 19, 40]] = True
    bridged = _without_short_gaps(flags)[:, 0]
    np.testing.assert_array_equal(np.flatnonzero(bridged), [*range(10, 20), 40])
    edges = np.ones((5, 1), dtype=bool)
    np.testing.assert_array_equal(_without_short_gaps(edges), edges)


def test_a_motion_never_at_a_limit_has_no_highlights(motion: Trajectory, tmp_path: Path) -> None:
    far = dataclasses.replace(motion, metadata={"limits": _speed_limit(motion, 1e3)})
    for name, trajectory in (("1.html", motion), ("2.html", far)):
        assert replay(trajectory, html=tmp_path / name).highlights is None
    assert messages(tmp_path / "1.html") == messages(tmp_path / "2.html")


def test_a_replay_is_shown_as_one_line(motion: Trajectory, tmp_path: Path) -> None:
    shown = repr(replay(motion, html=tmp_path / "motion.html"))
    assert re.fullmatch(r"Replay of '\w+', [\d.]+ s, at file://\S+motion.html", shown)


def test_the_trace_is_the_path_of_the_tip(motion: Trajectory, tmp_path: Path) -> None:
    replay(motion, html=tmp_path / "with.html")
    replay(motion, html=tmp_path / "without.html", trace=False)
    (drawn,) = (m for m in messages(tmp_path / "with.html") if m["path"] == "/meshcat/trace")
    (geometry,) = drawn["object"]["geometries"]
    points = geometry["data"]["attributes"]["position"]["array"]
    points = np.frombuffer(points.data, np.float32).reshape(-1, 3)
    ends = motion.robot.frame_position("tip", motion.q[[0, -1]])  # type: ignore[union-attr]
    np.testing.assert_allclose(points[[0, -1]], ends, atol=1e-6)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert steps.max() < 1.1 * steps.mean()  # a line where the tip is fast, too
    assert not [m for m in messages(tmp_path / "without.html") if "trace" in m["path"]]


def test_a_failed_write_leaves_the_old_page(
    motion: Trajectory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = tmp_path / "motion.html"
    page.write_text("before")
    with pytest.raises(DisplayError, match="No such file or directory"):
        replay(motion, html=tmp_path / "no" / "motion.html")

    def fail(self: Path, target: Path) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", fail)
    with pytest.raises(DisplayError, match="No space left on device"):
        replay(motion, html=page)
    assert page.read_text() == "before"
    assert list(tmp_path.iterdir()) == [page]


def test_a_robot_without_shapes_is_drawn_as_a_skeleton(two_link: Robot) -> None:
    names = [item.name for item in skeleton(two_link.model).geometryObjects]
    assert [name.split("_")[0] for name in names] == ["sphere", "sphere", "cylinder", "cylinder"]
    bars = skeleton(two_link.model).geometryObjects[2:]
    np.testing.assert_allclose([2 * bar.geometry.halfLength for bar in bars], [1.5, 1.0])


@pytest.mark.parametrize("links", [1, 5])
def test_the_skeleton_of_a_chain_reaches_its_tip(links: int, tmp_path: Path) -> None:
    (tmp_path / "chain.urdf").write_text(chain(links))
    robot = load_robot(tmp_path / "chain.urdf")
    geometry = skeleton(robot.model)
    data, shapes = robot.model.createData(), geometry.createData()
    q = np.linspace(0.3, 0.9, links)
    pin.updateGeometryPlacements(robot.model, data, geometry, shapes, q)
    last = geometry.geometryObjects[-1].geometry
    ends = [shapes.oMg[-1].act(np.array([0, 0, z * last.halfLength])) for z in (-1, 1)]
    tip = robot.frame_position(robot.tip_frame, q[None])[0]
    assert min(np.linalg.norm(end - tip) for end in ends) < 1e-12


def test_the_page_names_missing_meshes(tmp_path: Path) -> None:
    mesh = '<visual><geometry><mesh filename="gone.stl"/></geometry></visual>'
    (tmp_path / "arm.urdf").write_text(chain(1).replace("<inertial>", f"{mesh}<inertial>", 1))
    trajectory, _ = cubic_motion(Scene(load_robot(tmp_path / "arm.urdf")))
    replay(trajectory, html=tmp_path / "motion.html")
    assert "gone.stl" in (tmp_path / "motion.html").read_text()


def test_a_motion_without_its_robot_cannot_be_shown(
    bare_motion: Trajectory, tmp_path: Path
) -> None:
    bare_motion.save(tmp_path / "motion.npz")
    with pytest.raises(DisplayError, match="without its robot"):
        replay(Trajectory.load(tmp_path / "motion.npz"))


@pytest.mark.parametrize("speed", [0.0, -1.0, np.nan, np.inf])
def test_an_invalid_speed_raises(motion: Trajectory, speed: float) -> None:
    with pytest.raises(DisplayError, match="speed"):
        replay(motion, speed=speed)


# The live page


class Clock:
    """A fake clock that advances in `sleep`, and by 0.1 ms per reading."""

    def __init__(self) -> None:
        self.now = 100.0

    def monotonic(self) -> float:
        self.now += 1e-4
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds


@pytest.mark.parametrize("speed", [0.25, 1.0, 4.0])
def test_playback_runs_in_real_time_and_ends_at_the_goal(
    motion: Trajectory, monkeypatch: pytest.MonkeyPatch, speed: float
) -> None:
    clock, shown = Clock(), []

    class Display:
        def display(self, q: Array) -> None:
            shown.append((clock.now - 100.0, q))

    monkeypatch.setattr(replay_session, "time", clock)
    player = Replay(motion, Display(), "", None)  # type: ignore[arg-type]
    player.play(speed=speed)
    assert len(shown) == pytest.approx(60 * motion.duration / speed, abs=3)
    for elapsed, q in shown[:-1]:
        t = min(elapsed * speed, motion.duration)
        np.testing.assert_allclose(q, motion.configurations(t)[0], atol=2e-3 * speed)
    np.testing.assert_array_equal(shown[-1][1], motion.configurations(motion.duration)[0])
    assert shown[-1][0] == pytest.approx(motion.duration / speed, abs=0.02)


def test_playback_shows_and_hides_highlights(limited_motion: Trajectory, tmp_path: Path) -> None:
    shown = replay(limited_motion, html=tmp_path / "motion.html")
    assert shown.highlights is not None
    during = float(shown.highlights.times[shown.highlights.flags.any(axis=1)].mean())

    def hidden() -> int:
        drawn = [umsgpack.unpackb(message.packed) for message in shown.page.messages.all()]
        flags = [
            m["value"] for m in drawn if m.get("property") == "visible" and "/visuals/" in m["path"]
        ]
        assert len(flags) == 2 * flags.count(False)
        copies = [m["value"] for m in drawn if m["path"].endswith("at its limit") and "value" in m]
        return copies.count(False)

    shown.highlights.show(shown.visualizer, during)
    assert hidden() == 0
    shown.highlights.show(shown.visualizer, limited_motion.duration)
    assert hidden() > 0


def test_loop_plays_until_interrupted(motion: Trajectory, monkeypatch: pytest.MonkeyPatch) -> None:
    starts = []

    class Display:
        def display(self, q: Array) -> None:
            starts.extend([q] if (q == motion.q[0]).all() else [])
            if len(starts) == 3:
                raise KeyboardInterrupt

    monkeypatch.setattr(replay_session, "time", Clock())
    Replay(motion, Display(), "", None).play(loop=True)  # type: ignore[arg-type]
    assert len(starts) == 3


def servers() -> set[threading.Thread]:
    """The threads of servers; other tests may have left some."""
    return {thread for thread in threading.enumerate() if thread.name == "hovi-viewer"}


def test_a_live_page_is_served_on_the_loopback_interface_only(motion: Trajectory) -> None:
    addresses, before = list[str](), servers()
    with replay(motion, speed=100, announce=addresses.append) as shown:
        assert addresses == [shown.url]
        assert len(servers() - before) == 1
        found = re.fullmatch(r"http://127\.0\.0\.1:(\d+)/view/", shown.url)
        assert found is not None
        with socket.socket() as other:  # free unless the server listens everywhere
            other.bind(("127.0.0.2", int(found[1])))
    assert not servers() - before
    shown.close()


def test_connections_from_pages_of_other_sites_are_refused(motion: Trajectory) -> None:
    def status(address: str, origin: str) -> int:
        headers = {"Upgrade": "websocket", "Connection": "Upgrade", "Origin": origin}
        headers |= {"Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==", "Sec-WebSocket-Version": "13"}
        with contextlib.closing(http.client.HTTPConnection(address)) as connection:
            connection.request("GET", "/", headers=headers)
            with connection.getresponse() as response:
                return response.status

    with replay(motion, speed=100, announce=quiet) as shown:
        address = shown.url.removeprefix("http://").removesuffix("/view/")
        assert status(address, f"http://{address}") == 101
        assert status(address, "http://example.org") == 403


def test_an_unavailable_or_invalid_port_raises(motion: Trajectory) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        with pytest.raises(DisplayError, match=f"port {port}"):
            replay(motion, port=port)
    with pytest.raises(DisplayError, match="not 99999"):
        replay(motion, port=99999)


def test_a_missing_browser_raises_and_stops_the_server(
    motion: Trajectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = servers()
    monkeypatch.setattr(webbrowser, "open", lambda url, new: False)
    with pytest.raises(DisplayError, match="no browser could be started; open http"):
        replay(motion, open_browser=True, announce=quiet)
    monkeypatch.setattr(webbrowser, "open", lambda url, new: True)
    monkeypatch.setattr(replay_session, "_BROWSER_TIMEOUT", 0.1)
    with pytest.raises(DisplayError, match="no browser showed the page"):
        replay(motion, open_browser=True, announce=quiet)
    assert not servers() - before


def test_a_notebook_shows_the_page(motion: Trajectory, tmp_path: Path) -> None:
    with replay(motion, speed=100, announce=quiet) as shown:
        assert '<iframe srcdoc="&lt;!DOCTYPE' in shown._repr_html_()
        assert "127.0.0.1" not in shown._repr_html_()
    written = replay(motion, html=tmp_path / "motion.html")
    assert written.url == (tmp_path / "motion.html").as_uri()
    assert '<iframe srcdoc="&lt;!DOCTYPE' in written._repr_html_()


# In a browser


@needs_chromium
def test_a_page_plays_offline(motion: Trajectory, tmp_path: Path, tab: Tab) -> None:
    replay(motion, html=tmp_path / "motion.html", trace=False)
    tab.requests.clear()
    opened(tab, tmp_path / "motion.html")
    first, last = seek(tab, 0.0), seek(tab, motion.duration)
    for picture in (first, last):
        assert 0.002 < colored(picture).mean() < 0.3
    assert (colored(first) != colored(last)).mean() > 0.002
    assert all(url.startswith(("file:", "data:")) for url in tab.requests), tab.requests
    assert not tab.errors


@needs_chromium
def test_a_link_at_its_limit_is_yellow_on_the_page(
    limited_motion: Trajectory, tmp_path: Path, tab: Tab
) -> None:
    shown = replay(limited_motion, html=tmp_path / "motion.html", trace=False)
    assert shown.highlights is not None
    during = float(shown.highlights.times[shown.highlights.flags.any(axis=1)].mean())
    opened(tab, tmp_path / "motion.html")
    shares = [yellow(seek(tab, t)).mean() for t in (0.0, during, limited_motion.duration)]
    assert shares[1] > 1e-3
    assert max(shares[0], shares[2]) < 1e-4
    assert not tab.errors


@needs_chromium
def test_a_page_autoplays_and_stops_at_the_goal(
    motion: Trajectory, tmp_path: Path, tab: Tab
) -> None:
    replay(motion, html=tmp_path / "motion.html", speed=4.0)
    opened(tab, tmp_path / "motion.html")
    tab.until("!viewer.animator.playing")
    node = "viewer.scene_tree.find(['meshcat', 'robot', 'visuals', 'tip_0']).object.position"
    tip = motion.robot.frame_position("tip", motion.q[-1:])[0]  # type: ignore[union-attr]
    np.testing.assert_allclose(tab.value(f"{node}.toArray()"), tip, atol=1e-6)


@needs_chromium
def test_a_skeleton_is_visible(bare_motion: Trajectory, tmp_path: Path, tab: Tab) -> None:
    replay(bare_motion, html=tmp_path / "motion.html", trace=False)
    opened(tab, tmp_path / "motion.html")
    assert colored(seek(tab, 1.0)).mean() > 0.002
    assert not tab.errors


@needs_chromium
def test_meshes_with_several_materials_are_drawn(tmp_path: Path, tab: Tab) -> None:
    """The UR5's shoulder has two parts, one with two materials, which plain meshcat hides."""
    robot = load_robot("ur5")
    replay(cubic_motion(Scene(robot))[0], html=tmp_path / "ur5.html")
    opened(tab, tmp_path / "ur5.html")
    meshes = tab.value(
        "Object.values(viewer.scene_tree.find(['meshcat', 'robot', 'visuals']).children)"
        ".map(n => n.children['<object>'].object).map(o => [o.geometry.attributes.position.count,"
        "[o.material].flat().every(m => m.isMaterial)])"
    )
    assert len(meshes) == robot.visual.ngeoms  # type: ignore[union-attr]
    assert all(count > 1000 and whole for count, whole in meshes)
    assert np.abs(seek(tab, 0.0) - seek(tab, 2.0)).max(axis=2).mean() > 1.0


@needs_chromium
def test_a_live_replay_moves_in_the_browser(motion: Trajectory, tab: Tab) -> None:
    with replay(motion, speed=0.1, trace=False, announce=quiet) as shown:
        tab.open(shown.url)
        tab.until("viewer.animator.playing && controls.t > 0")
        pictures = [tab.screenshot().astype(float)]
        tab.until(f"controls.t > {0.1 * motion.duration} + {tab.value('controls.t')}")
        pictures.append(tab.screenshot().astype(float))
        pictures.append(seek(tab, motion.duration))
        for before, after in itertools.pairwise(pictures):
            assert colored(before).mean() > 0.002
            assert (colored(before) != colored(after)).mean() > 0.001
        tab.open(shown.url)  # browsers opened later play the motion, too
        tab.until("viewer.animator.playing")
    assert not tab.errors


@needs_chromium
@pytest.mark.parametrize("size", [0.01, 1.0, 30.0])
def test_robots_of_any_size_fill_the_picture(
    two_link: Robot, tmp_path: Path, tab: Tab, size: float
) -> None:
    text = Path(two_link.source.folder, two_link.source.reference).read_text()

    def scaled(match: re.Match[str]) -> str:
        numbers = " ".join(repr(size * float(x)) for x in match[2].split())
        return f'{match[1]}="{numbers}"'

    text = re.sub(r"(?<!axis )\b(xyz|radius|length)=\"([^\"]+)\"", scaled, text)
    (tmp_path / "arm.urdf").write_text(text)
    trajectory, _ = cubic_motion(Scene(load_robot(tmp_path / "arm.urdf")), seed=4)
    replay(trajectory, html=tmp_path / "arm.html", trace=False)
    opened(tab, tmp_path / "arm.html")
    rows, columns = np.nonzero(colored(seek(tab, 0.0)))
    assert np.ptp(rows) > 60 or np.ptp(columns) > 60
    assert 0.002 < len(rows) / (800 * 457) < 0.3
