"""Jumps of a clock and changes of its rate: their places and sizes."""

import numpy as np
import pytest

from gmwm.errors import InputError
from gmwm.readers import tuning
from gmwm.readers.clock import Clock, timing_of
from gmwm.readers.grid import Jumps, find_change, find_jumps

DT = 0.004


def clock(times):
    """A clock of these stamps in seconds."""

    def never(rows):
        return np.zeros(rows.size, dtype=bool)

    return Clock("a.csv", "column 't'", times, 1.0, "s", lambda row: f"row {row}", never)


def stamps(n=3000, lost=(), late=(), dt=DT):
    """An even clock from which (row, rows) are lost, and (row, steps) come late."""
    place = np.arange(n, dtype=float)
    for row, rows in lost:
        place[row:] += rows
    for row, steps in late:
        place[row] += steps
    return 100.0 + dt * place


@pytest.mark.parametrize(
    "lost", [(), ((1, 1),), ((2999, 1),), ((700, 1), (701, 2)), ((10, 40), (1500, 1), (2000, 9))]
)
def test_rows_that_are_lost_are_counted_where_they_are(lost):
    found = find_jumps(stamps(lost=lost))
    assert found.interval == pytest.approx(DT, rel=1e-9)
    assert found.rows.tolist() == [row for row, _ in lost]
    assert found.missing.tolist() == [rows for _, rows in lost]
    assert found.total == sum(rows for _, rows in lost)
    np.testing.assert_allclose(found.steps, [1.0 + rows for _, rows in lost], atol=1e-6)
    assert not np.any(found.is_off_grid)
    if lost:
        assert np.max(found.missing) == max(rows for _, rows in lost)


@pytest.mark.parametrize("steps", [0.4, 0.8, -0.4, 3.0])
def test_a_stamp_that_is_late_loses_nothing(steps):
    found = find_jumps(stamps(late=[(1000, min(steps, 0.99))]))
    assert found.total == 0
    assert find_jumps(stamps(lost=[(900, 2)], late=[(1000, 0.8)])).rows.tolist() == [900]


@pytest.mark.parametrize(("rows", "off"), [(5.0, False), (5.1, False), (5.4, True), (4.6, True)])
def test_a_jump_that_is_no_whole_number_of_steps(rows, off):
    found = find_jumps(stamps(lost=[(1500, rows)]))
    assert found.missing.tolist() == [5.0]
    assert found.is_off_grid.tolist() == [off]
    assert found.interval == pytest.approx(DT, rel=1e-6 if off else 1e-4)


@pytest.mark.parametrize("seed", range(5))
def test_rows_are_put_where_their_numbers_say(seed):
    rng = np.random.default_rng(seed)
    n = 60
    rows = np.sort(rng.choice(np.arange(1, n), 6, replace=False))
    repeated = np.setdiff1d(np.sort(rng.choice(np.arange(1, n), 8, replace=False)), rows)
    missing = rng.integers(1, 5, rows.size).astype(float)
    jumps = Jumps(rows, 1.0 + missing, missing, DT, repeated)
    expected, number = [], -1
    for row in range(n):
        if row not in repeated:
            number += 1 + int(np.sum(missing[rows == row]))
        expected.append(number)
    values = rng.normal(size=n)
    spread = jumps.spread(values)
    kept = np.setdiff1d(np.arange(n), repeated)
    whole = np.full(expected[-1] + 1, np.nan)
    whole[np.array(expected)[kept]] = values[kept]
    np.testing.assert_array_equal(spread, whole)


def bursts(length, count, missing=3.0):
    rows = np.arange(1, count + 1) * length
    return Jumps(rows, np.full(count, 1.0 + missing), np.full(count, missing), DT)


@pytest.mark.parametrize(
    ("length", "count", "are"), [(8, 20, False), (8, 21, True), (32, 21, True), (33, 21, False)]
)
def test_bursts_are_alike_and_short(length, count, are):
    assert bursts(length, count).are_bursts is are


@pytest.mark.parametrize(("odd", "are"), [(9, True), (10, False)])
def test_nine_of_ten_bursts_are_alike(odd, are):
    jumps = bursts(8, 101)
    jumps.missing[1 : 1 + odd] = 4.0
    assert jumps.are_bursts is are


