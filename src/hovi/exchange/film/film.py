"""A motion as a video or a GIF."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any

from hovi.discrete.trajectory import Trajectory
from hovi.errors import InputError
from hovi.exchange.film.pictures import Picture, picture_times, pictures
from hovi.exchange.film.shot import Shot
from hovi.exchange.libraries import library
from hovi.exchange.whole_export import whole_export, written_elsewhere

MAX_GIF_RATE = 50.0
"""Viewers slow a GIF down whose pictures last less than 20 ms."""


def write_video(
    trajectory: Trajectory,
    path: str | os.PathLike[str],
    rate: float = 30.0,
    *,
    size: Any = None,
    camera: Any = None,
    speed: float = 1.0,
) -> None:
    """Write an MP4 video (H.264) of the replay.

    rate: pictures per second. size, camera, speed: as for Shot.of.
    Raises InputError for an invalid rate, size, camera or speed, DisplayError when the file cannot
    be written, the motion cannot be drawn or imageio-ffmpeg is missing.
    """
    shot = Shot.of(size, camera, speed)
    picture_times(trajectory, rate, shot)
    ffmpeg = library("imageio_ffmpeg", "imageio-ffmpeg", "the format 'video'")
    with written_elsewhere(path, "video") as elsewhere:
        about = {"fps": rate, "macro_block_size": 2, "quality": 7}
        writer = ffmpeg.write_frames(str(elsewhere), shot.size, **about)
        writer.send(None)
        try:
            for picture in pictures(trajectory, rate, shot):
                writer.send(picture.tobytes())
        finally:
            writer.close()


def write_gif(
    trajectory: Trajectory,
    path: str | os.PathLike[str],
    rate: float = 15.0,
    *,
    size: Any = None,
    camera: Any = None,
    speed: float = 1.0,
) -> None:
    """Write a GIF of the replay, which repeats; its pictures last whole hundredths of a second.

    rate: pictures per second, at most MAX_GIF_RATE. size, camera, speed: as for Shot.of.
    Raises InputError for an invalid rate, size, camera or speed, DisplayError when the file cannot
    be written or the motion cannot be drawn.
    """
    shot = Shot.of(size, camera, speed)
    picture_times(trajectory, rate, shot)
    if rate > MAX_GIF_RATE:
        raise InputError(
            f"a GIF has at most {MAX_GIF_RATE:g} pictures per second, got {rate:g}; choose a lower "
            "rate, or the format 'video'."
        )
    image = library("PIL.Image", "pillow", "the format 'gif'")
    with whole_export(path, "GIF") as stream:
        shown: Iterator[Picture] = pictures(trajectory, rate, shot)
        first, others = image.fromarray(next(shown)), map(image.fromarray, shown)
        first.save(
            stream,
            format="GIF",
            save_all=True,
            append_images=others,
            duration=10 * round(100 / rate),
            loop=0,
        )
