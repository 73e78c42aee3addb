"""Bars in space, drawn by matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from hovi.exchange.film.shot import Shot

Array = npt.NDArray[np.float64]

_COLOR = "#0072b2"


class Bars:
    """A picture with room for all points of a motion.

    points: shape (..., 3), in [m]. shot: size of the picture, and from where the camera looks; it
        is as near as the motion allows. caption: lines at the top.
    """

    def __init__(self, points: Array, shot: Shot, caption: Sequence[str] = ()) -> None:
        size = shot.size
        figure = Figure(figsize=(size[0] / 100, size[1] / 100), dpi=100)
        lines = [fill(each, size[0] // 6).replace("$", r"\$") for each in caption]
        figure.text(0.01, 0.99, "\n".join(lines), va="top", fontsize=7.0, color="#a33c00")
        self._canvas: Any = FigureCanvasAgg(figure)
        axes: Any = figure.add_axes((0.0, 0.05, 1.0, 0.95), projection="3d")
        low, high = points.reshape(-1, 3).min(axis=0), points.reshape(-1, 3).max(axis=0)
        half = max(0.55 * float((high - low).max()), 1e-3)
        middle = 0.5 * (low + high)
        limits = [(c - half, c + half) for c in middle.tolist()]
        axes.set(xlim=limits[0], ylim=limits[1], zlim=limits[2])
        toward = _direction(shot, middle)
        if toward is not None:
            azimuth = np.degrees(np.arctan2(toward[1], toward[0]))
            elevation = np.degrees(np.arctan2(toward[2], np.hypot(*toward[:2])))
            axes.view_init(float(elevation), float(azimuth))
        self._axes = axes
        self._lines: list[Any] = []

    def draw(self, bars: Sequence[Array]) -> npt.NDArray[np.uint8]:
        """The picture of some bars, each from one point to another, (2, 3)."""
        for line in self._lines:
            line.remove()
        style = {"color": _COLOR, "linewidth": 4, "solid_capstyle": "round"}
        self._lines = [self._axes.plot(*bar.T, **style)[0] for bar in bars]
        self._canvas.draw()
        return np.asarray(self._canvas.buffer_rgba(), dtype=np.uint8)[:, :, :3].copy()


def _direction(shot: Shot, middle: Array) -> Array | None:
    """From what is looked at to the camera, (3,); None for that of matplotlib."""
    if shot.position is None:
        return None if shot.direction is None else np.array(shot.direction)
    target = middle if shot.target is None else np.array(shot.target)
    return np.asarray(np.array(shot.position) - target)
