"""Deadlines start when they are created, by the monotonic clock."""

from __future__ import annotations

import pytest

from hovi.system.deadline import Deadline, OutOfTimeError, is_late, raise_if_late


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


def test_work_is_allowed_that_ends_before_the_deadline(clock: Clock) -> None:
    deadline = Deadline(10.0)
    clock.now += 4.0
    assert deadline.spent == 4.0
    assert deadline.allows(6.0)
    assert not deadline.allows(6.5)
    assert Deadline().allows(1e9)


def test_computations_are_stopped_while_a_deadline_that_has_passed_is_in_force(
    clock: Clock,
) -> None:
    deadline = Deadline(3.0)
    with deadline.in_force():
        raise_if_late()
        clock.now += 4.0
        assert is_late()
        with pytest.raises(OutOfTimeError, match=r"^the time limit was reached$"):
            raise_if_late()
    assert not is_late()
    raise_if_late()


@pytest.mark.parametrize("inner", [None, 100.0])
def test_the_earlier_of_two_deadlines_holds(clock: Clock, inner: float | None) -> None:
    with Deadline(3.0).in_force(), Deadline(inner).in_force():
        assert not is_late()
        clock.now += 4.0
        assert is_late()


def test_an_outer_deadline_holds_again_after_an_inner_one(clock: Clock) -> None:
    with Deadline(3.0).in_force():
        with Deadline(1.0).in_force():
            clock.now += 2.0
            assert is_late()
        assert not is_late()
        clock.now += 2.0
        assert is_late()
