"""An interrupt caught in any part of a call ends that call, and no later one."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from hovi import Status, plan
from hovi.discrete.state import State
from hovi.planning.clearance.obstacles import Sphere
from hovi.planning.problem.frame_goal import FrameGoal
from hovi.planning.problem.goals import Via
from hovi.scene.effort_lagrangian import EffortLagrangian
from hovi.scene.scene import Scene
from hovi.system.deadline import raise_if_late
from hovi.system.interruption import (
    cancelled_by,
    interrupted,
    interruptible,
    raise_if_interrupted,
    record_interrupt,
)

HANG = np.array([-np.pi / 2, 0.0])
REACH = np.array([0.3, 0.7])
MAX_EVALUATIONS_AFTER = 25
"""Maximum number of evaluations to build the result after an interrupt."""

SEARCHES: dict[str, dict[str, Any]] = {
    "between limits": {"limits": {"base": "none", "tau": 12.0}},
    "among obstacles": {"obstacles": [Sphere([0.7, 0.0, -1.65], 0.15)]},
    "through a via point": {
        "via": [Via(0.5, State([-0.5, 0.2]))],
        "goal": FrameGoal("tip", position=[1.2, 0.0, 1.0]),
    },
    "to a tolerance": {"tolerance": 1e-10, "starts": 3, "processes": 1},
    "for the best duration": {"duration": (0.5, 20.0), "time_weight": 3.0},
    "on a fine grid": {"intervals": 200},
}


@interruptible
def suppressing() -> bool:
    with contextlib.suppress(KeyboardInterrupt):
        record_interrupt()
        raise KeyboardInterrupt
    return interrupted()


def test_an_interrupt_is_recorded_until_the_outermost_call_returns() -> None:
    @interruptible
    def outer() -> bool:
        suppressing()
        return interrupted()

    assert outer()
    assert not interrupted()


def test_a_call_that_raises_clears_the_recorded_interrupt() -> None:
    @interruptible
    def ended() -> None:
        suppressing()
        raise_if_interrupted()

    with pytest.raises(KeyboardInterrupt):
        ended()
    assert not interruptible(interrupted)()


def test_no_interrupt_is_recorded_outside_of_a_call() -> None:
    record_interrupt()
    assert not interrupted()
    raise_if_interrupted()


@pytest.mark.parametrize("look", [raise_if_late, raise_if_interrupted])
def test_what_cancels_is_an_interrupt_once_and_stays_recorded(look: Callable[[], None]) -> None:
    asked = list[bool]()

    def cancel() -> bool:
        asked.append(len(asked) > 1)
        return asked[-1]

    with cancelled_by(cancel):
        look()
        look()
        assert not interrupted()
        with pytest.raises(KeyboardInterrupt):
            look()
        raise_if_late()  # which leaves the end of the call to be computed
        assert interrupted()
    assert not interrupted()
    assert asked == [False, False, True]


@pytest.mark.parametrize("discarded", [False, True])
@pytest.mark.parametrize("evaluations", [2, 8])
@pytest.mark.parametrize("search", SEARCHES)
def test_an_interrupt_anywhere_ends_every_search(
    search: str,
    evaluations: int,
    discarded: bool,
    arm_scene: Scene,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Also where Python discards the exception, as in a destructor, and only the record remains."""
    output, calls = EffortLagrangian.output, 0

    def interrupting(self: EffortLagrangian, *jet: Any, **more: Any) -> Any:
        nonlocal calls
        calls += 1
        if calls == evaluations:
            record_interrupt()
            if not discarded:
                raise KeyboardInterrupt
        return output(self, *jet, **more)

    monkeypatch.setattr(EffortLagrangian, "output", interrupting)
    arguments = {"goal": REACH, "duration": 1.0, "limits": "none", "intervals": 12} | SEARCHES[
        search
    ]
    found = plan(arm_scene, HANG, **arguments)
    assert (found.success, found.status) == (False, Status.INTERRUPTED)
    assert "interrupted" in found.message
    assert "a minimum of cost" not in found.message
    assert evaluations <= calls <= evaluations + MAX_EVALUATIONS_AFTER
