"""Self-collision of a robot without pairs, among obstacles out of its reach, changes nothing."""

from __future__ import annotations

import hovi


def test_links_without_pairs_and_an_obstacle_out_of_reach_change_nothing() -> None:
    scene = hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")))
    ends, far = ([0.1, 0.2], [0.2, 0.1]), hovi.Sphere([5.0, 0.0, 0.0], 0.1)
    alone = hovi.plan(scene, *ends, 1.0, self_collision=False)
    both = hovi.plan(scene, *ends, 1.0, obstacles=[far], self_collision=True)
    assert both.success
    assert both.cost == alone.cost
