"""The client of a tool process that reads and writes one JSON object per line."""

from __future__ import annotations

import json
import os
import selectors
import subprocess
from pathlib import Path
from typing import Any

from hovi.errors import InputError, UnmeasurableError
from hovi.system.deadline import Deadline

_HERE = Path(__file__).parent
_MAX_ERROR_LENGTH = 300


class Worker:
    """A process that runs serve.py in the Python environment of a tool.

    python: path of that Python. tool: worker module of this folder. timeout: of one answer, in [s].
    Raises InputError when the Python cannot be started.
    """

    def __init__(self, python: Path, tool: str, timeout: float = 120.0) -> None:
        self._name, self._timeout, self._rest = tool, timeout, b""
        environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
        try:
            self._process = subprocess.Popen(
                [str(python), "-u", str(_HERE / "serve.py"), tool],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=environment,
            )
        except OSError as error:
            raise InputError(
                f"{str(python)!r} cannot be started: {error.strerror}; give the path of a "
                "Python executable."
            ) from None

    def ask(self, request: dict[str, Any]) -> dict[str, Any]:
        """The answer to one request. Raises UnmeasurableError for an error or no answer."""
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps(request).encode() + b"\n")
            self._process.stdin.flush()
            answer = json.loads(self._line())
        except (BrokenPipeError, json.JSONDecodeError):
            raise UnmeasurableError(f"{self._name} ended without an answer.") from None
        if "error" in answer:
            raise UnmeasurableError(str(answer["error"])[:_MAX_ERROR_LENGTH])
        assert isinstance(answer, dict)
        return answer

    def _line(self) -> bytes:
        """The next line that is an answer; other output of the tool is skipped."""
        assert self._process.stdout is not None
        pipe, deadline = self._process.stdout.fileno(), Deadline(self._timeout)
        with selectors.DefaultSelector() as selector:
            selector.register(pipe, selectors.EVENT_READ)
            while True:
                *lines, self._rest = self._rest.split(b"\n")
                answers = [line for line in lines if line.startswith(b"{")]
                if answers:
                    return answers[-1]
                if not selector.select(deadline.seconds_left):
                    break
                chunk = os.read(pipe, 1 << 20)
                if not chunk:
                    raise BrokenPipeError
                self._rest += chunk
        self.close()
        raise UnmeasurableError(f"{self._name} gave no answer in {self._timeout:.0f} s.")

    def close(self) -> None:
        """Terminate the process."""
        if self._process.poll() is None:
            self._process.kill()
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None and not stream.closed:
                try:
                    stream.close()
                except BrokenPipeError:  # unread requests
                    continue
