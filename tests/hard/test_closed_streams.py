"""Standard streams that are closed, full or without a reader: nothing computed is lost.

Real processes, which end with an exit code, at most one sentence, and the file that was asked for.
"""

from __future__ import annotations

import fcntl
import os
import re
import resource
import subprocess
import sys
import termios
import time
from collections.abc import Sequence
from pathlib import Path

import pytest

from hovi.discrete.trajectory import Trajectory
from hovi.system import progress as reports

CLOSED = "error: cannot write the output: stdout is closed.\n"
COMMAND = """
import os, sys, types
import hovi.cli.application as application
def {name}():
    {body}
module = types.ModuleType("hovi.cli.commands.{name}")
module.{name} = {name}
sys.modules[module.__name__] = module
application.COMMANDS += ("{name}",)
from hovi.__main__ import run
run()
"""
"""Runs hovi with one command more."""
_PROGRESS = re.compile(r"^ *\d+ % .* \(\d+ s\)\n", re.MULTILINE)


def without_progress(told: str) -> str:
    """What a command wrote to stderr but for the lines that come every few seconds."""
    return _PROGRESS.sub("", told)


def run(
    arguments: Sequence[str | Path], closed: Sequence[int], program: Sequence[str] = ("-m", "hovi")
) -> subprocess.CompletedProcess[str]:
    """A command whose standard streams with these numbers are closed when it begins."""

    def close() -> None:
        for number in closed:
            os.close(number)

    return subprocess.run(
        [sys.executable, *program, *map(str, arguments)],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
        preexec_fn=close,
    )


@pytest.mark.parametrize("starts", ["1", "3"])  # with worker processes, too
@pytest.mark.parametrize("closed", [(0,), (1,), (2,), (1, 2), (0, 1, 2)], ids=str)
def test_a_plan_is_kept_whichever_stream_is_closed(
    closed: tuple[int, ...], starts: str, tmp_path: Path
) -> None:
    out = tmp_path / "motion.npz"
    options = ("--starts", starts, "--out", out)
    done = run(("plan", "two_link_reach", *options), closed)
    lost = 1 in closed
    assert done.returncode == (1 if lost else 0)
    assert without_progress(done.stderr) == (CLOSED if lost and 2 not in closed else "")
    assert (f"wrote {out}" in done.stdout) != lost
    assert Trajectory.load(out).duration == 1.0


@pytest.mark.parametrize(
    "words", [("--version",), ("info", "two_link_reach"), ("schema",), ("info", "panda")]
)
def test_output_that_nobody_can_read_is_an_error(words: Sequence[str]) -> None:
    done = run(words, (1,))
    assert (done.returncode, done.stderr) == (1, CLOSED)


def test_a_command_without_output_succeeds_with_closed_streams() -> None:
    program = COMMAND.format(name="quiet", body="pass")
    done = run(("quiet",), (1, 2), ("-c", program))
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_a_refusal_does_not_go_to_stdout() -> None:
    done = run(("plan", "nowhere"), (2,))
    assert (done.returncode, done.stdout) == (2, "")


@pytest.mark.parametrize("words", [("plan", "two_link_reach"), ("plan", "nowhere")])
def test_a_full_or_broken_stderr_changes_no_exit_code(words: Sequence[str]) -> None:
    expected = 2 if "nowhere" in words else 0
    reader, writer = os.pipe()
    os.close(reader)
    with Path("/dev/full").open("w") as full, os.fdopen(writer, "w") as broken:
        for stderr in (full, broken):
            command = [sys.executable, "-m", "hovi", *words]
            done = subprocess.run(
                command, stdout=subprocess.PIPE, stderr=stderr, timeout=120, check=False
            )
            assert done.returncode == expected


BROKEN = """reader, writer = os.pipe()
    os.close(reader)
    os.write(writer, b"to a process that has ended")"""


