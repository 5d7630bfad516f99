"""Damaged files: each is refused with one sentence or read to what it says, never anything else."""

from __future__ import annotations

import gzip
import io
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st

from gmwm.errors import InputError
from gmwm.readers import read
from gmwm.readers.names import CANONICAL
from gmwm.readers.text import csv_table
from reading import SI

thorough = settings(deadline=None, database=None)

CELLS = [
    *("null", "None", "-NaN", "n/a"),
    *("nan", "inf", "-inf", "NA", "", " ", "text", "1e999", "1e308", "1e-320", "+1.5", "1_0", "٣"),
    *('"', '"1"', '"1,5"', "1,5", "0x1", "1.5e", ".", "-", "-.5", "5.", "00012", "1e5", "1 2"),
    *("0.1000000000000000055511151231257827", "9007199254740993", "#", "%", "nan(1)", "Infinity"),
    *("1.7976931348623157e308", "123456789012345678901234567890", "\x00", "\x0b1", "\xa01", "−1"),
]
LINES = [
    *("", "   ", "# comment", "text", "1", "1,2", ",,,,,,", '"', '"a', "\r", "\t", "gx,gy,gz"),
    *("7,1,2,3,4,5,6", "[deg/s]", "1;2;3;4;5;6;7", "\x00", "0.1 0.2 0.3 0.4 0.5 0.6 0.7"),
]

places = st.floats(0.0, 1.0, exclude_max=True)


def _at(place: float, length: int) -> int:
    return int(place * length)


@st.composite
def original(draw: st.DrawFn) -> bytes:
    """A valid file of seven columns."""
    delimiter = draw(st.sampled_from([",", ";", "\t", " ", ", "]))
    header = draw(st.sampled_from(["plain", "units", "commented", "none"]))
    rows = draw(st.integers(64, 80))
    rng = np.random.default_rng(draw(st.integers(0, 3)))
    table = np.round(np.column_stack([0.01 * np.arange(rows), rng.normal(size=(rows, 6))]), 4)
    lines = [delimiter.join(f"{v:g}" for v in row) for row in table]
    names = ["time_s", *CANONICAL]
    if header == "units":
        names = ["time [s]", *(f"{n} [{'deg/s' if n < 'b' else 'g'}]" for n in CANONICAL)]
    if header != "none":
        lines.insert(0, ("# " if header == "commented" else "") + delimiter.join(names))
    text = draw(st.sampled_from(["\n", "\r\n"])).join(lines) + "\n"
    if delimiter in (";", "\t") and draw(st.booleans()):
        text = text.replace(".", ",")
    return text.encode()


@st.composite
def mutated(draw: st.DrawFn) -> bytes:
    """A file with a few things done to it."""
    data = draw(original())
    for _ in range(draw(st.integers(0, 4))):
        data = _mutate(draw, data)
    return data


