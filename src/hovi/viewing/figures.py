"""Writing figures reproducibly and atomically, cautions under them, and zeros of two axes."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

from hovi.discrete.output.caution import caution_lines
from hovi.errors import DisplayError
from hovi.system.files import reason, whole_file

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_DPI = 150
_COLUMNS_PER_INCH = 16.5  # of text of the size of cautions
_METADATA: dict[str, dict[str, str | None]] = {
    ".png": {"Software": None},
    ".pdf": {"CreationDate": None},
    ".svg": {"Date": None},
}


def write_figure(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure as PNG, PDF or SVG by its suffix. Raises DisplayError."""
    suffix = Path(path).suffix.lower()
    if suffix not in _METADATA:
        raise DisplayError(
            f"the picture {Path(path).name!r} has no known format; "
            f"use a name that ends in {', '.join(_METADATA)}."
        )
    try:
        with whole_file(path) as stream:
            figure.savefig(stream, format=suffix[1:], dpi=_DPI, metadata=_METADATA[suffix])
    except OSError as error:
        raise DisplayError(f"cannot write the picture {str(path)!r}: {reason(error)}.") from error


def draw_cautions(figure: Figure, motions: Sequence[Mapping[str, Any]]) -> None:
    """Write the cautions of motions, by their metadata, under a figure of constrained layout."""
    columns = int(_COLUMNS_PER_INCH * figure.get_figwidth())
    lines = [fill(each, columns, subsequent_indent="  ") for each in caution_lines(motions)]
    if lines:
        text = "\n".join(lines).replace("$", r"\$")  # no formula
        figure.supxlabel(text, x=0.01, ha="left", fontsize=7.0, color="#a33c00")


def align_zeros(one: Axes, other: Axes) -> None:
    """Extend the limits of two axes until their zeros are at the same height.

    With limits -d <= 0 <= u relative to the extent d + u, both axes get the larger d and the larger
    u. Axes whose range is farther from zero than it is wide are left as they are: including zero
    would compress their curves.
    """
    limits = [ax.get_ylim() for ax in (one, other)]
    if any(max(low, -high) > high - low for low, high in limits):
        return
    spans = [(max(-low, 0.0), max(high, 0.0)) for low, high in limits]
    below = max(d / (d + u) for d, u in spans)
    above = max(u / (d + u) for d, u in spans)
    for ax, (d, u) in zip((one, other), spans, strict=True):
        ax.set_ylim(-below * (d + u), above * (d + u))
