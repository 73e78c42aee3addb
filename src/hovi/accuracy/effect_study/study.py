"""The influence of each effect, added alone to a scene, and its computing time."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from hovi.accuracy.effect_study.candidates import check_frames_move, effect_candidates
from hovi.discrete.trajectory import Trajectory
from hovi.effects import Effect, Touch
from hovi.errors import HoviError, InputError, SceneError
from hovi.flows.execution.tracking import play
from hovi.planning.refinement.error_estimate import estimate_error
from hovi.planning.solver.solver import Solution
from hovi.planning.task_file.task import Task
from hovi.planning.task_file.task_plan import plan_task
from hovi.robot.frame_distance import FrameDistance
from hovi.scene.evaluation_cost import seconds_per_point
from hovi.scene.scene import Scene, require_inertia
from hovi.system.dataclass import dataclass
from hovi.system.deadline import Deadline, OutOfTimeError
from hovi.system.interruption import interruptible, raise_if_interrupted, record_interrupt
from hovi.system.progress import Progress, shows_progress, silent

Array = npt.NDArray[np.float64]

BANDWIDTH = 10.0
"""Bandwidth of the tracking feedback, in [rad/s]."""
_SAMPLES = 20  # per interval
_TIME_FACTOR = 10.0  # default limit of a candidate, relative to the time of the task
_MIN_TIME_LIMIT = 10.0  # [s]


@dataclass(frozen=True)
class EffectTrial:
    """A scene with one effect added or removed, compared with the scene itself.

    effect: the effect. added: False if it was removed because the scene has it.
    torque: largest change of the torque along the scene's own motion, in [N m].
    cost: of the motion planned with the change, with the scene's own motion as the guess.
        success: whether that is a minimum; if not, the cost has no meaning.
        nit, plan_seconds: iterations and time of planning.
    tip: largest distance of the robot's tip_frames from the scene's own motion, in [m]; None if the
        durations differ or no minimum was found. tip_noise: how much of it may come from the grids:
        the estimated errors of both motions at the tip, in [m]; None if they are unknown.
    open_loop, held: tip deviation at the end, the largest of the tip_frames, when the planned
        torques are applied in the changed scene, without and with a feedback of 10 rad/s, in [m];
        None if the simulation diverged.
    instructions: added to the expression graph.
    seconds: of an evaluation with derivatives, per point.
    """

    effect: Effect
    added: bool
    torque: float
    cost: float
    success: bool
    nit: int
    plan_seconds: float
    tip: float | None
    tip_noise: float | None
    open_loop: float | None
    held: float | None
    instructions: int
    seconds: float

    @property
    def name(self) -> str:
        """The effect's key, after + or -."""
        return f"{'+' if self.added else '-'} {self.effect.key}"


@dataclass(frozen=True)
class FailedTrial:
    """A candidate effect with which nothing was found, such as one that the limits do not allow.

    reason: one sentence.
    """

    effect: Effect
    reason: str


@dataclass(frozen=True, eq=False)
class EffectStudy:
    """The motion of a scene and one trial per candidate effect.

    task: the task. solution: its motion. seconds: of an evaluation with derivatives, per point.
    plan_seconds: of planning it again from its own motion.
    untried: candidates not reached before the time limit or an interrupt.
    failed: candidates whose trial ended with an error.
    """

    task: Task
    solution: Solution
    seconds: float
    plan_seconds: float
    trials: tuple[EffectTrial, ...]
    untried: tuple[Effect, ...] = ()
    failed: tuple[FailedTrial, ...] = ()

    def change(self, trial: EffectTrial) -> float:
        """Relative change of the cost; NaN if no minimum was found with the effect."""
        if not trial.success:
            return np.nan
        return trial.cost / self.solution.cost - 1.0 if self.solution.cost else np.inf


@interruptible
@shows_progress
def study_effects(
    task: Task,
    candidates: Iterable[Effect] | None = None,
    progress: Progress | None = None,
    time_limit: float | None = None,
) -> EffectStudy:
    """Plan a task, then again with each candidate effect alone.

    candidates: effects to add; one that the scene has is removed instead. By default those of
        `effect_candidates`.
    time_limit: of the whole study, in [s], shared evenly by the remaining candidates; none is
        started when time is up. By default a candidate is planned in at most ten times the time
        of the task, at least 10 s. A KeyboardInterrupt ends the study with the trials so far.
    A candidate that fails is among `failed`, and the others are tried.
    Raises SceneError when no motion of the task itself is found and, before it is looked for, for a
    candidate that the robot cannot have, and InputError for one at a frame that cannot move;
    ModelError for a robot without inertia, whose motion has no torques to compare.
    """
    task.require_one_motion("a study of effects")
    require_inertia(task.scene, "a study of effects")
    report = progress or silent
    deadline, scene = Deadline(time_limit), task.scene
    tried = tuple(
        effect_candidates(scene.robot, scene.passive) if candidates is None else candidates
    )
    check_frames_move(scene.robot, tried)
    scenes = [_with_or_without(scene, effect) for effect in tried]
    began = time.perf_counter()
    report("planning the unchanged scene", 0.0)
    solution = _plan(task, task.scene, "cubic", task.options.starts, deadline.seconds_left)
    if not solution.success:
        raise SceneError(
            f"the effects of {task.name!r} cannot be compared, as no motion of the scene itself "
            f"was found: {solution.message}"
        )
    default_limit = max(_TIME_FACTOR * (time.perf_counter() - began), _MIN_TIME_LIMIT)
    began = time.perf_counter()
    _plan(task, task.scene, solution.trajectory, 1)
    replan_seconds = time.perf_counter() - began
    own_error = _tip_error(solution, default_limit)
    own_seconds, *times = seconds_per_point([scene, *scenes])
    trials, failed = list[EffectTrial](), list[FailedTrial]()
    try:
        for i, (effect, changed, seconds) in enumerate(zip(tried, scenes, times, strict=True)):
            report(f"trying {effect.key}", (1 + i) / (1 + len(tried)))
            rest = deadline.seconds_left
            limit = default_limit if rest is None else rest / (len(tried) - i)
            if limit <= 0:
                break
            try:
                trials.append(_trial(task, solution, own_error, effect, changed, seconds, limit))
            except Exception as error:  # an effect may be a user's own
                failed.append(FailedTrial(effect, _sentence(error)))
    except KeyboardInterrupt:
        record_interrupt()
    untried = tried[len(trials) + len(failed) :]
    found = tuple(trials), untried, tuple(failed)
    return EffectStudy(task, solution, own_seconds, replan_seconds, *found)


