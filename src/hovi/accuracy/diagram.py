"""The work-precision diagram of a scene as a record of runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from typing import Any

from hovi.accuracy.measures import MEASURES, shown_sizes, size
from hovi.accuracy.resolved_motion import ResolvedMotion
from hovi.accuracy.run import Run
from hovi.accuracy.tolerance_method import Choice
from hovi.system.dataclass import dataclass
from hovi.system.summary import Summarized, Summary


@dataclass(frozen=True, eq=False, repr=False)
class Diagram(Summarized):
    """Runs of several methods on one scene, from one guess, on one machine.

    scene: its name. guess: "near" or "cubic". resolved: the motion that errors refer to.
    runs: by method, then by intervals. choices: of `plan(tolerance=)`, ascending in accuracy.
    default: what `plan` does if neither scheme, intervals nor tolerance are named; None if that
        was not measured.
    limited: whether all motions hold limits.
    notes: sentences on the motion and on what was left out. complete: False if the time budget ran
        out.
    seconds: duration of the measurement, by the wall. clock: "processor" or "wall", of all times
        of solves.
    """

    scene: str
    guess: str
    resolved: ResolvedMotion
    runs: tuple[Run, ...] = field(repr=False)
    choices: tuple[Choice, ...] = ()
    default: Choice | None = None
    limited: bool = False
    notes: tuple[str, ...] = ()
    complete: bool = True
    seconds: float = 0.0
    clock: str = "processor"

    def _summary(self) -> Summary:
        counts = {method: len(self.of(method)) for method in self.methods}
        rows = [("guess", self.guess)]
        rows += [(name, f"{count} runs") for name, count in list(counts.items())[:5]]
        more = f" of {len(counts)} methods" if len(counts) > 5 else ""
        took = f"{len(self.runs)} runs{more}, {self.seconds:.3g} s"
        return Summary(f"Diagram of {self.scene!r}: {took}", tuple(rows))

    @property
    def methods(self) -> tuple[str, ...]:
        """Names of the methods, in the order of the runs."""
        return tuple(dict.fromkeys(run.method for run in self.runs))

    def of(self, method: str) -> tuple[Run, ...]:
        """The runs of one method, by intervals."""
        return tuple(run for run in self.runs if run.method == method)

    def kept(self, method: str, measure: str = "cost") -> tuple[tuple[Run, float], ...]:
        """The valid runs of a method, each with the largest error on its grid and all finer grids.

        So an error that is small by coincidence on one grid does not count.
        measure: in MEASURES, which has the units.
        """
        worst, pairs = 0.0, []
        for run in reversed([run for run in self.of(method) if run.counts]):
            worst = max(worst, size(run.error, measure))
            pairs.append((run, worst))
        return tuple(reversed(pairs))

    def cheapest(
        self,
        tolerance: float,
        measure: str = "cost",
        among: Callable[[Run], bool] = lambda run: True,
        time: Callable[[Run], float] = lambda run: run.seconds,
    ) -> Run | None:
        """The fastest run whose error, see `kept`, is within a tolerance; None if there is none.

        among: runs to consider. time: of a run, in [s].
        """
        accurate = [
            run
            for method in self.methods
            for run, error in self.kept(method, measure)
            if error <= tolerance and among(run)
        ]
        return min(accurate, key=time, default=None)

    def front(
        self,
        measure: str = "cost",
        among: Callable[[Run], bool] = lambda run: True,
        time: Callable[[Run], float] = lambda run: run.seconds,
    ) -> tuple[Run, ...]:
        """The Pareto front of time and error, see `kept`, fastest first."""
        pairs = [pair for method in self.methods for pair in self.kept(method, measure)]
        front, least = [], float("inf")
        for run, error in sorted(pairs, key=lambda pair: (time(pair[0]), pair[1])):
            if among(run) and error < least:
                front.append(run)
                least = error
        return tuple(front)

    def to_dict(self) -> dict[str, Any]:
        """The JSON form, with tip errors in [mm]."""
        front = {measure: {id(run) for run in self.front(measure)} for measure in MEASURES}
        return {
            "scene": self.scene,
            "guess": self.guess,
            "clock": self.clock,
            "resolved": {
                "scheme": self.resolved.scheme,
                "intervals": self.resolved.intervals,
                "tip_frames": list(self.resolved.tip_frames),
                "cost": self.resolved.cost,
                "uncertainty": shown_sizes(self.resolved.uncertainty),
                "limit_effect": self.resolved.limit_effect,
            },
            "limited": self.limited,
            "complete": self.complete,
            "notes": list(self.notes),
            "seconds": self.seconds,
            "runs": [
                run.to_dict() | {"front": [m for m in MEASURES if id(run) in front[m]]}
                for run in self.runs
            ],
            "choices": [choice.to_dict() for choice in self.choices],
            "default": None if self.default is None else self.default.to_dict(),
        }
