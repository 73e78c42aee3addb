"""Bounds of a CasADi function over boxes, by interval arithmetic on its instructions.

Samples of a function can miss a pulse between them, bounds cannot [MooreKearfottCloud2009, ch. 5].
All boxes are evaluated together, as arrays. Rounding errors, of relative size 1e-16 in each
instruction, are not bounded.
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from hovi.effects.expressions.interval_rules import (
    ARITHMETIC,
    PLAIN,
    RULES,
    Array,
    Bound,
    Mask,
    Run,
    unknown,
)
from hovi.system.dataclass import dataclass

NEGLIGIBLE = 1e-7
"""Change of a result that is negligible, relative to the largest result of the same instruction."""


@dataclass(frozen=True, eq=False)
class Enclosed:
    """A function over P boxes.

    lower, upper: shape (P, m). calm: whether every function in it has an argument that changes
    little within the box, or a result that does, (P,): then Gauss points in the box integrate it.
    jumps: whether it may jump, (P,).
    """

    lower: Array
    upper: Array
    calm: Mask
    jumps: Mask

    def chosen(self, which: Mask) -> Enclosed:
        """Those over some of the boxes."""
        at = self.lower[which], self.upper[which]
        return Enclosed(*at, self.calm[which], self.jumps[which])

    @property
    def width(self) -> Array:
        """upper - lower, shape (P, m); infinite where nothing is known."""
        with np.errstate(invalid="ignore"):
            width = self.upper - self.lower
        return np.where(np.isnan(width), np.inf, width)


class Enclosure:
    """Bounds of the outputs of a function of SX expressions.

    bends: whether anything in it is more than sums and products. known: whether all of its
    instructions have bounds; a function with others is not bounded.
    """

    bends: bool
    known: bool

    def __init__(self, function: ca.Function) -> None:
        self._steps = [_step(function, i) for i in range(function.n_instructions())]
        self._sizes = [int(function.numel_out(i)) for i in range(function.n_out())]
        self._places = [_places(function.sparsity_out(i)) for i in range(function.n_out())]
        operations = {step[0] for step in self._steps}
        self.known = operations <= PLAIN | RULES.keys()
        self.bends = bool(operations - ARITHMETIC)

    def __call__(
        self, boxes: Sequence[Bound], change: float, peaks: Array | None = None
    ) -> Enclosed:
        """The bounds over P boxes.

        boxes: lower and upper bounds of each argument, (P, width) each.
        change: largest change of an argument of a function that counts as calm, absolute for exp
            or sin, relative for 1/x, logarithms and powers.
        peaks: largest absolute value of each instruction, shape (size,), updated in place: what is
            negligible compared with it is calm.
        """
        P = len(boxes[0][0])
        run = Run(np.ones(P, dtype=bool), np.zeros(P, dtype=bool), change)
        results = [np.zeros((2, P, size)) for size in self._sizes]
        peaks = np.zeros(self.size) if peaks is None else peaks
        work: dict[int, Bound] = {}
        with np.errstate(all="ignore"):
            for i, (operation, inputs, outputs, constant) in enumerate(self._steps):
                if operation == ca.OP_INPUT:
                    lower, upper = boxes[inputs[0]]
                    work[outputs[0]] = lower[:, inputs[1]], upper[:, inputs[1]]
                elif operation == ca.OP_CONST:
                    work[outputs[0]] = np.float64(constant), np.float64(constant)  # type: ignore[assignment]
                elif operation == ca.OP_OUTPUT:
                    place = self._places[outputs[0]][outputs[1]]
                    for bound, result in zip(work[inputs[0]], results[outputs[0]], strict=True):
                        result[:, place] = bound
                else:
                    arguments = [work[j] for j in inputs]
                    found = RULES.get(operation, unknown)(run, *arguments)
                    work[outputs[0]] = found
                    if operation not in ARITHMETIC:
                        peaks[i] = max(peaks[i], _largest(found))
                        run.settle(found[1] - found[0] <= NEGLIGIBLE * peaks[i])
        whole = np.concatenate(results, axis=2)
        lower = np.where(np.isnan(whole[0]), -np.inf, whole[0])
        upper = np.where(np.isnan(whole[1]), np.inf, whole[1])
        return Enclosed(lower, upper, run.calm, run.jumps)

    @property
    def size(self) -> int:
        """Number of instructions."""
        return len(self._steps)


def _step(function: ca.Function, i: int) -> tuple[int, list[int], list[int], float]:
    operation = int(function.instruction_id(i))
    constant = float(function.instruction_constant(i)) if operation == ca.OP_CONST else 0.0
    return operation, function.instruction_input(i), function.instruction_output(i), constant


def _places(pattern: ca.Sparsity) -> list[int]:
    """The place of each stored entry in the column-major vector of all."""
    rows, columns = pattern.get_triplet()
    return [r + c * pattern.size1() for r, c in zip(rows, columns, strict=True)]


def _largest(x: Bound) -> float:
    """The largest finite absolute value."""
    size = np.maximum(np.abs(x[0]), np.abs(x[1]))
    return float(np.max(size, where=np.isfinite(size), initial=0.0))
