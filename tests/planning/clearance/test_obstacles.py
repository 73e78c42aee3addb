"""Obstacles and clearance as values: their fields, and the input that they refuse."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

import hovi
from hovi.errors import InputError
from hovi.planning.clearance.clearance import Clearance
from hovi.planning.clearance.obstacles import (
    KINDS,
    Box,
    Capsule,
    Obstacle,
    Sphere,
    obstacle_from_dict,
)
from hovi.planning.obstacles.obstacle import SYNONYMS

ALL = [
    Sphere([0.1, 0.2, 0.3], 0.1, name="ball"),
    Capsule([[0, 0, 0], [0, 0.3, 0.4]], 0.05),
    Box((1.0, 2.0, 0.1), np.array([0.0, 0.0, -0.1]), rpy=[0.0, 0.0, math.pi / 2]),
]


@pytest.mark.parametrize("obstacle", ALL, ids=lambda each: each.kind)
def test_an_obstacle_comes_back_from_json(obstacle: Obstacle) -> None:
    again = obstacle_from_dict(json.loads(json.dumps(obstacle.to_dict())))
    assert again == obstacle
    assert hash(again) == hash(obstacle)


@pytest.mark.parametrize("ends", [[[0, 0, 0], [0, 0.3, 0.4]], [[1, -2, 0.5], [1.6, -2, 1.3]]])
def test_a_capsule_lies_along_its_ends(ends: list[list[float]]) -> None:
    capsule = Capsule(ends, 0.05)
    ((shape, placement),) = capsule.bodies()
    half = shape.halfLength
    assert half == pytest.approx(0.5 * math.dist(*ends))
    found = [placement.act(np.array([0.0, 0.0, z])) for z in (-half, half)]
    np.testing.assert_allclose(found, ends, atol=1e-15)


def test_a_box_is_turned_as_in_a_urdf() -> None:
    corner = ALL[2].bodies()[0].placement.act(np.array([0.5, 1.0, 0.05]))
    np.testing.assert_allclose(corner, [-1.0, 0.5, -0.05], atol=1e-15)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Sphere([0, 0], 0.1), "`position` of a sphere must be 3 finite numbers"),
        (lambda: Sphere([0, 0, np.nan], 0.1), "`position` of a sphere must be 3 finite numbers"),
        (lambda: Sphere([0, 0, 0], -0.1), "`radius` of a sphere must be positive"),
        (lambda: Sphere([0, 0, 0], "wide"), "`radius` of a sphere must be a number"),
        (lambda: Box([1, 0, 1], [0, 0, 0]), "`size` of a box must be positive"),
        (lambda: Capsule([[0, 0, 0], [0, 0, 0]], 0.1), "ends of a capsule coincide"),
        (lambda: obstacle_from_dict({"kind": "spere"}), "did you mean 'sphere'"),
        (lambda: obstacle_from_dict({"kind": {"elbow": 1.0}}), "no obstacle of kind {"),
        (lambda: obstacle_from_dict({"kind": "box", "sise": 1}), "did you mean 'size'"),
        (lambda: obstacle_from_dict({"kind": "box", "size": [1, 1, 1]}), "needs `position`"),
        (lambda: Clearance([ALL[0], ALL[0]]), "two obstacles have the name 'ball'"),
        (lambda: Clearance(["ball"]), "an obstacle must be a hovi.Sphere"),
        (lambda: Clearance(margin=-0.1), "a length of 0 or more"),
        (lambda: Clearance(margin="wide"), "a length of 0 or more"),
    ],
)
def test_an_invalid_obstacle_is_refused_in_one_sentence(make: object, words: str) -> None:
    with pytest.raises(InputError, match=words):
        make()  # type: ignore[operator]


@pytest.mark.parametrize("word", SYNONYMS)
def test_another_word_for_a_kind_leads_to_that_kind_alone(word: str) -> None:
    meant = SYNONYMS[word]
    assert meant in KINDS
    for each in (word, word.capitalize()):
        with pytest.raises(InputError, match=f"of kind '{each}': did you mean '{meant}'\\?$"):
            obstacle_from_dict({"kind": each})


def test_another_word_leads_to_no_shape_that_a_grasped_object_cannot_have() -> None:
    for word, hint in (("cuboid", r"did you mean 'box'\?$"), ("floor", "valid names are 'box', ")):
        with pytest.raises(InputError, match=f"of kind '{word}': {hint}"):
            hovi.Grasped({"kind": word}, "tip", 1.0)


def test_obstacles_without_names_are_numbered_and_come_back_from_json() -> None:
    clearance = Clearance(ALL, 0.02, self_collision=True)
    assert [each.name for each in clearance.obstacles] == ["ball", "capsule 2", "box 3"]
    again = Clearance.from_dict(json.loads(json.dumps(clearance.to_dict())))
    assert again.obstacles == clearance.obstacles
    assert (again.margin, again.self_collision) == (0.02, True)


def test_a_single_obstacle_needs_no_list() -> None:
    assert Clearance(ALL[0]).obstacles == (ALL[0],)
    assert not Clearance().wanted
