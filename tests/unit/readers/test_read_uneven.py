"""Clocks as they are: bursts, copies, jitter, late stamps and losses."""

from __future__ import annotations

import numpy as np
import pytest

import gmwm
from gmwm.errors import InputError
from gmwm.readers import read
from gmwm.readers.grid import Jumps, place_uneven

N = 6000


class Simulated:
    """Stamps of a recorder, and the sample number of each row that it wrote."""

    def __init__(self, seed, rate, n=N):
        self.rng, self.rate = np.random.default_rng(seed), rate
        self.number = np.arange(n)
        self.stamps = 12.0 + self.number / rate

    def jitter(self, share):
        self.stamps = self.stamps + self.rng.uniform(-share, share, self.number.size) / self.rate

    def bursts(self, size):
        self.stamps = self.stamps[self.number // size * size + size - 1]

    def lose(self, share):
        kept = self.rng.random(self.number.size) >= share
        kept[[0, -1]] = True
        self.number, self.stamps = self.number[kept], self.stamps[kept]

    def copy(self, share):
        times = 1 + (self.rng.random(self.number.size) < share)
        self.number, self.stamps = (np.repeat(each, times) for each in (self.number, self.stamps))

    def step(self, by):
        row = self.number.size // 3
        self.stamps = self.stamps + by * (np.arange(self.number.size) >= row)

    @property
    def same(self):
        return np.diff(self.number, prepend=-1) == 0


def made(kind, seed, rate):
    clock = Simulated(seed, rate)
    if kind == "bursts of four":
        clock.bursts(4)
    elif kind == "losses":
        clock.lose(0.01)
    elif kind == "jitter":
        clock.jitter(0.4)
    elif kind == "jitter and losses":
        clock.jitter(0.3)
        clock.lose(0.02)
    elif kind == "copies":
        clock.lose(0.01)
        clock.copy(0.001)
    return clock


KINDS = ("bursts of four", "losses", "jitter", "jitter and losses", "copies")


@pytest.mark.parametrize("kind", ["bursts of four", "jitter", "jitter and losses"])
@pytest.mark.parametrize(("rate", "seed"), [(63.0, 1), (200.0, 2), (200.0, 3), (1000.0, 4)])
def test_every_row_has_its_number(kind, rate, seed):
    clock = made(kind, seed, rate)
    found = place_uneven(clock.stamps)
    spread = found.jumps.spread(clock.number.astype(float))
    there = ~np.isnan(spread)
    off = spread[there] - np.flatnonzero(there)
    if kind == "jitter and losses":
        assert np.mean(off == 0.0) > 0.98 and np.mean(np.abs(off) > 1.0) < 1e-3
    else:
        assert not np.any(off)
    assert found.jumps.interval * rate == pytest.approx(1.0, abs=1e-5)
    assert found.burst == (4 if kind == "bursts of four" else 1)


@pytest.fixture
def recorded(tmp_path):
    """Write noise with these stamps; the recording, and the samples, NaN where one is missing."""

    def _recorded(clock):
        noise = np.random.default_rng(9).normal(size=clock.number[-1] + 1)
        path = tmp_path / "log.npz"
        np.savez(path, time_s=clock.stamps, gx=noise[clock.number])
        truth = np.full(clock.number[-1] + 1, np.nan)
        truth[clock.number] = noise[clock.number]
        return read(path, units={"gyro": "rad/s"}), truth

    return _recorded


@pytest.mark.parametrize("kind", KINDS)
def test_variances_are_those_of_the_truth(recorded, kind):
    found, truth = recorded(made(kind, 5, 200.0))
    if kind == "jitter and losses":  # the place of a loss among rows with jitter is not exact
        assert found.n == pytest.approx(N, abs=1)
        assert np.mean(np.isnan(found["gyro_x"].values[: N - 1]) == np.isnan(truth[: N - 1])) > 0.97
        return
    np.testing.assert_array_equal(found["gyro_x"].values, truth)
    ours = gmwm.wavelet_variance(found["gyro_x"])
    theirs = gmwm.wavelet_variance(truth, dt=1.0 / 200.0)
    np.testing.assert_allclose(ours.variance, theirs.variance, rtol=1e-13)
    np.testing.assert_allclose(ours.tau, theirs.tau, rtol=1e-5)


@pytest.mark.parametrize(
    ("kind", "code", "key"),
    [
        ("bursts of four", "stamps-in-bursts", "rows"),
        ("copies", "rows-repeated", "count"),
        ("jitter and losses", "clock-jumps", "missing"),
    ],
)
def test_it_is_reported(recorded, kind, code, key):
    clock = made(kind, 6, 200.0)
    expected = {
        "stamps-in-bursts": 4,
        "rows-repeated": np.count_nonzero(clock.same),
        "clock-jumps": N - clock.number.size,
    }[code]
    found, _ = recorded(clock)
    (notice,) = [each for each in found.notices if each.code == code]
    assert notice.values[key] == pytest.approx(expected, abs=1) and expected > 0


@pytest.mark.parametrize(("by", "words"), [(1.6e9, "samples are missing"), (-0.3, "goes back")])
@pytest.mark.parametrize("size", [1, 4])
def test_a_clock_that_is_set_is_rejected_with_its_place(recorded, by, words, size):
    clock = Simulated(3, 200.0)
    clock.jitter(0.3 * (size == 1))
    clock.bursts(size)
    clock.step(by)
    with pytest.raises(InputError, match=words) as caught:
        recorded(clock)
    assert caught.value.code == "clock"
    assert "cut the file at this row and use one part" in str(caught.value)
    assert "row 2000" in str(caught.value)
    for part in (slice(None, 2000), slice(2000, None)):
        cut = Simulated(3, 200.0)
        cut.number, cut.stamps = clock.number[part] - clock.number[part][0], clock.stamps[part]
        found, truth = recorded(cut)
        np.testing.assert_array_equal(found["gyro_x"].values, truth)


@pytest.mark.parametrize("rate", [1100.0, 1300.0, 1700.0, 3300.0])
def test_stamps_in_whole_milliseconds_repeat(recorded, rate):
    clock = Simulated(3, rate)
    clock.stamps = np.floor(1e3 * clock.stamps) / 1e3
    found, truth = recorded(clock)
    np.testing.assert_array_equal(found["gyro_x"].values, truth)
    assert found.rate == pytest.approx(rate, rel=1e-5)


@pytest.mark.parametrize("rate", [1600.0, 1660.0, 1800.0, 1900.0, 3200.0])
@pytest.mark.parametrize("rounded", [np.round, np.floor])
def test_stamps_coarser_than_the_interval_give_the_mean_rate(recorded, rate, rounded):
    clock = Simulated(3, rate)
    clock.stamps = rounded(1e3 * clock.number / rate) / 1e3
    found, truth = recorded(clock)
    np.testing.assert_array_equal(found["gyro_x"].values, truth)
    assert found.rate == pytest.approx(rate, rel=2e-5)
    assert "stamps-coarse" in {each.code for each in found.notices}


@pytest.mark.parametrize(
    ("rate", "loss"),
    [(1600.0, 0.001), (1800.0, 0.01), (1990.0, 0.01), (1250.0, 0.03), (2000.0, 0.03)],
)
def test_stamps_coarser_than_the_interval_hide_no_rhythm(recorded, rate, loss):
    clock = Simulated(0, rate, 20_000)
    clock.lose(loss)
    clock.stamps = np.round(1e3 * clock.number / rate) / 1e3
    with pytest.raises(InputError, match="rounded too coarsely"):
        recorded(clock)


def test_coarse_stamps_with_a_loss_are_refused_as_without(recorded):
    clock = Simulated(3, 700.0)
    clock.lose(0.002)
    clock.stamps = np.round(clock.stamps, 3)
    with pytest.raises(InputError, match="rounded too coarsely"):
        recorded(clock)


@pytest.mark.parametrize("rate", [700.0, 850.0, 952.0, 998.7])
def test_rounded_stamps_of_an_even_clock_give_its_rate(recorded, rate):
    clock = Simulated(3, rate)
    clock.stamps = np.round(clock.stamps, 3)
    found, truth = recorded(clock)
    np.testing.assert_array_equal(found["gyro_x"].values, truth)
    assert found.rate == pytest.approx(rate, rel=2e-5)


@pytest.mark.parametrize("seed", range(8))
def test_runs_of_lost_rows_beside_strong_jitter_are_counted_or_rejected(recorded, seed):
    clock = Simulated(seed, 100.0)
    clock.jitter(0.3)
    there = np.ones(N, dtype=bool)
    for start in clock.rng.integers(1, N - 13, size=120):
        there[start : start + 12] = False
    clock.number, clock.stamps = clock.number[there], clock.stamps[there]
    try:
        found = recorded(clock)[0]
    except InputError as error:
        assert "column 'time_s'" in str(error)
    else:
        assert found.rate == pytest.approx(100.0, rel=2e-4)


@pytest.mark.parametrize("rate", [999.7, 998.5])
def test_lost_rows_in_milliseconds_hide_a_rate_below_a_kilohertz(recorded, rate):
    """A limit that the documentation states: both are steps of 1 ms, and some of 2 ms."""
    clock = Simulated(3, rate)
    clock.lose(0.01)
    clock.stamps = np.round(clock.stamps, 3)
    assert recorded(clock)[0].rate == pytest.approx(1000.0, rel=1e-5)


@pytest.mark.parametrize("rate", [700.0, 850.0])
@pytest.mark.parametrize("loss", [0.1, 0.4])
def test_coarse_stamps_with_many_losses_are_no_faster_clock(recorded, rate, loss):
    clock = Simulated(3, rate)
    clock.lose(loss)
    clock.stamps = np.round(clock.stamps, 3)
    with pytest.raises(InputError, match=r"rounded too coarsely|is not known"):
        recorded(clock)


@pytest.mark.parametrize(("rate", "unit"), [(800.0, 1e-3), (952.0, 1e-3), (80.0, 1e-2)])
@pytest.mark.parametrize("loss", [0.01, 0.05])
def test_coarse_stamps_are_not_a_faster_clock_that_loses_rows(recorded, rate, unit, loss):
    clock = Simulated(0, rate)
    clock.lose(loss)
    clock.stamps = np.round(clock.stamps / unit) * unit
    with pytest.raises(InputError, match="rounded too coarsely"):
        recorded(clock)


def test_rows_lost_at_random_have_no_rhythm():
    for seed in range(40):
        rng = np.random.default_rng(seed)
        rows = np.cumsum(rng.geometric(0.01, size=(5, 8, 10, 30, 100)[seed % 5]))
        one = np.ones(rows.size)
        assert not Jumps(rows, 2.0 * one, one, 1.0).are_rounding, seed


def test_a_counter_that_runs_over_in_bursts_is_continued(tmp_path):
    clock = Simulated(4, 200.0)
    clock.bursts(4)
    clock.lose(0.01)
    noise = np.random.default_rng(9).normal(size=N)
    ticks = np.floor(1e6 * clock.stamps + 2.0**32 - 3e7) % 2.0**32
    np.savez(tmp_path / "log.npz", time_us=ticks, gx=noise[clock.number])
    found = read(tmp_path / "log.npz", units={"gyro": "rad/s"})
    assert found.n == N
    assert found.rate == pytest.approx(200.0, rel=1e-5)
    codes = {each.code for each in found.notices}
    assert "clock-wraps" in codes


def test_a_clock_that_restarts_twice_is_to_be_cut(recorded):
    clock = Simulated(0, 200.0)
    clock.stamps = np.mod(clock.stamps, N / 600.0)
    with pytest.raises(InputError, match=r"goes back, and \d more .*: cut the file"):
        recorded(clock)


@pytest.mark.parametrize("seed", range(3))
def test_stamps_in_no_order_are_refused(recorded, seed):
    clock = Simulated(seed, 200.0)
    clock.rng.shuffle(clock.stamps)
    with pytest.raises(InputError, match="goes back") as caught:
        recorded(clock)
    assert caught.value.code == "clock"
    assert str(caught.value).endswith("give the sensor's rate=HZ and time=False")


def _refused(kind, clock):
    number = clock.number
    if kind == "milliseconds":
        clock.rate = 900.0
        clock.stamps = np.round(number / 0.9) / 1e3
    elif kind == "milliseconds and a loss":
        clock.rate = 1660.0
        clock.stamps = np.round((number + (number > 2000)) / 1.66) / 1e3
    elif kind == "bursts":
        clock.stamps = number // 20 * 20 / 200.0 + number % 20 * 1e-4
    elif kind == "set to zero":
        clock.stamps[N // 2 :] -= clock.stamps[N // 2]
    elif kind == "jitter":
        clock.jitter(3.0)
        clock.stamps.sort()
    elif kind == "an hour's gap":
        clock.step(3600.0)


REFUSED = ("milliseconds", "milliseconds and a loss", "bursts", "set to zero", "jitter")


@pytest.mark.parametrize("kind", [*REFUSED, "an hour's gap"])
def test_a_refusal_names_the_mean_rate_of_the_rows(recorded, kind):
    clock = Simulated(3, 200.0)
    _refused(kind, clock)
    with pytest.raises(InputError, match="rows come at") as caught:
        recorded(clock)
    assert caught.value.values["rate"] == pytest.approx(clock.rate, rel=5e-3)
    assert ("goes back" in str(caught.value)) == (kind == "set to zero")


def test_a_refusal_names_no_rate_of_two(recorded):
    clock = Simulated(3, 200.0)
    clock.stamps[N // 2 :] = clock.stamps[N // 2] + np.arange(N - N // 2) / 350.0
    clock.stamps[5000:] -= 3.0
    with pytest.raises(InputError) as caught:
        recorded(clock)
    assert "rate" not in caught.value.values


def test_a_stopped_clock_is_refused(recorded):
    clock = Simulated(1, 200.0)
    clock.stamps[2000:] = clock.stamps[2000]
    with pytest.raises(InputError, match="repeats the one before"):
        recorded(clock)


def test_a_host_that_stalls_loses_nothing(recorded):
    clock = Simulated(1, 200.0)
    for row in (900, 2500, 4000):
        clock.stamps[row : row + 20] = clock.stamps[row + 20] + 1e-5 * np.arange(-20, 0)
    found, truth = recorded(clock)
    np.testing.assert_array_equal(found["gyro_x"].values, truth)
    (notice,) = [each for each in found.notices if each.code == "stamps-astray"]
    assert notice.values["largest"] == pytest.approx(0.1, rel=0.05)


@pytest.mark.parametrize("share", [0.2, 1.0 / 3.0, 0.4])
def test_stamps_early_and_late_in_turns_lose_nothing(recorded, share):
    clock = Simulated(4, 200.0)
    clock.stamps = clock.stamps + share * (-1.0) ** clock.number / 200.0
    found, truth = recorded(clock)
    np.testing.assert_array_equal(found["gyro_x"].values, truth)
    assert found.rate == pytest.approx(200.0, rel=1e-5)


def test_a_clock_that_wanders_is_even(recorded):
    clock = Simulated(2, 200.0)
    clock.jitter(0.4)
    wander = (
        np.cumsum(clock.rng.normal(size=N)) * 5e-5 + 2.0 * np.sin(clock.number / 2000.0) / 200.0
    )
    clock.stamps = clock.stamps + wander
    found, truth = recorded(clock)
    np.testing.assert_array_equal(found["gyro_x"].values, truth)
