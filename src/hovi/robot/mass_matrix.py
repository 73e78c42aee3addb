"""The mass matrix M(q) of a model, joints that mimic others included."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.robot.mimic_model import Pull, uncoupled

Array = npt.NDArray[np.float64]


class MassMatrix:
    """q -> M(q), by Pinocchio's CRBA: of the model, or G^T M_all G of that with all joints free.

    Where a joint of several coordinates stands between a leader and its follower, CRBA of
    Pinocchio 4.1 is wrong on the coupled model.

    model: armature included.
    """

    def __init__(self, model: pin.Model) -> None:
        coupled = len(model.mimicking_joints) > 0
        self._model = uncoupled(model) if coupled else model
        self._data = self._model.createData()
        self._pull = Pull.of(model, self._model) if coupled else None

    def __call__(self, q: Array) -> Array:
        """Both triangles at M configurations (M, nq), shape (M, nv, nv), in [kg m^2]."""
        whole = q if self._pull is None else self._pull.configurations(q)
        upper = np.array([np.triu(pin.crba(self._model, self._data, one)) for one in whole])
        mass: Array = upper + np.triu(upper, 1).swapaxes(1, 2)
        if self._pull is not None:
            mass = np.asarray(self._pull.matrix.T @ mass @ self._pull.matrix)
        return mass
