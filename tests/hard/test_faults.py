"""Environment faults: kills, full disks, closed pipes, Ctrl-C, no home, no browser.

Real processes throughout; each ends with a sentence on stderr, an exit code and no partial file.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

import hovi
from hovi.cli.application import main
from hovi.discrete.trajectory import Trajectory
from hovi.errors import TrajectoryFileError
from hovi.system.files import whole_file

KILL_SCRIPT = """
import os, random, signal, sys, time
from pathlib import Path
from hovi.system.files import whole_file

folder, random = Path(sys.argv[1]), random.Random(3)
target, old, new = folder / "file", b"old" * 10**6, b"new" * 10**6
for trial in range(int(sys.argv[2])):
    target.write_bytes(old)
    child = os.fork()
    if child == 0:
        while True:
            with whole_file(target) as stream:
                for begin in range(0, len(new), 30_000):
                    stream.write(new[begin : begin + 30_000])
    time.sleep(random.uniform(0.0, 0.02))
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    assert target.read_bytes() in (old, new), "a partial file has the name"
    rest = [path for path in folder.iterdir() if path != target]
    # Between the last two calls a complete copy may still have its temporary name.
    assert all(path.read_bytes() == new for path in rest), "a partial file is left"
    for path in rest:
        path.unlink()
print("kills", trial + 1)
"""


@pytest.fixture(scope="module")
def motion(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("motion") / "reach.npz"
    assert main(["plan", "two_link_reach", "--out", str(path)]) == 0
    return path


def start(
    *arguments: str | Path, file_size: int | None = None, **environment: str
) -> subprocess.Popen[str]:
    """Start a command as from a shell, with files limited to `file_size` bytes."""

    def limit() -> None:
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # ignored in background jobs of a shell
        if file_size is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (file_size, file_size))

    return subprocess.Popen(
        [sys.executable, "-m", "hovi", *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        stdin=subprocess.DEVNULL,
        text=True,
        env={**os.environ, **environment},
        preexec_fn=limit,
        start_new_session=True,
    )


def one_sentence(stderr: str) -> str:
    """The error message, checked to be one sentence."""
    assert "Traceback" not in stderr
    assert stderr.startswith("error: ")
    assert stderr.count("\n") == 1
    return stderr


def test_a_killed_process_leaves_no_partial_file(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", KILL_SCRIPT, tmp_path, "100"],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.stdout == "kills 100\n", done.stderr


def test_a_file_gets_its_name_when_it_is_complete(tmp_path: Path) -> None:
    with whole_file(tmp_path / "file") as stream:
        stream.write(b"half")
        stream.flush()
        assert list(tmp_path.iterdir()) == []
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_file_system_without_unnamed_files_gets_a_temporary_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hovi.system.files._DESCRIPTORS", tmp_path / "no proc")
    with whole_file(tmp_path / "file") as stream:
        stream.write(b"whole")
        assert [path.suffix for path in tmp_path.iterdir()] == [".tmp"]
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
    with contextlib.suppress(ZeroDivisionError), whole_file(tmp_path / "file") as stream:
        stream.write(b"half")
        raise ZeroDivisionError
    assert (tmp_path / "file").read_bytes() == b"whole"
    assert len(list(tmp_path.iterdir())) == 1


WRITING_COMMANDS: dict[str, Sequence[str]] = {
    "plan": ("plan", "two_link_reach", "--out", "{folder}/motion.npz"),
    "simulate": ("simulate", "two_link_reach", "--out", "{folder}/motion.npz"),
    "plot": ("plot", "{motion}", "--out", "{folder}/picture.png"),
    "export": ("export", "{motion}", "--csv", "{folder}/table.csv"),
    "replay": ("replay", "{motion}", "--html", "{folder}/page.html"),
}


@pytest.mark.parametrize("command", WRITING_COMMANDS)
def test_a_full_disk_gives_one_sentence_and_no_file(
    command: str, motion: Path, tmp_path: Path
) -> None:
    words = [word.format(motion=motion, folder=tmp_path) for word in WRITING_COMMANDS[command]]
    process = start(*words, file_size=3_000)
    out, err = process.communicate(timeout=120)
    assert "File too large" in one_sentence(err)
    assert process.returncode == 2
    assert list(tmp_path.iterdir()) == []
    assert ("cost" in out) == (command == "plan")  # the result is printed nevertheless


def test_a_full_file_system_keeps_the_old_motion(motion: Path, tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(disk)]
    if subprocess.run(mount, capture_output=True, check=False).returncode != 0:
        pytest.skip("only root may mount a small disk")
    try:
        trajectory, target = Trajectory.load(motion), disk / "motion.npz"
        trajectory.save(target)
        before = target.read_bytes()
        (disk / "rest").write_bytes(b"x" * (shutil.disk_usage(disk).free - 4096))
        with pytest.raises(TrajectoryFileError, match="No space left on device"):
            trajectory.save(target)
        assert target.read_bytes() == before
        assert sorted(path.name for path in disk.iterdir()) == ["motion.npz", "rest"]
    finally:
        subprocess.run(["umount", str(disk)], check=True)


@pytest.mark.parametrize("arguments", [("info", "two_link_reach"), ("plan", "two_link_reach")])
def test_a_full_output_device_gives_one_sentence(arguments: Sequence[str]) -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "hovi", *arguments],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            timeout=120,
        )
    assert "No space left on device" in one_sentence(done.stderr)
    assert done.returncode in (1, 2)


def test_a_closed_pipe_is_silent() -> None:
    with start("info", "two_link_reach") as process:
        assert process.stdout is not None
        process.stdout.close()
        assert process.stderr is not None
        assert process.stderr.read() == ""
    assert process.returncode == 1


LONG_COMMANDS: dict[str, Sequence[str]] = {
    "plan": ("plan", "two_link_swing_up", "--starts", "400"),
    "plan --json": ("plan", "two_link_swing_up", "--starts", "400", "--json"),
    "simulate": ("simulate", "two_link_reach", "--duration", "3000", "--out", "{folder}/m.npz"),
    "export": ("export", "{motion}", "--csv", "{folder}/table.csv", "--rate", "5e6"),
    "replay": ("replay", "{motion}", "--no-browser"),
    "replay --loop": ("replay", "{motion}", "--no-browser", "--loop"),
    "info": ("info", "talos"),
    "plot": ("plot", "{motion}", "--out", "{folder}/picture.png"),
}


@pytest.mark.parametrize("command", LONG_COMMANDS)
@pytest.mark.parametrize(
    "seconds", [1.0, *(pytest.param(each, marks=pytest.mark.long) for each in (0.3, 0.6, 2.0, 4.0))]
)
def test_ctrl_c_ends_every_command_without_a_traceback(
    command: str, seconds: float, motion: Path, tmp_path: Path
) -> None:
    words = [word.format(motion=motion, folder=tmp_path) for word in LONG_COMMANDS[command]]
    process = start(*words)
    time.sleep(seconds)
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does, worker processes included
    _, err = process.communicate(timeout=60)
    assert "Traceback" not in err
    assert "Exception" not in err
    assert process.returncode in (0, 1, 130)
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


SEVERAL_SOLVES: dict[str, Sequence[str]] = {
    "rounds among obstacles": ("plan", "{scene}", "--intervals", "100"),
    "grids to a tolerance": (
        *("plan", "panda_reach_rich", "--starts", "1", "--tolerance", "1e-8"),
        "--self-collision",  # or it may be over before the signal
    ),
}
BALL_ON_THE_WAY = """
robot = "ur5"
duration = 2.0
limits = "none"
obstacles = [{ kind = "sphere", position = [0.45, 0.25, 0.69], radius = 0.1 }]

