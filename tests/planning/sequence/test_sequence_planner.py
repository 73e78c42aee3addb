"""plan_sequence: motions one after the other, against plans of each and dynamics by Pinocchio."""

from __future__ import annotations

import dataclasses
import itertools
import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

import hovi
from hovi import PlanOptions
from hovi.discrete.state import State
from hovi.errors import HoviError, InputError, SceneError
from hovi.planning.sequence.branches import MoveToGoal, chosen_branches
from hovi.planning.sequence.segment import Segment
from hovi.planning.sequence.sequence_job import job_of
from hovi.planning.task_file.reading import load_task
from hovi.planning.task_file.task_plan import plan_task
from oracles.ipopt_oracle import least_action

Array = npt.NDArray[np.float64]

MASS = 0.5
GRAB, PUT = [0.7, 0.9], [1.3, 1.9]
LOAD = hovi.effects.Payload(frame="tip", mass=MASS, center=(0.1, 0.0, 0.05))


@cache
def scene() -> hovi.Scene:
    return hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")), [hovi.effects.Gravity(9.8)])


def segments(**first: Any) -> list[Segment]:
    """Reach, carry and return."""
    return [
        Segment(GRAB, 0.6, name="reach", **first),
        Segment(PUT, "900 ms", effects=[LOAD], name="carry"),
        Segment([0.0, 0.0], 0.8, name="return"),
    ]


def passing() -> list[Segment]:
    """The same without a stop where the payload is taken."""
    return [Segment(State(GRAB, free_velocity=["all"]), 0.6), *segments()[1:]]


@cache
def planned() -> hovi.Solution:
    found = hovi.plan_sequence(scene(), [0.0, 0.0], segments(), limits="none", self_collision=False)
    assert found.success, found.message
    return found


@cache
def passed() -> hovi.Solution:
    found = hovi.plan_sequence(
        scene(), [0.0, 0.0], passing(), limits="none", tolerance=1e-6, self_collision=False
    )
    assert found.success, found.message
    return found


def models() -> dict[bool, pin.Model]:
    """The robot as Pinocchio reads it, without and with the payload as a body of its own."""
    found = {}
    for loaded in (False, True):
        model = pin.buildModelFromUrdf(str(hovi.example("two_link.urdf")))
        model.gravity.linear = np.array([0.0, 0.0, -9.8])
        if loaded:
            frame = model.frames[model.getFrameId("tip")]
            body = pin.Inertia(MASS, np.array(LOAD.center), np.zeros((3, 3)))
            model.appendBodyToJoint(frame.parentJoint, body, frame.placement)
        found[loaded] = model
    return found


def torque(model: pin.Model, q: Array, v: Array, a: Array) -> Array:
    data = model.createData()
    return np.array([pin.rnea(model, data, *row) for row in zip(q, v, a, strict=True)])


def test_stops_cost_what_the_motions_cost_one_by_one() -> None:
    ends, total = [[0.0, 0.0], GRAB, PUT, [0.0, 0.0]], 0.0
    for (start, goal), each in zip(itertools.pairwise(ends), segments(), strict=True):
        alone = hovi.Scene(scene().robot, [*scene().effects, *each.effects])
        one = hovi.plan(
            alone, start, goal, each.duration, limits="none", tolerance=1e-6, self_collision=False
        )
        assert one.success, one.message
        total += one.cost
    found = hovi.plan_sequence(
        scene(), [0.0, 0.0], segments(), limits="none", tolerance=1e-6, self_collision=False
    )
    assert found.success, found.message
    assert found.cost == pytest.approx(total, rel=2e-6)
    assert planned().cost == pytest.approx(total, rel=1e-3)


