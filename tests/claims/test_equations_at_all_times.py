"""Equations at all times: known optima, orders, and motions on lines and planes by Pinocchio alone.

With q_2 = sin q_1 a two-link arm has one coordinate. Its optimum is that of a sum of squares of
torques over polynomials q_1(t), with torques by Pinocchio's RNEA. It is also that of the equations
of velocities and of accelerations that follow from this one.
"""

from __future__ import annotations

import dataclasses
import pickle
from collections.abc import Callable
from functools import cache
from typing import Any

import casadi as ca
import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest
from scipy.optimize import least_squares

import hovi

Array = npt.NDArray[np.float64]
ENDS = -0.4, 1.3
DURATION = 1.2
LEVELS: dict[int, Callable[..., Any]] = {
    0: lambda q: q[1] - ca.sin(q[0]),
    1: lambda q, v: v[1] - ca.cos(q[0]) * v[0],
    2: lambda q, v, a: a[1] - ca.cos(q[0]) * a[0] + ca.sin(q[0]) * v[0] ** 2,
}


@cache
def reduced_optimum() -> float:
    """The least 1/2 integral |tau|^2 with q_2 = sin q_1, by 14 modes of q_1 and 60 Gauss points."""
    model = hovi.load_robot(hovi.example("two_link.urdf")).model
    data, modes = model.createData(), 14
    x, w = np.polynomial.legendre.leggauss(60)
    s, w = (x + 1) / 2, w / 2 * DURATION
    bump = np.polynomial.Polynomial([0, 0, 1, -2, 1])  # s^2 (1 - s)^2
    legendre = np.polynomial.Legendre
    curves = [
        legendre.basis(j, [0, 1]).convert(kind=np.polynomial.Polynomial) for j in range(modes)
    ]
    curves = [bump * curve for curve in curves]
    rise = np.polynomial.Polynomial([0, 0, 3, -2])
    jets = np.array([[c.deriv(d)(s) / DURATION**d for c in curves] for d in range(3)])
    first = np.array([rise.deriv(d)(s) / DURATION**d for d in range(3)]) * (ENDS[1] - ENDS[0])
    first[0] += ENDS[0]

    def torques(c: Array) -> Array:
        q, v, a = first + np.einsum("djp,j->dp", jets, c)
        jet = (
            np.stack([q, np.sin(q)], axis=1),
            np.stack([v, np.cos(q) * v], axis=1),
            np.stack([a, np.cos(q) * a - np.sin(q) * v**2], axis=1),
        )
        tau = np.array([pin.rnea(model, data, *at) for at in zip(*jet, strict=True)])
        return np.asarray((np.sqrt(w)[:, None] * tau).ravel())

    found = least_squares(torques, np.zeros(modes), xtol=1e-14, ftol=1e-14, gtol=1e-14)
    return float(found.cost)


def on_curve(level: int, **options: Any) -> hovi.Solution:
    """The motion from one end to the other, with q_2 = sin q_1 or a derivative of that."""
    robot = hovi.load_robot(hovi.example("two_link.urdf"))
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    given = hovi.Condition(LEVELS[level], hovi.Equal(), name="curve", tolerance=options.pop("room"))
    start, goal = ([angle, np.sin(angle)] for angle in ENDS)
    asked: dict[str, Any] = {"limits": "none", "self_collision": False} | options
    return hovi.plan(scene, start, goal, DURATION, conditions=[given], **asked)


@pytest.mark.parametrize("level", LEVELS)
def test_the_optimum_is_that_of_the_arm_with_one_coordinate(level: int) -> None:
    found = on_curve(level, tolerance=1e-8, room=1e-6)
    assert found.success, found.message
    assert found.n_neg == 0
    assert found.cost == pytest.approx(reduced_optimum(), rel=2e-8)
    q = found.trajectory.sample(np.linspace(0.0, DURATION, 5001)).q
    assert np.abs(q[:, 1] - np.sin(q[:, 0])).max() < 1e-6


@pytest.mark.parametrize(("level", "r"), [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2)])
def test_orders_are_those_of_the_scheme_at_nodes_and_r_plus_4_minus_l_between(
    level: int, r: int
) -> None:
    errors, missed = [], []
    for N in (16, 32, 64) if r == 0 else (8, 16, 32) if r == 1 else (4, 8, 16):
        found = on_curve(level, scheme=f"galerkin-{r}", intervals=N, room=1.0)
        errors.append(abs(found.cost - reduced_optimum()))
        at = found.trajectory.sample(np.linspace(0.0, DURATION, 4001))
        y = LEVELS[level](*(x.T for x in (at.q, at.v)[: level + 1]))
        missed.append(float(np.abs(np.asarray(ca.DM(y))).max()))
    cost, between = (np.diff(np.log(x)) / -np.log(2.0) for x in (errors, missed))
    assert cost[-1] > 2 * (r + 2) - 0.4, (cost, errors)
    assert between[-1] > r + 4 - level - 0.4, (between, missed)


