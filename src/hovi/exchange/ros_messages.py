"""ROS 2 messages as bytes: little-endian CDR, as middleware sends them and bags store them.

Definitions are those of ROS 2's common_interfaces and geometry2, with what they are made of after a
line of 80 equals signs each.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

NANO = 10**9
_RULE = "=" * 80 + "\n"
_TIME = f"{_RULE}MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
_HEADER = f"{_RULE}MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n{_TIME}"
_TRANSFORM = (
    f"{_RULE}MSG: geometry_msgs/TransformStamped\nstd_msgs/Header header\nstring child_frame_id\n"
    "geometry_msgs/Transform transform\n"
    f"{_RULE}MSG: geometry_msgs/Transform\ngeometry_msgs/Vector3 translation\n"
    "geometry_msgs/Quaternion rotation\n"
    f"{_RULE}MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"
    f"{_RULE}MSG: geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n"
)
DEFINITIONS = {
    "sensor_msgs/msg/JointState": (
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n"
        f"float64[] effort\n{_HEADER}"
    ),
    "tf2_msgs/msg/TFMessage": (
        f"geometry_msgs/TransformStamped[] transforms\n{_TRANSFORM}{_HEADER}"
    ),
    "std_msgs/msg/String": "string data\n",
}


class _Cdr:
    """Bytes of one message; numbers are aligned to their size after the header of four bytes."""

    def __init__(self) -> None:
        self._bytes = bytearray()

    def add(self, kind: str, value: float) -> None:
        """Add one number. kind: as in `struct`, such as "I" or "d"."""
        size = struct.calcsize(kind)
        self._bytes += bytes(-len(self._bytes) % size) + struct.pack(f"<{kind}", value)

    def add_text(self, text: str) -> None:
        """Add a string: its length with the final NUL, and both."""
        data = text.encode() + b"\0"
        self.add("I", len(data))
        self._bytes += data

    def add_doubles(self, values: Sequence[float] | Array) -> None:
        """Add a sequence of doubles."""
        self.add("I", len(values))
        for value in values:
            self.add("d", value)

    def add_header(self, stamp: int, frame: str) -> None:
        """Add a std_msgs/Header. stamp: in [ns]."""
        self.add("i", stamp // NANO)
        self.add("I", stamp % NANO)
        self.add_text(frame)

    def message(self) -> bytes:
        """The message with the header that names its encoding."""
        return b"\0\1\0\0" + bytes(self._bytes)


def joint_state(stamp: int, names: Sequence[str], q: Array, v: Array, tau: Array) -> bytes:
    """A sensor_msgs/JointState. stamp: in [ns]. q, v, tau: shape (J,); (0,) if unknown."""
    data = _Cdr()
    data.add_header(stamp, "")
    data.add("I", len(names))
    for name in names:
        data.add_text(name)
    for values in (q, v, tau):
        data.add_doubles(values)
    return data.message()


def transforms(stamp: int, parts: Iterable[tuple[str, str, Array]]) -> bytes:
    """A tf2_msgs/TFMessage.

    stamp: in [ns]. parts: parent, child, and (x, y, z, qx, qy, qz, qw) of the child in the parent.
    """
    listed, data = list(parts), _Cdr()
    data.add("I", len(listed))
    for parent, child, pose in listed:
        data.add_header(stamp, parent)
        data.add_text(child)
        for value in pose:
            data.add("d", value)
    return data.message()


def string(text: str) -> bytes:
    """A std_msgs/String."""
    data = _Cdr()
    data.add_text(text)
    return data.message()
