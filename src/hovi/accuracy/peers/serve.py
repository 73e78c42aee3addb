"""Answers questions about one tool: run by the Python of its environment, without hovi.

One JSON object per line, in and out. The first question is the scene; each later one is "prepare"
or "solve" with a number of intervals. The argument names a module of this folder, which has an
Arm (the scene, checked) and a Solve (a grid), which can `run` and then has an `answer`.
"""

from __future__ import annotations

import importlib
import json
import sys
import time
from typing import Any

CLOCKS = {"wall": time.perf_counter, "processor": time.process_time}


class Session:
    """A tool with its scene and the grids that were prepared for it."""

    def __init__(self, tool: Any) -> None:
        self._tool = tool
        self._arm: Any = None
        self._clock = time.perf_counter
        self._solves: dict[int, Any] = {}

    def answer(self, question: dict[str, Any]) -> dict[str, Any]:
        """What the other side asked for."""
        if "urdf" in question:
            self._arm, self._clock = self._tool.Arm(question), CLOCKS[question["clock"]]
            return {"ready": True}
        if "solve" in question:
            solve = self._solves[question["solve"]]
            began = self._clock()
            solve.run()
            return {"seconds": self._clock() - began, **solve.answer()}
        began, intervals = self._clock(), question["prepare"]
        self._solves[intervals] = self._tool.Solve(self._arm, intervals, question["guess"])
        return {"seconds": self._clock() - began}


def main() -> None:
    """Serve until the other side closes."""
    try:
        session = Session(importlib.import_module(sys.argv[1]))
    except ImportError as missing:
        print("\n" + json.dumps({"error": f"{sys.executable}: {missing}"}), flush=True)
        return
    for line in sys.stdin:
        try:
            answer = session.answer(json.loads(line))
        except Exception as error:  # the other side is told, and decides
            answer = {"error": f"{type(error).__name__}: {error}"}
        print("\n" + json.dumps(answer), flush=True)


if __name__ == "__main__":
    main()
