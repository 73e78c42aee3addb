"""Motions under equations by Newton's method: KKT, convergence, saddles, infeasibility."""

from __future__ import annotations

import dataclasses
from functools import cache
from itertools import pairwise
from pathlib import Path

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest
import scipy.linalg

import hovi
from hovi import Status, solve

SWING_UPS = ("acrobot_swing_up", "pendubot_swing_up", "cart_pole_swing_up")
SCHEMES = ("galerkin-2", "galerkin-2x8")
IPOPT = {
    "acrobot_swing_up": (58, 12.641),
    "pendubot_swing_up": (15, 21.911),
    "cart_pole_swing_up": (25, 24.396),
}
"""Steps of Ipopt on the same discrete problems, with `galerkin-2` on 40 intervals, and the cost of
a minimum near the cubic guess, which others may undercut."""
BUCKLING = (4 * np.pi**2, 80.763, 16 * np.pi**2)
"""Loads at which a straight rod of unit length and stiffness, clamped at both ends, loses
stability; the second and a repeated third one with its midpoint held as well."""


@cache
def swing_up(scene: str, scheme: str, intervals: int = 40) -> hovi.Solution:
    """A swing-up without limits, from the cubic guess."""
    task = hovi.load_task(hovi.example(scene))
    grid = hovi.Grid.uniform(task.duration, intervals, hovi.schemes.by_name(scheme))
    ld = hovi.DiscreteLagrangian(task.scene.effort_lagrangian(), grid)
    return solve(hovi.TrajectoryProblem(ld, task.start, task.goal))


@cache
def arm() -> hovi.Scene:
    return hovi.load_task(hovi.example("ur5_reach")).scene


def place(q: np.ndarray) -> np.ndarray:
    """Where the tool of the arm is."""
    model = arm().model
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    return data.oMf[model.getFrameId("tool0")].translation.copy()


def reach(
    goal: hovi.State | hovi.FrameGoal, via: tuple[hovi.Via, ...] = ()
) -> hovi.TrajectoryProblem:
    grid = hovi.Grid.uniform(1.5, 16, hovi.schemes.galerkin(2, points=8))
    ld = hovi.DiscreteLagrangian(arm().effort_lagrangian(), grid)
    return hovi.TrajectoryProblem(ld, hovi.State(np.zeros(6)), goal, via=via)


HALFWAY, END = np.array([0.5, -1.0, 0.8, 0.2, 0.3, 0.0]), np.array([0.9, -0.6, 0.4, 0.2, 0.3, 0.0])


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("scene", SWING_UPS)
def test_a_swing_up_takes_no_more_steps_than_one_and_a_half_times_ipopt(
    scene: str, scheme: str
) -> None:
    found = swing_up(scene, scheme)
    assert found.status in ("minimum", "unresolved")  # the acrobot's joint spins
    assert found.n_neg == 0
    steps, cost = IPOPT[scene]
    assert found.cost < 1.001 * cost
    most = 1.5 * steps if found.cost > 0.95 * cost else 100  # on the way to another minimum
    assert found.nit == len(found.history) <= most


