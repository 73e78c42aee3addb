"""A tool in another Python: a process that reads and writes one JSON object per line."""

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
_LAST_WORDS = 300


class Worker:
    """serve.py in a Python that has a tool installed.

    python: path of that Python. tool: module of this folder that knows it. patience: how long an
    answer may take, in [s]. Raises InputError when the Python cannot be started.
    """

    def __init__(self, python: Path, tool: str, patience: float = 120.0) -> None:
        self._name, self._patience, self._rest = tool, patience, b""
        environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}
        try:
            self._process = subprocess.Popen(
                [str(python), "-u", str(_HERE / "serve.py"), tool],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=environment,
            )
        except OSError as refused:
            raise InputError(
                f"{str(python)!r} cannot be started: {refused.strerror}; name the Python of an "
                "environment."
            ) from None

    def ask(self, question: dict[str, Any]) -> dict[str, Any]:
        """The answer to one question. Raises UnmeasurableError when there is none."""
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps(question).encode() + b"\n")
            self._process.stdin.flush()
            answer = json.loads(self._line())
        except (BrokenPipeError, json.JSONDecodeError):
            raise UnmeasurableError(f"{self._name} ended without an answer.") from None
        if "error" in answer:
            raise UnmeasurableError(str(answer["error"])[:_LAST_WORDS])
        assert isinstance(answer, dict)
        return answer

    def _line(self) -> bytes:
        """The next line that is an answer; tools print other things too."""
        assert self._process.stdout is not None
        pipe, deadline = self._process.stdout.fileno(), Deadline(self._patience)
        with selectors.DefaultSelector() as selector:
            selector.register(pipe, selectors.EVENT_READ)
            while True:
                *lines, self._rest = self._rest.split(b"\n")
                answers = [line for line in lines if line.startswith(b"{")]
                if answers:
                    return answers[-1]
                if not selector.select(deadline.seconds_left):
                    break
                piece = os.read(pipe, 1 << 20)
                if not piece:
                    raise BrokenPipeError
                self._rest += piece
        self.close()
        raise UnmeasurableError(f"{self._name} gave no answer in {self._patience:.0f} s.")

    def close(self) -> None:
        """End the process."""
        if self._process.poll() is None:
            self._process.kill()
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None and not stream.closed:
                try:
                    stream.close()
                except BrokenPipeError:  # what was never read
                    continue