def _mutate(draw: st.DrawFn, data: bytes) -> bytes:
    kind = draw(
        st.sampled_from(
            ["cell"] * 4
            + ["cut", "insert", "replace", "truncate", "drop line", "repeat line", "new line"]
            + ["shuffle fields", "join lines", "delimiter", "everywhere", "garbage", "swap lines"]
        )
    )
    place = draw(places)
    i = _at(place, len(data))
    if kind == "cut":
        return data[:i] + data[i + draw(st.integers(1, 20)) :]
    if kind in ("insert", "replace"):
        new = draw(st.binary(min_size=1, max_size=4) | st.sampled_from([b"\n", b",", b'"', b"-"]))
        return data[:i] + new + data[i + (len(new) if kind == "replace" else 0) :]
    if kind == "truncate":
        return data[:i]
    if kind == "garbage":
        return data[:i] + draw(st.binary(max_size=200)) + data[i:]
    if kind in ("delimiter", "everywhere"):
        old, new = draw(st.permutations([b",", b";", b"\t", b" ", b".", b"\n", b"\r\n", b"|"]))[:2]
        return data.replace(old, new) if kind == "everywhere" else data.replace(old, new, 7)
    lines = data.split(b"\n")
    j = _at(place, len(lines))
    if kind == "drop line":
        del lines[j]
    elif kind == "repeat line":
        lines.insert(j, lines[j])
    elif kind == "new line":
        lines.insert(j, draw(st.sampled_from(LINES)).encode())
    elif kind == "swap lines":
        lines[j], lines[0] = lines[0], lines[j]
    elif kind == "join lines":
        lines[j : j + 2] = [b" ".join(lines[j : j + 2])]
    else:
        parts = re.split(rb"([,;\t ]+)", lines[j])
        if kind == "shuffle fields":
            parts = draw(st.permutations(parts))
        else:
            parts[2 * _at(draw(places), (len(parts) + 1) // 2)] = draw(
                st.sampled_from(CELLS)
            ).encode()
        lines[j] = b"".join(parts)
    return b"\n".join(lines)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("fuzz")


def attempt(path, **options):
    """A recording, or the message."""
    try:
        return read(path, **options)
    except InputError as error:
        return str(error)


def check(outcome, path):
    if isinstance(outcome, str):
        assert outcome.isprintable()
        assert ": " in outcome
        assert outcome.startswith(path.name)
        return
    assert outcome.source == path.name
    assert len(outcome) > 0
    assert 0.0 < outcome.dt < np.inf
    assert outcome.n >= 64
    for channel in outcome.values():
        assert channel.values.shape == (outcome.n,)
        assert channel.values.dtype == np.float64
        assert not np.any(np.isinf(channel.values))
        assert channel.quantity == channel.name[: len(channel.quantity)]
    assert max(outcome.n - channel.missing for channel in outcome.values()) >= 64
    assert all(str(notice).isprintable() for notice in outcome.notices)


@thorough
@given(data=mutated(), compress=st.booleans(), rate=st.sampled_from([None, 100.0]))
def test_text(folder, data, compress, rate):
    path = folder / ("a.csv.gz" if compress else "a.csv")
    path.write_bytes(gzip.compress(data, 1) if compress else data)
    check(attempt(path, rate=rate, units=SI), path)


@thorough
@given(data=mutated(), place=places, new=st.binary(max_size=3), cut=st.integers(0, 3))
def test_damage_to_the_compressed_bytes(folder, data, place, new, cut):
    packed = gzip.compress(data, 1)
    i = _at(place, len(packed))
    path = folder / "b.csv.gz"
    path.write_bytes(packed[:i] + new + packed[i + cut :])
    check(attempt(path, rate=100, units=SI), path)


@thorough
@given(data=st.binary(max_size=400), name=st.sampled_from(["c.csv", "c.gz", "c.npy", "c.npz"]))
@example(data=b"a ( 1 )", name="c.csv")
@example(data=b"\r", name="c.csv")
@example(data=b"gx\n1\n\x85", name="c.csv")
def test_anything(folder, data, name):
    path = folder / name
    path.write_bytes(data)
    check(attempt(path, rate=100, units=SI), path)


def _value(cell: str) -> float:
    return np.nan if cell.lower() in ("", "na", "n/a", "#n/a", "null", "none") else float(cell)


def naive(data: bytes, delimiter: str | None, comments: str) -> np.ndarray | None:
    """The last six of seven columns by nothing but split and float.

    comments: Marks of lines before the first row that are none; below a header such a line may be a
        row, of which the column with the mark is not read.
    """
    text = data.decode("utf-8", "replace").removeprefix("\ufeff")
    rows: list[list[float]] = []
    for line in re.split("\r\n|\r|\n", text):
        if not line.strip(" \t") or (not rows and line.lstrip(" ")[0] in comments):
            continue
        if delimiter:  # between quotes it parts nothing
            line = re.sub('"[^"]*"', lambda quoted: quoted[0].replace(delimiter, "?"), line)
        # Not split(None), to which more than blanks and tabs is blank.
        fields = line.split(delimiter) if delimiter else re.split("[ \t]+", line.strip(" \t"))
        cells = [cell.strip(' \t"') for cell in fields]
        if delimiter != ",":
            cells = [cell.replace(",", ".") for cell in cells]
        try:
            # A line of words before the header has other widths.
            rows.append([_value(cell) for cell in (cells if len(cells) < 7 else cells[1:7])][-6:])
        except ValueError:
            if any(len(row) == 6 for row in rows):
                return None
            rows = []  # a line of numbers before the header
    return np.array(rows) if all(len(row) == 6 for row in rows) else None


def same_but_for(rows, found, named):
    """Whether all numbers are those of the file, but for so many that a notice takes as missing."""
    if rows is None or rows.shape != found.shape:
        return False
    gone = np.isnan(found) & ~np.isnan(rows)
    return gone.sum() == named and np.array_equal(found[~gone], rows[~gone], equal_nan=True)


@thorough
@given(data=mutated())
def test_what_is_accepted_is_what_the_file_says(folder, data):
    path = folder / "d.csv"
    path.write_bytes(data)
    channels = {name: i for i, name in enumerate(CANONICAL, start=1)}
    outcome = attempt(path, rate=100, units=SI, channels=channels, time=False)
    check(outcome, path)
    if isinstance(outcome, str):
        return
    found = np.column_stack([channel.values for channel in outcome.values()])
    said = [naive(data, mark, note) for mark in (";", "\t", ",", None) for note in ("#%", "")]
    named = sum(each.values["count"] for each in outcome.notices if each.code == "sentinel")
    assert any(same_but_for(rows, found, named) for rows in said)


@thorough
@given(data=mutated())
def test_both_ways_to_parse_agree(folder, data):
    path = folder / "e.csv"
    path.write_bytes(data)
    fast = attempt(path, rate=100, units=SI, time=False)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(csv_table, "_parse_with_arrow", lambda *_: None)
        careful = attempt(path, rate=100, units=SI, time=False)
    if isinstance(fast, str) or isinstance(careful, str):
        assert fast == careful
    else:
        assert fast.names == careful.names
        for name in fast.names:
            np.testing.assert_array_equal(fast[name].values, careful[name].values)


def _saved(kind: str) -> bytes:
    stream = io.BytesIO()
    rows = np.random.default_rng(0).normal(size=(70, 6))
    if kind == "matrix":
        np.save(stream, rows)
    elif kind == "structured":
        np.save(stream, np.zeros(70, [("t", "f8"), ("gyro", "f4", (3,)), ("ax", "i2")]))
    else:
        saver = np.savez if kind == "npz" else np.savez_compressed
        saver(stream, t=0.01 * np.arange(70), gyro=rows[:, :3], ax=rows[:, 3], rate=100.0)
    return stream.getvalue()


SAVED = {kind: _saved(kind) for kind in ("matrix", "structured", "npz", "compressed")}


@thorough
@given(
    kind=st.sampled_from(sorted(SAVED)),
    edits=st.lists(
        st.tuples(
            # The headers are at the beginning and, of a zip file, at the end.
            places.map(lambda p: 0.002 + 0.9 * p**3) | places.map(lambda p: 1 - p**3) | places,
            st.integers(0, 3),
            st.binary(max_size=3) | st.sampled_from([b"9", b"(", b"O", b"'", b"\n", b">c16"]),
        ),
        max_size=4,
    ),
    keep=st.sampled_from([1.0, 1.0, 1.0, 1.0, 0.99, 0.8, 0.3, 0.1, 0.0]),
)
def test_arrays(folder, kind, edits, keep):
    data = SAVED[kind]
    data = data[: int(keep * len(data))]
    for place, cut, new in edits:
        i = _at(place, len(data))
        data = data[:i] + new + data[i + cut :]
    path = folder / ("f.npz" if kind in ("npz", "compressed") else "f.npy")
    path.write_bytes(data)
    check(attempt(path, units=SI, rate=100), path)
