"""The formats that can be read, and which of them a file has, by its first bytes and its name.

A format is one module with a function that opens a file as tables, and one entry of `FORMATS`. The
help of the command line, the ``format`` of `gmwm.read` and its docstring follow from the entry.
This module imports no library, so that the command line can ask for the names at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any

from gmwm.errors import InputError

if TYPE_CHECKING:
    from gmwm.readers.table import Table

CLOCKS = ("header", "log")  # stamps of messages: of their headers, or of when they were recorded


@dataclass(frozen=True)
class Wanted:
    """What the caller asks of a file."""

    topics: Sequence[str] = ()  # by default the only one of an IMU, or one of each sensor
    clock: str = "header"  # which of `CLOCKS` counts
    by_channel: bool = False  # whether channels are named, all of which one sensor may have
    damaged: bool = False  # whether the rest of a damaged file is used
    every_imu: bool = False  # whether all IMUs of a log are wanted, each with tables of its own
    layout: str | None = None  # of a binary file without a header


@dataclass(frozen=True)
class Format:
    """A kind of file.

    opener: Function of a path and `Wanted` that gives tables, as "module:name" in this room; it
        asks for the libraries of an extra that it needs by `library` of `gmwm.readers.table`.
    """

    name: str
    title: str  # what messages call such files
    opener: str
    suffixes: tuple[str, ...] = ()
    magic: tuple[bytes, ...] = ()  # bytes that its files begin with
    is_log: bool = False  # whether there may be several topics of messages to choose from
    has_clocks: bool = False  # whether messages have stamps of their header and of their recording


_TEXT = Format("text", "CSV and other delimited text (plain or .gz)", "csv_table:open_text")
_FRAME = Format("a table in memory", "tables in memory", "formats.arrays:open_frame")
_RECORDS = Format("records", "binary files of a layout", "formats.binary:open_records")

FORMATS = (
    _TEXT,
    Format("numpy", "NPY and NPZ", "formats.arrays:open_numpy", (".npy", ".npz")),
    # By content before by name: a MAT file of version 7.3 is one of HDF5 behind 512 bytes.
    Format("hdf5", "HDF5", "formats.hdf5:open_hdf5", (".h5", ".hdf5", ".hdf"),
           (b"\x89HDF\r\n\x1a\n", b"MATLAB 7.3")),
    Format("mat", "MAT", "formats.hdf5:open_mat", (".mat",), (b"MATLAB 5.0",)),
    Format("parquet", "Parquet", "formats.arrays:open_parquet", (".parquet",), (b"PAR1",)),
    Format("feather", "Feather", "formats.arrays:open_feather", (".feather", ".arrow"),
           (b"ARROW1", b"FEA1")),
    Format("rosbag", "bags of ROS 1", "logs.rosbag:open_bag", (".bag",), (b"#ROSBAG",), True, True),
    Format("rosbag2", "bags of ROS 2", "logs.rosbag:open_bag", (".mcap", ".db3"),
           (b"\x89MCAP", b"SQLite format 3"), True, True),
    Format("ulog", "PX4 logs", "logs.ulog:open_ulog", (".ulg",), (b"ULog\x01\x12\x35",), True),
    # Other binary files have the suffix .bin too.
    Format("ardupilot", "ArduPilot logs", "logs.ardupilot:open_ardupilot", (), (b"\xa3\x95",),
           True),
)  # fmt: skip
"""All formats of files; a file of no other format is text."""

NAMES = tuple(each.name for each in FORMATS)
READABLE = f"gmwm reads {', '.join(each.title for each in FORMATS)}"


def open_tables(data: Any, wanted: Wanted, name: str | None = None) -> Sequence[Table]:
    """Open a file or a table in memory, whatever it is; sensors with own rates are own tables."""
    if wanted.layout is not None and name is not None:
        raise InputError("layout is for a binary file without a header: leave out format")
    if wanted.clock not in CLOCKS:
        raise InputError(f"clock = {wanted.clock!r}: give one of {', '.join(CLOCKS)}")
    if name is not None and name not in NAMES:
        raise InputError(f"format = {name!r}: give one of {', '.join(NAMES)}")
    if is_frame(data) and name is not None:
        raise InputError("a table in memory has no format: format is for files, leave it out")
    found = _RECORDS if wanted.layout is not None else _format_of(data, name)
    source = found.name if found is _FRAME else Path(data).name
    if wanted.topics and not found.is_log:
        raise InputError(f"{source} has no topics: topic is for bags and flight logs, leave it out")
    if wanted.clock != CLOCKS[0] and not found.has_clocks:
        raise InputError(f"{source} has one clock: clock is for bags, leave it out")
    opener = resolve_name(f"gmwm.readers.{found.opener}")
    tables: Sequence[Table] = opener(data if found is _FRAME else Path(data), wanted)
    return tables


def is_frame(data: object) -> bool:
    """Whether it is a table of pandas, polars, Arrow, or gives itself as one."""
    return not isinstance(data, type) and any(
        hasattr(data, name) for name in ("iloc", "to_arrow", "__arrow_c_stream__")
    )


def _format_of(data: Any, name: str | None) -> Format:
    from gmwm._core.files import existing_file, opened

    if is_frame(data):
        return _FRAME
    path = Path(data)
    if name is not None:
        if name != "rosbag2":  # a bag of ROS 2 may be a folder, which its reader checks
            existing_file(path)
        return next(each for each in FORMATS if each.name == name)
    with suppress(OSError, ValueError):  # ValueError: a null character in the name
        if path.is_dir() and any(
            each.name == "metadata.yaml" or not {".db3", ".mcap"}.isdisjoint(each.suffixes)
            for each in path.iterdir()
        ):
            return next(each for each in FORMATS if each.name == "rosbag2")
    suffix, head = existing_file(path).suffix.lower(), b""
    with suppress(OSError), opened(path) as stream:
        head = stream.read(max(len(magic) for each in FORMATS for magic in each.magic))
    by_content = [each for each in FORMATS if each.magic and head.startswith(each.magic)]
    by_name = [each for each in FORMATS if suffix in each.suffixes]
    found = next(iter(by_content + by_name), _TEXT)
    # MATLAB's save -ascii writes text into files of the same name; its others have binary headers.
    is_ascii = found.name == "mat" and not by_content and head[:16].isascii() and b"\0" not in head
    return _TEXT if is_ascii and head.split() else found
