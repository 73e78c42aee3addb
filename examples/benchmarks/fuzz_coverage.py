"""Fuzzing guided by coverage: atheris searches for bytes that reach new lines of the readers.

    python fuzz_coverage.py urdf|scene|trajectory|mesh|compiled|api SECONDS

It starts from mutated inputs of tests/hard, stops at the first fault, and saves it to a file.
"""

from __future__ import annotations

import sys
import tempfile
from importlib import import_module
from pathlib import Path
from random import Random

import atheris

TOP = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(TOP / "tests"))
MODULES = {
    "urdf": "hard.mutated_urdf",
    "scene": "hard.mutated_scene",
    "trajectory": "hard.mutated_motion",
    "compiled": "hard.compiled_calls",
    "api": "hard.api_calls",
    "mesh": "hard.mutated_mesh",
}
CORPUS, LARGEST = 300, 60_000  # inputs to begin with; bytes of an input
HANG = 10  # [s]


def main() -> None:
    kind, seconds = sys.argv[1], sys.argv[2]
    # Only the readers, since tracing the computations is slow.
    readers = [
        "hovi.robot.urdf.check",
        "hovi.robot.urdf.rules",
        "hovi.robot.urdf.spelling",
        "hovi.robot.urdf.normalize",
        "hovi.robot.urdf.mesh_files",
        "hovi.discrete.trajectory_file",
    ]
    with atheris.instrument_imports(
        include=[*readers, "hovi.planning.task_file", "hovi.discrete.node_continuity"]
    ):
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
