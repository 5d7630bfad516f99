"""Clocks and units that are more likely wrong than what they say."""

import re

import numpy as np
import pytest

import gmwm
from gmwm.errors import InputError
from marks import slow
from reading import codes

pd = pytest.importorskip("pandas")
N = 4000


def frame(time, name="time_s", accel=(0.0, 0.0, 9.81)):
    rng = np.random.default_rng(3)
    columns = {name: np.asarray(time, dtype=float)}
    columns |= {f"gyro_{a} [rad/s]": 1e-3 * rng.normal(size=len(time)) for a in "xyz"}
    columns |= {
        f"accel_{a} [m/s^2]": g * (1.0 + 1e-3 * rng.normal(size=len(time))) + 1e-4
        for a, g in zip("xyz", accel, strict=True)
    }
    return pd.DataFrame(columns)


@pytest.mark.parametrize("seed", [0, 1, slow(2), slow(3)])
@pytest.mark.parametrize("kept", [0.3, 0.4])
def test_most_rows_lost_at_random_invent_no_rate(seed, kept):
    time = 0.01 * np.flatnonzero(np.random.default_rng(seed).random(4 * N) < kept)
    try:
        found = gmwm.read(frame(time))
    except InputError as error:
        assert "time" in str(error)
    else:
        assert found.rate == pytest.approx(100.0, rel=1e-3)