@pytest.mark.parametrize(
    ("first", "second", "row"), [(0.01, 0.0101, None), (0.01, 0.0103, 1600), (0.0103, 0.01, 800)]
)
def test_a_change_of_the_rate_has_a_place(first, second, row):
    n = 3201
    at = row or 1600
    steps = np.where(np.arange(n - 1) < at, first, second)
    found = find_change(np.cumsum(np.append(0.0, steps)))
    if row is None:
        assert found is None
        return
    assert found.row == row
    assert found.rates == pytest.approx((1.0 / first, 1.0 / second))


def test_a_change_of_the_rate_needs_two_parts():
    least = tuning.LEAST_PART
    steps = np.repeat([0.01, 0.02], least)
    assert find_change(np.cumsum(np.append(0.0, steps))).row == least
    assert find_change(np.cumsum(steps)) is None
    rng = np.random.default_rng(1)
    noisy = np.repeat([0.01, 0.0103], 400) * (1.0 + 0.3 * rng.normal(size=800))
    assert find_change(np.cumsum(noisy)) is None


def lossy(share, one_at_a_time, n=60_000, dt=DT):
    """An even clock that lost a share of its rows, or each with that chance if none before was."""
    rng = np.random.default_rng(3)
    kept = rng.random(n) >= share
    if one_at_a_time:
        kept[1:] |= ~kept[:-1]
    kept[:2] = True
    return np.round(dt * np.flatnonzero(kept), 6), kept


@pytest.mark.parametrize("one_at_a_time", [True, False])
@pytest.mark.parametrize("share", [0.05, 0.3, 0.5, 0.7, 0.9, 0.95])
def test_rows_lost_from_an_exact_clock_leave_its_rate(share, one_at_a_time):
    times, kept = lossy(share, one_at_a_time)
    timing = timing_of(clock(times))
    assert timing.rate == pytest.approx(1.0 / DT, rel=1e-5)
    placed = timing.jumps.spread(np.ones(times.size))
    np.testing.assert_array_equal(np.isfinite(placed), kept[: placed.size])


@pytest.mark.parametrize("jitter", [0.02, 0.05, 0.1, 0.2, 0.3])
@pytest.mark.parametrize("share", [0.5, 0.8, 0.95])
def test_with_jitter_the_rate_is_right_or_the_clock_rejected(share, jitter):
    times, _ = lossy(share, one_at_a_time=False)
    times += jitter * DT * np.random.default_rng(4).normal(size=times.size)
    try:
        assert timing_of(clock(times)).rate == pytest.approx(1.0 / DT, rel=1e-5)
        assert jitter < 0.1
    except InputError:
        assert jitter > 0.05


def test_runs_of_lost_rows_leave_the_rate():
    change = np.random.default_rng(5).random(60_000) < 1.0 / 50.0
    kept = np.cumsum(change) % 2 == 0
    timing = timing_of(clock(DT * np.flatnonzero(kept)))
    assert timing.rate == pytest.approx(1.0 / DT, rel=1e-5)


@pytest.mark.parametrize("steps", [(0.004, 0.006), (0.002, 0.003), (0.010, 0.015)])
def test_steps_of_two_sizes_without_a_whole_ratio_are_no_clock(steps):
    times = np.cumsum(np.random.default_rng(6).choice(steps, 20_000))
    with pytest.raises(InputError, match="differences add up"):
        timing_of(clock(times))


@pytest.mark.parametrize("share", [0.2, 0.5, 0.9])
def test_lost_rows_of_stamps_rounded_too_coarsely_are_not_placed_by_the_unit(share):
    times, _ = lossy(share, one_at_a_time=False, dt=1.0 / 700.0)
    with pytest.raises(InputError):
        timing_of(clock(np.round(times, 3)))


@pytest.mark.parametrize("rate", [250.1, 333.3])
@pytest.mark.parametrize("share", [0.02, 0.2, 0.5, 0.9])
def test_lost_rows_of_rounded_stamps_leave_the_rate(share, rate):
    times, _ = lossy(share, one_at_a_time=False, dt=1.0 / rate)
    assert timing_of(clock(np.round(times, 3))).rate == pytest.approx(rate, rel=3e-6)


@pytest.mark.parametrize("rate", [499.9, 500.1])
@pytest.mark.parametrize("share", [0.02, 0.2, 0.5, 0.9])
def test_lost_rows_of_stamps_rounded_to_half_a_step_are_right_or_rejected(share, rate):
    times, _ = lossy(share, one_at_a_time=False, dt=1.0 / rate)
    try:
        assert timing_of(clock(np.round(times, 3))).rate == pytest.approx(rate, rel=3e-5)
    except InputError as error:
        assert "half-way" in str(error) or "not near a whole number" in str(error)
