"""Small recordings in every binary format, by its own library, and damage to their bytes."""

from __future__ import annotations

import io
import random
import shutil
import tempfile
from functools import cache, partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pyarrow as pa
from pyarrow import feather, parquet
from scipy.io import savemat

import bags
import flight_logs
import gmwm
from gmwm._core.memory import limited
from gmwm.readers import NAMES
from gmwm.readers.formats.binary import LAYOUTS

SI = {"gyro": "rad/s", "accel": "m/s^2"}
ROWS = 96
VARIANTS = 24
"""Of each original: the first is in order, something is odd in the others."""

_LAYOUTS = ("int16,1e-4,1e-3", "float32,1,1,rates,big", "int8,1,1", "float64,0,1", "", "x,y",
            "int32,1e999,1", "int64,1e-300,1e-300,little")  # fmt: skip

Files = dict[str, bytes]
"""Names within a folder, and contents."""

_SIZES = (0, 1, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0xFFFFFFFF, 10**9, 10**12, 2**63 - 1,
          2**64 - 1)  # fmt: skip


# -- damage ---------------------------------------------------------------------------------------


def damaged(rng: random.Random, data: bytes) -> bytes:
    """A few things done to the bytes, most often near the ends, where the headers are."""
    for _ in range(rng.choice((0, 1, 1, 1, 2, 4, 16))):
        data = _one_change(rng, data)
    return data


def _one_change(rng: random.Random, data: bytes) -> bytes:
    u = rng.random()
    at = int(len(data) * rng.choice((u, u**4, 1.0 - u**4)))
    kind = rng.randrange(9)
    if kind == 0:  # cut off
        return data[:at]
    if kind == 1:  # a bit
        return (
            data[:at]
            + bytes(b ^ (1 << rng.randrange(8)) for b in data[at : at + 1])
            + data[at + 1 :]
        )
    if kind == 2:  # bytes
        n = rng.choice((1, 2, 8, 100))
        return data[:at] + rng.randbytes(n) + data[at + n :]
    if kind == 3:  # a size
        n = rng.choice((1, 2, 4, 8))
        size = rng.choice(_SIZES) & ((1 << 8 * n) - 1)
        return data[:at] + size.to_bytes(n, rng.choice(("little", "big"))) + data[at + n :]
    if kind == 4:  # something between
        return data[:at] + rng.randbytes(rng.choice((1, 3, 64))) + data[at:]
    n = rng.choice((1, 8, 60, 400))
    to = rng.randrange(len(data) + 1)
    if kind == 5:  # lost
        return data[:at] + data[at + n :]
    if kind == 6:  # written twice
        return data[: at + n] + data[at : at + n] * rng.choice((1, 1, 50)) + data[at + n :]
    if kind == 7:  # two parts in each other's place
        first, last = sorted((at, to))
        a, b = data[first : first + n], data[last : last + n]
        return (
            data
            if first + n > last
            else data[:first] + b + data[first + n : last] + a + data[last + n :]
        )
    return data[:at] + bytes(n) + data[at + n :]  # a hole


def damaged_files(rng: random.Random, files: Files) -> Files:
    """One of the files damaged, or gone."""
    found = dict(files)
    name = rng.choice(sorted(found))
    if len(found) > 1 and rng.random() < 0.05:
        del found[name]
    else:
        found[name] = damaged(rng, found[name])
    return found


# -- originals ------------------------------------------------------------------------------------


