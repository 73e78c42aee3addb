"""The commands that show motions: a report, a comparison, and the menu of demonstrations."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path

import pytest

from hovi.cli.application import main
from hovi.effects import Gravity
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from samples.cubic_motion import cubic_motion


@pytest.fixture(scope="module")
def motions(two_link: Robot, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("motions")
    for seed in (1, 2):
        motion, _ = cubic_motion(Scene(two_link, [Gravity(9.8)]), seed=seed)
        motion.save(folder / f"{seed}.npz")
    return folder / "1.npz", folder / "2.npz"


def test_a_report_is_written_beside_the_motion(
    motions: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["report", str(motions[0])]) == 0
    page = motions[0].with_suffix(".html")
    assert capsys.readouterr().out == f"wrote {page}\n"
    assert "<h2>Certificate</h2>" in page.read_text()


def test_a_report_needs_the_suffix_of_a_page(
    motions: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["report", str(motions[0]), "--html", "report.pdf"]) == 2
    assert ".html" in capsys.readouterr().err


def test_a_replay_shows_other_motions_as_ghosts(motions: tuple[Path, Path], tmp_path: Path) -> None:
    page, one, other = tmp_path / "both.html", *map(str, motions)
    assert main(["replay", one, "--compare", other, "--html", str(page)]) == 0
    assert '"motions":[{"label":"1: ' in page.read_text()


def test_the_demo_is_served_until_ctrl_c() -> None:
    command = [sys.executable, "-m", "hovi", "demo", "--no-browser"]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    try:
        assert process.stdout is not None
        address = re.search(r"http://\S+?(?=;)", process.stdout.readline())
        assert address is not None
        with urllib.request.urlopen(address[0], timeout=30) as menu:
            assert menu.read().decode().count('class="card"') == 8
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=30)
    finally:
        process.kill()
    assert (process.returncode, err) == (0, "")
