"""Calls that would read or write out of bounds if hovi did not check them: see tests/valgrind.sh.

    python tests/hard/out_of_bounds.py COUNT

Discrete Lagrangians get paths of other lengths than their grid; COUNT compiled functions get the
wrong arguments of `compiled_calls`. It prints how many of them were refused.
"""

from __future__ import annotations

import sys
import tempfile
from collections import Counter
from pathlib import Path
from random import Random

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import hovi
from hard.compiled_calls import mutate, verdict
from hovi.errors import HoviError

SIZES = (1, 2), (19, 2), (21, 2), (20, 1), (20, 0), (20, 2), (0, 2)
"""Intervals and inner modes of the paths; the grid has 20 and 2."""
METHODS = "values", "action", "expand", "gradient", "momenta", "derivatives", "jets"


def main() -> None:
    scene = hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")), [hovi.effects.Gravity()])
    grid = hovi.Grid.uniform(1.0, 20, hovi.schemes.galerkin(2))
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
    found: Counter[str] = Counter()
    for N, r in SIZES:
        nodes, modes = np.zeros((N + 1, 2)), np.zeros((N, r, 2))
        path = hovi.DiscretePath(nodes, nodes, np.zeros((N, 2, 2)), modes)
        for name in METHODS:
            try:
                getattr(ld, name)(path)
                found["accepted"] += 1
            except HoviError:
                found["refused"] += 1
    with tempfile.TemporaryDirectory() as folder:
        for number in range(int(sys.argv[1])):
            found[str(verdict(mutate(Random(f"valgrind:{number}")), Path(folder))[0])] += 1
    print(", ".join(f"{count} {word}" for word, count in sorted(found.items())))


if __name__ == "__main__":
    main()
