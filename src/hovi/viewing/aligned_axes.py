"""Two axes of one panel, their zeros at the same height."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def align_zeros(one: Axes, other: Axes) -> None:
    """Extend the limits of both until zero has the same height in both.

    With limits -d <= 0 <= u of each, in shares of their extent d + u, both get the larger d and the
    larger u. Left alone where a range is farther from zero than it is wide: zero would squash it.
    """
    limits = [ax.get_ylim() for ax in (one, other)]
    if any(max(low, -high) > high - low for low, high in limits):
        return
    spans = [(max(-low, 0.0), max(high, 0.0)) for low, high in limits]
    below = max(d / (d + u) for d, u in spans)
    above = max(u / (d + u) for d, u in spans)
    for ax, (d, u) in zip((one, other), spans, strict=True):
        ax.set_ylim(-below * (d + u), above * (d + u))
