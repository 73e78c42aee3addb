"""How far frames of a robot are from where they should be, along two motions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt

from hovi.robot.robot import Robot

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FrameDistance:
    """The distance of each of some frames at M places of two motions.

    frames: their names. each: of every frame's origin, shape (M, F), in [m].
    """

    frames: tuple[str, ...]
    each: Array

    @classmethod
    def between(cls, robot: Robot, q: Array, other: Array, frame: str | None = None) -> Self:
        """The distance between configurations (M, nq) of one motion and of another.

        frame: whose origin is followed; the robot's tip_frames when None.
        Raises InputError for a frame that is unknown or does not move.
        """
        frames = robot.measured_frames(frame)
        return cls.of(
            frames, robot.frame_positions(frames, q), robot.frame_positions(frames, other)
        )

    @classmethod
    def of(cls, frames: tuple[str, ...], places: Array, others: Array) -> Self:
        """The same from positions of the frames, each of shape (M, F, 3), in [m]."""
        return cls(frames, np.asarray(np.linalg.norm(places - others, axis=-1)))

    @property
    def largest(self) -> Array:
        """The largest of all frames at every place, shape (M,), in [m]."""
        return np.asarray(self.each.max(axis=1))

    @property
    def frame(self) -> str:
        """The frame with the largest distance anywhere."""
        return self.frames[int(np.argmax(self.each.max(axis=0)))]

    def frame_at(self, place: int) -> str:
        """The frame with the largest distance at one place."""
        return self.frames[int(np.argmax(self.each[place]))]
