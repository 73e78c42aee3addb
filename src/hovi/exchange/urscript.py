"""A motion as a URScript program for an arm of Universal Robots.

The program moves to the start by `movej`, follows the samples by `servoj`, one for each step of the
controller, holds the end, and stops. As the manual asks [URScript]: "def" and "end" begin in the
first column and all other lines are indented, text is ASCII, angles are in [rad] in the order base,
shoulder, elbow, wrist 1 to 3, the lookahead time is 0.03 to 0.2 s and the gain 100 to 2000.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator
from pathlib import Path

from hovi.discrete.joined_motion import AnyMotion, JoinedMotion
from hovi.discrete.measures.motion_segments import motion_segments
from hovi.discrete.output.caution import caution_lines
from hovi.errors import InputError, warn
from hovi.exchange.arm_samples import UNIVERSAL_ROBOTS, arm_samples
from hovi.exchange.whole_export import whole_export
from hovi.version import __version__

LOOKAHEAD_TIMES = 0.03, 0.2
"""Least and largest lookahead time that servoj takes, in [s]."""
GAINS = 100.0, 2000.0
"""Least and largest gain that servoj takes."""
FRAME = 0.002
"""Time of a step of the controller, in [s]; controllers before the e-Series have 0.008."""
LEAST_RATE = 10.0
"""Least number of targets per second: the arm goes from one to the next as fast as it can."""
APPROACH_SPEED, APPROACH_ACCELERATION = 0.25, 0.5
"""Joint speed of the move to the start, in [rad/s], and its acceleration, in [rad/s^2]."""
STOP = 2.0
"""Deceleration of the stop after the end, in [rad/s^2]."""
DIGITS = 9
"""Decimals of an angle; no exponents, of which the manual says nothing."""
MANY = 2_500
"""Targets above which users report programs that an arm did not start."""


def write_urscript(
    motion: AnyMotion,
    path: str | os.PathLike[str],
    rate: float = 125.0,
    *,
    lookahead_time: float = 0.1,
    gain: float = 300.0,
) -> None:
    """Write the program, completely or not at all.

    rate: targets per second; 1/rate must be a multiple of 2 ms.
    lookahead_time: of servoj, 0.03 to 0.2, in [s]. gain: of servoj, 100 to 2000.
    Raises InputError for other values, and for a motion that `arm_samples` refuses; DisplayError
    when the file cannot be written.
    """
    _require_range("lookahead_time", lookahead_time, LOOKAHEAD_TIMES, " s")
    _require_range("gain", gain, GAINS, "")
    samples = arm_samples(motion, rate, UNIVERSAL_ROBOTS)
    step = _step(rate)
    targets = [_angles(row) for row in samples.q.tolist()]
    if len(targets) > MANY:
        warn(
            f"this program has {len(targets):,} targets, and arms of some users started none of "
            f"more than {MANY:,}: try it with a lower rate, or with shorter motions."
        )
    held = step * math.ceil(round(lookahead_time / step, 6))
    tuned = f"lookahead_time={lookahead_time:g}, gain={gain:g}"
    approach = f"a={APPROACH_ACCELERATION:g}, v={APPROACH_SPEED:g}"
    lines = [
        *(_comment(each) for each in _head(motion, samples.names, len(targets), step)),
        f"movej({targets[0]}, {approach})",
        *_marked([f"servoj({each}, t={step:g}, {tuned})" for each in targets[1:]], motion, step),
        f"servoj({targets[-1]}, t={held:g}, {tuned})",
        f"stopj({STOP:g})",
    ]
    program = [f"def {_name(path)}():", *(f"  {each}" for each in lines), "end"]
    with whole_export(path, "program") as stream:
        stream.write("".join(f"{each}\n" for each in program).encode("ascii"))


def _step(rate: float) -> float:
    """The time between targets, in [s]. Raises InputError if it is no multiple of FRAME."""
    frames = 1.0 / (max(rate, LEAST_RATE) * FRAME)
    if rate < LEAST_RATE or frames < 0.5 or abs(frames - round(frames)) > 1e-9 * frames:
        raise InputError(
            f"a program needs {LEAST_RATE:g} targets per second or more, {1e3 * FRAME:g} ms apart "
            f"or a multiple of it, got a rate of {rate:g}: use 500, 250, 125 or 100."
        )
    return round(frames) * FRAME


def _require_range(name: str, value: float, bounds: tuple[float, float], unit: str) -> None:
    lower, upper = bounds
    if not lower <= value <= upper:
        raise InputError(f"`{name}` of servoj must be {lower:g} to {upper:g}{unit}, got {value}.")


def _marked(commands: list[str], motion: AnyMotion, step: float) -> Iterator[str]:
    """The commands, with a comment where a rest, a motion or a segment begins, as for a gripper."""
    marks = [(math.floor(round(t / step, 6)), t, text) for t, text in _marks(motion)]
    for k, command in enumerate(commands):
        yield from (_comment(f"{t:.6g} s: {text}") for at, t, text in marks if at == k)
        yield command


def _marks(motion: AnyMotion) -> Iterator[tuple[float, str]]:
    """When what begins, in [s]; nothing for one motion without segments."""
    if not isinstance(motion, JoinedMotion):
        yield from ((each.begin, each.name) for each in motion_segments(motion))
        return
    for k, (start, part) in enumerate(zip(motion.starts.tolist(), motion.motions, strict=True)):
        if k and motion.gap:
            yield start - motion.gap, "rest"
        yield start, f"motion {k + 1}"
        yield from ((start + t, text) for t, text in _marks(part))


def _head(motion: AnyMotion, names: tuple[str, ...], targets: int, step: float) -> list[str]:
    """The robot, the duration, the joints and the cautions."""
    robot = "a robot" if motion.robot is None else motion.robot.name
    parts = len(motion.motions) if isinstance(motion, JoinedMotion) else 1
    gaps = (
        f", {parts} motions, {motion.gap:g} s between" if isinstance(motion, JoinedMotion) else ""
    )
    return [
        f"{robot}: {motion.duration:.6g} s{gaps}, {targets - 1} steps of {step:g} s",
        f"joints: {', '.join(names)}",
        f"written by hovi {__version__}; the move to the start looks at no obstacles",
        *caution_lines([motion.metadata]),
    ]


def _name(path: str | os.PathLike[str]) -> str:
    """A name for the program: that of the file, behind a word that no other name begins with."""
    return "hovi_" + re.sub(r"[^A-Za-z0-9]+", "_", Path(path).stem)[:40].strip("_")


def _comment(text: str) -> str:
    """A comment of one line of ASCII."""
    return "# " + "".join(each if " " <= each <= "~" else "?" for each in text)


def _angles(row: list[float]) -> str:
    """A list of angles; zero has no sign."""
    return f"[{', '.join(f'{round(x, DIGITS) + 0.0:.{DIGITS}f}' for x in row)}]"
