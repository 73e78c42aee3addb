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
from hovi.robot.space.coordinates import Coordinates
from hovi.scene.lagrangian import Lagrangian
from hovi.scene.scene import Scene

Array = npt.NDArray[np.float64]


class CasadiLagrangian(Lagrangian):
    """A Lagrangian of any order k from a CasADi expression.

    jet: symbols (q, v, a, ...), k + 1 columns of length n; q has length nq if there is a space.
    expression: L as a function of them. [ColomboFerraroMartin2016, section 2]
    space: the configuration space; None if it is a vector space.
    time: the symbol of t, in [s], if L depends on it.
    scene: of the robot whose motion L is about, if it is about one: its motions can be replayed,
        and their torques sampled.
    Raises InputError for jets of other shapes, and expressions of other symbols.
    """

    @check_arguments
    def __init__(
        self,
        jet: list[ca.SX],
        expression: ca.SX,
        space: ConfigurationSpace | None = None,
        *,
        time: ca.SX | None = None,
        scene: Scene | None = None,
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
        self.time, self.scene = time, scene
        self._own, self._begin = expression, 0.0  # before `within`
        nothing = ca.SX(0, 1)
        symbols = jet[0], ca.vertcat(*jet[1:]), nothing, nothing
        hessian, gradient = tangent.hessian(expression, symbols, space)
        arguments = jet if time is None else [*jet, time]
        self._value = _point_function("L", arguments, [expression])
        self._expand = _point_function("L_expand", arguments, [expression, gradient, hessian])

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

    @property
    def coordinates(self) -> Coordinates:
        """Those of the scene's robot, or else q[0], q[1], ..."""
        return super().coordinates if self.scene is None else self.scene.robot

    @property
    def timed(self) -> bool:
        """Whether L depends on time."""
        return self.time is not None

    def within(self, begin: float, end: float) -> CasadiLagrangian:
        """The same by a clock that starts at `begin`, in [s], as its scene."""
        scene = None if self.scene is None else self.scene.from_time(begin)
        if scene is self.scene and (self.time is None or begin == 0.0):
            return self
        own, total = self._own, self._begin + begin
        shifted = own if self.time is None else ca.substitute(own, self.time, self.time + total)
        later = CasadiLagrangian(self.jet, shifted, self._space, time=self.time, scene=scene)
        later._own, later._begin = own, total
        return later

    def value(self, *jet: Array, t: Array | None = None) -> Array:
        """L at P points, shape (P,)."""
        return self._value(*self._arguments(jet, t))[0]

    def evaluate(self, *jet: Array, t: Array | None = None) -> tuple[Array, Array, Array]:
        """Value, gradient and Hessian: see Lagrangian.evaluate."""
        value, gradient, hessian = self._expand(*self._arguments(jet, t))
        shape = (len(value), self.order + 1, self.nv)
        return value, gradient.reshape(shape), hessian.reshape(*shape, *shape[1:])

    def _arguments(self, jet: tuple[Array, ...], t: Array | None) -> tuple[Array, ...]:
        """The jet, and the times as a column if L depends on them."""
        if not self.timed:
            return jet
        if t is None:
            raise InputError("this Lagrangian depends on time: give t, one time per point.")
        return *jet, t[:, None]


def _point_function(name: str, arguments: list[ca.SX], results: list[ca.SX]) -> PointFunction:
    """A function of points. Raises InputError for symbols that are no arguments."""
    used, known = (
        {str(symbol) for symbol in ca.symvar(ca.vertcat(*map(ca.vec, each)))}
        for each in (results, arguments)
    )
    names = sorted(used - known)
    if names:
        raise InputError(
            f"the expression of a Lagrangian has symbols that are not in its jet: "
            f"{', '.join(names)}; pass that of time as `time`, and give all others a value."
        )
    return PointFunction(ca.Function(name, arguments, results))
