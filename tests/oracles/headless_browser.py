"""A headless Chromium for the tests, driven over its DevTools protocol by Tornado's client."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import io
import json
import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import numpy as np
import numpy.typing as npt
import tornado.websocket
from PIL import Image

CHROMIUM = next(
    (p for p in map(shutil.which, ("chromium", "chromium-browser", "google-chrome")) if p), None
)
_FLAGS = (
    "--headless --no-sandbox --use-angle=swiftshader --enable-unsafe-swiftshader "
    "--disable-background-networking --no-first-run --disable-component-update --disable-sync "
    "--disable-dev-shm-usage --hide-scrollbars --remote-debugging-port=0 --remote-allow-origins=*"
)
_SECONDS = 60.0


class Tab:
    """One page of the browser."""

    def __init__(self, socket: Any, loop: asyncio.AbstractEventLoop) -> None:
        self._socket, self._loop, self._count = socket, loop, 0
        self.requests: list[str] = []
        self.errors: list[str] = []
        for domain in ("Page", "Network", "Runtime", "Log"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Send a DevTools command and return its answer; events in between are recorded."""
        self._count += 1
        message = {"id": self._count, "method": method, "params": parameters}
        answer = self._loop.run_until_complete(asyncio.wait_for(self._ask(message), _SECONDS))
        assert "error" not in answer, answer
        return dict(answer["result"])

    def open(self, url: str) -> None:
        """Go to a page and wait until its meshcat viewer has drawn something."""
        self.call("Page.navigate", url=url)
        ready = "typeof viewer == 'object' && viewer.scene_tree.children['meshcat'] !== undefined"
        self.until(ready)

    def until(self, condition: str) -> None:
        """Wait for a JavaScript condition."""
        deadline = time.monotonic() + _SECONDS
        while not self.value(condition):
            assert time.monotonic() < deadline, f"{condition}: {self.errors}"
            time.sleep(0.05)

    def value(self, expression: str) -> Any:
        """The value of a JavaScript expression."""
        result = self.call(
            "Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True
        )
        assert "exceptionDetails" not in result, result
        return result["result"].get("value")

    def screenshot(self, path: Path | None = None) -> npt.NDArray[np.int16]:
        """A screenshot of the page, shape (height, width, 3)."""
        data = base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])
        if path is not None:
            path.write_bytes(data)
        return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"), dtype=np.int16)

    def _note(self, event: dict[str, Any]) -> None:
        parameters = event.get("params", {})
        if event.get("method") == "Network.requestWillBeSent":
            self.requests.append(parameters["request"]["url"])
        if event.get("method") == "Runtime.exceptionThrown":
            self.errors.append(str(parameters["exceptionDetails"]))
        if event.get("method") == "Log.entryAdded" and parameters["entry"]["level"] == "error":
            self.errors.append(parameters["entry"]["text"])

    async def _ask(self, message: dict[str, Any]) -> dict[str, Any]:
        await self._socket.write_message(json.dumps(message))
        while True:
            answer = json.loads(await self._socket.read_message())
            if answer.get("id") == message["id"]:
                return dict(answer)
            self._note(answer)


@contextlib.contextmanager
def headless_browser(
    profile: Path, size: tuple[int, int] = (800, 600), names: str = ""
) -> Iterator[Tab]:
    """A browser with a fresh profile in the folder `profile`, closed at the end.

    names: rules by which it resolves names of hosts, such as "MAP other.test 127.0.0.1".
    """
    assert CHROMIUM is not None
    window = f"--window-size={size[0]},{size[1]}"
    flags = [*_FLAGS.split(), window, f"--user-data-dir={profile}"]
    if names:
        flags.append(f"--host-resolver-rules={names}")
    command = [CHROMIUM, *flags, "about:blank"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    loop = asyncio.new_event_loop()
    try:
        port = _debugging_port(profile, process)
        with urlopen(f"http://127.0.0.1:{port}/json") as answer:
            pages = [page for page in json.load(answer) if page["type"] == "page"]
        connect = tornado.websocket.websocket_connect
        url = pages[0]["webSocketDebuggerUrl"]

        async def join() -> Any:
            return await connect(url, max_message_size=2**28)

        async def leave(socket: Any) -> None:
            socket.close()
            await asyncio.sleep(0.1)

        socket = loop.run_until_complete(join())
        yield Tab(socket, loop)
        loop.run_until_complete(leave(socket))
    finally:
        process.terminate()
        process.wait(timeout=20)
        loop.close()


def _debugging_port(profile: Path, process: subprocess.Popen[bytes]) -> int:
    file, deadline = profile / "DevToolsActivePort", time.monotonic() + _SECONDS
    while not (file.exists() and file.read_text().strip()):
        assert process.poll() is None, "Chromium ended at once"
        assert time.monotonic() < deadline, "Chromium did not start"
        time.sleep(0.05)
    return int(file.read_text().split()[0])