@pytest.mark.parametrize("scene", SWING_UPS)
def test_the_number_of_steps_does_not_grow_with_the_grid(scene: str) -> None:
    coarse, fine = (swing_up(scene, "galerkin-2", N) for N in (40, 160))
    assert fine.cost == pytest.approx(coarse.cost, rel=1e-3)
    assert fine.nit <= coarse.nit + 8


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("scene", SWING_UPS)
def test_the_multipliers_make_the_action_stationary(scene: str, scheme: str) -> None:
    """The derivative of action + lambda . tau along random changes, by central differences."""
    found = swing_up(scene, scheme)
    problem, path = found.problem, found.trajectory.path
    assert problem is not None
    assert found.forces is not None
    model, data = problem.scene.model, problem.scene.model.createData()
    (passive,) = problem.passive
    (force,) = (each.output_gradient for each in found.forces)
    (weights,) = problem.ld.point_weights

    def lagrangian(moved: hovi.DiscretePath) -> tuple[float, float]:
        (jet,) = problem.ld.jets(moved)
        tau = np.array([pin.rnea(model, data, *x) for x in zip(*jet, strict=True)])
        effort = 0.5 * float(weights @ np.sum(np.delete(tau, passive, 1) ** 2, axis=1))
        return effort, float(weights @ (force[:, passive] * tau[:, passive]))

    t, T = problem.grid.t, problem.grid.duration
    base = problem.moved(path)
    assert lagrangian(base)[0] == pytest.approx(found.cost, rel=1e-12)
    for seed in range(3):
        shape = np.random.default_rng(seed).standard_normal((3, 2))

        def bent(size: float, shape: np.ndarray = shape) -> hovi.DiscretePath:
            s, k = t / T, np.arange(1, 4)[:, None]
            bell = (s * (1 - s)) ** 2
            slope = 2 * s * (1 - s) * (1 - 2 * s) / T
            wave, rate = np.sin(np.pi * k * s), np.pi * k / T * np.cos(np.pi * k * s)
            dq = np.einsum("kn,kt->tn", shape, bell * wave)
            dv = np.einsum("kn,kt->tn", shape, slope * wave + bell * rate)
            q, v, h = path.q + size * dq, path.v + size * dv, problem.grid.steps[:, None]
            dz0 = (dq[1:] - dq[:-1] - h * dv[:-1]) / h**2
            dz1 = (dv[1:] - dv[:-1]) / h
            z = path.z + size * np.stack([dz0, dz1], axis=1)
            return hovi.DiscretePath(q, v, z, path.inner)

        above, below = (lagrangian(bent(size)) for size in (1e-4, -1e-4))
        rates = (np.array(above) - np.array(below)) / 2e-4
        assert abs(rates.sum()) < 1e-5 * max(np.abs(rates).max(), found.cost)
        assert np.abs(rates).max() > 1e-3


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("scene", SWING_UPS)
def test_the_last_steps_converge_quadratically(scene: str, scheme: str) -> None:
    """Whole steps, whose decreases fall like squares down to rounding errors."""
    last = swing_up(scene, scheme).history[-3:]
    for before, after in pairwise(last):
        assert before.shift == after.shift == 0.0
        assert after.ratio == pytest.approx(1.0, abs=0.1)
        assert np.log(abs(after.decrease)) < 1.3 * np.log(before.decrease)
    assert abs(last[-1].decrease) < 1e-9


GANTRY = """<robot name="gantry"><link name="base"/>
  <link name="cart"><inertial><mass value="1"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <link name="load"><inertial><mass value="1"/>
    <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <joint name="drive" type="prismatic"><parent link="base"/><child link="cart"/>
    <axis xyz="1 0 0"/><limit lower="-9" upper="9" effort="9" velocity="9"/></joint>
  <joint name="spring" type="prismatic"><parent link="cart"/><child link="load"/>
    <axis xyz="1 0 0"/><limit lower="-9" upper="9" effort="9" velocity="9"/></joint></robot>"""
"""A cart with a sprung load of its mass, 1 kg: a linear system."""


def least_effort(k: float, T: float) -> float:
    """Half the integral of u^2 that moves the cart by 1 m in T, by its Gramian."""
    A, B = np.zeros((4, 4)), np.array([0.0, 0.0, 1.0, -1.0])
    A[[0, 1], [2, 3]], A[2:, 1] = 1.0, [k, -2.0 * k]
    both = np.block([[-A, np.outer(B, B)], [np.zeros((4, 4)), A.T]])
    flow = scipy.linalg.expm(T * both)
    gramian = flow[4:, 4:].T @ flow[:4, 4:]
    return 0.5 * float(np.linalg.inv(gramian)[0, 0])


