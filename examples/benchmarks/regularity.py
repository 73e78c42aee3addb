"""Regularity of the schemes: the matrix W_d of every table, for L = 1/2 |a|^2 and h = 1."""

from __future__ import annotations

import numpy as np
from measuring import print_table

from hovi.schemes import CLASSIC, by_name, is_regular, regularity_matrix

NAMES = (*CLASSIC, "galerkin-0", "galerkin-1", "galerkin-2")


def main() -> None:
    rows = []
    for name in NAMES:
        scheme, W = by_name(name), regularity_matrix(by_name(name))
        entries = ", ".join(f"{entry:.4g}" for entry in W.ravel() + 0.0)
        rank = np.linalg.matrix_rank(W, tol=1e-10)
        determinant = f"{np.linalg.det(W):.4g}" if is_regular(scheme) else "0"
        points = len(scheme.points)
        rows.append([f"`{name}`", points, scheme.inner_modes, entries, determinant, rank])
    columns = ["scheme", "points", "inner modes", "D13, D14, D23, D24", "det W_d", "rank"]
    print_table(columns, rows)


if __name__ == "__main__":
    main()
