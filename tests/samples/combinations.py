"""Cases of every combination, carried out by the public functions.

What comes back satisfies what it claims, by the judge, or it is a HoviError of one sentence, or a
status with a sentence.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import hovi
from hovi.accuracy.effect_study.study import study_effects
from samples.asked_motions import ROLLING, Asked, planned, reversed_view
from samples.motion_judge import SAME, judged
from samples.pairwise import Case


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
    floats = asked.case["robot"] == "free-flyer"  # on no base
    candidates = [
        hovi.effects.ViscousFriction(0.05),
        hovi.effects.Armature(0.01) if floats else ROLLING,
    ]
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
    at = reversed_view(k), reversed_view(s)
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
