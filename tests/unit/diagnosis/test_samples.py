"""Counts of samples that are missing, held, at an end or on a value, from counts made by hand."""

import numpy as np
import pytest
from examining import examined, only

from gmwm import Channel
from gmwm._core.text import per_cent
from gmwm.diagnosis import tuning
from gmwm.diagnosis.repeats import held_samples, is_coarse, repetition, rounding, thinned
from gmwm.diagnosis.samples import cut_off_or_abrupt_end, gap_notices, is_dithered, repeated_value


def channel(values, name="gyro_x", dt=0.01):
    return Channel(name, np.asarray(values, dtype=float), dt, "gyro", "rad/s")


def shuffled(counts, seed=1, first=0):
    """Samples of whole values from ``first`` on, of each as many as counted."""
    values = np.repeat(np.arange(first, first + len(counts), dtype=float), counts)
    return np.random.default_rng(seed).permutation(values)


def test_gaps_are_counted():
    values = np.ones(100)
    values[[0, 1, 2, 50, 98, 99]] = np.nan
    (found,) = gap_notices([channel(values)], 0.1)
    assert found.values == pytest.approx(
        {"missing": 6.0, "share": 0.06, "gaps": 3.0, "longest": 0.3}
    )
    assert (found.where, found.severity) == ("gyro_x", "note")
    assert "6 of 100 samples missing (6 %) in 3 gaps, the longest 0.3 s" in found.text
    values[:] = 1.0
    values[7] = np.nan
    assert "in 1 gap," in gap_notices([channel(values)], 0.1)[0].text


@pytest.mark.parametrize(
    ("missing", "severity"),
    [(0, None), (10, "note"), (11, "warning"), (50, "warning"), (51, "bad"), (100, "bad")],
)
def test_many_gaps_are_worse(missing, severity):
    values = np.ones(100)
    values[:missing] = np.nan
    assert [each.severity for each in gap_notices([channel(values)], 1.0)] == (
        [severity] if severity else []
    )


def test_gaps_of_all_channels_are_those_of_the_recording():
    one, other = np.ones(10), np.ones(10)
    one[3] = other[3] = np.nan
    pair = [channel(one, "gyro_x"), channel(other, "gyro_y")]
    assert [each.where for each in gap_notices(pair, 1.0)] == [""]
    assert [each.where for each in gap_notices(pair[:1], 1.0)] == ["gyro_x"]
    other[4] = np.nan
    assert [each.where for each in gap_notices(pair, 1.0)] == ["gyro_x", "gyro_y"]
    assert [each.where for each in gap_notices([*pair, channel(np.ones(10), "gyro_z")], 1.0)] == [
        "gyro_x", "gyro_y",
    ]  # fmt: skip


def test_noise_is_as_wide_as_its_steps_between_runs():
    noise = np.tile([0.0, 2.0, 0.0, 1.0], 16)
    assert is_dithered(noise[: tuning.LONG_RUN + 1], 0.0)
    assert not is_dithered(noise[: tuning.LONG_RUN], 0.0)
    assert is_dithered(noise, 1.0) and not is_dithered(noise, 1.4)
    held = np.concatenate([noise, np.full(tuning.LONG_RUN - 2, 1.0), noise])
    assert is_dithered(held, 1.0)
    few = np.tile([0.0, 1.0], 1000)
    for far, dithered in ((49, False), (50, True)):  # each makes two steps, of 1999
        few[1 : 2 * far : 2] = 2.0
        assert is_dithered(few, 1.0) is dithered


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("last", "found"), [(7, False), (28, False), (34, True), (2000, True)])
def test_more_samples_at_the_end_than_before_it(sign, last, found):
    values = sign * shuffled([last, 20, 60, 400, 2000, 5000, 2000, 400, 60, 20, 4])
    notice = only(cut_off_or_abrupt_end(examined(values, step=1.0)))
    assert (notice is not None) is found
    if found:
        assert notice.values == pytest.approx({
            "samples": last, "share": last / values.size,
            "lowest": np.min(values), "highest": np.max(values),
        })  # fmt: skip
        assert notice.severity == ("bad" if last > 1e-3 * values.size else "warning")
        quiet = values[np.abs(values) > 0.0]
        calm = examined(values, step=1.0, quiet=quiet)
        assert only(cut_off_or_abrupt_end(calm)).severity == "warning"