def test_a_grid_that_misses_it_between_the_nodes_is_reported() -> None:
    found = on_curve(0, scheme="galerkin-1", intervals=6, room=1e-6)
    assert found.status is hovi.Status.UNRESOLVED
    assert "condition 'curve' is violated: it is missed by " in found.message
    assert found.violation in found.message
    assert on_curve(0, scheme="galerkin-1", intervals=6, room=1e-3).success


# Lines and planes of a tool, by Pinocchio alone

ARMS = {
    "ur5": ("tool0", [0.0, -1.2, 1.5, -0.3, 0.5, 0.0]),
    "xarm7": ("link7", [0.1, -0.3, 0.2, 0.9, 0.1, 1.1, 0.0]),
    "z1": ("link06", [0.1, 1.2, -1.0, -0.2, 0.1, 0.0]),
}
AXES = "x", "y", "z"


def tool_at(robot: hovi.Robot, frame: str, q: Array) -> Array:
    return np.asarray(robot.frame_pose(frame, q)[:3, 3])


def reached(robot: hovi.Robot, frame: str, q: Array, target: Array) -> Array:
    """The configuration near q in which the origin of a frame is at a point."""
    model, data = robot.model, robot.model.createData()
    number = model.getFrameId(frame, pin.FrameType.BODY)
    for _ in range(200):
        error = target - tool_at(robot, frame, q)
        J = pin.computeFrameJacobian(model, data, q, number, pin.LOCAL_WORLD_ALIGNED)[:3]
        q = q + 0.5 * J.T @ np.linalg.solve(J @ J.T + 1e-9 * np.eye(3), error)
    assert np.abs(target - tool_at(robot, frame, q)).max() < 1e-9
    return q


def kept(frame: str, axes: str, point: Array) -> list[hovi.Condition]:
    """Coordinates of a frame that stay those of a point."""
    return [
        hovi.Condition(
            f'position["{frame}", "{axis}"]', hovi.Equal(point[AXES.index(axis)]), name=axis
        )
        for axis in axes
    ]


@pytest.mark.parametrize("axes", ["x", "xz"])
@pytest.mark.parametrize("limits", ["none", "urdf"])
@pytest.mark.parametrize("arm", ARMS)
def test_a_tool_stays_on_its_plane_or_line(arm: str, limits: str, axes: str) -> None:
    robot, (frame, home) = hovi.load_robot(arm), ARMS[arm]
    q0 = np.append(home, np.zeros(robot.nv - len(home)))
    point = tool_at(robot, frame, q0)
    q1 = reached(robot, frame, q0, np.add(point, [0.0, 0.2, 0.0]))
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    asked: dict[str, Any] = {"limits": limits, "self_collision": False}
    found = hovi.plan(scene, q0, q1, 1.5, conditions=kept(frame, axes, point), **asked)
    assert found.success, found.message
    assert found.violation == ""
    at = found.trajectory.sample(np.linspace(0.0, 1.5, 20001))
    places = np.array([tool_at(robot, frame, q) for q in at.q[::10]])
    missed = found.margins().missed
    assert missed.keys() == set(axes)
    for axis in axes:
        sampled = np.abs(places - point)[:, AXES.index(axis)].max()
        assert sampled < 1.1e-6
        assert missed[axis] == pytest.approx(sampled, rel=0.05, abs=1e-11)
    if limits == "urdf":
        assert np.all(np.abs(at.v) < robot.velocity_limit * (1 + 1e-5))
        assert np.all((at.q > robot.lower - 1e-5) & (at.q < robot.upper + 1e-5))
    without = hovi.plan(scene, q0, q1, 1.5, **asked)
    assert without.success or limits == "none"  # a wrist may spin
    assert not without.success or found.cost > without.cost * (1 - 1e-3)


