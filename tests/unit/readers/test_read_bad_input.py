"""What cannot be used is refused in one sentence: what, where, and the hint."""

from __future__ import annotations

import gzip
import os

import numpy as np
import pytest

from gmwm.errors import InputError
from gmwm.readers import read
from gmwm.readers.names import CANONICAL
from reading import SI

HEADER = ",".join(CANONICAL)


def problem(path, **options):
    with pytest.raises(InputError) as caught:
        read(path, **({"rate": 100, "units": SI} | options))
    message = str(caught.value)
    assert len(message.splitlines()) == 1
    assert ": " in message
    return message


@pytest.fixture
def damaged(write, samples):
    """Write a good file with one line replaced."""

    def _damaged(number, line, **options):
        path = write(samples, HEADER, **options)
        lines = path.read_text().split("\n")
        lines[number - 1] = line
        path.write_text("\n".join(lines))
        return path

    return _damaged


def test_missing_file(tmp_path):
    path = tmp_path / "nowhere.csv"
    assert problem(path) == f"{path} does not exist: check the path"
    assert "does not exist" in problem(tmp_path / "nowhere.npy")
    assert "does not exist" in problem("a\0b.csv")


def test_directory(tmp_path):
    assert problem(tmp_path) == f"{tmp_path} is a directory: name a file in it"


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="root may read anything")
@pytest.mark.parametrize("name", ["a.csv", "a.npy"])
def test_no_permission(tmp_path, name):
    path = tmp_path / name
    path.write_text("gx\n")
    path.chmod(0)
    assert "a.csv cannot be read" in problem(path)


def test_unreadable(tmp_path, monkeypatch):
    path = tmp_path / "a.csv"
    path.write_text("gx\n")

    def refuse(*_args, **_kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("gmwm._core.files.open", refuse, raising=False)
    assert problem(path) == "a.csv cannot be read (Permission denied): check its permissions"
    npy = tmp_path / "a.npy"
    npy.touch()
    assert problem(npy) == "a.npy cannot be read: check its permissions"


@pytest.mark.parametrize("data", [b"", b"\n", b" \r\n\t\n", b"\xef\xbb\xbf"])
def test_empty(tmp_path, data):
    (tmp_path / "a.csv").write_bytes(data)
    assert problem(tmp_path / "a.csv") == "a.csv is empty: give a file with samples"
    for content in (gzip.compress(data), b""):
        (tmp_path / "a.csv.gz").write_bytes(content)
        assert problem(tmp_path / "a.csv.gz") == "a.csv.gz is empty: give a file with samples"


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.csv", "# a\n% b\n", "holds only comments"),
        ("a.csv", HEADER + "\n\n", "a.csv has a header (line 1) but no data: add samples"),
        ("a.py", "import this\n\nprint('hello')\n", "a.py holds no numbers in its first lines"),
        ("a.json", "{\n}\n", "NPY and NPZ"),
    ],
)
def test_text_that_is_no_table(tmp_path, name, text, words):
    path = tmp_path / name
    path.write_text(text)
    assert words in problem(path)


@pytest.mark.parametrize(
    "cell", ["abc", "1.2.3", "1,5", "1_0", "0x10", "١", "--1", "1 2", "1e", "#"]
)
def test_text_for_a_number(damaged, cell):
    path = damaged(40, f"1;2;3;{cell};5;6", delimiter=";")
    path.write_text(path.read_text().replace(HEADER, HEADER.replace(",", ";")))
    message = problem(path)
    assert message.startswith(f"static.csv, line 40, column 'accel_x': {cell!r} is not a number: ")
    assert "correct the line" in message


def test_text_without_header(write, samples):
    path = write(samples)
    path.write_text(path.read_text() + "1,2,oops,4,5,6\n")
    assert "line 81, column 2 (counted from 0): 'oops' is not a number" in problem(path)


@pytest.mark.parametrize(
    ("number", "line", "words"),
    [
        (1, "1,2,oops,4,5,6", "static.csv, line 1, column 2 (counted from 0): 'oops'"),
        (81, "1,2,oops,4,5,6", "line 81, column 'gyro_z': 'oops' is not a number"),
        *((12, f"1,{cell},3,4,5,6", f"column 'gyro_y': '{cell}' is not a number")
          for cell in ("nan(1)", "nan1", "missing", "-", "?", "1.#IND")),
        (30, "# pause", "line 30: 1 fields where 6 were expected"),
        (33, "1,2,3,4,5", "static.csv, line 33: 5 fields where 6 were expected: correct the line"),
        (33, "1,2,3,4,5,6,7", "line 33: 7 fields where 6 were expected"),
        (33, "1,2,3,4,5,6,,", "line 33: 8 fields where 6 were expected"),
        (1, "gyro_x,gyro_y", "line 2 and after: 6 fields where the header (line 1) has 2"),
        (1, f"{HEADER},temp", "line 2 and after: 6 fields where the header (line 1) has 7"),
        (8, '1,2,"3,4,5,6', "line 8: quotes that do not match"),
        (1, '"a,b,c,d,e,f', "line 1: quotes that do not match"),
    ],
)  # fmt: skip
def test_a_line_that_cannot_be_used(damaged, number, line, words):
    assert words in problem(damaged(number, line))


