"""Which effect matters: each added alone to a scene, what it changes against what it costs."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hovi.accuracy.effect_study.candidates import effect_candidates
from hovi.discrete.trajectory import Trajectory
from hovi.effects import Effect, Touch
from hovi.errors import InputError, SceneError
from hovi.flows.tracking import play
from hovi.planning.solver.solver import Solution
from hovi.planning.task_file.task import Task
from hovi.planning.task_file.task_plan import plan_task
from hovi.scene.evaluation_cost import seconds_per_point
from hovi.scene.scene import Scene
from hovi.system.deadline import Deadline
from hovi.system.interruption import interruptible, raise_if_interrupted, record_interrupt

Array = npt.NDArray[np.float64]
Progress = Callable[[str, float], None]

BANDWIDTH = 10.0
"""Of the feedback that holds a motion to its plan, in [rad/s]."""
_SAMPLES = 20
_PATIENCE = 10.0
_LEAST_SECONDS = 10.0


@dataclass(frozen=True)
class EffectTrial:
    """A scene with one effect more or less, beside the scene itself.

    effect: which. added: whether it was added, or taken away since the scene names it.
    torque: largest change of a torque that the scene's own motion needs, in [N m].
    cost: of the motion planned with it, from the scene's own as the guess. success: whether that
        is a minimum; where it is not, the cost says nothing. nit, plan_seconds: what planning took.
    tip: largest distance of its tip from the scene's own motion, in [m]; None where the two do
        not last equally long, or no minimum was found.
    open_loop, held: how far the tip ends off when the scene's own torques are played with it,
        alone and held by a feedback of 10 rad/s, in [m]; None where the motion is lost.
    instructions: what it adds to the expression graph.
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
    open_loop: float | None
    held: float | None
    instructions: int
    seconds: float

    @property
    def name(self) -> str:
        """The effect's key with a sign."""
        return f"{'+' if self.added else '-'} {self.effect.key}"


@dataclass(frozen=True, eq=False)
class EffectStudy:
    """A scene's own motion and one trial for each candidate.

    task: what was planned. solution: its motion. seconds: of an evaluation, per point.
    plan_seconds: of planning it again from its own motion.
    untried: candidates that were not reached when time was up or a person ended the study.
    """

    task: Task
    solution: Solution
    seconds: float
    plan_seconds: float
    trials: tuple[EffectTrial, ...]
    untried: tuple[Effect, ...] = ()

    def change(self, trial: EffectTrial) -> float:
        """Relative change of the cost; NaN where no minimum was found with the effect."""
        if not trial.success:
            return np.nan
        return trial.cost / self.solution.cost - 1.0 if self.solution.cost else np.inf


@interruptible
def study_effects(
    task: Task,
    candidates: Iterable[Effect] | None = None,
    progress: Progress | None = None,
    time_limit: float | None = None,
) -> EffectStudy:
    """Plan a task, then each candidate effect alone.

    candidates: effects to add; one that the scene names is taken away instead. When not given,
        those of `effect_candidates`.
    time_limit: of everything, in [s], shared evenly by the candidates that are left: each is
        planned within its share, and none is begun when time is up. When not given, planning one
        takes at most ten times what the task took, or 10 s. A KeyboardInterrupt ends the study
        with the trials so far.
    Raises SceneError when the task itself has no motion to compare with.
    """
    tell = progress or (lambda text, share: None)
    deadline, began = Deadline(time_limit), time.perf_counter()
    tell("planning the scene as it is", 0.0)
    solution = _plan(task, task.scene, "cubic", task.options.starts, deadline.seconds_left)
    if not solution.success:
        raise SceneError(
            f"the effects of {task.name!r} cannot be compared, as no motion was found to compare "
            f"with: {solution.message}"
        )
    patience = max(_PATIENCE * (time.perf_counter() - began), _LEAST_SECONDS)
    began = time.perf_counter()
    _plan(task, task.scene, solution.trajectory, 1)
    again = time.perf_counter() - began
    scene = task.scene
    tried = tuple(
        effect_candidates(scene.robot, scene.passive) if candidates is None else candidates
    )
    scenes = [_changed(scene, effect) for effect in tried]
    own_seconds, *times = seconds_per_point([scene, *scenes])
    trials: list[EffectTrial] = []
    try:
        for i, (effect, changed, seconds) in enumerate(zip(tried, scenes, times, strict=True)):
            tell(f"trying {effect.key}", (1 + i) / (1 + len(tried)))
            rest = deadline.seconds_left
            limit = patience if rest is None else rest / (len(tried) - i)
            if limit <= 0:
                break
            trials.append(_trial(task, solution.trajectory, effect, changed, seconds, limit))
    except KeyboardInterrupt:
        record_interrupt()
    untried = tried[len(trials) :]
    return EffectStudy(task, solution, own_seconds, again, tuple(trials), untried)


def _changed(scene: Scene, effect: Effect) -> Scene:
    """The scene with the effect, or without it where it has one of its kind."""
    without = scene.without(effect.key)
    if len(without.effects) < len(scene.effects):
        return without
    return dataclasses.replace(scene, effects=[*scene.effects, effect])


def _trial(
    task: Task, own: Trajectory, effect: Effect, scene: Scene, seconds: float, limit: float
) -> EffectTrial:
    """The trial of an effect, planned in at most limit seconds. Raises KeyboardInterrupt."""
    named = {each.key: each for each in task.scene.effects}
    began = time.perf_counter()
    found = _plan(task, scene, own, 1, limit)
    took = time.perf_counter() - began
    moves = set(effect.touches) != {Touch.COST}
    return EffectTrial(
        named.get(effect.key, effect),
        effect.key not in named,
        _torque_change(scene, own),
        found.cost,
        found.success,
        found.nit,
        took,
        _tip_distance(own, found.trajectory) if found.success else None,
        _off(scene, own, "none") if moves else 0.0,
        _off(scene, own, "pd") if moves else 0.0,
        scene.graph().n_instructions() - task.scene.graph().n_instructions(),
        seconds,
    )


def _plan(
    task: Task, scene: Scene, guess: str | Trajectory, starts: int, limit: float | None = None
) -> Solution:
    changed = dataclasses.replace(task, scene=scene)
    solution = plan_task(changed, starts=starts, guess=guess, time_limit=limit)
    raise_if_interrupted()  # with the other plans, unless a person ended this one
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
    places = (robot.frame_position(robot.tip_frame, m.configurations(t)) for m in (own, other))
    return float(np.linalg.norm(np.subtract(*places), axis=1).max())


def _off(scene: Scene, own: Trajectory, feedback: str) -> float | None:
    try:
        return float(play(scene, own, feedback, bandwidth=BANDWIDTH).tip_deviation[-1])
    except InputError:  # a motion that runs away leaves no step that could be solved
        return None
