"""Bytes of ROS messages to numbers, without message objects.

Behind the header (stamp and ``frame_id``) of `sensor_msgs/Imu` and `sensor_msgs/Temperature` stand
nothing but 64-bit floating-point numbers, so that messages of one ``frame_id`` are rows of one
array. ROS 1 writes them little-endian and unaligned (wiki.ros.org/roscpp/Overview/Messages and
Serialization), ROS 2 in either byte order, aligned to eight bytes counted from the end of the
encapsulation header (OMG CDR, formal/2021-11-01, 9.3; DDSI-RTPS 2.5, 10.2).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError

_Bytes = npt.NDArray[np.uint8]
_Integers = npt.NDArray[np.int64]

ANGULAR_VELOCITY, LINEAR_ACCELERATION = 13, 25
"""First number of these parts of `sensor_msgs/Imu`; their covariances follow."""


@dataclass(frozen=True)
class Message:
    """A type of message: a header, then numbers.

    Attributes
    ----------
    count : int
        Numbers behind the header.
    columns : mapping of str to int
        Name of a column, with its unit -> which of the numbers it is.
    """

    count: int
    columns: Mapping[str, int]


IMU = Message(
    37,
    {f"gyro_{axis} [rad/s]": ANGULAR_VELOCITY + i for i, axis in enumerate("xyz")}
    | {f"accel_{axis} [m/s^2]": LINEAR_ACCELERATION + i for i, axis in enumerate("xyz")},
)

TEMPERATURE = Message(2, {"temperature [degC]": 0})

COVARIANCE_OF = {"gyro": ANGULAR_VELOCITY + 3, "accel": LINEAR_ACCELERATION + 3}
"""First number of the covariance of each sensor: -1 where the message does not have it."""


@dataclass(frozen=True)
class Serialization:
    """How the header is written.

    Attributes
    ----------
    stamp : int
        Offset of the stamp, bytes.
    is_cdr : bool
        Whether an encapsulation header says the byte order and numbers are aligned.
    """

    stamp: int
    is_cdr: bool

    @property
    def text(self) -> int:
        """Offset of ``frame_id``, behind its length."""
        return self.stamp + 12

    def offset(self, frame: int) -> int:
        """Where the numbers begin behind a ``frame_id`` of so many bytes."""
        end = self.text + frame
        return 4 + -(-(end - 4) // 8) * 8 if self.is_cdr else end


ROS1, CDR = Serialization(4, False), Serialization(4, True)
"""The stamp follows a counter in ROS 1, the encapsulation header in ROS 2."""


def decode(
    raw: Sequence[bytes],
    message: Message,
    wanted: Sequence[int],
    serialization: Serialization,
    where: Callable[[int], str],
) -> tuple[_Integers, list[FloatArray]]:
    """Stamps and numbers of messages.

    Parameters
    ----------
    raw : sequence of bytes
        Messages as they are stored.
    wanted : sequence of int
        Which of the numbers behind the header.
    where : callable
        Index of a message -> where it is.

    Returns
    -------
    stamps : (n,) ndarray of int
        Of the headers, ns.
    numbers : list of (n,) ndarray

    Raises
    ------
    InputError
        At a message that is too short, or of another encoding.
    """
    n = len(raw)
    sizes = np.fromiter(map(len, raw), np.int64, n)
    short = np.flatnonzero(sizes < serialization.text)
    if short.size:
        raise _cut_off(where(int(short[0])))
    joined = np.frombuffer(b"".join(raw), np.uint8)
    starts = np.cumsum(sizes) - sizes
    is_even = bool(np.all(sizes == sizes[0]))  # as a topic is, almost always: no copies
    text = np.arange(serialization.text)
    head = joined.reshape(n, -1)[:, : text.size] if is_even else joined[starts[:, None] + text]
    is_big = np.zeros(n, dtype=bool)
    if serialization.is_cdr:
        is_big = head[:, 1] == 0
        foreign = np.flatnonzero((head[:, 0] != 0) | (head[:, 1] > 1))
        if foreign.size:
            row = int(foreign[0])
            raise InputError(
                f"{where(row)}: encoding 0x{head[row, :2].tobytes().hex()} is not plain CDR: "
                "record with a usual RMW, or convert the bag with ros2 bag convert"
            )
    length = np.ascontiguousarray(head[:, -4:])
    frames = length.view("<u4")[:, 0].astype(np.int64)
    if np.any(is_big):
        frames[is_big] = length.view(">u4")[is_big, 0]
    stamps = np.empty(n, np.int64)
    numbers = [np.empty(n) for _ in wanted]
    left = np.ones(n, dtype=bool)
    while np.any(left):  # once: a topic has one frame_id, almost always
        first = int(np.argmax(left))
        size, frame = int(sizes[first]), int(frames[first])
        alike = (sizes == size) & (frames == frame) & (is_big == is_big[first])
        offset, order = serialization.offset(frame), ">" if is_big[first] else "<"
        if offset + 8 * message.count > size:
            raise _cut_off(where(first))
        rows = slice(None) if np.all(alike) else np.flatnonzero(alike)
        if isinstance(rows, slice):
            block = joined.reshape(n, size)
        else:
            block = joined[starts[rows][:, None] + np.arange(size)]
        # Seconds after 2038 are unsigned in ROS 1, and in ROS 2 as drivers write them.
        seconds = _field(block, serialization.stamp, f"{order}u4").astype(np.int64)
        stamps[rows] = seconds * 10**9 + _field(block, serialization.stamp + 4, f"{order}u4")
        for values, index in zip(numbers, wanted, strict=True):
            values[rows] = _field(block, offset + 8 * index, f"{order}f8")
        left &= ~alike
    return stamps, numbers


def _field(block: _Bytes, offset: int, dtype: str) -> npt.NDArray[Any]:
    """A number of each row, wherever it stands in it."""
    rows, size = block.shape
    return np.ndarray((rows,), dtype, block, offset, (size,))


def _cut_off(place: str) -> InputError:
    return InputError(f"{place} is cut off: record the bag again, or cut it before that message")
