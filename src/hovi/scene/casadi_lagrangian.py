"""Lagrangians of any order from a CasADi expression."""

from __future__ import annotations

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.checks.arguments import check_arguments
from hovi.dynamics.point_function import PointFunction
from hovi.errors import InputError
from hovi.robot.space import tangent
from hovi.robot.space.configuration_space import ConfigurationSpace
from hovi.scene.lagrangian import Lagrangian

Array = npt.NDArray[np.float64]


class CasadiLagrangian(Lagrangian):
    """A Lagrangian of any order k from a CasADi expression.

    jet: symbols (q, v, a, ...), k + 1 columns of length n; q has length nq if there is a space.
    expression: L as a function of them. [ColomboFerraroMartin2016, section 2]
    space: the configuration space; None if it is a vector space.
    """

    @check_arguments
    def __init__(
        self, jet: list[ca.SX], expression: ca.SX, space: ConfigurationSpace | None = None
    ) -> None:
        if len(jet) < 2 or not all(each.is_column() and each.numel() for each in jet):
            raise InputError(
                "a jet is a list of two or more columns (q, v, ...) of CasADi symbols, got "
                f"{len(jet)}, of shapes {', '.join(str(each.shape) for each in jet)}."
            )
        self.order = len(jet) - 1
        self.jet = list(jet)
        self.expression = expression
        self._space = space
        nothing = ca.SX(0, 1)
        symbols = jet[0], ca.vertcat(*jet[1:]), nothing, nothing
        hessian, gradient = tangent.hessian(expression, symbols, space)
        self._value = PointFunction(ca.Function("L", jet, [expression]))
        self._expand = PointFunction(ca.Function("L_expand", jet, [expression, gradient, hessian]))

    @property
    def nq(self) -> int:
        """Length of a configuration."""
        return int(self.jet[0].shape[0])

    @property
    def nv(self) -> int:
        """Degrees of freedom."""
        return int(self.jet[1].shape[0])

    @property
    def space(self) -> ConfigurationSpace | None:
        """The configuration space; None if it is a vector space."""
        return self._space

    def value(self, *jet: Array, t: Array | None = None) -> Array:
        """L at P points, shape (P,)."""
        return self._value(*jet)[0]

    def evaluate(self, *jet: Array, t: Array | None = None) -> tuple[Array, Array, Array]:
        """Value, gradient and Hessian: see Lagrangian.evaluate."""
        value, gradient, hessian = self._expand(*jet)
        shape = (len(value), self.order + 1, self.nv)
        return value, gradient.reshape(shape), hessian.reshape(*shape, *shape[1:])
