"""Torques of schemes without a curve of their own, for plots.

The second derivative of the cubic through the nodes of a Taylor scheme oscillates about the true
acceleration, and so do its torques. Those at the quadrature points, the controls of the scheme, do
not.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hovi.discrete.discrete_lagrangian import DiscreteLagrangian
from hovi.discrete.trajectory import Trajectory
from hovi.schemes import is_galerkin

Array = npt.NDArray[np.float64]


def scheme_torque(trajectory: Trajectory, t: Array) -> Array | None:
    """The torques at the quadrature points, interpolated linearly to times t in [s], (M, nv).

    None where the interpolant is the scheme's own curve, and for motions without a scene.
    """
    scene, grid = trajectory.scene, trajectory.grid
    if scene is None or all(is_galerkin(scheme) for scheme, _ in grid.groups):
        return None
    ld = DiscreteLagrangian(scene.effort_lagrangian(), grid)
    jets = zip(ld.jets(trajectory.path), ld.point_times, strict=True)
    tau = np.concatenate([ld.lagrangian.output(*jet, t=times) for jet, times in jets])
    known, first = np.unique(np.concatenate(ld.point_times), return_index=True)
    return np.stack([np.interp(t, known, each) for each in tau[first].T], axis=1)
