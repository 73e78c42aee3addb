"""Readers of programs for arms, from the manuals alone: they know no writer and no robot."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

NUMBER = r"-?\d+(?:\.\d+)?"
LIST = rf"\[({NUMBER}(?:, {NUMBER}){{5}})\]"
HEAD = re.compile(r"def ([a-z][A-Za-z0-9_]*)\(\):")
COMMENT = re.compile(r" +#[ -~]*")
MOVEJ = re.compile(rf" +movej\({LIST}, a=({NUMBER}), v=({NUMBER})\)")
SERVOJ = re.compile(
    rf" +servoj\({LIST}, t=({NUMBER}), lookahead_time=({NUMBER}), gain=({NUMBER})\)"
)
STOPJ = re.compile(rf" +stopj\(({NUMBER})\)")
CONTROLLER_FRAME = 0.002
"""The controller acts every 2 ms, in [s]."""


@dataclass(frozen=True)
class Program:
    """What an arm does: it goes to `start` (6,), then has `targets` (M, 6), in [rad], at `times`.

    times: when each target is to be reached after the move to the start, (M,), in [s].
    comments: lines after "#" before the first command. marks: those between targets, each with the
    number of targets before it.
    """

    name: str
    start: Array
    times: Array
    targets: Array
    comments: list[str]
    tuning: set[tuple[float, float]]
    marks: list[tuple[int, str]]


def read_urscript(data: bytes) -> Program:
    """A program of the form: def, comments, movej, servoj and comments, stopj, end.

    Raises AssertionError for any other line, and for arguments outside the manual's ranges.
    """
    text = data.decode("ascii")
    assert text.endswith("\n")
    lines = text.splitlines()
    assert len(lines) == text.count("\n")
    head = HEAD.fullmatch(lines[0])
    assert head, lines[0]
    assert lines[-1] == "end"
    body = lines[1:-1]
    first = next(k for k, line in enumerate(body) if not COMMENT.fullmatch(line))
    comments, commands = [_said(line) for line in body[:first]], body[first:]
    move, stop = MOVEJ.fullmatch(commands[0]), STOPJ.fullmatch(commands[-1])
    assert move, commands[0]
    assert stop, commands[-1]
    assert min(float(move[2]), float(move[3]), float(stop[1])) > 0
    targets, steps, marks, tuning = [], [], [], set()
    for line in commands[1:-1]:
        if COMMENT.fullmatch(line):
            marks.append((len(targets), _said(line)))
            continue
        found = SERVOJ.fullmatch(line)
        assert found, line
        targets.append(_numbers(found[1]))
        steps.append(float(found[2]))
        tuning.add((float(found[3]), float(found[4])))
    assert all(0.03 <= lookahead <= 0.2 and 100 <= gain <= 2000 for lookahead, gain in tuning)
    frames = np.array(steps) / CONTROLLER_FRAME
    assert (frames > 0.5).all()
    np.testing.assert_allclose(frames, np.round(frames), atol=1e-9)
    times = np.cumsum(steps)
    return Program(head[1], _numbers(move[1]), times, np.array(targets), comments, tuning, marks)


def read_franka(data: bytes) -> Array:
    """The samples (M, 7), in [rad], as `stream >> number >> character` reads them seven at a time.

    Both skip white space; a number ends where none can go on. Reading ends with the row in which
    the stream ends; a row of which no number was read is one that was never written.
    """
    text, at, rows = data.decode("ascii"), 0, []
    ended = False
    while not ended:
        row = []
        for _ in range(7):
            found = re.compile(r"\s*([-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?)").match(text, at)
            assert found, f"no number in row {len(rows)}"
            row.append(float(found[1]))
            delimiter = re.compile(r"\s*(\S)").match(text, found.end())
            ended = delimiter is None
            at = found.end() if delimiter is None else delimiter.end()
        rows.append(row)
    return np.array(rows)


def _said(comment: str) -> str:
    return comment.strip()[1:].strip()


def _numbers(text: str) -> Array:
    return np.array([float(each) for each in text.split(",")])
