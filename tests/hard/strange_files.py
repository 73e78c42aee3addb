"""Helpers for the cases of invalid models and files."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import pinocchio as pin

from hard.case import Outcome
from hovi.errors import HoviError
from hovi.robot.bundled_models import example
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot

ARM = example("two_link.urdf").read_text()
MASS = 'mass value="0.375"'
CHAIN_LINK = (
    '<link name="l{i}"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" '
    'iyz="0" izz="1"/></inertial></link><joint name="j{i}" type="continuous"><parent link="{p}"/>'
    '<child link="l{i}"/><axis xyz="0 0 1"/></joint>'
)


def loaded(text: str) -> Robot:
    """The robot loaded from a file with this text."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "robot.urdf"
        path.write_text(text)
        return load_robot(path)


def long_chain(links: int) -> str:
    """The URDF of a serial chain."""
    parts = (CHAIN_LINK.format(i=i, p=f"l{i - 1}" if i else "base") for i in range(links))
    return '<robot name="chain"><link name="base"/>' + "".join(parts) + "</robot>"


def by_pinocchio(text: str) -> str:
    """The result of Pinocchio's own parser: the mass of the first link, or its error."""
    with _quiet():
        try:
            model = pin.buildModelFromXML(text)
        except ValueError as error:
            return f"{type(error).__name__}: {str(error)[:60]}"
    arm = f", upper arm of {model.inertias[1].mass:g} kg" if model.nv else ""
    return f"loads, {model.nv} joints{arm}"


def refusals(calls: Mapping[str, tuple[Callable[[], object], str]]) -> Outcome:
    """Whether each call raises one sentence that contains its fragment."""
    for name, (call, fragment) in calls.items():
        try:
            call()
        except HoviError as error:
            sentence = str(error)
            if fragment not in sentence or "\n" in sentence:
                return Outcome(f"{name}: {sentence}", False)
        else:
            return Outcome(f"{name}: accepted", False)
    return Outcome(f"{len(calls)} of {len(calls)} refused, such as: {sentence[:110]}", True)


def run_process(code: str, text: str = "", memory: int | None = None) -> tuple[int, str]:
    """Exit code and last word of a process that runs `code` with `text` on its input.

    memory: limit in bytes.
    """
    if memory is not None:
        code = f"import resource; resource.setrlimit(resource.RLIMIT_AS, ({memory},) * 2)\n{code}"
    done = subprocess.run(
        [sys.executable, "-c", code], input=text, capture_output=True, text=True, check=False
    )
    words = (done.stdout + done.stderr).split()
    return done.returncode, words[-1] if words else ""


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Suppress what C++ prints on stderr."""
    kept, null = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 2)
    try:
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(null)
