"""A headless Chromium for the tests, driven as by films, which records requests and errors."""

from __future__ import annotations

import base64
import contextlib
import io
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

from hovi.exchange.film import headless_browser as film

CHROMIUM = film.browser()
_SECONDS = 60.0


class Tab:
    """One page of the browser."""

    def __init__(self, tab: film.Tab) -> None:
        self._tab = tab
        self.requests: list[str] = []
        self.errors: list[str] = []
        tab.hear(self._note)
        for domain in ("Network", "Runtime", "Log"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Send a DevTools command and return its answer; events in between are recorded."""
        return self._tab.call(method, **parameters)

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


@contextlib.contextmanager
def headless_browser(size: tuple[int, int] = (800, 600), names: str = "") -> Iterator[Tab]:
    """A browser with a fresh profile, closed at the end.

    names: rules by which it resolves names of hosts, such as "MAP other.test 127.0.0.1".
    """
    with film.headless_tab(size, [f"--host-resolver-rules={names}"] if names else []) as tab:
        yield Tab(tab)
