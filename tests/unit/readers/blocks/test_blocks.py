"""Files that are read a block at a time, against the same files read as a whole."""

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet

import gmwm
from gmwm.errors import InputError
from gmwm.readers import read_blocks

UNITS = {"gyro": "deg/s", "accel": "m/s^2"}
N = 30_000
ROWS = 7000


@pytest.fixture(scope="module")
def columns():
    """Two channels with stamps of which rows are missing, some at the seam of two blocks."""
    rng = np.random.default_rng(1)
    time = np.arange(N) / 100.0
    gyro, accel = rng.normal(size=N), 9.81 + 0.01 * rng.normal(size=N)
    gyro[1234] = np.nan
    kept = np.ones(N, dtype=bool)
    kept[2000:2007] = False
    kept[ROWS + 5 : ROWS + 12] = False
    return {"time_s": time[kept], "gyro_x": gyro[kept], "accel_z": accel[kept]}


@pytest.fixture(scope="module", params=["csv", "parquet", "stamps", "npy"])
def file(request, columns, tmp_path_factory):
    folder = tmp_path_factory.mktemp("blocks")
    path = folder / f"static.{'parquet' if request.param == 'stamps' else request.param}"
    if request.param == "csv":
        text = "\n".join(",".join(map(str, row)) for row in zip(*columns.values(), strict=True))
        path.write_text(",".join(columns) + "\n" + text.replace("nan", "") + "\n")
        return path, {}
    if request.param == "npy":
        np.save(path, np.stack(list(columns.values()), axis=1))
        return path, {"channels": {"gyro_x": 1, "accel_z": 2}, "time": 0}
    table = pa.table(columns)
    if request.param == "stamps":
        ticks = 1_700_000_000_000_000 + np.rint(columns["time_s"] * 1e6).astype(np.int64)
        table = table.set_column(0, "time", pa.array(ticks, pa.timestamp("us")))
    parquet.write_table(table, path)
    return path, {}


def test_blocks_are_the_recording(file):
    path, options = file
    whole = gmwm.read(path, units=UNITS, **options)
    parts = list(read_blocks(path, units=UNITS, rows=ROWS, **options))
    assert len(parts) > 1
    for name, channel in whole.items():
        found = np.concatenate([part[name].values for part in parts])
        np.testing.assert_array_equal(found, channel.values)
    assert parts[0].dt == pytest.approx(whole.dt, rel=1e-6)
    assert whole.n == N


def test_variances_of_a_file_are_those_of_its_samples(file):
    path, options = file
    found = gmwm.stream(path, units=UNITS, rows=ROWS, **options)
    whole = gmwm.read(path, units=UNITS, **options)
    assert found.n == N
    assert [n.values["missing"] for n in found.notices if n.code == "missing-samples"] == [15, 14]
    for name, channel in whole.items():
        alone = gmwm.StreamingVariance(channel.dt)
        alone.update(channel.values)
        wv = found.variances[name]
        np.testing.assert_array_equal(wv.variance, alone.result().variance)
        assert (wv.name, wv.quantity) == (name, channel.quantity)


def test_a_change_of_rate(tmp_path):
    slow = np.arange(10_000) / 50.0
    time = np.concatenate([slow, slow[-1] + np.arange(1, 9001) / 100.0])
    table = pa.table({"time_s": time, "gyro_x": np.random.default_rng(2).normal(size=time.size)})
    with pytest.raises(InputError, match="the sampling rate goes from 50 to 100 Hz"):
        list(read_blocks(table, units=UNITS, rows=10_000))


@pytest.mark.parametrize("rows", [8000, 10_000])
def test_a_small_change_of_rate_is_reported_as_of_the_whole(rows):
    time = np.cumsum(np.repeat([1.0 / 100.0, 1.0 / 71.0], 20_000))
    table = pa.table({"time_s": time, "gyro_x": np.random.default_rng(2).normal(size=time.size)})
    found = gmwm.calibrate_stream(table, gmwm.WhiteNoise(), units=UNITS, rows=rows)
    for notices in (found.notices, gmwm.stream(table, units=UNITS, rows=rows).notices):
        assert [n.severity for n in notices if n.code == "rate-changes"] == ["bad"]
    assert found["gyro_x"].reasons["rate_constant"] is False


SEAMS = (8000, 16_000)


