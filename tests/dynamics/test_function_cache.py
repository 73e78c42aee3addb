"""Compiled functions equal the interpreted ones, and only libraries built by hovi are loaded."""

from __future__ import annotations

import contextlib
import hashlib
import os
import pickle
import shutil
import stat
import subprocess
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import casadi as ca
import numpy as np
import numpy.typing as npt
import pytest

from hovi import plan, version
from hovi.dynamics import function_cache as module
from hovi.dynamics.function_cache import COMPILERS, CompilationError, compiled, library_folder
from hovi.dynamics.point_function import PointFunction
from hovi.dynamics.symbolic_dynamics import casadi_functions
from hovi.dynamics.torque_model import CasadiTorque
from hovi.effects import Gravity, JointLimitPotential, SceneSymbols
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene
from hovi.system.deadline import Deadline, OutOfTimeError
from hovi.workers.pool import end_idle_workers
from oracles.opened_files import opened_files
from samples.compiled_functions import compile_and_evaluate, function, value_at_one

Array = npt.NDArray[np.float64]

needs_root = pytest.mark.skipif(os.geteuid() != 0, reason="only root gives files away")

EFFECTS = [Gravity(9.8), JointLimitPotential({"elbow": (0.0, np.radians(170.0))})]


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache folder of the test, which does not exist yet."""
    home = tmp_path / "a cache"
    monkeypatch.setenv("XDG_CACHE_HOME", str(home))
    return home


def libraries(cache: Path) -> list[Path]:
    return sorted((cache / "hovi" / "compiled").glob("*.so"))


@contextlib.contextmanager
def new_workers() -> Iterator[None]:
    """Worker processes with the environment of the test, which end with it."""
    end_idle_workers()
    yield
    end_idle_workers()


def without_compiler(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    empty = tmp_path / "empty"
    empty.mkdir()
    monkeypatch.setenv("PATH", str(empty))


def jets(robot: Robot, points: int) -> tuple[Array, Array, Array]:
    random = np.random.default_rng(0)
    q, v, a = (random.normal(scale=3.0, size=(points, robot.nv)) for _ in range(3))
    return q, v, a


def casadi_torque(robot: Robot, compile: bool) -> CasadiTorque:
    sym = ca.SX.sym
    symbols = SceneSymbols(sym("q", robot.nq), sym("v", robot.nv), sym("a", robot.nv), sym("t"))
    model = Scene(robot, [Gravity(9.8)]).model
    tau = casadi_functions(model).inverse_dynamics(symbols.q, symbols.v, symbols.a)
    return CasadiTorque(symbols.columns(), tau, compile)


def assert_same(found: Array, expected: Array) -> None:
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())


def test_a_compiled_scene_has_the_values_and_derivatives_of_an_interpreted_one(
    two_link: Robot,
) -> None:
    jet = jets(two_link, 200)
    interpreted = Scene(two_link, EFFECTS).effort_lagrangian()
    made = Scene(two_link, EFFECTS, compile=True).effort_lagrangian()
    assert_same(made.value(*jet), interpreted.value(*jet))
    for found, expected in zip(made.evaluate(*jet), interpreted.evaluate(*jet), strict=True):
        assert_same(found, expected)


def test_compiled_inverse_dynamics_equals_the_interpreted_one(two_link: Robot) -> None:
    jet, R = jets(two_link, 200), np.array([1.0, 2.0])
    found = casadi_torque(two_link, compile=True).expand(*jet, None, R, None)
    expected = casadi_torque(two_link, compile=False).expand(*jet, None, R, None)
    for one, other in zip(found, expected, strict=True):
        assert_same(one, other)


def test_worker_processes_plan_on_a_compiled_scene(two_link: Robot, cache: Path) -> None:
    def minima(compile: bool) -> tuple[float, ...]:
        scene = Scene(two_link, EFFECTS, compile=compile)
        solution = plan(scene, [0.0, 0.1], [0.4, 0.6], 2.0, intervals=6, starts=3, processes=2)
        assert solution.success
        return solution.minima

    with new_workers():
        assert minima(True) == pytest.approx(minima(False), rel=1e-9)
    assert len(libraries(cache)) == 2  # the value, and the value with its derivatives


def test_a_pickled_scene_and_its_functions_stay_compiled(two_link: Robot) -> None:
    scene = pickle.loads(pickle.dumps(Scene(two_link, EFFECTS, compile=True)))
    assert scene.compile
    torque = casadi_torque(two_link, compile=True)
    copy = pickle.loads(pickle.dumps(torque))
    jet = jets(two_link, 5)
    np.testing.assert_array_equal(copy.torque(*jet), torque.torque(*jet))
    assert copy._torque.function.is_a("External")


def test_compilation_is_described_but_not_stored(
    two_link: Robot,
) -> None:
    scenes = [Scene(two_link, EFFECTS, compile=compile) for compile in (True, False)]
    assert scenes[0].to_dict() == scenes[1].to_dict()
    assert ["machine code" in scene.describe() for scene in scenes] == [True, False]


def test_the_folder_belongs_to_the_user(cache: Path) -> None:
    compiled(function())
    for folder in (cache, cache / "hovi", cache / "hovi" / "compiled"):
        assert stat.S_IMODE(folder.stat().st_mode) == 0o700


def test_read_permission_of_others_is_removed() -> None:
    folder = library_folder()
    folder.chmod(0o755)
    assert stat.S_IMODE(library_folder().stat().st_mode) == 0o700


@pytest.mark.parametrize("suffix", ["", ".sha256"])
@pytest.mark.parametrize("change", ["mode", pytest.param("owner", marks=needs_root)])
def test_a_library_that_others_could_have_written_is_built_again(
    cache: Path, suffix: str, change: str
) -> None:
    compiled(function())
    (library,) = libraries(cache)
    before, file = library.stat().st_ino, Path(f"{library}{suffix}")
    if change == "mode":
        file.chmod(0o620)
    else:
        os.chown(file, 12345, -1)
    assert value_at_one(compiled(function())) == 2.0
    assert library.stat().st_ino != before
    for each in (library, Path(f"{library}.sha256")):
        assert (stat.S_IMODE(each.stat().st_mode), each.stat().st_uid) == (0o600, os.geteuid())


@pytest.mark.parametrize("name", ["hovi", "hovi/compiled"])
@pytest.mark.parametrize("mode", [0o770, 0o720, 0o702, 0o1777])
def test_a_folder_writable_by_others_is_refused(cache: Path, name: str, mode: int) -> None:
    library_folder()
    (cache / name).chmod(mode)
    with pytest.raises(CompilationError, match=rf"{name} may be written to by others.*chmod go-w"):
        compiled(function())
    assert libraries(cache) == []


@pytest.mark.parametrize("mode", [0o777, 0o770, 0o720, 0o702])
@pytest.mark.parametrize("above", ["a cache", "."])
def test_a_folder_above_that_others_can_write_to_is_refused(
    cache: Path, above: str, mode: int
) -> None:
    cache.mkdir()
    folder = cache.parent / above
    folder.chmod(mode)
    with pytest.raises(CompilationError, match="may be written to by others"):
        compiled(function())
    folder.chmod(0o1777)  # as /tmp: entries can be replaced by their owners only
    assert value_at_one(compiled(function())) == 2.0


@needs_root
@pytest.mark.parametrize("above", ["a cache", "."])
def test_a_folder_above_that_belongs_to_somebody_else_is_refused(cache: Path, above: str) -> None:
    cache.mkdir()
    os.chown(cache.parent / above, 12345, -1)
    with pytest.raises(CompilationError, match="belongs to another user"):
        compiled(function())


@pytest.mark.parametrize("change", ["chmod 777 {0}/..", "mv {0} {0}-old; ln -s {0}-old {0}"])
def test_folders_are_checked_again_after_a_build(
    cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: str
) -> None:
    """The compiler stands for whoever changes a folder while it runs."""
    folder, compiler = library_folder(), shutil.which(COMPILERS[0])
    run = f'{compiler} "$@" && case "$1" in -O*) ' + change.format(f"'{folder}'") + ";; esac"
    made = a_compiler(tmp_path / "bin", run)
    monkeypatch.setenv("PATH", f"{made}:{os.environ['PATH']}")
    with pytest.raises(CompilationError, match=r"others|symbolic link|cannot be written"):
        compiled(function())


def test_nothing_is_built_in_the_folder_for_temporary_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    library_folder()
    (tmp_path / "shared").mkdir()
    monkeypatch.setenv("TMPDIR", str(tmp_path / "shared"))
    monkeypatch.setattr(tempfile, "tempdir", None)
    with opened_files(tmp_path / "shared") as opened:
        compiled(function(7.0))
    assert opened == set()


@pytest.mark.parametrize("name", ["hovi", "hovi/compiled"])
def test_a_symbolic_link_as_folder_is_refused(cache: Path, tmp_path: Path, name: str) -> None:
    (cache / name).parent.mkdir(parents=True)
    (tmp_path / "elsewhere").mkdir(mode=0o700)
    (cache / name).symlink_to(tmp_path / "elsewhere")
    with pytest.raises(CompilationError, match="symbolic link"):
        compiled(function())


@needs_root
@pytest.mark.parametrize("name", ["hovi", "hovi/compiled"])
def test_a_folder_of_another_user_is_refused(cache: Path, name: str) -> None:
    library_folder()
    os.chown(cache / name, 12345, -1)
    with pytest.raises(CompilationError, match="belongs to another user"):
        compiled(function())


def test_a_cache_that_cannot_be_created_is_reported(cache: Path) -> None:
    cache.write_text("a file in the way")
    with pytest.raises(CompilationError, match=r"cannot be made \(.*XDG_CACHE_HOME"):
        compiled(function())


def test_a_relative_cache_folder_is_ignored(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert library_folder() == tmp_path / ".cache" / "hovi" / "compiled"


def test_cached_libraries_need_no_compiler(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    compiled(function())
    without_compiler(monkeypatch, tmp_path)
    assert value_at_one(compiled(function())) == 2.0
    with pytest.raises(CompilationError, match=r"needs a C compiler.*compile=False"):
        compiled(function(3.0))


def test_a_missing_compiler_is_reported(
    two_link: Robot, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    without_compiler(monkeypatch, tmp_path)
    scene = Scene(two_link, EFFECTS, compile=True)
    with pytest.raises(CompilationError, match=r"needs a C compiler.*compile=False"):
        plan(scene, [0.0, 0.1], [0.4, 0.6], 2.0)


def test_cached_libraries_are_not_compiled_again(cache: Path) -> None:
    compiled(function())
    (library,) = libraries(cache)
    before = library.stat()
    compiled(function())
    assert library.stat() == before


def test_different_functions_have_different_libraries(cache: Path) -> None:
    assert value_at_one(compiled(function(2.0))) == 2.0
    assert value_at_one(compiled(function(3.0))) == 3.0
    assert len(libraries(cache)) == 2


@pytest.mark.parametrize("part", ["FLAGS", "__version__", "_platform"])
def test_the_name_of_a_library_depends_on_its_inputs(
    cache: Path, monkeypatch: pytest.MonkeyPatch, part: str
) -> None:
    compiled(function())
    changed = {
        "FLAGS": (*module.FLAGS, "-O0"),
        "__version__": "0.0.0",
        "_platform": lambda: ("another", "machine"),
    }
    owner = version if part == "__version__" else module
    monkeypatch.setattr(owner, part, changed[part])
    compiled(function())
    assert len(libraries(cache)) == 2


def planted(folder: Path, source: str) -> bytes:
    """A library with the right name that hovi did not build."""
    (folder / "planted.c").write_text(source)
    subprocess.run(
        ["cc", "-shared", "-fPIC", "-o", "planted.so", "planted.c"], cwd=folder, check=True
    )
    return (folder / "planted.so").read_bytes()


@pytest.mark.parametrize("hash_file", ["as it was", "none", "garbled"])
def test_a_planted_library_is_not_loaded(cache: Path, tmp_path: Path, hash_file: str) -> None:
    made = tmp_path / "made"
    compiled(function())
    (library,) = libraries(cache)
    beside = library.with_name(library.name + ".sha256")
    proof = f'__attribute__((constructor)) void f(void) {{ fclose(fopen("{made}", "w")); }}'
    other = planted(tmp_path, f"#include <stdio.h>\n{proof}")
    library.unlink()  # the first is loaded: never write into it
    library.write_bytes(other)
    if hash_file == "none":
        beside.unlink()
    elif hash_file == "garbled":
        beside.write_bytes(b"\xff\xfe")
    assert value_at_one(compiled(function())) == 2.0
    assert not made.exists()
    assert library.read_bytes() != other
    assert beside.read_text() == hashlib.sha256(library.read_bytes()).hexdigest()


def test_a_library_that_casadi_would_prefer_is_refused(
    cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiled(function())
    (library,) = libraries(cache)
    shadow = Path(f"{tmp_path}/first/{library}")
    shadow.parent.mkdir(parents=True)
    shadow.write_bytes(library.read_bytes())
    monkeypatch.setenv("CASADIPATH", f"/nowhere:{tmp_path}/first")
    with pytest.raises(CompilationError, match="in place of"):
        compiled(function())


def a_compiler(folder: Path, script: str) -> Path:
    folder.mkdir()
    program = folder / COMPILERS[0]
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(0o755)
    return folder


def test_a_failing_compiler_is_reported_with_its_first_error(
    cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    script = 'case "$1" in -O*) echo "no such header" >&2; exit 1;; esac'
    folder = a_compiler(tmp_path / "bin", script)
    monkeypatch.setenv("PATH", str(folder))
    with pytest.raises(CompilationError, match=r"fails on 'f' \(no such header\).*compile=False"):
        compiled(function())
    assert libraries(cache) == []


ENDLESS = """case "$1" in -O*) /bin/sleep 600 & echo $! > "$HOME/child"; wait;; esac"""


def has_not_ended(process: int) -> bool:
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return False
    return state != "Z"


def test_a_compiler_ends_at_the_deadline_with_its_children(
    cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(a_compiler(tmp_path / "bin", ENDLESS)))
    monkeypatch.setenv("HOME", str(tmp_path))
    with Deadline(2.0).in_force(), pytest.raises(OutOfTimeError):
        compiled(function())
    child = int((tmp_path / "child").read_text())
    waited = time.monotonic() + 20.0  # a killed process ends when it is scheduled next
    while has_not_ended(child) and time.monotonic() < waited:
        time.sleep(0.01)
    assert not has_not_ended(child)
    assert [path.name for path in (cache / "hovi" / "compiled").iterdir()] == []


def test_what_is_not_compiled_at_the_deadline_is_interpreted(
    cache: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(a_compiler(tmp_path / "bin", ENDLESS)))
    monkeypatch.setenv("HOME", str(tmp_path))
    with Deadline(1.0).in_force():
        found = PointFunction(function(), compile=True)
    x = np.ones((3, 2))
    np.testing.assert_array_equal(found(x)[0], PointFunction(function())(x)[0])
    assert libraries(cache) == []


def test_a_library_that_does_not_load_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    script = 'while [ $# -gt 0 ]; do [ "$1" = -o ] && echo rubbish > "$2"; shift; done'
    folder = a_compiler(tmp_path / "bin", script)
    monkeypatch.setenv("PATH", str(folder))
    with pytest.raises(CompilationError, match="does not load"):
        compiled(function())


def test_threads_and_processes_can_compile_the_same_function_at_once(cache: Path) -> None:
    with ThreadPoolExecutor(4) as threads:
        assert [value_at_one(f) for f in threads.map(compiled, [function()] * 4)] == [2.0] * 4
    with ProcessPoolExecutor(2, get_context("spawn")) as processes:
        found = list(processes.map(compile_and_evaluate, [5.0] * 4))
    assert found == [5.0] * 4
    assert len(libraries(cache)) == 2
    assert not list((cache / "hovi" / "compiled").glob("*.tmp"))


def test_results_are_bitwise_independent_of_the_number_of_threads(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    x = ca.SX.sym("x", 2)
    y = x
    for _ in range(1000):
        y = ca.sin(y) + ca.cos(y[0])
    x_at = np.random.default_rng(0).normal(size=(1001, 2))
    found = []
    for threads in ("1", "2"):
        monkeypatch.setenv("OMP_NUM_THREADS", threads)
        made = PointFunction(ca.Function("g", [x], [y]), compile=True)
        assert max(count for _, count in made._parts(1001)) == int(threads)
        found.append(made(x_at)[0].tobytes())
    assert found[0] == found[1]