def test_a_replanned_motion_and_what_is_left_of_one_keep_it() -> None:
    robot, (frame, home) = hovi.load_robot("ur5"), ARMS["ur5"]
    q0 = np.array(home)
    point = tool_at(robot, frame, q0)
    q1, q2 = (reached(robot, frame, q0, np.add(point, [0.0, y, 0.0])) for y in (0.2, 0.21))
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    first = hovi.plan(scene, q0, q1, 1.5, conditions=kept(frame, "xz", point))
    for found in (first.replan(goal=hovi.State(q2)), first.advance(0.4), first.advance("0.7 s")):
        assert found.success, found.message
        assert found.nit < first.nit
        assert found.violation == ""
        q = found.trajectory.sample(np.linspace(0.0, found.trajectory.duration, 2001)).q
        places = np.array([tool_at(robot, frame, x) for x in q])
        assert np.abs(places - point)[:, [0, 2]].max() < 1.1e-6
    away = first.replan(start=hovi.State(q0 + 1e-2))
    assert away.status is hovi.Status.INFEASIBLE
    assert "at the start, where a motion cannot change that" in away.message


def test_a_plane_may_move() -> None:
    robot, (frame, home) = hovi.load_robot("ur5"), ARMS["ur5"]
    q0 = np.array(home)
    point = tool_at(robot, frame, q0)
    q1 = reached(robot, frame, q0, np.add(point, [0.1, 0.2, 0.0]))
    wave = f'position["{frame}", "x"] - 0.1 * sin(3.141592653589793 * t / 3)^2'
    moving = hovi.Condition(wave.replace("^", "**"), hovi.Equal(point[0]), name="plane")
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    found = hovi.plan(scene, q0, q1, 1.5, limits="none", conditions=[moving])
    assert found.success, found.message
    t = np.linspace(0.0, 1.5, 2001)
    x = np.array([tool_at(robot, frame, q)[0] for q in found.trajectory.sample(t).q])
    assert np.abs(x - point[0] - 0.1 * np.sin(np.pi * t / 3) ** 2).max() < 1.1e-6


def test_the_best_duration_on_a_line_is_stationary() -> None:
    robot, (frame, home) = hovi.load_robot("ur5"), ARMS["ur5"]
    q0 = np.array(home)
    point = tool_at(robot, frame, q0)
    q1 = reached(robot, frame, q0, np.add(point, [0.0, 0.2, 0.0]))
    scene, line = hovi.Scene(robot, [hovi.effects.Gravity()]), kept(frame, "xz", point)
    asked: dict[str, Any] = {"limits": "none", "conditions": line, "tolerance": 1e-6}
    best = hovi.plan(scene, q0, q1, (0.2, 2.5), time_weight=500.0, **asked)
    assert best.success, best.message
    T = best.trajectory.duration
    assert 0.22 < T < 2.4
    for factor in (0.97, 1.03):
        other = hovi.plan(scene, q0, q1, factor * T, guess=best.trajectory, **asked)
        assert other.success, other.message
        assert other.cost + 500.0 * factor * T > best.cost


# What is implied, and what cannot be


@pytest.fixture(scope="module")
def line() -> dict[str, Any]:
    """A UR5 at rest, a point 0.2 m on a line of its tool, and the line."""
    robot, (frame, home) = hovi.load_robot("ur5"), ARMS["ur5"]
    q0 = np.array(home)
    point = tool_at(robot, frame, q0)
    goal = np.add(point, [0.0, 0.2, 0.0])
    known = {"robot": robot, "q0": q0, "q1": reached(robot, frame, q0, goal), "point": point}
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    return known | {"scene": scene, "goal": goal, "line": kept(frame, "xz", point)}


def test_a_frame_that_ends_on_its_line_is_reached(line: dict[str, Any]) -> None:
    goal = hovi.FrameGoal("tool0", position=line["goal"])
    found = hovi.plan(line["scene"], line["q0"], goal, 1.5, conditions=line["line"])
    assert found.success, found.message
    assert (
        np.abs(tool_at(line["robot"], "tool0", found.trajectory.q[-1]) - line["goal"]).max() < 2e-6
    )


def test_the_same_condition_twice_changes_nothing(line: dict[str, Any]) -> None:
    again = [
        *line["line"],
        *(hovi.Condition(x.function, x.on, name=f"{x.name} again") for x in line["line"]),
    ]
    asked: dict[str, Any] = {"limits": "urdf", "self_collision": False}
    ends = line["scene"], line["q0"], line["q1"], 1.5
    once, twice = (hovi.plan(*ends, conditions=x, **asked) for x in (line["line"], again))
    assert once.success, once.message
    assert twice.success, twice.message
    assert twice.cost == pytest.approx(once.cost, rel=1e-3)