@pytest.mark.parametrize("scheme", ["galerkin-0", "galerkin-2", "galerkin-2x8", "galerkin-4"])
@pytest.mark.parametrize("distance", [0.0, 1.0])
def test_a_linear_system_takes_one_step_to_its_minimum(
    tmp_path: Path, scheme: str, distance: float
) -> None:
    """The Hessian of its effort, which leaves out the passive joint's force, is singular."""
    (tmp_path / "gantry.urdf").write_text(GANTRY)
    robot = hovi.load_robot(tmp_path / "gantry.urdf")
    springs = hovi.effects.JointSprings([0.0, 10.0])
    scene = hovi.Scene(robot, [springs], passive=["spring"])
    grid = hovi.Grid.uniform(3.0, 48, hovi.schemes.by_name(scheme))
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
    problem = hovi.TrajectoryProblem(ld, hovi.State([0.0, 0.0]), hovi.State([distance, 0.0]))
    found = solve(problem)
    assert found.success, found.message
    assert found.n_neg == 0
    assert found.nit <= 3
    assert found.cost == pytest.approx(distance**2 * least_effort(10.0, 3.0), rel=1e-4)


@pytest.mark.parametrize("scene", SWING_UPS)
def test_a_solution_on_a_coarser_grid_is_followed_in_a_few_steps(scene: str) -> None:
    coarse = swing_up(scene, "galerkin-2")
    fine = swing_up(scene, "galerkin-2", 160).problem
    assert fine is not None
    found = solve(fine, coarse.trajectory)
    assert found.success
    assert found.cost == pytest.approx(coarse.cost, rel=1e-3)
    assert found.nit <= 6


@pytest.mark.parametrize("kind", ["pose", "position", "via"])
def test_momenta_change_at_a_frame_goal_by_forces_on_its_frame_alone(kind: str) -> None:
    """J^T f with the frame's Jacobian: the natural condition of what the goal leaves free."""
    if kind == "via":
        via = (hovi.Via(0.75, hovi.FrameGoal("tool0", position=place(HALFWAY))),)
        problem = reach(hovi.State(END), via)
    else:
        pose = tool(END)
        goal = {"pose": pose} if kind == "pose" else {"position": pose.translation}
        problem = reach(hovi.FrameGoal("tool0", **goal))
    found = solve(problem)
    assert found.usable, found.message
    assert found.n_neg == 0
    node = 8 if kind == "via" else 16
    target = HALFWAY if kind == "via" else END
    np.testing.assert_allclose(place(found.trajectory.q[node]), place(target), rtol=0, atol=1e-10)
    D = problem.ld.derivatives(found.trajectory.path)
    if kind == "via":
        change, rate = D[node - 1, 2] + D[node, 0], D[node - 1, 3] + D[node, 1]
        assert np.abs(rate).max() < 1e-7 * np.abs(D).max()
    else:
        change = D[-1, 2]
    model, rows = arm().model, slice(0, 6 if kind == "pose" else 3)
    frame, world = model.getFrameId("tool0"), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    q = found.trajectory.q[node]
    J = pin.computeFrameJacobian(model, model.createData(), q, frame, world)[rows]
    force, *_ = np.linalg.lstsq(J.T, change)
    assert np.abs(change).max() > 1.0
    np.testing.assert_allclose(J.T @ force, change, rtol=0, atol=1e-6 * np.abs(change).max())
    again = solve(problem, found.trajectory)
    assert again.nit <= 3
    assert again.cost == pytest.approx(found.cost, rel=1e-10)


def test_a_goal_that_is_stated_twice_changes_nothing() -> None:
    """Its multipliers are not unique then, the motion is."""
    goal = hovi.FrameGoal("tool0", position=place(HALFWAY))
    once, twice = (
        solve(reach(hovi.State(END), (hovi.Via(0.75, goal),) * count)) for count in (1, 2)
    )
    assert twice.usable, twice.message
    assert twice.n_neg == 0
    assert twice.cost == pytest.approx(once.cost, rel=1e-9)
    np.testing.assert_allclose(twice.trajectory.q, once.trajectory.q, rtol=0, atol=1e-6)