def test_torques_are_those_of_the_robot_with_what_it_carries() -> None:
    motion, bodies = planned().trajectory, models()
    for t, loaded in (
        (0.3, False),
        (0.6 - 1e-9, False),
        (0.6 + 1e-9, True),
        (1.2, True),
        (1.5 + 1e-9, False),
    ):
        m = motion.sample([t])
        np.testing.assert_allclose(m.tau, torque(bodies[loaded], m.q, m.v, m.a), atol=1e-9)
    for t in (0.6, 1.5):
        np.testing.assert_allclose(motion.sample([t]).v, 0.0, atol=1e-12)
    np.testing.assert_allclose(motion.sample([0.6]).q[0], GRAB, atol=1e-14)
    assert motion.duration == pytest.approx(2.3)
    jump = motion.sample([0.6 + 1e-9]).tau - motion.sample([0.6 - 1e-9]).tau
    assert np.abs(jump).max() > 1.0


def test_the_planned_torques_move_the_robot_and_what_it_carries_along_the_motion() -> None:
    found = hovi.certify(planned(), "tip", estimate=False)
    assert found.replay is not None, found.missing
    assert found.replay.angle < 1e-9
    assert found.replay.q.shape == (planned().trajectory.grid.intervals, 2)


def test_passing_through_is_cheaper_than_a_stop_and_ipopts_motion() -> None:
    found = hovi.plan_sequence(
        scene(),
        [0.0, 0.0],
        passing(),
        limits="none",
        scheme="galerkin-2",
        intervals=23,
        self_collision=False,
    )
    assert found.problem is not None
    assert found.problem.grid.t[6] == pytest.approx(0.6)
    cost, nodes = least_action(found.problem, found.trajectory.path)
    assert found.cost == pytest.approx(cost, rel=1e-9)
    path = found.trajectory.path
    np.testing.assert_allclose(np.hstack([path.q, path.v])[1:-1], nodes, rtol=0, atol=1e-5)
    assert passed().cost < 0.97 * planned().cost
    assert np.abs(passed().trajectory.sample([0.6]).v).max() > 0.5


def test_the_momentum_of_a_free_velocity_is_the_same_before_and_after_a_seam() -> None:
    """p~ = M tau of each robot's mass matrix and torque, since q'' jumps with the load."""
    motion, bodies = passed().trajectory, models()
    node = int(np.argmin(np.abs(motion.t - 0.6)))
    both = motion.sample_intervals([node - 1, node], [1.0, 0.0])
    momenta = []
    for i, loaded in enumerate((False, True)):
        model = bodies[loaded]
        M = pin.crba(model, model.createData(), both.q[i])
        M = np.triu(M) + np.triu(M, 1).T
        momenta.append(M @ torque(model, both.q[i][None], both.v[i][None], both.a[i][None])[0])
    np.testing.assert_allclose(momenta[0], momenta[1], rtol=2e-3)
    np.testing.assert_allclose(momenta[1], motion.momenta[node, 1], rtol=2e-3)
    np.testing.assert_allclose(both.v[0], both.v[1], atol=1e-12)


def test_a_seam_without_a_goal_is_where_the_best_motion_passes() -> None:
    """One robot throughout, with a node more: the motion of a single plan."""
    halves = [Segment(None, 0.4), Segment([0.7, 0.9], 0.6)]
    options: dict[str, Any] = {"limits": "none", "tolerance": 1e-6}
    found = hovi.plan_sequence(scene(), [0.0, 0.0], halves, **options, self_collision=False)
    single = hovi.plan(scene(), [0.0, 0.0], [0.7, 0.9], 1.0, **options, self_collision=False)
    assert found.cost == pytest.approx(single.cost, rel=2e-6)


def test_one_segment_is_a_plan() -> None:
    found = hovi.plan_sequence(
        scene(),
        [0.0, 0.0],
        [Segment(GRAB, 1.0, effects=[LOAD], limits="none")],
        self_collision=False,
    )
    loaded = hovi.Scene(scene().robot, [*scene().effects, LOAD])
    assert (
        found.cost
        == hovi.plan(loaded, [0.0, 0.0], GRAB, 1.0, limits="none", self_collision=False).cost
    )