def moved(by, *, stays=False):
    """Rows 0.01 s apart, but for those at the seams and all after the second, or at it only."""
    time = 0.01 * np.arange(20_000)
    if stays:
        time[SEAMS[1] :] += by
    else:
        time[list(SEAMS)] += by
    return time, np.arange(20_000)


def kept(*, again=(), gone=()):
    rows = np.sort(np.append(np.delete(np.arange(20_000), gone), again).astype(int))
    return 0.01 * rows, rows


def overlapping(at, *back):
    """Rows that are written again, up to so many before ``at``, after which they go on."""
    parts = [np.arange(at)]
    for each in back:
        parts += [np.arange(at - each, at)]
    rows = np.concatenate([*parts, np.arange(at, 20_000)])
    return 0.01 * rows, rows


def at_seams(before, after):
    return np.concatenate([np.arange(seam - before, seam + after) for seam in SEAMS])


CLOCKS = {
    "bursts of 64": (0.01 * (np.arange(20_000) // 64 * 64 + 63), np.arange(20_000)),
    "bursts of 300": (0.01 * (np.arange(20_000) // 300 * 300 + 299), np.arange(20_000)),
    "astray": moved(0.37),
    "early": moved(-1.7),
    "set": moved(1.7e9, stays=True),
    "set back": moved(-77.123, stays=True),
    "back to the beginning": moved(-160.0, stays=True),
    "lost": kept(gone=at_seams(9, 14)),
    "lost after": kept(gone=at_seams(0, 23)),
    "twice": kept(again=at_seams(0, 1)),
    "a block again": overlapping(8000, 6000),
    "all again": overlapping(8000, 8000),
    "again twice": overlapping(16_000, 7000, 7000),
    "again after a seam": overlapping(8300, 6000),
    "again before a seam": overlapping(7800, 6000),
    "again over two seams": overlapping(16_000, 15_000),
    "a seam within what is again": overlapping(13_000, 4500),
    "a seam near the end of what is again": overlapping(15_000, 2000),
    "a counter that runs over": (np.arange(20_000) * 2.0**16 / SEAMS[0] % 2**16, np.arange(20_000)),
}


@pytest.mark.parametrize("name", CLOCKS)
def test_what_a_clock_does_at_a_seam_it_does_anywhere(name):
    time, rows = CLOCKS[name]
    x = np.random.default_rng(3).normal(size=20_000)[rows]
    table = pa.table({"time_us" if "counter" in name else "time_s": time, "gyro_x": x})
    whole = gmwm.read(table, units=UNITS)
    for size in (8000, 7777):
        parts = list(read_blocks(table, units=UNITS, rows=size))
        found = np.concatenate([part["gyro_x"].values for part in parts])
        np.testing.assert_array_equal(found, whole["gyro_x"].values)
    codes = {n.code for n in gmwm.stream(table, units=UNITS, rows=8000).notices}
    assert {n.code for n in whole.notices} - {"gravity"} <= codes


def test_a_log_is_not_divided(tmp_path):
    np.savez(tmp_path / "a.npz", gyro=np.zeros((100, 3)), rate=100.0)
    assert len(list(read_blocks(tmp_path / "a.npz", units=UNITS))) == 1
    from scipy.io import savemat

    savemat(tmp_path / "a.mat", {"gyro": np.random.default_rng(0).normal(size=(100, 3))})
    assert len(list(read_blocks(tmp_path / "a.mat", rate=100.0, units=UNITS))) == 1


def same(path, **options):
    whole = gmwm.read(path, **options)
    parts = list(read_blocks(path, rows=4096, **options))
    assert len(parts) > 1
    for channel in whole.inertial:
        found = np.concatenate([part[channel.name].values for part in parts])
        np.testing.assert_array_equal(found, channel.values)


@pytest.mark.parametrize("clock", ["header", "log"])
def test_a_bag(tmp_path, clock):
    bags = pytest.importorskip("bags")
    samples = np.tile(bags.at_rest(1000), (9, 1))
    warm = [(t, bags.temperature(bags.ROS2, t, 30.0)) for t in bags.stamps(9)]
    topics = {"/imu": bags.imu_topic(bags.ROS2, samples), "/t": (bags.TEMPERATURE_TYPE, warm)}
    same(bags.write2(tmp_path / "a", topics), clock=clock)


def test_topics_together_are_not_divided(tmp_path):
    bags = pytest.importorskip("bags")
    samples, rest = bags.at_rest(300), np.zeros((300, 3))
    gyro, force = np.hstack([samples[:, :3], rest]), np.hstack([rest, samples[:, 3:]])
    topics = {"/g": bags.imu_topic(bags.ROS1, gyro), "/a": bags.imu_topic(bags.ROS1, force)}
    path = bags.write1(tmp_path / "a.bag", topics)
    with pytest.raises(InputError, match="2 topics cannot be read a block at a time together"):
        next(read_blocks(path))
    assert next(read_blocks(path, topic="/g")).names == ("gyro_x", "gyro_y", "gyro_z")


def test_records(tmp_path):
    rng = np.random.default_rng(3)
    records = np.zeros((9000, 7))
    records[:, 0], records[:, 1:] = np.arange(9000) / 128.0, 1e-4 * rng.normal(size=(9000, 6))
    records[:, 6] += 9.8 / 128.0
    records.tofile(tmp_path / "a.dat")
    same(tmp_path / "a.dat", layout="KF-GINS")


def test_what_a_clock_does_is_told_once_and_in_times_of_the_record():
    """Rows on either side of a block belong to others, whose notices tell of them."""
    rows = np.delete(
        np.arange(40_000), [*range(7990, 8000), *range(23_000, 23_040), *range(31_000, 31_007)]
    )
    x = np.random.default_rng(3).normal(size=rows.size)
    table = pa.table({"time_s": 0.01 * rows, "gyro_x": x})
    (whole,) = [n for n in gmwm.read(table, units=UNITS).notices if n.code == "clock-jumps"]
    found = [
        n for part in read_blocks(table, units=UNITS, rows=8000) for n in part.notices
        if n.code == "clock-jumps"
    ]  # fmt: skip
    assert [n.values["missing"] for n in found] == [10, 40, 7]
    assert [n.values["time"] for n in found] == pytest.approx([79.89, 229.99, 309.99])
    (joined,) = [
        n for n in gmwm.stream(table, units=UNITS, rows=8000).notices if n.code == "clock-jumps"
    ]
    assert joined == whole
    assert (joined.values["count"], joined.values["missing"]) == (3, 57)
    (joined,) = gmwm.health_stream(table, units=UNITS, rows=8000).of(code="clock-jumps")
    assert joined == whole


def test_gaps_of_all_blocks_are_told_as_of_the_whole():
    """One of them on both sides of a seam, which is no two."""
    x = np.random.default_rng(5).normal(size=(40_000, 2))
    x[3000:7000], x[7000:9000, 0], x[22_000:22_100] = np.nan, np.nan, np.nan
    table = pa.table({"gyro_x": x[:, 0], "gyro_y": x[:, 1]})
    for of in (table, table.select(["gyro_x"])):
        whole = gmwm.read(of, 100, UNITS).notices
        found = gmwm.stream(of, rate=100, units=UNITS, rows=8000).notices
        assert "missing-samples" in {n.code for n in found}
        assert found == whole


def test_a_gap_at_a_seam_is_no_clock_that_was_set():
    """It is longer than all rows of the block before it, which sees it beyond its end."""
    time = 0.01 * np.arange(24_000)
    time[8000:] += 200.0
    table = pa.table({"time_s": time, "gyro_x": np.random.default_rng(4).normal(size=24_000)})
    codes = [n.code for n in gmwm.stream(table, units=UNITS, rows=8000).notices]
    assert "clock-jumps" in codes
    assert "clock-set" not in codes


def test_bursts_that_a_seam_divides_lose_no_samples():
    time = np.floor(np.arange(30_000) / 50) * 0.5
    table = pa.table({"time_s": time, "gyro_x": np.random.default_rng(4).normal(size=30_000)})
    codes = {n.code for n in gmwm.stream(table, units=UNITS, rows=9990).notices}
    assert "stamps-in-bursts" in codes
    assert not codes & {"clock-jumps", "clock-set", "rows-repeated"}


def test_coarse_rows_of_a_clock_that_was_set_back_are_no_copies():
    """Stamps come again, and now and then the samples with them, by chance."""
    rng = np.random.default_rng(5)
    time = 0.01 * np.concatenate([np.arange(12_000), np.arange(4000, 16_000)])
    table = pa.table({"time_s": time, "gyro_x": np.rint(2.0 * rng.normal(size=24_000))})
    notices = gmwm.stream(table, units=UNITS, rows=8000).notices
    assert "rows-repeated" not in {n.code for n in notices}
    assert gmwm.stream(table, units=UNITS, rows=8000).n == 24_000
