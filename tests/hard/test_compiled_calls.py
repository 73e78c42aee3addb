"""Compiled entries check their arguments against each other before they read or write a number."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest

from hard import api_calls, compiled_calls
from hard.compiled_calls import ENTRIES, Kind, changed, error_in, valid_call, verdict_on
from hard.verdict import Mutant, Verdict
from hovi._native import intervals
from hovi.dynamics.extension import SymbolicModel, archive
from hovi.robot.bundled_models import example
from hovi.robot.loading import load_robot

Array = np.ndarray
SEEDS = range(4)


def read_only(array: Array) -> Array:
    copy = array.copy()
    copy.setflags(write=False)
    return copy


def misaligned(array: Array) -> Array:
    memory = bytearray(array.nbytes + 1)
    return np.frombuffer(memory, array.dtype, array.size, offset=1).reshape(array.shape)


WRONG: dict[str, Callable[[Array], Any]] = {
    "of single precision": lambda x: x.astype(np.float32),
    "of integers of 32 bits": lambda x: x.astype(np.int32),
    "of the other byte order": lambda x: x.astype(x.dtype.newbyteorder()),
    "with a dimension more": lambda x: x[None],
    "of one number": lambda x: x.dtype.type(1),
    "not contiguous": lambda x: np.repeat(x, 2, axis=-1)[..., ::2],
    "longer": lambda x: np.concatenate([x, x[:1]]),
    "shorter": lambda x: x[:-1],
    "a list": lambda x: x.tolist(),
    "misaligned": misaligned,
}


def full_call(name: str) -> dict[str, Any]:
    """A valid call in which no array is empty, or missing."""
    for seed in range(1_000):
        call = valid_call(name, seed)
        if all(isinstance(call[key], Array) and call[key].size > 1 for key in ENTRIES[name].kinds):
            return call
    raise AssertionError(f"no seed gives a full call of {name}")


def written(kind: Kind) -> bool:
    return kind.output or kind.updated


CASES = [(name, key) for name, entry in ENTRIES.items() for key in entry.kinds]


@pytest.mark.parametrize("name", ENTRIES)
def test_valid_calls_are_accepted_and_write_all_of_their_outputs(name: str) -> None:
    for seed in range(30):
        call = valid_call(name, seed)
        assert not error_in(name, call)
        found, why = verdict_on(name, call)
        assert found is Verdict.ACCEPTED, why


@pytest.mark.parametrize(("name", "key"), CASES)
def test_an_argument_that_is_wrong_is_refused_and_named(name: str, key: str) -> None:
    for what, change in WRONG.items():
        call = full_call(name)
        call[key] = change(call[key])
        if not error_in(name, call):  # such as a band of more columns than are used
            continue
        with pytest.raises((TypeError, ValueError)) as refusal:
            ENTRIES[name].function(**call)
        sentence = str(refusal.value)
        assert "\n" not in sentence, what
        assert sentence.endswith("."), what
        assert refusal.type is ValueError or sentence.startswith(f"{key} must be "), what


@pytest.mark.parametrize(
    ("name", "key"), [(name, key) for name, key in CASES if written(ENTRIES[name].kinds[key])]
)
def test_an_output_that_is_read_only_is_refused(name: str, key: str) -> None:
    call = full_call(name)
    call[key] = read_only(call[key])
    with pytest.raises(TypeError, match=f"{key} must be a writable.*read-only"):
        ENTRIES[name].function(**call)


@pytest.mark.parametrize("name", ENTRIES)
def test_random_changes_are_refused_where_they_contradict_the_rest(name: str) -> None:
    for seed in range(100):
        found, why = verdict_on(name, changed(name, seed, 2))
        assert found in (Verdict.REFUSED, Verdict.ACCEPTED), f"seed {seed}: {why}"


def test_every_compiled_function_is_among_the_entries() -> None:
    from hovi._native import band, barrier, distances, dynamics, expressions, groups

    functions = {
        f"{module.__name__.rpartition('.')[2]}.{name}"
        for module in (band, barrier, expressions, groups, intervals)
        for name in dir(module)
        if callable(getattr(module, name)) and not name.startswith("_")
    }
    classes = {
        "dynamics": dynamics.InverseDynamicsKernel,
        "sampling": dynamics.PathSampler,
        "distances": distances.PairDistances,
    }
    methods = {
        f"{module}.{name}"
        for module, each in classes.items()
        for name in dir(each)
        if not name.startswith("_") and callable(getattr(each, name))
    }
    built = {f"{module}.{each.__name__}" for module, each in classes.items()}
    assert functions | methods | built <= ENTRIES.keys()


def test_a_damaged_archive_of_a_model_is_refused() -> None:
    """Boost's reader crashes for one in a hundred of these without the checksum."""
    text = archive(load_robot(example("two_link.urdf")).model)
    SymbolicModel(text)
    naked = text.partition(" ")[2]
    cut = [text[:length] for length in (0, 1, 8, 9, 10, len(text) // 2, len(text) - 1)]
    for damaged in (*cut, naked, text + " ", text.replace(" shoulder ", " "), text.upper()):
        with pytest.raises(ValueError, match="archive is damaged"):
            SymbolicModel(damaged)
    for seed in range(3_000):
        with pytest.raises(ValueError, match="archive is damaged"):
            SymbolicModel(compiled_calls.damaged(text, Random(seed)))


def test_an_archive_of_no_model_is_refused() -> None:
    for text in ("", "22 serialization::archive", "22 serialization::archive 19 0 0"):
        with pytest.raises(ValueError, match="archive is not that of a model"):
            SymbolicModel(f"{zlib.crc32(text.encode()):08x} {text}")


def test_a_model_that_contradicts_itself_is_refused() -> None:
    model = load_robot(example("two_link.urdf")).model
    model.parents[1] = 2
    with pytest.raises(ValueError, match="contradicts itself"):
        SymbolicModel(archive(model))


def test_a_layout_whose_parts_overlap_or_leave_gaps_is_refused() -> None:
    q, v = np.zeros((1, 14)), np.zeros((1, 12))
    for second in ([4, 6, 6, 6], [4, 7, 7, 6], [4, 7, 6, 5], [5, 7, 6, 6], [-1, 7, 6, 6]):
        layout = np.array([[4, 0, 0, 6], second])
        with pytest.raises(ValueError, match="row 1 of layout is no part"):
            compiled_calls.groups.integrate(layout, q, v, np.zeros((1, 14)))


@pytest.mark.parametrize("wrong", [4, -1, 2**40])
def test_a_neighbor_that_is_no_point_of_its_hull_is_refused(wrong: int) -> None:
    call = full_call("distances.PairDistances")
    assert call["point_counts"][0] == 4
    call["neighbors"][0] = wrong
    with pytest.raises(ValueError, match="neighbors must be"):
        compiled_calls.distances.PairDistances(**call)


@pytest.mark.parametrize("name", ["barrier.aim", "barrier.merit", "barrier.move"])
@pytest.mark.parametrize("keep", [-1.0, -5e-324, -np.inf, np.nan])
def test_a_negative_share_of_a_gap_is_refused(name: str, keep: float) -> None:
    """Steps were clamped between bounds in the wrong order, which is undefined."""
    with pytest.raises(ValueError, match="keep must be a share of the gaps, 0 or more"):
        ENTRIES[name].function(**(full_call(name) | {"keep": keep}))


@pytest.mark.parametrize("wrong", [{"mu": -1e-9}, {"mu": np.nan}, {"ratio": 0.99}])
def test_a_range_of_multipliers_that_is_empty_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="mu must be 0 or more, and ratio 1 or more"):
        ENTRIES["barrier.move"].function(**(full_call("barrier.move") | wrong))


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("barrier.recenter", {"c": 0.0}),
        ("barrier.recenter", {"mu": np.nan}),
        ("barrier.follow", {"next_mu": 0.0}),
        ("barrier.follow", {"least": -1.0}),
    ],
)
def test_a_central_path_needs_positive_numbers(name: str, wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="c and mu must be positive"):
        ENTRIES[name].function(**(full_call(name) | wrong))


@pytest.mark.parametrize(
    "content",
    [
        b'["band.factor", 1e999, 1]',
        b'["band.factor", 1, 1e999]',
        b'["x", 1, 1]',
        b"[]",
        b"\xff",
        b"1",
    ],
)
def test_bytes_that_are_no_call_are_nothing_to_judge(content: bytes) -> None:
    for module in (compiled_calls, api_calls):
        assert module.verdict(Mutant(content), Path()) == (Verdict.REFUSED, "not a call")
