"""Types in MAT files: what MATLAB and scipy write passes, others are refused before scipy reads."""

import io
import struct
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from scipy.sparse import eye

import gmwm
from gmwm.readers.formats.mat_tags import check_types

OF_MATLAB = Path(scipy.io.__file__).parent / "matlab" / "tests" / "data"
VALUES = {
    "a": np.arange(30.0).reshape(10, 3), "whole": np.arange(3, dtype="i2"), "z": 1.0 + 2.0j,
    "inside": {"x": np.arange(5.0), "cell": [1.0, "b", {"w": 1.0}], "text": "text"},
    "sparse": eye(4).tocsc(), "complex": (1j * eye(4)).tocsc(), "none": np.zeros((0, 0)),
    "truth": np.array([True, False]),
}  # fmt: skip


def mat(values=VALUES, compressed=False):
    stream = io.BytesIO()
    scipy.io.savemat(stream, values, do_compression=compressed)
    return stream.getvalue()


@pytest.mark.skipif(not OF_MATLAB.exists(), reason="scipy is installed without its test data")
def test_what_matlab_writes_passes():
    read = 0
    for path in OF_MATLAB.glob("*.mat"):
        try:
            scipy.io.loadmat(path)
        except Exception:  # version 7.3, and files that scipy keeps for being damaged
            continue
        check_types(path)
        read += 1
    assert read > 60


@pytest.mark.parametrize("compressed", [False, True])
def test_what_scipy_writes_passes(tmp_path, compressed):
    path = tmp_path / "a.mat"
    path.write_bytes(mat(compressed=compressed))
    check_types(path)


def big_endian(values):
    """A matrix of doubles as a machine of the other byte order writes it."""
    shape = struct.pack(">IIII", 5, 8, values.size, 1)
    name = struct.pack(">HH4s", 1, 1, b"a\0\0\0")
    numbers = struct.pack(">II", 9, 8 * values.size) + values.astype(">f8").tobytes()
    inside = struct.pack(">IIII", 6, 8, 6, 0) + shape + name + numbers
    header = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x01\x00MI"
    return header + struct.pack(">II", 14, len(inside)) + inside


def test_the_other_byte_order_passes_too(tmp_path):
    path = tmp_path / "a.mat"
    path.write_bytes(big_endian(np.arange(4.0)))
    assert scipy.io.loadmat(path)["a"].ravel().tolist() == [0.0, 1.0, 2.0, 3.0]
    check_types(path)
    path.write_bytes(
        big_endian(np.arange(4.0)).replace(struct.pack(">II", 9, 32), b"\0\0\1\0\0\0\0\40")
    )
    with pytest.raises(ValueError, match="numbers of type 256"):
        check_types(path)


@pytest.mark.parametrize("kind", [0, 8, 10, 11, 14, 15, 19, 21, 255])
@pytest.mark.parametrize("where", ["alone", "in a structure", "imaginary", "sparse"])
def test_numbers_of_no_type_are_refused(tmp_path, kind, where):
    """There scipy ends the process."""
    values = np.full(10, 7.5)
    given = {
        "alone": values, "in a structure": {"x": values}, "imaginary": values + 7.5j,
        "sparse": eye(10).tocsc() * 7.5,
    }[where]  # fmt: skip
    data = mat({"a": given})
    tag = struct.pack("<II", 9, 80)
    place = data.rindex(tag)
    path = tmp_path / "a.mat"
    path.write_bytes(data[:place] + struct.pack("<II", kind, 80) + data[place + 8 :])
    with pytest.raises(ValueError, match=f"numbers of type {kind}"):
        check_types(path)
    with pytest.raises(gmwm.InputError, match=r"a\.mat is damaged"):
        gmwm.read(path, rate=100.0)


def test_what_is_cut_off_or_nested_without_end_is_refused(tmp_path):
    path = tmp_path / "a.mat"
    path.write_bytes(mat({"a": {"x": 1.0, "y": np.arange(40.0)}})[:-340])
    with pytest.raises(EOFError):
        check_types(path)
    cell = b""
    for _ in range(70):
        inside = struct.pack("<IIII", 6, 8, 1, 0) + struct.pack("<IIII", 5, 8, 1, 1)
        inside += struct.pack("<II", 1, 0) + cell
        cell = struct.pack("<II", 14, len(inside)) + inside
    path.write_bytes(b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + cell)
    with pytest.raises(ValueError, match="64 deep"):
        check_types(path)


def test_version_4_has_no_tags(tmp_path):
    path = tmp_path / "a.mat"
    scipy.io.savemat(path, {"a": np.arange(100.0)}, format="4")
    check_types(path)