def off(q: Array) -> Array:
    return q + np.array([0.0, 0.02, 0.0, 0.0, 0.0, 0.0])


def via(q: Array) -> hovi.Via:
    return hovi.Via(0.7, hovi.State(q))


CANNOT: dict[str, tuple[Callable[[dict[str, Any]], dict[str, Any]], str]] = {
    "start": (lambda x: {"start": off(x["q0"])}, "at the start, where a motion cannot change that"),
    "goal": (lambda x: {"goal": off(x["q1"])}, "at the goal, where a motion cannot change that"),
    "velocity": (
        lambda x: {"start": hovi.State(x["q0"], [0.1] * 6)},
        "per second at the start, where it should stay: change the velocity there",
    ),
    "via": (
        lambda x: {"via": [via(off(0.5 * (x["q0"] + x["q1"])))]},
        "at the motion at t = 0.7 s, where a motion cannot change that",
    ),
    "frame": (
        lambda x: {"goal": hovi.FrameGoal("tool0", position=np.add(x["goal"], [0.05, 0, 0]))},
        "is missed by 0.05 at the goal, where a motion cannot change that",
    ),
}


@pytest.mark.parametrize("what", CANNOT)
@pytest.mark.parametrize("limits", ["none", "urdf"])
def test_what_cannot_be_is_infeasible_at_once(line: dict[str, Any], what: str, limits: str) -> None:
    changes, sentence = CANNOT[what]
    ends = {"start": line["q0"], "goal": line["q1"]} | changes(line)
    start, goal = ends.pop("start"), ends.pop("goal")
    asked: dict[str, Any] = {"limits": limits, "conditions": line["line"]} | ends
    found = hovi.plan(line["scene"], start, goal, 1.5, **asked)
    assert found.status is hovi.Status.INFEASIBLE
    assert sentence in found.message
    assert found.nit == 0


def turned(q: ca.SX, v: ca.SX) -> ca.SX:
    return v[0] - q[1] * v[2]


REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "smooth": (
        {"smooth": True},
        "a cost of order 3 (smooth=True) does not support: leave it out, or give it room",
    ),
    "free duration": (
        {
            "duration": (0.5, 3.0),
            "conditions": [hovi.Condition(turned, hovi.Equal(), name="turned")],
        },
        "is an equation of velocities at all times, which needs a given duration",
    ),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_is_not_supported_is_refused_in_one_sentence(line: dict[str, Any], what: str) -> None:
    given, sentence = REFUSED[what]
    asked = {"duration": 1.5, "conditions": line["line"]} | given
    with pytest.raises(hovi.HoviError) as refused:
        hovi.plan(line["scene"], line["q0"], line["q1"], **asked)
    assert sentence in str(refused.value)
    assert "\n" not in str(refused.value)


def test_times_that_are_one_node_count_once(line: dict[str, Any]) -> None:
    once, twice = (
        hovi.Condition(
            'position["tool0", "y"]', hovi.Equal(line["point"][1] + 0.05), hovi.AtTimes(t)
        )
        for t in (0.6, [0.6, 0.6])
    )
    ends = line["scene"], line["q0"], line["q1"], 1.5
    alone = {"limits": "none", "self_collision": False}
    found = [hovi.plan(*ends, conditions=[x], **alone) for x in (once, twice)]
    assert found[0].success, found[0].message
    assert found[1].cost == found[0].cost
    assert found[1].nit == found[0].nit


def test_a_motion_on_a_line_can_be_pickled(line: dict[str, Any]) -> None:
    asked: dict[str, Any] = {"limits": "none", "self_collision": False}
    ends = line["scene"], line["q0"], line["q1"], 1.5
    found = hovi.plan(*ends, conditions=line["line"], **asked)
    again = pickle.loads(pickle.dumps(found)).replan()
    assert again.success, again.message
    assert again.cost == pytest.approx(found.cost, rel=1e-9)


@pytest.mark.parametrize("limits", ["none", "urdf"])
def test_the_unit_of_a_condition_does_not_matter(line: dict[str, Any], limits: str) -> None:
    found = []
    for unit in (1.0, 1e2, 1e4):
        asked = [
            hovi.Condition(
                f'{unit!r} * position["tool0", "{axis}"]',
                hovi.Equal(unit * line["point"][AXES.index(axis)]),
                name=axis,
                tolerance=1e-6 * unit,
            )
            for axis in "xz"
        ]
        ends = line["scene"], line["q0"], line["q1"], 1.5
        more: dict[str, Any] = {"limits": limits, "self_collision": False}
        found.append(hovi.plan(*ends, conditions=asked, **more))
    assert all(each.success for each in found), [each.message for each in found]
    assert max(each.nit for each in found) < 1.2 * min(each.nit for each in found)
    assert np.ptp([each.cost for each in found]) < 1e-3 * found[0].cost


