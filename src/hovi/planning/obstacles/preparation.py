"""Time limits of what is done with obstacles before a plan: meshes are divided into parts."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from hovi.errors import InputError
from hovi.system.deadline import Deadline, OutOfTimeError, time_left


@contextmanager
def prepared_within(seconds: float | None) -> Iterator[None]:
    """Whatever the block does with obstacles ends after a time in [s]; without a limit if None.

    A deadline that is in force counts instead. Raises InputError where the time is not enough.
    """
    if seconds is None or time_left() is not None:
        yield
        return
    try:
        with Deadline(seconds).in_force():
            yield
    except OutOfTimeError:
        raise InputError(
            f"the time limit of {seconds:g} s passed before the obstacles were ready: give more "
            "time once, as the convex parts of a mesh are kept, or leave out convex_parts."
        ) from None
