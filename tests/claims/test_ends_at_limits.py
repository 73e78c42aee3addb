"""A success is a motion within its limits, wherever its ends are and wherever they lead.

Ends at, beyond and near bounds, with derivatives of every direction, judged by dense samples of the
motion alone: no success is over a limit by more than the tolerance, but for what it says is excused
until when; and none is not usable.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import pytest

import hovi
from hovi.errors import InputError

pytestmark = pytest.mark.filterwarnings("ignore")
SAMPLES = 50_001
T = 2.2
TOLERANCE = 1e-6
OUTWARDS = (-0.2, 0.0, 1e-3, 0.02, 0.1, 0.3)
"""Velocities out of a bound, in rad/s."""
BEYOND = (0.0, 0.0, 1e-9, 1e-5, 2e-3, -1e-3, 0.2)
"""Distances of positions out of their bounds, in rad."""
TOO_FAST = (0.0, 1e-9, 1e-3, 0.02, 0.5)
"""The same of velocities, in rad/s."""
KINDS = "plan", "replan", "advance", "smooth", "free"
ROBOTS = {"pendulum": [30.0], "ur5": [150.0, 150.0, 150.0, 28.0, 28.0, 28.0]}
"""Robots of one and of six joints, with bounds of their torques in N m."""


@functools.cache
def scene(robot: str) -> hovi.Scene:
    source = hovi.example("pendulum.urdf") if robot == "pendulum" else robot
    return hovi.Scene(hovi.load_robot(source), [hovi.effects.Gravity()])


def bounds(robot: str) -> dict[str, np.ndarray]:
    n = len(ROBOTS[robot])
    return {"q": np.full(n, 1.5), "v": np.full(n, 3.0), "tau": np.array(ROBOTS[robot])}


def options(robot: str) -> dict[str, Any]:
    limits = {"base": "none", **{kind: row.tolist() for kind, row in bounds(robot).items()}}
    return {"limits": limits, "self_collision": False, "time_limit": 20}


@functools.cache
def known(robot: str) -> hovi.Solution:
    """A motion inside, that is replanned and advanced."""
    ends = np.random.default_rng(0).uniform(-1, 1, (2, len(ROBOTS[robot])))
    return hovi.plan(scene(robot), *ends, T, **options(robot))


def about_a_bound(robot: str, rng: np.random.Generator, order: int) -> hovi.State:
    """A state whose position or velocity is at a bound, next to it or beyond, in any direction."""
    n = len(ROBOTS[robot])
    q, v, a = rng.uniform(-1, 1, n), rng.uniform(-0.2, 0.2, n), np.zeros(n)
    side, joint = rng.choice([-1.0, 1.0]), rng.integers(n)
    if rng.random() < 0.7:
        q[joint], v[joint] = side * (1.5 + rng.choice(BEYOND)), side * rng.choice(OUTWARDS)
    else:
        v[joint] = side * (3.0 + rng.choice(TOO_FAST))
        a[joint] = side * rng.choice([-1.0, 0.0, 0.5])
    return hovi.State(q, v, a=a) if order == 3 else hovi.State(q, v)


def found(robot: str, seed: int) -> hovi.Solution | None:
    """A motion from or to such a state; None where it is refused."""
    rng, kind = np.random.default_rng(seed), KINDS[seed % len(KINDS)]
    at = about_a_bound(robot, rng, 3 if kind == "smooth" else 2)
    inside = hovi.State(rng.uniform(-1, 1, len(ROBOTS[robot])))
    start, goal = (at, inside) if rng.random() < 0.5 else (inside, at)
    if kind == "replan":
        return known(robot).replan(start, goal, time_limit=20)
    if kind == "advance":
        return known(robot).advance(0.3, start, goal, time_limit=20)
    free = {"duration": (0.8 * T, 1.5 * T), "time_weight": 1.0} if kind == "free" else {}
    more = {"duration": T, **free, "smooth": kind == "smooth"}
    return hovi.plan(scene(robot), start, goal, **more, **options(robot))


def excess(solution: hovi.Solution, within: dict[str, np.ndarray]) -> float:
    """The largest excess over any bound, as a fraction of its range, but for what is excused."""
    motion = solution.trajectory
    t = np.linspace(0.0, motion.duration, SAMPLES)
    sample, worst = motion.sample(t), -np.inf
    for kind, bound in within.items():
        over = np.abs(getattr(sample, kind)) - bound
        for each in solution.excused:
            if each.limit == kind:
                joint = motion.coordinate_names.index(each.joint)
                over[t < each.until, joint] -= each.excess
        worst = max(worst, float((over / (2 * bound)).max()))
    return worst


def judge(robot: str, seed: int) -> bool:
    """Whether a motion was found; raises if it is none."""
    solution = found(robot, seed)
    if solution is None or not solution.success:
        return False
    case = f"{robot} {seed} {KINDS[seed % len(KINDS)]}: {solution.message}"
    assert solution.usable, case
    assert excess(solution, bounds(robot)) <= 1.1 * TOLERANCE, case
    for each in solution.excused:
        size = 3.0  # the range of positions, and the bound of velocities
        assert 0 < each.excess <= 0.02 * size * (1 + 1e-9), case
        assert each.until < solution.trajectory.duration, case
    return True


@pytest.mark.parametrize("robot", ROBOTS)
def test_no_success_is_over_its_limits(robot: str) -> None:
    assert sum(judge(robot, seed) for seed in range(15)) >= 4


@pytest.mark.long
@pytest.mark.parametrize("first", range(0, 150, 30))
@pytest.mark.parametrize("robot", ROBOTS)
def test_no_success_of_300_is_over_its_limits(robot: str, first: int) -> None:
    assert sum(judge(robot, seed) for seed in range(1000 + first, 1030 + first)) >= 8


def from_start(v: float, q: float = 0.0, **more: Any) -> hovi.Solution:
    """A motion of the pendulum from a position and a velocity."""
    given = options("pendulum") | more
    return hovi.plan(scene("pendulum"), hovi.State([q], [v]), [0.3], T, **given)


@pytest.mark.parametrize(
    ("q", "v", "limit"), [(0.0, 3.002, "v"), (1.5, 0.05, "q"), (1.51, 0.0, "q"), (-1.5, -0.2, "q")]
)
def test_a_start_outside_or_leaving_is_led_back(q: float, v: float, limit: str) -> None:
    solution = from_start(v, q)
    assert solution.success, solution.message
    (excused,) = solution.excused
    assert (excused.limit, excused.joint) == (limit, scene("pendulum").robot.joint_names[0])
    assert excess(solution, bounds("pendulum")) <= TOLERANCE
    assert excess(solution, {limit: bounds("pendulum")[limit] - excused.excess}) > TOLERANCE
    assert str(excused) in solution.message


def test_a_start_that_rounding_brought_outside_costs_nothing() -> None:
    inside, outside = from_start(0.0, 1.5), from_start(0.0, 1.5 + 1e-9)
    assert outside.success
    assert outside.excused == ()
    assert outside.nit <= inside.nit + 1


@pytest.mark.parametrize(("q", "v", "figure"), [(1.57, 0.0, "1.57"), (0.0, 3.1, "3.1")])
def test_a_start_too_far_outside_is_refused_with_the_figure(
    q: float, v: float, figure: str
) -> None:
    solution = from_start(v, q)
    assert not solution.success
    assert figure in solution.message
    assert "up to 0.06 beyond" in solution.message


@pytest.mark.parametrize(("q", "v"), [(1.5001, 0.0), (1.5, 0.05), (0.0, 3.001)])
def test_strict_plans_refuse_every_start_outside_or_leaving(q: float, v: float) -> None:
    solution = from_start(v, q, strict=True)
    assert not solution.success
    assert solution.excused == ()
    assert "at the start" in solution.message


def test_strict_is_kept_and_changed_by_replan_and_advance() -> None:
    state = hovi.State([1.5], [0.05])
    known_one = known("pendulum")
    assert known_one.replan(state).excused
    assert not known_one.replan(state, strict=True).success
    assert not known_one.advance(0.3, state, strict=True).success
    strict = from_start(0.0, strict=True)
    assert not strict.replan(state).success
    assert strict.replan(state, strict=False).excused


@pytest.mark.parametrize(
    ("q", "v"), [(1.5, 0.1), (1.5, -0.1), (-1.5, 1e-3), (1.5, 1e-3), (1.51, 0.0)]
)
def test_goals_at_a_bound_with_a_derivative_or_outside_are_refused(q: float, v: float) -> None:
    goal = hovi.State([q], [v])
    for solution in (
        hovi.plan(scene("pendulum"), [0.0], goal, T, **options("pendulum")),
        known("pendulum").replan(goal=goal),
        known("pendulum").advance(0.3, goal=goal),
    ):
        assert not solution.success
        assert f"{q:g} rad" in solution.message
        assert "at the goal" in solution.message


def test_via_points_at_a_bound_with_a_derivative_are_refused() -> None:
    via = hovi.Via(1.0, hovi.State([1.5], [0.1]))
    solution = hovi.plan(scene("pendulum"), [0.0], [0.3], T, via=[via], **options("pendulum"))
    assert not solution.success
    assert "via point at 1 s" in solution.message


@pytest.mark.parametrize("end", ["q", "v"])
def test_a_sensor_that_gives_no_number_is_refused(end: str) -> None:
    q, v = ([np.nan], [0.0]) if end == "q" else ([0.0], [np.nan])
    state = hovi.State(np.array(q), np.array(v))
    for call in (
        lambda: known("pendulum").replan(state),
        lambda: known("pendulum").advance(0.3, state),
        lambda: hovi.plan(scene("pendulum"), state, [0.3], T, **options("pendulum")),
    ):
        with pytest.raises(InputError, match="start"):
            call()


@pytest.mark.parametrize(
    "grid",
    [
        {"intervals": 5},
        {"intervals": 20},
        {"intervals": 40},
        {"intervals": 40, "scheme": "galerkin-0x4"},
    ],
)
@pytest.mark.parametrize(
    ("start", "goal", "limit"),
    [
        (hovi.State([0.0], [3.02]), hovi.State([6.4], [2.6]), "v"),
        (hovi.State([-0.1], [-3.02]), hovi.State([-6.5], [-2.6]), "v"),
        (hovi.State([1.5], [0.3]), hovi.State([1.4]), "q"),
        (hovi.State([-1.5], [-0.3]), hovi.State([-1.4]), "q"),
    ],
)
def test_a_motion_is_at_its_limit_from_where_it_is_led_back_on(
    start: hovi.State, goal: hovi.State, limit: str, grid: dict[str, Any]
) -> None:
    """On every grid; no more is excused than the sentence says, and nothing afterwards."""
    bound = {"q": 1.5, "v": 3.0}[limit]
    given = {"limits": {"base": "none", limit: bound}, "self_collision": False}
    free = hovi.Scene(scene("pendulum").robot)
    solution = hovi.plan(free, start, goal, T, **grid, **given)
    assert solution.usable, solution.message
    (excused,) = solution.excused
    t = np.linspace(0.0, T, SAMPLES)
    over = np.abs(getattr(solution.trajectory.sample(t), limit)[:, 0]) - bound
    e, after = excused.at(t), t >= excused.until
    assert e.max() == pytest.approx(excused.excess, rel=1e-4)
    assert (e[after] == 0.0).all()
    assert (over - e).max() <= TOLERANCE
    assert over[after & (t < 1.5 * excused.until)].max() >= -1e-6


def test_what_is_excused_stays_with_a_saved_motion(tmp_path: Any) -> None:
    solution = from_start(3.002)
    solution.trajectory.save(tmp_path / "m.npz")
    loaded = hovi.Trajectory.load(tmp_path / "m.npz")
    (recorded,) = loaded.metadata["limits"]["excused"]
    (excused,) = solution.excused
    assert recorded["limit"] == "v"
    assert recorded["until"] == excused.until
    assert recorded["excess"] == excused.excess


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("room", [1e-6, 1e-7])
def test_a_height_that_the_goal_has_but_for_a_micrometre_is_kept(seed: int, room: float) -> None:
    """What the tolerance of the bound costs is an error that no grid reduces, and no fault of one.

    The estimate covers the difference from a millimetre of room, which costs less.
    """
    rng = np.random.default_rng(seed)
    scene = hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])
    start = np.array([0.0, -1.5, 1.5, 0.0, 0.0, 0.0]) + 0.1 * seed * rng.uniform(-1, 1, 6)
    goal = np.array([1.0, -1.0, 1.0, 0.5, 0.5, 0.5]) + 0.1 * seed * rng.uniform(-1, 1, 6)
    first, last = (scene.robot.frame_pose("tool0", q)[2, 3] for q in (start, goal))
    sign = 1 if last > first else -1

    def planned(room: float) -> hovi.Solution:
        on = hovi.Between(**{"upper" if sign > 0 else "lower": last + sign * room})
        height = hovi.Condition('position["tool0", "z"]', on, name="height", unit="m")
        given = {"conditions": [height], "self_collision": False, "processes": 1}
        return hovi.plan(scene, start, goal, 1.5, **given)

    found, loose = planned(room), planned(1e-3)
    assert found.status == "minimum", found.message
    assert found.violation == ""
    assert found.error_estimate is not None
    within = found.error_estimate < 1e-3
    assert within or "the tolerance of limits allows no smaller error" in found.message
    assert loose.cost < found.cost * (1 + 1e-3)
    assert abs(found.cost / loose.cost - 1) < 0.02


@pytest.mark.parametrize("speed", [0.1, 0.2, 0.3])
@pytest.mark.parametrize("goal", [1.4, 0.6])
def test_a_start_that_is_led_back_costs_what_a_fine_grid_says(speed: float, goal: float) -> None:
    """It leaves its bound at a node: inside an interval its cost was 7 % higher, and no error."""
    robot = hovi.load_robot(hovi.example("two_link.urdf"))
    start, end = hovi.State([1.5, 0.0], [speed, 0.0]), hovi.State([goal, 0.3])

    def cost(**options: Any) -> float:
        limits = {"base": "none", "q": [[-1.5, 1.5], [-9.0, 9.0]]}
        return hovi.plan(hovi.Scene(robot, []), start, end, 2.2, limits=limits, **options).cost

    assert cost() == pytest.approx(cost(intervals=160), rel=1e-3)


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("given", ["a velocity", "a configuration", "a segment", "a free segment"])
def test_a_motion_turns_at_a_limit_where_it_stops_or_passes(
    robot: str, side: float, given: str
) -> None:
    """Between its ends a joint at its limit rests: that costs what resting there costs alone."""
    n, tolerance = len(ROBOTS[robot]), 1e-5
    start, via = np.full(n, 0.3 * side), np.linspace(0.6, 0.9, n) * side
    via[0] = 1.5 * side  # at its bound
    rest = hovi.State(via, np.zeros(n))
    asked = options(robot) | {"tolerance": tolerance}
    wider = asked["limits"] | {"q": [1.7] + [1.5] * (n - 1)}
    free = robot == "ur5" and given in ("a configuration", "a free segment")
    names = scene(robot).robot.joint_names[1:] if free else []
    resting = hovi.State(via, np.zeros(n), free_velocity=names)

    def through(goal: hovi.State, limits: Any) -> hovi.Solution:
        others = asked | {"limits": limits}
        if "segment" not in given:
            return hovi.plan(scene(robot), start, start, T, via=[hovi.Via(T / 2, goal)], **others)
        segments = [hovi.Segment(goal, T / 2), hovi.Segment(start, T / 2)]
        return hovi.plan_sequence(scene(robot), start, segments, **others)

    goal = {
        "a velocity": rest,
        "a configuration": hovi.State(via),
        "a segment": rest,
        "a free segment": hovi.State(via, free_velocity=["all"]),
    }[given]
    found, alone = through(goal, asked["limits"]), through(resting, wider)
    assert found.success, found.message
    assert alone.success, alone.message
    q = found.trajectory.sample(np.linspace(0.0, T, SAMPLES)).q
    assert (side * q[:, 0]).max() <= 1.5 + 1e-9
    assert found.cost == pytest.approx(alone.cost, rel=3 * tolerance)
