"""The live page: whom it answers, what it may load, and what waits for browsers that are slow."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import http.client
import logging
import os
import select
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import tornado.websocket
import umsgpack

from hovi.discrete.trajectory import Trajectory
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.viewing import meshcat_server
from hovi.viewing.meshcat_page import Message, Messages
from hovi.viewing.meshcat_server import MAX_BROWSERS, ServedPage
from hovi.viewing.replay_session import Replay, replay
from oracles.headless_browser import CHROMIUM, Tab, headless_browser
from samples.cubic_motion import cubic_motion
from samples.meshes import mesh_arm, textured

needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")


@pytest.fixture(scope="module")
def motion(two_link: Robot) -> Trajectory:
    return cubic_motion(Scene(two_link), seed=4)[0]


@pytest.fixture
def shown(motion: Trajectory) -> Iterator[Replay]:
    """A page of the motion, which has been played."""
    with replay(motion, speed=100, announce=lambda address: None) as page:
        yield page


@pytest.fixture(scope="module")
def tab() -> Iterator[Tab]:
    with headless_browser(names="MAP other.test 127.0.0.1") as opened:
        yield opened


def port_of(shown: Replay) -> int:
    return int(shown.url.split(":")[2].split("/")[0])


def upgrade(host: str, origin: str = "") -> dict[str, str]:
    """The headers of a browser that asks for the messages."""
    headers = {"Host": host, "Upgrade": "websocket", "Connection": "Upgrade"}
    key = base64.b64encode(os.urandom(16)).decode()
    headers |= {"Sec-WebSocket-Key": key, "Sec-WebSocket-Version": "13"}
    return headers | ({"Origin": origin} if origin else {})


def answer(shown: Replay, path: str, headers: dict[str, str], body: bytes = b"") -> tuple[int, str]:
    """Status and text of the answer to a request."""
    with contextlib.closing(http.client.HTTPConnection("127.0.0.1", port_of(shown))) as connection:
        connection.request("POST" if body else "GET", path, body or None, headers)
        with connection.getresponse() as response:
            return response.status, "" if response.status == 101 else response.read().decode()


def silent_browser(port: int) -> socket.socket:
    """A browser that asks for the messages and takes none of them."""
    browser = socket.create_connection(("127.0.0.1", port), timeout=60)
    ask_for_messages(browser, port)
    return browser


def ask_for_messages(browser: socket.socket, port: int) -> None:
    """Send the request of a browser for the messages."""
    lines = [f"{name}: {value}" for name, value in upgrade(f"127.0.0.1:{port}").items()]
    browser.sendall("\r\n".join(["GET / HTTP/1.1", *lines, "", ""]).encode())


def rest_of(browser: socket.socket) -> bytes:
    """All that arrives until the server ends the connection."""
    parts = []
    with contextlib.suppress(ConnectionResetError):
        while part := browser.recv(2**16):
            parts.append(part)
    return b"".join(parts)


def until(condition: object) -> None:
    """Wait for a condition."""
    deadline = time.monotonic() + 60
    while not condition():  # type: ignore[operator]
        assert time.monotonic() < deadline
        time.sleep(0.01)


# Whom it answers


@pytest.mark.parametrize("path", ["/view/", "/view/main.min.js", "/", "/nothing"])
@pytest.mark.parametrize("host", ["other.test:{}", "other.test", "127.0.0.1.other.test:{}", "x"])
def test_requests_that_name_another_host_are_refused(shown: Replay, path: str, host: str) -> None:
    """A site whose name leads to this machine sends its own name, and an origin that matches it."""
    named = host.format(port_of(shown))
    for headers in ({"Host": named}, upgrade(named, f"http://{named}")):
        status, text = answer(shown, path, headers)
        assert status == 403
        assert text == "This page is served to 127.0.0.1 and localhost only.\n"


@pytest.mark.parametrize("origin", ["http://[::1", "http://other.test", "null", "://", "x"])
def test_an_origin_that_is_not_the_page_is_refused_in_silence(
    shown: Replay, origin: str, capsys: pytest.CaptureFixture[str], caplog: pytest.LogCaptureFixture
) -> None:
    """An origin that is no address was a traceback."""
    assert answer(shown, "/", upgrade(f"127.0.0.1:{port_of(shown)}", origin))[0] == 403
    assert capsys.readouterr().err == ""
    assert [record for record in caplog.records if record.levelno >= logging.WARNING] == []


@pytest.mark.parametrize("host", ["127.0.0.1:{}", "localhost:{}", "localhost:8000", "LOCALHOST"])
def test_requests_that_name_this_machine_are_answered(shown: Replay, host: str) -> None:
    named = host.format(port_of(shown))
    status, text = answer(shown, "/view/", {"Host": named})
    assert status == 200
    assert f"ws://{named}" in text
    assert answer(shown, "/", upgrade(named, f"http://{named}"))[0] == 101


@needs_chromium
def test_a_site_whose_name_leads_here_cannot_read_the_page(shown: Replay, tab: Tab) -> None:
    tab.call("Page.navigate", url=shown.url.replace("127.0.0.1", "other.test"))
    tab.until("document.readyState == 'complete' && location.host.startsWith('other.test')")
    assert "localhost only" in tab.value("document.body.innerText")
    opened = "new Promise(done => { const s = new WebSocket(`ws://${location.host}`);"
    opened += "s.onopen = () => done(true); s.onerror = () => done(false); })"
    assert not tab.value(opened)


def test_a_request_with_a_body_is_refused_before_the_body_is_sent(shown: Replay) -> None:
    with socket.create_connection(("127.0.0.1", port_of(shown)), timeout=10) as connection:
        connection.sendall(b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 90000\r\n\r\n")
        assert connection.recv(100).startswith(b"HTTP/1.1 4")


# What the page may load


@contextlib.contextmanager
def other_server() -> Iterator[tuple[str, list[str]]]:
    """The address of a server elsewhere, and the paths that were asked of it."""
    asked: list[str] = []

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            asked.append(self.path)
            self.send_response(200)
            self.send_header("Access-Control-Allow-Origin", "*")
            self.end_headers()

        def log_message(self, *args: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_port}", asked
        finally:
            server.shutdown()
            thread.join()


WAYS_OUT = {
    "fetch": "fetch('{}/fetch', {{mode: 'no-cors'}}).then(() => 1, () => 0)",
    "an image": "new Promise(done => {{ const i = new Image(); i.onload = () => done(1);"
    "i.onerror = () => done(0); i.src = '{}/image'; }})",
    "a script": "new Promise(done => {{ const s = document.createElement('script');"
    "s.onload = () => done(1); s.onerror = () => done(0); s.src = '{}/script';"
    "document.body.append(s); }})",
    "a frame": "new Promise(done => {{ const f = document.createElement('iframe');"
    "f.onload = () => done(0); f.src = '{}/frame'; document.body.append(f);"
    "setTimeout(() => done(0), 500); }})",
    "a socket": "new Promise(done => {{ const s = new WebSocket('{}/socket'.replace('http', 'ws'));"
    "s.onopen = () => done(1); s.onerror = () => done(0); s.onclose = () => done(0); }})"
    ".catch(() => 0)",
}


@needs_chromium
@pytest.mark.parametrize("way", WAYS_OUT)
@pytest.mark.parametrize("live", [True, False])
def test_a_page_reaches_no_other_server(
    motion: Trajectory, tab: Tab, tmp_path: Path, live: bool, way: str
) -> None:
    page = None if live else tmp_path / "page.html"
    with (
        replay(motion, speed=100, html=page, announce=lambda address: None) as shown,
        other_server() as (address, asked),
    ):
        tab.open(shown.url)
        tab.value(WAYS_OUT[way].format(address))
        assert asked == []


@needs_chromium
def test_the_other_server_hears_of_requests_that_are_not_prevented(tab: Tab) -> None:
    with other_server() as (page, _), other_server() as (address, asked):
        tab.call("Page.navigate", url=f"{page}/")
        tab.until(f"location.href == '{page}/' && document.readyState == 'complete'")
        for way in WAYS_OUT.values():
            tab.value(way.format(address))
        assert sorted(asked) == ["/fetch", "/frame", "/image", "/script", "/socket"]


@needs_chromium
@pytest.mark.parametrize("namespace", [True, False])
def test_a_mesh_asks_nothing_of_another_server(tmp_path: Path, tab: Tab, namespace: bool) -> None:
    """Given as geometry, so that the names in the mesh are not checked."""
    with other_server() as (address, asked):
        text = textured(f"{address}/wood.png")
        if not namespace:
            text = text.replace('xmlns="http://www.collada.org/2005/11/COLLADASchema"', "")
        (tmp_path / "rod.dae").write_text(text)
        urdf = mesh_arm(tmp_path, f"file://{tmp_path / 'rod.dae'}")
        model = pin.buildModelFromUrdf(str(urdf))
        visual = pin.buildGeomFromUrdf(model, str(urdf), pin.GeometryType.VISUAL)
        trajectory = cubic_motion(Scene(load_robot(model, visual=visual)))[0]
        with (
            contextlib.nullcontext() if not namespace else pytest.warns(UserWarning, match="wood"),
            replay(trajectory, speed=100, announce=lambda address: None) as shown,
        ):
            tab.open(shown.url)
            tab.until("viewer.animator.actions.length > 0")
            time.sleep(0.3)
        assert asked == []


@needs_chromium
@pytest.mark.parametrize("name", ["127.0.0.1", "localhost"])
def test_a_live_page_connects_under_both_names(shown: Replay, tab: Tab, name: str) -> None:
    tab.errors.clear()
    tab.open(shown.url.replace("127.0.0.1", name))
    assert not tab.errors


# What waits for browsers

SCRIPT = """
import sys, time
sys.path.insert(0, {tests!r})
from hovi.robot.bundled_models import example
from hovi.robot.loading import load_robot
from hovi.scene.scene import Scene
from hovi.viewing.replay_session import replay
from samples.cubic_motion import cubic_motion
from viewing.test_meshcat_server import Message, port_of, silent_browser, until

