"""Files that need more memory than they may: kept on disk, or rejected before they are read."""

import gzip
import io
import os
import resource
import subprocess
import sys
import weakref
import zipfile

import numpy as np
import pytest

from gmwm import InputError, Recording, read
from gmwm._core import memory

UNITS = {"gyro": "rad/s"}
ROWS = np.random.default_rng(0).normal(size=(100, 3))


def npy(array):
    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()


def header(shape):
    text = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text.encode()


@pytest.fixture
def little(monkeypatch):
    monkeypatch.setenv(memory.VARIABLE, "0.01")  # 10.7 MB


def refused(path, **options):
    with pytest.raises(InputError, match=r"GB of memory, and .* GB may be used") as caught:
        read(path, rate=100, units=UNITS, **options)
    assert str(caught.value).startswith(path.name)


def test_a_compressed_text_that_does_not_fit_takes_little_memory(tmp_path):
    path = tmp_path / "a.csv.gz"
    path.write_bytes(gzip.compress(b"1,2,3\n" * 5_000_000, 1))  # 30 MB, 120 MB as numbers
    code = (
        "import gmwm\n"
        "from gmwm._core.spool import is_spooled\n"
        f"found = gmwm.read({str(path)!r}, rate=100, units={UNITS!r})\n"
        "print(all(is_spooled(each.values) for each in found.values()), found.n)\n"
        "print(next(each for each in open('/proc/self/status') if each.startswith('VmHWM')))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True,
                          env={**os.environ, memory.VARIABLE: "0.01"})  # fmt: skip
    message, peak, *_ = done.stdout.splitlines()
    assert message == "True 5000000"
    assert int(peak.split()[1]) < 400_000  # kB, most of it libraries


def test_entries_that_are_not_wanted_are_not_read(tmp_path, little):
    path = tmp_path / "a.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("gyro.npy", npy(ROWS))
        archive.writestr("temp_log.npy", header((20_000_000,)) + bytes(160_000_000))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    found = read(path, rate=100, units=UNITS, channels={"gyro_x": "gyro_x"})
    np.testing.assert_array_equal(found["gyro_x"].values, ROWS[:, 0])
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss < before + 100_000
    refused(path, channels={"gyro_x": "gyro_x", "gyro_y": "gyro_y", "gyro_z": "temp_log"})


def test_an_entry_that_promises_more_than_it_holds(tmp_path):
    path = tmp_path / "a.npz"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("gyro.npy", header((10**13, 3)) + bytes(100))
    with pytest.raises(InputError, match=r"a.npz is damaged or cut off"):
        read(path, rate=100, units=UNITS)


def test_a_file_that_the_disk_has_no_room_for(tmp_path, little, monkeypatch):
    monkeypatch.setattr("gmwm._core.spool._LEFT_FREE", 1 << 60)
    path = tmp_path / "a.npy"
    np.save(path, np.tile(ROWS, (5000, 1)))
    with pytest.raises(InputError, match=r"no room .*: set TMPDIR"):
        read(path, rate=100, units=UNITS)


def test_no_memory_for_an_entry_is_a_sentence(tmp_path, monkeypatch):
    path = tmp_path / "a.npz"
    np.savez(path, gyro=ROWS)

    def fail(*_, **__):
        raise MemoryError

    monkeypatch.setattr(np.lib.format, "read_array", fail)
    with pytest.raises(InputError, match=r"a.npz: there is not enough memory: read fewer"):
        read(path, rate=100, units=UNITS)


def test_empty_fields_are_missing_in_every_block_and_pandas_is_not_needed(tmp_path, monkeypatch):
    """Blocks of the text hold gaps of their own; what Arrow has for it would import pandas."""
    monkeypatch.setitem(sys.modules, "pandas", None)
    n = 45_000
    values = np.random.default_rng(1).normal(size=(n, 3)).round(9)
    values[::977, 1] = np.nan
    values[:, 2] += 9.81
    rows = (",".join("" if np.isnan(v) else repr(v) for v in row) for row in values.tolist())
    file = tmp_path / "gaps.csv"
    file.write_text("\n".join(["gyro_x,gyro_y,accel_z", *rows]) + "\n")
    rec = read(file, rate=100, units={"gyro": "rad/s", "accel": "m/s^2"})
    for name, column in zip(("gyro_x", "gyro_y", "accel_z"), values.T, strict=True):
        np.testing.assert_array_equal(rec[name].values, column)


def test_of_pairs_a_series_is_in_memory_once():
    given = {"gyro_x": np.arange(64.0), "gyro_y": np.arange(64.0)}
    rec = Recording.from_arrays(given, 100.0, {"gyro": "deg/s"})
    assert list(given) == ["gyro_x", "gyro_y"]
    parts = {name: weakref.ref(values) for name, values in given.items()}

    def pairs():
        for name in list(given):
            yield name, given.pop(name)

    same = Recording.from_arrays(pairs(), 100.0, {"gyro": "deg/s"})
    np.testing.assert_array_equal(same["gyro_x"].values, rec["gyro_x"].values)
    assert not any(part() for part in parts.values())