@pytest.mark.parametrize("cell", ["inf", "-Infinity", "+INF", "1e999", "-1e200"])
def test_not_finite(damaged, cell):
    message = problem(damaged(12, f"1,{cell},3,4,{cell},6"))
    assert message.startswith(f"static.csv, line 12, column 'gyro_y': '{cell}' is not a usable")
    assert "and 1 more such" in message
    assert "empty the field if the sample is missing" in message


def test_what_is_infinite_is_counted_over_all_blocks(damaged, monkeypatch):
    from gmwm.readers import csv_table

    monkeypatch.setattr(csv_table.blocks, "__defaults__", (0, 1, 500, str))
    path = damaged(12, "1,inf,3,4,-inf,6")
    path.write_text(path.read_text() + "1,2,,4,5,1e200\n" * 3)
    assert "line 12, column 'gyro_y'" in problem(path)
    assert "and 4 more such" in problem(path)
    assert "more such" not in problem(damaged(12, "1,inf,3,4,nan,6"))


def test_too_few_samples_are_there(write, samples):
    path = write(samples, HEADER)
    lines = path.read_text().split("\n")
    path.write_text("\n".join(lines[:64] + [",,,,,"] * 100))
    assert "static.csv has 63 samples of any channel, but needs at least 64" in problem(path)


@pytest.mark.parametrize("line", ["1 2 3 4 5", "1\t2 3 4  5 6 7"])
def test_ragged_blanks(write, samples, line):
    path = write(samples, delimiter=" ")
    path.write_text(f"{path.read_text()}{line}\n")
    assert f"line 81: {len(line.split())} fields where 6" in problem(path)


def test_first_line_is_the_ragged_one(write, samples):
    path = write(samples)
    path.write_text("1,2,3\n" + path.read_text())
    assert "static.csv, line 1: 3 fields where 6 were expected" in problem(path)


def test_too_few_samples(write, samples):
    message = problem(write(samples[:63], HEADER))
    assert message == "static.csv has 63 samples, but needs at least 64: record longer"
    assert read(write(samples[:64], HEADER), rate=1, units=SI).n == 64


@pytest.mark.parametrize(("option", "quantity"), [("deg/s", "gyro"), ("g", "accel")])
def test_unit_missing(write, samples, option, quantity):
    units = {key: unit for key, unit in SI.items() if key != quantity}
    with pytest.raises(InputError) as caught:
        read(write(samples, HEADER.replace("x", "x [m]")), rate=1, units=units)
    message = str(caught.value)
    assert f"does not give the unit of {quantity}_x ('m' does not fit):" in message
    assert f'units={{"{quantity}": "{option}"}}' in message
    assert caught.value.code == f"{quantity}-unit-missing"


@pytest.mark.parametrize(
    ("header", "options", "words"),
    [
        (None, {"channels": {"table": 0}, "units": {}}, 'units={"table": "deg/s"}'),
        *((HEADER, {"units": SI | {"gyro": unit}}, f"static.csv, channel gyro_x: un{kind}")
          for unit, kind in {"furlong": "known unit 'furlong'", "": "", "deg/": "", "9 9": "",
                             "LSB": "", "m": "it 'm' cannot be converted"}.items()),
        (HEADER, {"units": SI | {"gyro": "g"}},
         "channel gyro_x: unit 'g' cannot be converted to rad/s"),
        (HEADER.replace("gyro_x", "gyro_x [g]"), {"units": {}},
         "channel gyro_x: unit 'g' cannot be converted"),
        (HEADER, {"units": SI | {"gyros": "deg/s"}},
         "units has 'gyros', which is neither gyro nor accel nor a channel"),
        (HEADER, {"rate": None}, "static.csv has no time column and no rate was given"),
        (HEADER, {"rate": None}, "rate=100"),
        *((HEADER, {"rate": rate}, "give a positive sampling rate in Hz")
          for rate in (0, -5.0, float("nan"), float("inf"), 1e-320)),
        ("a,b,c,d,e,f", {}, "its columns are 'a', 'b', 'c', 'd', 'e', 'f'"),
        ("a,b,c,d,e,f", {}, "channels={"),
        ("gx,gyro_x,gy,gz,ax,ay", {}, "columns 'gx' and 'gyro_x' may both be gyro_x"),
        ("gx,gyro_x,gy,gz,ax,ay", {}, 'channels={"gyro_x": 0}'),
        ("gx,gx,gy,gz,ax,ay", {"channels": {"gyro_x": "gx"}},
         "2 columns 'gx': give the index of the column for gyro_x"),
        *(("a,b,c,d,e,f", option, "static.csv has no column")
          for column in ("gz", "", "-1", "6", 6, -1)
          for option in ({"channels": {"gyro_x": column}}, {"time": column})),
        *((None, {"channels": {"gyro_x": column}},
           f"gyro_x = {column!r} is not a column: give its name or its index")
          for column in (True, None, 1.0, ["a"])),
        (None, {"channels": {}}, "channels names no channel"),
        (None, {"time": True}, "time = True is not a column"),
    ],
)  # fmt: skip
def test_names_and_options_that_cannot_be_used(write, samples, header, options, words):
    assert words in problem(write(samples, header), **options)