def bending(load: float, rods: int = 1) -> hovi.DiscreteLagrangian:
    """The energy 1/2 q''^2 - load/2 q'^2 + q'^4 of rods under a load; t is the length."""
    q, v, a = (ca.SX.sym(name, rods) for name in "qva")
    energy = ca.dot(a, a) / 2 - load * ca.dot(v, v) / 2 + ca.sumsqr(v**2)
    grid = hovi.Grid.uniform(1.0, 20, hovi.schemes.galerkin(2))
    return hovi.DiscreteLagrangian(hovi.CasadiLagrangian([q, v, a], energy), grid)


def rod(load: float, held: bool) -> hovi.TrajectoryProblem:
    """A rod under a load along it, straight."""
    ld = bending(load)
    via = (hovi.Via(0.5, hovi.State([0.0])),) if held else ()
    return hovi.TrajectoryProblem(ld, hovi.State([0.0]), hovi.State([0.0]), via=via)


@pytest.mark.parametrize("load", [30.0, 50.0, 100.0, 200.0])
def test_the_index_of_a_held_rod_is_the_number_of_ways_it_can_buckle(load: float) -> None:
    """Holding its midpoint takes the first way, which bends it there, and leaves the others."""
    ways = sum(load > critical for critical in BUCKLING)
    free = solve(rod(load, held=False), escape_saddles=False)
    held = solve(rod(load, held=True), escape_saddles=False)
    assert free.n_neg == ways
    assert held.n_neg == max(ways - 1, 0)
    assert held.status is (Status.SADDLE if ways > 1 else Status.MINIMUM)
    np.testing.assert_allclose(held.trajectory.q, 0.0, atol=1e-12)


def test_a_held_rod_buckles_where_saddles_are_left() -> None:
    found = solve(rod(100.0, held=True))
    assert found.status is Status.MINIMUM
    assert found.cost < -1.0
    assert "A saddle of cost 0 was left" in found.message
    q = found.trajectory.q[:, 0]
    assert abs(q[10]) < 1e-10
    np.testing.assert_allclose(q, -q[::-1], atol=1e-6)  # as an S
    assert np.abs(q).max() > 0.05


@pytest.mark.parametrize("load", [30.0, 60.0, 100.0])
def test_a_rod_within_limits_buckles_too(load: float) -> None:
    """Straight it is stationary within them."""
    problem = rod(load, held=False)
    limits = hovi.as_limits(problem.coordinates, {"base": "none", "v": 5.0})
    found = solve(dataclasses.replace(problem, limits=limits))
    assert found.success, found.message
    straight = load < BUCKLING[0]
    assert (np.abs(found.trajectory.q).max() < 1e-6) == straight
    assert (found.cost < -0.1) == (not straight)


