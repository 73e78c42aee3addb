"""Fuzzing guided by coverage: atheris searches for bytes that reach new lines of the readers.

    python fuzz_coverage.py urdf|scene|trajectory|segments|study|command|mesh|compiled|api SECONDS

It starts from mutated inputs of tests/hard, stops at the first fault, and saves it to a file.
"""

from __future__ import annotations

import sys
import tempfile
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from random import Random

import atheris

TOP = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(TOP / "tests"))
MODULES = {
    "urdf": "hard.mutated_urdf",
    "scene": "hard.mutated_scene",
    "trajectory": "hard.mutated_motion",
    "motion_meshes": "hard.mutated_motion_meshes",
    "segments": "hard.mutated_segments",
    "study": "hard.mutated_study",
    "command": "hard.mutated_command",
    "compiled": "hard.compiled_calls",
    "api": "hard.api_calls",
    "mesh": "hard.mutated_mesh",
}
CORPUS, LARGEST = 300, 60_000  # inputs to begin with; bytes of an input
HANG = 10  # [s]
READERS = (
    *("hovi.robot.urdf", "hovi.robot.srdf", "hovi.planning.task_file", "hovi.checks"),
    *("hovi.discrete.trajectory_file", "hovi.discrete.node_continuity"),
    "hovi.scene.segment_scenes",
)
"""Modules and packages whose lines count: tracing the computations is slow."""


def computations() -> list[str]:
    """All other modules: atheris takes all of a package or names what it leaves out."""
    found = find_spec("hovi")
    assert found is not None
    assert found.origin is not None
    package = Path(found.origin).parent
    files = [path.relative_to(package.parent).with_suffix("") for path in package.rglob("*.py")]
    names = [".".join(file.parts).removesuffix(".__init__") for file in files]
    return [name for name in names if not f"{name}.".startswith(tuple(f"{r}." for r in READERS))]


def main() -> None:
    kind, seconds = sys.argv[1], sys.argv[2]
    with atheris.instrument_imports(include=["hovi"], exclude=computations()):
        module = import_module(MODULES[kind])
        verdict = import_module("hard.verdict")
    good = (verdict.Verdict.REFUSED, verdict.Verdict.ACCEPTED)
    folder = Path(tempfile.mkdtemp(prefix="hovi-fuzz-"))
    corpus = folder / "corpus"
    corpus.mkdir()
    for number in range(CORPUS):
        (corpus / str(number)).write_bytes(module.mutate(Random(f"1:{number}")).content)

    def one(data: bytes) -> None:
        found, why = module.verdict(verdict.Mutant(data), folder)
        if found not in good:
            raise AssertionError(f"{found}: {why}")

    limits = [f"-max_total_time={seconds}", f"-timeout={HANG}", f"-max_len={LARGEST}"]
    atheris.Setup([sys.argv[0], *limits, f"-artifact_prefix={folder}/", str(corpus)], one)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
