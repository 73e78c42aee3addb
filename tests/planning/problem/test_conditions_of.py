"""All that is asked of a motion is one list of functions, sets and places."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import hovi
from hovi.conditions.function import Function, Points
from hovi.conditions.joint_quantity import DERIVATIVES, QUANTITIES, JointQuantity
from hovi.conditions.state_difference import StateDifference
from hovi.planning.clearance.distances import distances_between
from hovi.planning.problem.conditions_of import conditions_of, ends_of
from hovi.planning.problem.pair_distances import PairDistances
from hovi.schemes import galerkin

STEP = 1e-6
TURN = np.diag([-1.0, -1.0, 1.0])


@pytest.fixture(scope="module")
def scene() -> hovi.Scene:
    robot = hovi.load_robot(hovi.example("two_link.urdf"))
    return hovi.Scene(robot, [hovi.effects.Gravity(9.8)])


def problem_of(scene: hovi.Scene, **asked: object) -> hovi.TrajectoryProblem:
    grid = hovi.Grid.uniform(1.0, 8, galerkin(1))
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
    return hovi.TrajectoryProblem(ld, hovi.State([0.0, 0.0]), hovi.State([0.7, 0.9]), **asked)  # type: ignore[arg-type]


def kinds(problem: hovi.TrajectoryProblem) -> list[tuple[str, str, str]]:
    parts = ((each.y, each.on, each.where) for each in conditions_of(problem))
    return [tuple(type(part).__name__ for part in each) for each in parts]  # type: ignore[misc]


def test_every_kind_of_what_is_asked_is_in_the_list(scene: hovi.Scene) -> None:
    robot = scene.robot
    limits = hovi.as_limits(robot, {"base": "none", "v": 3.0, "tau": 40.0, "power": 90.0})
    ball = hovi.Clearance([hovi.Sphere([0.0, 0.6, 0.0], 0.05, name="ball")])
    low = hovi.Condition('position["tip", "z"]', hovi.Between(upper=3.0), name="height")
    via = (hovi.Via(0.5, hovi.State([0.3, 0.4])),)
    whole = problem_of(scene, limits=limits, clearance=ball, conditions=[low], via=via)
    assert kinds(whole) == [
        ("StateDifference", "Equal", "AtNode"),
        ("StateDifference", "Equal", "AtNode"),
        ("StateDifference", "Equal", "AtNode"),
        ("JointQuantity", "LimitRange", "ControlPoints"),
        ("JointQuantity", "LimitRange", "AtPoints"),
        ("Expression", "Between", "AtPoints"),
        ("Expression", "Between", "AtPoints"),
        ("PairDistances", "Between", "Exchange"),
    ]
    assert [each.where.given for each in ends_of(whole)] == [True, True]
    hinge = problem_of(dataclasses.replace(scene, passive=("elbow",)))
    assert kinds(hinge)[2:] == [("JointQuantity", "Equal", "Along")]


def sequence(scene: hovi.Scene, elbow: float) -> hovi.Solution:
    parts = [hovi.Segment(goal, 0.5) for goal in ([0.3, elbow], [0.7, 0.9])]
    return hovi.plan_sequence(scene, [0.0, 0.0], parts, limits="none", intervals=8)


def test_a_motion_is_asked_to_pass_what_its_seams_hold(scene: hovi.Scene) -> None:
    found, other = sequence(scene, 0.4), sequence(scene, 0.6)
    assert found.usable
    missed = dataclasses.replace(other, problem=found.problem).violation
    assert missed == "the motion passes t = 0.5 s 0.2 rad from the position of 'elbow'"


def test_a_frame_half_a_turn_from_its_goal_misses_it(scene: hovi.Scene) -> None:
    """There what is equated to zero vanishes as well."""
    found = hovi.plan(scene, [0.0, 0.0], [0.7, 0.9], 1.0, limits="none", intervals=8)
    problem = found.problem
    assert problem is not None
    R = scene.robot.frame_pose("tip", found.trajectory.sample([0.5]).q[0])[:3, :3]
    axis = np.linalg.svd(R - R.T)[2][-1]  # of the joints, which all turn about one
    for turned, missed in ((np.eye(3), False), (2 * np.outer(axis, axis) - np.eye(3), True)):
        via = (hovi.Via(0.5, hovi.FrameGoal("tip", rotation=turned @ R)),)
        other = dataclasses.replace(found, problem=dataclasses.replace(problem, via=via))
        assert ("is missed: frame 'tip'" in other.violation) == missed


FUNCTIONS = [*QUANTITIES, "distance", "state"]


@pytest.mark.parametrize("name", FUNCTIONS)
def test_slopes_are_those_of_finite_differences(name: str, ur5: hovi.Robot) -> None:
    random, n = np.random.default_rng(5), ur5.nv
    x = {key: random.uniform(-1, 1, (3, n)) for key in QUANTITIES}
    function: Function = JointQuantity(name, np.array([1, 4]))
    if name == "distance":
        ball = hovi.Clearance([hovi.Sphere([0.6, 0.3, 0.9], 0.05, name="ball")])
        function = PairDistances(distances_between(ur5, ball))
    elif name == "state":
        jet = [random.uniform(-1, 1, n) for _ in DERIVATIVES]
        function = StateDifference(ur5, jet, random.uniform(size=(4, n)) < 0.7)

    def values(**changed: np.ndarray) -> np.ndarray:
        at = {**x, **changed}
        return function.values(Points(t=np.zeros(3), **at))

    slopes = function.slopes(Points(t=np.zeros(3), **x))
    assert set(slopes) == function.needs - {"t"}
    for key, J in slopes.items():
        for i in range(n):
            e = STEP * np.eye(n)[i]
            numeric = (values(**{key: x[key] + e}) - values(**{key: x[key] - e})) / (2 * STEP)
            np.testing.assert_allclose(J[:, :, i], numeric, atol=1e-7)