@pytest.mark.parametrize("bend", [1e-3, -1e-3])
@pytest.mark.parametrize("kind", ["free", "held", "limited"])
def test_a_rod_buckles_to_the_side_to_which_it_is_bent(kind: str, bend: float) -> None:
    """Next to a saddle the cost falls to both sides, and the way leads on downhill."""
    held = kind == "held"
    problem = rod(100.0 if held else 60.0, held)
    if kind == "limited":
        limits = hovi.as_limits(problem.coordinates, {"base": "none", "v": 5.0})
        problem = dataclasses.replace(problem, limits=limits)
    waves = 2 if held else 1

    def bent(t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        s, w = t[:, None], 2 * np.pi * waves
        bell, slope = (s * (1 - s)) ** 2, 2 * s * (1 - s) * (1 - 2 * s)
        curve = np.sin(w * s / 2)
        return bend * bell * curve, bend * (slope * curve + bell * w / 2 * np.cos(w * s / 2)), 0 * s

    found = solve(problem, problem.path(bent))
    assert found.success, found.message
    assert found.cost < -0.1
    assert np.sign(found.trajectory.q[5, 0]) == np.sign(bend)


def test_via_points_that_contradict_each_other_are_infeasible() -> None:
    """And in few steps."""
    at = place(HALFWAY)
    via = [
        hovi.Via(0.75, hovi.FrameGoal("tool0", position=at + np.array([x, 0, 0])))
        for x in (0, 0.05)
    ]
    found = solve(reach(hovi.State(END), tuple(via)), max_iterations=400)
    assert found.status is Status.INFEASIBLE
    assert found.nit <= 90
    assert "the goal at t = 0.75 s cannot be met: frame 'tool0' misses it by" in found.message
    middle = place(found.trajectory.q[8])
    np.testing.assert_allclose(middle, at + np.array([0.025, 0, 0]), rtol=0, atol=1e-5)


@pytest.mark.parametrize("limit", [{"max_iterations": 3}, {"time_limit": 0.0}])
def test_a_search_that_is_cut_short_says_what_remains(limit: dict[str, float]) -> None:
    problem = swing_up("pendubot_swing_up", "galerkin-2").problem
    assert problem is not None
    found = solve(problem, **limit)
    assert found.status in (Status.ITERATION_LIMIT, Status.TIME_LIMIT)
    assert found.nit <= 3


def test_steps_are_reported_as_they_are_counted() -> None:
    problem = swing_up("pendubot_swing_up", "galerkin-2").problem
    assert problem is not None
    steps: list[int] = []
    found = solve(problem, report=lambda step, cost: steps.append(step))
    assert steps == list(range(1, found.nit + 1))


def tool(q: np.ndarray) -> pin.SE3:
    """The pose of the tool of the arm."""
    model = arm().model
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    return data.oMf[model.getFrameId("tool0")].copy()


@cache
def posed() -> hovi.Solution:
    """A reach to a pose of the tool."""
    return solve(reach(hovi.FrameGoal("tool0", tool(END))))


def test_replanning_follows_a_frame_goal_in_a_few_steps() -> None:
    """From the old motion and the multipliers that it has, and not from inverse kinematics."""
    pose = tool(END)
    pose.translation += [0.004, -0.003, 0.002]
    again = posed().replan(goal=hovi.FrameGoal("tool0", pose))
    assert again.success
    assert again.nit <= 5
    np.testing.assert_allclose(tool(again.trajectory.q[-1]), pose, rtol=0, atol=1e-9)
    assert np.abs(again.trajectory.q[-1] - posed().trajectory.q[-1]).max() < 0.1


def test_replanning_to_a_goal_turned_by_half_a_turn_does_not_stay_where_it_is() -> None:
    """The equations hold at the old end, half a turn away from the goal."""
    pose = tool(END)
    pose.rotation = pose.rotation @ np.diag([-1.0, -1.0, 1.0])
    again = posed().replan(goal=hovi.FrameGoal("tool0", pose))
    assert again.success, again.message
    np.testing.assert_allclose(tool(again.trajectory.q[-1]), pose, rtol=0, atol=1e-9)


def test_rods_that_bend_alike_leave_the_saddle_where_newtons_method_ends() -> None:
    """With an equation at all times it begins without a penalty, at the straight rods."""
    alike = hovi.Condition(lambda q: q[0] - q[1], hovi.Equal(0.0))
    ends = hovi.State(np.zeros(2)), hovi.State(np.zeros(2))
    problem = hovi.TrajectoryProblem(bending(50.0, rods=2), *ends, conditions=(alike,))
    straight = solve(problem, escape_saddles=False)
    assert (straight.status, straight.n_neg) == (Status.SADDLE, 1)
    bent = solve(problem)
    assert bent.status is Status.MINIMUM
    assert bent.cost == pytest.approx(2 * solve(rod(50.0, held=False)).cost, rel=1e-9)
    assert np.abs(bent.trajectory.q).max() > 0.1
    np.testing.assert_allclose(bent.trajectory.q[:, 0], bent.trajectory.q[:, 1], atol=1e-9)
    assert "A saddle of cost 0 was left" in bent.message