def test_an_effect_of_a_segment_takes_the_place_of_the_scenes_own() -> None:
    heavy = hovi.effects.Payload(frame="tip", mass=2.0)
    both = hovi.Scene(scene().robot, [*scene().effects, heavy])
    found = hovi.plan_sequence(
        both, [0.0, 0.0], segments(), limits="none", intervals=12, self_collision=False
    )
    parts = found.trajectory.segments
    assert parts is not None
    carried = [next(e.mass for e in s.effects if e.key == "payload") for s in parts.scenes]  # type: ignore[attr-defined]
    assert carried == [2.0, MASS, 2.0]
    assert parts.scenes[0] is parts.scenes[2]


def test_each_segment_keeps_its_own_limits() -> None:
    slow = {"base": "none", "v": [1.0, 3.0]}
    given = [Segment(x.goal, 1.2 * x.duration, effects=x.effects) for x in segments()]
    given[1] = Segment(PUT, 1.1, effects=[LOAD], limits=slow)
    found = hovi.plan_sequence(scene(), [0.0, 0.0], given, limits="none", self_collision=False)
    assert found.success, found.message
    t = np.linspace(0.0, found.trajectory.duration, 4001)
    v, inside = np.abs(found.trajectory.sample(t).v), (t >= 0.72) & (t <= 1.82)
    assert (v[inside].max(axis=0) <= np.array([1.0, 3.0]) + 1e-4).all()
    assert v[inside, 0].max() > 0.99
    assert v[~inside].max(axis=0)[0] > 1.1


def test_limits_of_all_segments_are_written_as_those_of_one_motion() -> None:
    found = hovi.plan_sequence(
        scene(),
        [0.0, 0.0],
        segments(),
        limits={"base": "none", "v": 20.0},
        intervals=12,
        self_collision=False,
    )
    assert "limits" in found.trajectory.metadata


def test_a_segment_that_waits_stays_where_it_is() -> None:
    """As while a gripper closes; holding the arm costs what its torque at rest does."""
    wait = Segment(GRAB, 0.3, limits={"base": "none", "v": 1e-3}, name="close")
    given = [segments()[0], wait, *segments()[1:]]
    found = hovi.plan_sequence(scene(), [0.0, 0.0], given, limits="none", self_collision=False)
    assert found.success, found.message
    q = found.trajectory.sample(np.linspace(0.6, 0.9, 31)).q
    assert np.abs(q - GRAB).max() < 3e-4
    still = torque(models()[False], np.array([GRAB]), np.zeros((1, 2)), np.zeros((1, 2)))
    held = 0.5 * 0.3 * float(np.sum(still**2))
    assert found.cost == pytest.approx(planned().cost + held, rel=3e-3)


def test_the_branches_of_frames_are_the_cheapest_way_through_them_all() -> None:
    """Of all combinations of elbow up and down, by the action of the cubics between them."""
    robot = scene().robot
    goals = [
        hovi.FrameGoal("tip", position=robot.frame_position("tip", np.array([q]))[0])
        for q in (GRAB, PUT, [0.4, -1.2])
    ]
    given = [Segment(goal, T) for goal, T in zip(goals, (0.6, 0.9, 0.5), strict=True)]
    options = PlanOptions(limits="none").on(scene())
    job = job_of(scene(), State([0.0, 0.0]), goals, given, options)
    free = -np.full(2, np.inf), np.full(2, np.inf)
    moves = [
        MoveToGoal((i,), begin, end, goal, free)
        for i, (begin, end, goal) in enumerate(
            zip((0.0, 0.6, 1.5), (0.6, 1.5, 2.0), goals, strict=True)
        )
    ]
    start = MoveToGoal((), 0.0, 0.0, State([0.0, 0.0]), free)
    _, chosen = chosen_branches(robot, job.lagrangian(), start, moves, options.clearance)

    def cost(nodes: list[Array]) -> float:
        total = 0.0
        for (a, b), move in zip(itertools.pairwise([np.zeros(2), *nodes]), moves, strict=True):
            grid = hovi.Grid.uniform(move.end - move.begin, 4, hovi.schemes.by_name("galerkin-0x8"))
            ld = hovi.DiscreteLagrangian(scene().effort_lagrangian(), grid)
            problem = hovi.TrajectoryProblem(ld, State(a), State(b))
            total += problem.ld.action(problem.guess("cubic"))
        return total

    branches = [hovi.inverse_kinematics(robot, goal, limits="none") for goal in goals]
    assert min(map(len, branches)) >= 2
    best = min(itertools.product(*branches), key=lambda nodes: cost(list(nodes)))
    for goal, q in zip(chosen, best, strict=True):
        assert isinstance(goal, hovi.FrameGoal)
        np.testing.assert_allclose(goal.guess, q, atol=1e-6)  # type: ignore[arg-type]


