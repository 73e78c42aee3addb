"""A figure that notebooks show without pyplot."""

from __future__ import annotations

import io

from matplotlib.figure import Figure

_DPI = 100


class ShownFigure(Figure):
    """A Matplotlib figure without global state, which is shown as the value of a cell."""

    def _repr_png_(self) -> bytes:
        stream = io.BytesIO()
        self.savefig(stream, format="png", dpi=_DPI, metadata={"Software": None})
        return stream.getvalue()
