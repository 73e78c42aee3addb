"""A Chromium without a window, driven over its DevTools protocol."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import json
import os
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import tornado.websocket

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
_FLAGS = (
    "--headless --use-angle=swiftshader --enable-unsafe-swiftshader --no-first-run "
    "--disable-background-networking --disable-component-update --disable-sync "
    "--disable-dev-shm-usage --hide-scrollbars --remote-debugging-port=0 --remote-allow-origins=*"
)
_SECONDS = 60.0


class BrowserError(Exception):
    """The browser cannot be started, or does not do what it is asked for."""


class Tab:
    """One page of the browser."""

    def __init__(self, socket: Any, loop: asyncio.AbstractEventLoop) -> None:
        self._socket, self._loop, self._count = socket, loop, 0
        self.call("Page.enable")

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Send a DevTools command and return its answer. Raises BrowserError."""
        self._count += 1
        message = {"id": self._count, "method": method, "params": parameters}
        try:
            answer = self._loop.run_until_complete(asyncio.wait_for(self._ask(message), _SECONDS))
        except TimeoutError:
            raise BrowserError(f"{method} takes more than {_SECONDS:.0f} s") from None
        if "error" in answer:
            raise BrowserError(f"{method}: {answer['error'].get('message')}")
        return dict(answer["result"])

    def value(self, expression: str) -> Any:
        """The value of a JavaScript expression. Raises BrowserError."""
        result = self.call("Runtime.evaluate", expression=expression, returnByValue=True)
        if "exceptionDetails" in result:
            raise BrowserError(result["exceptionDetails"].get("text", "a script failed"))
        return result["result"].get("value")

    def until(self, condition: str) -> None:
        """Wait for a JavaScript condition. Raises BrowserError."""
        deadline = time.monotonic() + _SECONDS
        while not self.value(condition):
            if time.monotonic() > deadline:
                raise BrowserError(f"the page is not ready after {_SECONDS:.0f} s")
            time.sleep(0.05)

    def screenshot(self) -> bytes:
        """The page as a PNG."""
        return base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])

    async def _ask(self, message: dict[str, Any]) -> dict[str, Any]:
        await self._socket.write_message(json.dumps(message))
        while True:
            text = await self._socket.read_message()
            if text is None:
                raise BrowserError("the browser ended")
            answer = json.loads(text)
            if answer.get("id") == message["id"]:
                return dict(answer)


def browser() -> str | None:
    """The path of a Chromium; None without one."""
    return next((path for path in map(shutil.which, NAMES) if path), None)


@contextlib.contextmanager
def headless_tab(size: tuple[int, int]) -> Iterator[Tab]:
    """A page of a browser with a profile of its own, which ends with the block.

    size: width and height, in pixels. Raises BrowserError.
    """
    path = browser()
    if path is None:
        raise BrowserError("there is no Chromium")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        flags = [*_FLAGS.split(), f"--window-size={size[0]},{size[1]}"]
        if os.geteuid() == 0:
            flags.append("--no-sandbox")  # Chromium has none for root
        command = [path, *flags, f"--user-data-dir={profile}", "about:blank"]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        loop = asyncio.new_event_loop()
        try:
            yield Tab(_join(loop, _port(Path(profile), process)), loop)
        except (OSError, tornado.websocket.WebSocketError) as lost:
            raise BrowserError(str(lost)) from lost
        finally:
            process.kill()
            process.wait()
            loop.close()


def _join(loop: asyncio.AbstractEventLoop, port: int) -> Any:
    with urlopen(f"http://127.0.0.1:{port}/json", timeout=_SECONDS) as answer:
        pages = [page for page in json.load(answer) if page["type"] == "page"]

    async def join() -> Any:
        url = pages[0]["webSocketDebuggerUrl"]
        return await tornado.websocket.websocket_connect(url, max_message_size=2**28)

    return loop.run_until_complete(join())


def _port(profile: Path, process: subprocess.Popen[bytes]) -> int:
    file, deadline = profile / "DevToolsActivePort", time.monotonic() + _SECONDS
    while not (file.exists() and file.read_text().strip()):
        if process.poll() is not None or time.monotonic() > deadline:
            raise BrowserError("Chromium does not start")
        time.sleep(0.05)
    return int(file.read_text().split()[0])