def test_a_frame_where_segments_meet_is_met_at_rest_or_in_passing() -> None:
    robot = scene().robot
    tip = robot.frame_position("tip", np.array([GRAB]))[0]
    for free, moving in (((), False), (("all",), True)):
        goal = hovi.FrameGoal("tip", position=tip, free_velocity=free)
        given = [Segment(goal, 0.6), *segments()[1:]]
        found = hovi.plan_sequence(scene(), [0.0, 0.0], given, limits="none", self_collision=False)
        assert found.success, found.message
        m = found.trajectory.sample([0.6])
        np.testing.assert_allclose(robot.frame_position("tip", m.q)[0], tip, atol=1e-9)
        assert bool(np.abs(m.v).max() > 0.1) is moving
        assert found.cost <= (passed() if moving else planned()).cost * (1 + 1e-3)


def test_a_tolerance_is_met_although_torques_jump() -> None:
    """The contributions of intervals beside a seam are those of its own segment."""
    tip = scene().robot.frame_position("tip", np.array([PUT]))[0]
    given = [segments()[0], Segment(hovi.FrameGoal("tip", position=tip), 0.9, effects=[LOAD])]
    found = hovi.plan_sequence(
        scene(),
        [0.0, 0.0],
        [*given, segments()[2]],
        limits="none",
        tolerance=1e-6,
        self_collision=False,
    )
    assert found.success, found.message
    assert found.accuracy is not None
    assert "stopped early" not in found.message
    assert found.trajectory.grid.intervals == 24


def test_a_frame_is_met_within_the_limits_of_its_own_segment() -> None:
    """Not within the narrow ones of a segment that waits elsewhere."""
    near = {"base": "none", "q": [[0.69, 0.71], [0.89, 0.91]]}
    tip = scene().robot.frame_position("tip", np.array([PUT]))[0]
    given = [
        segments()[0],
        Segment(GRAB, 0.2, limits=near),
        Segment(hovi.FrameGoal("tip", position=tip), 0.9),
        segments()[2],
    ]
    found = hovi.plan_sequence(
        scene(), [0.0, 0.0], given, limits="none", intervals=16, self_collision=False
    )
    assert found.status is not hovi.Status.INFEASIBLE, found.message
    reached = found.trajectory.configurations([1.7])
    np.testing.assert_allclose(scene().robot.frame_position("tip", reached)[0], tip, atol=1e-8)


@pytest.mark.parametrize(("shoulder", "sign"), [(0.4, 1.0), (1.7, -1.0)])
@pytest.mark.parametrize("narrow", range(3))
def test_a_frame_where_segments_meet_is_met_within_the_limits_of_both(
    narrow: int, shoulder: float, sign: float
) -> None:
    """The elbow bends to the better side, unless the segment before or after is limited to none."""
    limits = {"base": "none", "q": {"elbow": sorted([-9.0 * sign, 0.2 * sign])}}
    tip = scene().robot.frame_position("tip", np.array([GRAB]))[0]
    goals = hovi.FrameGoal("tip", position=tip), [shoulder, 0.0], [0.4, 0.0]
    given = [
        Segment(goal, 0.8, limits=limits if i == narrow else None) for i, goal in enumerate(goals)
    ]
    found = hovi.plan_sequence(
        scene(), [shoulder, 0.0], given, limits="none", intervals=12, self_collision=False
    )
    assert found.violation == ""
    elbow = found.trajectory.configurations([0.8])[0, 1]
    assert elbow == pytest.approx(0.9 * (sign if narrow == 2 else -sign), abs=1e-6)


