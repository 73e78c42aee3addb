from __future__ import annotations

import dataclasses
import io
import json
import os
import pickle
import subprocess
import sys
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.output.stored_torque import StoredTorque, chebyshev_points
from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.effects import Gravity
from hovi.errors import HoviWarning, InputError, TrajectoryFileError
from hovi.planning.problem.problem import TrajectoryProblem
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.schemes import by_name, galerkin
from oracles.on_grid import solve_on_grid
from samples.cubic_motion import cubic_motion

Array = npt.NDArray[np.float64]
Entries = dict[str, Any]

SCHEMES = ["galerkin-0", "galerkin-1", "galerkin-2", "galerkin-5", "hermite-simpson"]


@pytest.fixture(scope="module")
def scene(two_link: Robot) -> Scene:
    return Scene(two_link, [Gravity(9.8)])


@pytest.fixture(scope="module")
def motion(scene: Scene) -> Trajectory:
    return with_inner_modes(cubic_motion(scene)[0])


@pytest.fixture
def saved(motion: Trajectory, tmp_path: Path) -> Path:
    motion.save(tmp_path / "motion.npz")
    return tmp_path / "motion.npz"


def with_inner_modes(trajectory: Trajectory) -> Trajectory:
    """The same nodes with a non-cubic acceleration that jumps at the nodes."""
    path = trajectory.path
    inner = np.random.default_rng(3).normal(size=path.inner.shape)
    return dataclasses.replace(trajectory, path=DiscretePath(path.q, path.v, path.z, inner))


# Sampling


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_cubic_is_sampled_exactly(scene: Scene, scheme: str) -> None:
    trajectory, cubic = cubic_motion(scene, schemes=[scheme] * 5)
    t = np.linspace(0.0, 2.0, 501)
    for got, wanted in zip(trajectory.sample(t)[:3], cubic(t), strict=True):
        np.testing.assert_allclose(got, wanted, rtol=0, atol=2e-14)


def test_intervals_can_differ_in_length_and_scheme(scene: Scene) -> None:
    steps = np.array([0.3, 0.05, 0.9, 0.4, 0.35])
    trajectory, cubic = cubic_motion(scene, schemes=SCHEMES, steps=steps)
    t = np.random.default_rng(1).uniform(0.0, 2.0, 400)  # in no order
    for got, wanted in zip(trajectory.sample(t)[:3], cubic(t), strict=True):
        np.testing.assert_allclose(got, wanted, rtol=0, atol=1e-13)


def test_v_and_a_are_derivatives_of_q(motion: Trajectory) -> None:
    s, h = chebyshev_points(8), motion.grid.steps[3]
    q, v, a, _ = motion.sample_intervals(np.full(8, 3), s)
    differentiate = np.polynomial.polynomial
    for values, wanted in ((q, v), (v, a)):
        polynomial = differentiate.polyfit(s, values, 7)
        derivative = differentiate.polyval(s, differentiate.polyder(polynomial)).T / h
        np.testing.assert_allclose(derivative, wanted, atol=1e-9)


def test_torques_match_rnea(motion: Trajectory) -> None:
    q, v, a, tau = motion.sample(np.linspace(0.0, 2.0, 40))
    model = motion.robot.model.copy()  # type: ignore[union-attr]
    model.gravity.linear = np.array([0.0, 0.0, -9.8])
    data = model.createData()
    wanted = [pin.rnea(model, data, *point) for point in zip(q, v, a, strict=True)]
    np.testing.assert_allclose(tau, wanted, rtol=0, atol=1e-12)


def test_nodes_are_sampled_from_the_right_and_the_end_from_the_left(motion: Trajectory) -> None:
    N = motion.grid.intervals
    right = motion.sample_intervals(np.arange(N), np.zeros(N))
    left = motion.sample_intervals(np.arange(N), np.ones(N))
    at_nodes = motion.sample(motion.t)
    assert np.abs(right.a[1:] - left.a[:-1]).min() > 0.1
    np.testing.assert_array_equal(at_nodes.a[:-1], right.a)
    np.testing.assert_array_equal(at_nodes.a[-1], left.a[-1])
    np.testing.assert_array_equal(at_nodes.q[:-1], motion.q[:-1])
    np.testing.assert_allclose(at_nodes.q[-1], motion.q[-1], atol=1e-15)


