"""A torque or a cost that is not a number is no matter of limits, whichever method meets it."""

from __future__ import annotations

import numpy as np
import pytest

from hovi import Status, plan
from hovi.effects import Custom, Effect
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene

TIME = "log(t - 2)"  # never defined
ELBOW = 'sqrt(q["elbow"] - 0.1)'  # not where the motion begins


@pytest.mark.parametrize("limits", ["none", "urdf", {"tau": 50.0}, {"v": 5.0}], ids=str)
@pytest.mark.parametrize("passive", [(), ("shoulder",)], ids=["actuated", "passive"])
@pytest.mark.parametrize(
    ("effect", "words"),
    [
        (Custom({"elbow": TIME}), "the torque of joint 'elbow' is nan at t = 0.0"),
        (Custom({"elbow": ELBOW}), "the torque of joint 'elbow' is nan at t = 0.0"),
        (Custom(cost=ELBOW), "the cost is nan at t = 0.0"),
    ],
    ids=["time", "elbow", "cost"],
)
def test_what_is_not_a_number_is_named_and_nothing_else(
    two_link: Robot, effect: Effect, words: str, passive: tuple[str, ...], limits: object
) -> None:
    scene = Scene(two_link, [effect], passive=passive)
    options = {"intervals": 8, "limits": limits, "continuation": False}
    solution = plan(scene, [0.0, 0.0], [0.3, 0.7], 1.0, **options)
    assert (solution.success, solution.status) == (False, Status.DIVERGED)
    assert solution.message.startswith(words)
    assert "limit" not in solution.message
    assert np.isnan(solution.cost)


def test_a_torque_that_is_not_a_number_between_the_points_breaks_no_limit(two_link: Robot) -> None:
    """On eight intervals of two points the first point is at 26 ms."""
    scene = Scene(two_link, [Custom({"elbow": "sqrt(t - 0.003)"})])
    options = {"intervals": 8, "limits": "urdf", "continuation": False}
    options |= {"scheme": "galerkin-2"}
    solution = plan(scene, [0.0, 0.0], [0.3, 0.7], 1.0, **options)
    assert solution.status is Status.DIVERGED
    assert "joint 'elbow' reaches nan N m at t = 0 s" in solution.message
    assert "between the quadrature points" in solution.message


@pytest.mark.filterwarnings("ignore:holding the robot still")
def test_a_motion_that_the_limits_forbid_is_still_infeasible(two_link: Robot) -> None:
    scene = Scene(two_link, [Custom({"elbow": "exp(t)"})])
    options = {"intervals": 8, "limits": {"tau": 0.01}, "continuation": False}
    solution = plan(scene, [0.0, 0.0], [0.3, 0.7], 1.0, **options)
    assert solution.status is Status.INFEASIBLE