def test_smooth_sequences_have_continuous_accelerations() -> None:
    found = hovi.plan_sequence(
        scene(), [0.0, 0.0], segments(), limits="none", smooth=True, self_collision=False
    )
    assert found.success, found.message
    motion = found.trajectory
    for t in (0.6, 1.5):
        before, after = motion.sample([t - 1e-7]), motion.sample([t])
        np.testing.assert_allclose(before.a, after.a, atol=1e-2)
        np.testing.assert_allclose(after.v, 0.0, atol=1e-12)
    for t in (0.0, motion.duration):
        np.testing.assert_allclose(motion.sample([t]).a, 0.0, atol=1e-9)


def test_a_via_point_within_a_segment_keeps_its_time() -> None:
    via = hovi.Via(1.0, State([1.2, 1.0]))
    found = hovi.plan_sequence(
        scene(), [0.0, 0.0], segments(), limits="none", via=[via], self_collision=False
    )
    assert found.success, found.message
    np.testing.assert_allclose(found.trajectory.sample([1.0]).q[0], [1.2, 1.0], atol=1e-8)
    np.testing.assert_allclose(found.trajectory.sample([0.6]).q[0], GRAB, atol=1e-12)


def test_an_obstacle_is_avoided_while_something_is_carried() -> None:
    robot = scene().robot
    at = robot.frame_position("tip", planned().trajectory.configurations([0.9]))[0]
    found = hovi.plan_sequence(
        scene(),
        [0.0, 0.0],
        segments(),
        limits="none",
        obstacles=[hovi.Sphere(at, 0.03)],
        intervals=24,
        self_collision=False,
    )
    assert found.cost > planned().cost
    moved = found.trajectory.configurations(np.linspace(0.0, 2.3, 1001))
    assert np.linalg.norm(robot.frame_position("tip", moved) - at, axis=1).min() > 0.039


def test_the_grid_has_the_intervals_and_a_node_at_every_seam() -> None:
    for N in (3, 5, 17):
        found = hovi.plan_sequence(
            scene(),
            [0.0, 0.0],
            segments(),
            limits="none",
            intervals=N,
            max_iterations=1,
            self_collision=False,
        )
        assert found.trajectory.grid.intervals == N
        assert np.abs(found.trajectory.t[:, None] - [0.6, 1.5]).min(axis=0).max() < 1e-12