def _sentence(error: Exception) -> str:
    """An error in words; with its kind if it is not one that hovi raises."""
    return str(error) if isinstance(error, HoviError) else f"{type(error).__name__}: {error}"


def _with_or_without(scene: Scene, effect: Effect) -> Scene:
    """The scene with the effect added, or removed if it has one of this kind."""
    without = scene.without(effect.key)
    if len(without.effects) < len(scene.effects):
        return without
    return dataclasses.replace(scene, effects=[*scene.effects, effect])


def _trial(
    task: Task,
    unchanged: Solution,
    own_error: float | None,
    effect: Effect,
    scene: Scene,
    seconds: float,
    limit: float,
) -> EffectTrial:
    """The trial of an effect; limit: of planning, in [s]. Raises KeyboardInterrupt.

    own_error: of the tip of the unchanged motion, in [m].
    """
    own = unchanged.trajectory
    named = {each.key: each for each in task.scene.effects}
    began = time.perf_counter()
    found = _plan(task, scene, own, 1, limit)
    took = time.perf_counter() - began
    moves = set(effect.touches) != {Touch.COST}
    tip = _tip_distance(own, found.trajectory) if found.success else None
    error = None if tip is None or own_error is None else _tip_error(found, limit)
    noise = None if error is None or own_error is None else own_error + error
    return EffectTrial(
        named.get(effect.key, effect),
        effect.key not in named,
        _torque_change(scene, own),
        found.cost,
        found.success,
        found.nit,
        took,
        tip,
        noise,
        _tip_deviation(scene, own, "none") if moves else 0.0,
        _tip_deviation(scene, own, "pd") if moves else 0.0,
        scene.graph().n_instructions() - task.scene.graph().n_instructions(),
        seconds,
    )


def _plan(
    task: Task, scene: Scene, guess: str | Trajectory, starts: int, limit: float | None = None
) -> Solution:
    changed = dataclasses.replace(task, scene=scene)
    solution = plan_task(changed, starts=starts, guess=guess, time_limit=limit)
    raise_if_interrupted()  # unless this plan was interrupted
    return solution


def _torque_change(scene: Scene, own: Trajectory) -> float:
    N = own.grid.intervals
    k, s = np.repeat(np.arange(N), _SAMPLES), np.tile(np.linspace(0, 1, _SAMPLES), N)
    motion = own.sample_intervals(k, s)
    t = own.t[k] + s * own.grid.steps[k]
    tau = scene.inverse_dynamics(motion.q, motion.v, motion.a, t)
    return float(np.abs(tau - motion.tau).max())


def _tip_distance(own: Trajectory, other: Trajectory) -> float | None:
    robot = own.robot
    if robot is None or abs(own.duration - other.duration) > 1e-9 * own.duration:
        return None
    t = np.linspace(0.0, own.duration, 1 + _SAMPLES * own.grid.intervals)
    t = np.minimum(t, other.duration)
    distance = FrameDistance.between(robot, own.configurations(t), other.configurations(t))
    return float(distance.largest.max())


def _tip_error(solution: Solution, limit: float) -> float | None:
    """The estimated error of a minimum at the tip_frames, in [m]; None if there is no estimate.

    limit: of a solve on a finer grid, if one is needed, in [s].
    """
    accuracy = solution.accuracy
    if accuracy is not None and accuracy.estimate is not None and accuracy.tolerance.frame is None:
        return accuracy.estimate.largest_tip
    try:
        with Deadline(limit).in_force():
            found = estimate_error(solution)
    except (HoviError, OutOfTimeError):
        return None
    return None if found is None else found.largest_tip


def _tip_deviation(scene: Scene, own: Trajectory, feedback: str) -> float | None:
    try:
        return float(play(scene, own, feedback, bandwidth=BANDWIDTH).tip_deviation[-1])
    except InputError:  # the simulation diverged and a step has no solution
        return None
