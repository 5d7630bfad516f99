"""Files whose libraries end the process, read on without end or take all memory are refused."""

import os
import struct
import time
from pathlib import Path

import numpy as np
import pytest
import scipy.io

import gmwm
from gmwm import InputError
from gmwm.readers.formats import hdf5 as trial
from gmwm.readers.formats.arrays import ArrayTable, array_of
from gmwm.readers.formats.hdf5 import read_mat, tried
from marks import slow

X = np.random.default_rng(1).normal(size=100)
OF_MATLAB = Path(scipy.io.__file__).parent / "matlab" / "tests" / "data"


def opened(path):
    return ArrayTable.of_entries(path.name, {"gyro_x": array_of(X), "text": array_of(X)})


def ends(path):
    os.abort()


def goes_on(path):
    while True:
        pass


def waits(path):
    time.sleep(20.0)
    return opened(path)


def takes_memory(path):
    with pytest.raises(MemoryError):
        np.ones(1 << 28)
    raise InputError(f"{path.name} needs much", "memory", "use less", {"bytes": 3.0})


def second_fails(path):
    def fail():
        raise ValueError

    table = opened(path)
    table.arrays[1].__dict__["read"] = fail
    return table


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "a.mat"
    path.write_bytes(b"a")
    return path


def prints(path):
    print("hello")
    return opened(path)


def test_what_is_printed_is_no_answer_and_modules_beside_the_data_are_not_loaded(file, monkeypatch):
    for name in ("json", "random", "signal"):
        (file.parent / f"{name}.py").write_text("raise SystemExit")
    monkeypatch.chdir(file.parent)
    table = tried(prints, Path("a.mat"))
    assert table.names == ("gyro_x", "text")
    np.testing.assert_array_equal(table.load([0])[0], X)


def test_a_process_that_ends_is_a_damaged_file(file):
    with pytest.raises(InputError, match=r"a\.mat is damaged: its library"):
        tried(ends, file)


@pytest.mark.skipif(os.name != "posix", reason="needs limits")
def test_a_process_that_reads_on_is_a_damaged_file(file, monkeypatch):
    begin = "from gmwm.readers.formats import hdf5 as trial; trial._SECONDS = 1; trial.answer()"
    monkeypatch.setattr(trial, "_PROGRAM", begin)
    with pytest.raises(InputError, match=r"a\.mat is damaged"):
        tried(goes_on, file)


@pytest.mark.skipif(os.name != "posix", reason="needs limits")
def test_memory_that_no_such_file_needs_is_not_given(file):
    with pytest.raises(InputError, match=r"a\.mat needs much: use less") as caught:
        tried(takes_memory, file)
    assert (caught.value.code, caught.value.hint) == ("memory", "use less")
    assert caught.value.values == {"bytes": 3.0}


def test_an_array_that_cannot_be_read_is_refused_when_it_is_asked_for(file):
    table = tried(second_fails, file)
    np.testing.assert_array_equal(table.load([0])[0], X)
    with pytest.raises(InputError, match=r"a\.mat is damaged or cut off"):
        table.load([1])


@pytest.mark.parametrize("kind", [slow(8), slow(11), 255])
def test_numbers_of_no_type_end_scipy_and_are_refused(tmp_path, kind):
    path = tmp_path / "a.mat"
    scipy.io.savemat(path, {"gyro_x": X})
    data = path.read_bytes()
    place = data.rindex(struct.pack("<II", 9, X.nbytes))
    path.write_bytes(data[:place] + struct.pack("<I", kind) + data[place + 4 :])
    with pytest.raises(InputError, match=r"a\.mat is damaged"):
        gmwm.read(path, rate=100.0, units={"gyro": "rad/s"})


def test_good_files_of_many_structures_are_read(tmp_path):
    path = tmp_path / "a.mat"
    scipy.io.savemat(path, {**{f"v{i}": {"a": 1.0} for i in range(1500)}, "gyro_x": X})
    found = gmwm.read(path, rate=100.0, units={"gyro": "rad/s"}, channels=["gyro_x"])
    np.testing.assert_array_equal(found["gyro_x"].values, X)


def test_texts_and_arrays_in_other_files_are_not_read(tmp_path):
    h5py = pytest.importorskip("h5py")
    (tmp_path / "secret.bin").write_bytes(X.tobytes())
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as content:
        content["gyro_x"], content["name"] = X, "text"
    assert gmwm.read(path, rate=100.0, units={"gyro": "rad/s"}).n == X.size
    with h5py.File(path, "a") as content:
        place = [(str(tmp_path / "secret.bin"), 0, X.nbytes)]
        content.create_dataset("gyro_y", X.shape, "f8", external=place)
    with pytest.raises(InputError, match="gyro_y is in another file"):
        gmwm.read(path, rate=100.0, units={"gyro": "rad/s"})


@pytest.mark.skipif(not OF_MATLAB.exists(), reason="scipy is installed without its test data")
def test_what_matlab_writes_ends_nothing():
    """Most hold nothing of a recording, which is what they are refused for."""
    for path in sorted(OF_MATLAB.glob("test*_7.4_GLNX86.mat"))[::12]:
        with pytest.raises(InputError) as caught:
            tried(read_mat, path)
            raise InputError("used")
        assert "its library" not in str(caught.value), path.name


def test_virtual_data_sets_and_deep_groups_of_hdf5_are_rejected(tmp_path):
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "a.h5"
    layout = h5py.VirtualLayout(X.shape, "f8")
    layout[:] = h5py.VirtualSource(tmp_path / "secret.h5", "x", X.shape)
    with h5py.File(path, "w") as content:
        content.create_virtual_dataset("gyro_x", layout)
    with pytest.raises(InputError, match="gyro_x is in another file, which is not opened"):
        gmwm.read(path, rate=100.0, units={"gyro": "rad/s"})
    with h5py.File(path, "w") as content:
        content["/".join("g" * 40) + "/gyro_x"] = X
    with pytest.raises(InputError, match="groups nested more than 32 deep: flatten it"):
        gmwm.read(path, rate=100.0, units={"gyro": "rad/s"})


@pytest.mark.skipif(os.name != "posix", reason="needs limits")
def test_a_process_that_waits_is_a_damaged_file(file, monkeypatch):
    begin = "from gmwm.readers.formats import hdf5 as trial; trial._WALL, trial._SECONDS = 1, 1"
    monkeypatch.setattr(trial, "_PROGRAM", f"{begin}; trial.answer()")
    with pytest.raises(InputError, match=r"a\.mat is damaged"):
        tried(waits, file)
