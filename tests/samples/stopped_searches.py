"""What ends a search from outside: Ctrl-C at an evaluation of torques, and a clock that leaps."""

from __future__ import annotations

from time import monotonic
from types import SimpleNamespace
from typing import Any

import pytest

from hovi.scene.effort_lagrangian import EffortLagrangian
from hovi.system import deadline


class InterruptedEvaluations:
    """Counts the evaluations of torques, of which one ends with Ctrl-C.

    calls: evaluations so far. last: the number of that one; -1 for none.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch, last: int = -1) -> None:
        self.calls, self.last = 0, last
        output = EffortLagrangian.output

        def counted(lagrangian: EffortLagrangian, *jet: Any, **more: Any) -> Any:
            self.calls += 1
            if self.calls == self.last:
                raise KeyboardInterrupt
            return output(lagrangian, *jet, **more)

        monkeypatch.setattr(EffortLagrangian, "output", counted)

    def restart(self, last: int) -> None:
        """Count from zero again."""
        self.calls, self.last = 0, last


class LeapingClock:
    """The clock of deadlines, which `leap` moves on by eleven days."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self._ahead = 0.0
        clock = SimpleNamespace(monotonic=lambda: monotonic() + self._ahead)
        monkeypatch.setattr(deadline, "time", clock)

    def leap(self) -> None:
        """Let every time limit pass."""
        self._ahead = 1e6
