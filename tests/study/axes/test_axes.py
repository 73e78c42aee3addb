"""What varies: grids, samples, configurations, poses and tables."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import qmc

from hovi.errors import SceneError
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.study.axes.configurations import configurations
from hovi.study.axes.listed import grid, listed
from hovi.study.axes.poses import points_on_grid, poses
from hovi.study.axes.samplers import samples_in_box
from hovi.study.axes.table_columns import table_columns
from hovi.study.cells.field_path import FieldPath

Q, T, GOAL = FieldPath.of("goal.q"), FieldPath.of("duration"), FieldPath.of("goal")
LOW, HIGH = np.array([-1.0, 2.0, 0.0]), np.array([1.0, 5.0, 0.5])


def test_a_grid_has_both_ends() -> None:
    assert list(grid([T], 1.0, 2.0, 5).values) == [(1.0,), (1.25,), (1.5,), (1.75,), (2.0,)]


def test_a_list_of_several_fields_needs_a_value_for_each() -> None:
    assert list(listed([Q, T], [[[1.0], 2.0]]).values) == [([1.0], 2.0)]
    with pytest.raises(SceneError, match="must be a list of 2, one for each, but it is"):
        listed([Q, T], [[1.0, 2.0, 3.0]])


@pytest.mark.parametrize("sampler", ["uniform", "sobol", "latin-hypercube"])
def test_samples_fill_the_box_and_a_seed_gives_them_again(sampler: str) -> None:
    points = samples_in_box(sampler, LOW, HIGH, 256, seed=3)
    assert points.shape == (256, 3)
    assert (points >= LOW).all()
    assert (points <= HIGH).all()
    assert np.abs(points.mean(axis=0) - (LOW + HIGH) / 2).max() < 0.15
    assert np.array_equal(points, samples_in_box(sampler, LOW, HIGH, 256, seed=3))
    assert not np.array_equal(points, samples_in_box(sampler, LOW, HIGH, 256, seed=4))


def test_sobol_and_latin_hypercube_are_more_even_than_uniform_samples() -> None:
    unit = np.zeros(3), np.ones(3)
    spread = {
        name: qmc.discrepancy(samples_in_box(name, *unit, 128, seed=1))
        for name in ("uniform", "sobol", "latin-hypercube")
    }
    assert spread["sobol"] < 0.2 * spread["uniform"]
    assert spread["latin-hypercube"] < spread["uniform"]


def test_random_configurations_are_within_the_limits(ur5: Robot, panda: Robot) -> None:
    for robot in (ur5, panda):
        axis = configurations([Q], robot, 0.5, 50, seed=0, sampler="uniform")
        q = np.array([value for (value,) in axis.values])
        assert q.shape == (50, robot.nq)
        middle, span = (robot.upper + robot.lower) / 2, robot.upper - robot.lower
        allowed = np.where(span < 2 * np.pi, 0.25 * span, 0.5 * np.pi)
        center = np.where(span < 2 * np.pi, middle, 0.0)
        assert (np.abs(q - center) <= allowed + 1e-12).all()


def test_random_angles_of_continuous_joints_are_on_the_circle(models: Path) -> None:
    robot = load_robot("kinova")
    axis = configurations([Q], robot, 1.0, 20, seed=0, sampler="uniform")
    for (q,) in axis.values:
        robot.check_configuration(q, "q")
    assert len({tuple(q) for (q,) in axis.values}) == 20


def test_a_robot_with_an_orientation_has_no_random_configurations(models: Path) -> None:
    robot = load_robot(models / "flying_body.urdf", free_flyer=True)
    with pytest.raises(SceneError, match="joints with orientations"):
        configurations([Q], robot, 1.0, 2, seed=0, sampler="uniform")


def test_poses_are_targets_of_a_frame() -> None:
    points = points_on_grid([0, 0, 1], [1, 2, 3], [2, 3, 1])
    assert len(points) == 6
    assert points[:, 2].tolist() == [2.0] * 6
    axis = poses([GOAL], "tool0", points, {"rpy": [0.0, 1.0, 0.0]}, by_kinematics=True)
    assert axis.values[0] == (
        {"frame": "tool0", "position": [0.0, 0.0, 2.0], "rpy": [0.0, 1.0, 0.0]},
    )
    assert axis.ends == ("goal",)
    with pytest.raises(SceneError, match='need the field "goal" or "start"'):
        poses([Q], "tool0", points, {}, True)


def test_the_columns_of_a_csv_file_are_numbers_where_they_look_like_them(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("T, n,name,on\n1.5,3,a,true\n\n2e0,-4,nan,false\n")
    axis = table_columns(path, {"duration": "T", "seed": "n", "robot": "name", "smooth": "on"})
    assert list(axis.values) == [(1.5, 3, "a", True), (2.0, -4, "nan", False)]


def test_the_columns_of_a_parquet_file_keep_their_types(tmp_path: Path) -> None:
    pa = pytest.importorskip("pyarrow")
    import pyarrow.parquet as pq

    path = tmp_path / "a.parquet"
    pq.write_table(pa.table({"T": [1.5, 2.0], "q": [[0.0, 1.0], [1.0, 2.0]], "n": [1, 2]}), path)
    axis = table_columns(path, {"duration": "T", "goal.q": "q"})
    assert list(axis.values) == [(1.5, [0.0, 1.0]), (2.0, [1.0, 2.0])]
    pq.write_table(pa.table({"T": [1.5, None]}), path)
    with pytest.raises(SceneError, match="row 1 of column 'T' must be a finite number"):
        table_columns(path, {"duration": "T"})


@pytest.mark.parametrize(
    ("name", "content", "what"),
    [
        ("a.csv", b"T\n1\n", "no column 'q'"),
        ("a.csv", b"q,q\n1,2\n", "two columns 'q'"),
        ("a.csv", b"q,b\n1\n", "line 2: 1 values under 2 names"),
        ("a.csv", b"q\n\xff\n", "is not UTF-8"),
        ("a.csv", b'q\n"1\n', "is no .csv file"),
        ("a.csv", b"q\n", "has no values"),
        ("a.csv", b"q\n1\n2.5\n\nn/a\n4\n", "line 5: the other values of column 'q' are numbers"),
        (
            "a.csv",
            b"q,b\n,1\n2,2\n3,3\n",
            "line 2: the other values of column 'q' are numbers, but this one is ''",
        ),
        ("a.csv", b"q\n1\n1e999\n3\n", "'q' are numbers, but this one is '1e999'"),
        ("a.csv", b"q\na\nb\ntrue\n", "'q' are texts, but this one is True"),
        ("a.parquet", b"PAR1 nonsense PAR1", "is no .parquet file"),
        ("a.txt", b"q\n1\n", "must be a .csv or a .parquet file"),
    ],
)
def test_other_tables_are_refused(tmp_path: Path, name: str, content: bytes, what: str) -> None:
    if name.endswith("parquet"):
        pytest.importorskip("pyarrow")
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(SceneError) as raised:
        table_columns(path, {"goal.q": "q"})
    assert what in str(raised.value)
