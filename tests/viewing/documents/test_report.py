"""The report of a motion, as somebody without hovi gets it."""

from __future__ import annotations

import base64
import dataclasses
import html
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.effects import Gravity, ViscousFriction
from hovi.errors import DisplayError, InputError
from hovi.planning.problem.limits import as_limits
from hovi.planning.task_file.reading import load_task
from hovi.robot.bundled_models import example
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.version import __version__
from hovi.viewing.documents.report import write_report
from oracles.headless_browser import CHROMIUM, Tab, headless_browser
from samples.cubic_motion import cubic_motion

needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")


@pytest.fixture(scope="module")
def motion(two_link: Robot) -> Trajectory:
    return cubic_motion(Scene(two_link, [Gravity(9.8), ViscousFriction(0.3)]), seed=4)[0]


@pytest.fixture(scope="module")
def report(motion: Trajectory, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("report") / "report.html"
    write_report(motion, path)
    return path


@pytest.fixture(scope="module")
def tab() -> Iterator[Tab]:
    with headless_browser() as opened:
        yield opened


def test_a_report_has_all_of_its_parts(motion: Trajectory, report: Path) -> None:
    text = report.read_text()
    headings = ("Replay", "Curves", "Peaks", "Certificate", "Account of effects", "Scene")
    for heading in headings:
        assert f"<h2>{heading}</h2>" in text
    assert f"hovi {__version__}" in text
    assert "torques simulated again" in text
    assert "[effects.gravity]" in text
    (picture,) = re.findall(r"data:image/svg\+xml;base64,([\w+/=]+)", text)
    assert b"<svg" in base64.b64decode(picture)


def test_the_same_motion_gives_the_same_report(
    motion: Trajectory, report: Path, tmp_path: Path
) -> None:
    write_report(motion, tmp_path / "again.html")
    assert (tmp_path / "again.html").read_bytes() == report.read_bytes()


def test_the_torques_of_an_effect_are_those_that_it_adds(motion: Trajectory, report: Path) -> None:
    t = np.linspace(0.0, motion.duration, 401)
    friction = 0.3 * motion.sample(t).v
    rows = re.findall(
        r"<tr><td>viscous_friction</td><td>([^<]+)</td><td>([^ <]+)", report.read_text()
    )
    assert len(rows) == 1
    assert float(rows[0][0]) == pytest.approx(np.sqrt(np.mean(friction**2)), rel=1e-3)
    assert float(rows[0][1]) == pytest.approx(np.abs(friction).max(), rel=1e-3)


def test_its_scene_is_a_scene_file(motion: Trajectory, report: Path, tmp_path: Path) -> None:
    (text,) = re.findall(r"<h2>Scene</h2>\n<pre>(.*?)</pre>", report.read_text(), re.DOTALL)
    (tmp_path / "scene.toml").write_text(html.unescape(text))
    (tmp_path / "two_link.urdf").write_bytes(example("two_link.urdf").read_bytes())
    task = load_task(tmp_path / "scene.toml")
    assert task.scene.effects == motion.scenes[0].effects
    for end, node in ((task.start, 0), (task.goal, -1)):
        assert isinstance(end, State)
        np.testing.assert_allclose(end.q, motion.q[node], atol=1e-9)
        np.testing.assert_allclose(end.v, motion.v[node], atol=1e-9)


def test_peaks_name_each_joint_with_its_limit_and_mark_those_at_one(
    motion: Trajectory, tmp_path: Path
) -> None:
    fast = np.abs(motion.sample(np.linspace(0.0, 2.0, 20_001)).v).max(axis=0)
    bounds = [float(fast[0]), 2 * float(fast[1])]
    limits = as_limits(motion.robot, {"base": "none", "v": bounds}).to_dict()
    path = tmp_path / "limited.html"
    write_report(dataclasses.replace(motion, metadata={"limits": limits}), path)
    (table,) = re.findall(r"<caption>Speed \[rad/s\]</caption>(.*?)</table>", path.read_text())
    rows = re.findall(r"<tr( class='limit')?><td>(\w+)</td>(.*?)</tr>", table)
    assert [(mark != "", joint) for mark, joint, _ in rows] == [
        (True, "shoulder"),
        (False, "elbow"),
    ]
    for (_, _, cells), peak, bound in zip(rows, fast, bounds, strict=True):
        value, t, limit, margin = re.findall(r"<td[^>]*>([^<]*)</td>", cells)
        assert abs(float(value)) == pytest.approx(peak, rel=1e-3)
        assert 0.0 <= float(t) <= 2.0
        assert limit == f"±{bound:.4g}"
        assert margin == f"{50 * (1 - peak / bound):.1f} %"


def test_a_report_loads_no_external_resource(report: Path) -> None:
    text = html.unescape(report.read_text())
    assert not re.search(r"<(script|img|link|iframe)[^>]+(src|href)=\"(?!data:)", text)


@needs_chromium
def test_the_replay_in_a_report_plays_and_no_request_leaves(report: Path, tab: Tab) -> None:
    tab.call("Page.navigate", url=report.as_uri())
    inside = "document.querySelector('iframe')?.contentWindow"
    tab.until(f"{inside}?.viewer?.animator?.actions?.length > 0")
    assert all(url.startswith(("file:", "data:", "blob:", "about:")) for url in tab.requests)
    assert not tab.errors


def test_what_is_no_motion_is_refused(tmp_path: Path, motion: Trajectory) -> None:
    with pytest.raises(InputError, match="expected a motion"):
        write_report("motion.npz", tmp_path / "r.html")  # type: ignore[arg-type]
    with pytest.raises(DisplayError, match="No such file or directory"):
        write_report(motion, tmp_path / "no" / "r.html")
