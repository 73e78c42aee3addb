"""Self-collision of a robot without pairs, among obstacles out of its reach, is no crash."""

from __future__ import annotations

import hovi
from hovi.errors import ModelError


def test_links_without_pairs_and_an_obstacle_out_of_reach_are_refused_or_change_nothing() -> None:
    scene = hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")))
    ends, far = ([0.1, 0.2], [0.2, 0.1]), hovi.Sphere([5.0, 0.0, 0.0], 0.1)
    alone = hovi.plan(scene, *ends, 1.0, self_collision=False)
    try:
        both = hovi.plan(scene, *ends, 1.0, obstacles=[far], self_collision=True)
    except ModelError as refused:
        assert "has no pair of shapes that can collide" in str(refused)  # noqa: PT017 - either
        return
    assert both.success
    assert both.cost == alone.cost