def test_both_ends_are_counted():
    values = shuffled([80, 20, 60, 400, 2000, 400, 60, 20, 90])
    notice = only(cut_off_or_abrupt_end(examined(values, step=1.0)))
    assert notice.values["samples"] == 170.0
    assert "170 samples" in notice.text and " and " in notice.text


@pytest.mark.parametrize(
    ("most", "severity"), [(431, None), (433, "warning"), (600, "bad"), (1500, "bad")]
)
def test_a_value_that_comes_far_more_often_than_those_beside_it(most, severity):
    counts = np.array([10, 50, 100, 80, most, 100, 60, 30, 20])
    # No two of it in a row, so that runs are counted one by one.
    rest = shuffled([*counts[:4], 0, *counts[5:]])
    values = np.full(2 * most + 9550, np.nan)
    values[: 2 * most : 2] = 4.0
    free = np.flatnonzero(np.isnan(values))
    values[free] = np.resize(rest[rest != 4.0], free.size)
    often = np.unique(values[np.diff(values, prepend=-1) != 0], return_counts=True)[1]
    scale = np.max(np.delete(often, 4)[2:6]) / 100.0
    notice = only(repeated_value(examined(values, step=1.0, scatter=2.0)))
    enough = most - 4.0 * 100.0 * scale >= tuning.LONG_RUN
    assert (notice is not None) is bool(enough)
    if enough:
        assert notice.values["value"] == 4.0
        assert notice.values["samples"] == most
        assert notice.severity == ("bad" if most > 0.05 * values.size else "warning")


@pytest.mark.parametrize(("times", "first"), [(2, 0), (2, 1), (3, 2), (5, 0)])
def test_samples_that_are_repeated_are_counted(times, first):
    own = np.random.default_rng(5).normal(size=200)
    values = np.repeat(own, times)[times - first if first else 0 :]
    found = repetition(channel(values))
    assert (found.times, found.first) == (times, first)
    thin = thinned(channel(values), found)
    assert thin.dt == pytest.approx(0.01 * times)
    np.testing.assert_array_equal(thin.values, own[1 if first else 0 :])
    assert repetition(channel(own)) is None
    last = (first or times) + (tuning.FEWEST_KNOWN - 1) * times
    assert repetition(channel(values[:last])) is None
    assert repetition(channel(values[: last + 1])) is not None


@pytest.mark.parametrize("held", [0.0, 0.02, 0.1])
@pytest.mark.parametrize("step", [0.0, 0.25])
def test_the_share_of_samples_that_are_held(held, step):
    rng = np.random.default_rng(6)
    values = rng.normal(size=40_000)
    values = np.rint(values / step) * step if step else values
    again = np.flatnonzero(rng.random(values.size) < held)[1:]
    values[again] = values[again - 1]
    share, chance, _ = held_samples(examined(values, step=step))
    assert share == pytest.approx(held, rel=0.25, abs=1e-9)
    by_chance = 0.0 if step == 0.0 or held == 0.0 else 0.25 / np.sqrt(4.0 * np.pi)
    assert chance == pytest.approx(by_chance, rel=0.2)


@pytest.mark.parametrize(
    ("scatter", "severity"),
    [(1.5 * 3.0, "good"), (2.05, "good"), (1.95, "note"), (1.05, "note"), (0.95, "warning"),
     (0.34, "warning"), (0.32, "bad")],
)  # fmt: skip
def test_how_coarse_a_step_is_beside_the_noise(scatter, severity):
    fine = np.random.default_rng(1).integers(-9, 9, 2000)
    usual = float(np.hypot(scatter, 12**-0.5))
    found = only(rounding(examined(fine, step=1.0, scatter=usual)))
    assert found.severity == severity
    assert found.values == pytest.approx({"lsb": 1.0, "noise": scatter})
    if scatter > 1.0:
        share = per_cent(1.0 / 12.0 / (scatter**2 + 1.0 / 12.0))
        assert found.hint == f"rounding is treated as white noise: {share} of it"
    assert only(rounding(examined(fine))) is None


def test_two_levels_are_coarse_wherever_they_are():
    rng = np.random.default_rng(9)
    for noise, coarse in ((0.15, True), (0.5, False)):
        for mean in (0.0, 0.5, 7.3):
            values = np.rint(mean + noise * rng.normal(size=5000))
            assert is_coarse(values, 1.0) is coarse
    assert not is_coarse(np.zeros(0), 1.0)
