"""Asks a process with OMPL for paths; the distances are measured here."""

from __future__ import annotations

import json
import os
import selectors
import subprocess
import sys
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from hovi.planning.paths.free_space import FreeSpace
from hovi.system.deadline import Deadline, raise_if_late, time_left

Array = npt.NDArray[np.float64]

MAX_MOTIONS = 20_000
"""Maximum number of straight motions that are looked at for one path."""
MAX_SILENCE = 10.0
"""Time without a question or an answer after which the process counts as lost, in [s]."""
READ_BYTES = 1 << 16
"""Largest number of bytes that are read from the process at once."""
_WORKER = Path(__file__).with_name("ompl_worker.py")


def has_ompl() -> bool:
    """Whether the extra with OMPL is installed."""
    return find_spec("ompl") is not None


class OmplProcess:
    """A process of its own with OMPL, which ends with the `with` statement.

    Whatever happens in it, this process goes on: a path is None where it crashes or falls silent.
    """

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._rest = b""

    def __enter__(self) -> Self:
        with suppress(OSError):
            self._process = subprocess.Popen(
                [sys.executable, "-W", "ignore", str(_WORKER)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                start_new_session=True,  # Ctrl-C in a terminal is for this process
            )
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            for stream in (self._process.stdin, self._process.stdout):
                with suppress(OSError):
                    if stream is not None:
                        stream.close()

    def path(self, space: FreeSpace, start: Array, goal: Array, seed: int) -> Array | None:
        """The points of a path, (M, nv) in the space's coordinates; None if none is found.

        start, goal: shape (nv,). seed: the same one gives the same path in a new process.
        Raises OutOfTimeError when the deadline in force passes.
        """
        lower, upper = space.around(start, goal)
        request = {
            "lower": lower.tolist(),
            "upper": upper.tolist(),
            "start": start.tolist(),
            "goal": goal.tolist(),
            "seed": seed + 1,  # OMPL takes none that is zero
            "motions": MAX_MOTIONS,
        }
        try:
            self._tell(json.dumps(request))
            while "path" not in (said := self._said()):
                free = space.is_free_between(np.array(said["from"]), np.array(said["to"]))
                self._tell("1" if free else "0")
        except (OSError, ValueError, KeyError, TypeError):
            return None
        return None if said["path"] is None else np.array(said["path"], dtype=np.float64)

    def _tell(self, line: str) -> None:
        if self._process is None or self._process.stdin is None:
            raise BrokenPipeError
        self._process.stdin.write(line.encode() + b"\n")
        self._process.stdin.flush()

    def _said(self) -> dict[str, Any]:
        """The next line that it writes. Raises OSError where none comes any more."""
        assert self._process is not None
        assert self._process.stdout is not None
        pipe, silence = self._process.stdout.fileno(), Deadline(MAX_SILENCE)
        with selectors.DefaultSelector() as selector:
            selector.register(pipe, selectors.EVENT_READ)
            while b"\n" not in self._rest:
                raise_if_late()
                waits = [each for each in (time_left(), silence.seconds_left) if each is not None]
                if not selector.select(min(waits)):
                    if silence.passed:
                        raise BrokenPipeError
                    continue
                chunk = os.read(pipe, READ_BYTES)
                if not chunk:
                    raise BrokenPipeError
                self._rest += chunk
        line, self._rest = self._rest.split(b"\n", 1)
        said = json.loads(line)
        if not isinstance(said, dict):
            raise TypeError
        return said
