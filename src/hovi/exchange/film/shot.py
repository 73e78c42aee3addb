"""How a motion is filmed: the size of the pictures, the camera and the speed."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from hovi.errors import InputError, nearest
from hovi.system.dataclass import dataclass

Point = tuple[float, float, float]

SIZE = 640, 480
"""Width and height where none is given, in pixels."""
SMALLEST, LARGEST = (128, 128), (1920, 1080)
"""Bounds of the width and the height, in pixels; Chromium draws no picture of 64x64."""
VIEWS: dict[str, Point] = {
    "front": (1.0, 0.0, 0.15),
    "side": (0.0, -1.0, 0.15),
    "top": (0.0, -1e-3, 1.0),
    "iso": (1.0, -1.0, 0.8),
}
"""Directions from the middle of a motion to the camera, in the world's frame."""
_SIZE = re.compile(r"(\d{1,5})\s*[xX]\s*(\d{1,5})")
_CAMERA = (
    "a view (front, side, top, iso), a position in [m], or a position and the point that it looks "
    'at, such as "1.5,-1.2,0.8:0,0,0.4"'
)


@dataclass(frozen=True)
class Shot:
    """How a motion is filmed, valid once built.

    size: width and height of the pictures, in pixels.
    direction: from the middle of the motion to the camera, which is as near as the motion allows;
        None for the replay page's own.
    position, target: of the camera, and the point that it looks at, in [m] in the world's frame;
        None where there is a direction. A target of None is the middle of the motion.
    speed: seconds of the motion per second of the film.
    """

    size: tuple[int, int] = SIZE
    direction: Point | None = None
    position: Point | None = None
    target: Point | None = None
    speed: float = 1.0

    @classmethod
    def of(cls, size: Any = None, camera: Any = None, speed: float = 1.0) -> Shot:
        """From what users give. Raises InputError.

        size: (width, height), or a text such as "1280x720". camera: the name of a view, a position,
        or a position and a target: numbers, or a text such as "1.5,-1.2,0.8:0,0,0.4".
        """
        if not (isinstance(speed, int | float) and math.isfinite(speed) and speed > 0):
            raise InputError(f"the speed of a film must be a positive number, got {speed!r}.")
        known = SIZE if size is None else _size(size)
        if camera is None:
            return cls(known, speed=float(speed))
        if isinstance(camera, str) and not re.search(r"[\d.]", camera):
            if camera not in VIEWS:
                raise InputError(f"there is no view {camera!r}: {nearest(camera, VIEWS)}")
            return cls(known, direction=VIEWS[camera], speed=float(speed))
        position, target = _points(camera)
        return cls(known, position=position, target=target, speed=float(speed))


def _size(given: Any) -> tuple[int, int]:
    """Width and height, even as H.264 needs them."""
    numbers: Any = given
    if isinstance(given, str):
        match = _SIZE.fullmatch(given.strip())
        numbers = match and [int(each) for each in match.groups()]
    is_pair = isinstance(numbers, Sequence) and len(numbers) == 2
    if not is_pair or not all(isinstance(x, int) and x % 2 == 0 for x in numbers):
        raise InputError(
            f"the size of a film must be two even numbers of pixels, such as 1280x720, got "
            f"{given!r}."
        )
    if any(not low <= x <= high for low, x, high in zip(SMALLEST, numbers, LARGEST, strict=True)):
        low, high = ("x".join(map(str, each)) for each in (SMALLEST, LARGEST))
        raise InputError(f"the size of a film must be from {low} to {high} pixels, got {given!r}.")
    return numbers[0], numbers[1]


def _points(given: Any) -> tuple[Point, Point | None]:
    """A position, and a target if there is one."""
    parts = [part.split(",") for part in given.split(":")] if isinstance(given, str) else given
    try:
        numbers = np.array(parts)
        numbers = numbers.astype(float) if numbers.dtype.kind in "iufU" else np.zeros(0)
    except (TypeError, ValueError):
        numbers = np.zeros(0)
    if numbers.shape not in ((3,), (1, 3), (2, 3)) or not np.isfinite(numbers).all():
        raise InputError(f"the camera of a film is {_CAMERA}, got {given!r}.")
    first, *others = np.atleast_2d(numbers).tolist()
    if others and math.dist(first, others[0]) < 1e-6:
        raise InputError(f"the camera of a film looks at where it is, {first}; move one of both.")
    return tuple(first), tuple(others[0]) if others else None
