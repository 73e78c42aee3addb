"""A method: something that plans the scene's motion with a number of intervals, and is timed."""

from __future__ import annotations

import os
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

from hovi.accuracy.reference_motion import Configurations


@dataclass(frozen=True, eq=False)
class Answer:
    """One solve.

    success: whether the method says that it found a minimum. message: what it says.
    cost: 1/2 integral |tau|^2 as the method computes it.
    configurations: the motion, by the method's own interpolant.
    steps: iterations. seconds: wall time of this solve alone.
    """

    success: bool
    message: str
    cost: float
    configurations: Configurations
    steps: int
    seconds: float


@dataclass(frozen=True, eq=False)
class Prepared:
    """A method that has built all it needs for one grid.

    solve: plans the motion from the guess, every time in the same way.
    seconds: wall time of building, without that of sampling the guess.
    """

    solve: Callable[[], Answer]
    seconds: float


class Method(ABC):
    """Plans one problem from one guess, on grids of any number of intervals.

    name: as tables and legends call it. family: what it shares a color with. order: of the cost
    in the step length; None where there is none to state. coarsest: intervals to begin with.
    """

    name: str
    family: str
    order: int | None
    coarsest: int = 4

    @abstractmethod
    def prepare(self, intervals: int) -> Prepared:
        """Build everything for N equal intervals.

        intervals: N >= 2. Raises UnmeasurableError when the method cannot do it.
        """

    def close(self) -> None:
        """Give back what the method holds."""


def processor_time() -> float:
    """Processor time of this process and of the children that it has waited for, in [s]."""
    spent = os.times()
    return time.process_time() + spent.children_user + spent.children_system


CLOCKS: dict[str, Callable[[], float]] = {"wall": time.perf_counter, "processor": processor_time}
"""By wall time one sees what one waits for; by processor time, what a busy machine would take if
nobody else used it."""


class Stopwatch:
    """Time since it was made, in [s].

    clock: in CLOCKS.
    """

    def __init__(self, clock: str = "wall") -> None:
        self._now = CLOCKS[clock]
        self._began = self._now()

    @property
    def seconds(self) -> float:
        """Time that has passed."""
        return self._now() - self._began
