"""The mass matrix M(q) of a model, mimic joints included."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from hovi.robot.mimic_model import CoordinateMap, uncoupled

Array = npt.NDArray[np.float64]


class MassMatrix:
    """q -> M(q) by Pinocchio's CRBA; G^T M_all G of the uncoupled model if there are mimic joints.

    CRBA of Pinocchio 4.1 is wrong on a coupled model with a joint of several coordinates between a
    leader and its follower.

    model: with armature.
    """

    def __init__(self, model: pin.Model) -> None:
        coupled = len(model.mimicking_joints) > 0
        self._model = uncoupled(model) if coupled else model
        self._data = self._model.createData()
        self._map = CoordinateMap.of(model, self._model) if coupled else None

    def __call__(self, q: Array) -> Array:
        """The symmetric matrices at M configurations (M, nq), shape (M, nv, nv), in [kg m^2]."""
        whole = q if self._map is None else self._map.configurations(q)
        upper = np.array([np.triu(pin.crba(self._model, self._data, one)) for one in whole])
        mass: Array = upper + np.triu(upper, 1).swapaxes(1, 2)
        if self._map is not None:
            mass = np.asarray(self._map.matrix.T @ mass @ self._map.matrix)
        return mass
