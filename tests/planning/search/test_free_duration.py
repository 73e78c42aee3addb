"""Free durations: Pontryagin's Hamiltonian equals the weight of time."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest

import hovi
from hovi.errors import InputError

WEIGHT = 20.0


def reach(duration: object, intervals: int = 16, **options: object) -> hovi.Solution:
    task = hovi.load_task(hovi.example("two_link_reach"))
    options = {"limits": "none", "intervals": intervals, **options}
    return hovi.plan(task.scene, task.start, task.goal, duration, **options)


def hamiltonian(solution: hovi.Solution) -> np.ndarray:
    """p.v + p~.a - L at the nodes, a from p~ = M tau by pin.aba."""
    motion, model = solution.trajectory, solution.problem.scene.model
    data, values = model.createData(), []
    for q, v, (p, p_tilde) in zip(motion.q, motion.v, motion.momenta, strict=True):
        mass = pin.crba(model, data, q)
        mass = np.triu(mass) + np.triu(mass, 1).T
        tau = np.linalg.solve(mass, p_tilde)
        a = pin.aba(model, data, q, v, tau)
        values.append(p @ v + p_tilde @ a - 0.5 * tau @ tau)
    return np.array(values)


def test_the_derivative_of_the_cost_in_the_duration_is_that_of_differences() -> None:
    base = reach(1.3)
    moved = [reach(1.3 + d, guess=base.trajectory).cost for d in (-1e-3, 1e-3)]
    assert base.duration_derivative == pytest.approx((moved[1] - moved[0]) / 2e-3, rel=1e-5)


def test_the_hamiltonian_at_the_nodes_is_the_weight_of_time_to_the_order_of_the_scheme() -> None:
    gaps = []
    for N in (8, 16, 32):
        solution = reach((0.5, 4.0), N, time_weight=WEIGHT)
        assert solution.success, solution.message
        gaps.append(np.max(np.abs(hamiltonian(solution) - WEIGHT)))
    slopes = np.log2(np.divide(gaps[:-1], gaps[1:]))
    assert np.all(slopes > 7.0)
    assert gaps[-1] < 1e-7


def test_the_duration_found_is_where_a_sweep_has_its_minimum() -> None:
    solution = reach((0.5, 4.0), time_weight=WEIGHT)
    T = solution.trajectory.duration
    sweep = [
        reach(T * f, guess=solution.trajectory).cost + WEIGHT * T * f for f in (0.98, 1.0, 1.02)
    ]
    assert sweep[1] == pytest.approx(solution.cost, rel=1e-12)
    assert min(sweep) == sweep[1]
    assert solution.cost == pytest.approx(
        hovi.plan(
            solution.problem.scene,
            solution.problem.start,
            solution.problem.goal,
            T,
            limits="none",
            guess=solution.trajectory,
            self_collision=False,
        ).cost
        + WEIGHT * T
    )


def told(message: str, words: str) -> float:
    """The number before these words of a message."""
    found = re.search(rf"([0-9.e+-]+){words}", message)
    assert found is not None, message
    return float(found[1])


@pytest.mark.parametrize("limit", [None, 3])
def test_the_told_costs_are_those_of_the_motion_and_of_its_time(limit: int | None) -> None:
    """For a minimum, and for the best motion where the search ends before one is found."""
    options = {} if limit is None else {"max_iterations": limit, "continuation": False}
    found = reach((0.5, 4.0), time_weight=WEIGHT, **options)
    T = found.trajectory.duration
    assert found.success == (limit is None)
    assert abs(T - 1.0) > 0.05
    effort = found.problem.ld.action(found.trajectory.path)
    assert found.cost == pytest.approx(effort + WEIGHT * T, rel=1e-12)
    if found.success:
        assert told(found.message, " of it for time") == pytest.approx(WEIGHT * T, rel=1e-5)
        assert told(found.message, ", [0-9.]+ of it") == pytest.approx(found.cost, rel=1e-9)
        assert found.minima == (found.cost,)
    else:
        words = re.search(r"Time adds ([0-9.]+) to the cost", found.message)
        assert words is not None, found.message
        assert float(words[1].rstrip(".")) == pytest.approx(WEIGHT * T, rel=1e-5)
        assert found.minima == ()


def test_a_large_weight_ends_at_the_bound() -> None:
    fast = reach((1.0, 2.0), time_weight=1e4)
    assert fast.trajectory.duration == 1.0
    assert "kept at its bound" in fast.message


def test_limits_hold_while_the_duration_is_found() -> None:
    task, weight = hovi.load_task(hovi.example("ur5_reach_limited")), 60.0
    ends = task.scene, task.start, task.goal
    options = {"limits": task.options.limits, "intervals": 24}
    solution = hovi.plan(*ends, (1.5, 2.5), time_weight=weight, **options, self_collision=False)
    assert solution.success, solution.message
    T, guess = solution.trajectory.duration, solution.trajectory
    assert 1.5 < T < 2.5
    costs = [
        hovi.plan(*ends, T * f, guess=guess, **options, self_collision=False).cost + weight * T * f
        for f in (0.9, 1.1)
    ]
    assert solution.cost < min(costs)


def test_a_search_that_runs_out_of_time_is_no_success() -> None:
    solution = reach((0.5, 4.0), time_weight=WEIGHT, time_limit=1e-3)
    assert not solution.success
    assert solution.status is hovi.Status.TIME_LIMIT


def test_bad_durations_are_refused() -> None:
    with pytest.raises(InputError, match="whose lower bound is below the upper one"):
        reach((2.0, 1.0))
    with pytest.raises(InputError, match="time_weight needs a free duration"):
        reach(1.0, time_weight=1.0)
    with pytest.raises(InputError, match=r"lower, upper\] of two"):
        reach((1.0, 2.0, 3.0))
    with pytest.raises(InputError, match="`time_weight` must be a number"):
        reach((1.0, 2.0), time_weight=-1.0)


TORQUES = {"base": "none", "tau": [8.0, 3.0]}
Scan = dict[float, hovi.Solution]


def raised(two_link: hovi.Robot, duration: object, **options: object) -> hovi.Solution:
    """The two-link arm from hanging to a reach, at rest, with torques of 8 and 3 N m."""
    scene = hovi.Scene(two_link, [hovi.effects.Gravity(9.8)])
    options = {"limits": TORQUES, "intervals": 20, **options}
    return hovi.plan(scene, [-np.pi / 2, 0.0], [0.3, 0.7], duration, **options)


def scan(plan: Callable[[float], hovi.Solution], lower: float, upper: float) -> Scan:
    """Plans for given durations, each from its own guess."""
    return {float(T): plan(float(T)) for T in np.geomspace(lower, upper, 12)}


def least(found: Scan, weight: float) -> tuple[float, float]:
    """The best duration of a scan, and its cost with time."""
    totals = {T: s.cost + weight * T for T, s in found.items() if s.success}
    best = min(totals, key=lambda T: totals[T])
    return best, totals[best]


def excess(solution: hovi.Solution, most: list[float]) -> float:
    """By which share the torques of pin.rnea exceed their limits at 10,000 instants."""
    motion, model = solution.trajectory, solution.problem.scene.model
    data, samples = model.createData(), motion.sample(np.linspace(0, motion.duration, 10_000))
    rows = zip(samples.q, samples.v, samples.a, strict=True)
    tau = np.array([pin.rnea(model, data, q, v, a) for q, v, a in rows])
    return float((np.abs(tau) / most).max() - 1)


def test_a_first_duration_that_is_too_short_is_left(two_link: hovi.Robot) -> None:
    found = raised(two_link, (0.3, 3.0), time_weight=30.0)
    assert found.status is hovi.Status.MINIMUM, found.message
    assert found.cost <= 51.357 * (1 + 1e-4)
    assert found.trajectory.duration == pytest.approx(1.25, rel=0.05)
    assert found.duration_derivative == pytest.approx(-30.0, rel=1e-6)
    assert excess(found, [8.0, 3.0]) <= 1e-5
    assert "The best duration is" in found.message


def test_between_velocity_limits_the_best_duration_is_that_of_a_scan() -> None:
    task, weight = hovi.load_task(hovi.example("ur5_reach_limited")), 1000.0
    ends, options = (task.scene, task.start, task.goal), {"limits": {"v": 3.14}}
    found = hovi.plan(*ends, (0.2, 1.0), time_weight=weight, **options, self_collision=False)
    fixed = scan(
        lambda T: hovi.plan(*ends, T, continuation=False, **options, self_collision=False), 0.2, 1.0
    )
    T, cost = least(fixed, weight)
    assert fixed[0.2].status is hovi.Status.INFEASIBLE  # by the mean velocity
    assert found.success, found.message
    assert cost * (1 - 0.02) <= found.cost <= cost * (1 + 1e-5)
    assert found.trajectory.duration == pytest.approx(T, rel=5 ** (1 / 11) - 1)


def test_a_range_whose_upper_end_is_best_is_searched_up_to_it(two_link: hovi.Robot) -> None:
    found = raised(two_link, (0.3, 1.15), time_weight=30.0)
    fixed = scan(lambda T: raised(two_link, T, continuation=False), 0.9, 1.15)
    assert least(fixed, 30.0) == pytest.approx((1.15, found.cost), rel=1e-6)
    assert found.trajectory.duration == pytest.approx(1.15, rel=1e-14)
    assert found.success
    assert "kept at its bound, 1.15 s" in found.message


def test_a_hurry_ends_at_the_edge_of_feasibility(two_link: hovi.Robot) -> None:
    found = raised(two_link, (0.3, 3.0), time_weight=1e5, intervals=8)
    T = found.trajectory.duration
    assert found.status is hovi.Status.MINIMUM, found.message
    assert f"The best duration is {T:.10g}" in found.message
    assert found.duration_derivative == pytest.approx(-1e5, rel=1e-7)
    assert excess(found, [8.0, 3.0]) <= 1e-5
    shorter = raised(two_link, T * (1 - 2e-3), intervals=8, guess=found.trajectory)
    assert shorter.status is hovi.Status.INFEASIBLE


def test_a_range_without_a_motion_is_infeasible_for_a_reason(two_link: hovi.Robot) -> None:
    found = raised(two_link, (0.3, 0.9), time_weight=30.0, continuation=False)
    assert (found.success, found.status) == (False, hovi.Status.INFEASIBLE)
    assert "the torque of joint 'elbow' reaches" in found.message
    assert "Nor was one found for 6 other durations from 0.3 to 0.9 s." in found.message
    assert found.minima == ()


def test_where_long_motions_are_infeasible_shorter_ones_are_tried(two_link: hovi.Robot) -> None:
    """A joint that may not be slower than 0.4 rad/s cannot take its time."""
    scene, limits = hovi.Scene(two_link, []), {"base": "none", "v": {"shoulder": [0.4, 3.0]}}
    ends = hovi.State([0.0, 0.0], [1.0, 0.0]), hovi.State([1.5, 0.0], [1.0, 0.0])
    found = hovi.plan(scene, *ends, (2.0, 12.0), limits=limits, intervals=8)
    assert found.success, found.message
    assert found.trajectory.duration < 1.5 / 0.4
    assert found.trajectory.sample(np.linspace(0, 2, 1000)).v[:, 0].min() >= 0.4 - 3e-5


def test_passive_joints_and_limits_leave_room_for_the_best_duration(two_link: hovi.Robot) -> None:
    scene = hovi.Scene(two_link, [hovi.effects.Gravity(9.8)], passive=["elbow"])
    ends, limits = (
        ([-np.pi / 2, 0.0], [np.pi / 2, 0.0]),
        {"base": "none", "tau": {"shoulder": 12.0}},
    )
    found = hovi.plan(scene, *ends, (0.5, 6.0), time_weight=30.0, limits=limits, intervals=30)
    assert found.success, found.message
    assert found.duration_derivative == pytest.approx(-30.0, rel=1e-6)
    assert "The best duration is" in found.message


FAR_AWAY = hovi.Sphere([0.0, 2.8, 0.0], 0.1)
"""An obstacle that changes nothing but the way in which a best duration is found: by solves for
given ones."""


def test_all_starts_are_made_where_there_is_a_motion(two_link: hovi.Robot) -> None:
    told: list[str] = []
    options = {"starts": 3, "processes": 1, "intervals": 8, "time_weight": 30.0}
    options["obstacles"] = [FAR_AWAY]
    found = raised(two_link, (0.3, 3.0), progress=lambda text, _: told.append(text), **options)
    assert found.success, found.message
    assert [text[:11] for text in told].count("3 of 3 star") == 1
    assert "starts" not in found.message


def test_around_an_obstacle_the_best_duration_is_cheaper_than_its_neighbours(
    two_link: hovi.Robot,
) -> None:
    scene, ball = hovi.Scene(two_link, []), hovi.Sphere([0.85, 0.0, -1.7], 0.15)
    ends, options = ([-np.pi / 2, 0.0], [0.3, 0.7]), {"obstacles": [ball], "limits": "none"}
    found = hovi.plan(scene, *ends, (1.25, 1.55), time_weight=30.0, intervals=12, **options)
    assert found.success, found.message
    assert found.duration_derivative == pytest.approx(-30.0, rel=1e-6)
    T = found.trajectory.duration
    for each in (0.95 * T, 1.05 * T):
        near = hovi.plan(scene, *ends, each, intervals=12, **options)
        assert near.cost + 30.0 * each > found.cost
    bare = hovi.plan(scene, *ends, T, intervals=12, limits="none")
    assert bare.cost + 30.0 * T < found.cost * (1 - 0.01)


@pytest.mark.parametrize("share", [0.03, 0.15, 0.4])
def test_a_time_limit_is_told_wherever_it_ends_the_search(
    two_link: hovi.Robot, share: float
) -> None:
    options = {"time_weight": 1e5, "intervals": 40}
    whole = raised(two_link, (0.3, 3.0), **options)
    assert whole.success
    limit = share * whole.solve_seconds
    found = raised(two_link, (0.3, 3.0), time_limit=limit, **options)
    assert (found.success, found.status) == (False, hovi.Status.TIME_LIMIT)
    assert "time limit" in found.message
    assert "a minimum of cost" not in found.message
    assert f"{found.trajectory.duration:.10g} s" in found.message


@pytest.mark.parametrize("starts", [1, 3])
def test_other_durations_are_tried(two_link: hovi.Robot, starts: int) -> None:
    """One after the other by a single start; several starts begin at other ones by themselves."""
    said: list[str] = []

    def progress(text: str, fraction: float) -> None:
        said.append(text)

    options = {"progress": progress, "continuation": False, "processes": 1, "starts": starts}
    found = raised(two_link, (0.3, 3.0), time_weight=30.0, obstacles=[FAR_AWAY], **options)
    assert found.success
    assert any(text.startswith("no minimum for") for text in said) == (starts == 1)
    counted = {int(number) for text in said for number in re.findall(r"of (\d+) starts", text)}
    assert counted == ({3} if starts == 3 else set())


@pytest.mark.parametrize("starts", [1, 2])
def test_no_other_duration_is_tried_once_a_motion_is_found(
    two_link: hovi.Robot, starts: int
) -> None:
    said: list[str] = []
    options = {"continuation": False, "processes": 1, "starts": starts, "obstacles": [FAR_AWAY]}
    options |= {"intervals": 8, "time_weight": 30.0}
    found = raised(two_link, (0.3, 3.0), progress=lambda text, _: said.append(text), **options)
    assert found.success, found.message
    assert "starts" not in found.message
    assert "Nor was one found" not in found.message
    pairs = [re.findall(r"([\d.]+) s", x) for x in said if x.startswith("no minimum for")]
    assert [last for _, last in pairs[:-1]] == [first for first, _ in pairs[1:]]
    fixed = {"continuation": False, "intervals": 8}
    assert not raised(two_link, float(pairs[-1][0]), **fixed).success
    assert raised(two_link, float(pairs[-1][1]), **fixed).success


def test_no_other_duration_is_tried_after_the_time_limit(two_link: hovi.Robot) -> None:
    said: list[str] = []
    options = {"time_weight": 30.0, "time_limit": 1e-6, "processes": 1}
    found = raised(two_link, (0.3, 3.0), progress=lambda text, _: said.append(text), **options)
    assert found.status is hovi.Status.TIME_LIMIT
    assert not any(text.startswith("no minimum for") for text in said)