def test_the_names_and_scenes_of_segments_are_saved(tmp_path: Path) -> None:
    motion = planned().trajectory
    motion.save(tmp_path / "motion.npz")
    loaded = hovi.Trajectory.load(tmp_path / "motion.npz")
    assert loaded.metadata["segment_names"] == ["reach", "carry", "return"]
    t = np.linspace(0.0, 2.3, 41)
    for one, other in zip(motion.sample(t), loaded.sample(t), strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_coarse_sequence_is_the_guess_of_a_fine_one() -> None:
    """More intervals than twice the grid of the search, which keeps the seams."""
    found = hovi.plan_sequence(
        scene(), [0.0, 0.0], segments(), limits="none", intervals=230, self_collision=False
    )
    assert found.success, found.message
    assert found.cost == pytest.approx(planned().cost, rel=1e-3)


def test_several_starts_find_the_same_with_any_number_of_processes() -> None:
    options: dict[str, Any] = {"limits": "none", "starts": 5, "intervals": 12}
    one, two = (
        hovi.plan_sequence(
            scene(), [0.0, 0.0], segments(), **options, processes=n, self_collision=False
        )
        for n in (1, 2)
    )
    assert one.minima == two.minima
    assert one.cost <= planned().cost * 1.01


@pytest.mark.parametrize("limits", ["none", {"base": "none", "tau": [60.0, 40.0]}])
def test_a_sequence_that_runs_out_of_steps_goes_on(limits: Any) -> None:
    """To a motion that meets where segments do, as one that is found at once."""
    said: list[str] = []
    given: dict[str, Any] = {"limits": limits, "intervals": 24, "self_collision": False}
    hurried = {"max_iterations": 3, "progress": lambda text, share: said.append(text)}
    found = hovi.plan_sequence(scene(), [0.0, 0.0], segments(), **given, **hurried)
    assert any(text.startswith("continuation") for text in said)
    assert found.success, found.message
    meets = found.trajectory.sample([0.6, 1.5])
    np.testing.assert_allclose(meets.q, [GRAB, PUT], atol=1e-9)
    np.testing.assert_allclose(meets.v, 0.0, atol=1e-9)
    at_once = hovi.plan_sequence(scene(), [0.0, 0.0], segments(), **given)
    assert found.cost == pytest.approx(at_once.cost, rel=1e-3)


def test_a_segment_that_cannot_be_is_named_before_solving() -> None:
    limits = {"base": "none", "v": [1.0, 1.0]}
    found = hovi.plan_sequence(scene(), [0.0, 0.0], segments(limits=limits), limits="none")
    assert found.status is hovi.Status.INFEASIBLE
    assert found.nit == 0
    assert "in 'reach' joint 'elbow' has to move" in found.message
    tight = {"base": "none", "q": [[-1.0, 1.0], [-2.0, 2.0]]}
    given = [segments()[0], Segment(PUT, 0.9, limits=tight), segments()[2]]
    message = hovi.plan_sequence(scene(), [0.0, 0.0], given, limits="none").message
    assert "in 'segment 2' the position of joint 'shoulder' at the goal is 1.3 rad" in message


def test_a_frame_out_of_reach_is_told() -> None:
    far = hovi.FrameGoal("tip", position=[9.0, 0.0, 0.0])
    given = [Segment(far, 0.6), *segments()[1:]]
    found = hovi.plan_sequence(scene(), [0.0, 0.0], given, limits="none", self_collision=False)
    assert not found.success
    assert "no configuration that reaches" in found.message


def test_the_shipped_sequence_is_planned() -> None:
    found = plan_task(load_task(hovi.example("two_link_pick")))
    assert found.success, found.message
    assert found.trajectory.metadata["segment_names"] == ["reach", "carry", "return"]


@pytest.mark.parametrize(
    ("given", "options", "said"),
    [
        ([], {}, "a sequence has 1 to 1,000 segments, got 0"),
        ("reach", {}, "segments must be a list of hovi.Segment"),
        ([[0.0, 0.0]], {}, "segments must be a list of hovi.Segment"),
        ([Segment(None, 1.0)], {}, "the last segment, 'segment 1', needs a goal"),
        (
            [Segment(GRAB, 1.0, name="a"), Segment(PUT, 1.0, name="a")],
            {},
            "two segments have the name 'a'",
        ),
        (
            [Segment(State(GRAB, a=[1.0, 1.0]), 1.0), Segment(PUT, 1.0)],
            {},
            "the goal of 'segment 1' takes no `a`",
        ),
        (segments(), {"time_weight": 1.0}, "time_weight needs a free duration"),
        (segments(), {"turns": {"elbow": 1}}, "takes no `turns`"),
        (segments(), {"intervals": 2, "scheme": "galerkin-2"}, "2 intervals are too few for 3"),
        (
            segments(),
            {"smooth": True, "limits": {"base": "none", "torque_rate": 100.0}},
            "has limits on the torque rate, but torques jump",
        ),
        (
            [Segment([0.0], 1.0), Segment(PUT, 1.0)],
            {},
            "expected (2,): one number each for shoulder, elbow",
        ),
        ([Segment("home", 1.0), Segment(PUT, 1.0)], {}, "no pose"),
        (
            [Segment(GRAB, 1.0, effects=[LOAD, LOAD]), Segment(PUT, 1.0)],
            {},
            "the effect 'payload' is named twice",
        ),
    ],
)
def test_what_is_no_sequence_is_refused(given: Any, options: Any, said: str) -> None:
    with pytest.raises(HoviError, match=re.escape(said)):
        hovi.plan_sequence(scene(), [0.0, 0.0], given, **options, self_collision=False)


@pytest.mark.parametrize("duration", [0.0, -1.0, float("nan"), float("inf"), "2 parsecs", None])
def test_a_duration_that_is_none_is_refused(duration: Any) -> None:
    with pytest.raises(InputError, match="duration of a segment"):
        Segment(GRAB, duration)


@pytest.mark.parametrize("effects", [LOAD, "payload", [None], [[LOAD]]])
def test_effects_that_are_none_are_refused(effects: Any) -> None:
    with pytest.raises(SceneError, match="effects is a list such as"):
        Segment(GRAB, 1.0, effects=effects)


@pytest.mark.parametrize("seconds", [1e-9, 5e-3])
def test_a_time_limit_that_ends_before_the_search_leaves_the_guess(seconds: float) -> None:
    goal = hovi.FrameGoal("tip", position=[-0.6, 0.0, 1.4])
    parts = [Segment(goal, 0.6), Segment([0.0, 0.0], 0.8)]
    late = hovi.plan_sequence(scene(), [0.0, 0.0], parts, time_limit=seconds, self_collision=False)
    assert late.status is hovi.Status.TIME_LIMIT
    assert np.isfinite(late.cost)


def test_obstacles_that_move_are_looked_at_by_the_clock_of_the_sequence() -> None:
    """A ball leaves the last goal after half of the time, or comes there at its end."""
    robot = hovi.load_robot("ur5")
    q = [[0.0, -1.2, 1.2, -0.5, 0.3, 0.1], [0.9, -1.0, 0.8, 0.1, -0.3, 0.5], [0.0] * 6]
    tip = robot.frame_pose("tool0", np.array(q[2]))[:3, 3]
    here, away = [0.0, 0.0, 0.0], [0.0, 0.0, 9.0]
    parts = [{"goal": q[1], "duration": 1.5}, {"goal": q[2], "duration": 1.5}]
    arm = hovi.Scene(robot, [hovi.effects.Gravity()])
    for times, positions, refused in (
        ([1.5, 3.0], [here, away], False),
        ([0.0, 3.0], [away, here], True),
    ):
        path = {"times": times, "positions": positions}
        ball = hovi.Sphere(tip, 0.1, name="ball", path=path)
        found = hovi.plan_sequence(
            arm, q[0], parts, obstacles=[ball], time_limit=0.2, self_collision=False
        )
        assert ("and obstacle 'ball' overlap" in found.message) == refused


@pytest.mark.parametrize("slower", [1.25, 1.75])
def test_a_pick_that_would_fold_into_itself_keeps_its_distances(slower: float) -> None:
    task = load_task(hovi.example("panda_pick_and_place"))
    longer = [
        dataclasses.replace(each, duration=each.duration * (slower if i % 2 == 0 else 1.0))
        for i, each in enumerate(task.segments)
    ]
    total = sum(each.duration for each in longer)
    task = dataclasses.replace(task, segments=tuple(longer), duration=total)
    found = plan_task(task, tolerance="1 %")
    assert found.success, found.message
    assert not found.violation
    assert found.problem is not None
    assert found.problem.distances is not None
    distances = found.problem.distances
    q = found.trajectory.configurations(np.linspace(0.0, total, 5001))
    assert distances.values(q, 0.05).min() > 0.01


def test_a_joint_may_stop_at_its_limit_between_segments() -> None:
    """As costly as plans of each segment alone, whose ends are at the limit."""
    limits = {"base": "none", "q": [[-3.0, 3.0], [-GRAB[1], GRAB[1]]]}
    options = {"limits": limits, "self_collision": False}
    moves = [(GRAB, 0.5), (GRAB, 0.3), ([0.0, 0.0], 0.8)]
    found = hovi.plan_sequence(scene(), [0.0, 0.0], [Segment(*each) for each in moves], **options)
    assert found.success, found.message
    starts = [[0.0, 0.0], GRAB, GRAB]
    alone = [hovi.plan(scene(), q, *each, **options) for q, each in zip(starts, moves, strict=True)]
    assert found.cost == pytest.approx(sum(each.cost for each in alone), rel=2e-3)
    elbow = found.trajectory.sample(np.linspace(0.0, 1.6, 5001)).q[:, 1]
    assert GRAB[1] - 1e-6 < elbow.max() < GRAB[1] + 1e-5
