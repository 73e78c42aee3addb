"""What a plan says of its motion beyond its numbers stays with the motion, wherever it goes."""

from __future__ import annotations

import json
import re
import warnings
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest
import yaml

import hovi
from hovi.cli.application import main
from hovi.errors import HoviWarning
from hovi.viewing.documents.report import write_report

SCENE = """robot = "ur5"
duration = 0.6
limits = "none"
self_collision = false
start.q = [0.0, -1.2, 1.2, -0.5, 0.3, 0.1]
goal.q = [0.8, -1.0, 1.0, -0.3, 0.1, 0.4]
"""
LEFT_OUT, BEYOND = "Gravity is left out", "beyond those of the URDF on the velocity"
"""What is said of the motion of SCENE."""


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The motion of SCENE, by `hovi plan`."""
    folder = tmp_path_factory.mktemp("cautions")
    (folder / "scene.toml").write_text(SCENE)
    assert main(["plan", str(folder / "scene.toml"), "--out", str(folder / "motion.npz")]) == 0
    return folder / "motion.npz"


@pytest.fixture(scope="module")
def motion(file: Path) -> hovi.Trajectory:
    return hovi.Trajectory.load(file)


def curve_cost(motion: hovi.Trajectory) -> float:
    """1/2 integral |tau|^2 dt along the curve, with torques of pin.rnea."""
    t = np.linspace(0.0, motion.duration, 20_001)
    assert motion.robot is not None
    model = motion.robot.model.copy()
    model.gravity.setZero()
    data = model.createData()
    sampled = motion.sample(t)
    tau = [pin.rnea(model, data, *each) for each in zip(*sampled[:3], strict=True)]
    return float(np.trapezoid(0.5 * np.square(tau).sum(axis=1), t))


def test_links_that_are_kept_apart_are_no_limits(motion: hovi.Trajectory) -> None:
    """A motion without limits says so whether self-collision was looked at or not."""
    assert motion.robot is not None
    scene, ends = hovi.Scene(motion.robot, []), motion.q[[0, -1]]
    found = hovi.plan(scene, *ends, 0.6, limits="none", self_collision=True)
    assert found.success, found.message
    assert any(BEYOND in each for each in found.trajectory.cautions)


@pytest.mark.parametrize("intervals", [50, 60, 70, 100, 200])
def test_a_success_whose_curve_costs_more_says_by_how_much(
    two_link: hovi.Robot, intervals: int
) -> None:
    solution = hovi.plan(
        hovi.Scene(two_link),
        [-1.5, 0.0],
        [1.5, 0.0],
        2.0,
        scheme="taylor-midpoint",
        intervals=intervals,
        limits="none",
        self_collision=False,
    )
    assert solution.success
    true = curve_cost(solution.trajectory)
    said = [each for each in solution.trajectory.cautions if "curve costs" in each]
    if abs(true / solution.cost - 1) > 0.01:
        assert len(said) == 1
        numbers = re.search(r"costs ([\d.]+) % more .* grid, ([\d.]+) instead of", said[0])
        assert numbers is not None
        assert float(numbers[1]) == pytest.approx(100 * (true / solution.cost - 1), rel=0.05)
        assert float(numbers[2]) == pytest.approx(true, rel=1e-3)
    else:
        assert not said


def test_a_joint_that_spins_is_named(motion: hovi.Trajectory) -> None:
    """One that turns by far more than its way and half a turn, as no slow motion does."""
    arm = hovi.load_robot("xarm7")
    goal = np.clip([1.3, -0.4, 1.0, 1.5, -0.8, 1.2, -1.5], arm.lower + 0.05, arm.upper - 0.05)
    scene, q = hovi.Scene(arm, [hovi.effects.Gravity()]), np.full(7, 0.1)
    fast = hovi.plan(scene, q, goal, 1.0, limits="none", self_collision=False).trajectory
    ratios = [turns(fast), turns(motion)]
    assert ratios[0].max() > 10 > ratios[1].max()
    spinning = int(np.argmax(ratios[0]))
    speed = np.abs(fast.sample(np.linspace(0.0, 1.0, 5001)).v[:, spinning]).max()
    (said,) = [each for each in fast.cautions if "spins" in each]
    assert repr(fast.coordinate_names[spinning]) in said
    assert f"{speed:.3g} rad/s" in said
    assert not any("spins" in each for each in motion.cautions)


def turns(motion: hovi.Trajectory) -> npt.NDArray[np.float64]:
    """T times the largest velocity of each joint, over its way and half a turn."""
    v = np.abs(motion.sample(np.linspace(0.0, motion.duration, 5001)).v).max(axis=0)
    return np.asarray(motion.duration * v / (np.pi + np.abs(motion.q[-1] - motion.q[0])))


def test_links_that_enter_each_other_are_named_and_warned_of(tmp_path: Path) -> None:
    arm = hovi.load_robot("panda", locked=["panda_finger_joint1", "panda_finger_joint2"])
    folded = [0.0, 1.7, 0.0, -3.05, 0.0, 0.5, 0.0]
    solution = hovi.plan(hovi.Scene(arm), "default", folded, 2.0, self_collision=False)
    assert solution.success
    first = solution.trajectory.cautions[0]
    assert re.search(r"links 'panda_\w+' and 'panda_\w+' into each other, by 0.\d+ m", first)
    solution.trajectory.save(tmp_path / "motion.npz")
    again = hovi.Trajectory.load(tmp_path / "motion.npz")
    assert again.cautions[0] == first
    with pytest.warns(HoviWarning, match="into each other"):
        hovi.export(again, tmp_path / "motion.csv", rate=20.0)


def test_the_limits_that_were_left_out_are_named_where_they_are_exceeded(
    motion: hovi.Trajectory,
) -> None:
    assert motion.robot is not None
    v = np.abs(motion.sample(np.linspace(0.0, motion.duration, 2001)).v).max(axis=0)
    beyond = v > motion.robot.velocity_limit
    assert beyond.any()
    (said,) = [each for each in motion.cautions if BEYOND in each]
    worst = motion.coordinate_names[int(np.argmax(v / motion.robot.velocity_limit))]
    others = f" and {beyond.sum() - 1} more" if beyond.sum() > 1 else "."
    assert f"velocity of joint {worst!r}{others}" in said


def test_within_limits_and_with_gravity_nothing_is_said(arm_scene: hovi.Scene) -> None:
    solution = hovi.plan(arm_scene, [-1.0, 0.0], [1.0, 0.5], 1.5, self_collision=False)
    assert solution.success
    assert solution.trajectory.cautions == ()


def test_what_was_warned_of_stays_however_warnings_are_filtered(two_link: hovi.Robot) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        solution = hovi.plan(
            hovi.Scene(two_link), [0.0, 0.0], [90.0, 0.0], 40.0, self_collision=False
        )
    assert any("degrees" in each for each in solution.trajectory.cautions)


def test_a_file_keeps_them_and_a_motion_without_any_says_nothing(
    motion: hovi.Trajectory, tmp_path: Path
) -> None:
    motion.save(tmp_path / "again.npz")
    assert hovi.Trajectory.load(tmp_path / "again.npz").cautions == motion.cautions
    assert len(motion.cautions) == 2
    bare = hovi.Trajectory(motion.grid, motion.path, motion.momenta, motion.scene)
    assert bare.cautions == ()
    assert "cautions" not in repr(bare)


@pytest.mark.parametrize("command", ["info", "plot", "report", "replay", "export"])
def test_every_command_that_shows_the_motion_says_them(
    command: str, file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = {
        "info": [],
        "plot": ["--out", str(tmp_path / "motion.png")],
        "report": ["--html", str(tmp_path / "motion.html")],
        "replay": ["--html", str(tmp_path / "motion.html")],
        "export": ["--out", str(tmp_path / "motion.csv")],
    }
    assert main([command, str(file), *options[command]]) == 0
    printed = "".join(capsys.readouterr())
    assert LEFT_OUT in printed
    assert BEYOND in printed


@pytest.mark.parametrize("kind", ["report", "replay"])
def test_pages_show_them(kind: str, motion: hovi.Trajectory, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    write_report(motion, page) if kind == "report" else hovi.replay(motion, html=page)
    text = page.read_text().partition("<iframe")[0]  # of a report, without the replay in it
    assert LEFT_OUT in text
    assert BEYOND in text


def test_plots_have_them_under_the_curves(motion: hovi.Trajectory) -> None:
    for figure in (hovi.plot(motion), hovi.plot(motion, compare=[motion])):
        label = figure.get_supxlabel()
        assert LEFT_OUT in label
        assert BEYOND.split()[0] in label


def test_exports_with_a_place_for_text_have_them(motion: hovi.Trajectory, tmp_path: Path) -> None:
    pq = pytest.importorskip("pyarrow.parquet")
    reader = pytest.importorskip("mcap.reader")
    for suffix in ("csv", "npz", "parquet", "yaml", "json", "mcap", "xml"):
        hovi.export(motion, tmp_path / f"motion.{suffix}", rate=20.0)
    with np.load(tmp_path / "motion.npz", allow_pickle=False) as arrays:
        found = {"npz": arrays["cautions"].tolist()}
    metadata = pq.read_schema(tmp_path / "motion.parquet").metadata
    found["parquet"] = json.loads(metadata[b"cautions"])
    with (tmp_path / "motion.mcap").open("rb") as stream:
        (record,) = reader.make_reader(stream).iter_metadata()
        found["mcap"] = json.loads(record.metadata["cautions"])
    for suffix in ("yaml", "xml"):
        found[suffix] = (tmp_path / f"motion.{suffix}").read_text().splitlines()[:4]
    for suffix, lines in found.items():
        assert any(LEFT_OUT in each for each in lines), suffix
        assert any(BEYOND in each for each in lines), suffix


def test_readers_of_formats_without_a_place_for_text_are_not_disturbed(
    motion: hovi.Trajectory, tmp_path: Path
) -> None:
    for suffix in ("csv", "yaml", "json"):
        hovi.export(motion, tmp_path / f"motion.{suffix}", rate=20.0)
    table = np.genfromtxt(tmp_path / "motion.csv", delimiter=",", names=True)
    assert len(table) == 13
    message = json.loads((tmp_path / "motion.json").read_text())
    assert yaml.safe_load((tmp_path / "motion.yaml").read_text()) == message


def test_an_export_warns_of_links_that_meet_only(motion: hovi.Trajectory, tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error", HoviWarning)
        hovi.export(motion, tmp_path / "motion.csv", rate=20.0)


def test_a_study_has_them_in_rows_and_counts_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pq = pytest.importorskip("pyarrow.parquet")
    (tmp_path / "scene.toml").write_text(SCENE)
    (tmp_path / "study.toml").write_text(
        'scene = "scene.toml"\n[[vary]]\nfield = "duration"\nvalues = [0.6, 0.7]\n'
    )
    run = ["study", "run", str(tmp_path / "study.toml"), "--out", str(tmp_path / "out")]
    assert main([*run, "--workers", "1"]) == 0
    rows = pq.read_table(tmp_path / "out" / "plans.parquet").to_pylist()
    assert len(rows) == 2
    for row in rows:
        assert any(LEFT_OUT in each for each in row["cautions"])
        assert any(BEYOND in each for each in row["cautions"])
    capsys.readouterr()
    assert main(["study", "show", str(tmp_path / "out"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["cautions"] == {"left out": 2, "limits": 2}
