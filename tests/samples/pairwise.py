"""Cases that contain every pair of values of several axes: few, where the product is vast."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from random import Random

Case = dict[str, str]
Pair = frozenset[tuple[str, str]]
TRIES = 30
"""Random orders of the axes, of which the one that covers most pairs becomes a case."""


def pairs_of(case: Case) -> set[Pair]:
    """The pairs of values that a case contains."""
    return {frozenset(pair) for pair in itertools.combinations(case.items(), 2)}


def all_pairs(axes: Mapping[str, Sequence[str]], left_out: set[Pair]) -> set[Pair]:
    """Every pair of values of two axes but for those that are left out."""
    found: set[Pair] = set()
    for (one, first), (other, second) in itertools.combinations(axes.items(), 2):
        found |= {frozenset([(one, x), (other, y)]) for x in first for y in second}
    return found - left_out


def pairwise(
    axes: Mapping[str, Sequence[str]], left_out: set[Pair] = frozenset(), seed: int = 0
) -> list[Case]:
    """Cases that contain every pair but those left out, which none contains. Greedy and seeded.

    Raises ValueError for a pair that no case without a pair left out can contain.
    """
    random, missing, cases = Random(seed), all_pairs(axes, left_out), list[Case]()
    while missing:
        first = min(missing, key=sorted)
        tries = (_case(axes, first, missing, left_out, random) for _ in range(TRIES))
        found = [case for case in tries if case is not None]
        if not found:
            raise ValueError(f"no case contains {sorted(first)}")
        best = max(found, key=lambda case: len(pairs_of(case) & missing))
        cases.append(best)
        missing -= pairs_of(best)
    return cases


def _case(
    axes: Mapping[str, Sequence[str]],
    first: Pair,
    missing: set[Pair],
    left_out: set[Pair],
    random: Random,
) -> Case | None:
    """A case with a pair, each further value being the one that covers most; None if stuck."""
    case = dict(first)
    rest = [axis for axis in axes if axis not in case]
    random.shuffle(rest)
    for axis in rest:

        def gain(value: str, axis: str = axis) -> tuple[int, float]:
            new = {frozenset([(axis, value), item]) for item in case.items()}
            return len(new & missing), random.random()

        allowed = [
            value
            for value in axes[axis]
            if not any(frozenset([(axis, value), item]) in left_out for item in case.items())
        ]
        if not allowed:
            return None
        case[axis] = max(allowed, key=gain)
    return {axis: case[axis] for axis in axes}


def product(axes: Mapping[str, Sequence[str]]) -> Callable[[], list[Case]]:
    """All cases, when they are called for."""
    return lambda: [
        dict(zip(axes, values, strict=True)) for values in itertools.product(*axes.values())
    ]