def memory():
    return int(open("/proc/self/statm").read().split()[1]) * 4096

def shown(robot):
    trajectory = cubic_motion(Scene(load_robot(robot)))[0]
    return replay(trajectory, speed=100, announce=lambda address: None)
"""
FRAMES = """
with shown("ur5") as page:
    page.page.messages.add(Message("/large", "set_object", "", b"x" * 4_000_000))
    before = memory()
    browsers = [silent_browser(port_of(page)) for _ in range(48)]
    until(lambda: len(page.page._browsers) > 10)
    for _ in range(40):
        page.play(speed=40)
    print(sum(len(message.packed) for message in page.page.messages.all()), memory() - before)
"""
LARGE = """
with shown(example("two_link.urdf")) as page:
    browsers = [silent_browser(port_of(page)) for _ in range(10)]
    until(lambda: len(page.page._browsers) == 10)
    message = Message("/large", "set_object", "", b"x" * 50_000_000)
    before = memory()
    page.page._loop.call_soon_threadsafe(page.page._broadcast, message)
    until(lambda: memory() > before + len(message.packed))
    time.sleep(2.0)
    print(len(message.packed), memory() - before)
"""


def content_and_memory(code: str) -> tuple[int, int]:
    """Bytes that were to be sent, and how much the memory of a process grew."""
    code = SCRIPT.format(tests=str(Path(__file__).parents[1])) + code
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=True)
    assert done.stderr == ""
    content, more = map(int, done.stdout.split())
    return content, more


def test_browsers_that_take_nothing_do_not_fill_the_memory() -> None:
    content, more = content_and_memory(FRAMES)
    assert content > 5e6  # which 48 browsers had in their queues, and each motion besides
    assert more < 4 * content


def test_few_copies_of_a_large_message_are_in_memory() -> None:
    content, more = content_and_memory(LARGE)
    assert more < 5 * content  # ten browsers


def test_a_slow_browser_gets_the_end_of_the_motion_and_not_every_frame(shown: Replay) -> None:
    frames = 3_000
    q = shown.trajectory.configurations(np.linspace(0.0, shown.trajectory.duration, frames))

    async def received() -> list[bytes]:
        browser = await tornado.websocket.websocket_connect(shown.url[:-5].replace("http", "ws"))
        await asyncio.to_thread(lambda: [shown.visualizer.display(each) for each in q])
        last = {message.packed for message in shown.page.messages.all()}
        messages = []
        while last:
            messages.append(await browser.read_message())
            last.discard(messages[-1])
        browser.close()
        while await browser.read_message() is not None:
            pass
        return messages

    page = shown.page
    assert isinstance(page, ServedPage)
    messages = asyncio.run(asyncio.wait_for(received(), 60))
    final: dict[str, object] = {}
    for message in map(umsgpack.unpackb, messages):
        if message["type"] == "set_transform":
            final[message["path"]] = message["matrix"]
    kept = {
        message.path: umsgpack.unpackb(message.packed)["matrix"]
        for message in page.messages.all()
        if message.kind == "set_transform"
    }
    assert final == kept


def test_deletions_are_sent_to_browsers(shown: Replay) -> None:
    async def received() -> list[bytes]:
        browser = await tornado.websocket.websocket_connect(shown.url[:-5].replace("http", "ws"))
        for _ in shown.page.messages.all():
            await browser.read_message()
        shown.visualizer.viewer["/meshcat/robot"].delete()
        messages = [await browser.read_message()]
        browser.close()
        while await browser.read_message() is not None:
            pass
        return messages

    (message,) = map(umsgpack.unpackb, asyncio.run(asyncio.wait_for(received(), 60)))
    assert (message["type"], message["path"]) == ("delete", "/meshcat/robot")


def test_a_browser_that_takes_nothing_is_disconnected(
    shown: Replay, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(meshcat_server, "_TAKE_SECONDS", 0.1)
    page = shown.page
    assert isinstance(page, ServedPage)
    browser = silent_browser(port_of(shown))
    until(lambda: page._browsers)
    large = Message("/large", "set_object", "", bytes(50_000_000))
    page._loop.call_soon_threadsafe(page._broadcast, large)
    until(lambda: not page._browsers)
    assert len(rest_of(browser)) < 50_000_000
    browser.close()
    assert not caplog.records


def test_a_page_has_a_limited_number_of_browsers(shown: Replay) -> None:
    page, port = shown.page, port_of(shown)
    assert isinstance(page, ServedPage)
    browsers = [silent_browser(port) for _ in range(MAX_BROWSERS)]
    until(lambda: len(page._browsers) == MAX_BROWSERS)
    with silent_browser(port) as one_more:
        assert b"too many windows show this page" in rest_of(one_more)
    browsers.pop().close()
    until(lambda: len(page._browsers) < MAX_BROWSERS)
    with silent_browser(port):
        until(lambda: len(page._browsers) == MAX_BROWSERS)
    for browser in browsers:
        browser.close()


def test_a_page_has_a_limited_number_of_connections(shown: Replay) -> None:
    connections = [socket.create_connection(("127.0.0.1", port_of(shown))) for _ in range(300)]
    connections[-1].settimeout(10)  # less than idle connections are kept
    assert connections[-1].recv(1) == b""
    ended, _, _ = select.select(connections, [], [], 0.0)
    assert len(ended) > 200
    for connection in connections:
        connection.close()
    until(lambda: shown.page._server._open == 0)  # type: ignore[attr-defined]
    assert answer(shown, "/view/", {"Host": "localhost"})[0] == 200


def test_a_large_message_from_a_browser_ends_its_connection(shown: Replay) -> None:
    browser = silent_browser(port_of(shown))
    browser.sendall(b"\x82\xff" + (10**9).to_bytes(8, "big") + b"mask")
    rest_of(browser)
    browser.close()


def test_closing_a_page_does_not_wait_for_browsers(
    motion: Trajectory, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.DEBUG, "asyncio")
    with replay(motion, speed=100, announce=lambda address: None) as shown:
        page = shown.page
        assert isinstance(page, ServedPage)
        browsers = [silent_browser(port_of(shown)) for _ in range(3)]
        until(lambda: len(page._browsers) == 3)
        large = Message("/large", "set_object", "", bytes(50_000_000))
        page._loop.call_soon_threadsafe(page._broadcast, large)
        until(
            lambda: all(browser.sender and not browser.sender.done() for browser in page._browsers)
        )
    for browser in browsers:
        browser.close()
    assert not [record for record in caplog.records if record.levelno > logging.DEBUG]


def test_a_browser_that_joins_while_the_page_closes_is_disconnected(
    motion: Trajectory, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Connected before, it asks for the messages once the others have left."""
    with replay(motion, speed=100, announce=lambda address: None) as shown:
        page = shown.page
        assert isinstance(page, ServedPage)
        late = socket.create_connection(("127.0.0.1", port_of(shown)), timeout=10)
        until(lambda: page._server._open == 1)
        close, port = page._server.close_all_connections, port_of(shown)

        async def slowly() -> None:
            ask_for_messages(late, port)
            while not page._browsers:
                await asyncio.sleep(0.01)
            await close()

        monkeypatch.setattr(page._server, "close_all_connections", slowly)
    assert not page._browsers
    rest_of(late)  # which is there until the server ends the connection
    late.close()


# The messages


def packed(messages: Messages) -> list[bytes]:
    return [message.packed for message in messages.all()]


@pytest.mark.parametrize("deletions", [True, False])
def test_a_deletion_drops_what_is_inside(deletions: bool) -> None:
    messages = Messages(deletions)
    for path in ("/a", "/a/b", "/ab", "/c"):
        messages.add(Message(path, "set_object", "", path.encode()))
    messages.add(Message("/a", "delete", "", b"gone"))
    messages.add(Message("/a", "set_object", "", b"again"))
    kept = [b"/ab", b"/c", b"gone", b"again"]
    assert packed(messages) == (kept if deletions else [b"/ab", b"/c", b"again"])


def test_the_last_message_of_a_kind_counts_and_messages_are_taken_in_order() -> None:
    messages = Messages()
    for number in range(3):
        messages.add(Message("/a", "set_property", "visible", b"%d" % number))
        messages.add(Message("/a", "set_property", "color", b"c%d" % number))
    assert packed(messages) == [b"2", b"c2"]
    assert [messages.take() for _ in range(3)] == [b"2", b"c2", None]
