"""Fuzzing: every mutated file or call is refused with one sentence, or right."""

from __future__ import annotations

import tempfile
from pathlib import Path
from random import Random
from types import ModuleType

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hard import (
    api_calls,
    compiled_calls,
    grammar_scenes,
    mutated_command,
    mutated_mesh,
    mutated_mjcf,
    mutated_motion,
    mutated_motion_meshes,
    mutated_obstacles,
    mutated_request,
    mutated_scene,
    mutated_segments,
    mutated_study,
    mutated_surface,
    mutated_urdf,
)
from hard.verdict import Verdict

MUTATED = (
    mutated_urdf,
    mutated_scene,
    grammar_scenes,
    mutated_motion,
    mutated_motion_meshes,
    mutated_segments,
    mutated_mesh,
    mutated_mjcf,
    mutated_surface,
    mutated_obstacles,
    mutated_request,
    mutated_study,
    mutated_command,
    compiled_calls,
    api_calls,
)
GOOD = (Verdict.REFUSED, Verdict.ACCEPTED)


def fuzz(module: ModuleType, random: Random) -> None:
    """Load or call one mutated input; fails with the reason if the verdict is a fault."""
    mutant = module.mutate(random)
    with tempfile.TemporaryDirectory() as folder:
        verdict, reason = module.verdict(mutant, Path(folder))
    assert verdict in GOOD, reason


SETTINGS = settings(
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)


@pytest.mark.parametrize("module", MUTATED, ids=lambda module: module.__name__)
@settings(SETTINGS, max_examples=60)
@given(random=st.randoms(use_true_random=False))
def test_mutated_inputs_are_refused_or_right(module: ModuleType, random: Random) -> None:
    fuzz(module, random)


@pytest.mark.long
@pytest.mark.parametrize("module", MUTATED, ids=lambda module: module.__name__)
@settings(SETTINGS, max_examples=5_000)
@given(random=st.randoms(use_true_random=False))
def test_many_mutated_inputs_are_refused_or_right(module: ModuleType, random: Random) -> None:
    fuzz(module, random)
