"""Meshes in convex parts by CoACD, kept in the user's cache folder by the mesh's hash.

[WeiLiuLingSu2022]
"""

from __future__ import annotations

import io
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import coal
import numpy as np
import numpy.typing as npt

from hovi.errors import InputError
from hovi.planning.obstacles.hull import hull_of
from hovi.planning.obstacles.triangle_mesh import TriangleMesh
from hovi.system.deadline import raise_if_late, time_left
from hovi.system.file_cache import read_cached, write_cached

Array = npt.NDArray[np.float64]
Parts = tuple[Array, ...]

THRESHOLD = 0.05
"""Largest concavity of a part, relative to the mesh: CoACD's own default."""
MAX_PARTS = 200
"""Maximum number of parts of a mesh."""
_KEY = f"coacd-1-{THRESHOLD:g}"
"""Part of the name of a cached file, to be changed with what is computed."""
_MAX_SECONDS = 600.0
"""Time after which a mesh counts as one that cannot be divided, in [s]."""
_WORKER = Path(__file__).with_name("coacd_worker.py")


def convex_parts(mesh: TriangleMesh) -> Parts:
    """Vertices (M, 3) of each of the parts, whose hulls together cover a mesh but for `uncovered`.

    Raises InputError without CoACD, and for a mesh that it cannot divide.
    """
    name = f"{_KEY}-{mesh.digest}.npz"
    cached = read_cached("convex_parts", name)
    parts = None if cached is None else _unpacked(cached)
    if parts is None:
        parts = _divided(mesh)
        write_cached("convex_parts", name, _packed(parts))
    return parts


def uncovered(mesh: TriangleMesh, parts: Parts) -> float:
    """How far the corners and middles of a mesh's triangles lie outside its parts, in [m]."""
    corners = mesh.vertices[mesh.triangles]
    middles = corners.mean(axis=1)
    points = np.concatenate([mesh.vertices, middles])
    least = np.full(len(points), np.inf)
    hulls = [hull for part in parts if (hull := hull_of(part)) is not None]
    for hull in hulls:
        for i in np.flatnonzero(least > 0.0):
            least[i] = min(least[i], _distance(points[i], hull))
        raise_if_late()
    return float(max(least.max(initial=0.0), 0.0))


def _distance(point: Array, hull: coal.ConvexBase) -> float:
    at, result = coal.Transform3s(np.eye(3), point), coal.DistanceResult()
    coal.distance(
        coal.Sphere(0.0), at, hull, coal.Transform3s.Identity(), coal.DistanceRequest(), result
    )
    return float(result.min_distance)


def _divided(mesh: TriangleMesh) -> Parts:
    """The parts by CoACD in a process of its own, with which it shares no library."""
    if find_spec("coacd") is None:
        raise InputError(
            f"mesh {mesh.name!r} is to be divided into convex parts, which needs CoACD: run pip "
            "install 'hovi[convex]', or leave out convex_parts to take its convex hull."
        )
    left = time_left()
    seconds = _MAX_SECONDS if left is None else min(left, _MAX_SECONDS)
    with tempfile.TemporaryDirectory(prefix="hovi-") as folder:
        given, wanted = Path(folder, "mesh.npz"), Path(folder, "parts.npz")
        np.savez(given, vertices=mesh.vertices, triangles=mesh.triangles, threshold=THRESHOLD)
        command = [sys.executable, str(_WORKER), str(given), str(wanted)]
        try:
            subprocess.run(command, capture_output=True, timeout=seconds, check=True)
            parts = _unpacked(wanted.read_bytes())
        except subprocess.TimeoutExpired:
            raise_if_late()
            raise InputError(
                f"mesh {mesh.name!r} was not divided into convex parts in {_MAX_SECONDS:.0f} s: "
                "simplify it, or leave out convex_parts."
            ) from None
        except (subprocess.CalledProcessError, OSError):
            parts = None
    if not parts:
        raise InputError(
            f"mesh {mesh.name!r} cannot be divided into convex parts by CoACD: repair it, or leave "
            "out convex_parts to take its convex hull."
        )
    return parts


def _packed(parts: Parts) -> bytes:
    stream = io.BytesIO()
    arrays: dict[str, Any] = {f"part_{k}": part for k, part in enumerate(parts)}
    np.savez(stream, **arrays)
    return stream.getvalue()


def _unpacked(content: bytes) -> Parts | None:
    """The parts in a file's content; None for anything else."""
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as data:
            names = [f"part_{k}" for k in range(len(data.files))]
            parts = tuple(np.asarray(data[name], dtype=np.float64) for name in names)
    except Exception:  # numpy raises a dozen kinds for a damaged file
        return None
    fits = all(part.ndim == 2 and part.shape[1] == 3 for part in parts)
    usable = fits and all(np.isfinite(part).all() for part in parts)
    return parts if usable and 0 < len(parts) <= MAX_PARTS else None
