"""What notebooks show: short texts, tables, figures, and a page that plays after conversion."""

from __future__ import annotations

import base64
import gzip
import html
import importlib.util
import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import hovi
from hovi.errors import DisplayError, InputError
from oracles.headless_browser import CHROMIUM, headless_browser

TUTORIAL = Path(__file__).resolve().parents[2] / "docs" / "tutorial.ipynb"
needs_jupyter = pytest.mark.skipif(
    not all(map(importlib.util.find_spec, ("nbconvert", "ipykernel"))), reason="no Jupyter"
)


@pytest.fixture(scope="module")
def solution() -> hovi.Solution:
    scene = hovi.Scene(hovi.load_robot("ur5"), [hovi.effects.Gravity()])
    return hovi.plan(
        scene,
        [0, -1.2, 1.2, -1.5, -1.5, 0],
        [1, -1, 1.4, -1.2, -1.5, 0.5],
        1.0,
        self_collision=False,
    )


@pytest.fixture(scope="module")
def reach() -> hovi.Solution:
    return hovi.plan_task(hovi.load_task(hovi.example("two_link_reach")))


def test_public_objects_are_shown_in_fewer_than_ten_lines(solution: hovi.Solution) -> None:
    motion, problem = solution.trajectory, solution.problem
    assert problem is not None
    shown = [solution, motion, problem, problem.limits, problem.start, problem.ld]
    shown += [motion.grid, motion.path, motion.grid.schemes[0], motion.robot, motion.scene]
    shown += [hovi.certify(solution, time_limit=1.0), hovi.extremes(motion), solution.margins()]
    shown += [hovi.load_task(hovi.example("two_link_pick"))]
    for each in shown:
        assert repr(each).count("\n") < 9, type(each)
        assert len(repr(each)) < 2000, type(each)


def test_the_tables_of_a_plan_state_its_numbers(solution: hovi.Solution) -> None:
    for text in (repr(solution), solution._repr_html_()):
        assert f"{solution.cost:.8g}" in text
        assert solution.status in text
        assert f"{solution.trajectory.grid.intervals} intervals" in text
        assert f"{solution.nit} steps" in text
    assert solution.problem is not None
    limits = solution.problem.limits
    assert f"±{limits.upper[3, 0]:.4g}" in repr(limits)
    assert repr(limits).count("±") == np.isfinite(limits.upper).sum()


def test_names_from_files_are_escaped_in_tables(reach: hovi.Solution) -> None:
    name = "<script>alert(1)</script>"
    robot = reach.trajectory.robot
    assert robot is not None
    before = robot.name
    object.__setattr__(robot, "name", name)
    try:
        shown = reach._repr_html_() + reach.trajectory._repr_html_()
    finally:
        object.__setattr__(robot, "name", before)
    assert name not in shown
    assert html.escape(name) in shown


def test_a_plot_is_a_figure_that_notebooks_show(solution: hovi.Solution) -> None:
    figure = hovi.plot(solution)
    assert isinstance(figure, Figure)
    assert figure._repr_png_().startswith(b"\x89PNG")


def test_compared_motions_have_panels_by_joint_with_dashed_limits(solution: hovi.Solution) -> None:
    figure = hovi.plot(solution, compare=[solution.trajectory])
    names = solution.trajectory.coordinate_names
    assert [ax.get_title(loc="left") for ax in figure.axes[::3]] == list(names)
    labels = [ax.get_ylabel() for ax in figure.axes[:3]]
    assert labels == ["angle [rad]", "velocity [rad/s]", "torque [N m]"]
    assert solution.problem is not None
    limit, speed = solution.problem.limits, figure.axes[1]
    at = {line.get_ydata()[0] for line in speed.lines if line.get_gid() == "limit"}
    assert at == {limit.lower[1, 0], limit.upper[1, 0]}
    sampled = solution.trajectory.sample(np.linspace(0.0, 1.0, 600)).v[:, 0]
    np.testing.assert_array_equal(speed.lines[0].get_ydata(), sampled)


def test_motions_of_other_joints_are_not_compared(
    solution: hovi.Solution, reach: hovi.Solution
) -> None:
    with pytest.raises(DisplayError, match="same robot"):
        hovi.plot(solution, compare=[reach])
    for wrong in (5, ["motion.npz"]):
        with pytest.raises(InputError):
            hovi.plot(solution, compare=wrong)  # type: ignore[arg-type]


def test_an_embedded_page_is_the_offline_page(reach: hovi.Solution, tmp_path: Path) -> None:
    written = hovi.replay(reach.trajectory, html=tmp_path / "motion.html")
    found = re.search(r'atob\("([^"]+)"\)', html.unescape(written._repr_html_()))
    assert found is not None
    page = gzip.decompress(base64.b64decode(found[1])).decode()
    assert page == (tmp_path / "motion.html").read_text()


def test_the_tutorial_is_stored_without_outputs() -> None:
    cells = json.loads(TUTORIAL.read_text())["cells"]
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    assert len(code) > 5
    assert all(not cell["outputs"] and cell["execution_count"] is None for cell in code)


@pytest.fixture(scope="module")
def converted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("tutorial")
    convert = ["-m", "nbconvert", "--execute", "--to", "html", str(TUTORIAL)]
    done = subprocess.run(
        [sys.executable, *convert, f"--output-dir={folder}"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return folder / "tutorial.html"


@needs_jupyter
def test_the_tutorial_runs_and_shows_tables_and_figures(converted: Path) -> None:
    text = converted.read_text()
    assert text.count('src="data:image/png;base64,') == 2
    assert text.count("Solution: minimum") == 2
    assert text.count("<iframe srcdoc") == 1


@needs_jupyter
@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")
def test_the_replay_plays_in_the_converted_tutorial(converted: Path, tmp_path: Path) -> None:
    with headless_browser((1000, 1200)) as tab:
        tab.call("Page.navigate", url=converted.as_uri())
        frame = "document.querySelector('iframe[srcdoc]')"
        tab.until(f"{frame} !== null")
        tab.value(f"{frame}.scrollIntoView({{block: 'center'}})")
        inside = f"{frame}.contentWindow.eval"
        tab.until(f"{inside}('typeof controls') == 'object'")
        pictures = []
        for number, t in enumerate((0.0, 0.7)):
            tab.value(f"{inside}('controls.seek({t}); viewer.render(); 1')")
            pictures.append(tab.screenshot(tmp_path / f"{number}.png"))
        assert (np.abs(pictures[1] - pictures[0]) > 30).sum() > 500
        assert not [url for url in tab.requests if "127.0.0.1" in url]