@pytest.mark.parametrize("limits", ["none", "urdf"])
def test_what_is_left_of_a_coarse_motion_is_planned(limits: str) -> None:
    """Between the nodes it misses the equation by less than its tolerance, at some rate."""
    found = on_curve(0, scheme="galerkin-1", intervals=6, room=6e-5, limits=limits)
    assert found.success, found.message
    for elapsed in np.linspace(0.02, 1.1, 13).tolist():
        left = found.advance(elapsed)
        assert left.success, (elapsed, left.message)


@pytest.mark.parametrize("scheme", ["galerkin-0", "taylor-midpoint"])
def test_an_interval_without_unknowns_and_equations_is_planned(scheme: str) -> None:
    found = on_curve(0, scheme=scheme, intervals=16, room=1e-2)
    left = found.advance(1.15)
    assert left.trajectory.grid.intervals == 1
    assert left.violation == ""


def test_a_grid_is_refined_for_it_alone(line: dict[str, Any]) -> None:
    """The first grid is fine enough for a loose tolerance of the cost."""
    ends = line["scene"], line["q0"], line["q1"], 1.5
    asked: dict[str, Any] = {"limits": "none", "self_collision": False, "tolerance": 0.05}
    found = [
        hovi.plan(
            *ends,
            conditions=[dataclasses.replace(x, tolerance=room) for x in line["line"]],
            **asked,
        )
        for room in (1e-2, 1e-6)
    ]
    assert all(each.success for each in found), [each.message for each in found]
    assert found[0].margins().missed["x"] > 1e-6
    assert found[1].margins().missed["x"] < 1e-6


def test_a_plane_of_a_redundant_arm_does_not_make_steps_creep() -> None:
    """Within limits steps follow a condition that curves; a stiff penalty took hundreds of them."""
    robot = hovi.load_robot("kinova")
    names, frame = list(robot.model.names)[1:], "j2s6s200_end_effector"
    start = dict.fromkeys(names, 0.0) | {names[1]: 2.5, names[2]: 2.0, names[4]: 1.0}
    scene = hovi.Scene(robot, [hovi.effects.Gravity()])
    settings: dict[str, Any] = {"self_collision": False, "limits": "urdf"}
    goal = start | {names[0]: 2.8}
    short = hovi.plan(scene, start, goal, 8.0, intervals=2, **settings)
    height = float(tool_at(robot, frame, short.trajectory.q[0])[2])
    plane = kept(frame, "z", np.array([0.0, 0.0, height]))
    found = hovi.plan(scene, start, goal, 8.0, conditions=plane, **settings)
    assert found.success, found.message
    assert found.nit < 200
    at = found.trajectory.sample(np.linspace(0.0, 8.0, 1001))
    assert max(abs(tool_at(robot, frame, q)[2] - height) for q in at.q) < 1e-6


def test_a_via_point_off_the_line_is_infeasible_within_limits(line: dict[str, Any]) -> None:
    """Near the middle of the motion, where neither end tells."""
    off = hovi.Via(0.8, hovi.FrameGoal("tool0", position=line["point"] + [0.05, 0.15, 0.05]))
    ends = line["scene"], line["q0"], line["q1"], 1.5
    asked: dict[str, Any] = {"limits": "urdf", "self_collision": False, "time_limit": 60.0}
    found = hovi.plan(*ends, conditions=line["line"], via=[off], **asked)
    assert found.status is hovi.Status.INFEASIBLE
    assert "goal at t = 0.8 s" in found.message or "condition" in found.message


def test_the_same_value_many_times_changes_nothing_within_limits(line: dict[str, Any]) -> None:
    x = float(line["point"][0])
    many = [
        hovi.Condition(f'{k} * (position["tool0", "x"] - {x!r})', hovi.Equal(0.0), name=f"x{k}")
        for k in range(1, 7)
    ]
    ends = line["scene"], line["q0"], line["q1"], 1.5
    one, all_of_them = (
        hovi.plan(*ends, conditions=asked, limits="urdf", self_collision=False)
        for asked in (many[:1], many)
    )
    assert all_of_them.success, all_of_them.message
    assert all_of_them.cost == pytest.approx(one.cost, rel=1e-3)
