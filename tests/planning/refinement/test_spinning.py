"""Light joints that spin without limits are named, with what helps."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

import hovi
from hovi.planning.problem.tolerance import Tolerance
from oracles.on_grid import solve_on_grid

Array = npt.NDArray[np.float64]

UR5_REACH = [1.46, -2.7, 1.45, 1.55, 2.1, -1.61], [2.5, 2.36, 0.25, -0.95, 2.2, 1.59], 3.89
SO100_REACH = [0.886, 1.65, -2.167, -0.702, 2.447], [1.311, 1.387, -1.757, -1.005, 1.52], 3.722
XARM_REACH = [0.3, -0.6, 0.5, 0.8, 0.2, 0.4, -0.3], [-0.9, 0.4, -0.8, 1.6, 1.2, 1.3, 1.5], 3.0


def on_quarters(found: hovi.Solution) -> hovi.Solution:
    """The solution from a motion on intervals of a quarter of its own."""
    assert found.problem is not None
    return solve_on_grid(found.problem.on(found.problem.grid.halved().halved()), found.trajectory)


@pytest.fixture(scope="module")
def xarm() -> hovi.Scene:
    return hovi.Scene(hovi.load_robot("xarm7"), [hovi.effects.Gravity()])


def test_a_spinning_wrist_is_named_with_its_inertia(xarm: hovi.Scene) -> None:
    found = hovi.plan(xarm, *XARM_REACH, limits="none", self_collision=False)
    (said,) = [each for each in found.trajectory.cautions if "spins" in each]
    named = re.search(r"Joint '(\S+)' spins at up to (\S+) rad/s with an inertia of (\S+) kg", said)
    assert named is not None
    joint = xarm.robot.coordinate_names.index(named[1])
    motion = found.trajectory.sample(np.linspace(0.0, 3.0, 20_001))
    assert float(named[2]) == pytest.approx(np.abs(motion.v[:, joint]).max(), rel=0.05)
    model = xarm.robot.model.copy()
    model.armature = np.zeros(model.nv)
    mass = [pin.crba(model, model.createData(), q)[joint, joint] for q in found.trajectory.q]
    assert float(named[3]) == pytest.approx(min(mass), rel=0.05)
    for remedy in ("limits", "armature", "acceleration_cost"):
        assert remedy in said


def test_each_remedy_helps(xarm: hovi.Scene) -> None:
    gravity, robot = hovi.effects.Gravity(), xarm.robot
    rotors = hovi.Scene(robot, [gravity, hovi.effects.Armature(0.1)])
    smooth = hovi.Scene(robot, [gravity, hovi.effects.AccelerationCost(0.05)])
    for scene, limits in ((xarm, "urdf"), (rotors, "none"), (smooth, "none")):
        found = hovi.plan(scene, *XARM_REACH, limits=limits, self_collision=False)
        assert found.success, found.message
        assert not any("spins" in said for said in found.trajectory.cautions)


def test_info_names_light_joints_beforehand(xarm: hovi.Scene) -> None:
    assert "little inertia about joint7 (0.00014 kg m^2)" in xarm.robot.describe()
    rotors = hovi.load_robot("talos_arm")  # its model has rotors in the arm, none in the gripper
    assert "gripper_left_joint (0.0012 kg m^2)" in rotors.describe()
    assert "little inertia" not in hovi.load_robot(hovi.example("two_link.urdf")).describe()


def test_a_spinning_motion_that_a_finer_grid_leaves_is_no_minimum(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Two more modes change its cost by 0.5 %, intervals of a quarter by 3 %."""
    monkeypatch.setattr(Tolerance, "finer", ())  # `plan` goes on to these, which resolve another
    robot = hovi.load_robot("talos_arm", locked=["gripper_left_joint"])
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    start, goal = [1.82, 0.43, -1.69, -1.36, 0.09, -0.62], [0.48, 1.02, -0.76, -2.39, -0.94, 0.16]
    found = hovi.plan(
        scene, start, goal, 1.23, limits="none", processes=1, tolerance=0.03, self_collision=False
    )
    finer = on_quarters(found)
    assert finer.success
    assert finer.cost < 0.99 * found.cost
    assert found.status is hovi.Status.UNRESOLVED
    assert "rad/s" in found.message


@pytest.fixture(scope="module")
def spinning_z1() -> hovi.Solution:
    """Two more modes change its cost by 0.1 %; a grid that takes more steps leads elsewhere."""
    scene = hovi.Scene(hovi.load_robot("z1", locked=["jointGripper"]), [hovi.effects.Gravity()])
    start = [0.06222511, 1.94983376, -0.15340647, 1.26122452, 0.59194828, -2.10693647]
    goal = [2.14330674, 2.11635047, -1.8623539, -0.84617339, 1.11296258, 1.76312911]
    few = {"max_iterations": 250, "self_collision": False}
    return hovi.plan(scene, start, goal, 2.47673118403244, limits="none", processes=1, **few)


