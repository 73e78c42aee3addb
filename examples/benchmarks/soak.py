"""Random plans under random faults, for a given time: is everything that was finished there, whole?

Every plan is a process `hovi plan SCENE --out FILE` of a random reach, from one start or several in
worker processes. One fault meets it at a random moment: kill -9 of the process or of one of its
workers, SIGTERM, SIGHUP, Ctrl-C, a disk that is full (a tmpfs of 64 kB as root, else a limit on
the size of files), or none. Afterwards
- FILE is the motion that was there before or a new one, and loads with its hash; it is a new one
  if the process ended with 0;
- nothing else is left in its folder, and no process of its session;
- its outputs have ended, without a traceback, with at most one line of an error.

    python soak.py [--minutes 60] [--seed 0]
"""

from __future__ import annotations

import argparse
import contextlib
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from measuring import print_machine, print_table

from hovi.discrete.trajectory import Trajectory

SIGNALS = {
    "kill -9": signal.SIGKILL,
    "SIGTERM": signal.SIGTERM,
    "SIGHUP": signal.SIGHUP,
    "Ctrl-C": signal.SIGINT,
}
FAULTS = ("none", *SIGNALS, "killed worker", "full disk")
DISK, FILE_SIZE = 64 * 1024, 3_000
LONGEST, GRACE = 120.0, 10.0
UNSTARTED = "init_import_site"
"""In what Python prints if Ctrl-C meets it while it starts, before hovi can answer."""
SCENE = """
robot = "ur5"
duration = {duration}
limits = "{limits}"
starts = {starts}
seed = {seed}
start.q = {start}
goal.q = {goal}
effects.gravity.acceleration = 9.81
"""


@dataclass(frozen=True)
class Outcome:
    """What became of one plan. wrong: what should not be, or ""."""

    fault: str
    code: int
    new: bool
    wrong: str


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    random, ends = np.random.default_rng(args.seed), time.monotonic() + 60 * args.minutes
    outcomes: list[Outcome] = []
    with tempfile.TemporaryDirectory() as folder:
        while time.monotonic() < ends:
            outcomes.append(_plan(Path(folder), random))
            left = max(ends - time.monotonic(), 0.0) / 60
            print(f"{outcomes[-1]}, {left:.1f} min left", file=sys.stderr, flush=True)
    rows = []
    for fault in FAULTS:
        own = [each for each in outcomes if each.fault == fault]
        codes = Counter(each.code for each in own)
        text = ", ".join(f"{code}: {n}" for code, n in sorted(codes.items()))
        new, wrong = sum(each.new for each in own), sum(bool(each.wrong) for each in own)
        rows.append([fault, len(own), text or "-", new, wrong])
    print_table(["fault", "plans", "exit codes", "new motions", "wrong"], rows)
    for each in outcomes:
        if each.wrong:
            print(f"- {each.fault}, exit code {each.code}: {each.wrong}")
    print_machine(threads=1)
    raise SystemExit(any(each.wrong for each in outcomes))


def _plan(folder: Path, random: np.random.Generator) -> Outcome:
    """One plan with one fault."""
    fault = str(random.choice(FAULTS))
    scene = folder / "scene.toml"
    scene.write_text(_scene(random, several=fault == "killed worker" or random.random() < 0.3))
    with _disk(folder / "disk", full=fault == "full disk") as disk:
        before = _content(disk / "motion.npz")
        process = _started(scene, disk, limited=fault == "full disk" and os.getuid() != 0)
        try:
            _meet(process, fault, float(random.uniform(0.0, 4.0)))
            wrong = _ending(process)
        finally:
            rest = _session(process.pid)
            for each in rest:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(each, signal.SIGKILL)
        if rest:
            wrong = wrong or f"{len(rest)} processes were left"
        after = _content(disk / "motion.npz")
        wrong = wrong or _file_fault(disk, after, changed=after != before, code=process.returncode)
        if fault == "none" and process.returncode not in (0, 1):  # 1: no minimum was found
            wrong = f"exit code {process.returncode} without a fault"
        return Outcome(fault, process.returncode, after != before, wrong)


