"""Progress on stderr: what was reported last, also while nothing new is."""

from __future__ import annotations

import os
import select
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from hovi.cli.application import main
from hovi.system import progress as reports
from oracles.processes import wait_until


def test_the_last_line_is_repeated_while_work_is_silent(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(reports, "LINE_PERIOD", 0.05)
    shown = ""

    def shows(text: str, times: int) -> bool:
        nonlocal shown
        shown += capfd.readouterr().err
        return shown.count(text) >= times

    with reports.progress(quiet=False) as report:
        assert report is not None
        wait_until(lambda: shows("  0 % planning (0 s)\n", 1))
        report("refining 2 minima", 0.5)
        wait_until(lambda: shows(" 50 % refining 2 minima (", 3))
    capfd.readouterr()
    assert capfd.readouterr().err == ""


def test_quiet_progress_is_none(capfd: pytest.CaptureFixture[str]) -> None:
    with reports.progress(quiet=True) as report:
        assert report is None
    assert capfd.readouterr().err == ""


def test_a_line_comes_every_five_seconds() -> None:
    assert reports.LINE_PERIOD == 5.0


def test_a_simulation_shows_that_it_runs(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(reports, "LINE_PERIOD", 0.01)
    assert main(["simulate", "two_link_reach", "--duration", "20", "--intervals", "2000"]) == 0
    assert "  0 % simulating (" in capfd.readouterr().err


@pytest.fixture
def reported(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """All that is reported, whatever lines there is time for."""
    texts: list[str] = []

    @contextmanager
    def recorded(doing: str) -> Iterator[reports.Progress]:
        texts.append(doing)
        yield lambda text, fraction: texts.append(text)

    monkeypatch.setattr(reports, "_plain_lines", recorded)
    return texts


@pytest.mark.parametrize("scene", ["two_link_pick", "ur5_reach_limited"])
def test_every_part_of_a_plan_is_reported(scene: str, reported: list[str]) -> None:
    assert main(["plan", scene]) == 0
    assert reported[0] == "reading the scene"
    assert "planning" in reported
    assert any(text.startswith("certificate: ") for text in reported)


def test_a_study_of_effects_reports_each_of_them(reported: list[str]) -> None:
    assert main(["effects", "ur5_reach", "--time-limit", "3 s"]) in (0, 1)
    assert reported[0] == "reading the scene"
    assert "trying gravity" in reported


def test_a_bar_on_a_terminal_shows_the_last_report_and_goes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It comes after a delay; brackets in its text are no markup."""
    ours, theirs = os.openpty()
    monkeypatch.setattr(reports, "BAR_DELAY", 0.05)
    for name, value in {"TERM": "xterm", "COLUMNS": "80", "LINES": "24"}.items():
        monkeypatch.setenv(name, value)

    def await_text(text: bytes) -> None:
        shown = b""
        while text not in shown:
            assert select.select([ours], [], [], 20.0)[0], shown
            shown += os.read(ours, 4096)

    with os.fdopen(theirs, "w") as terminal:
        monkeypatch.setattr(sys, "stderr", terminal)
        with reports.progress(quiet=False, doing="starting [red]") as report:
            assert report is not None
            await_text(b"starting [red]")
            report("half", 0.5)
            await_text(b"half")
        await_text(b"\x1b[2K")  # the line is erased
    os.close(ours)