def test_equal_names_that_nobody_asks_for_do_no_harm(write, samples):
    assert len(read(write(samples, "t2,t2,gy,gz,ax,ay"), rate=1, units=SI)) == 4


@pytest.mark.parametrize("units", [{}, SI])
@pytest.mark.parametrize("width", [1, 2, 3, 4, 5, 8])
def test_number_of_columns_without_names(write, samples, width, units):
    message = problem(write(np.tile(samples, 2)[:, :width]), units=units)
    one_sensor = "whether this is a gyro or an accelerometer"
    many = f"static.csv has {width} columns without names"
    assert (one_sensor if width in (1, 3, 4) else many) in message
    assert "channels={" in message


def test_not_gzip(write, samples):
    path = write(samples, HEADER)
    path = path.rename(path.with_name("static.csv.gz"))
    assert problem(path).startswith("static.csv.gz is not a gzip file although its name ends")


@pytest.mark.parametrize("keep", [3, 12, 0.5, -4])
def test_cut_gzip(write, samples, keep):
    path = write(samples, HEADER, name="static.csv.gz")
    data = path.read_bytes()
    path.write_bytes(data[: int(keep * len(data)) if isinstance(keep, float) else keep])
    message = problem(path)
    assert message.startswith("static.csv.gz ends before its gzip data are complete")
    assert "get a whole copy" in message


@pytest.mark.parametrize("keep", [0.5, -4])
def test_what_is_there_of_cut_gzip_may_be_taken(write, keep):
    rows = np.random.default_rng(1).normal(size=(4000, 6))
    path = write(rows, HEADER, name="static.csv.gz")
    data = path.read_bytes()
    path.write_bytes(data[: int(keep * len(data)) if isinstance(keep, float) else keep])
    found = read(path, rate=100, units=SI, damaged=True)
    assert 0.45 < found.n / len(rows) <= 1.0
    assert np.array_equal(found["accel_z"].values, rows[: found.n, 5])
    assert [each.severity for each in found.notices if each.code == "damaged"] == ["warning"]


@pytest.mark.parametrize("cut", [12, 5])  # two fields and a half, a digit and a half
@pytest.mark.parametrize("delimiter", [",", " "])
def test_text_that_is_cut_off_in_its_last_line(write, samples, cut, delimiter):
    path = write(samples, delimiter=delimiter)
    text = path.read_text().rstrip("\n")
    path.write_text(text)  # a last line without an end is whole by itself
    assert read(path, rate=100, units=SI).n == len(samples)
    path.write_text(text[:-cut])
    message = problem(path)
    assert message.startswith(f"static.csv is cut off in line {len(samples)}: ")
    assert message.endswith("or read the rest with damaged=True")
    found = read(path, rate=100, units=SI, damaged=True)
    assert found.n == len(samples) - 1
    assert [each.severity for each in found.notices if each.code == "damaged"] == ["warning"]


def test_damaged_gzip(write, samples):
    path = write(samples, HEADER, name="static.csv.gz")
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path.write_bytes(data)
    assert "static.csv.gz is a damaged gzip file" in problem(path)
    path.write_bytes(b"\x1f\x8b\xff\xff" + bytes(20))
    assert "static.csv.gz is a damaged gzip file" in problem(path)


@pytest.mark.parametrize("name", ["a.csv", "a.dat", "a.xlsx", "a.csv.gz"])
def test_binary(tmp_path, name):
    path = tmp_path / name
    data = bytes(range(256)) * 8
    path.write_bytes(gzip.compress(data) if name.endswith("gz") else data)
    message = problem(path)
    assert message.startswith(f"{name} is not a text file")
    assert "CSV and other delimited text (plain or .gz), NPY and NPZ" in message


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-32"])
def test_wide_encodings(write, samples, encoding):
    path = write(samples, HEADER)
    path.write_bytes(path.read_text().encode(encoding))
    message = problem(path)
    assert "is UTF-16 text: save it as UTF-8" in message or "is not a text file" in message


def test_latin_1_header(write, samples):
    path = write(samples, HEADER)
    path.write_bytes(path.read_text().replace("gyro_x", "gyro_x [°/s]").encode("latin-1"))
    message = problem(path)
    assert "static.csv, line 1: this is not UTF-8 text: save it as UTF-8" in message


def test_endless_line(tmp_path, monkeypatch):
    from gmwm.readers import csv_table as text_file

    monkeypatch.setattr(text_file, "_LONGEST_LINE", 1 << 18)
    path = tmp_path / "a.csv"
    path.write_text("1," * (1 << 18))
    assert "a.csv, line 1: longer than" in problem(path)