def _samples(variant: int, rate: float = 100.0) -> tuple[np.ndarray, np.ndarray]:
    """Times in seconds and samples, (n, 6), something odd in all but the first variant."""
    rng = np.random.default_rng(variant)
    rows, times = bags.at_rest(ROWS), 5.0 + np.arange(ROWS) / rate
    column, row = rng.integers(6), rng.integers(ROWS)
    values = (np.nan, np.inf, -np.inf, 1e30, 1e-300, -1e8, 0.0)
    kind = variant % 12
    if kind == 1:
        rows[row, column] = rng.choice(values)
    elif kind == 2:
        rows[:, column] = rng.choice(values)
    elif kind == 3:
        rows[rng.random((ROWS, 6)) < 0.3] = np.nan
    elif kind == 4:
        times = times[::-1].copy()
    elif kind == 5:
        times[row] = rng.choice((0.0, 1e3, 4e9))
    elif kind == 6:
        times[:] = times[0]
    elif kind == 7:
        few = int(rng.choice((1, 2, 30)))
        rows, times = rows[:few], times[:few]
    elif kind == 8:
        rows[:, 3:] /= 9.80665
    elif kind == 9:
        times += np.cumsum(rng.exponential(0.1, ROWS) * (rng.random(ROWS) < 0.1))
    elif kind == 10:
        rows[:, rng.integers(2) * 3 :][:, :3] = 0.0
    elif kind == 11:
        rng.shuffle(times)
    return times, rows


