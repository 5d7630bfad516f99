"""What kind of file this is, by its first bytes and its name."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from gmwm._core.files import existing_file
from gmwm.errors import InputError
from gmwm.readers.csv_table import CsvTable
from gmwm.readers.formats.frame import is_frame, open_feather, open_frame, open_parquet
from gmwm.readers.formats.hdf5 import open_hdf5, open_mat
from gmwm.readers.formats.messages import Wanted, open_ardupilot, open_bag, open_ulog
from gmwm.readers.formats.numpy_file import open_numpy
from gmwm.readers.formats.trial import tried
from gmwm.readers.table import Table

CLOCKS = ("header", "log")
"""Stamps of messages: those of their headers, or the times at which they were recorded."""

_HEAD = 16  # bytes


@dataclass(frozen=True)
class Kind:
    """A kind of file.

    magic: What its files begin with, if they begin alike.
    open: Gives its tables.
    has_topics: Whether there may be several series of messages to choose from.
    has_clocks: Whether messages have the stamp of their header and that of their recording.
    """

    name: str
    suffixes: tuple[str, ...]
    magic: tuple[bytes, ...]
    open: Callable[[Path, Wanted], tuple[Table, ...]]
    has_topics: bool = False
    has_clocks: bool = False


def _alone(open_table: Callable[[Path], Table]) -> Callable[..., tuple[Table, ...]]:
    return lambda path, wanted: (open_table(path),)


_TEXT = Kind("text", (), (), lambda path, wanted: (CsvTable.open(path, wanted.damaged),))

KINDS = (
    # Their names are judged, and what is inside is checked, as they always were.
    Kind("numpy", (".npy", ".npz"), (), _alone(open_numpy)),
    # By content before by name: a MAT file of version 7.3 is one of HDF5 behind 512 bytes.
    Kind(
        "hdf5",
        (".h5", ".hdf5", ".hdf"),
        (b"\x89HDF\r\n\x1a\n", b"MATLAB 7.3"),
        _alone(partial(tried, open_hdf5)),
    ),
    Kind("mat", (".mat",), (b"MATLAB 5.0",), _alone(partial(tried, open_mat))),
    Kind("parquet", (".parquet",), (b"PAR1",), _alone(open_parquet)),
    Kind("feather", (".feather", ".arrow"), (b"ARROW1", b"FEA1"), _alone(open_feather)),
    Kind("rosbag", (".bag",), (b"#ROSBAG",), open_bag, True, True),
    Kind("rosbag2", (".mcap", ".db3"), (b"\x89MCAP", b"SQLite format 3"), open_bag, True, True),
    Kind("ulog", (".ulg",), (b"ULog\x01\x12\x35",), open_ulog, True),
    # Other binary files have the suffix .bin too.
    Kind("ardupilot", (), (b"\xa3\x95",), open_ardupilot, True),
)
"""All but text, which begins with anything."""


NAMES = (*(kind.name for kind in KINDS), _TEXT.name)
"""Of kinds of files, as ``format`` of `gmwm.read` has them."""


def open_tables(data: Any, wanted: Wanted, form: str | None = None) -> tuple[Table, ...]:
    """Open a file or a table in memory, whatever it is.

    wanted: Of a log.
    form: One of `NAMES`, in place of what its first bytes and its name show.
    Returns: several if its sensors have rates of their own.
    Raises InputError if it cannot be used.
    """
    if wanted.clock not in CLOCKS:
        raise InputError(f"clock = {wanted.clock!r}: give one of {', '.join(CLOCKS)}")
    if form is not None and form not in NAMES:
        raise InputError(f"format = {form!r}: give one of {', '.join(NAMES)}")
    path = None if is_frame(data) else Path(data)
    if path is None and form is not None:
        raise InputError("a table in memory has no format: format is for files, leave it out")
    kind = _TEXT if path is None else _kind(path, form)
    source = path.name if path else "a table"
    if wanted.topics and not kind.has_topics:
        raise InputError(f"{source} has no topics: topic is for bags and flight logs, leave it out")
    if wanted.clock != CLOCKS[0] and not kind.has_clocks:
        raise InputError(f"{source} has one clock: clock is for bags, leave it out")
    if path is None:
        return (open_frame(data),)
    return kind.open(path, wanted)


def is_text(path: Path) -> bool:
    """Whether a file is read as delimited text."""
    return _kind(path) is _TEXT


def _kind(path: Path, form: str | None = None) -> Kind:
    if form is not None:
        # A bag of ROS 2 may be a folder, which its reader checks.
        path = path if form == "rosbag2" else existing_file(path)
        return next((kind for kind in KINDS if kind.name == form), _TEXT)
    if _is_bag_folder(path):
        return next(kind for kind in KINDS if kind.name == "rosbag2")
    suffix, head = existing_file(path).suffix.lower(), b""
    with suppress(OSError), path.open("rb") as stream:
        head = stream.read(_HEAD)
    by_content = [kind for kind in KINDS if kind.magic and head.startswith(kind.magic)]
    by_name = [kind for kind in KINDS if suffix in kind.suffixes]
    return next(iter(by_content + by_name), _TEXT)


def _is_bag_folder(path: Path) -> bool:
    """Whether it is a folder that holds what ros2 bag writes, perhaps not all of it."""
    with suppress(OSError, ValueError):  # ValueError: a null character in the name
        return path.is_dir() and any(
            each.name == "metadata.yaml" or not {".db3", ".mcap"}.isdisjoint(each.suffixes)
            for each in path.iterdir()
        )
    return False
