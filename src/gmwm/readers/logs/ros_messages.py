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

    count: Numbers behind the header.
    columns: Name of a column, with its unit -> index of its number.
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

    stamp: Offset of the stamp, bytes.
    is_cdr: Whether an encapsulation header says the byte order and numbers are aligned.
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

_LITTLE = 0x0100
_ORDERS = {0x0000: ">", _LITTLE: "<"}
"""Byte order of plain CDR, by the two bytes of its encapsulation header as a small number."""


def decode(
    raw: Sequence[bytes],
    message: Message,
    wanted: Sequence[int],
    serialization: Serialization,
    where: Callable[[int], str],
) -> tuple[_Integers, list[FloatArray]]:
    """Stamps of the headers, ns, and numbers of messages.

    raw: Messages as they are stored.
    wanted: Indices of the numbers behind the header.
    where: Index of a message -> its place.
    Returns: (n,) stamps; (n,) of each number that is wanted.
    Raises InputError at a message that is too short, or of another encoding.
    """
    n = len(raw)
    lengths = list(map(len, raw))
    is_even = lengths.count(lengths[0]) == n  # as a topic is, almost always: no copies
    sizes = np.full(n, lengths[0]) if is_even else np.array(lengths)
    if sizes.min() < serialization.text:
        raise _cut_off(where(int(np.argmax(sizes < serialization.text))))
    joined = np.frombuffer(b"".join(raw), np.uint8)
    starts = np.cumsum(sizes) - sizes
    if is_even:
        head = joined.reshape(n, -1)
    else:
        head = joined[starts[:, None] + np.arange(serialization.text)]
    codes = _field(head, 0, "<u2") if serialization.is_cdr else np.full(n, _LITTLE)
    frames = _field(head, serialization.text - 4, "<u4")
    stamps = np.empty(n, np.int64)
    numbers = [np.empty(n) for _ in wanted]
    left = np.ones(n, dtype=bool)
    while left.any():  # once: a topic has one encoding and one frame_id, almost always
        first = int(np.argmax(left))
        size, code = int(sizes[first]), int(codes[first])
        if code not in _ORDERS:
            raise InputError(
                f"{where(first)}: encoding 0x{code.to_bytes(2, 'little').hex()} is not plain CDR: "
                "record with a usual RMW, or convert the bag with ros2 bag convert"
            )
        order = _ORDERS[code]
        alike = (sizes == size) & (codes == code) & (frames == frames[first])
        if alike.all():
            rows: slice | _Integers = slice(None)
            block = joined.reshape(n, size)
        else:
            rows = np.flatnonzero(alike)
            block = joined[starts[rows][:, None] + np.arange(size)]
        offset = serialization.offset(int(_field(block, serialization.text - 4, f"{order}u4")[0]))
        if offset + 8 * message.count > size:
            raise _cut_off(where(first))
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
