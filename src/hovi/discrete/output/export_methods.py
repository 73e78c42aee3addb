"""Methods of a motion that write it for other programs."""

from __future__ import annotations

import os
from typing import Any

from hovi.checks.arguments import check_arguments
from hovi.discrete.output.exporter import exported

Path = str | os.PathLike[str]


@check_arguments
class ExportMethods:
    """`to_...` for every export format, as `hovi.export` writes it.

    path: the file, which is written completely or not at all. rate: samples per second, or pictures
    of a film; that of the format when None. Raises InputError for an invalid rate, extension or
    motion, DisplayError when the file cannot be written or an optional library is missing.
    """

    def to_csv(self, path: Path, rate: float | None = None) -> None:
        """Write t, q, v, a and tau as comma-separated values in full precision."""
        exported(self, path, "csv", rate)

    def to_numpy(self, path: Path, rate: float | None = None) -> None:
        """Write an npz archive of plain arrays."""
        exported(self, path, "numpy", rate)

    def to_parquet(self, path: Path, rate: float | None = None) -> None:
        """Write a Parquet table."""
        exported(self, path, "parquet", rate)

    def to_joint_trajectory(
        self, path: Path, rate: float | None = None, *, efforts: bool = False
    ) -> None:
        """Write a ROS 2 trajectory_msgs/JointTrajectory, as YAML or JSON by the extension.

        efforts: fill in the field `effort` too, which many joint_trajectory_controllers refuse.
        """
        exported(self, path, "joint-trajectory", rate, **({"efforts": True} if efforts else {}))

    def to_robot_trajectory(self, path: Path, rate: float | None = None) -> None:
        """Write MoveIt's moveit_msgs/RobotTrajectory, as YAML or JSON by the extension."""
        exported(self, path, "robot-trajectory", rate)

    def to_urscript(
        self,
        path: Path,
        rate: float | None = None,
        *,
        lookahead_time: float | None = None,
        gain: float | None = None,
    ) -> None:
        """Write a URScript program for an arm of Universal Robots, a target per sample.

        lookahead_time: of servoj, 0.03 to 0.2, in [s]; 0.1 when None. gain: of servoj, 100 to 2000;
        300 when None.
        """
        exported(self, path, "urscript", rate, lookahead_time=lookahead_time, gain=gain)

    def to_franka(self, path: Path, rate: float | None = None) -> None:
        """Write the table of seven joints per millisecond that libfranka's example reads."""
        exported(self, path, "franka", rate)

    def to_mcap(self, path: Path, rate: float | None = None) -> None:
        """Write an MCAP file of ROS 2 messages: joint states, efforts, TF and the URDF."""
        exported(self, path, "mcap", rate)

    def to_mujoco(self, path: Path, rate: float | None = None) -> None:
        """Write a MuJoCo model with a keyframe of positions, velocities and controls a sample."""
        exported(self, path, "mujoco", rate)

    def to_rerun(self, path: Path, rate: float | None = None) -> None:
        """Write a recording of the Rerun viewer: curves of the joints and the moving robot."""
        exported(self, path, "rerun", rate)

    def to_video(
        self,
        path: Path,
        rate: float | None = None,
        *,
        size: Any = None,
        camera: Any = None,
        speed: float | None = None,
    ) -> None:
        """Write an MP4 video of the replay. size, camera, speed: as for `hovi.export`."""
        exported(self, path, "video", rate, size=size, camera=camera, speed=speed)

    def to_gif(
        self,
        path: Path,
        rate: float | None = None,
        *,
        size: Any = None,
        camera: Any = None,
        speed: float | None = None,
    ) -> None:
        """Write a GIF of the replay. size, camera, speed: as for `hovi.export`."""
        exported(self, path, "gif", rate, size=size, camera=camera, speed=speed)
