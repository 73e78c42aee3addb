"""The distance of frames between two motions of a robot."""

from __future__ import annotations

from typing import Self

import numpy as np
import numpy.typing as npt

from hovi.robot.robot import Robot
from hovi.system.dataclass import dataclass

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FrameDistance:
    """The distance of several frames between two motions, at M samples.

    frames: their names. each: of every frame's origin, shape (M, F), in [m].
    """

    frames: tuple[str, ...]
    each: Array

    @classmethod
    def between(cls, robot: Robot, q: Array, other: Array, frame: str | None = None) -> Self:
        """The distance between configurations q and other, each of shape (M, nq).

        frame: whose origin is compared; all of the robot's tip_frames if None.
        Raises InputError for a frame that is unknown or does not move.
        """
        frames = robot.measured_frames(frame)
        return cls.of(
            frames, robot.frame_positions(frames, q), robot.frame_positions(frames, other)
        )

    @classmethod
    def of(cls, frames: tuple[str, ...], positions: Array, others: Array) -> Self:
        """The distance between positions of the frames in two motions, (M, F, 3) each, in [m]."""
        return cls(frames, np.asarray(np.linalg.norm(positions - others, axis=-1)))

    @property
    def largest(self) -> Array:
        """The largest of all frames at each sample, shape (M,), in [m]."""
        return np.asarray(self.each.max(axis=1))

    @property
    def frame(self) -> str:
        """The frame with the largest distance of all samples."""
        return self.frames[int(np.argmax(self.each.max(axis=0)))]

    def frame_at(self, sample: int) -> str:
        """The frame with the largest distance at one sample."""
        return self.frames[int(np.argmax(self.each[sample]))]
