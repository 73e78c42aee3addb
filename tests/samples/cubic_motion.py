"""Motions with known samples: a cubic in each joint, which all schemes reproduce."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from hovi.discrete.grid import DiscretePath, Grid
from hovi.discrete.trajectory import Trajectory
from hovi.scene.scene import Scene
from hovi.schemes import by_name

Array = npt.NDArray[np.float64]


class Cubic:
    """q(t) = c0 + c1 t + c2 t^2 + c3 t^3 for n joints, the coefficients drawn from a seed."""

    def __init__(self, n: int, seed: int = 0) -> None:
        self.coefficients = np.random.default_rng(seed).uniform(-1.0, 1.0, (4, n))

    def __call__(self, t: npt.ArrayLike) -> tuple[Array, Array, Array]:
        """q, v and a at times t (M,), each (M, n)."""
        t = np.atleast_1d(np.asarray(t, dtype=np.float64))
        one = np.ones_like(t)
        powers = (
            [one, t, t**2, t**3],
            [0 * t, one, 2 * t, 3 * t**2],
            [0 * t, 0 * t, 2 * one, 6 * t],
        )
        q, v, a = (np.stack(p, axis=1) @ self.coefficients for p in powers)
        return q, v, a

    @classmethod
    def resting(cls, start: npt.ArrayLike, end: npt.ArrayLike, duration: float) -> Cubic:
        """From rest at `start` to rest at `end`, (n,) each, in `duration` [s]."""
        q, moved = np.asarray(start, dtype=float), np.subtract(end, start)
        found = cls(len(q))
        found.coefficients = np.stack(
            [q, 0.0 * q, 3.0 * moved / duration**2, -2.0 * moved / duration**3]
        )
        return found


def cubic_motion(
    scene: Scene,
    duration: float = 2.0,
    schemes: Sequence[str] = ("galerkin-2",) * 7,
    steps: Array | None = None,
    seed: int = 0,
    cubic: Cubic | None = None,
) -> tuple[Trajectory, Cubic]:
    """A trajectory that is a cubic, and the cubic. `steps` are uniform by default."""
    N, cubic = len(schemes), Cubic(scene.robot.nv, seed) if cubic is None else cubic
    steps = np.full(N, duration / N) if steps is None else steps
    grid = Grid(steps, tuple(by_name(name) for name in schemes))
    q, v, a = cubic(grid.t)
    h, jerk = grid.steps[:, None], 6 * cubic.coefficients[3]
    z = np.stack([a[:-1] / 2 + jerk * h / 6, a[:-1] + jerk * h / 2], axis=1)
    inner = np.zeros((N, grid.inner_modes, scene.robot.nv))
    momenta = np.zeros((N + 1, 2, scene.robot.nv))
    path = DiscretePath(q, v, z, inner)
    return Trajectory(grid, path, momenta, scene, {"cost": 1.0, "status": "minimum"}), cubic
