"""Weights of the joint torques in the cost."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import casadi as ca
import numpy as np
import numpy.typing as npt

from hovi.effects.effect import Effect, Touch
from hovi.effects.expressions.formula import Number, expression
from hovi.effects.expressions.formula_symbols import joint_symbols
from hovi.effects.expressions.joint_values import (
    JointValues,
    in_words,
    joint_values,
    of_urdf,
)
from hovi.effects.expressions.symbols import SceneSymbols
from hovi.errors import SceneError
from hovi.system.dataclass import dataclass

if TYPE_CHECKING:
    from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]

ROUNDING = 1e-12
"""Negative eigenvalue of a matrix that counts as zero, relative to the largest."""


@dataclass(frozen=True)
class EffortWeight(Effect):
    """R of the cost 1/2 tau^T R tau, diagonal or full; without this effect R = 1.

    Where a torque has weight 0, another cost has to bound its joint's acceleration: a motion of
    bounded cost has to have bounded accelerations.

    weight: the diagonal of R, 0 or more, per [(N m)^2] or [N^2]; in a table, joints that are left
        out have weight 1.
    matrix: R instead, nv rows of nv numbers or formulas of q["joint"], v["joint"], a["joint"] and
        t; symmetric, and positive semidefinite.
    from_urdf: use R = 1 / limit^2 of the URDF's effort limits instead, which makes torques and
        forces comparable: each counts as a fraction of its limit. A joint without a limit has
        weight 0.
    """

    weight: JointValues | None = None
    matrix: tuple[tuple[Number, ...], ...] | None = None
    from_urdf: bool = False
    key: ClassVar[str] = "effort_weight"
    touches: ClassVar[tuple[Touch, ...]] = (Touch.COST,)

    def check_values(self) -> None:
        """Raise SceneError unless one kind of weight is given."""
        sources = [self.weight is not None, self.matrix is not None, self.from_urdf]
        if sum(sources) != 1:
            count = {0: "none was", 2: "two were"}.get(sum(sources), "all were")
            raise SceneError(
                "effect 'effort_weight' needs one of weight, matrix and from_urdf = true; "
                f"{count} given."
            )

    def check(self, robot: Robot) -> None:
        """Raise SceneError for unknown joints, negative weights and what is no such matrix."""
        self.effort_weight(robot)
        self._check_matrix(robot)

    def effort_weight(self, robot: Robot) -> Array:
        """The diagonal of R, shape (nv,); zeros if a matrix is given, which is a running cost."""
        if self.from_urdf:
            limits = of_urdf(robot, self.key, "effort limits", robot.effort_limit)
            known = (limits > 0) & np.isfinite(limits)
            return np.where(known, 1 / np.where(known, limits, 1.0) ** 2, 0.0)
        if self.weight is None:
            return np.zeros(robot.nv)
        given = self.weight
        if isinstance(given, dict):
            given = dict.fromkeys(robot.coordinate_names, 1.0) | given
        return joint_values(robot, "effect 'effort_weight': weight", given, 0)

    def running_cost(self, robot: Robot, symbols: SceneSymbols, tau: ca.SX) -> ca.SX | None:
        """1/2 tau^T R tau of a matrix."""
        if self.matrix is None:
            return None
        return ca.bilin(self._expression(robot, symbols), tau, tau) / 2

    def describe(self) -> str:
        """One line for the description of a scene."""
        if self.from_urdf:
            return "effort_weight: squares of torques and forces relative to their URDF limits"
        if self.matrix is None:
            return f"effort_weight: {in_words(self.weight, 'times the squared torque')}"
        rows = ", ".join(f"[{', '.join(map(_shown, row))}]" for row in self.matrix)
        return f"effort_weight: tau^T [{rows}] tau"

    def _expression(self, robot: Robot, symbols: SceneSymbols) -> ca.SX:
        """R, shape (nv, nv)."""
        known = joint_symbols(robot, symbols)
        rows = [
            [expression(f"effect 'effort_weight': row {i + 1} of matrix", x, known) for x in row]
            for i, row in enumerate(self.matrix or ())
        ]
        return ca.vertcat(*(ca.horzcat(*row) for row in rows))

    def _check_matrix(self, robot: Robot) -> None:
        given, n = self.matrix, robot.nv
        if given is None:
            return
        if len(given) != n or any(len(row) != n for row in given):
            raise SceneError(
                f"effect 'effort_weight': matrix needs {n} rows of {n}, one per joint coordinate, "
                f"got rows of {', '.join(str(len(row)) for row in given) or 'nothing'}."
            )
        R = self._expression(robot, SceneSymbols.of(robot))
        for i, j in zip(*np.tril_indices(n, -1), strict=True):
            if given[i][j] != given[j][i]:
                raise SceneError(
                    f"effect 'effort_weight': matrix must be symmetric, but rows {j + 1} and "
                    f"{i + 1} have {_shown(given[j][i])} and {_shown(given[i][j])}."
                )
        if R.is_constant():
            eigenvalues = np.linalg.eigvalsh(np.array(ca.DM(R)))
            if eigenvalues[0] < -ROUNDING * np.abs(eigenvalues).max():
                raise SceneError(
                    "effect 'effort_weight': matrix must be positive semidefinite, but has the "
                    f"eigenvalue {eigenvalues[0]:.3g}."
                )


def _shown(entry: Number) -> str:
    return repr(entry) if isinstance(entry, str) else f"{entry:g}"