def _written(name: str, write: Any) -> Files:
    """What is written under a name: a file, or the files of a folder."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        write(path)
        return {
            str(each.relative_to(folder)): each.read_bytes()
            for each in sorted(Path(folder).rglob("*"))
            if each.is_file()
        }


@cache
def ulog(variant: int) -> Files:
    times, rows = _samples(variant, 250.0)
    stamps, rows = (1e6 * times).astype(np.uint64), rows.astype(np.float32)
    counts = flight_logs.fifo_counts()[:64]
    _, _, _, columns = flight_logs.combined(rows)
    topics = [("sensor_combined", 0, stamps, columns)]
    if variant % 5 == 1:
        topics = [
            flight_logs.fifo(s, counts[:, i : i + 3], 0.001) for s, i in (("gyro", 0), ("accel", 3))
        ]
    elif variant % 5 == 2:
        topics = [
            flight_logs.single("gyro", rows[:, :3], stamps),
            flight_logs.single("accel", rows[:, 3:], stamps),
        ]
    elif variant % 5 == 3:
        topics += [
            flight_logs.single("accel", rows[:9, 3:], stamps[:9]),
            ("sensor_combined", 1, stamps, columns),
        ]
    elif variant % 5 == 4:
        columns["accelerometer_timestamp_relative"] = np.resize(
            [-500, -4500, 2**31 - 1], len(stamps)
        )
    return _written("a.ulg", lambda path: flight_logs.write_ulog(path, *topics))


@cache
def ardupilot(variant: int) -> Files:
    times, rows = _samples(variant, 400.0)
    forms: list[Any] = [flight_logs.IMU]
    messages = [
        (name, int(1e6 * t), *rest)
        for t, (name, _, *rest) in zip(
            times, flight_logs.imu_messages(rows, variant % 2), strict=True
        )
    ]
    if variant % 4 == 1:  # batches
        forms, messages = list(flight_logs.BATCH), []
        for i in range(8):
            kind, batch = i % 2, i // 2
            start = 10**6 + 32_000 * batch
            counts = np.random.default_rng(i).integers(-30, 30, 96) + (4000 if kind == 0 else 0)
            messages.append(("ISBH", start, i, kind, 0, 400, 32, start, 1000.0))
            messages.append(("ISBD", start, i, 0, *counts))
    elif variant % 4 == 2:  # two units
        messages += [(name, t, 1 - i, *rest) for name, t, i, *rest in messages]
    return _written("a.bin", lambda path: flight_logs.write_dataflash(path, forms, messages))


@cache
def bag(kind: str, variant: int) -> Files:
    """Of ``"1"``, ``"SQLITE3"`` or ``"MCAP"``."""
    store = bags.ROS1 if kind == "1" else bags.ROS2
    times, rows = _samples(variant)
    stamps = (1e9 * np.clip(times, 0.0, 4e9)).astype(np.int64)
    messages = [
        (bags.START + i, bags.imu(store, s, six))
        for i, (s, six) in enumerate(zip(stamps, rows, strict=True))
    ]
    topics = {"/imu": (bags.IMU_TYPE, messages)}
    if variant % 3 == 1:
        warm = [
            (bags.START + i, bags.temperature(store, s, 30.0)) for i, s in enumerate(stamps[::8])
        ]
        topics["/warm"] = (bags.TEMPERATURE_TYPE, warm)
    if variant % 4 == 3:
        topics["/imu2"] = topics["/imu"]
    packed = {"1": ("LZ4", "BZ2"), "SQLITE3": ("MESSAGE",), "MCAP": ("MESSAGE", "STORAGE")}[kind]
    compression = packed[variant % len(packed)] if variant % 5 == 4 else None
    if kind == "1":
        return _written("a.bag", lambda path: bags.write1(path, topics, compression))
    big = variant % 7 == 6
    return _written("a", lambda path: bags.write2(path, topics, kind, compression, big))


def _columns(variant: int) -> dict[str, np.ndarray]:
    """Of a structured file."""
    times, rows = _samples(variant)
    rng = np.random.default_rng(variant)
    found: dict[str, Any] = {"time": times, "gyro": rows[:, :3], "accel": rows[:, 3:]}
    if variant % 5 == 1:
        found["fs"] = np.array(100.0)
        del found["time"]
    elif variant % 5 == 2:
        found = {"data": np.column_stack([times, rows])}
    elif variant % 5 == 3:
        found |= {"temperature": 30.0 + times, "note": np.arange(3), "dt": np.array(0.0)}
    odd = (np.float32, np.int16, np.complex128, ">f8", bool, np.float16, np.uint64)
    if variant > 12:
        name = str(rng.choice(sorted(found)))
        with np.errstate(all="ignore"):
            found[name] = np.nan_to_num(found[name]).astype(odd[variant % len(odd)])
    return found


@cache
def mat(variant: int) -> Files:
    stream, content = io.BytesIO(), _columns(variant)
    given = {"imu": content} if variant % 3 == 1 else content
    savemat(stream, given, format="4" if variant % 7 == 6 and given is content else "5",
            do_compression=bool(variant % 2))  # fmt: skip
    return {"a.mat": stream.getvalue()}


@cache
def hdf5(variant: int, is_mat: bool = False) -> Files:
    stream = io.BytesIO()
    with h5py.File(
        stream, "w", userblock_size=512 if is_mat else 0, libver=("earliest", "latest")[variant % 2]
    ) as file:
        for name, values in _columns(variant).items():
            values = np.asarray(values)
            values = values.T if is_mat else values
            packed = (
                {"compression": "gzip", "chunks": True} if variant % 3 == 1 and values.ndim else {}
            )
            made = file.create_dataset(f"imu/{name}", data=values, **packed)
            if name in SI:
                made.attrs["units"] = SI[name]
        if variant % 4 == 1:
            file["odd"] = np.zeros(ROWS, dtype=[("wx", "f8"), ("ax", "f4", (3,))])
    data = stream.getvalue()
    return {"a.mat": b"MATLAB 7.3 MAT-file".ljust(512) + data[512:]} if is_mat else {"a.h5": data}


@cache
def arrow(kind: str, variant: int) -> Files:
    """Parquet or Feather."""
    times, rows = _samples(variant)
    names = [f"{sensor}_{axis} [{SI[sensor]}]" for sensor in SI for axis in "xyz"]
    columns: dict[str, Any] = {"time_s": times, **dict(zip(names, rows.T, strict=True))}
    if variant % 5 == 1:
        columns["time_s"] = pa.array((1e9 * times).astype(np.int64)).cast(pa.timestamp("ns"))
    elif variant % 5 == 2:
        columns[names[0]] = pa.array(
            [None if np.isnan(v) or i % 9 == 0 else str(v) for i, v in enumerate(rows[:, 0])]
        )
    elif variant % 5 == 3:
        columns["list"] = pa.array([[1.0, 2.0]] * len(rows))
    elif variant % 5 == 4:
        columns[names[1]] = pa.array(rows[:, 1].astype(np.float16))
    table = pa.table(columns)
    stream = io.BytesIO()
    if kind == "parquet":
        parquet.write_table(
            table, stream, compression=("snappy", "zstd", "none")[variant % 3], row_group_size=40
        )
    else:
        feather.write_feather(
            table, stream, compression=("lz4", "zstd", "uncompressed")[variant % 3]
        )
    return {f"a.{kind}": stream.getvalue()}


def records(rng: random.Random) -> tuple[bytes, str]:
    """A binary file without a header, and a layout, most often its own."""
    name = rng.choice(sorted(LAYOUTS))
    layout = LAYOUTS[name]
    times, rows = _samples(rng.randrange(VARIANTS))
    made = np.zeros(len(times), layout.record)
    made["time"] = times
    scale = np.repeat([layout.gyro, layout.accel], 3) * 100.0
    with np.errstate(all="ignore"):
        made["values"] = rows / scale
    if rng.random() < 0.2:
        name = rng.choice((*LAYOUTS, *_LAYOUTS))
    return damaged(rng, made.tobytes()), name


# -- use ------------------------------------------------------------------------------------------


def place(files: Files, folder: Path) -> Path:
    """Write files into a folder in which nothing else is; the path to read."""
    own = folder / "in"
    shutil.rmtree(own, ignore_errors=True)
    own.mkdir()
    for name, data in files.items():
        (own / name).parent.mkdir(exist_ok=True)
        (own / name).write_bytes(data)
    first = sorted(files)[0] if files else "a"
    return own / (Path(first).parts[0] if "/" in first else first)


def make(original: Any, rng: random.Random, folder: Path) -> Path:
    """An original of any variant, most often damaged."""
    files = original(rng.choice((0, 0, rng.randrange(VARIANTS))))
    return place(damaged_files(rng, files), folder)


def make_bag2(kind: str, rng: random.Random, folder: Path) -> Path:
    """A bag of ROS 2: its folder, or the file in it alone."""
    path = make(partial(bag, kind), rng, folder)
    inside = (
        [each for each in path.iterdir() if each.suffix in (".db3", ".mcap")]
        if path.is_dir()
        else []
    )
    return inside[0] if inside and rng.random() < 0.5 else path


def make_records(rng: random.Random, folder: Path) -> Path:
    """Records, and their layout beside them."""
    data, layout = records(rng)
    path = place({"a.dat": data}, folder)
    path.with_name("layout").write_text(layout)
    return path


def read(rng: random.Random, path: Path) -> Any:
    """Read as people do: as it is, or with something stated."""
    options: dict[str, Any] = {}
    if path.suffix == ".dat":
        options["layout"] = path.with_name("layout").read_text()
    elif rng.random() < 0.1:
        options["format"] = rng.choice(NAMES)
    if rng.random() < 0.3:
        options["rate"] = rng.choice((100.0, 250.0, 400.0, 1e-3))
    if rng.random() < 0.6:
        options["units"] = SI
    if rng.random() < 0.1:
        options["topic"] = rng.choice(("/imu", "IMU[0]", "sensor_combined", "x"))
    if rng.random() < 0.1:
        options["clock"] = "log"
    if rng.random() < 0.5:
        options["damaged"] = True
    if rng.random() < 0.1:
        options["channels"] = rng.choice((["gyro"], {"gyro_x": 1}, ["accel_z", "temp"]))
    if rng.random() < 0.15 and not {"topic", "clock", "format", "layout"} & set(options):
        with limited(1e-5):  # columns that are kept on disk
            return gmwm.read(path, **options)
    found = gmwm.read(path, **options)
    str(found)
    return found
