"""Arrays of any layout mean the same as lists of their numbers; masked entries are refused."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

import hovi
from hard.api_calls import Call, calls
from hovi.errors import HoviError


def numbers(value: Any) -> np.ndarray | None:
    """The array that a list or an array of numbers is; None for anything else."""
    if not isinstance(value, np.ndarray | list | tuple) or len(value) == 0:
        return None
    try:
        array = np.array(value)
    except (ValueError, TypeError):  # of other things, or of arrays of several shapes
        return None
    return array if array.dtype.kind in "if" and array.ndim > 0 and array.size > 0 else None


def reversed_twice(x: np.ndarray) -> np.ndarray:
    return x[::-1].copy()[::-1]


def strided(x: np.ndarray) -> np.ndarray:
    return np.repeat(x, 2, axis=-1)[..., ::2]


def read_only(x: np.ndarray) -> np.ndarray:
    copy = x.copy()
    copy.setflags(write=False)
    return copy


def misaligned(x: np.ndarray) -> np.ndarray:
    memory = bytearray(x.nbytes + 1)
    memory[1:] = x.tobytes()
    return np.frombuffer(memory, x.dtype, x.size, offset=1).reshape(x.shape)


LAYOUTS: dict[str, Callable[[np.ndarray], Any]] = {
    "reversed": reversed_twice,
    "strided": strided,
    "Fortran": np.asfortranarray,
    "read-only": read_only,
    "misaligned": misaligned,
    "other bytes": lambda x: x.astype(x.dtype.newbyteorder()),
    "nothing masked": lambda x: np.ma.array(x, mask=np.zeros(x.shape, bool)),
}


def masked(x: np.ndarray) -> Any:
    mask = np.zeros(x.shape, dtype=bool)
    mask.flat[-1] = True
    return np.ma.array(x, mask=mask)


def arguments() -> Iterator[tuple[str, int | str, np.ndarray]]:
    for name, call in calls().items():
        for place in call.places:
            given = call.arguments[place] if isinstance(place, int) else dict(call.keywords)[place]
            array = numbers(given)
            if array is not None:
                yield name, place, array


SLOW = "conjugate_time", "plan 2"
ARGUMENTS = list(arguments())
IDS = [f"{name}-{place}" for name, place, _ in ARGUMENTS]
MARKED = [
    pytest.param(*each, marks=pytest.mark.long if each[0].startswith(SLOW) else ())
    for each in ARGUMENTS
]


def figures(result: Any) -> list[np.ndarray]:
    """The arrays in what a call returns."""
    if isinstance(result, np.ndarray | float | int) and not isinstance(result, bool):
        return [np.asarray(result)]
    if isinstance(result, tuple | list):
        return [x for each in result for x in figures(each)]
    if isinstance(result, hovi.Solution):
        return figures(result.trajectory.path)
    fields = vars(result).values() if hasattr(result, "__dataclass_fields__") else ()
    return [x for x in fields if isinstance(x, np.ndarray)]


@pytest.mark.filterwarnings("ignore::hovi.errors.HoviWarning")
@pytest.mark.parametrize(("name", "place", "array"), MARKED, ids=IDS)
def test_arrays_of_any_layout_mean_their_numbers(
    name: str, place: int | str, array: np.ndarray
) -> None:
    call: Call = calls()[name]
    if "time_limit" in call.places and name.startswith("plan"):  # its two steps end by themselves
        call = call.replaced("time_limit", 60.0)
    expected = figures(call.replaced(place, array)())
    for layout, change in LAYOUTS.items():
        found = figures(call.replaced(place, change(array))())
        assert len(found) == len(expected), layout
        for x, y in zip(found, expected, strict=True):
            np.testing.assert_array_equal(x, y, err_msg=layout)


@pytest.mark.filterwarnings("ignore::hovi.errors.HoviWarning")
@pytest.mark.parametrize(("name", "place", "array"), ARGUMENTS, ids=IDS)
def test_masked_entries_are_refused(name: str, place: int | str, array: np.ndarray) -> None:
    call: Call = calls()[name]
    for wrong in (masked(array), list(masked(array))):
        with pytest.raises(HoviError, match="mask") as refusal:
            call.replaced(place, wrong)()
        assert "\n" not in str(refusal.value)
