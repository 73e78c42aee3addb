"""Strange inputs by the hundred: each is refused in a sentence, or is what it says."""

from __future__ import annotations

import tempfile
from pathlib import Path
from random import Random
from types import ModuleType

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hard import mutated_motion, mutated_scene, mutated_urdf
from hard.verdict import Verdict

MUTATED = (mutated_urdf, mutated_scene, mutated_motion)
GOOD = (Verdict.REFUSED, Verdict.ACCEPTED)


def fuzz(module: ModuleType, random: Random) -> None:
    """One input, with a verdict that says what is wrong."""
    mutant = module.mutate(random)
    with tempfile.TemporaryDirectory() as folder:
        verdict, why = module.verdict(mutant, Path(folder))
    assert verdict in GOOD, why


SETTINGS = settings(
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)


@pytest.mark.parametrize("module", MUTATED, ids=lambda module: module.__name__)
@settings(SETTINGS, max_examples=60)
@given(random=st.randoms(use_true_random=False))
def test_whatever_hypothesis_makes_is_refused_or_is_what_it_says(
    module: ModuleType, random: Random
) -> None:
    fuzz(module, random)


@pytest.mark.long
@pytest.mark.parametrize("module", MUTATED, ids=lambda module: module.__name__)
@settings(SETTINGS, max_examples=5_000)
@given(random=st.randoms(use_true_random=False))
def test_whatever_hypothesis_makes_in_minutes_is_refused_as_well(
    module: ModuleType, random: Random
) -> None:
    fuzz(module, random)
