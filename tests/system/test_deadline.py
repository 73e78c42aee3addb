"""Deadlines start when they are created, by the monotonic clock."""

from __future__ import annotations

import pytest

from hovi.system.deadline import Deadline


class Clock:
    now = 100.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr("hovi.system.deadline.time", clock)
    return clock


def test_seconds_left_decrease_to_zero(clock: Clock) -> None:
    deadline = Deadline(3.0)
    assert (deadline.seconds_left, deadline.passed) == (3.0, False)
    clock.now += 2.0
    assert (deadline.seconds_left, deadline.passed) == (1.0, False)
    clock.now += 2.0
    assert (deadline.seconds_left, deadline.passed) == (0.0, True)


def test_none_means_no_limit(clock: Clock) -> None:
    never = Deadline()
    clock.now += 1e9
    assert (never.seconds_left, never.passed) == (None, False)
    assert (never.part(0.5).seconds_left, never.part(0.5).passed) == (None, False)


def test_a_part_is_a_share_of_the_time_left(clock: Clock) -> None:
    deadline = Deadline(10.0)
    clock.now += 2.0
    part = deadline.part(0.5)
    assert part.seconds_left == 4.0
    clock.now += 5.0
    assert part.passed
    assert not deadline.passed
