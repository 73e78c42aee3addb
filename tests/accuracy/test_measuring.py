"""Measurements of methods on finer and finer grids: their order, their ends and their budget."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import numpy.typing as npt

from hovi.accuracy.budget import Budget
from hovi.accuracy.measuring import measure
from hovi.accuracy.method import Answer, Method, Prepared
from hovi.accuracy.reference_motion import ReferenceMotion
from hovi.errors import UnmeasurableError
from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]


class FakeMethod(Method):
    """A method with errors N^-4 against a motion of cost 1, and times proportional to N."""

    order = 4

    def __init__(self, name: str, seconds: float) -> None:
        self.name, self.family, self.seconds = name, "nobody", seconds
        self.solves = 0

    def prepare(self, intervals: int) -> Prepared:
        if intervals > 64:
            raise UnmeasurableError("it has no more than 64 intervals.")

        def solve() -> Answer:
            self.solves += 1
            error = float(intervals) ** -4

            def away(t: Array) -> Array:
                return np.full((len(t), 1), error)

            return Answer(True, "", 1 + error, away, 1, self.seconds * intervals)

        return Prepared(solve, 0.0)


def measured(pendulum: Robot, budget: float, *methods: Method) -> Any:
    reference = ReferenceMotion(pendulum, 1.0, lambda t: np.zeros((len(t), 1)), 1.0)
    return measure(methods, reference, Budget(budget), lambda text, fraction: None)


def test_a_method_that_raises_on_a_grid_keeps_its_runs_and_is_noted(pendulum: Robot) -> None:
    found = measured(pendulum, 1e6, FakeMethod("short", 1e-9))
    assert max(run.intervals for run in found.runs) == 64
    assert found.notes == ("short: it has no more than 64 intervals.",)


def test_a_solve_of_a_tenth_of_the_budget_is_the_last_of_its_method(
    pendulum: Robot,
) -> None:
    slow = FakeMethod("slow", 1.0)  # one second per interval
    found = measured(pendulum, 100.0, slow)
    assert [run.intervals for run in found.runs] == [4, 6, 8, 12]
    assert [len(run.repeats) for run in found.runs] == [2, 1, 1, 1]  # until they take 5 s
    assert slow.solves == 4 + 5


def test_a_dominated_method_is_not_refined(pendulum: Robot) -> None:
    found = measured(pendulum, 1e9, FakeMethod("fast", 1.0), FakeMethod("slow", 40.0))
    assert max(run.intervals for run in found.runs if run.method == "fast") == 64
    assert [run.intervals for run in found.runs if run.method == "slow"] == [4]


class Halving(FakeMethod):
    """A method that halves all of its intervals, as limits and charts may require it."""

    def prepare(self, intervals: int) -> Prepared:
        prepared = super().prepare(intervals)

        def solve() -> Answer:
            return dataclasses.replace(prepared.solve(), intervals=2 * intervals)

        return Prepared(solve, 0.0)


def test_a_run_tells_the_intervals_that_it_ended_with(pendulum: Robot) -> None:
    found = measured(pendulum, 1e6, Halving("halving", 1e-9))
    assert [run.intervals for run in found.runs] == [8, 24, 64]  # from 4, 12 and 32


def test_methods_get_the_same_time_whatever_their_order(pendulum: Robot) -> None:
    solved: list[str] = []

    class Noted(FakeMethod):
        def prepare(self, intervals: int) -> Prepared:
            solved.append(self.name)
            return super().prepare(intervals)

    measured(pendulum, 1e6, Noted("slow", 1e-3), Noted("fast", 1e-4))
    assert solved[:6] == ["slow", "fast", "fast", "fast", "fast", "fast"]
    assert solved.index("slow", 1) > 5


def test_a_late_measurement_has_its_share_of_the_time_left(pendulum: Robot) -> None:
    budget = Budget(60.0)
    budget._began -= 0.85 * budget.seconds
    reference = ReferenceMotion(pendulum, 1.0, lambda t: np.zeros((len(t), 1)), 1.0)
    method, quiet = FakeMethod("late", 1e-9), lambda text, fraction: None
    assert measure([method], reference, budget, quiet, fraction=0.9, repeats=0).runs
