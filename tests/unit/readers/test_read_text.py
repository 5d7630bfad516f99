"""Delimited text that can be read, in all its dialects."""

from __future__ import annotations

import gzip

import numpy as np
import pytest

from gmwm._core.units import factor
from gmwm.readers import csv_table, read
from gmwm.readers.names import CANONICAL
from reading import SI, assert_holds, texts

HEADER = ",".join(CANONICAL)


@pytest.mark.parametrize("with_header", [True, False])
@pytest.mark.parametrize("delimiter", [",", ";", "\t", " ", "   ", " \t ", ", ", " ; "], ids=repr)
def test_every_delimiter(write, samples, delimiter, with_header):
    header = delimiter.join(CANONICAL) if with_header else None
    for name in ("a.csv", "a.txt", "a.dat", "a.csv.gz", "a"):
        recording = read(write(samples, header, name=name, delimiter=delimiter), rate=50, units=SI)
        assert_holds(recording, samples)
        assert recording.rate == pytest.approx(50)
        assert recording.source == name
        assert texts(recording) == ()


LINE_ENDS = [
    {"end": end, "last": last, "after": after}
    for end in ("\n", "\r\n", "\r") for last in ("", ",")
    for after in ("", "\n\n", "\r\n   \r\n\t\n")
]  # fmt: skip


@pytest.mark.parametrize("with_header", [True, False])
@pytest.mark.parametrize(
    "form",
    [
        *({"delimiter": delimiter, "decimal": ","} for delimiter in (";", "\t", "  ")),
        *LINE_ENDS,
        {"end": "\n\n"},
        {"before": "\ufeff"},
        {"before": "# IMU 7, bench\n% 2024-05-01, 20 degrees\n\n#\n"},
    ],
    ids=repr,
)
def test_every_form(write, samples, form, with_header):
    header = form.get("delimiter", ",").join(CANONICAL) if with_header else None
    assert_holds(read(write(samples, header, **form), rate=50, units=SI), samples)


@pytest.mark.parametrize("last", ["", ","])
def test_delimiter_at_the_end_of_some_lines(write, samples, last):
    path = write(samples, f"{HEADER},", last=last)
    assert_holds(read(path, rate=50, units=SI), samples)
    path = write(samples, HEADER, last=last)
    path.write_text(path.read_text().rstrip().rstrip(","))
    assert_holds(read(path, rate=50, units=SI), samples)


def test_quotes_and_plus_signs(write, samples):
    path = write(samples)
    lines = path.read_text().splitlines()
    lines = [",".join(f'"{float(v):+.5f}"' for v in line.split(",")) for line in lines]
    path.write_text(",".join(f'"{name}"' for name in CANONICAL) + "\n" + "\n".join(lines))
    assert_holds(read(path, rate=50, units=SI), samples)


