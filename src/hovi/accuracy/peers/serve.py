"""The server process of one tool, run by the Python of its environment, without hovi.

It reads and writes one JSON object per line. The first request is the scene; each later one is
"prepare" or "solve" with a number of intervals; "solve" with a "goal" too moves the goal and starts
from the last motion. The command-line argument names a module of this folder that defines Arm (the
checked scene) and Solve (one grid, with methods `run`, `answer`, and `replan` if goals may move).
"""

from __future__ import annotations

import importlib
import json
import sys
import time
from typing import Any

CLOCKS = {"wall": time.perf_counter, "processor": time.process_time}


class Session:
    """A tool, its scene and its prepared grids."""

    def __init__(self, tool: Any) -> None:
        self._tool = tool
        self._arm: Any = None
        self._clock = time.perf_counter
        self._solves: dict[int, Any] = {}

    def answer(self, request: dict[str, Any]) -> dict[str, Any]:
        """The response to one request."""
        if "urdf" in request:
            self._arm, self._clock = self._tool.Arm(request), CLOCKS[request["clock"]]
            return {"ready": True}
        if "solve" in request:
            solve = self._solves[request["solve"]]
            began = self._clock()
            if "goal" in request:
                solve.replan(request["goal"])
            else:
                solve.run()
            return {"seconds": self._clock() - began, **solve.answer()}
        began, intervals = self._clock(), request["prepare"]
        self._solves[intervals] = self._tool.Solve(self._arm, intervals, request["guess"])
        return {"seconds": self._clock() - began}


def main() -> None:
    """Answer requests until standard input is closed."""
    try:
        session = Session(importlib.import_module(sys.argv[1]))
    except ImportError as missing:
        print("\n" + json.dumps({"error": f"{sys.executable}: {missing}"}), flush=True)
        return
    for line in sys.stdin:
        try:
            answer = session.answer(json.loads(line))
        except Exception as error:  # reported to the client
            answer = {"error": f"{type(error).__name__}: {error}"}
        print("\n" + json.dumps(answer), flush=True)


if __name__ == "__main__":
    main()
