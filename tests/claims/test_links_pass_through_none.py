"""Links do not pass through each other while a motion clear of them is looked for."""

from __future__ import annotations

import numpy as np

import hovi
from hovi.planning.clearance.distances import Distances

START = [0.0, -0.5, 0.0, -2.0, 0.0, 1.6, 0.7]
GOAL = [0.9, 0.3, -0.4, -1.2, 0.5, 2.2, -0.3]
MARGIN = 0.01


def test_a_motion_whose_cheapest_ways_lead_through_the_shoulder_is_found() -> None:
    """Of a Panda without limits, whose wrist is dear.

    Where a step may take the fifth link through the second one, the solve does not come back.
    """
    robot = hovi.load_robot("panda", locked=["panda_finger_joint1", "panda_finger_joint2"])
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    weight = [1, 1, 1, 1, 100, 100, 100]
    given = {"limits": "none", "weight": weight, "processes": 1}
    through = hovi.plan(scene, START, GOAL, 1.5, self_collision=False, **given)
    found = hovi.plan(scene, START, GOAL, 1.5, margin=MARGIN, **given)
    assert found.success, found.message
    distances = Distances(robot, hovi.Clearance(self_collision=True))
    least = {
        name: distances.values(each.trajectory.configurations(np.linspace(0.0, 1.5, 5_001))).min()
        for name, each in (("through", through), ("clear", found))
    }
    assert least["through"] < 0.0
    assert least["clear"] > MARGIN - 1e-6
