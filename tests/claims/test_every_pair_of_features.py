"""Every pair of 22 features: a right motion, or one of the known refusals in a sentence.

`pytest -s tests/claims/test_every_pair_of_features.py` prints the pairs that are refused.
"""

from __future__ import annotations

import pytest

from samples.asked_features import FEATURES, PAIRS, AskedFeatures, planned_with
from samples.feature_judge import distances, judged, outcome

pytestmark = pytest.mark.filterwarnings("ignore::hovi.errors.HoviWarning")
REFUSED = {
    ("smooth", "free-flyer"),
}
"""The pairs that hovi refuses, in the order of FEATURES: leave out the one that no longer is."""


@pytest.mark.parametrize("feature", FEATURES[:-1])
def test_every_pair_gives_a_right_motion_or_is_known_to_be_refused(feature: str) -> None:
    wrong, refused = list[str](), set[tuple[str, str]]()
    for pair in (each for each in PAIRS if each[0] == feature):
        reason, fault = outcome(pair)
        if reason:
            refused.add(pair)
            print(f"| {pair[0]} | {pair[1]} | {reason} |")
            wrong += [f"{pair}: {reason!r} is no sentence"] * ("\n" in reason or len(reason) > 500)
        if fault:
            wrong.append(f"{pair}: {fault}")
    assert not wrong, "\n".join(wrong)
    assert refused == {each for each in REFUSED if each[0] == feature}


@pytest.mark.long
@pytest.mark.parametrize("call", ["replan", "advance"])
@pytest.mark.parametrize("feature", FEATURES[:-1])
def test_every_pair_goes_on_and_is_planned_again(feature: str, call: str) -> None:
    """Triples with a call, but for those with a pair that is refused."""
    triples = [pair for pair in PAIRS if pair[0] == feature and call not in pair]
    found = {pair: outcome((*pair, call)) for pair in triples if pair not in REFUSED}
    wrong = [f"{pair}: {reason or fault}" for pair, (reason, fault) in found.items()]
    assert not [each for each in wrong if not each.endswith(": ")], "\n".join(wrong)


def test_there_are_22_features() -> None:
    assert len(FEATURES) == 22
    assert len(PAIRS) == 231
    assert set(PAIRS) >= REFUSED


WRONG = {
    **{"limits": "limits", "via": "via", "obstacle": "distances", "moving obstacle": "distances"},
    **{"segments": "duration", "time-dependent effect": "torques", "grasped": "torques"},
    **{"tolerance": "tolerance", "friction": "torques", "payload": "torques"},
}
"""What the judge says first of a plain motion that should have a feature."""


@pytest.mark.parametrize("feature", WRONG)
def test_the_judge_notices_that_a_feature_is_missing(feature: str) -> None:
    found = planned_with(AskedFeatures.of())
    assert judged(AskedFeatures.of(), found) == ""
    assert judged(AskedFeatures.of(feature), found).startswith(f"{WRONG[feature]}: ")


def test_the_judge_knows_the_time_at_which_an_obstacle_passes() -> None:
    asked = AskedFeatures.of("moving obstacle")
    found = planned_with(asked)
    assert judged(asked, found, goal=asked.q1 + 1e-4).startswith("goal: ")
    assert distances(asked, found.trajectory, 0.0) == ""
    assert distances(asked, found.trajectory, 0.3) != ""
