"""Curves of many joints can be told apart on white, by people who see fewer colors, too."""

from __future__ import annotations

import itertools

import numpy as np
import numpy.typing as npt

from hovi.viewing.curves.colors import COLORS, curve_style

Array = npt.NDArray[np.float64]

TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
WHITE = np.array([0.9505, 1.0, 1.089])
SEEN = {
    "by most": np.eye(3),
    "without green": np.array(
        [[0.3673, 0.8606, -0.2280], [0.2801, 0.6725, 0.0474], [-0.0118, 0.0429, 0.9689]]
    ),
    "without red": np.array(
        [[0.1523, 1.0526, -0.2049], [0.1145, 0.7863, 0.0992], [-0.0039, -0.0481, 1.0520]]
    ),
}
"""Linear colors as they are seen (Machado, Oliveira and Fernandes, 2009, table 1)."""


def linear(color: str) -> Array:
    """The linear color, (3,), of sRGB such as "#0072B2"."""
    c = np.frombuffer(bytes.fromhex(color[1:]), np.uint8) / 255
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def lab(color: Array) -> Array:
    """CIE L*a*b* of a linear color, in which a distance of 2.3 is just noticed."""
    x, y, z = np.cbrt(np.maximum(TO_XYZ @ color / WHITE, 1e-6))
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def test_every_color_has_a_contrast_of_three_on_white() -> None:
    for color in COLORS:
        assert 1.05 / (TO_XYZ[1] @ linear(color) + 0.05) >= 3.0, color


def test_two_colors_differ_by_twenty_for_everybody() -> None:
    for who, transform in SEEN.items():
        for one, other in itertools.combinations(COLORS, 2):
            seen = [lab(np.clip(transform @ linear(each), 0, 1)) for each in (one, other)]
            assert np.linalg.norm(seen[0] - seen[1]) > 20.0, (who, one, other)


def test_the_styles_of_eighteen_joints_differ() -> None:
    assert len({curve_style(i) for i in range(18)}) == 18
    assert all(curve_style(i).line == "-" for i in range(len(COLORS)))
