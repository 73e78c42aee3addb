"""What a study shows: the command line, summaries, pictures and the page of the worst motions."""

from __future__ import annotations

import fcntl
import json
import shutil
import threading
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from hovi.cli.application import main
from hovi.robot.loading import load_robot
from hovi.scene.scene import Scene
from hovi.study.running.progress import StudyProgress
from hovi.study.showing.charts import (
    FARTHEST,
    _Cells,
    draw_against,
    draw_histograms,
    draw_map,
    map_of,
)
from hovi.study.showing.plans import Plans
from hovi.study.showing.summary import summary
from hovi.study.storage.folder import About, used_alone
from hovi.study.study import Study
from hovi.study.worst_page import shared_pieces, write_worst
from hovi.viewing.replay_session import page_of
from samples.cubic_motion import cubic_motion

pytest.importorskip("pyarrow")
pytest.importorskip("pandas")

STUDY = """
scene = "two_link_reach"

[[vary]]
field = "goal.q[0]"
grid = { lower = 0.0, upper = 0.6, count = 3 }

[[vary]]
field = "goal.q[1]"
grid = { lower = 0.2, upper = 0.8, count = 3 }

[[vary]]
field = "limits"
values = ["none", { base = "none", tau = 0.5 }]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    at = tmp_path_factory.mktemp("shown")
    (at / "study.toml").write_text(STUDY)
    code = main(["study", str(at / "study.toml"), "--out", str(at / "out"), "--workers", "1"])
    assert code == 0
    return at / "out"


def test_plans_are_shown_while_a_study_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    seen: list[str] = []

    def look(state: StudyProgress) -> None:
        if state.done and not seen:
            assert main(["study", "show", str(tmp_path)]) == 0
            seen.append(capsys.readouterr().out)

    (tmp_path / "study.toml").write_text(STUDY)
    study = Study.read(tmp_path / "study.toml")
    assert study.run(tmp_path, progress=look).complete
    assert "so far" in seen[0]
    assert main(["study", "show", str(tmp_path)]) == 0
    assert "so far" not in capsys.readouterr().out


def test_plans_of_a_run_that_was_killed_are_shown(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    killed = tmp_path / "killed"
    shutil.copytree(folder, killed, ignore=shutil.ignore_patterns("*.parquet"))
    assert main(["study", "show", str(killed), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["plans"], told["success"], told["finished"]) == (18, 9, False)
    assert main(["study", "motion", str(killed), "0", "--out", str(tmp_path / "m.npz")]) == 2
    assert "when its run has ended" in capsys.readouterr().err
    shutil.rmtree(killed / "journal")
    assert main(["study", "show", str(killed)]) == 2
    assert "run the study first" in capsys.readouterr().err


def test_the_command_tells_failures_and_resumes(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["study", "run", str(folder.parent / "study.toml"), "--out", str(folder)]
    assert main(command) == 0
    told = capsys.readouterr()
    assert "18 of 18 done, 0 of them now" in told.out
    assert main([*command[:-1], str(folder.parent / "again")]) == 0
    told = capsys.readouterr()
    assert "failed   9 infeasible" in told.out
    lines = [line for line in told.err.splitlines() if line.startswith("cell")]
    assert len(lines) == 9
    assert all(", infeasible: " in line for line in lines)


def test_the_summary_is_that_of_the_table(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows, found = Study.load(folder), summary(Plans.read(folder))
    minima = rows[rows["success"]]
    assert found["status"] == {"minimum": 9, "infeasible": 9}
    assert found["quantiles"]["cost"] == pytest.approx(
        np.quantile(minima["cost"], [0, 0.25, 0.5, 0.75, 1])
    )
    assert [each["cell"] for each in found["worst"]] == minima.sort_values("cost", ascending=False)[
        "cell"
    ].tolist()
    assert main(["study", "show", str(folder), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == found


def test_pictures_and_a_motion_are_written(folder: Path, tmp_path: Path) -> None:
    names = [tmp_path / name for name in ("h.png", "m.svg", "a.png", "m.npz")]
    show = ["study", "show", str(folder), "--value", "nit"]
    assert main([*show, "--histograms", str(names[0]), "--map", str(names[1])]) == 0
    assert main([*show, "--against", "goal.q[1]", "--map", str(names[2])]) == 0
    assert main(["study", "motion", str(folder), "0", "--out", str(names[3])]) == 0
    assert all(path.stat().st_size > 5_000 for path in names)
    assert "infeasible" not in names[1].read_text()  # where another plan of a place is a minimum


def test_of_plans_at_one_place_the_map_has_the_best(folder: Path, tmp_path: Path) -> None:
    plans = Plans.read(folder)
    assert plans.varying == ("goal.q[0]", "goal.q[1]")
    draw_map(plans, tmp_path / "map.svg")
    draw_histograms(plans, tmp_path / "h.pdf")
    draw_against(plans, "goal.q[0]", tmp_path / "a.svg")


def test_the_page_of_the_worst_motions_has_a_replay_of_each(folder: Path, tmp_path: Path) -> None:
    page, plans = tmp_path / "worst.html", Plans.read(folder)
    assert write_worst(plans, page, count=3) == 3
    text = page.read_text()
    shared, replays = (
        json.loads(line.removeprefix(f"const {name} = ").removesuffix(";"))
        for name in ("SHARED", "REPLAYS")
        for line in text.splitlines()
        if line.startswith(f"const {name} = ")
    )
    assert text.count("</script>") == 1
    for row, pieces in zip(plans.worst(3), replays, strict=True):
        assert f"cell {plans.columns['cell'][row]}:" in text
        own = page_of(Study.motion(folder, plans.columns["key"][row])).offline_html()
        assert "".join(shared[x] if isinstance(x, int) else x for x in pieces) == own
    assert len(text) < 2 * len(own)  # of which each has the viewer


def test_replays_of_one_robot_share_its_meshes() -> None:
    scene = Scene(load_robot("ur5"))
    pages = [page_of(cubic_motion(scene, seed=seed)[0]).offline_html() for seed in (0, 1)]
    shared, replays = shared_pieces(pages)
    own = [sum(len(each) for each in pieces if isinstance(each, str)) for pieces in replays]
    assert max(own) < 0.2 * sum(map(len, shared))  # curves and links' positions


@pytest.mark.parametrize("texts", [[], [""], ["a", "a"], ["x" * 200 + "'b", "'" + "x" * 200]])
def test_pieces_put_together_are_the_texts(texts: list[str]) -> None:
    shared, found = shared_pieces(texts)
    assert [
        "".join(shared[x] if isinstance(x, int) else x for x in each) for each in found
    ] == texts


@pytest.mark.parametrize(
    ("arguments", "what"),
    [
        (["show", "missing"], "there is no plans.parquet in missing"),
        (["show", "FOLDER", "--map", "a.png", "--value", "cots"], "did you mean 'cost'"),
        (["show", "FOLDER", "--map", "a.png", "--value", "status"], "has no numbers"),
        (["show", "FOLDER", "--map", "a.png", "--over", "cost"], "two parameters"),
        (["show", "FOLDER", "--map", "a.txt"], "must end in .png"),
        (["motion", "FOLDER", "99", "--out", "a.npz"], "no plan of cell 99"),
        (["missing.toml", "--out", "FOLDER"], "missing.toml."),
        (["STUDY", "--out", "FOLDER", "--workers", "0"], "workers must be from 1"),
        (["STUDY", "--out", "FOLDER", "--scheduler", "x"], "scheduler must be"),
    ],
)
def test_bad_input_is_one_sentence(
    folder: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], what: str
) -> None:
    places = {"FOLDER": str(folder), "STUDY": str(folder.parent / "study.toml")}
    assert main(["study", *(places.get(each, each) for each in arguments)]) == 2
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert error.startswith("error: ")
    assert what in error


def test_the_state_is_known_while_a_study_runs_and_afterwards(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    seen: list[dict[str, object]] = []

    def look(state: StudyProgress) -> None:
        if state.done and state.failed is None:
            assert main(["study", "state", str(tmp_path), "--json"]) == 0
            seen.append(json.loads(capsys.readouterr().out) | {"known": state.done})

    (tmp_path / "study.toml").write_text(STUDY)
    assert Study.read(tmp_path / "study.toml").run(tmp_path, progress=look).complete
    first, last = seen[0], Study.state(tmp_path)
    assert (first["running"], first["count"]) == (True, 18)
    assert all(int(str(each["known"])) <= int(str(each["done"])) <= 18 for each in seen)
    assert (last.running, last.done, last.count) == (False, 18, 18)
    assert last.status == {"minimum": 9, "infeasible": 9}
    assert last.seconds_left == 0.0
    assert "18 of 18 done, complete" in last.text()
    assert main(["study", "state", str(tmp_path)]) == 0
    assert "9 infeasible" in capsys.readouterr().out


def test_the_state_of_a_run_that_was_killed_is_that_of_its_whole_lines(
    folder: Path, tmp_path: Path
) -> None:
    killed = tmp_path / "killed"
    shutil.copytree(folder, killed, ignore=shutil.ignore_patterns("*.parquet"))
    (lines,) = (killed / "journal").glob("*.lines")
    lines.write_bytes(b"".join(lines.read_bytes().splitlines(keepends=True)[:5])[:-9])
    state = Study.state(killed)
    assert (state.running, state.done, state.count) == (False, 4, 18)
    assert state.text() == "4 of 18 done, no run is working on it"
    old = json.loads((killed / "study.json").read_text())
    del old["count"], old["coordinates"]
    (killed / "study.json").write_text(json.dumps(old))
    assert Study.state(killed).count is None
    assert About.read(killed) is not None
    assert main(["study", "state", str(tmp_path)]) == 2


def test_a_folder_that_is_looked_at_can_be_used(tmp_path: Path) -> None:
    """The look of another process holds the lock for a moment only."""
    with used_alone(tmp_path):
        pass
    with (tmp_path / ".lock").open("rb") as lock:
        fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
        threading.Timer(0.03, fcntl.flock, (lock, fcntl.LOCK_UN)).start()
        with used_alone(tmp_path):
            pass


def test_a_notebook_shows_a_map_that_names_joints_and_units(folder: Path) -> None:
    (ax, colors) = Study.map(folder).axes
    assert ax.get_xlabel() == "shoulder at the goal [rad]"
    assert ax.get_ylabel() == "elbow at the goal [rad]"
    assert colors.get_ylabel() == "cost"
    for figure in (Study.map(folder, value="nit"), Study.histograms(folder)):
        assert figure._repr_png_().startswith(b"\x89PNG")


def test_a_map_of_a_grid_has_a_rectangle_for_each_plan_and_none_overlap() -> None:
    x, y = (each.ravel() for each in np.meshgrid([0.0, 1.0, 4.0], np.linspace(0, 1, 40)))
    order = np.random.default_rng(0).permutation(len(x))
    cells = _Cells.of(x[order], y[order])
    assert sorted(cells.plan.ravel()) == list(range(120))
    for edges, values in zip(cells.edges, ([0.0, 1.0, 4.0], np.linspace(0, 1, 40)), strict=True):
        assert np.all(np.diff(edges) > 0)
        assert np.all((edges[:-1] < values) & (values < edges[1:]))
    _, i = np.unravel_index(np.argsort(cells.plan.ravel()), cells.plan.shape)
    np.testing.assert_array_equal(np.array([0.0, 1.0, 4.0])[i], x[order])


def test_elsewhere_a_point_of_a_map_has_the_nearest_plan() -> None:
    rng = np.random.default_rng(0)
    x, y = rng.uniform(0, 2, 150), rng.uniform(0, 30, 150)
    cells = _Cells.of(x, y)
    at = [(edges[1:] + edges[:-1]) / 2 for edges in cells.edges]
    size = np.ptp(x), np.ptp(y)
    for row, column in rng.integers(0, len(at[0]), (500, 2)):
        apart = np.hypot((x - at[0][column]) / size[0], (y - at[1][row]) / size[1])
        near = apart.min() < FARTHEST / np.sqrt(150)
        assert cells.plan[row, column] == (np.argmin(apart) if near else -1)


def test_a_map_of_a_hundred_thousand_plans_has_no_stripes(folder: Path) -> None:
    """On a grid of 1,000 x 100 every pixel inside is that of a plan."""
    few = Plans.read(folder)
    x, y = (each.ravel().tolist() for each in np.mgrid[0:1:1000j, 0:1:100j])
    count = len(x)
    columns = {
        "goal.q[0]": x,
        "goal.q[1]": y,
        "cost": [1.0 + a for a in x],
        "success": [True] * count,
        "status": ["minimum"] * count,
        "key": [""] * count,
    }
    plans = Plans(folder, columns, ("goal.q[0]", "goal.q[1]"), {}, coordinates=few.coordinates)
    figure = map_of(plans)
    picture = plt_image(figure)
    box = figure.axes[0].get_window_extent()
    height = picture.shape[0]
    rows = slice(int(height - box.y1) + 3, int(height - box.y0) - 3)
    inside = picture[rows, int(box.x0) + 3 : int(box.x1) - 3, :3]
    assert not (inside == 255).all(axis=2).any()


def plt_image(figure: Figure) -> npt.NDArray[np.uint8]:
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())
