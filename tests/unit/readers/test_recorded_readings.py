# ruff: noqa: E501 - tables
"""Recordings, layouts of texts, blocks of lines and topics that are joined: all that they say."""

import gzip
from dataclasses import replace
from types import SimpleNamespace

import numpy as np

import gmwm
from gmwm import Channel, Recording
from gmwm.readers.clock import Jumps
from gmwm.readers.formats.joining import (
    Part,
    _aligned,
    has_sensors,
    joined,
    shares,
    with_temperature,
)
from gmwm.readers.layout import find_layout
from gmwm.readers.text_file import blocks, content_size, count_lines
from recorded import assert_as_recorded, edge, refused

NOISE = np.random.default_rng(6).normal(size=900)
UNITS = {"gyro": "deg/s", "accel": "g", "temp": "degC", "vdd": "mV"}


def numbers(recording):
    return [[c.name, c.quantity, c.unit, c.n, c.missing, c.dt, float(np.nansum(c.values))]
            for c in recording.channels]  # fmt: skip


def test_recordings():
    holes = NOISE.copy()
    holes[[3, 4, 9]] = np.nan
    other = NOISE.copy()
    other[5] = np.nan
    data = {"gyro_x": holes, "gyro_y": np.roll(holes, 7), "gyro_z": other, "accel_x": NOISE * np.nan,
            "temp": 20 + NOISE, "vdd": 3300 + NOISE}  # fmt: skip
    rec = Recording.from_arrays(data, 50.0, UNITS, source="log.csv")
    two = replace(
        rec, channels=(*rec.channels, Channel("accel_y", NOISE[:450], 0.04, "accel", "m/s^2"))
    )
    found = {}
    for name, each in (("one rate", rec), ("two rates", two)):
        found[name] = [
            numbers(each), str(each), repr(each), each.rate, each.dt, each.n, each.duration, len(each),
            [numbers(part) for part in each.by_rate()], each.notices, [c.name for c in each.inertial],
            refused(lambda e=each: repr(e.of_one_rate("this"))),
        ]  # fmt: skip
        for start, stop in (
            (0.0, None),
            (0.0, 18.0),
            (0.0, 99.0),
            (1.0, 5.0),
            (0.05, 1.33),
            (0.05, 1.32),
            (-1.0, 3.0),
            (2.0, None),
        ):
            found[f"{name} {start} {stop}"] = refused(
                lambda e=each, a=start, b=stop: [*numbers(e.part(a, b)), list(e.part(a, b).notices)]
            )
    changes = replace(rec, notices=(gmwm.health(rec).notices[0],))
    found["part"] = refused(lambda: numbers(changes.part(1.0, 9.0)))
    for name, rate, more in (
        ("zero", 0.0, {}), ("low", 9e-7, {}), ("least", 1e-6, {}), ("most", 1e9, {}), ("high", 1.1e9, {}),
        ("no unit", 1.0, {"x": NOISE}), ("length", 1.0, {"gyro_y": NOISE[:9]}), ("infinite", 1.0, {"gyro_y": np.full(900, np.inf)}),
        ("shape", 1.0, {"gyro_y": NOISE[:, None]}), ("text", 1.0, {"gyro_y": ["a"] * 900}),
    ):  # fmt: skip
        found[name] = refused(
            lambda r=rate, m=more: numbers(Recording.from_arrays({"gyro_x": NOISE} | m, r, UNITS))
        )
    found["spread"] = [
        edge(lambda a: Channel("a", a * NOISE[:9], 1.0, "gyro", "rad/s").is_of_a_sensor, low, high)
        for low, high in ((1e-65, 1.0), (1.0, 1e65))
    ]  # fmt: skip
    found["constant"] = [
        Channel("a", x, 1.0, "gyro", "rad/s").is_constant
        for x in (np.ones(3), np.array([1.0, np.nan]), NOISE)
    ]
    found["means"] = [
        str(Channel("a", np.array(x), 2.0, "gyro", "rad/s")) for x in ([1.0, np.nan, 4.0], [np.nan])
    ]
    assert_as_recorded("readers/recordings", found)


def test_layouts_of_texts():
    found = {}
    rows = "1.5,2,3\n4,5.25,6\n7,8,9\n"
    for name, text in {
        "plain": rows, "names": "a,b,c\n" + rows, "comment": "# a,b,c\n# d\n" + rows, "two": "# x\n% a,b,c\n" + rows,
        "trailing": rows.replace("\n", ",\n"), "named trailing": "a,b,c,d\n" + rows.replace("\n", ",\n"),
        "few names": "a,b\n" + rows, "many names": "a,b,c,d\n" + rows, "empty last": "a,b,c,\n" + rows,
        "semicolons": rows.replace(",", ";"), "decimal": rows.replace(",", ";").replace(".", ","), "blanks": rows.replace(",", "  "),
        "tabs": rows.replace(",", "\t"), "one": "1\n2\n3\n", "words": "a\nb\n", "only names": "a,b,c\n",
        "numbering": "0,1,2\n" + rows, "numbering two": "0,1\n1.5,2\n3,4\n", "dates": "date,b\n2024-01-01T00:00:00,1\n2024-01-01T00:00:01,2\n",
        "preamble": "device 7\nrate,100\n\na,b,c\n" + rows, "long preamble": "x\n" * 20 + "a,b,c\n" + rows, "crlf": ("a,b,c\n" + rows).replace("\n", "\r\n"),
        "cr": ("a,b,c\n" + rows).replace("\n", "\r"), "mark": "\ufeffa,b,c\n" + rows, "quotes": '"a","b","c"\n' + rows, "open": '"a,b,c\n' + rows,
        "nan": "nan,nan,nan\n" + rows, "mixed": "1;2,5\n3;4,5\n", "blackbox": '"Product","Blackbox"\n"x",1\nloopIteration,time\n1,2\n2,3\n',
        "no blackbox": '"Product","Blackbox"\n1,2\n', "slash": "// a b c\n" + rows.replace(",", " "), "sep": "sep=,\n" + rows, "blank": "\n\n" + rows,
        "utf16": "\xff\xfe", "latin": "a\xe9,b\n1,2\n", "null": "a\x00b",
    }.items():  # fmt: skip
        data = text.encode("latin-1") if name in ("utf16", "latin") else text.encode()
        found[name] = refused(lambda d=data: find_layout("log", d))
    found["lines"] = [
        count_lines(text) for text in (b"", b"a\nb", b"a\r\nb\r\n", b"a\rb\rc", b"a\r\nb\nc\r")
    ]
    assert_as_recorded("readers/layouts_of_texts", found)


