"""The command: exit codes, JSON output, one sentence per invalid input, Ctrl-C."""

from __future__ import annotations

import json
import math
import os
import re
import signal
import subprocess
import sys
import time
import urllib.request
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hovi
from hovi.cli.application import main
from hovi.cli.reports.arm_limits import limit_set_json, limit_set_text
from hovi.discrete.trajectory import Trajectory
from hovi.planning.problem.arms.limit_set import limit_set
from hovi.robot.bundled_models import example, example_scenes
from oracles.programs import read_urscript
from samples.cubic_motion import Cubic, cubic_motion

REACH = example("two_link_reach.toml").read_text()
URDF = example("two_link.urdf").read_text()

Outcome = tuple[int, str, str]
Run = Callable[..., Outcome]


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    """Run a command in this process; returns exit code, stdout and stderr."""

    def run(*arguments: str | Path) -> Outcome:
        code = main([str(each) for each in arguments])
        out, err = capsys.readouterr()
        return code, out, err

    return run


def run_process(*arguments: str | Path, cwd: Path | None = None) -> Outcome:
    """Run a command as from a shell."""
    command = [sys.executable, "-m", "hovi", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=cwd, timeout=120)
    return done.returncode, done.stdout, done.stderr


@pytest.fixture(scope="module")
def motion(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("motion") / "reach.npz"
    assert main(["plan", "two_link_reach", "--out", str(path)]) == 0
    return path


def scene(folder: Path, text: str = REACH, urdf: str | None = URDF) -> Path:
    if urdf is not None:
        (folder / "two_link.urdf").write_text(urdf)
    path = folder / "scene.toml"
    path.write_text(text)
    return path


# Planning

NUMBERS = ("cost", "nit", "n_neg", "setup_seconds", "solve_seconds", "intervals")


def only_object(text: str) -> dict[str, Any]:
    """The one JSON object on stdout, which must not contain NaN or infinities."""

    def refuse(constant: str) -> float:
        raise AssertionError(f"{constant} is not JSON")

    fields = json.loads(text, parse_constant=refuse)
    assert isinstance(fields, dict)
    return fields


def test_json_is_one_object_with_the_documented_keys(run: Run) -> None:
    code, out, err = run("plan", "two_link_reach", "--json")
    assert (code, err) == (0, "")
    fields = only_object(out)
    assert fields["success"] is True
    assert fields["status"] == "minimum"
    assert fields["message"]
    assert 0 < fields["error_estimate"] < 1e-7
    assert (fields["scheme"], fields["intervals"], fields["n_neg"]) == ("galerkin-2", 16, 0)
    assert math.isclose(fields["cost"], 20.2088008, rel_tol=1e-6)
    assert all(isinstance(fields[key], (int, float)) for key in NUMBERS)
    assert list(fields["peaks"]) == ["shoulder", "elbow"]
    assert fields["limits"] is None
    assert fields["excess"] is None


def test_json_has_the_effort_and_the_extremes(run: Run, tmp_path: Path) -> None:
    motion = tmp_path / "reach.npz"
    fields = only_object(run("plan", "two_link_reach", "--json", "--out", motion)[1])
    assert fields["effort"] == pytest.approx(fields["cost"], rel=1e-12)
    trajectory = Trajectory.load(motion)
    a = trajectory.sample(np.linspace(0, trajectory.duration, 2001)).a
    found = fields["acceleration"]
    assert found["largest"] == pytest.approx(np.abs(a).max(), rel=1e-3)
    assert found["largest"] == max(found["joints"].values()) == found["joints"][found["joint"]]
    assert 0 <= found["t"] <= trajectory.duration
    names = ["shoulder", "elbow"]
    assert [found["start"][name] for name in names] == pytest.approx(a[0])
    assert [found["end"][name] for name in names] == pytest.approx(a[-1])
    assert (found["unit"], fields["jerk"]["unit"]) == ("rad/s^2", "rad/s^3")
    assert list(fields["jerk"]) == list(found)


def test_the_report_says_the_effort_the_largest_acceleration_and_jerk(run: Run) -> None:
    out = run("plan", "two_link_reach", "--no-certificate", "--verbose")[1]
    assert re.search(r"^effort +20\.2088", out, re.MULTILINE)
    ends = r".*; up to \S+ \(elbow\) at the start, \S+ \(elbow\) at the end$"
    for label, unit in (("accel\\.", "2"), ("jerk", "3")):
        line = rf"^{label} +at most \S+ rad/s\^{unit} \(elbow, t = \S+ s\){ends}"
        assert re.search(line, out, re.MULTILINE), out
    out = run("plan", "two_link_reach", "--no-certificate")[1]
    largest = r"at most \S+ rad/s\^{} \(elbow, t = \S+ s\)".format
    assert re.search(f"^accel\\. +{largest(2)}; jerk {largest(3)}$", out, re.MULTILINE), out


def test_the_report_says_the_effort_where_it_is_not_the_cost(run: Run) -> None:
    assert re.search(r"^effort ", run("plan", "two_link_reach", "--smooth")[1], re.MULTILINE)
    assert "effort" not in run("plan", "two_link_reach")[1]


def test_a_report_is_short_and_verbose_adds_the_rest(run: Run) -> None:
    short, long = (run("plan", "two_link_reach", *more)[1] for more in ((), ("--verbose",)))
    labels, all_labels = ([line[:9].strip() for line in x.splitlines()] for x in (short, long))
    top = ["status", "message", "cost", "scheme", "time"]
    assert labels == [*top, "", "joint", *labels[7:10], "", "accel.", "accuracy"]
    solver = {"effort", "n_neg", "nit"}
    certificate = {"errors", "action", "bound", "energy", "residual", "largest", "replay"}
    assert set(all_labels) >= {*top, "accel.", "jerk"} | solver | certificate
    assert "accuracy" not in all_labels


def test_options_override_the_scene(run: Run) -> None:
    options = ("--scheme", "galerkin-1", "--intervals", "24", "--seed", "7", "--starts", "1")
    _, out, _ = run("plan", "two_link_reach", "--json", *options)
    fields = only_object(out)
    assert [fields[key] for key in ("scheme", "intervals", "seed", "starts")] == [
        "galerkin-1",
        24,
        7,
        1,
    ]


def test_without_limits_the_report_marks_exceeded_urdf_limits(run: Run) -> None:
    code, out, _ = run("plan", "ur5_reach")
    assert code == 0
    for fragment in ("minimum", "galerkin-2 on 16 intervals", "wrist_3_joint", "150"):
        assert fragment in out
    assert "! limits Planned without limits, the motion is beyond those of the URDF on the " in out


def test_with_limits_the_report_shows_the_margins(run: Run) -> None:
    code, out, _ = run("plan", "ur5_reach_limited", "--no-certificate")
    assert code == 0
    assert "beyond" not in out
    assert "* at a limit" in out
    rows = {line.split()[0]: line for line in out.splitlines() if line.strip()}
    assert re.search(r"3\.14 +\*0\.0 %", rows["elbow_joint"])  # its velocity, of 3.14 rad/s
    row = rows["shoulder_lift_joint"]
    assert "*" not in row


def test_json_has_the_margin_to_each_limit(run: Run, tmp_path: Path) -> None:
    motion = tmp_path / "ur5.npz"
    code, out, _ = run("plan", "ur5_reach_limited", "--json", "--out", motion)
    fields = only_object(out)
    assert code == 0
    trajectory = Trajectory.load(motion)
    assert fields["intervals"] == trajectory.grid.intervals
    assert 0 <= fields["excess"] <= 1e-6
    assert list(fields["limits"]) == ["q", "v", "a", "tau"]
    for name, room in fields["limits"]["v"].items():
        left = (3.14 - fields["peaks"][name]["v"]) / 6.28
        assert math.isclose(room, left, abs_tol=1e-4)
    assert set(fields["limits"]["a"].values()) == {None}


def test_the_limits_of_an_arm_are_reported_with_what_they_leave_out(run: Run) -> None:
    options = ("--limits", "ur5", "--no-certificate")
    _, out, _ = run("plan", "ur5_reach", *options)
    line = r"^limits +ur5, of a UR5 \(CB3\); no limits on acceleration, jerk and torque rate are"
    assert re.search(line, out, re.MULTILINE)
    fields = only_object(run("plan", "ur5_reach", "--json", *options)[1])
    assert fields["limit_set"]["name"] == "ur5"
    assert fields["limit_set"]["unpublished"] == ["a", "jerk", "torque_rate"]
    assert fields["limit_set"]["not_applied"] == []
    assert all(url.startswith("https://") for url in fields["limit_set"]["sources"])
    assert fields["excess"] < 1e-6


def test_a_report_says_that_jerk_limits_do_not_apply() -> None:
    arm = limit_set("panda")
    text = limit_set_text(arm, 2)
    assert "without those on jerk and torque rate, for which a motion needs order 3" in text
    assert "without" not in limit_set_text(arm, 3)
    found = limit_set_json(arm, 2)
    assert found is not None
    assert (found["not_applied"], found["unpublished"]) == (["jerk", "torque_rate"], [])


def test_an_unknown_arm_is_refused_with_a_hint(run: Run) -> None:
    assert_refused(run("plan", "ur5_reach", "--limits", "pnda"), "'pnda'", "'panda'")
    assert_refused(run("plan", "ur5_reach", "--limits", "panda"), "panda_joint1", "'ur5'")


def test_info_names_the_sources_of_the_limits_of_an_arm(run: Run, tmp_path: Path) -> None:
    text = example("ur5_reach.toml").read_text().replace('limits = "none"', 'limits = "ur5"')
    code, out, _ = run("info", scene(tmp_path, text, None))
    assert code == 0
    assert "seed 0, limits ur5\nlimits of a UR5 (CB3), published in" in out
    assert "github.com/UniversalRobots" in out


def test_intervals_are_those_on_which_limits_hold(run: Run) -> None:
    fields = only_object(run("plan", "panda_reach_limited", "--json")[1])
    assert fields["success"]
    assert f", on {fields['intervals']} intervals" in fields["message"]


def test_a_tolerance_chooses_the_scheme(run: Run) -> None:
    code, out, _ = run("plan", "ur5_reach", "--tolerance", "1e-6", "--json")
    fields = json.loads(out)
    assert code == 0
    assert 0 < fields["error_estimate"] <= 1e-6
    assert fields["tolerance_reached"] is True
    assert fields["errors"]["cost"] == pytest.approx(fields["error_estimate"])
    assert fields["errors"]["frame"] == "tool0"
    assert fields["grids"][-1]["intervals"] == fields["intervals"]
    assert fields["grids"][-1]["error"] < 1e-2 * fields["grids"][0]["error"]
    _, out, _ = run("plan", "ur5_reach", "--tolerance", "0.1 mm")
    assert re.search(r"estimated error \S+ mm at tool0, tolerance 0.1 mm at tool0", out)
    line = r"^accuracy estimated errors: cost \S+, joints \S+ rad, tool0 \S+ mm; simulating"
    assert re.search(line, out, re.MULTILINE)
    _, out, _ = run("plan", "ur5_reach", "--tolerance", "0.1 mm", "--verbose")
    assert re.search(r"^errors +cost .*, q .* rad, .* tool0 .* mm$", out, re.MULTILINE)


SWING_UP = """robot = "two_link.urdf"
duration = {duration}
limits = "none"
start.q = [-1.5707963267948966, 0.0]
goal.q = [1.5707963267948966, 0.0]
[effects.gravity]
"""


def test_a_motion_that_its_grid_does_not_resolve_is_unresolved(run: Run, tmp_path: Path) -> None:
    path = scene(tmp_path, SWING_UP.format(duration=200.0))
    code, out, _ = run("plan", path, "--intervals", "16")
    assert code == 1
    assert re.search(r"^status +unresolved$", out, re.MULTILINE)
    found = re.search(
        r"its cost is (\S+) at the quadrature points, but (\S+) along", " ".join(out.split())
    )
    assert found is not None
    cost, integral = (float(number) for number in found.groups())
    assert abs(integral - cost) > 0.5 * integral
    code, out, _ = run("plan", scene(tmp_path, SWING_UP.format(duration=5.0)), "--json")
    fields = only_object(out)
    assert (code, fields["status"], fields["tolerance"]) == (0, "minimum", 1e-3)
    assert fields["tolerance_reached"]
    assert fields["certificate"]["integral"] == pytest.approx(fields["cost"], rel=1e-3)


def test_a_plan_comes_with_its_certificate(run: Run) -> None:
    fields = json.loads(run("plan", "two_link_reach", "--json")[1])
    certificate = fields["certificate"]
    assert certificate["action"] == pytest.approx(fields["cost"], rel=1e-14)
    assert certificate["integral"] == pytest.approx(fields["cost"], rel=1e-5)
    assert fields["error_estimate"] == certificate["errors"]["cost"] < 1e-7
    assert certificate["hamiltonian"] == pytest.approx(55.452, abs=1e-2)
    assert certificate["replay"]["q_rad"] < 1e-8
    assert certificate["replay"]["certifies"] == "dynamics and torques, not optimality"
    text = run("plan", "two_link_reach")[1]
    line = r"^accuracy estimated errors: cost \S+, joints \S+ rad, tip \S+ mm; simulating "
    assert re.search(
        line + r"the torques from node to node agrees to \S+e-1\d rad$", text, re.MULTILINE
    )
    text = run("plan", "two_link_reach", "--verbose")[1]
    assert "this certifies dynamics and torques, not optimality" in text
    assert re.search(r"^energy +Pontryagin's H = 55\.45", text, re.MULTILINE)
    fields = json.loads(run("plan", "two_link_reach", "--no-certificate", "--json")[1])
    assert fields["certificate"] is None
    assert 0 < fields["error_estimate"] < 1e-7


def test_a_scene_may_have_a_tolerance(run: Run, tmp_path: Path) -> None:
    unnamed = REACH.replace('name = "galerkin-2"', "")
    path = scene(tmp_path, "tolerance = '0.01 deg'\n" + unnamed)
    fields = json.loads(run("plan", path, "--json")[1])
    assert fields["tolerance"] == "0.01 deg"
    assert fields["errors"]["q_rad"] <= np.deg2rad(0.01)
    fields = json.loads(run("plan", path, "--intervals", "8", "--json")[1])
    assert (fields["scheme"], fields["intervals"]) == ("galerkin-2", 8)
    assert "tolerance" not in fields
    assert "tolerance 0.01 deg" in run("info", path)[1]


def test_limits_are_overridden_by_an_option(run: Run) -> None:
    fields = only_object(run("plan", "ur5_reach_limited", "--limits", "none", "--json")[1])
    assert fields["limits"] is None
    fields = only_object(run("plan", "two_link_reach", "--limits", "urdf", "--json")[1])
    assert all(room > 0.4 for room in fields["limits"]["tau"].values())


def test_a_goal_outside_the_limits_is_infeasible_and_named(run: Run, tmp_path: Path) -> None:
    text = REACH.replace('limits = "none"\n', "") + "[limits.q]\nelbow = 0.5\n"
    code, out, _ = run("plan", scene(tmp_path, text), "--json")
    fields = only_object(out)
    assert (code, fields["status"]) == (1, "infeasible")
    assert "goal" in fields["message"]
    assert "'elbow'" in fields["message"]
    assert "position of joint 'elbow' at the goal" in run("plan", tmp_path / "scene.toml")[1]


def test_a_written_motion_is_the_planned_motion(motion: Path) -> None:
    trajectory = Trajectory.load(motion)
    np.testing.assert_allclose(trajectory.q[-1], [0.3, 0.7], atol=1e-12)
    np.testing.assert_allclose(trajectory.v[-1], [0.5, -0.4], atol=1e-12)


def test_a_motion_is_a_guess_for_another_grid(run: Run, motion: Path) -> None:
    _, out, _ = run("plan", "two_link_reach", "--guess", motion, "--intervals", "20", "--json")
    fields = only_object(out)
    assert fields["success"]
    assert fields["nit"] < 5


@pytest.mark.parametrize("time_limit", ["0.01", "10 ms"])
def test_a_time_limit_returns_the_best_so_far(run: Run, tmp_path: Path, time_limit: str) -> None:
    motion = tmp_path / "best.npz"
    limit = ("--time-limit", time_limit, "--out", motion, "--json")
    code, out, _ = run("plan", "two_link_swing_up", *limit)
    fields = only_object(out)
    assert code == (0 if fields["success"] else 1)
    assert fields["status"] in ("time_limit", "minimum")
    assert Trajectory.load(motion).duration == 10.0


def test_an_interrupt_prints_the_best_so_far(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "hovi", "plan", "two_link_swing_up", "--json"]
    command += ["--starts", "1000"]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    try:
        time.sleep(4.0)
        os.kill(process.pid, signal.SIGINT)
        out, err = process.communicate(timeout=60)
    finally:
        process.kill()
    assert "Traceback" not in err
    fields = only_object(out)
    assert process.returncode == (0 if fields["success"] else 1)
    assert math.isfinite(fields["cost"])


INTERRUPTED_IMPORT = """
import os, signal, sys
from hovi.__main__ import run

module = sys.argv.pop(1)

class Interrupt:
    def find_spec(self, name, *rest):
        if name == module:
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Interrupt())
run()
"""


def interrupted_import(module: str, *arguments: str | Path) -> Outcome:
    """Run a command that gets Ctrl-C at the start of importing a module."""
    command = [sys.executable, "-c", INTERRUPTED_IMPORT, module, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    return done.returncode, done.stdout, done.stderr


def test_an_interrupt_during_an_import_of_a_run_keeps_the_best_so_far(tmp_path: Path) -> None:
    free = REACH.replace("duration = 1.0", "time_weight = 3.0\nduration = [0.5, 40.0]")
    options = scene(tmp_path, free), "--intervals", "4000", "--json"
    code, out, err = interrupted_import("scipy.optimize", "plan", *options)
    fields = only_object(out)
    assert (code, err, fields["status"]) == (1, "", "interrupted")
    assert math.isfinite(fields["cost"])


@pytest.mark.parametrize("module", ["typer", "numpy", "pinocchio"])
def test_an_interrupt_during_the_first_imports_ends_the_command(module: str) -> None:
    assert interrupted_import(module, "plan", "two_link_reach") == (130, "", "")


AS_A_WEAK_REFERENCE_GOES = """
import signal, sys, time, weakref
from hovi import __main__ as entry

entry.handle_interrupts()
there = {"__name__": "weakref", "signal": signal}
exec("def remove(_): signal.raise_signal(signal.SIGINT)", there)

class Thing:
    pass

try:
    reference = weakref.ref(Thing(), there["remove"])
    time.sleep(20)
except KeyboardInterrupt:
    sys.exit(7)
"""


def test_an_interrupt_where_python_drops_exceptions_comes_after_it() -> None:
    """It was printed as ignored, with a traceback, and the command went on."""
    command = [sys.executable, "-c", AS_A_WEAK_REFERENCE_GOES]
    done = subprocess.run(command, capture_output=True, timeout=60, check=False)
    assert (done.returncode, done.stderr.decode()) == (7, "")


AS_SOBOL_TABLES_LOAD = """
import os, signal, sys
import numpy as np
from hovi.__main__ import run

load = np.load

def interrupted(file, *rest, **options):
    if "sobol" in str(getattr(file, "name", file)):
        np.load = load
        os.kill(os.getpid(), signal.SIGINT)
    return load(file, *rest, **options)

np.load = interrupted
run()
"""

SOBOL_STUDY = """
scene = "two_link_reach"
[[vary]]
field = "goal.q"
sample = {lower = [0.0, 0.0], upper = [1.0, 1.0], count = 64}
"""


def test_an_interrupt_that_compiled_code_drops_ends_a_study(tmp_path: Path) -> None:
    """SciPy's compiled loader of tables cannot raise: the study planned all of its cells."""
    (tmp_path / "study.toml").write_text(SOBOL_STUDY)
    command = [sys.executable, "-c", AS_SOBOL_TABLES_LOAD, "study", "study.toml", "--out", "out"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, cwd=tmp_path)
    assert done.returncode == 130
    assert "Traceback" not in done.stderr
    assert "64 of 64" not in done.stdout


@pytest.mark.parametrize("name", ["", ".", "/"])
@pytest.mark.parametrize("command", [("export", "--csv"), ("plot",), ("report",)])
def test_a_motion_without_a_name_is_refused(command: tuple[str, ...], name: str, run: Run) -> None:
    code, out, err = run(*command, name)
    assert (code, out) == (2, "")
    assert re.fullmatch(r"error: FILE must be a motion, such as motion\.npz, and not '/?'\.\n", err)


@pytest.fixture
def deep(tmp_path: Path) -> Iterator[Path]:
    """A folder that does not exist yet, and whose removal is more than `shutil.rmtree` can do."""
    yield tmp_path.joinpath(*["d"] * 1_500)
    subprocess.run(["rm", "-rf", tmp_path / "d"], check=True)


def test_a_study_goes_into_a_folder_that_is_a_thousand_deep(
    run: Run, deep: Path, tmp_path: Path
) -> None:
    (tmp_path / "study.toml").write_text('scene = "two_link_reach"\n')
    code, _, err = run("study", tmp_path / "study.toml", "--out", deep, "--workers", "1")
    assert code == 0
    assert not re.search("error|warning|note", err)  # on a slow machine it shows its progress
    assert (deep / "plans.parquet").exists()


# Describing robots and scenes, and showing motions


def test_info_describes_robots_and_scenes(run: Run, tmp_path: Path) -> None:
    for what in ("two_link_elbow", scene(tmp_path), example("two_link.urdf"), "ur5"):
        code, out, err = run("info", what)
        assert (code, err) == (0, "")
        assert "elbow" in out
    code, listed, _ = run("info")
    assert code == 0
    assert {"panda", "two_link_elbow"} <= set(re.findall(r"\w+", listed))
    assert "joint_limit_potential" in run("info", "two_link_elbow")[1]
    assert "Base: floating" in run("info", "ur5", "--free-flyer")[1]


@pytest.mark.parametrize("name", ["ARM.URDF", "arm.xml", "folder/arm"])
def test_info_takes_the_paths_that_load_robot_takes(run: Run, tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.parent.mkdir(exist_ok=True)
    path.write_text(URDF)
    code, out, err = run("info", path)
    assert (code, err) == (0, "")
    assert "elbow" in out
    assert "no-such.xml" in run("info", "no-such.xml")[2]


def test_export_writes_a_table(run: Run, motion: Path, tmp_path: Path) -> None:
    target = tmp_path / "reach.csv"
    code, out, _ = run("export", motion, "--csv", target, "--rate", "100")
    assert code == 0
    assert str(target) in out
    assert len(target.read_text().splitlines()) == 102
    assert run("export", motion, "--csv")[0] == 0
    assert motion.with_suffix(".csv").exists()


@pytest.mark.parametrize(
    "arguments", [[], ["--csv"], ["--format", "csv"], ["--csv", "--format", "csv"]]
)
def test_an_export_format_is_given_by_name_option_or_file(
    arguments: list[str], run: Run, motion: Path, tmp_path: Path
) -> None:
    target = tmp_path / "reach.csv"
    assert run("export", motion, *arguments, "--out", target)[0] == 0
    assert target.read_text().startswith("t,q_")


def test_nothing_is_written_where_there_is_no_motion(run: Run, tmp_path: Path) -> None:
    scene, out = tmp_path / "fast.toml", tmp_path / "fast.npz"
    text = example("ur5_reach_limited.toml").read_text()
    scene.write_text(re.sub("(?m)^duration = .*$", "duration = 0.01", text))
    code, said, _ = run("plan", scene, "--out", out)
    assert (code, out.exists()) == (1, False)
    assert "infeasible" in said
    assert "wrote nothing, as there is no motion" in said


def test_every_format_has_a_file_name_of_its_own(run: Run, motion: Path, tmp_path: Path) -> None:
    saved = tmp_path / "reach.npz"
    saved.write_bytes(motion.read_bytes())
    for name, target in (
        ("numpy", "reach_samples.npz"),
        ("joint-trajectory", "reach.yaml"),
        ("robot-trajectory", "reach_robot_trajectory.yaml"),
    ):
        code, out, _ = run("export", saved, "--format", name)
        assert code == 0
        assert str(tmp_path / target) in out
    assert saved.read_bytes() == motion.read_bytes()
    refused = run("export", saved, "--format", "numpy", "--out", saved)
    assert_refused(refused, "a motion itself")


def test_motions_are_joined_in_one_export(run: Run, tmp_path: Path) -> None:
    scene = hovi.Scene(hovi.load_robot("ur5"))
    for name, ends in (("there", (0.1, 0.4)), ("back", (0.4, 0.1))):
        cubic = Cubic.resting(*(np.full(6, x) for x in ends), 0.5)
        cubic_motion(scene, 0.5, cubic=cubic)[0].save(tmp_path / f"{name}.npz")
    there, back, out = (tmp_path / name for name in ("there.npz", "back.npz", "cycle.script"))
    tuned = ("--lookahead-time", "0.05", "--gain", "500")
    code, said, _ = run("export", there, "--then", back, "--gap", "0.2", "--out", out, *tuned)
    assert (code, said.strip()) == (0, f"wrote {out}")
    program = read_urscript(out.read_bytes())
    alike = tmp_path / "listed.script"
    assert run("export", there, back, "--gap", "0.2", alike, *tuned)[0] == 0
    assert read_urscript(alike.read_bytes()).targets.tolist() == program.targets.tolist()
    assert program.tuning == {(0.05, 500.0)}
    np.testing.assert_allclose(program.times[-2], 1.2, atol=1e-9)
    np.testing.assert_allclose(program.targets[[61, 80]], 0.4, atol=2e-3)
    again = run("export", there, "--then", there, "--out", tmp_path / "no.csv")
    assert_refused(again, "motion 2 begins 0.3 rad or m of", "plan it from there")
    assert_refused(run("export", there, "--gap", "1", "--csv"), "a gap is between motions")
    assert_refused(run("export", there, "--gain", "1", "--csv"), "`gain` is for", "'urscript'")
    assert_refused(run("export", there, "--then", back, "--out", back), "a motion itself")
    assert not (tmp_path / "no.csv").exists()
    before = back.read_bytes()
    assert_refused(run("export", there, back), "a motion itself", "--out to export several")
    assert back.read_bytes() == before


def test_a_motion_is_checked_in_mujoco(run: Run, motion: Path) -> None:
    assert_refused(run("check", motion, "--in", "mujko"), "'mujko'", "'mujoco'")
    pytest.importorskip("mujoco")
    code, out, _ = run("check", motion, "--in", "mujoco", "--json")
    report = only_object(out)
    assert (code, report["success"]) == (0, True)
    assert max(report["error"].values()) < 1e-3
    assert "follows the plan" in run("check", motion)[1]


def test_plot_writes_a_figure(run: Run, motion: Path, tmp_path: Path) -> None:
    code, out, _ = run("plot", motion, "--out", tmp_path)
    assert code == 0
    assert f"wrote {tmp_path / 'reach.png'}" in out
    assert (tmp_path / "reach.png").read_bytes().startswith(b"\x89PNG")


def test_replay_writes_a_page(run: Run, motion: Path, tmp_path: Path) -> None:
    page = tmp_path / "reach.html"
    assert run("replay", motion, "--html", page)[0] == 0
    assert "<html" in page.read_text()[:1000].lower()


def test_a_live_replay_serves_its_page_until_interrupted(motion: Path) -> None:
    command = [sys.executable, "-m", "hovi", "replay", str(motion), "--no-browser"]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    try:
        assert process.stdout is not None
        address = re.search(r"http://\S+?(?=;)", process.stdout.readline())
        assert address is not None
        with urllib.request.urlopen(address[0], timeout=10) as page:
            assert page.status == 200
        time.sleep(1.5)  # longer than the motion
        assert process.poll() is None
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=20)
    finally:
        process.kill()
    assert process.returncode == 0
    assert "Traceback" not in err


# Bad input


def assert_refused(outcome: Outcome, *expected: str) -> None:
    code, out, err = outcome
    assert code == 2
    assert out == ""
    assert err.startswith("error: ")
    assert err.count("\n") == 1
    assert "Traceback" not in err
    for fragment in expected:
        assert fragment in err


def chain(links: int) -> str:
    """The URDF of a chain of links."""
    inertia = '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
    link = '<link name="l{0}"><inertial><mass value="1"/>' + inertia + "</inertial></link>"
    joint = (
        '<joint name="j{0}" type="revolute"><parent link="l{0}"/><child link="l{1}"/>'
        '<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
    )
    parts = [link.format(i) for i in range(links)]
    parts += [joint.format(i, i + 1) for i in range(links - 1)]
    return f'<robot name="chain">{"".join(parts)}</robot>'


MODELS = {
    "not a URDF": ("not a robot", []),
    "another XML": ("<sdf><model/></sdf>", ["robot"]),
    "NaN mass": (URDF.replace('mass value="0.375"', 'mass value="NaN"'), ["upper_arm", "mass"]),
    "negative mass": (URDF.replace('mass value="0.25"', 'mass value="-1"'), ["forearm", "mass"]),
    "20,000 links": (chain(20_000), ["links"]),
}


@pytest.mark.parametrize("model", MODELS)
def test_an_invalid_robot_is_refused(model: str, run: Run, tmp_path: Path) -> None:
    urdf, expected = MODELS[model]
    path = scene(tmp_path, urdf=urdf)
    assert_refused(run("plan", path), "two_link.urdf", *expected)
    assert_refused(run("info", tmp_path / "two_link.urdf"), *expected)


SCENES = {
    "start of wrong length": ("q = [-1.5707963267948966, 0.0]", "q = [1, 2, 3]", ["shoulder"]),
    "NaN in the goal": ("q = [0.3, 0.7]", "q = [nan, 0.7]", ["goal.q[0]", "nan"]),
    "T = 0": ("duration = 1.0", "duration = 0.0", ["duration", "it is 0."]),
    "T < 0": ("duration = 1.0", "duration = -1.0", ["duration", "it is -1."]),
    "N = 0": ("intervals = 16", "intervals = 0", ["intervals"]),
    "unknown effect": ("[effects.gravity]", "[effects.gravitas]", ["'gravity'"]),
    "unknown scheme": ("galerkin-2", "galerkin-two", ["'galerkin-2'"]),
    "unit": ("duration", 'tolerance = "1 mmm"\nduration', ["tolerance", "'mm'", "line"]),
    "degenerate scheme": ("galerkin-2", "mean-difference", ["mean-difference"]),
    "unknown key": ("intervals =", "intervalls =", ["'intervals'", "line 17"]),
}


@pytest.mark.parametrize("mistake", SCENES)
def test_an_invalid_scene_is_refused(mistake: str, run: Run, tmp_path: Path) -> None:
    old, new, expected = SCENES[mistake]
    assert old in REACH
    assert_refused(run("plan", scene(tmp_path, REACH.replace(old, new)), "--json"), *expected)


COMMANDS: dict[str, tuple[Sequence[str], list[str]]] = {
    "no such scene": (["plan", "nowhere.toml"], ["nowhere.toml"]),
    "nearly a shipped scene": (["plan", "two_link_swingup"], ["'two_link_swing_up'"]),
    "tolerance": (["plan", "two_link_reach", "--tolerance", "1 mmm"], ["'1 mmm'", "'mm'"]),
    "frame": (["plan", "two_link_reach", "--tolerance", "1 mm at foot"], ["'foot'"]),
    "two ways": (
        ["plan", "two_link_reach", "--tolerance", "1e-6", "--intervals", "8"],
        ["--tolerance chooses"],
    ),
    "N = 0": (["plan", "two_link_reach", "--intervals", "0"], ["intervals"]),
    "no starts": (["plan", "two_link_reach", "--starts", "0"], ["starts"]),
    "scheme": (["plan", "two_link_reach", "--scheme", "galerkn-2"], ["'galerkin-2'"]),
    "guess": (["plan", "two_link_reach", "--guess", "cubik"], ["'cubic'"]),
    "limits": (["plan", "two_link_reach", "--limits", "urd"], ["--limits", "'urdf'"]),
    "no such guess": (["plan", "two_link_reach", "--guess", "no.npz"], ["no.npz"]),
    "unit of a time limit": (
        ["plan", "two_link_reach", "--time-limit", "2 sec"],
        ["--time-limit '2 sec' has the unit 'sec'", "'s'"],
    ),
    "unit of a duration": (["simulate", "two_link_reach", "--duration", "2 mn"], ["'min'"]),
    "no time": (["effects", "two_link_reach", "--time-limit", "soon"], ["--time-limit", "'soon'"]),
    "time limit": (["plan", "two_link_reach", "--time-limit", "nan"], ["--time-limit"]),
    "ending": (["plan", "two_link_reach", "--out", "motion.toml"], [".npz"]),
    "folder": (["plan", "two_link_reach", "--out", "/nowhere/m.npz"], ["/nowhere"]),
    "option": (["plan", "two_link_reach", "--interval", "3"], ["--intervals"]),
    "number": (["plan", "two_link_reach", "--intervals", "many"], ["--intervals"]),
    "no scene": (["plan"], ["SCENE"]),
    "no such robot": (["info", "pandaa"], ["'panda'"]),
    "no such scene, to info": (["info", "two_link_swingup"], ["'two_link_swing_up'"]),
    "no such URDF": (["info", "nowhere.urdf"], ["nowhere.urdf"]),
    "no such motion": (["plot", "nowhere.npz"], ["nowhere.npz"]),
    "no format": (["export", "nowhere.npz"], ["--format", "csv", "joint-trajectory"]),
    "an extension of no format": (["export", "m.npz", "--out", "m.cvs"], ["'.csv'"]),
    "a robot as a scene": (["plan", str(example("two_link.urdf"))], ["no TOML", "hovi info"]),
    "a scene as a motion": (["replay", str(example("ur5_reach.toml"))], ["not a motion"]),
    "a path to nothing": (["plan", "nowhere/scene.toml"], ["check the path"]),
    "no such format": (["export", "nowhere.npz", "--format", "cvs"], ["'cvs'", "'csv'"]),
    "two formats": (["export", "m.npz", "--csv", "--format", "npy"], ["--csv", "--format npy"]),
    "two files": (["export", "m.npz", "a.csv", "--csv", "--out", "b.csv"], ["a.csv", "b.csv"]),
    "command": (["plann"], ["plan"]),
}


@pytest.mark.parametrize("mistake", COMMANDS)
def test_an_invalid_command_is_refused(mistake: str, run: Run) -> None:
    arguments, expected = COMMANDS[mistake]
    assert_refused(run(*arguments), *expected)


@pytest.mark.parametrize("value", ["0", "-1", "nan"])
@pytest.mark.parametrize("command", [("export", "--csv", "--rate"), ("replay", "--speed")])
def test_rates_and_speeds_must_be_positive(
    command: tuple[str, ...], value: str, run: Run, motion: Path
) -> None:
    assert_refused(run(command[0], motion, *command[1:], value))


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 not a zip", b"hello"])
def test_a_file_without_a_motion_is_refused(content: bytes, run: Run, tmp_path: Path) -> None:
    path = tmp_path / "invalid.npz"
    path.write_bytes(content)
    assert_refused(run("export", path, "--csv"), "invalid.npz")


# As a process


def test_the_version_is_printed_without_importing_pinocchio() -> None:
    script = (
        "import sys; from hovi.cli.application import main; main(['--version'])\n"
        "print('pinocchio' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    version, loaded = done.stdout.splitlines()
    assert version.startswith("hovi ")
    assert loaded == "False"


def test_a_process_ends_with_the_exit_code_and_no_traceback(tmp_path: Path) -> None:
    assert_refused(run_process("plan", "nowhere.toml", cwd=tmp_path), "nowhere.toml")
    code, out, err = run_process("plan", "two_link_reach", "--json", cwd=tmp_path)
    assert (code, err) == (0, "")
    assert only_object(out)["success"]


def test_help_lists_every_command(run: Run) -> None:
    code, out, _ = run("--help")
    assert code == 0
    for command in ("plan", "replay", "plot", "export", "info"):
        assert command in out


def test_every_bundled_scene_is_found_by_name(run: Run) -> None:
    for name in example_scenes():
        assert run("info", name)[0] == 0


# Sequences


def test_a_sequence_is_planned_saved_and_drawn(run: Run, tmp_path: Path) -> None:
    code, out, _ = run("plan", "two_link_pick", "--json", "--out", tmp_path / "pick.npz")
    assert code == 0
    report = only_object(out)
    segments = report["segments"]
    assert [each["name"] for each in segments] == ["reach", "carry", "return"]
    assert [each["end"] for each in segments] == pytest.approx([0.6, 1.5, 2.3])
    assert sum(each["cost"] for each in segments) == pytest.approx(report["cost"], rel=1e-12)
    assert report["certificate"]["replay"] is not None
    assert "segment 'carry' from 0.6 to 1.5 s" in run("info", tmp_path / "pick.npz")[1]
    assert run("plot", tmp_path / "pick.npz", "--out", tmp_path / "pick.png")[0] == 0
    assert run("replay", tmp_path / "pick.npz", "--html", tmp_path / "pick.html")[0] == 0


def test_the_report_of_a_sequence_lists_its_segments(run: Run) -> None:
    code, out, _ = run("plan", "two_link_pick", "--no-certificate")
    assert code == 0
    lines = [line for line in out.splitlines() if line.startswith("segment")]
    assert [line.split("'")[1] for line in lines] == ["reach", "carry", "return"]
    assert "from 0.6 to 1.5 s, cost" in lines[1]


def test_info_names_the_segments_and_what_is_theirs(run: Run) -> None:
    code, out, _ = run("info", "two_link_pick")
    assert code == 0
    assert "segment 'carry': 0.9 s, from 0.6 to 1.5 s\n  payload: 0.5 kg at tip" in out
    assert "  goal q = [0.7, 0.9]" in out
    assert "    position [-0.6, 0, 1.4] m" in out


@pytest.mark.parametrize("command", ["simulate", "effects", "accuracy"])
def test_what_takes_one_motion_refuses_a_sequence(run: Run, command: str) -> None:
    code, _, err = run(command, "two_link_pick")
    assert code == 2
    assert "takes one motion, and task 'two_link_pick' has 3 segments" in err
