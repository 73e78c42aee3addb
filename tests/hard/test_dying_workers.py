"""Processes of a plan that die: workers are replaced or missed, and none outlives the command."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys

import pytest

from oracles.processes import children, is_running, processor_seconds, wait_until

needs_workers = pytest.mark.skipif(
    len(os.sched_getaffinity(0)) < 2, reason="one processor, no workers"
)
STARTUP_SECONDS = 2.5
"""Processor time after which a worker has imported what it needs."""


def start(starts: int, *options: str) -> subprocess.Popen[str]:
    """A plan with many starts, on a grid that is solved in some hundredths of a second."""
    command = ["plan", "two_link_swing_up", "--scheme", "galerkin-2", "--intervals", "100"]
    return subprocess.Popen(
        [sys.executable, "-m", "hovi", *command, "--starts", str(starts), *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_DFL),  # nohup ignores it
    )


def workers(parent: subprocess.Popen[str]) -> list[int]:
    """The worker processes of a command that are past their imports."""
    assert parent.poll() is None, parent.communicate()
    found = children(parent.pid)
    return [pid for pid in found if processor_seconds(pid) > STARTUP_SECONDS]


@needs_workers
def test_a_plan_whose_workers_are_killed_ends_with_the_best_of_the_others() -> None:
    process = start(1000, "--json", "--no-certificate")
    killed: list[int] = []
    while len(killed) < 2 and process.poll() is None:
        for pid in [each for each in workers(process) if each not in killed][:1]:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
                killed.append(pid)
    assert len(killed) == 2
    out, err = process.communicate(timeout=300)
    assert "Traceback" not in err
    assert process.returncode == 0
    result = json.loads(out)
    assert result["status"] == "minimum"
    assert len(result["minima"]) > 1
    assert " of 1000 starts: a worker process was ended by SIGKILL, as " in result["message"]
    assert "Lost 1 of" in result["message"] or "Lost 2 of" in result["message"]


@needs_workers
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGKILL])
def test_workers_end_with_a_killed_command_and_let_its_output_go(number: signal.Signals) -> None:
    process = start(100_000)
    wait_until(lambda: bool(workers(process)))
    pids = children(process.pid)
    assert len(pids) >= 2
    process.send_signal(number)
    process.communicate(timeout=30)  # ends only where nobody holds the streams open
    assert process.returncode == -number
    wait_until(lambda: not any(map(is_running, pids)))


@needs_workers
def test_ctrl_c_during_a_round_keeps_what_its_workers_found() -> None:
    process = start(100_000, "--no-certificate")
    wait_until(lambda: bool(workers(process)))
    pids = children(process.pid)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does
    out, err = process.communicate(timeout=60)
    assert "Traceback" not in err
    assert out.startswith(("status   minimum\n", "status   interrupted\n"))
    assert " of 100000 starts" in out
    wait_until(lambda: not any(map(is_running, pids)))


FEW_DESCRIPTORS = """
import resource, sys
from hovi.cli.application import main
resource.setrlimit(resource.RLIMIT_NOFILE, (8, 8))  # two pipes need more while they are made
sys.exit(main(sys.argv[1:]))
"""


def test_a_plan_needs_no_workers_where_none_can_be_started() -> None:
    command = ("plan", "two_link_reach", "--scheme", "galerkin-2", "--intervals", "16", "--json")
    plans = [
        subprocess.run(
            [sys.executable, *program, *command, "--starts", "8"],
            capture_output=True,
            text=True,
            timeout=300,
        )
        for program in (("-c", FEW_DESCRIPTORS), ("-m", "hovi"))
    ]
    assert [plan.stderr for plan in plans] == ["", ""]
    few, usual = (json.loads(plan.stdout) for plan in plans)
    assert few["status"] == "minimum"
    assert few["minima"] == usual["minima"]
    assert few["message"] == usual["message"]