@pytest.mark.parametrize(
    ("k", "s"), [(0, -1e-9), (0, 1.0 + 1e-9), (0, np.nan), (-1, 0.5), (1000, 0.5), (0.5, 0.5)]
)
def test_positions_outside_an_interval_are_refused(motion: Trajectory, k: float, s: float) -> None:
    for values in (([k], [s]), ([k, 0], [s, 0.5])):
        with pytest.raises(InputError, match=r"numbers of intervals, 0 to 4, and s positions|s "):
            motion.sample_intervals(*values)


def test_configurations_match_sample(motion: Trajectory) -> None:
    t = np.linspace(0.0, 2.0, 33)
    np.testing.assert_array_equal(motion.configurations(t), motion.sample(t).q)


def test_scalar_and_empty_times_are_accepted(motion: Trajectory) -> None:
    assert [x.shape for x in motion.sample(1.0)] == [(1, 2)] * 4
    assert [x.shape for x in motion.sample([])] == [(0, 2)] * 4


@pytest.mark.parametrize("t", [-1e-9, 2.0 + 1e-9, np.nan, np.inf, [[0.0]]])
def test_times_outside_the_motion_are_refused(motion: Trajectory, t: float) -> None:
    with pytest.raises(InputError, match=r"times must be|motion lasts"):
        motion.sample(t)


def test_rounding_at_the_end_is_tolerated(motion: Trajectory) -> None:
    q = motion.sample(np.nextafter(2.0, 3.0)).q
    np.testing.assert_array_equal(q, motion.sample(2.0).q)


def test_arrays_of_the_wrong_shape_are_refused(motion: Trajectory) -> None:
    with pytest.raises(InputError, match="momenta has shape"):
        dataclasses.replace(motion, momenta=motion.momenta[1:])
    path = dataclasses.replace(motion.path, inner=motion.path.inner[:, :1])
    with pytest.raises(InputError, match="inner has shape"):
        dataclasses.replace(motion, path=path)
    with pytest.raises(InputError, match="scene"):
        dataclasses.replace(motion, scene=None)


# Files


def test_a_loaded_motion_equals_the_saved_one(motion: Trajectory, saved: Path) -> None:
    loaded, t = Trajectory.load(saved), np.linspace(0.0, 2.0, 77)
    for got, wanted in zip(loaded.sample(t), motion.sample(t), strict=True):
        np.testing.assert_array_equal(got, wanted)
    np.testing.assert_array_equal(loaded.momenta, motion.momenta)
    assert loaded.coordinate_names == ("shoulder", "elbow")
    assert loaded.metadata["cost"] == 1.0
    assert loaded.metadata["versions"]["pin"] == pin.__version__


def test_every_scheme_name_survives(scene: Scene, tmp_path: Path) -> None:
    names = [*SCHEMES, *SCHEMES[::-1], "taylor-midpoint"]
    cubic_motion(scene, schemes=names)[0].save(tmp_path / "motion.npz")
    loaded = Trajectory.load(tmp_path / "motion.npz")
    assert [scheme.name for scheme in loaded.grid.schemes] == names


def test_saving_a_loaded_motion_gives_the_same_bytes(saved: Path, tmp_path: Path) -> None:
    Trajectory.load(saved).save(tmp_path / "again.npz")
    assert (tmp_path / "again.npz").read_bytes() == saved.read_bytes()


def test_another_process_writes_the_same_bytes(saved: Path, tmp_path: Path) -> None:
    again = tmp_path / "again.npz"
    load_and_save = (
        "from hovi.discrete.trajectory import Trajectory as T; T.load(argv[1]).save(argv[2])"
    )
    code = f"from sys import argv; {load_and_save}"
    environment = {**os.environ, "PYTHONHASHSEED": "7", "TZ": "Asia/Tokyo"}
    subprocess.run([sys.executable, "-c", code, saved, again], check=True, env=environment)
    assert again.read_bytes() == saved.read_bytes()


def test_numpy_opens_the_file_without_pickle(motion: Trajectory, saved: Path) -> None:
    with np.load(saved, allow_pickle=False) as file:
        np.testing.assert_array_equal(file["q"], motion.q)
        assert json.loads(file["header"].tobytes())["format"] == "hovi-trajectory"


def test_the_file_contains_no_local_path(saved: Path) -> None:
    assert str(Path.home()).encode() not in saved.read_bytes()
    assert str(Path(__file__).parents[2]).encode() not in saved.read_bytes()


