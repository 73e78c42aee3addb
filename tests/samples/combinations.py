"""Motions asked for in every way at once: one value of each axis, and an independent judge.

A case is a robot, an effect, limits, a goal, a duration, a world, a grid, a number of starts, a
call, and a kind of arrays. It is carried out by the public functions. What comes back satisfies
what it claims, by Pinocchio and dense samples alone, or it is a HoviError of one sentence.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pinocchio as pin

import hovi
from hovi.accuracy.effect_study.study import study_effects
from samples.pairwise import Case, Pair
from samples.small_robots import arm, with_shapes

Array = np.ndarray
SAMPLES = 2_001
TIME, STEPS = 1.25, 150
SAME, LIMIT_SLACK = 1e-5, 3e-6
"""Of ends, in [rad] or [m]; of limits, relative to their ranges."""


def two_link() -> hovi.Robot:
    return hovi.load_robot(hovi.example("two_link.urdf"))


ROBOTS: dict[str, Callable[[], hovi.Robot]] = {
    "two_link": two_link,
    "three joints": lambda: arm("three", ("revolute",) * 3),
    "continuous": lambda: arm("turning", ("revolute", "continuous")),
    "free-flyer": lambda: arm("flyer", ("revolute",) * 2, free_flyer=True),
    "passive": lambda: with_shapes("cart_pole.urdf"),
    "moving base": two_link,
}
PASSIVE = ("hinge",)
_ROLLING = hovi.effects.MovingBase(position=("0.05*sin(3*t)", 0.0, 0.0), rotation=(0, "0.1*t", 0))


def _casadi_cost(nq: int, nv: int) -> ca.Function:
    q, v, a, tau = (ca.SX.sym(name, n) for name, n in zip("qvau", (nq, nv, nv, nv), strict=True))
    return ca.Function("C", [q, v, a, tau, ca.SX.sym("t")], [0.1 * ca.sumsqr(v)])


def effects_of(robot: hovi.Robot) -> dict[str, list[hovi.effects.Effect]]:
    """An effect of every kind for a robot."""
    e, tip = hovi.effects, robot.tip_frame
    joints = zip(list(robot.model.joints)[1:], list(robot.model.names)[1:], strict=True)
    plain = [name for joint, name in joints if joint.nq == joint.nv == 1]
    last = plain[-1]  # that has a position
    every: dict[str, list[hovi.effects.Effect]] = {
        "acceleration_cost": [e.AccelerationCost(0.01)],
        "armature": [e.Armature(0.05)],
        "casadi_cost": [e.CasadiCost(_casadi_cost(robot.nq, robot.nv))],
        "custom": [e.Custom({last: f'0.1*sin(v["{last}"])'}, f'0.1*v["{last}"]**2')],
        "drag": [e.Drag(tip, 0.05, wind=(0.0, 2.0, 0.0))],
        "dry_friction": [e.DryFriction(0.1, width=0.2)],
        "effort_weight": [e.EffortWeight({last: 2.0})],
        "effort_matrix": [e.EffortWeight(matrix=(2.0 * np.eye(robot.nv) + 0.1).tolist())],
        "jerk_cost": [e.JerkCost(1e-4)],
        "joint_limit_potential": [e.JointLimitPotential({last: (-2.0, 2.0)}, 10.0, 0.05)],
        "joint_springs": [e.JointSprings({last: 1.0}, {last: 0.0})],
        "moving_base": [_ROLLING],
        "payload": [e.Payload(tip, 0.3)],
        "power_cost": [e.PowerCost(0.1, 0.5)],
        "reference_cost": [e.ReferenceCost({last: 0.2}, 1.0)],
        "running_cost": [e.RunningCost({"drives": "0.01*dot(tau, tau)"})],
        "velocity_cost": [e.VelocityCost(0.1)],
        "viscous_friction": [e.ViscousFriction(0.1)],
        "wrench": [e.Wrench(tip, (0.0, 0.0, -1.0))],
    }
    return every


GROUPS: dict[str, tuple[str, ...]] = {
    "nothing": (),
    "gravity": (),
    "rotors": ("armature", "viscous_friction"),
    "joints": ("dry_friction", "joint_springs"),
    "tool": ("payload", "drag"),
    "forces": ("wrench", "custom"),
    "rates": ("acceleration_cost", "velocity_cost", "power_cost"),
    "costs": ("effort_weight", "running_cost", "reference_cost"),
    "matrix": ("effort_matrix", "casadi_cost", "joint_limit_potential"),
    "jerk": ("jerk_cost",),
    "rolling": ("moving_base",),
}
"""Effects that act together, so that there are fewer combinations. Gravity is with all but one."""


def chosen_effects(robot: hovi.Robot, name: str) -> list[hovi.effects.Effect]:
    """Those of a group, or of one kind alone."""
    every = effects_of(robot)
    found = [each for kind in GROUPS.get(name, (name,)) for each in every[kind]]
    return found if name == "nothing" else [hovi.effects.Gravity(), *found]


RIGID_ALONE = {
    *(
        "nothing",
        "gravity",
        "rates",
        "costs",
        "matrix",
        "jerk",
        "acceleration_cost",
        "casadi_cost",
        "effort_weight",
        "effort_matrix",
    ),
    *("jerk_cost", "joint_limit_potential", "power_cost", "reference_cost", "running_cost"),
    *("velocity_cost",),
}
"""Effects that change no torque."""


def _reversed(x: Array) -> Array:
    return np.array(x[::-1])[::-1]


def _read_only(x: Array) -> Array:
    copy = x.copy()
    copy.setflags(write=False)
    return copy


def _as_integers(x: Array) -> Array:
    whole = bool((x == np.round(x)).all())
    return x.astype(np.int64) if whole else x


ARRAYS: dict[str, Callable[[Array], Any]] = {
    "list": lambda x: x.tolist(),
    "tuple": lambda x: tuple(x.tolist()),
    "reversed": _reversed,
    "strided": lambda x: np.repeat(x, 2)[::2],
    "read-only": _read_only,
    "single": lambda x: x.astype(np.float32),
    "integers": _as_integers,
    "other bytes": lambda x: x.astype(">f8"),
    "unmasked": lambda x: np.ma.array(x, mask=np.zeros(len(x), bool)),
}
AXES: dict[str, tuple[str, ...]] = {
    "robot": tuple(ROBOTS),
    "effect": tuple(GROUPS),
    "limits": ("urdf", "none", "own", "margin"),
    "smooth": ("no", "yes"),
    "goal": (
        *("configuration", "state", "dict", "position", "pose", "axis", "free"),
        *("periodic", "segments"),
    ),
    "via": ("none", "configuration", "frame"),
    "duration": ("fixed", "text", "free"),
    "world": ("empty", "obstacle", "moving obstacle", "self-collision"),
    "grid": ("default", "tolerance", "intervals", "scheme"),
    "starts": ("1", "2"),
    "call": ("plan", "replan", "advance", "sample", "simulate", "study"),
    "arrays": tuple(ARRAYS),
}


REFUSED: tuple[tuple[str, str, str, str], ...] = (
    *(("via", via, "duration", "free") for via in ("configuration", "frame")),
    *(("via", via, "goal", "periodic") for via in ("configuration", "frame")),
    *(("goal", "periodic", "robot", name) for name in ("passive", "continuous", "free-flyer")),
    *(("goal", "segments", "robot", name) for name in ("passive", "continuous", "free-flyer")),
    ("goal", "segments", "duration", "free"),
    *(("robot", "free-flyer", *other) for other in (("smooth", "yes"), ("effect", "jerk"))),
    ("robot", "free-flyer", "effect", "rolling"),
    ("smooth", "yes", "effect", "jerk"),
    *(
        ("robot", name, "world", "self-collision")
        for name in ("two_link", "moving base", "passive")
    ),
    *((*timed, "duration", "free") for timed in (("robot", "moving base"), ("effect", "rolling"))),
    *((*timed, "call", "advance") for timed in (("robot", "moving base"), ("effect", "rolling"))),
    *(
        ("world", "moving obstacle", *other)
        for other in (("call", "advance"), ("duration", "free"))
    ),
    ("goal", "segments", "call", "advance"),
)
"""Pairs of values that are refused, whatever the others are."""
LEFT_OUT: set[Pair] = {frozenset([(a, x), (b, y)]) for a, x, b, y in REFUSED}


@cache
def robot_of(name: str) -> hovi.Robot:
    return ROBOTS[name]()


@dataclass(frozen=True)
class Asked:
    """What a case asks for. q0, q1: ends. middle: between them. d: from q0 to q1."""

    case: Case

    @property
    def robot(self) -> hovi.Robot:
        return robot_of(self.case["robot"])

    @property
    def scene(self) -> hovi.Scene:
        robot, effects = self.robot, chosen_effects(self.robot, self.case["effect"])
        if self.case["robot"] == "moving base" and _ROLLING not in effects:
            effects.append(_ROLLING)
        passive = PASSIVE if self.case["robot"] == "passive" else ()
        return hovi.Scene(robot, effects, passive=passive, compile=False)

    @property
    def d(self) -> Array:
        """In eighths, which single precision keeps."""
        if self.case["robot"] == "passive":
            return np.array([0.5, 0.0])
        return np.where(np.arange(self.robot.nv) % 2 == 0, 0.25, -0.375)

    @property
    def q0(self) -> Array:
        return self.robot.neutral()

    @property
    def q1(self) -> Array:
        exact = self.robot.integrate(self.q0, self.d)
        return exact.astype(np.float32).astype(float) if self.robot.nq == self.robot.nv else exact

    @property
    def middle(self) -> Array:
        return self.robot.integrate(self.q0, 0.5 * self.d)

    def array(self, x: Array) -> Any:
        """Numbers as the kind of arrays of the case; not as single precision of unit norms."""
        kind = self.case["arrays"]
        if kind == "single" and self.robot.nq != self.robot.nv:
            kind = "reversed"
        return ARRAYS[kind](np.array(x, dtype=float))

    @property
    def limits(self) -> Any:
        own = {"base": "none", "v": 4.0, "tau": 80.0}
        return {"own": own, "margin": {"margin": 0.1}}.get(self.case["limits"], self.case["limits"])

    @property
    def bounds(self) -> Iterator[tuple[str, Array, Array]]:
        """(kind, lower, upper), of q by entry, of v and tau by coordinate."""
        model, kind = self.robot.model, self.case["limits"]
        nq, nv = model.nq, model.nv
        if kind == "none":
            return
        if kind == "own":
            yield "v", np.full(nv, -4.0), np.full(nv, 4.0)
            yield "tau", np.full(nv, -80.0), np.full(nv, 80.0)
            return
        lower, upper = np.full(nq, -np.inf), np.full(nq, np.inf)
        for joint in list(model.joints)[1:]:
            if joint.nq == joint.nv == 1:
                lower[joint.idx_q] = model.lowerPositionLimit[joint.idx_q]
                upper[joint.idx_q] = model.upperPositionLimit[joint.idx_q]
        share = 0.1 if kind == "margin" else 0.0  # at each end
        fastest, strongest = model.velocityLimit, model.effortLimit
        rates = ("v", -fastest, fastest), ("tau", -strongest, strongest)
        for name, low, high in (("q", lower, upper), *rates):
            limited = (high > low) & (high < 1e15) & (low > -1e15)
            low, high = np.where(limited, low, -np.inf), np.where(limited, high, np.inf)
            room = share * np.where(limited, high, 0.0) - share * np.where(limited, low, 0.0)
            yield name, low + room, high - room

    @property
    def goal(self) -> Any:
        robot, q1, last = self.robot, self.q1, self.robot.coordinate_names[-1]
        kind, tip = self.case["goal"], robot.tip_frame
        pose = robot.frame_pose(tip, q1)
        if kind == "state":
            return hovi.State(self.array(q1), self.array(0.125 * np.sign(self.d)))
        if kind == "dict":
            return self._table(q1)
        if kind == "position":
            return hovi.FrameGoal(tip, position=self.array(pose[:3, 3]))
        if kind == "pose":
            return hovi.FrameGoal(tip, pose=np.asfortranarray(pose))
        if kind == "axis":
            return hovi.FrameGoal(tip, axis=(self.array(np.eye(3)[0]), self.array(pose[:3, 0])))
        if kind == "free":
            return hovi.State(self.array(q1), free=(last,), free_velocity=(last,))
        if kind == "periodic":
            return hovi.Periodic(self.array(np.zeros(robot.nv)))
        return self.array(q1)

    def _table(self, q: Array) -> dict[str, Any]:
        model = self.robot.model
        joints = zip(list(model.names)[1:], list(model.joints)[1:], strict=True)
        return {
            name: q[j.idx_q : j.idx_q + j.nq].tolist() if j.nq > 1 else float(q[j.idx_q])
            for name, j in joints
        }

    @property
    def options(self) -> dict[str, Any]:
        ball = hovi.Sphere(self.array(np.array([0.0, 4.0, 4.0])), 0.25, name="ball")
        path = {"times": [0.0, 5.0], "positions": [[0.0, 0.0, 0.0], [0.0, 0.5, 0.0]]}
        worlds: dict[str, dict[str, Any]] = {
            "empty": {"self_collision": False},
            "obstacle": {"obstacles": [ball], "self_collision": False},
            "moving obstacle": {
                "obstacles": [hovi.Sphere([0.0, 4.0, 4.0], 0.25, path=path, name="ball")],
                "self_collision": False,
            },
            "self-collision": {"self_collision": True},
        }
        grids: dict[str, dict[str, Any]] = {
            "default": {},
            "tolerance": {"tolerance": 1e-2},
            "intervals": {"intervals": 8},
            "scheme": {"scheme": "galerkin-2x8", "intervals": 6},
        }
        chosen = {
            **{"limits": self.limits, "starts": int(self.case["starts"]), "processes": 1},
            **{"smooth": self.case["smooth"] == "yes", "max_iterations": STEPS},
            "continuation": False,
            **worlds[self.case["world"]],
            **grids[self.case["grid"]],
        }
        if self.case["duration"] == "free":
            chosen["time_weight"] = 30.0
        tip, middle = self.robot.tip_frame, self.middle
        if self.case["via"] == "configuration":
            chosen["via"] = [hovi.Via(TIME / 2, hovi.State(self.array(middle)))]
        if self.case["via"] == "frame":
            at = self.array(self.robot.frame_position(tip, middle))
            chosen["via"] = [{"time": "625 ms", "frame": tip, "position": at}]
        return chosen

    @property
    def duration(self) -> Any:
        texts = {"fixed": TIME, "text": "1250 ms", "free": (0.5 * TIME, 2.0 * TIME)}
        return texts[self.case["duration"]]


def planned(asked: Asked) -> hovi.Solution:
    """The first motion of a case."""
    scene, start = asked.scene, asked.array(asked.q0)
    if asked.case["goal"] == "periodic":
        return _period(asked)
    if asked.case["goal"] == "segments":
        middle = {"goal": asked.array(asked.middle), "duration": 0.5 * TIME}
        last = hovi.Segment(asked.goal, asked.duration, effects=[hovi.effects.VelocityCost(0.01)])
        return hovi.plan_sequence(scene, start, [middle, last], **asked.options)
    return hovi.plan(scene, start, asked.goal, asked.duration, **asked.options)


def _period(asked: Asked) -> hovi.Solution:
    """A period, with what a problem takes of the options."""
    scheme = hovi.schemes.galerkin(2, derivatives=asked.scene.order, points=8)
    grid = hovi.Grid.uniform(TIME, 8, scheme)
    ld = hovi.DiscreteLagrangian(asked.scene.effort_lagrangian(), grid)
    limits = hovi.as_limits(asked.robot, asked.limits, asked.scene.order)
    start = hovi.State(asked.array(asked.q0), asked.array(0.25 * np.sign(asked.d)))
    via = hovi.PlanOptions(**asked.options).via
    return hovi.solve(hovi.TrajectoryProblem(ld, start, asked.goal, limits=limits, via=via))


class NoMotionError(Exception):
    """There is none, for the reason given."""


def carried_out(case: Case, folder: Path) -> tuple[str, str]:
    """What is wrong with the outcome of a case, and why it has no motion; "" where nothing is.

    Raises whatever hovi raises but a HoviError of one sentence.
    """
    asked = Asked(case)
    try:
        if case["call"] == "study":
            return _study(asked), ""
        found = _motion(planned(asked))
        return judged(asked, found) or _called(asked, found, folder), ""
    except (hovi.HoviError, NoMotionError) as error:
        sentence = str(error)
        clear = 0 < len(sentence) < 1_500 and "\n" not in sentence
        return ("" if clear else f"no sentence: {sentence!r}"), sentence


def _motion(found: hovi.Solution) -> hovi.Solution:
    if not found.success:
        raise NoMotionError(f"{found.status}: {found.message}" if found.message else "")
    return found


def _called(asked: Asked, found: hovi.Solution, folder: Path) -> str:
    """The second call of a case."""
    call = asked.case["call"]
    if call == "replan":
        moved = asked.robot.integrate(asked.q1, 0.0625 * np.sign(asked.d))
        again = _motion(found.replan(asked.array(asked.q0), asked.array(moved)))
        return judged(asked, again, goal=moved)
    if call == "advance":
        again = _motion(found.advance(0.25))
        passed = found.trajectory.sample([0.25])
        return judged(asked, again, start=(passed.q[0], passed.v[0]), elapsed=0.25)
    if call == "sample":
        return _samples(asked, found.trajectory, folder)
    if call == "simulate":
        motion = hovi.simulate(
            asked.scene, asked.array(asked.q0), 0.25, found.trajectory, intervals=50
        )
        finite = np.isfinite(motion.q).all() and np.isfinite(motion.v).all()
        if not finite:
            return "the simulation is not finite"
        apart = asked.robot.difference(asked.q0, motion.q[0])
        return "" if np.abs(apart).max() < SAME else "the simulation starts elsewhere"
    return ""


def _study(asked: Asked) -> str:
    """A study of two candidates."""
    options = hovi.PlanOptions(**asked.options)
    start, goal = hovi.State(asked.array(asked.q0)), asked.goal
    if isinstance(goal, hovi.Periodic):
        return ""
    if not isinstance(goal, hovi.State | hovi.FrameGoal):
        goal = hovi.State(goal)
    candidates = [hovi.effects.ViscousFriction(0.05), _ROLLING]
    task = hovi.Task(asked.scene, start, goal, asked.duration, options, "a study")
    study = study_effects(task, candidates)
    counted = len(study.trials) + len(study.failed) + len(study.untried)
    if counted != len(candidates):
        return f"{counted} of {len(candidates)} candidates are accounted for"
    unclear = [each.reason for each in study.failed if ": " in each.reason[:20]]
    return f"a trial failed: {unclear[0]}" if unclear else judged(asked, study.solution)


def _samples(asked: Asked, motion: hovi.Trajectory, folder: Path) -> str:
    """Samples at times and in intervals agree, with those of the motion from a file, too."""
    t = asked.array(np.linspace(0.0, 1.0, 9) * motion.duration)
    whole = np.asarray(t, dtype=float)
    k = np.clip(np.searchsorted(motion.t, whole, side="right") - 1, 0, len(motion.t) - 2)
    s = np.clip((whole - motion.t[k]) / np.diff(motion.t)[k], 0.0, 1.0)
    motion.save(folder / "motion.npz")
    loaded = hovi.Trajectory.load(folder / "motion.npz")
    expected = motion.sample(np.minimum(whole, motion.duration).tolist())
    at = _reversed(k), _reversed(s)
    for name, found in (
        ("times", motion.sample(np.minimum(t, motion.duration))),
        ("intervals", motion.sample_intervals(*at)),
        ("a file", loaded.sample_intervals(*at)),
    ):
        for key in ("q", "v", "a", "tau"):
            x, y = getattr(found, key), getattr(expected, key)
            size = max(1.0, float(np.abs(y).max(initial=0.0)))
            if not np.abs(x - y).max(initial=0.0) <= 1e-6 * size:
                return f"{key} sampled by {name} differs"
    jets = motion.jet_intervals(*at)
    return "" if np.abs(jets[0] - expected.q).max() <= 1e-9 else "jets in intervals differ"


# The judge: Pinocchio and dense samples


def judged(
    asked: Asked,
    found: hovi.Solution,
    start: tuple[Array, Array] | None = None,
    goal: Array | None = None,
    elapsed: float = 0.0,
) -> str:
    """What a success does not satisfy of what it claims; "" if nothing."""
    motion = found.trajectory
    t = np.linspace(0.0, motion.duration, SAMPLES)
    sample = motion.sample(t)
    series = {"q": sample.q, "v": sample.v, "a": sample.a, "tau": sample.tau}
    if not all(np.isfinite(x).all() for x in series.values()):
        return "samples are not finite"
    if not math.isfinite(found.cost):
        return "the cost is not finite"
    checks: Mapping[str, Callable[[], str]] = {
        "duration": lambda: _duration(asked, motion.duration, elapsed),
        "start": lambda: _start(asked, series, start, goal),
        "goal": lambda: _goal(asked, series, goal),
        "via": lambda: "" if elapsed or goal is not None else _via(asked, motion),
        "limits": lambda: _limits(asked, series),
        "torques": lambda: _torques(asked, series),
    }
    wrong = ((name, check()) for name, check in checks.items())
    return next((f"{name}: {what}" for name, what in wrong if what), "")


def _duration(asked: Asked, T: float, elapsed: float) -> str:
    low, high = (0.5 * TIME, 2.0 * TIME) if asked.case["duration"] == "free" else (TIME, TIME)
    sequence = asked.case["goal"] == "segments" and asked.case["call"] != "study"
    more = 0.5 * TIME if sequence else 0.0
    inside = low + more - elapsed - 1e-9 <= T <= high + more - elapsed + 1e-9
    return "" if inside else f"{T} s"


def _start(
    asked: Asked,
    series: Mapping[str, Array],
    start: tuple[Array, Array] | None,
    goal: Array | None,
) -> str:
    if asked.case["goal"] == "periodic" and start is None and goal is None:
        ends = asked.robot.difference(series["q"][0], series["q"][-1])
        apart = max(np.abs(ends).max(), np.abs(series["v"][-1] - series["v"][0]).max())
        return "" if apart < SAME else f"the ends of a period differ by {apart:.3g}"
    q, v = (asked.q0, np.zeros(asked.robot.nv)) if start is None else start
    apart = np.abs(asked.robot.difference(q, series["q"][0])).max()
    if not max(apart, np.abs(series["v"][0] - v).max()) < SAME:
        return f"{apart:.3g} away"
    return ""


def _goal(asked: Asked, series: Mapping[str, Array], goal: Array | None) -> str:
    robot, kind, q, v = asked.robot, asked.case["goal"], series["q"][-1], series["v"][-1]
    if goal is None and kind == "periodic":
        return ""
    if goal is None and kind in ("position", "pose", "axis"):
        here, wanted = (robot.frame_pose(robot.tip_frame, x) for x in (q, asked.q1))
        apart = np.abs(here - wanted)
        missed = {"position": apart[:3, 3], "pose": apart, "axis": apart[:3, 0]}[kind].max()
        return "" if missed < SAME else f"the frame misses its {kind} by {missed:.3g}"
    apart, speed = robot.difference(q, asked.q1 if goal is None else goal), v.copy()
    if goal is None and kind == "free":
        apart[-1] = speed[-1] = 0.0
    if goal is None and kind == "state":
        speed -= 0.125 * np.sign(asked.d)
    missed = max(np.abs(apart).max(), np.abs(speed).max())
    return "" if missed < SAME else f"missed by {missed:.3g}"


def _via(asked: Asked, motion: hovi.Trajectory) -> str:
    robot, kind = asked.robot, asked.case["via"]
    if kind == "none" or asked.case["goal"] in ("periodic", "segments"):
        return ""
    at = 0.5 * TIME  # a via point's time is one of the first duration asked for
    if asked.case["duration"] == "free":
        return ""
    q = motion.sample([at]).q[0]
    here, wanted = (robot.frame_position(robot.tip_frame, x) for x in (q, asked.middle))
    missed = np.abs(here - wanted).max()
    if kind == "configuration":
        missed = np.abs(robot.difference(q, asked.middle)).max()
    return "" if missed < SAME else f"missed by {missed:.3g}"


def _limits(asked: Asked, series: Mapping[str, Array]) -> str:
    for name, low, high in asked.bounds:
        limited = np.isfinite(high) & np.isfinite(low)
        low, high, given = low[limited], high[limited], series[name][:, limited]
        over = np.maximum(given - high, low - given).max(axis=0, initial=0.0) / (high - low)
        if over.max(initial=0.0) > LIMIT_SLACK:
            return f"{name} is over its limit by {over.max():.3g} of its range"
    return ""


def _torques(asked: Asked, series: Mapping[str, Array]) -> str:
    tau = series["tau"]
    largest = max(float(np.abs(tau).max()), 1e-3)
    if asked.case["robot"] == "passive":
        passive = np.abs(tau[:, 1]).max() / largest
        return "" if passive < 0.02 else f"a passive joint has {passive:.3g} of the largest"
    if asked.case["robot"] == "moving base" or asked.case["effect"] not in RIGID_ALONE:
        return ""
    model = asked.robot.model.copy()
    down = 0.0 if asked.case["effect"] == "nothing" else -9.81
    model.gravity.linear, model.armature = np.array([0.0, 0.0, down]), np.zeros(model.nv)
    data, some = model.createData(), slice(None, None, 20)
    jets = zip(series["q"][some], series["v"][some], series["a"][some], strict=True)
    expected = np.array([pin.rnea(model, data, *jet) for jet in jets])
    wrong = np.abs(tau[some] - expected).max() / largest
    return "" if wrong < 1e-8 else f"torques are off by {wrong:.3g} of the largest"