def test_blocks_of_lines(tmp_path):
    found = {}
    path = tmp_path / "a.csv"
    for name, end in (("lf", "\n"), ("crlf", "\r\n"), ("cr", "\r")):
        text = end.join(f"{k},{k * k}" for k in range(40)) + end * 3
        path.write_bytes(text.encode())
        for size in (7, 16, 64, 1000):
            parts = list(blocks(path, 4, 3, size))
            found[f"{name} {size}"] = [[line, len(block)] for line, block in parts]
            assert b"".join(block for _, block in parts).strip() == text.encode()[4:].strip()
    found["size"] = content_size(path)
    path.write_bytes(gzip.compress(b"x" * 5000, mtime=0))
    found["packed"] = content_size(path)
    path.write_bytes(b"1,2\n3,4")
    found["no end"] = [[line, block.decode()] for line, block in blocks(path)]
    path.write_bytes(b"x" * ((1 << 20) + 1))
    found["long"] = refused(lambda: list(blocks(path, size=1 << 20)))
    path.write_bytes(b"x" * (1 << 20))
    found["longest"] = refused(lambda: len(list(blocks(path, size=1 << 20))))
    assert_as_recorded("readers/blocks_of_lines", found)


def part(names, n=900, rate=100.0, start=5.0, **more):
    unit = {"gyro": "rad/s", "accel": "m/s^2"}
    arrays = {name: NOISE[:n] + k for k, name in enumerate(names)}
    recording = Recording.from_arrays(arrays, rate, unit, source="bag")
    return Part(replace(recording, jitter=more.get("jitter")), start, more.get("jumps"))


def test_topics_that_are_joined():
    found = {}
    for name, parts in {
        "one": [part(["gyro_x"])], "alike": [part(["gyro_x"]), part(["accel_x"])],
        "shifted": [part(["gyro_x"]), part(["accel_x"], start=6.237)], "rates": [part(["gyro_x"]), part(["accel_x"], 300, 40.0)],
        "apart": [part(["gyro_x"]), part(["accel_x"], start=14.0)], "close": [part(["gyro_x"]), part(["accel_x"], start=13.365)],
        "short": [part(["gyro_x"]), part(["accel_x"], start=13.354)], "same": [part(["gyro_x"]), part(["gyro_x"])],
        "nearly": [part(["gyro_x"]), part(["accel_x"], rate=100.05)], "not quite": [part(["gyro_x"]), part(["accel_x"], rate=100.06)],
        "longer": [part(["gyro_x"], 898), part(["accel_x"], jitter=0.25), part(["accel_y"], jitter=0.125)],
    }.items():  # fmt: skip

        def act(parts=parts):
            one = joined(parts)
            return [numbers(one), one.notices, one.jitter]

        found[name] = refused(act)
    channels = [
        Channel("a", NOISE[:n], dt, "gyro", "rad/s")
        for n, dt in ((100, 0.01), (101, 0.01), (99, 0.0100499), (99, 0.0100506), (102, 0.01))
    ]
    found["aligned"] = [[c.n, c.dt] for c in _aligned(channels)]
    jumps = Jumps(
        np.array([10, 20]), np.array([3.0, 2.0]), np.array([2.0, 1.0]), 1.0, np.array([15])
    )
    found["samples"] = [[s.start, s.stop] for s in (
        part(["gyro_x"], jumps=jumps).samples(slice(*rows)) for rows in ((0, 5), (5, 12), (10, 16), (15, 30)))]  # fmt: skip
    found["rows"] = [part(["gyro_x"]).samples(slice(3, 9)).stop, part(["gyro_x"]).stop]

    def table(*names, **columns):
        return SimpleNamespace(
            source="bag", names=names, load=lambda wanted: {i: columns["values"][i] for i in wanted}
        )

    tables = [
        table("time", "gyro_x", "gyro_y"),
        table("time", "accel_x"),
        table("t", "temperature"),
        table("time", "odd"),
    ]
    found["sensors"] = [has_sensors(each) for each in tables]
    for channels in (None, ["gyro"], "accel_x", ["gyro_y", "accel"], ["gyro_z"], {"gyro_x": 1}):
        found[f"shares {channels}"] = refused(
            lambda c=channels: [[list(t.names), own] for t, own in shares(tables[:2], c)]
        )
    for names in (("time_ms", "temperature"), ("time", "temp [degC]"), ("a", "temp")):
        stamps = np.array([7000.0, 6000.0, 9000.0]) * (1.0 if "ms" in names[0] else 1e-3)
        warm = with_temperature(
            part(["gyro_x"]), table(*names, values=[stamps, np.array([21.0, 20.0, 25.0])])
        )
        found[f"{names}"] = [numbers(warm.recording), warm.recording.notices]
    assert_as_recorded("readers/joined", found)
