"""Clocks as they are: bursts, copies, jitter, backward steps, jumps and losses."""

from __future__ import annotations

import numpy as np
import pytest

import gmwm
from gmwm.errors import InputError
from gmwm.readers import read, tuning
from gmwm.readers.clock import Jumps
from gmwm.readers.clock.beat import without_beat
from gmwm.readers.clock.uneven import _costs, followed

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
        clock.jitter(0.4)
        clock.lose(0.01)
    elif kind == "copies":
        clock.lose(0.01)
        clock.copy(0.001)
    elif kind == "backward steps":
        clock.lose(0.01)
        clock.step(-0.3)
    elif kind == "a clock that is set":
        clock.jitter(0.3)
        clock.step(1.6e9)
    return clock


KINDS = (
    "bursts of four", "losses", "jitter", "jitter and losses", "copies", "backward steps",
    "a clock that is set",
)  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("rate", "seed"), [(63.0, 1), (200.0, 2), (200.0, 3), (1000.0, 4)])
def test_every_row_has_its_number(kind, rate, seed):
    clock = made(kind, seed, rate)
    found = followed(clock.stamps, clock.same, clock.stamps.size)
    assert np.array_equal(np.cumsum(found.advance), clock.number - clock.number[0])
    assert found.interval * rate == pytest.approx(1.0, abs=1e-5)
    assert np.count_nonzero(found.is_set) == (kind in ("backward steps", "a clock that is set"))
    assert found.burst == (4 if kind == "bursts of four" else 1)


@pytest.fixture
def recorded(tmp_path):
    """Write noise with these stamps; the recording, and the samples, NaN where one is missing."""

    def _recorded(clock):
        noise = np.random.default_rng(9).normal(size=N)
        path = tmp_path / "log.npz"
        np.savez(path, time_s=clock.stamps, gx=noise[clock.number])
        truth = np.full(clock.number[-1] + 1, np.nan)
        truth[clock.number] = noise[clock.number]
        return read(path, units={"gyro": "rad/s"}), truth

    return _recorded


@pytest.mark.parametrize("kind", KINDS)
def test_variances_are_those_of_the_truth(recorded, kind):
    found, truth = recorded(made(kind, 5, 200.0))
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
        ("backward steps", "clock-set", "count"),
        ("a clock that is set", "clock-set", "count"),
        ("jitter and losses", "clock-jumps", "missing"),
    ],
)
def test_it_is_reported(recorded, kind, code, key):
    clock = made(kind, 6, 200.0)
    expected = {
        "stamps-in-bursts": 4,
        "rows-repeated": np.count_nonzero(clock.same),
        "clock-set": 1,
        "clock-jumps": N - clock.number.size,
    }[code]
    found, _ = recorded(clock)
    (notice,) = [each for each in found.notices if each.code == code]
    assert notice.values[key] == expected > 0


@pytest.mark.parametrize("by", [1.6e9, -0.3])
@pytest.mark.parametrize("row", [2000, 2001, 2002, 2003])
@pytest.mark.parametrize("loss", [0.0, 0.01])
def test_a_clock_that_is_set_in_a_burst_invents_no_sample(recorded, by, row, loss):
    clock = Simulated(3, 200.0)
    clock.bursts(4)
    clock.stamps = clock.stamps + by * (clock.number >= row)
    clock.lose(loss)
    found, truth = recorded(clock)
    assert found.n == N
    if not loss:  # which row of a burst was lost does not show
        np.testing.assert_array_equal(found["gyro_x"].values, truth)
    (notice,) = [each for each in found.notices if each.code == "clock-set"]
    assert notice.values["largest"] == pytest.approx(by, abs=0.021)


def test_by_how_much_a_clock_was_set(recorded):
    found, _ = recorded(made("backward steps", 7, 200.0))
    (notice,) = [each for each in found.notices if each.code == "clock-set"]
    assert notice.severity == "warning"
    assert notice.values["largest"] == pytest.approx(-0.295, abs=0.006)


def test_rows_that_only_look_alike_are_no_copies(recorded):
    clock = made("bursts of four", 8, 200.0)
    coarse = np.round(np.random.default_rng(2).normal(size=N))
    same = np.r_[False, (np.diff(coarse) == 0.0) & (np.diff(clock.stamps) == 0.0)]
    found = followed(clock.stamps, same, clock.stamps.size)
    assert np.all(found.advance[1:] == 1)


@pytest.mark.parametrize("rate", [1100.0, 1300.0, 2000.0, 4000.0])
def test_stamps_in_whole_milliseconds_repeat(recorded, rate):
    clock = Simulated(3, rate)
    clock.stamps = np.floor(1e3 * clock.stamps) / 1e3
    found, truth = recorded(clock)
    np.testing.assert_array_equal(found["gyro_x"].values, truth)
    assert found.rate == pytest.approx(rate, rel=1e-5)


def test_coarse_stamps_with_a_loss_are_refused_as_without(recorded):
    clock = Simulated(3, 700.0)
    clock.lose(0.002)
    clock.stamps = np.round(clock.stamps, 3)
    with pytest.raises(InputError, match="rounded too coarsely"):
        recorded(clock)