def test_exponents_and_points_without_digits(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("gx,ax\n" + "1.e-2,.5\n-1E+1,-3\n" * 40)
    recording = read(path, rate=1, units=SI)
    np.testing.assert_array_equal(recording["gyro_x"].values, [0.01, -10.0] * 40)
    np.testing.assert_array_equal(recording["accel_x"].values, [0.5, -3.0] * 40)


def test_units_given_and_rate(write, samples):
    path = write(samples, HEADER)
    recording = read(path, rate=200, units={"gyro": "deg/s", "accel": "g", "accel_z": "mg"})
    np.testing.assert_allclose(recording["gyro_y"].values, np.deg2rad(samples[:, 1]), rtol=1e-15)
    np.testing.assert_allclose(recording["accel_x"].values, 9.80665 * samples[:, 3], rtol=1e-15)
    np.testing.assert_allclose(recording["accel_z"].values, 9.80665e-3 * samples[:, 5], rtol=1e-14)
    assert recording["gyro_x"].unit == "rad/s"
    assert recording["accel_x"].quantity == "accel"


@pytest.mark.parametrize(
    ("names", "gyro_unit", "accel_unit"),
    [
        ("gyro_{} [deg/s]|accel_{} [g]", "deg/s", "g"),
        ("Gyro {} (°/s)|Accel {} (mg)", "deg/s", "mg"),
        ("w{} (rad/sec)|a{} (m/s²)", "rad/s", "m/s^2"),
        ("gyro_{}_dps|accel_{}_mps2", "deg/s", "m/s^2"),
        ("ang_vel_{}_rad_s|acc_{}_g", "rad/s", "g"),
        ("w_RS_S_{} [rad s^-1]|a_RS_S_{} [m s^-2]", "rad/s", "m/s^2"),
    ],
)
def test_units_in_the_header(write, samples, names, gyro_unit, accel_unit):
    gyro, accel = names.split("|")
    header = ",".join([*(gyro.format(a) for a in "xyz"), *(accel.format(a) for a in "xyz")])
    recording = read(write(samples, header), rate=100)
    for name, column in zip(CANONICAL, samples.T, strict=True):
        unit, si = (gyro_unit, "rad/s") if name.startswith("gyro") else (accel_unit, "m/s^2")
        np.testing.assert_allclose(recording[name].values, column * factor(unit, si), rtol=1e-14)
    assert any("units from the names" in note for note in texts(recording))


@pytest.mark.parametrize("stated", ["rad/s", "deg"])
def test_units_given_overrule_the_header_with_a_note(write, samples, stated):
    path = write(samples[:, :1], f"gyro_x [{stated}]")
    recording = read(path, rate=100, units={"gyro": "deg/s"})
    np.testing.assert_allclose(recording["gyro_x"].values, np.deg2rad(samples[:, 0]))
    assert f"gyro_x in {stated}, not deg/s" in " ".join(texts(recording))


def test_blanks_keep_units_with_their_names(write, samples):
    header = "gx [deg/s] gy [deg/s] gz [deg/s] ax [m s^-2]  ay [m s^-2]\taz [m s^-2]"
    recording = read(write(samples, header, delimiter=" "), rate=100)
    np.testing.assert_array_equal(recording["accel_z"].values, samples[:, 5])


def test_euroc(tmp_path, samples):
    stamps = 1403636579758555392 + 5_000_000 * np.arange(80)
    lines = [
        f"{t}," + ",".join(repr(float(v)) for v in row)
        for t, row in zip(stamps, samples, strict=True)
    ]
    header = (
        "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
        "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]"
    )
    path = tmp_path / "data.csv"
    path.write_text("\r\n".join([header, *lines]))
    recording = read(path)
    assert_holds(recording, samples)
    assert recording.rate == pytest.approx(200, rel=1e-6)


def test_rostopic_header_begins_with_percent(tmp_path):
    path = tmp_path / "imu.csv"
    header = (
        "%time,field.header.seq,field.header.stamp,field.header.frame_id,"
        "field.orientation.x,field.angular_velocity.x,field.linear_acceleration.z\n"
    )
    rows = [f"{10**18 + 10**7 * i},{i},{10**18 + 10**7 * i},imu,0,{i}.5,9.8\n" for i in range(70)]
    path.write_text(header + "".join(rows))
    recording = read(path, rate=100.0, units=SI)
    assert recording.names == ("gyro_x", "accel_z", "field.header.stamp")
    assert recording.rate == pytest.approx(100)
    assert "'field.header.seq'" in " ".join(texts(recording))


def test_commented_header_that_means_nothing_is_no_header(write, samples):
    path = write(samples, before="# a,b,c,d,e,f\n")
    assert_holds(read(path, rate=50, units=SI), samples)
    recording = read(path, rate=50, units=SI, channels={"gyro_x": "e"})
    np.testing.assert_array_equal(recording["gyro_x"].values, samples[:, 4])


def test_other_columns_are_named_in_a_note(write, samples):
    path = write(samples, "seq,gx,flag,gy,gz,count")
    recording = read(path, rate=50, units=SI)
    assert_holds(recording, samples[:, [1, 3, 4]], CANONICAL[:3])
    assert texts(recording) == ("columns not used: 'seq', 'flag', 'count'",)


def test_text_in_a_column_that_is_not_used(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("gx,state,az\n" + '1,"on, warm",2\n' * 32 + "1,caf\xe9,2\n" * 40)
    recording = read(path, rate=50, units=SI)
    assert recording.names == ("gyro_x", "accel_z")
    assert recording.n == 72
    path.write_bytes(path.read_text().replace("caf\xe9", "hot").encode() + b"1,\xff\xfe,2\n")
    assert read(path, rate=50, units=SI).n == 73


def test_columns_in_any_order(write, samples):
    order = [5, 0, 3, 1, 4, 2]
    path = write(samples[:, order], ",".join(CANONICAL[i] for i in order))
    assert_holds(read(path, rate=50, units=SI), samples)


def test_numbers_of_columns_above_the_data_are_no_sample(write, samples):
    recording = read(write(samples, "0,1,2,3,4,5"), rate=50, units=SI)
    assert_holds(recording, samples)
    assert "line 1 was read as column numbers" in texts(recording)[0]


def test_index_column_without_a_name(write, samples):
    rows = np.column_stack([np.arange(80), samples])
    recording = read(write(rows, "," + HEADER), rate=50, units=SI)
    assert_holds(recording, samples)
    assert texts(recording) == ("column not used: 0 (counted from 0)",)


@pytest.mark.parametrize(
    ("width", "units", "names"),
    [
        (1, {"gyro": "rad/s"}, CANONICAL[:1]),
        (1, {"accel": "m/s^2"}, CANONICAL[3:4]),
        (3, {"gyro": "rad/s"}, CANONICAL[:3]),
        (3, {"accel": "m/s^2"}, CANONICAL[3:]),
        (6, SI, CANONICAL),
    ],
)
@pytest.mark.parametrize("with_time", [False, True])
def test_no_header(write, samples, width, units, names, with_time):
    rows = samples[:, :width]
    if with_time and width == 1:
        rate, time, rows = None, 0, np.column_stack([0.01 * np.arange(80), rows])
    elif with_time:
        rate, time, rows = None, None, np.column_stack([0.01 * np.arange(80), rows])
    else:
        rate, time = 100.0, None
    recording = read(write(rows), rate=rate, units=units, time=time)
    assert_holds(recording, samples[:, :width], names)
    assert recording.rate == pytest.approx(100)


def test_no_header_and_time_not_wanted(write, samples):
    rows = np.column_stack([np.zeros(80), samples])
    assert_holds(read(write(rows), rate=100, units=SI, time=False), samples)


def test_channels_by_name_and_index(write, samples):
    path = write(samples, "a1,b2,col3,d4,e5,f6")
    recording = read(
        path,
        rate=100,
        units={"gyro": "deg/s", "accel": "g", "turntable": "mdeg/s"},
        channels={"gyro_x": "COL3", "accel_z": 5, "turntable": "0"},
    )
    assert recording.names == ("gyro_x", "accel_z", "turntable")
    np.testing.assert_allclose(recording["gyro_x"].values, np.deg2rad(samples[:, 2]))
    np.testing.assert_allclose(recording["turntable"].values, np.deg2rad(samples[:, 0]) / 1000)
    assert recording["turntable"].quantity == "gyro"
    assert texts(recording) == ("columns not used: 'b2', 'd4', 'e5'",)


def test_channels_name_without_its_unit(write, samples):
    path = write(samples[:, :2], "first [deg/s],second [g]")
    recording = read(path, rate=100, channels={"up": "second", "gyro_x": "first"})
    assert recording["up"].quantity == "accel"
    np.testing.assert_allclose(recording["up"].values, samples[:, 1] * 9.80665)


def test_channels_choose_between_columns_of_one_meaning(write, samples):
    path = write(samples[:, :2], "imu0.gyro_x,imu1.gyro_x")
    recording = read(path, rate=1, units=SI, channels={"gyro_x": "imu1.gyro_x"})
    np.testing.assert_array_equal(recording["gyro_x"].values, samples[:, 1])


@pytest.mark.parametrize("odd", ["+1.5", '"1.5"', "1.5\x20"])
def test_blocks_read_in_either_way_fit_together(write, monkeypatch, odd):
    monkeypatch.setattr(csv_table.blocks, "__defaults__", (0, 1, 1000, str))
    rows = np.round(np.random.default_rng(1).normal(size=(500, 6)), 4)
    path = write(rows, HEADER, end="\r\n")
    lines = path.read_bytes().split(b"\r\n")
    cells = lines[250].split(b",")
    lines[250] = b",".join([odd.encode(), *cells[1:]])
    path.write_bytes(b"\r\n".join(lines))
    rows[249, 0] = 1.5
    assert_holds(read(path, rate=1, units=SI), rows)


def test_gzip_by_content_and_of_two_members(write, samples):
    path = write(samples, HEADER)
    data = path.read_bytes()
    path.write_bytes(gzip.compress(data[:500]) + gzip.compress(data[500:]))
    assert_holds(read(str(path), rate=1, units=SI), samples)


def test_a_row_that_the_fast_parser_loses_is_read(write, samples, monkeypatch):
    import pyarrow
    from pyarrow import csv

    whole = csv.read_csv

    def one_less(*arguments, **options):
        table = whole(*arguments, **options)
        return pyarrow.concat_tables([table.slice(0, 3), table.slice(4)])

    monkeypatch.setattr(csv, "read_csv", one_less)
    assert_holds(read(write(samples, HEADER), rate=50, units=SI), samples)
