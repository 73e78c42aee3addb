"""The colors and dashes of curves, everywhere the same."""

from __future__ import annotations

from typing import Literal, NamedTuple

COLORS = ("#0072B2", "#D55E00", "#009E73", "#AD87AE", "#92592E", "#5670EA", "#333333")
"""On white each has a contrast of 3 or more, and they differ for the color-blind, too: four of the
palette of Okabe and Ito, and three in place of those that are too light for a line."""
_DASHES = ((), (6.0, 2.5), (1.5, 2.0), (6.0, 2.0, 1.5, 2.0))
"""Lengths of dashes and gaps, in line widths; none for a solid line."""


class CurveStyle(NamedTuple):
    """How a curve is drawn. color: such as "#0072B2". dashes: as in _DASHES."""

    color: str
    dashes: tuple[float, ...]

    @property
    def line(self) -> Literal["-"] | tuple[float, tuple[float, ...]]:
        """The line style in the words of Matplotlib."""
        return (0.0, self.dashes) if self.dashes else "-"


def curve_style(number: int) -> CurveStyle:
    """The style of a joint, from 0 on; those of the first 28 differ."""
    row, column = divmod(number, len(COLORS))
    return CurveStyle(COLORS[column], _DASHES[row % len(_DASHES)])
