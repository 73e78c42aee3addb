"""A pick cycle of seven segments with free durations, next to the best of a scan over them.

A UR5 takes a part of 1 kg and brings it to another place: it reaches a pose 100 mm above the part,
goes down to it on a straight line with its tool vertical, in the last 50 mm no faster than
100 mm/s, lifts it 100 mm straight up, carries it, lowers it straight by 50 mm as slowly, and goes
home. It passes where the last 50 mm begin and rests at the other ends of segments, whose durations
are free, at one price per second. The scan is a descent along each duration in turn, by plans for
given ones, from the geometric means of their bounds on, or from what was found.

    python pick_cycle.py [--weight 200] [--finest 1.05] [--around]
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from measuring import print_machine, print_table
from random_arms import timed

import hovi

NAMES = "reach", "approach", "touch", "lift", "carry", "lower", "home"
BOUNDS = 0.2, 4.0
"""Of every duration, in [s]."""
HOME = (0.0, -1.2, 1.5, -1.87, -1.57, 0.0)
PART, PLACE, HEIGHT = (0.45, 0.25), (0.45, -0.25), 0.15
"""x and y of both, and z of the tool there, in [m]."""
FIRST_STEP, AROUND_STEP, SHRINKS = 1.6, 1.1, 0.5
"""Factors on a duration in the first sweep of the scan, from the means and from what was found, and
on its logarithm where none is better."""
Durations = Sequence[float | tuple[float, float]]


def cycle(durations: Durations) -> list[hovi.Segment]:
    """The segments with their durations, in [s], or bounds of them."""
    down = ([0.0, 0.0, 1.0], [0.0, 0.0, -1.0])
    straight = hovi.conditions.OnLine("tool0"), hovi.conditions.Upright("tool0", axis=down)
    slowly = *straight, hovi.conditions.ToolSpeed("tool0", "100 mm/s")
    part = [hovi.effects.Payload(frame="tool0", mass=1.0, center=(0.0, 0.0, 0.05))]

    def over(place: tuple[float, float], height: float, free: Sequence[str] = ()) -> hovi.FrameGoal:
        position = [*place, HEIGHT + height]
        return hovi.FrameGoal("tool0", position=position, axis=down, free_velocity=free)

    goals = [
        over(PART, 0.1),
        over(PART, 0.05, ["all"]),
        over(PART, 0.0),
        over(PART, 0.1),
        over(PLACE, 0.05, ["all"]),
        over(PLACE, 0.0),
        list(HOME),
    ]
    keep = [(), straight, slowly, straight, (), slowly, ()]
    carried = "lift", "carry", "lower"
    return [
        hovi.Segment(goal, T, name=name, keep=kept, effects=part if name in carried else ())
        for goal, T, name, kept in zip(goals, durations, NAMES, keep, strict=True)
    ]


@dataclass
class Scan:
    """The best durations so far, their cost J + w T, and how many plans that took."""

    total: Callable[[Sequence[float]], float]
    durations: list[float]
    best: float = np.inf
    plans: int = 0

    def run(self, first: float, finest: float) -> None:
        """Descend along each duration in turn, until no step by the finest factor is better."""
        self.best, step = self._tried(self.durations), np.log(first)
        while step > np.log(finest) * SHRINKS:
            better = [self._along(i, step) for i in range(len(self.durations))]
            if not any(better):
                step *= SHRINKS

    def _along(self, i: int, step: float) -> bool:
        """Whether a longer or a shorter duration of a segment is better, which is then kept."""
        for way in (-step, step):
            other = list(self.durations)
            other[i] = float(np.clip(other[i] * np.exp(way), *BOUNDS))
            if other[i] == self.durations[i]:
                continue
            cost = self._tried(other)
            if cost < self.best:
                self.best, self.durations = cost, other
                return True
        return False

    def _tried(self, durations: Sequence[float]) -> float:
        self.plans += 1
        return self.total(durations)


def main() -> None:
    """Print both, and by how much the durations found together cost more."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--weight", type=float, default=200.0, help="price of a second")
    parser.add_argument("--finest", type=float, default=1.05, help="factor of the last sweep")
    parser.add_argument("--around", action="store_true", help="scan from the durations found")
    given = parser.parse_args()
    scene = hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])

    def total(durations: Sequence[float]) -> float:
        found = hovi.plan_sequence(scene, HOME, cycle(durations))
        return found.cost + given.weight * sum(durations) if found.success else np.inf

    free, price = cycle([BOUNDS] * len(NAMES)), given.weight
    seconds, found = timed(lambda: hovi.plan_sequence(scene, HOME, free, time_weight=price))
    lengths = found.trajectory.segment_durations.tolist()
    first, begun = FIRST_STEP, [float(np.sqrt(np.prod(BOUNDS)))] * len(NAMES)
    if given.around:
        first, begun = AROUND_STEP, [float(np.clip(T, *BOUNDS)) for T in lengths]
    scan = Scan(total, begun)
    taken, _ = timed(lambda: scan.run(first, given.finest))
    rows = [
        ["found together", f"{found.cost:.6g}", _said(lengths), "1", f"{seconds:.3g}"],
        ["best of the scan", f"{scan.best:.6g}", _said(scan.durations), *_of(scan, taken)],
    ]
    columns = ["", "cost J + w T", "durations [s], in order", "plans", "CPU s"]
    print_table(columns, rows)
    more = 100 * (found.cost / scan.best - 1)
    print(f"The durations found together cost {more:+.2g} % more than the best of the scan.")
    print(f"It is a {found.status}: {found.message}")
    print_machine(threads=1)


def _said(durations: Sequence[float]) -> str:
    return ", ".join(f"{T:.3g}" for T in durations) + f"; {sum(durations):.4g} in all"


def _of(scan: Scan, seconds: float) -> list[str]:
    return [str(scan.plans), f"{seconds:.3g}"]


if __name__ == "__main__":
    main()