@pytest.mark.parametrize(
    ("rate", "unit"), [(800.0, 1e-3), (952.0, 1e-3), (6664.0, 1e-3), (80.0, 1e-2)]
)
@pytest.mark.parametrize("loss", [0.0, 0.01])
def test_coarse_stamps_are_not_a_faster_clock_that_loses_rows(recorded, rate, unit, loss):
    clock = Simulated(0, rate)
    clock.lose(loss)
    clock.stamps = np.round(clock.stamps / unit) * unit
    with pytest.raises(InputError, match="rounded too coarsely"):
        recorded(clock)


@pytest.mark.parametrize("seed", range(40))
def test_rows_lost_at_random_have_no_rhythm(seed):
    rng = np.random.default_rng(seed)
    rows = np.cumsum(rng.geometric(0.01, size=(5, 8, 10, 30, 100)[seed % 5]))
    one = np.ones(rows.size)
    assert not Jumps(rows, 2.0 * one, one, 1.0).are_rounding


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
    assert "clock-set" not in codes


@pytest.mark.parametrize("seed", range(3))
def test_stamps_in_no_order_are_refused(recorded, seed):
    clock = Simulated(seed, 200.0)
    clock.rng.shuffle(clock.stamps)
    with pytest.raises(InputError, match=r"goes back, and .* no even clock fits") as caught:
        recorded(clock)
    assert caught.value.code == "clock"
    assert "sort the rows" in caught.value.hint


def test_a_stopped_clock_is_refused(recorded):
    clock = Simulated(1, 200.0)
    clock.stamps[2000:] = clock.stamps[2000]
    with pytest.raises(InputError, match="repeats the one before"):
        recorded(clock)


def test_a_host_that_stalls_loses_nothing(recorded):
    clock = Simulated(1, 200.0)
    for row in (900, 2500, 4000):
        clock.stamps[row : row + 20] = clock.stamps[row + 20]
    found, truth = recorded(clock)
    np.testing.assert_array_equal(found["gyro_x"].values, truth)
    (notice,) = [each for each in found.notices if each.code == "stamps-astray"]
    assert notice.values["largest"] == pytest.approx(0.1, rel=0.05)


@pytest.mark.parametrize("share", [0.2, 1.0 / 3.0, 0.4])
@pytest.mark.parametrize("loss", [0.0, 0.01])
def test_stamps_early_and_late_in_turns(recorded, share, loss):
    clock = Simulated(4, 200.0)
    clock.stamps = clock.stamps + share * (-1.0) ** clock.number / 200.0
    clock.lose(loss)
    found, truth = recorded(clock)
    np.testing.assert_array_equal(found["gyro_x"].values, truth)
    assert found.rate == pytest.approx(200.0, rel=1e-5)
    (notice,) = [each for each in found.notices if each.code == "stamps-in-turns"]
    assert notice.values["share"] == pytest.approx(share, rel=1e-3)


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("share", [0.1, 0.25, 0.4])
def test_jitter_and_rounding_have_no_turns(seed, share):
    rng = np.random.default_rng(seed)
    n = (64, 500)[seed % 2]
    assert without_beat(np.arange(n) + rng.uniform(-share, share, n)) is None
    assert without_beat(np.round(np.arange(n) / rng.uniform(100.0, 900.0), 3)) is None


@pytest.mark.parametrize("by", [-4.0, -0.6, 2e8])
@pytest.mark.parametrize("seed", range(3))
def test_a_clock_that_is_set_by_little_or_in_a_stall_is_reported(recorded, by, seed):
    clock = Simulated(seed, 200.0)
    clock.jitter(0.3)
    row = int(clock.rng.integers(1000, 5000))
    if abs(by) > 1.0:
        clock.stamps[row - 10 : row + 10] = clock.stamps[row + 10]
    clock.stamps[row:] += by / 200.0
    found, _ = recorded(clock)
    notices = {each.code: each for each in found.notices}
    reported = notices.get("clock-shifts", notices.get("clock-set"))
    assert reported.severity == "warning"
    if "clock-shifts" in notices:
        assert found.n == N
        assert reported.values["largest"] == pytest.approx(by / 200.0, rel=0.1, abs=5e-4)
        assert reported.values["row"] == pytest.approx(row, abs=100)


def test_a_clock_that_wanders_has_no_shifts(recorded):
    clock = Simulated(2, 200.0)
    clock.jitter(0.4)
    wander = (
        np.cumsum(clock.rng.normal(size=N)) * 5e-5 + 2.0 * np.sin(clock.number / 2000.0) / 200.0
    )
    clock.stamps = clock.stamps + wander
    found, _ = recorded(clock)
    assert {each.code for each in found.notices}.isdisjoint({"clock-shifts", "clock-set"})


def test_rows_are_copies_only_where_their_stamps_do_not_repeat_as_well():
    """Samples that repeat with their stamps are buffered; those that repeat alone are copies."""
    stamps = np.repeat(np.arange(50.0), 2)
    same = np.diff(stamps, prepend=-1.0) == 0.0
    usual = np.array([*tuning.CLOCK_COSTS, 0.0])
    lone = np.where(np.arange(100) < 30, same, False)
    np.testing.assert_array_equal(_costs(stamps, lone), usual)
    np.testing.assert_array_equal(_costs(np.arange(100.0), same)[[1, 4]], [0.0, usual[1]])