@pytest.mark.parametrize("rows", [3, 5, 8])
def test_bursts_with_stamps_close_together_are_no_losses(rows):
    k = np.arange(N)
    time = 0.01 * rows * (k // rows) + 0.005 * (k % rows)
    with pytest.raises(InputError, match=f"every {rows} rows the clock .* written in bursts"):
        gmwm.read(frame(time))


def test_rows_that_are_lost_now_and_then_in_a_rhythm_are_lost():
    k = np.arange(N)
    found = gmwm.read(frame(0.01 * k[k % 102 < 100]))
    assert found["gyro_x"].missing == 2 * (N // 102)


def test_a_stated_unit_that_no_sensor_has():
    assert "rate-unlikely" in codes(gmwm.read(frame(10.0 * np.arange(N), "time [s]")))
    assert "rate-unlikely" not in codes(gmwm.read(frame(0.01 * np.arange(N))))


@pytest.mark.parametrize(
    ("name", "step", "said"),
    [("time", 0.25, True), ("time", 1 / 6000, True), ("time [s]", 0.25, False),
     ("time", 0.1, False), ("time", 1 / 5000, False)],
)  # fmt: skip
def test_a_rate_that_few_sensors_have_by_stamps_without_a_unit(name, step, said):
    found = [n for n in gmwm.read(frame(step * np.arange(N), name)).notices
             if n.code == "rate-unlikely"]  # fmt: skip
    assert bool(found) is said
    assert not said or (found[0].severity == "warning" and "'time [ms]'" in found[0].hint)


def test_increments_read_as_accelerations():
    found = gmwm.read(frame(0.01 * np.arange(N), accel=(0.0, 0.0, 0.0981)))
    (notice,) = [each for each in found.notices if each.code == "gravity"]
    assert "increments" in notice.text
    assert notice.severity == "bad"


def test_the_nearest_unit_of_gravity_is_named():
    with pytest.raises(InputError, match=r"gravity in cm/s\^2"):
        gmwm.read(frame(0.01 * np.arange(N), accel=(0.0, 0.0, 980.7)))
    with pytest.raises(InputError, match="gravity in mg"):
        gmwm.read(frame(0.01 * np.arange(N), accel=(0.0, 0.0, 1000.0)))


def test_frames_without_rows_or_with_names_twice():
    with pytest.raises(InputError, match="has 0 samples"):
        gmwm.read(frame(np.zeros(0)))
    twice = pd.concat([frame(0.01 * np.arange(N))] * 2, axis=1)
    with pytest.raises(InputError, match="Duplicate"):
        gmwm.read(twice)


@pytest.mark.parametrize("number", [1e30, -999.0, 2147483647.0])
def test_numbers_that_are_no_samples_are_missing(number):
    table, rows = frame(0.01 * np.arange(N)), [0, 700, 701, N - 1]
    clean = gmwm.read(table)["gyro_y"].values.copy()
    table.loc[rows, "gyro_y [rad/s]"] = number
    found = gmwm.read(table)
    clean[rows] = np.nan
    np.testing.assert_array_equal(found["gyro_y"].values, clean)
    (notice,) = [each for each in found.notices if each.code == "sentinel"]
    assert (notice.where, notice.severity) == ("gyro_y", "warning")
    assert notice.values == {"count": 4, "value": number, "row": 0}


@pytest.mark.parametrize("kind", ["shock", "counts", "cut off", "wide"])
def test_samples_are_no_error_codes(kind):
    table = frame(0.01 * np.arange(N))
    rng = np.random.default_rng(1)
    column = np.asarray(table["gyro_x [rad/s]"])
    unit = "gyro_x [mdeg/s]"
    column = 1e3 * np.degrees(column)
    if kind == "shock":
        column[100:120] = 3e4 * rng.normal(size=20)
    elif kind == "counts":
        column = np.round(rng.normal(size=N) * 700.0)
        column[::1000] = 999.0
    elif kind == "cut off":
        column = np.clip(np.round(rng.normal(size=N) * 20_000.0), -32768, 32767)
    elif kind == "wide":
        column = np.where(rng.random(N) < 0.5, -999.0, 999.0) + column
    table = table.drop(columns="gyro_x [rad/s]").assign(**{unit: column})
    assert "sentinel" not in codes(gmwm.read(table))


@pytest.mark.parametrize(
    ("number", "rows"), [(-99.0, "three"), (999.9, "7 %"), (-8388608.0 * 4.7e-6, "a block")]
)
def test_a_number_that_comes_again_from_nowhere_is_no_sample(number, rows):
    table = frame(0.01 * np.arange(N))
    there = np.zeros(N, dtype=bool)
    if rows == "three":
        there[[50, 300, N - 1]] = True
    elif rows == "7 %":
        there = np.random.default_rng(3).random(N) < 0.07
    else:
        there[100 : 100 + N // 12] = True
    clean = gmwm.read(table)["gyro_y"].values.copy()
    table.loc[there, "gyro_y [rad/s]"] = number
    found = gmwm.read(table)
    clean[there] = np.nan
    np.testing.assert_array_equal(found["gyro_y"].values, clean)
    (notice,) = [each for each in found.notices if each.code == "sentinel"]
    assert (notice.values["count"], notice.values["value"]) == (there.sum(), number)


@pytest.mark.parametrize("kind", ["turn to the end of the scale", "vibration", "rounded", "bursts"])
def test_what_moves_is_no_error_code(kind):
    rng = np.random.default_rng(4)
    n = 20_000
    values = np.round(2.0 * rng.normal(size=n))  # counts
    if kind == "turn to the end of the scale":
        values[5000:7000] = np.clip(
            np.round(3e4 * np.sin(np.arange(2000) / 300.0)), -20_000, 20_000
        )
    elif kind == "vibration":
        values[::4] += np.round(100.0 * rng.standard_t(3, size=n // 4))
    elif kind == "bursts":
        values[12_000:] = np.round(60.0 * rng.normal(size=8000))
    else:
        values = np.round(0.3 * rng.normal(size=n))
        values[::997] += 2.0

    table = pd.DataFrame({"time [s]": 0.01 * np.arange(n), "gyro_x [mdeg/s]": values})
    assert "sentinel" not in codes(gmwm.read(table))


@pytest.mark.parametrize(
    "again",
    [
        np.s_[2000:6000],  # beside a clock of 100 Hz they look like one of 200 Hz
        np.s_[14_000:],
        np.s_[5000:5003],
    ],
)
@pytest.mark.parametrize("how", ["each row twice", "in a piece"])
def test_rows_written_again_change_neither_rate_nor_samples(again, how):
    n, rng = 20_000, np.random.default_rng(4)
    time = 0.01 * (np.arange(n) + 0.05 * rng.standard_normal(n))
    values = 1e-3 * rng.standard_normal(n)
    rows = np.arange(n)
    stop = rows[again][-1] + 1
    order = np.concatenate([rows[:stop], rows[again], rows[stop:]])
    if how == "each row twice":
        order = np.sort(order)
    frame = pd.DataFrame({"time_s": time[order], "gyro_x": values[order]})
    recording = gmwm.read(frame, units={"gyro": "rad/s"})
    np.testing.assert_array_equal(recording["gyro_x"].values, values)
    assert recording.rate == pytest.approx(100.0, rel=1e-5)
    (notice,) = [
        each for each in recording.notices if each.severity != "note" or "rows" in each.code
    ]
    assert (notice.code, notice.values["count"]) == ("rows-repeated", rows[again].size)


def test_a_clock_that_is_set_back_is_rejected():
    n, rng = 20_000, np.random.default_rng(5)
    number = np.arange(n) - 300 * (np.arange(n) >= 9000)
    frame = pd.DataFrame({"time_s": 0.01 * number, "gyro_x": rng.standard_normal(n)})
    with pytest.raises(InputError, match=r"row 9000.*: the clock goes back"):
        gmwm.read(frame, units={"gyro": "rad/s"})


def test_rows_of_two_sensors_in_turns_are_refused():
    found = frame(0.01 * (np.arange(N) // 2)).assign(imu_id=np.arange(N) % 2)
    with pytest.raises(InputError, match=r"'imu_id': rows of 2 sensors come in turns"):
        gmwm.read(found)


@pytest.mark.parametrize("number", [0.0 * np.arange(N), np.arange(N), 1.0 * (np.arange(N) > 2000)])
def test_columns_that_number_something_else(number):
    found = gmwm.read(frame(0.01 * np.arange(N)).assign(id=number, device="front"))
    assert found.n == N


@pytest.mark.parametrize("name", ["time(ms)", "tow [msec]"])
def test_seconds_under_a_name_of_milliseconds_are_rejected_with_the_name_to_write(name):
    with pytest.raises(gmwm.InputError, match="a rate of 100000 Hz") as caught:
        gmwm.read(frame(0.01 * np.arange(N), name))
    right = re.search("such as '(.*)'", str(caught.value))[1]
    assert gmwm.read(frame(0.01 * np.arange(N), right)).rate == pytest.approx(100.0)


@pytest.mark.parametrize("rate", [100.0, 66.0])
def test_a_given_rate_that_ignores_other_stamps_is_warned_of(rate):
    k = np.arange(N)
    lost = np.random.default_rng(1).random(N) < 1.0 / 3.0
    data = frame(0.01 * k[~lost], "time [s]")
    assert "rate-ignores-stamps" in codes(gmwm.read(data, rate=rate, time=False))
    even = frame(0.01 * k, "time [s]")
    assert "rate-ignores-stamps" not in codes(gmwm.read(even, rate=100.0, time=False))
