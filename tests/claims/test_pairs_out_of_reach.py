"""Self-collision of a robot without pairs is refused in a sentence, with and without obstacles."""

from __future__ import annotations

import pytest

import hovi
from hovi.errors import ModelError


@pytest.mark.parametrize("obstacles", [[], [hovi.Sphere([5.0, 0.0, 0.0], 0.1)]])
def test_links_without_pairs_are_refused_where_they_are_to_be_kept_apart(
    obstacles: list[hovi.Sphere],
) -> None:
    scene = hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")))
    ends = ([0.1, 0.2], [0.2, 0.1])
    with pytest.raises(ModelError, match="has no pair of shapes that can collide"):
        hovi.plan(scene, *ends, 1.0, obstacles=obstacles, self_collision=True)


def test_an_obstacle_out_of_reach_changes_no_cost() -> None:
    scene = hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")))
    ends = ([0.1, 0.2], [0.2, 0.1])
    alone, both = (
        hovi.plan(scene, *ends, 1.0, obstacles=obstacles)
        for obstacles in ([], [hovi.Sphere([5.0, 0.0, 0.0], 0.1)])
    )
    assert both.success
    assert both.cost == alone.cost
