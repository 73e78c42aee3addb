"""The public API refuses what means nothing, in one sentence."""

from __future__ import annotations

import json
from random import Random

import numpy as np
import pytest

import hovi
from hard.api_calls import WRONG, calls, mutate, problem, robot, scene, solution, verdict_on
from hard.verdict import Verdict
from hovi.errors import HoviError, InputError

GOOD = (Verdict.REFUSED, Verdict.ACCEPTED)
LEFT_OUT = {
    # results, which hovi makes
    *("Accuracy", "Certificate", "Flow", "MotionError", "Iterate", "Simulation", "Solution"),
    *("Status", "Tolerance", "Tracking", "Robot", "HoviError"),
    *("Extreme", "Extremes", "LimitSet", "LimitSource", "MujocoReplay"),
    # abstract
    "Function",
    # needs an optional library, and has tests of its own
    "replay_in_mujoco",
    # packages, of which the members are called
    *("accuracy", "conditions", "effects", "methods", "schemes", "symbolic"),
}


@pytest.fixture(params=list(calls()))
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def test_the_calls_are_valid(name: str) -> None:
    calls()[name]()


@pytest.mark.filterwarnings("ignore")
def test_another_argument_is_refused_or_harmless(name: str) -> None:
    for place in calls()[name].places:
        for number in range(len(WRONG)):
            found, why = verdict_on(name, place, number)
            assert found in GOOD, why


def test_every_public_function_and_class_is_called() -> None:
    called = {name.split()[0].split(".")[0] for name in calls()}
    called |= {each.function.__module__.rpartition(".")[2] for each in calls().values()}
    public = {name for name in dir(hovi) if not name.startswith("_")} - LEFT_OUT
    assert public <= called
    assert {each.__name__ for each in hovi.effects.REGISTRY.values()} - {"Jet"} <= called
    assert set(hovi.conditions.__all__) - {"EndPoses", "Keep", "Pose"} <= called
    assert set(hovi.symbolic.__all__) - {"RigidBody"} <= called


@pytest.mark.parametrize(
    "method",
    [
        *("values", "action", "expand", "gradient", "jets", "turns", "momenta", "derivatives"),
        *("point_gradients", "duration_derivative"),
    ],
)
@pytest.mark.parametrize("intervals", [1, 3, 5, 20])
def test_a_path_of_another_length_is_refused(method: str, intervals: int) -> None:
    """It was read beyond its end."""
    grid = hovi.Grid.uniform(1.0, intervals, hovi.schemes.by_name("galerkin-2"))
    other = problem().on(grid)
    path = hovi.solve(other, max_iterations=1).trajectory.path
    with pytest.raises(InputError, match=r"path's q must have shape \(5, 2\) on this grid of 4"):
        getattr(problem().ld, method)(path)


@pytest.mark.parametrize("name", ["q", "v", "z", "inner"])
def test_a_path_whose_arrays_do_not_fit_each_other_is_refused(name: str) -> None:
    path = solution().trajectory.path
    for change in (lambda x: x[:-1], lambda x: x[..., :1], lambda x: x[None], lambda x: x[:, :0]):
        arrays = dict(zip(("q", "v", "z", "inner"), path.arrays, strict=True))
        arrays[name] = change(arrays[name])
        with pytest.raises(InputError, match=f"path's {name} must have shape"):
            problem().ld.values(hovi.DiscretePath(**arrays))


def test_jets_of_another_path_are_refused() -> None:
    path, ld = solution().trajectory.path, problem().ld
    for wrong in ([ld.jets(path)[0][:2]], ld.jets(path) * 2, [(np.zeros((3, 2)),) * 3]):
        with pytest.raises(InputError, match="the jets are not at this path's points"):
            ld.values(path, wrong)


def test_a_number_of_starts_beyond_any_is_refused() -> None:
    for starts in (10**30, True, "4", 0, None):
        with pytest.raises(HoviError, match="`starts` must be a whole number"):
            hovi.plan(scene(), [0, 0], [0.3, 0.7], 1.0, starts=starts)  # type: ignore[arg-type]


def test_intervals_that_are_no_number_are_refused() -> None:
    for intervals in (True, "16", [16], 2.5):
        for call in (
            lambda n: hovi.plan(scene(), [0, 0], [0.3, 0.7], 1.0, intervals=n),
            lambda n: hovi.simulate(scene(), [0, 0], 1.0, intervals=n),
            lambda n: hovi.Grid.uniform(1.0, n, hovi.schemes.by_name("galerkin-2")),
        ):
            with pytest.raises(InputError, match=r"intervals`? must be a whole number"):
                call(intervals)


def test_a_joint_that_does_not_exist_is_refused() -> None:
    with pytest.raises(InputError, match="v has entries 0 to 1, not 2"):
        robot().joint_at(2)


def test_the_fuzzer_changes_an_argument_of_every_call_that_has_one() -> None:
    chosen = {json.loads(mutate(Random(i)).content)[0] for i in range(5_000)}
    assert chosen == {name for name, each in calls().items() if each.places}