def test_a_failed_save_keeps_the_existing_file(
    motion: Trajectory, saved: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = saved.read_bytes()

    def fail(*args: object, **options: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np.lib.format, "write_array", fail)
    with pytest.raises(TrajectoryFileError, match="No space left on device"):
        motion.save(saved)
    assert saved.read_bytes() == before
    assert list(saved.parent.iterdir()) == [saved]


def test_paths_that_cannot_be_written_are_reported(motion: Trajectory, tmp_path: Path) -> None:
    with pytest.raises(TrajectoryFileError, match="No such file or directory"):
        motion.save(tmp_path / "no" / "motion.npz")
    with pytest.raises(TrajectoryFileError, match="not a regular file"):
        motion.save(tmp_path)


def test_metadata_that_is_not_json_is_refused(motion: Trajectory, tmp_path: Path) -> None:
    for value in (float("nan"), object()):
        with pytest.raises(TrajectoryFileError, match="JSON"):
            dataclasses.replace(motion, metadata={"x": value}).save(tmp_path / "motion.npz")
    assert not list(tmp_path.iterdir())


def test_a_scheme_that_its_name_does_not_restore_is_refused(scene: Scene, tmp_path: Path) -> None:
    trajectory, _ = cubic_motion(scene)
    own = dataclasses.replace(by_name("galerkin-2"), name="mine")
    grid = dataclasses.replace(trajectory.grid, schemes=(own,) * 7)
    with pytest.raises(TrajectoryFileError, match="'mine'"):
        dataclasses.replace(trajectory, grid=grid).save(tmp_path / "motion.npz")


# Files from strangers


def entries(path: Path) -> Entries:
    with np.load(path, allow_pickle=False) as file:
        contents = dict(file)
    contents["header"] = json.loads(contents["header"].tobytes())
    return contents


def rewrite(path: Path, contents: Entries) -> None:
    text = json.dumps(contents.pop("header"))
    np.savez(path, header=np.frombuffer(text.encode(), np.uint8), **contents)


def edited(key: str, value: Any) -> Callable[[Entries], None]:
    return lambda contents: contents["header"].__setitem__(key, value)


def array(name: str, change: Callable[[Array], Any]) -> Callable[[Entries], None]:
    return lambda contents: contents.__setitem__(name, change(contents[name]))


def spoil(value: float) -> Callable[[Array], Array]:
    return lambda x: np.where(np.arange(x.size).reshape(x.shape) == 3, value, x)


BROKEN: dict[str, tuple[Callable[[Entries], object], str]] = {
    "missing array": (lambda c: c.pop("z"), "lacks the entry 'z'"),
    "one node too few": (array("q", lambda x: x[1:]), "q has shape"),
    "another number of joints": (array("v", lambda x: x[:, :1]), "v has shape"),
    "flat": (array("z", np.ravel), "z has shape"),
    "a step too many": (array("steps", lambda x: np.append(x, 0.1)), "one scheme per interval"),
    "negative step": (array("steps", lambda x: -x), "positive"),
    "NaN": (array("q", spoil(np.nan)), "'q': holds numbers that are not finite"),
    "inner modes beyond any motion": (
        array("inner", spoil(1e300)),
        r"inner has 1e\+300, beyond the largest number",
    ),
    "velocities beyond any motion": (array("v", spoil(-1e200)), r"v has 1e\+200, beyond"),
    "infinite": (array("momenta", spoil(np.inf)), "not finite"),
    "single precision": (array("q", lambda x: x.astype(np.float32)), "expected float64"),
    "text for numbers": (array("q", lambda x: x.astype(str)), "expected float64"),
    "Fortran order": (array("q", np.asfortranarray), "C order"),
    "unknown scheme": (edited("schemes", [["galerkin-x", 7]]), "no scheme 'galerkin-x'"),
    "huge scheme": (edited("schemes", [["galerkin-9999", 7]]), "more inner modes"),
    "more schemes than intervals": (edited("schemes", [["galerkin-2", 10**6]]), "more schemes"),
    "negative count": (edited("schemes", [["galerkin-2", -7]]), "not a scheme's name"),
    "schemes of another kind": (edited("schemes", 3), "schemes are not a list"),
    "another hash": (edited("scene_sha256", "0" * 64), "SHA-256"),
    "another URDF": (lambda c: c["header"]["scene"]["robot"].update(urdf="<robot/>"), "SHA-256"),
    "no scene": (edited("scene", None), "coordinates"),
    "a scene of another kind": (edited("scene", []), "SHA-256"),
    "another format": (edited("format", "something"), "not a hovi trajectory"),
    "a later version": (edited("version", 3), "format version 3"),
    "no metadata": (lambda c: c["header"].pop("metadata"), "lacks 'metadata'"),
    "NaN in the metadata": (edited("metadata", {"cost": np.nan}), "NaN is not a finite number"),
    "a node that does not follow": (array("q", spoil(0.5)), "q at the end of interval"),
    "a velocity that does not follow": (
        array("v", lambda x: np.vstack([x[:-1], x[-1:] + 1])),
        "v at the end of interval",
    ),
    "steps of no length": (array("steps", lambda x: 0 * x + 1e-300), "between 1e-12 and"),
    "metadata of another kind": (edited("metadata", []), "metadata is not a table"),
    "other momenta": (array("momenta", lambda x: x + 1e-9), "contents do not match"),
    "momenta of another sign": (array("momenta", np.negative), "contents do not match"),
    "other inner modes": (array("inner", lambda x: 1.001 * x), "contents do not match"),
    "another scheme": (
        edited("schemes", [["galerkin-1", 7]]),
        "contents do not match",
    ),
    "another cost": (edited("metadata", {"cost": 0.5}), "contents do not match"),
    "another hash of the contents": (edited("sha256", "0" * 64), "contents do not match"),
    "a hash of another kind": (edited("sha256", None), "contents do not match"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_inconsistent_files_are_refused(saved: Path, name: str) -> None:
    contents, (change, sentence) = entries(saved), BROKEN[name]
    change(contents)
    rewrite(saved, contents)
    with pytest.raises(TrajectoryFileError, match=sentence):
        Trajectory.load(saved)


@pytest.mark.parametrize("content", [b"", b"hello", b"\x93NUMPY" * 100, b"\0" * 10_000])
def test_files_of_another_kind_are_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "motion.npz"
    path.write_bytes(content)
    with pytest.raises(TrajectoryFileError, match=r"'motion\.npz' is not a motion: expected"):
        Trajectory.load(path)


@pytest.mark.parametrize("content", [b"PK", b"PK\x03\x04" * 100])
def test_an_incomplete_archive_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "motion.npz"
    path.write_bytes(content)
    with pytest.raises(TrajectoryFileError, match=r"'motion\.npz' is not a complete npz file"):
        Trajectory.load(path)


def test_a_missing_file_and_a_folder_are_refused(tmp_path: Path) -> None:
    with pytest.raises(TrajectoryFileError, match="there is no"):
        Trajectory.load(tmp_path / "motion.npz")
    with pytest.raises(TrajectoryFileError, match="that is a folder"):
        Trajectory.load(tmp_path)


def test_a_truncated_file_is_refused(saved: Path) -> None:
    whole = saved.read_bytes()
    for length in np.linspace(0, len(whole) - 1, 40).astype(int):
        saved.write_bytes(whole[:length])
        with pytest.raises(TrajectoryFileError):
            Trajectory.load(saved)


def test_a_flipped_byte_is_refused_or_harmless(motion: Trajectory, saved: Path) -> None:
    whole = saved.read_bytes()
    for place in np.random.default_rng(5).integers(0, len(whole), 150):
        damaged = bytearray(whole)
        damaged[place] ^= 0x55
        saved.write_bytes(damaged)
        try:
            loaded = Trajectory.load(saved)
        except TrajectoryFileError:
            continue
        for name in ("q", "v", "momenta", "t"):  # a byte that says nothing
            np.testing.assert_array_equal(getattr(loaded, name), getattr(motion, name))


def test_a_file_without_a_hash_of_its_contents_loads_with_a_warning(
    motion: Trajectory, saved: Path
) -> None:
    contents = entries(saved)
    del contents["header"]["sha256"]  # as by an earlier version
    rewrite(saved, contents)
    with pytest.warns(HoviWarning, match="no SHA-256 of its contents"):
        loaded = Trajectory.load(saved)
    np.testing.assert_array_equal(loaded.momenta, motion.momenta)


def test_metadata_that_json_changes_are_those_of_the_hash(
    motion: Trajectory, tmp_path: Path
) -> None:
    metadata = {"a": {10: (1, 2), 2: -0.0, None: 1e300, "\u20ac": 2**70}, "b": "\ud800"}
    dataclasses.replace(motion, metadata=metadata).save(tmp_path / "motion.npz")
    loaded = Trajectory.load(tmp_path / "motion.npz")
    assert loaded.metadata["a"] == {"10": [1, 2], "2": 0.0, "null": 1e300, "\u20ac": 2**70}


def replace_entry(path: Path, name: str, data: bytes) -> None:
    with zipfile.ZipFile(path) as old:
        contents = {n: old.read(n) for n in old.namelist()}
    contents[name] = data
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as new:
        for n, d in contents.items():
            new.writestr(n, d)


def npy(header: str, data: bytes = b"") -> bytes:
    padded = header.encode() + b"\n"
    return b"\x93NUMPY\x01\x00" + len(padded).to_bytes(2, "little") + padded + data


@pytest.mark.parametrize(
    "shape",
    [
        *("(10**18, 2)", "(1000000000000, 2)", "(-1, 2)", "(3, 2)", "(2,)", "'x'"),
        *("(True, 3)", "(3, True)", f"({'1, ' * 70}3)", "(3, 1.0)", "((), 3)"),
    ],
)
def test_a_shape_that_does_not_match_the_data_is_refused(saved: Path, shape: str) -> None:
    header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}"
    replace_entry(saved, "q.npy", npy(header, b"\0" * 24))
    with pytest.raises(TrajectoryFileError, match="'q'"):
        Trajectory.load(saved)


def test_a_pickle_is_never_opened(saved: Path, tmp_path: Path) -> None:
    class Bomb:
        def __reduce__(self) -> tuple[Any, ...]:
            return (Path.touch, (tmp_path / "ran",))

    header = "{'descr': '|O', 'fortran_order': False, 'shape': (8, 2), }"
    replace_entry(saved, "q.npy", npy(header, pickle.dumps(Bomb())))
    with pytest.raises(TrajectoryFileError, match="expected float64"):
        Trajectory.load(saved)
    assert not (tmp_path / "ran").exists()


def test_a_file_that_unpacks_to_too_much_is_refused(
    saved: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hovi.discrete.trajectory_file.MAX_BYTES", 50_000)
    replace_entry(saved, "q.npy", b"\0" * 10_000_000)
    with pytest.raises(TrajectoryFileError, match="more than the 50000 allowed"):
        Trajectory.load(saved)


def test_a_header_that_unpacks_to_too_much_is_refused(
    saved: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hovi.discrete.trajectory_file.MAX_HEADER_BYTES", 50_000)
    replace_entry(saved, "header.npy", b"\0" * 10_000_000)
    with pytest.raises(TrajectoryFileError, match="a header of 10000000 bytes, more than the 50"):
        Trajectory.load(saved)


def test_a_small_file_that_unpacks_to_a_large_one_is_refused(saved: Path) -> None:
    replace_entry(saved, "q.npy", b"\0" * 50_000_000)
    with pytest.raises(TrajectoryFileError, match="would unpack to 500"):
        Trajectory.load(saved)


def test_a_header_of_millions_of_lists_is_refused_unread(saved: Path) -> None:
    stream = io.BytesIO()
    np.lib.format.write_array(stream, np.frombuffer(b"[],[" * 10**6, np.uint8), version=(1, 0))
    replace_entry(saved, "header.npy", stream.getvalue())
    with pytest.raises(TrajectoryFileError, match="more than 2,000,000 parts"):
        Trajectory.load(saved)


def test_a_header_with_an_infinite_number_is_refused(saved: Path) -> None:
    text = b'{"format": "hovi-trajectory", "version": 1, "cost": 1e999}'
    stream = io.BytesIO()
    np.lib.format.write_array(stream, np.frombuffer(text, np.uint8), version=(1, 0))
    replace_entry(saved, "header.npy", stream.getvalue())
    with pytest.raises(TrajectoryFileError, match="1e999 is not a finite number"):
        Trajectory.load(saved)


def test_a_duplicate_entry_is_refused(saved: Path) -> None:
    with warnings.catch_warnings(), zipfile.ZipFile(saved, "a") as archive:
        warnings.simplefilter("ignore")  # zipfile's own, about the duplicate
        archive.writestr("q.npy", archive.read("q.npy"))
    with pytest.raises(TrajectoryFileError, match="an entry occurs twice"):
        Trajectory.load(saved)


def test_a_motion_too_large_to_load_is_not_saved(
    motion: Trajectory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hovi.discrete.trajectory_file.MAX_BYTES", 1_000)
    with pytest.raises(TrajectoryFileError, match="at most 1000"):
        motion.save(tmp_path / "motion.npz")


def test_a_deeply_nested_header_is_refused(saved: Path) -> None:
    stream = io.BytesIO()
    np.lib.format.write_array(stream, np.frombuffer(b"[" * 200_000, np.uint8), version=(1, 0))
    replace_entry(saved, "header.npy", stream.getvalue())
    with pytest.raises(TrajectoryFileError, match="JSON"):
        Trajectory.load(saved)


# Robots without a text


@pytest.fixture(scope="module")
def model_motion(two_link: Robot) -> Trajectory:
    robot = load_robot(two_link.model)
    return with_inner_modes(cubic_motion(Scene(robot, [Gravity(9.8)]))[0])


def test_torques_of_a_given_model_survive_without_it(
    model_motion: Trajectory, tmp_path: Path
) -> None:
    path = tmp_path / "motion.npz"
    model_motion.save(path)
    loaded, t = Trajectory.load(path), np.linspace(0.0, 2.0, 301)
    assert loaded.scene is None
    assert loaded.coordinate_names == ("shoulder", "elbow")
    for got, wanted in zip(loaded.sample(t), model_motion.sample(t), strict=True):
        np.testing.assert_allclose(got, wanted, rtol=0, atol=1e-11)
    loaded.save(tmp_path / "again.npz")
    assert (tmp_path / "again.npz").read_bytes() == path.read_bytes()


@pytest.mark.parametrize("names", [None, ["shoulder"], ["shoulder", 2], "ab"])
def test_invalid_names_are_refused(model_motion: Trajectory, tmp_path: Path, names: Any) -> None:
    path = tmp_path / "motion.npz"
    model_motion.save(path)
    contents = entries(path)
    contents["header"]["metadata"]["coordinates"] = names
    rewrite(path, contents)
    with pytest.raises(TrajectoryFileError, match="names of"):
        Trajectory.load(path)


def test_stored_torques_interpolate_and_reproduce_jumps() -> None:
    values = np.random.default_rng(0).normal(size=(3, 9, 2))
    torque, s = StoredTorque(values), chebyshev_points(9)
    for k in range(3):
        np.testing.assert_array_equal(torque(np.full(9, k), s), values[k])


def test_the_full_duration_can_be_sampled_on_nonuniform_grids(scene: Scene) -> None:
    # seven of ten intervals in thirteen pieces: their sum lacks ten units of rounding
    grid = Grid(np.repeat([0.15, 0.15 / 13], [3, 91]), (galerkin(2),) * 94)
    assert grid.duration < 1.5 * (1 - 9 * np.finfo(float).eps)
    ld = DiscreteLagrangian(scene.effort_lagrangian(), grid)
    uneven = solve_on_grid(TrajectoryProblem(ld, State([0.0, 0.0]), State([0.3, 0.1]))).trajectory
    np.testing.assert_allclose(uneven.sample(1.5).q[0], [0.3, 0.1], atol=1e-12)
    with pytest.raises(InputError, match="the motion lasts from 0 to"):
        uneven.sample(1.5 + 1e-12)


def test_a_file_is_the_same_on_every_system(saved: Path) -> None:
    """Members are readable by all, as on Unix, with a fixed date."""
    with zipfile.ZipFile(saved) as archive:
        for member in archive.infolist():
            assert member.external_attr == 0o644 << 16
            assert member.create_system == 3
            assert member.date_time == (1980, 1, 1, 0, 0, 0)
            assert member.compress_type == zipfile.ZIP_STORED


def test_arrays_in_any_order_of_memory_are_the_same_path(motion: Trajectory, scene: Scene) -> None:
    path, ld = motion.path, DiscreteLagrangian(scene.effort_lagrangian(), motion.grid)
    other = DiscretePath(*(np.asfortranarray(array) for array in path.arrays))
    strided = DiscretePath(*(np.repeat(array, 2, axis=0)[::2] for array in path.arrays))
    for each in (other, strided):
        assert all(array.flags.c_contiguous for array in each.arrays)
        np.testing.assert_array_equal(ld.values(each), ld.values(path))


@pytest.mark.parametrize("shape", [(3, 2, 1), (1, 5, 1), (3, 2, 4)])
def test_stored_torques_need_two_points_and_any_number_of_joints(shape: tuple[int, ...]) -> None:
    values = np.random.default_rng(1).normal(size=shape)
    torque = StoredTorque(values)
    np.testing.assert_array_equal(torque(np.zeros(2, dtype=int), np.array([0.0, 1.0])),
                                  values[0, [0, -1]])  # fmt: skip
    with pytest.raises(InputError, match="2 or more points"):
        StoredTorque(values[:, :1])
    with pytest.raises(InputError, match="2 or more points"):
        StoredTorque(values[0])
