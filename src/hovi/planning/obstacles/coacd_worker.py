"""Convex parts by CoACD, in a process of its own: `python coacd_worker.py in.npz out.npz`.

CoACD brings a C++ library with which Pinocchio can no longer read URDFs if it is loaded first, so
that this file imports nothing of hovi, and hovi nothing of this file.
"""

import sys

import coacd
import numpy as np


def main(given: str, wanted: str) -> None:
    """Read vertices, triangles and threshold; write the vertices of each part."""
    with np.load(given, allow_pickle=False) as data:
        mesh = coacd.Mesh(data["vertices"], data["triangles"].astype(np.int32))
        threshold = float(data["threshold"])
    coacd.set_log_level("error")
    parts = coacd.run_coacd(mesh, threshold=threshold, seed=0)
    np.savez(wanted, **{f"part_{k}": vertices for k, (vertices, _) in enumerate(parts)})


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])