[start]
q = [0.0, -1.2, 1.2, -0.5, 0.3, 0.1]

[goal]
frame = "tool0"
position = [0.45, 0.25, 0.2]
axis = { frame = [0, 0, 1], world = [0, 0, -1] }

[[via]]
time = 1.0
frame = "tool0"
position = [0.45, 0.25, 0.55]
axis = { frame = [0, 0, 1], world = [0, 0, -1] }
"""
"""On the way the ball is where the wrist would be: the search tries one solve after another."""


@pytest.mark.parametrize("command", SEVERAL_SOLVES)
def test_one_ctrl_c_ends_a_plan_of_many_solves(command: str, tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(BALL_ON_THE_WAY)
    words = [word.format(scene=scene) for word in SEVERAL_SOLVES[command]]
    process = start(*words)
    while _processor_seconds(process.pid) < 2.5:  # imports are over, at any load of the machine
        assert process.poll() is None
        time.sleep(0.05)
    os.kill(process.pid, signal.SIGINT)
    try:
        out, err = process.communicate(timeout=30)
    finally:
        process.kill()
    assert "Traceback" not in err
    assert process.returncode == 1
    assert out.startswith("status   interrupted\n")
    assert "the best so far" in out or "was interrupted" in out


def _processor_seconds(pid: int) -> float:
    """Processor time of a process so far, in [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def test_an_unwritable_home_is_tolerated(motion: Path, tmp_path: Path) -> None:
    process = start(
        *("plot", motion, "--out", tmp_path / "picture.png"),
        HOME="/proc/nowhere",
        XDG_CACHE_HOME="/proc/nowhere",
        XDG_CONFIG_HOME="/proc/nowhere",
        MPLCONFIGDIR="",
    )
    out, err = process.communicate(timeout=120)
    assert process.returncode == 0
    assert out.startswith(f"wrote {tmp_path / 'picture.png'}\n")
    assert "Traceback" not in err


def test_without_a_browser_the_address_is_printed(motion: Path) -> None:
    process = start("replay", motion, PATH="/nowhere", DISPLAY="", BROWSER="")
    assert process.stdout is not None
    assert process.stdout.readline().startswith("playing at http://127.0.0.1:")
    os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (0, "")


def test_one_ctrl_c_ends_a_replay_that_loops(motion: Path) -> None:
    process = start("replay", motion, "--no-browser", "--loop", "--speed", "50")
    assert process.stdout is not None
    assert process.stdout.readline().startswith("playing at http://127.0.0.1:")
    time.sleep(1.0)
    os.kill(process.pid, signal.SIGINT)
    try:
        _, err = process.communicate(timeout=60)
    finally:
        process.kill()
    assert (process.returncode, err) == (0, "")


def test_an_interrupt_wrapped_in_a_runtime_error_is_recognized() -> None:
    """Python 3.11 wraps exceptions of __set_name__ in a RuntimeError."""
    program = (
        "import hovi.cli.application\n"
        "class Naming:\n"
        "    def __set_name__(self, owner, name): raise KeyboardInterrupt\n"
        "def main(): type('Owner', (), {'each': Naming()})\n"
        "hovi.cli.application.main = main\n"
        "from hovi.__main__ import run\n"
        "run()\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, check=False)
    assert done.returncode == 130
    assert b"Traceback" not in done.stderr


def test_an_interrupt_swallowed_by_an_imported_module_is_raised_again(tmp_path: Path) -> None:
    (tmp_path / "swallows").with_suffix(".py").write_text(
        "import os, signal\n"
        "try: os.kill(os.getpid(), signal.SIGINT)\n"
        "except KeyboardInterrupt: pass\n"
        "print('went on')\n"
    )
    program = (
        "import signal\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "import hovi.cli.application\n"
        "def main(): print('begun'); import swallows\n"
        "hovi.cli.application.main = main\n"
        "from hovi.__main__ import run\n"
        "run()\n"
    )
    environment = os.environ | {"PYTHONPATH": f"{tmp_path}:{os.environ.get('PYTHONPATH', '')}"}
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "begun\n", "")


@pytest.mark.parametrize("unnamed", [True, False])
def test_the_longest_names_are_written(
    unnamed: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not unnamed:
        monkeypatch.setattr("hovi.system.files._DESCRIPTORS", tmp_path / "no proc")
    for letter in ("a", "\u4e2d", "\U0001f600"):
        name = letter * (255 // len(letter.encode()))
        with whole_file(tmp_path / name) as stream:
            stream.write(b"whole")
        assert (tmp_path / name).read_bytes() == b"whole"


@pytest.mark.parametrize("name", ["a\0b", "\ud800"])
def test_a_name_that_no_file_can_have_is_an_error_of_the_system(name: str, tmp_path: Path) -> None:
    with pytest.raises(OSError, match="no file can have that name"), whole_file(tmp_path / name):
        pass


@pytest.mark.parametrize("last", [2, 7, 8, 10])
def test_an_interrupt_where_distances_begin_to_count_keeps_the_motion(
    last: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Their rows have grown then, and their multipliers have not."""
    rows = importlib.import_module("hovi.planning.solver.near.clearance_rows").ClearanceRows
    add, grown = rows._add, 0

    def adding(*given: Any) -> int:
        nonlocal grown
        added: int = add(*given)
        grown += added > 0
        if added > 0 and grown == last:
            raise KeyboardInterrupt
        return added

    monkeypatch.setattr(rows, "_add", adding)
    found = hovi.plan_task(hovi.load_task(hovi.example("ur5_around_sphere")), processes=1)
    assert grown >= last
    assert found.status == "interrupted"
