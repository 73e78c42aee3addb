"""A Chromium without a window, driven over its DevTools protocol.

The protocol goes through a pair of pipes. Through a port, every user of the machine could drive the
browser, and so read all files that its owner may read.
"""

from __future__ import annotations

import base64
import contextlib
import fcntl
import json
import os
import select
import shutil
import signal
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from hovi.system.files import reason

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
_FLAGS = (
    "--headless --use-angle=swiftshader --enable-unsafe-swiftshader --no-first-run "
    "--disable-background-networking --disable-component-update --disable-sync "
    "--disable-dev-shm-usage --hide-scrollbars --remote-debugging-pipe"
)
_READS, _WRITES = 3, 4
"""The descriptors from which Chromium reads commands, and to which it writes answers."""
_UNUSED = 10
"""Descriptors from here on are not among the two above."""
_SECONDS = 60.0
_END = b"\0"


class BrowserError(Exception):
    """The browser cannot be started, or does not do what it is asked for."""


class _Connection:
    """Commands to a browser and its answers: JSON, each with a NUL at its end.

    heard: called with each event.
    """

    heard: Callable[[dict[str, Any]], object] = staticmethod(lambda event: None)

    def __init__(self, commands: int, answers: int) -> None:
        self._commands, self._answers = commands, answers
        self._count, self._arrived = 0, bytearray()
        os.set_blocking(commands, False)

    def call(self, method: str, parameters: dict[str, Any], session: str = "") -> dict[str, Any]:
        """Send a command and return its answer. session: of a page; "" for the browser itself."""
        self._count += 1
        command = {"id": self._count, "method": method, "params": parameters}
        if session:
            command["sessionId"] = session
        deadline = time.monotonic() + _SECONDS
        try:
            self._send(json.dumps(command).encode() + _END, deadline)
            while (answer := json.loads(self._received(deadline))).get("id") != self._count:
                self.heard(answer)
        except TimeoutError:
            raise BrowserError(f"{method} takes more than {_SECONDS:.0f} s") from None
        except OSError:
            when = "does not start" if self._count == 1 else "ended"
            raise BrowserError(f"Chromium {when}") from None
        if "error" in answer:
            raise BrowserError(f"{method}: {answer['error'].get('message')}")
        return dict(answer["result"])

    def _send(self, content: bytes, deadline: float) -> None:
        rest = memoryview(content)
        while rest:
            _wait(self._commands, select.POLLOUT, deadline)
            rest = rest[os.write(self._commands, rest) :]

    def _received(self, deadline: float) -> bytes:
        """The next message."""
        while (end := self._arrived.find(_END)) < 0:
            _wait(self._answers, select.POLLIN, deadline)
            arrived = os.read(self._answers, 1 << 20)
            if not arrived:
                raise BrokenPipeError
            self._arrived += arrived
        message = bytes(self._arrived[:end])
        del self._arrived[: end + 1]
        return message


class Tab:
    """One page of the browser."""

    def __init__(self, connection: _Connection) -> None:
        self._connection = connection
        target = connection.call("Target.createTarget", {"url": "about:blank"})
        joined = {"targetId": target["targetId"], "flatten": True}
        self._session = str(connection.call("Target.attachToTarget", joined)["sessionId"])
        self.call("Page.enable")

    def hear(self, heard: Callable[[dict[str, Any]], object]) -> None:
        """Call a function with each event that arrives before an answer."""
        self._connection.heard = heard

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Send a DevTools command and return its answer. Raises BrowserError."""
        return self._connection.call(method, parameters, self._session)

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


def browser() -> str | None:
    """The path of a Chromium; None without one."""
    return next((path for path in map(shutil.which, NAMES) if path), None)


@contextlib.contextmanager
def headless_tab(size: tuple[int, int], more: Sequence[str] = ()) -> Iterator[Tab]:
    """A page of a browser with a profile of its own, which ends with the block.

    size: width and height, in pixels. more: further flags. Raises BrowserError.
    """
    path = browser()
    if path is None:
        raise BrowserError("there is no Chromium")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        flags = [*_FLAGS.split(), f"--window-size={size[0]},{size[1]}", *more]
        if os.geteuid() == 0:
            flags.append("--no-sandbox")  # Chromium has none for root
        with _started([path, *flags, f"--user-data-dir={profile}"]) as connection:
            yield Tab(connection)


@contextlib.contextmanager
def _started(command: list[str]) -> Iterator[_Connection]:
    """A connection to a browser that is started, and ended with the block."""
    with contextlib.ExitStack() as closing:
        reads, commands = _pipe()
        closing.callback(os.close, commands)
        answers, writes = _pipe()
        closing.callback(os.close, answers)
        try:
            closing.callback(_end, _spawned(command, reads, writes))
        except OSError as refused:
            raise BrowserError(f"Chromium does not start: {reason(refused)}") from None
        finally:  # so that the other ends notice when the browser is gone
            os.close(reads)
            os.close(writes)
        yield _Connection(commands, answers)


def _pipe() -> tuple[int, int]:
    """The ends of a pipe for reading and writing, both out of the way of the browser's own."""
    ends = os.pipe()
    moved = tuple(fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, _UNUSED) for end in ends)
    for end in ends:
        os.close(end)
    return moved[0], moved[1]


def _spawned(command: list[str], reads: int, writes: int) -> int:
    """The process of a browser with these ends of the pipes and no other open file."""
    nothing = [(os.POSIX_SPAWN_OPEN, k, os.devnull, os.O_RDWR, 0) for k in range(3)]
    pipes = [(os.POSIX_SPAWN_DUP2, reads, _READS), (os.POSIX_SPAWN_DUP2, writes, _WRITES)]
    return os.posix_spawn(
        command[0],
        command,
        os.environ,
        file_actions=[*nothing, *pipes],
        setsigdef=[signal.SIGPIPE],  # which Python ignores
    )


def _end(pid: int) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)


def _wait(descriptor: int, event: int, deadline: float) -> None:
    """Wait until a descriptor is ready. event: of select.poll. Raises TimeoutError."""
    poll = select.poll()
    poll.register(descriptor, event)
    if not poll.poll(1e3 * max(deadline - time.monotonic(), 0.0)):
        raise TimeoutError