def _scene(random: np.random.Generator, several: bool) -> str:
    """A random reach as the text of a scene file."""
    start, goal = (np.round(random.uniform(-1.5, 1.5, 6), 3).tolist() for _ in range(2))
    return SCENE.format(
        start=start,
        goal=goal,
        duration=round(float(random.uniform(1.5, 3.0)), 3),
        limits=str(random.choice(["urdf", "none"])),
        starts=6 if several else 1,
        seed=int(random.integers(1000)),
    )


@contextlib.contextmanager
def _disk(path: Path, full: bool) -> Iterator[Path]:
    """A folder with a motion of an earlier plan, on a full disk if that is asked for."""
    path.mkdir(exist_ok=True)
    old = path.with_suffix(".npz")
    if full and os.getuid() == 0:
        mount = ["mount", "-t", "tmpfs", "-o", f"size={DISK}", "tmpfs", str(path)]
        subprocess.run(mount, check=True)
        try:
            if old.exists():
                shutil.copy(old, path / "motion.npz")
            (path / "rest").write_bytes(b"x" * max(shutil.disk_usage(path).free - 4096, 0))
            yield path
        finally:
            subprocess.run(["umount", str(path)], check=True)
        return
    yield path
    if (path / "motion.npz").exists():
        shutil.copy(path / "motion.npz", old)


def _started(scene: Path, disk: Path, limited: bool) -> subprocess.Popen[str]:
    """`hovi plan` in a session of its own."""

    def prepare() -> None:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        if limited:
            resource.setrlimit(resource.RLIMIT_FSIZE, (FILE_SIZE, FILE_SIZE))

    return subprocess.Popen(
        [sys.executable, "-m", "hovi", "plan", str(scene), "--out", str(disk / "motion.npz")],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        stdin=subprocess.DEVNULL,
        text=True,
        preexec_fn=prepare,
        start_new_session=True,
    )


def _meet(process: subprocess.Popen[str], fault: str, seconds: float) -> None:
    """Let the fault happen after some seconds, unless the process ended before."""
    if fault in SIGNALS:
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(seconds)
        if process.poll() is None:
            process.send_signal(SIGNALS[fault])
    elif fault == "killed worker":
        ends = time.monotonic() + LONGEST
        while process.poll() is None and time.monotonic() < ends:
            workers = [each for each in _session(process.pid) if each != process.pid]
            if workers:
                time.sleep(seconds / 4)
                with contextlib.suppress(ProcessLookupError):
                    os.kill(workers[-1], signal.SIGKILL)
                return
            time.sleep(0.02)


def _ending(process: subprocess.Popen[str]) -> str:
    """What is wrong with how the process ended, or ""."""
    try:
        _, err = process.communicate(timeout=LONGEST)
    except subprocess.TimeoutExpired:
        process.kill()
        return f"its outputs had not ended after {LONGEST:g} s"
    errors = [line for line in err.splitlines() if line.startswith("error: ")]
    if ("Traceback" in err and UNSTARTED not in err) or len(errors) > 1:
        return err.strip()
    ends = time.monotonic() + GRACE
    while _session(process.pid) and time.monotonic() < ends:
        time.sleep(0.05)
    return ""


def _session(leader: int) -> list[int]:
    """The processes of a session that have not ended."""
    found = []
    for each in Path("/proc").iterdir():
        if each.name.isdigit():
            with contextlib.suppress(OSError):
                fields = (each / "stat").read_text().rpartition(")")[2].split()
                if int(fields[3]) == leader and fields[0] != "Z":
                    found.append(int(each.name))
    return sorted(found)


def _content(path: Path) -> bytes | None:
    return path.read_bytes() if path.exists() else None


def _file_fault(disk: Path, after: bytes | None, changed: bool, code: int) -> str:
    """What is wrong with the files of a plan, or ""."""
    others = {each.name for each in disk.iterdir()} - {"motion.npz", "rest"}
    if others:
        return f"{', '.join(sorted(others))} was left"
    if code == 0 and not changed:
        return "it ended with 0, but wrote no motion"
    if after is not None:
        try:
            Trajectory.load(disk / "motion.npz")
        except Exception as error:  # whatever a broken file raises
            return f"the motion does not load: {error}"
    return ""


if __name__ == "__main__":
    main()
