"""The interface of a timed planning method."""

from __future__ import annotations

import os
import time
from abc import ABC, abstractmethod
from collections.abc import Callable

from hovi.accuracy.reference_motion import Configurations
from hovi.system.dataclass import dataclass


@dataclass(frozen=True, eq=False)
class Answer:
    """The result of one solve.

    success: whether the method reports a minimum. message: its own.
    cost: 1/2 integral |tau|^2 as the method computes it.
    configurations: the motion, by the method's own interpolant.
    steps: iterations. seconds: time of this solve alone, by the clock of the diagram.
    intervals: of the final grid, if some were halved for limits or charts; None if as prepared.
    """

    success: bool
    message: str
    cost: float
    configurations: Configurations
    steps: int
    seconds: float
    intervals: int | None = None


@dataclass(frozen=True, eq=False)
class Prepared:
    """A method set up for one grid.

    solve: plans the motion from the guess, identically on every call.
    seconds: setup time, without sampling the guess.
    """

    solve: Callable[[], Answer]
    seconds: float


class Method(ABC):
    """A planning method for one problem and guess, on uniform grids.

    name: in tables and legends. family: methods drawn in one color. order: convergence order of
    the cost in the step length; None if unknown. coarsest: smallest number of intervals.
    """

    name: str
    family: str
    order: int | None
    coarsest: int = 4

    @abstractmethod
    def prepare(self, intervals: int) -> Prepared:
        """Set up the method for N equal intervals.

        intervals: N >= 2. Raises UnmeasurableError when the method does not support them.
        """

    def close(self) -> None:
        """Release the method's resources."""


def processor_time() -> float:
    """Processor time of this process and of its terminated child processes, in [s]."""
    spent = os.times()
    return time.process_time() + spent.children_user + spent.children_system


CLOCKS: dict[str, Callable[[], float]] = {"wall": time.perf_counter, "processor": processor_time}
"""Wall time, and processor time, which depends less on other load."""


class Stopwatch:
    """A stopwatch that starts at construction.

    clock: in CLOCKS.
    """

    def __init__(self, clock: str = "processor") -> None:
        self._now = CLOCKS[clock]
        self._began = self._now()

    @property
    def seconds(self) -> float:
        """Elapsed time, in [s]."""
        return self._now() - self._began