def test_a_later_grid_that_is_left_unfinished_refutes_an_estimate(
    spinning_z1: hovi.Solution,
) -> None:
    found, accuracy = spinning_z1, spinning_z1.accuracy
    assert found.status is hovi.Status.UNRESOLVED, found.message
    assert accuracy is not None
    assert found.problem is not None
    finer = found.problem.grid.intervals < np.array([done.intervals for done in accuracy.rounds])
    lower = np.array([done.cost for done in accuracy.rounds])[finer]
    assert len(lower) > 0
    assert np.isnan([done.error for done in accuracy.rounds])[finer].all()
    assert found.error_estimate == pytest.approx(found.cost / lower.min() - 1, rel=1e-3)


def planned_on_a_grid(robot: hovi.Robot, start: Array, goal: Array, T: float) -> hovi.Solution:
    """A motion without limits, on given intervals."""
    options: dict[str, Any] = {"limits": "none", "self_collision": False, "continuation": False}
    grid: dict[str, Any] = {"intervals": 20, "scheme": "galerkin-4x10", "processes": 1}
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    return hovi.plan(scene, start, goal, T, **options, **grid)


@pytest.mark.parametrize("seed", [5, 8, 11, 15, 21, 31])
@pytest.mark.parametrize("name", ["z1", "ur5", "xarm7"])
def test_a_success_in_a_valley_is_one_on_intervals_of_a_quarter(name: str, seed: int) -> None:
    """On given grids, without limits; a motion that is refused is no claim."""
    robot = hovi.load_robot(name)
    rng = np.random.default_rng(seed)
    start, goal = rng.uniform(-1.5, 1.5, (2, robot.nq))
    start, goal = (np.clip(q, 0.9 * robot.lower, 0.9 * robot.upper) for q in (start, goal))
    found = planned_on_a_grid(robot, start, goal, 3.0)
    if found.success:
        finer = on_quarters(found)
        assert finer.cost == pytest.approx(found.cost, rel=0.01)


def test_a_fast_spinning_motion_that_finer_grids_confirm_is_a_minimum() -> None:
    """A light wrist turns fast in it. Replanned farther away, it is compared anew."""
    scene = hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])
    start, goal, duration = UR5_REACH
    found = hovi.plan(
        scene, start, goal, duration, limits="none", processes=1, self_collision=False
    )
    assert found.success, found.message
    motion = found.trajectory.sample(np.linspace(0.0, duration, 5_001))
    assert np.abs(motion.v).max() * duration > 8 * np.pi
    assert on_quarters(found).cost == pytest.approx(found.cost, rel=1e-2)
    moved = found.replan(goal=np.add(goal, 2e-3))
    assert moved.error_estimate not in (found.error_estimate, 2 * (found.error_estimate or 0.0))


def test_a_motion_that_still_finer_grids_refute_is_no_minimum() -> None:
    robot = hovi.load_robot("xarm7")
    rng = np.random.default_rng(21)
    low, high = np.maximum(robot.lower, -2.5), np.minimum(robot.upper, 2.5)
    start, goal = (
        (low + high) / 2 + 0.6 * (high - low) / 2 * rng.uniform(-1, 1, robot.nq) for _ in range(2)
    )
    found = planned_on_a_grid(robot, start, goal, 2.0)
    assert found.status is hovi.Status.UNRESOLVED, found.message
    assert "rad/s a finer grid confirms it, but a still finer one does not" in found.message
    finer = on_quarters(found)
    assert abs(finer.cost / found.cost - 1) > 1e-3


def test_a_motion_that_finer_grids_move_ever_further_is_no_minimum(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Two more modes change its cost by 0.3 %, intervals of a quarter by 1.8 %, 37 rad away."""
    monkeypatch.setattr(Tolerance, "finer", ())
    scene = hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])
    start = [-2.07511832, 0.34060844, 0.34505737, 0.72300065, 1.97343618, -2.57173197]
    goal = [-2.09247888, -0.85894251, -2.42605944, -3.01370346, 2.55865486, 1.94229937]
    options = {"limits": "none", "processes": 1}
    found = hovi.plan(
        scene, start, goal, 4.190286081291065, tolerance=0.02, **options, self_collision=False
    )
    assert found.status is hovi.Status.UNRESOLVED, found.message
    assert "and a still finer one does not confirm that" in found.message
    finer = on_quarters(found)
    assert finer.success
    assert finer.cost < 0.99 * found.cost
    assert hovi.plan(scene, start, goal, 4.190286081291065, **options, self_collision=False).success


@pytest.mark.parametrize("tolerance", [1e-3, 1e-4])
def test_a_tolerance_is_claimed_in_a_flat_valley_only_as_halves_of_the_intervals_confirm_it(
    tolerance: float,
) -> None:
    """Two more modes move its light joints far at the same cost, and halves lower the cost."""
    scene = hovi.Scene(
        hovi.load_robot("so100", locked=["root_joint", "gripper"]), [hovi.effects.Gravity()]
    )
    start, goal, duration = SO100_REACH
    found = hovi.plan(
        *(scene, start, goal, duration),
        limits="none",
        tolerance=tolerance,
        self_collision=False,
        processes=1,
    )
    assert found.success, found.message
    assert found.accuracy is not None
    assert found.error_estimate is not None
    assert found.problem is not None
    halves = found.problem.grid.halved().enriched(4)
    lower = solve_on_grid(found.problem.on(halves), found.trajectory, max_iterations=2000).cost
    error = found.cost / lower - 1
    assert not found.accuracy.reached or error <= tolerance
    assert error <= found.error_estimate