def test_a_pipe_that_breaks_elsewhere_is_reported() -> None:
    """A worker that ends while it is started, for instance; only stdout's reader may be silent."""
    done = run(("broken",), (), ("-c", COMMAND.format(name="broken", body=BROKEN)))
    assert done.returncode == 2
    assert done.stderr.startswith("error: the connection to another process broke; ")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("terminal", [False, True])
def test_progress_raises_nothing_when_its_reader_has_gone(
    terminal: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    reader, writer = os.openpty() if terminal else os.pipe()
    monkeypatch.setattr(reports, "LINE_PERIOD", 0.0)
    monkeypatch.setattr(reports, "BAR_DELAY", 0.0)
    with os.fdopen(writer, "w") as stream:
        monkeypatch.setattr(sys, "stderr", stream)
        with reports.progress(quiet=False) as report:
            assert report is not None
            report("first", 0.1)
            os.close(reader)
            for share in (0.2, 0.3, 0.9):
                report("later", share)
        monkeypatch.undo()
        os.dup2(os.open(os.devnull, os.O_WRONLY), writer)  # for the buffer that is left


PAGE = 4096
"""Size of the smallest pipe, in bytes."""


def left_by_its_reader(
    words: Sequence[str | Path], room: int, taken: int, largest_file: int | None = None
) -> tuple[int, str]:
    """Exit code and stderr of a command whose reader leaves in the middle, as `head` does.

    room: bytes of output that the pipe takes before a write waits. taken: bytes that the command
    has written when the reader leaves.
    """

    def limit() -> None:
        if largest_file is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (largest_file, largest_file))

    reader, writer = os.pipe()
    assert fcntl.fcntl(writer, fcntl.F_SETPIPE_SZ, PAGE) == PAGE
    os.write(writer, bytes(PAGE - room))
    command = [sys.executable, "-u", "-m", "hovi", *map(str, words)]
    process = subprocess.Popen(
        command, stdout=writer, stderr=subprocess.PIPE, text=True, preexec_fn=limit
    )
    os.close(writer)
    waiting = bytearray(4)
    end = time.monotonic() + 60
    while int.from_bytes(waiting, sys.byteorder) < PAGE - room + taken and process.poll() is None:
        if time.monotonic() > end:
            raise TimeoutError("the command writes less than expected")
        fcntl.ioctl(reader, termios.FIONREAD, waiting)
        time.sleep(0.01)
    os.close(reader)
    _, told = process.communicate(timeout=120)
    return process.returncode, without_progress(told)


@pytest.mark.parametrize("starts", ["1", "3"])  # with worker processes, too
@pytest.mark.parametrize("within", ["first line", "table"])
def test_a_reader_that_leaves_ends_a_plan_quietly_and_loses_nothing(
    within: str, starts: str, tmp_path: Path
) -> None:
    """As `hovi plan ... | head -1`. In a table rich ends the process, after replacing stdout."""
    out = tmp_path / "motion.npz"
    words = ("plan", "two_link_reach", "--starts", starts, "--out", out)
    before = len(run(words, ()).stdout.partition("solving")[0]) if within == "table" else 0
    out.unlink(missing_ok=True)
    room = before + 100 if before else 5
    assert left_by_its_reader(words, room, max(before - 40, 0)) == (1, "")
    assert Trajectory.load(out).duration == 1.0


@pytest.mark.parametrize("words", [("--help",), ("info", "panda"), ("simulate", "--help")])
def test_a_reader_that_leaves_ends_other_commands_quietly(words: Sequence[str]) -> None:
    assert left_by_its_reader(words, 5, 0) == (1, "")


def test_a_plan_that_cannot_be_written_is_reported_though_nobody_reads_it(tmp_path: Path) -> None:
    out = tmp_path / "motion.npz"
    code, told = left_by_its_reader(("plan", "two_link_reach", "--out", out), 5, 0, 1000)
    assert (code, told.count("\n")) == (2, 1)
    assert str(out) in told
    assert not out.exists()
