"""A weight given with a plan replaces that of the scene's effect, and the message says so."""

from __future__ import annotations

import hovi

SENTENCE = "The option weight takes the place of the scene's effect 'effort_weight'."


def planned(effects: list[hovi.effects.Effect], **options: object) -> hovi.Solution:
    scene = hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")), effects)
    return hovi.plan(scene, [0.0, 0.0], [0.3, 0.7], 1.0, intervals=8, limits="none", **options)


def test_the_message_says_that_the_weight_of_the_scene_does_not_count() -> None:
    own, other = hovi.effects.EffortWeight((1.0, 2.0)), hovi.effects.EffortWeight((50.0, 1.0))
    replaced = planned([other], weight=[1.0, 2.0])
    assert replaced.cost == planned([own]).cost
    assert SENTENCE in replaced.message
    for silent in (planned([own]), planned([]), planned([], weight=[1.0, 2.0])):
        assert SENTENCE not in silent.message
