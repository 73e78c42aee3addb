"""Certificates: every check against an independent number, and reasons for missing ones."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest
from scipy.integrate import quad

import hovi
from hovi import Solution, certify, estimate_error, plan
from hovi.cli.reports.certificate import certificate_lines
from hovi.discrete.curve_integral import integral_along
from hovi.discrete.guess import regularized
from hovi.discrete.state import State
from hovi.effects import Armature, Custom, Gravity, ViscousFriction, Wrench
from hovi.errors import InputError
from hovi.flows.execution.dynamics_replay import replay_dynamics
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from oracles.on_grid import solve_on_grid
from samples.manifold_robots import with_arm
from samples.paper_arm import HANG, REACH_Q, REACH_V, effort

GOAL = State(REACH_Q, REACH_V)
HAMILTONIAN = 55.452
"""Reference values of the reach in one second, computed independently."""


def reach(scene: Scene, **options: object) -> Solution:
    return plan(scene, HANG, GOAL, 1.0, **({"limits": "none"} | options))  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def fine(arm_scene: Scene) -> Solution:
    return reach(arm_scene, intervals=32)


# Energy


def test_the_hamiltonian_at_the_nodes_is_constant(fine: Solution) -> None:
    found = certify(fine).hamiltonian
    assert found is not None
    assert found.values.shape == (33,)
    assert found.mean == pytest.approx(HAMILTONIAN, abs=1e-3)
    assert found.spread < 1e-8


def test_its_spread_falls_with_the_order_of_the_nodes(arm_scene: Scene) -> None:
    spreads = []
    for intervals in (8, 16, 32):
        solution = reach(arm_scene, scheme="galerkin-1", intervals=intervals)
        found = certify(solution, estimate=False).hamiltonian
        assert found is not None
        spreads.append(found.spread)
    orders = np.log2(np.divide(spreads[:-1], spreads[1:]))
    assert orders[-1] == pytest.approx(6, abs=1.2)


def test_no_hamiltonian_is_claimed_where_it_is_not_constant(two_link: Robot) -> None:
    gust = Custom(torque_of={"shoulder": "sin(3*t)"})
    scene = Scene(two_link, effects=[Gravity(9.8), gust])
    solution = reach(scene)
    certificate = certify(solution)
    assert certificate.hamiltonian is None
    assert "depend on time" in certificate.missing["hamiltonian"]


# Replay


@pytest.mark.parametrize("scheme", ["galerkin-2", "galerkin-0", "taylor-midpoint"])
def test_the_planned_torques_lead_from_node_to_node(arm_scene: Scene, scheme: str) -> None:
    replay = replay_dynamics(reach(arm_scene, scheme=scheme, intervals=16).trajectory)
    assert replay.q.shape == (16, 2)
    assert replay.angle < 1e-8
    assert replay.largest_tip < 1e-8
    assert np.max(replay.v) < 1e-6


def test_a_replay_sees_torques_of_another_scene(fine: Solution, two_link: Robot) -> None:
    # the same motion of an arm with armature, whose own torques are right for it
    heavy = Scene(two_link, effects=[Gravity(9.8), Armature([0.1, 0.1])])
    moved = dataclasses.replace(fine.trajectory, scene=heavy)
    assert replay_dynamics(moved).angle < 1e-9
    # torques of the light arm do not move the heavy one
    torques = fine.trajectory.sample_intervals

    class Wrong:
        def __getattr__(self, name: str) -> object:
            return torques if name == "sample_intervals" else getattr(moved, name)

    assert replay_dynamics(Wrong()).angle > 1e-4  # type: ignore[arg-type]


def test_a_motion_that_is_not_optimal_is_replayed_just_as_well(arm_scene: Scene) -> None:
    stopped = reach(arm_scene, max_iterations=1, continuation=False)
    assert not stopped.success
    assert replay_dynamics(stopped.trajectory).angle < 1e-8


def test_effects_are_part_of_the_replay(two_link: Robot) -> None:
    effects = [Gravity(9.8), Armature([0.05, 0.02]), ViscousFriction([0.4, 0.3])]
    scene = Scene(two_link, effects=effects)
    assert replay_dynamics(reach(scene).trajectory).angle < 1e-8
    frictionless = Scene(two_link, effects=effects[:2])
    assert (
        replay_dynamics(dataclasses.replace(reach(scene).trajectory, scene=frictionless)).angle
        < 1e-8
    )


def test_torques_of_passive_joints_are_not_applied(two_link: Robot) -> None:
    acrobot = Scene(two_link, effects=[Gravity(9.8)], passive=["shoulder"])
    goal = State(np.add(HANG, [0.6, -1.0]))
    coarse, fine = (
        plan(acrobot, HANG, goal, 1.5, limits="none", intervals=N).trajectory for N in (16, 64)
    )
    misses = [replay_dynamics(motion).angle for motion in (coarse, fine)]
    assert misses[0] > 1e-9  # between the points the passive torque is not zero
    assert misses[1] < 0.01 * misses[0]


# The rest


def test_the_integral_is_that_of_the_torques_along_the_curve(arm_scene: Scene) -> None:
    solution = reach(arm_scene, scheme="galerkin-0", intervals=8)
    motion = solution.trajectory

    def density(t: float) -> float:
        at = motion.sample(t)
        return effort(at.q[0], at.v[0], at.a[0])

    pieces = [
        quad(density, a, b, epsabs=1e-12)[0] for a, b in zip(motion.t, motion.t[1:], strict=False)
    ]
    assert solution.problem is not None
    found = integral_along(solution.problem.ld.lagrangian, motion)
    assert found.value == pytest.approx(sum(pieces), rel=1e-9)
    assert abs(found.value - sum(pieces)) <= found.error
    assert abs(found.value - solution.cost) > 1e-4 * solution.cost


def test_the_bound_is_above_the_minimum_on_every_grid(arm_scene: Scene) -> None:
    costs = [reach(arm_scene, scheme="galerkin-4", intervals=64).cost]
    for scheme in ("galerkin-0", "galerkin-2", "galerkin-2x6"):
        for intervals in (12, 16, 24):
            found = certify(reach(arm_scene, scheme=scheme, intervals=intervals), estimate=False)
            assert found.bound is not None
            assert found.bound >= costs[0] * (1 - 1e-12)


def test_there_is_no_bound_where_the_curve_is_not_admissible() -> None:
    task = hovi.load_task(hovi.example("cart_pole_swing_up"))
    found = certify(hovi.plan_task(task), estimate=False)
    assert found.bound is None
    assert "hold at points, or in moments, only" in found.missing["bound"]


def test_the_equations_hold_at_a_solution_and_not_elsewhere(
    arm_scene: Scene, fine: Solution
) -> None:
    residual = certify(fine).residual
    assert residual is not None
    assert residual < 1e-10
    stopped = reach(arm_scene, max_iterations=1, intervals=32, continuation=False)
    residual = certify(stopped).residual
    assert residual is not None
    assert residual > 1e-3


@pytest.mark.parametrize("node", [1, 3, 7])
def test_the_residual_is_the_largest_jump_of_the_momenta_at_any_node(
    arm_scene: Scene, node: int
) -> None:
    """At a motion with one node out of place, by the derivatives of the discrete Lagrangian."""
    solution = reach(arm_scene, intervals=8)
    assert solution.problem is not None
    problem, path = solution.problem, solution.trajectory.path
    q = path.q.copy()
    q[node] += 1e-3
    z = regularized(problem.robot, problem.grid, q, path.v)
    moved = dataclasses.replace(path, q=q, z=z)
    D = problem.ld.derivatives(moved)
    jumps = np.abs(D[:-1, 2:] + D[1:, :2])
    sizes = [max(np.abs(D[:, [i, i + 2]]).max(), 1e-300) for i in (0, 1)]
    expected = max(float(jumps[:, i].max() / sizes[i]) for i in (0, 1))
    found = certify(
        dataclasses.replace(solution, trajectory=problem.trajectory(moved)), estimate=False
    )
    assert found.residual == pytest.approx(expected, rel=1e-9)
    assert expected > 1e-4


def test_a_curve_beyond_a_limit_has_no_bound(arm_scene: Scene) -> None:
    """The limits are narrowed after the plan, by a thousandth."""
    found = reach(arm_scene, limits={"base": "none", "v": 5.0})
    assert found.problem is not None
    assert found.problem.limits is not None
    assert certify(found, estimate=False).bound is not None
    narrow = dataclasses.replace(found.problem, limits=found.problem.limits.with_margin(1e-3))
    certificate = certify(dataclasses.replace(found, problem=narrow), estimate=False)
    assert certificate.bound is None
    assert "the curve exceeds a limit by" in certificate.missing["bound"]


def test_peaks_lie_between_the_nodes_too(arm_scene: Scene) -> None:
    solution = reach(arm_scene, intervals=4)
    certificate = certify(solution)
    t = np.linspace(0.0, 1.0, 4001)
    dense = solution.trajectory.sample(t)
    assert certificate.velocity.value == pytest.approx(np.abs(dense.v).max(), rel=1e-3)
    assert certificate.torque.value == pytest.approx(np.abs(dense.tau).max(), rel=1e-2)
    assert certificate.velocity.value > 1.05 * np.abs(solution.trajectory.v).max()
    at = solution.trajectory.sample(certificate.velocity.t)
    joint = arm_scene.robot.coordinate_names.index(certificate.velocity.joint)
    assert abs(at.v[0, joint]) == pytest.approx(certificate.velocity.value, rel=1e-9)


def test_a_plan_to_a_tolerance_brings_its_estimate_along(arm_scene: Scene) -> None:
    solution = reach(arm_scene, tolerance=1e-8)
    certificate = certify(solution)
    assert certificate.errors is solution.accuracy.estimate  # type: ignore[union-attr]
    assert certificate.errors is not None
    assert certificate.errors.cost <= 1e-8
    assert certificate.missing == {}
    assert certificate.action == pytest.approx(solution.cost, rel=1e-14)


def test_checks_that_are_unknown_under_limits_are_missing(arm_scene: Scene) -> None:
    limited = reach(arm_scene, limits={"base": "none", "v": 6.0}, intervals=16)
    certificate = certify(limited, estimate=False)
    assert (certificate.errors, certificate.hamiltonian, certificate.residual) == (None,) * 3
    assert set(certificate.missing) == {"errors", "hamiltonian", "residual"}
    assert certificate.replay is not None
    assert certificate.replay.angle < 1e-8


def test_a_solution_without_problem_and_an_unknown_frame_are_refused(fine: Solution) -> None:
    with pytest.raises(InputError, match="has no frame 'tipp'"):
        certify(fine, frame="tipp")
    with pytest.raises(InputError, match=r"frame 'base' .* is fixed to the world.*'tip'\.$"):
        certify(fine, frame="base")
    with pytest.raises(InputError, match="has no problem"):
        certify(dataclasses.replace(fine, problem=None))


def test_a_solve_can_be_certified(fine: Solution) -> None:
    assert fine.problem is not None
    certificate = certify(solve_on_grid(fine.problem))
    assert certificate.n_neg == 0
    assert certificate.errors is not None
    assert certificate.errors.cost < 1e-9


def test_a_force_on_a_link_is_part_of_the_replay(two_link: Robot) -> None:
    push = Wrench(frame="tip", force=[1.0, -2.0, 0.0])
    assert (
        replay_dynamics(reach(Scene(two_link, effects=[Gravity(9.8), push])).trajectory).angle
        < 1e-8
    )


@pytest.mark.parametrize("base", ["free-flyer", "spherical", "continuous"])
def test_joints_on_groups_are_certified_like_others(base: str) -> None:
    robot = load_robot(with_arm(base))
    scene = Scene(robot, effects=[Gravity()])
    turn = 0.3 * np.random.default_rng(1).uniform(-1, 1, robot.nv)
    goal = robot.integrate(robot.neutral(), turn)
    found = plan(scene, robot.neutral(), goal, 1.0, limits="none", tolerance=1e-5)
    certificate = certify(found)
    assert found.accuracy is not None
    assert found.accuracy.reached
    assert certificate.missing == {}
    assert certificate.hamiltonian is not None
    assert certificate.hamiltonian.spread < 1e-7
    assert certificate.replay is not None
    assert certificate.replay.angle < 1e-9
    assert certificate.replay.slide < 1e-9


# Several tips


@pytest.fixture(scope="module")
def exact(two_arms: Robot) -> Solution:
    """One arm goes far, the other stays nearly where it is."""
    start, step = two_arms.neutral(), np.array([0.01, 0.02, 0.6, 0.8])
    scene = Scene(two_arms, [Gravity()])
    return plan(scene, State(start), State(start + step), 1.0, limits="none", tolerance="0.1 mm")


def test_a_length_is_measured_where_the_file_ends_at_what_does_not_move(exact: Solution) -> None:
    assert exact.accuracy is not None
    assert exact.accuracy.reached
    assert 1e-9 < exact.accuracy.error < 1e-4
    assert exact.accuracy.estimate is not None
    assert exact.accuracy.estimate.frame == "right_gripper"
    assert re.search(
        r"estimated error \S+ mm at right_gripper, tolerance 0.1 mm at left_gripper and "
        r"right_gripper\.( |$)",
        exact.message,
    )


def test_a_certificate_names_the_tip_with_the_largest_error(exact: Solution) -> None:
    found = certify(exact)
    assert found.errors is not None
    assert found.replay is not None
    assert found.errors is exact.accuracy.estimate  # type: ignore[union-attr]
    motion = exact.trajectory
    replays = {f: replay_dynamics(motion, f) for f in ("left_gripper", "right_gripper")}
    worst = max(replays, key=lambda frame: replays[frame].largest_tip)
    assert (found.replay.frame, found.replay.largest_tip) == (worst, replays[worst].largest_tip)
    np.testing.assert_array_equal(
        found.replay.tip, np.maximum(*(each.tip for each in replays.values()))
    )
    lines = dict(certificate_lines(found, verbose=True))
    assert re.search(r", right_gripper \S+ mm$", lines["errors"])
    assert re.search(rf", {worst} by \S+ mm", lines["replay"])


def test_a_certificate_of_one_tip_is_not_that_of_all(exact: Solution) -> None:
    left = certify(exact, "left_gripper").errors
    assert left is not None
    assert left.frame == "left_gripper"
    assert 0 < left.largest_tip < 0.9 * exact.accuracy.error  # type: ignore[union-attr]


def test_a_certificate_ends_at_its_time_limit_and_names_what_is_missing(two_link: Robot) -> None:
    """Forward simulation with such friction takes steps of nanoseconds."""
    stiff, v = Scene(two_link, [ViscousFriction(1e9)]), np.array([0.5, 0.3])
    ends = State(HANG, v), State(HANG + v, v)
    solution = plan(stiff, *ends, 1.0, limits="none", intervals=16)
    assert solution.success
    names: list[str] = []
    found = certify(solution, time_limit=2.0, progress=names.append)
    assert found.missing == {"replay": "the time limit was reached"}
    assert found.replay is None
    assert found.errors is not None
    assert names == ["bound", "errors", "hamiltonian", "residual", "replay"]


def test_a_certificate_without_time_has_what_needs_none(fine: Solution) -> None:
    found = certify(fine, time_limit=-1.0)
    assert set(found.missing) == {"bound", "errors", "hamiltonian", "residual", "replay"}
    assert set(found.missing.values()) == {"the time limit was reached"}
    assert found.integral == pytest.approx(certify(fine).integral)


def test_an_estimate_for_one_tip_certifies_no_other(two_arms: Robot) -> None:
    """The estimate of a tolerance is taken over exactly where it is of the frame asked for."""
    start, step = two_arms.neutral(), np.array([0.01, 0.02, 0.6, 1.4])
    ends = State(start), State(start + step)
    options = {"limits": "none", "tolerance": "0.1 mm at right_gripper"}
    solution = plan(Scene(two_arms, [Gravity()]), *ends, 1.0, **options)  # type: ignore[arg-type]
    assert solution.accuracy is not None
    known = solution.accuracy.estimate
    assert known is not None
    for frame in (None, "right_gripper"):
        assert certify(solution, frame, estimate=False).errors is known
    other = certify(solution, "left_gripper").errors
    measured = estimate_error(solution, "left_gripper")
    assert other is not None
    assert measured is not None
    assert other.frame == "left_gripper"
    assert other.largest_tip == pytest.approx(measured.largest_tip, rel=1e-12)
    assert other.largest_tip > 2 * known.largest_tip
    unknown = certify(solution, "left_gripper", estimate=False)
    assert unknown.errors is None
    assert "takes another solve" in unknown.missing["errors"]


def test_without_a_tolerance_errors_are_estimated_when_asked_for(fine: Solution) -> None:
    estimated, skipped = certify(fine), certify(fine, estimate=False)
    assert estimated.errors is not None
    assert "errors" not in estimated.missing
    assert skipped.errors is None
    assert "plan with a tolerance" in skipped.missing["errors"]
