"""The step of the samples: found exactly, from text too, and not where there is none."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import gmwm
from gmwm.diagnosis.repeats import step_size, widest_step
from marks import slow


@settings(max_examples=60, deadline=None)
@given(
    step=st.floats(1e-7, 1e3),
    noise=st.floats(0.35, 300.0),
    offset=st.floats(-1e4, 1e4),
    n=st.integers(300, 3000),
    seed=st.integers(0, 10_000),
)
def test_step_is_found_whatever_the_scale_and_offset(step, noise, offset, n, seed):
    x = np.random.default_rng(seed).normal(size=n) * noise + offset
    assert step_size(np.rint(x) * step) == pytest.approx(step, rel=1e-6)


@pytest.mark.parametrize(("step", "decimals"), [(1 / 300, 5), (0.05, 2), (1.0 / 7.0, 2), (2e-3, 3)])
def test_text_with_few_decimals_does_not_hide_the_step(step, decimals):
    x = np.random.default_rng(1).normal(size=5000) * 6.0
    written = np.round(np.rint(x) * step, decimals)
    assert step_size(written) == pytest.approx(step, rel=2e-2)


@pytest.mark.parametrize(
    "differences",
    [[0, 2, 3, 2, 2, 3, 3, 2, 3, 2, 3, 2], [0, 6, 6, 7, 11, 6, 7, 11, 6, 6, 11, 7, 6]],
)
def test_the_common_divisor_of_differences_is_the_step(differences):
    levels = np.cumsum(differences) * 0.25
    x = np.random.default_rng(2).choice(levels, size=2000)
    assert step_size(x) == pytest.approx(0.25, rel=1e-9)


def test_two_levels_are_one_step_apart():
    x = np.where(np.random.default_rng(3).random(500) < 0.1, 0.3, 0.1)
    assert step_size(x) == pytest.approx(0.2)


def test_single_precision_keeps_its_own_step():
    # Numbers near 9.8 stored with 24 bits come in steps of 2^-20.
    x = (9.80665 + 1e-4 * np.random.default_rng(4).normal(size=50_000)).astype(np.float32)
    assert step_size(x.astype(float)) == pytest.approx(2.0**-20, rel=1e-6)


def of_digits(values, digits=3):
    return np.array([float(f"{each:.{digits}g}") for each in values])


@pytest.mark.parametrize(
    ("mean", "digits", "widest"),
    [
        (0.0, 1, 1e-3),
        (0.0, 2, 1e-4),
        (0.1, 3, 1e-3),
        (-0.1, 3, 1e-3),
        (0.101, 3, 1e-3),
        (0.1, 4, 1e-4),
        (0.0975, 3, 1e-4),
    ],
)
def test_numbers_of_few_digits_have_wider_steps_above_a_power_of_ten(mean, digits, widest):
    values = of_digits(mean + 1e-3 * np.random.default_rng(1).normal(size=40_000), digits)
    step = step_size(values)
    assert widest_step(values, step) == pytest.approx(widest, rel=1e-6)


def test_numbers_of_few_digits_in_half_precision_have_wider_steps_above_a_power_of_two():
    values = 0.125 + 1e-3 * np.random.default_rng(1).normal(size=40_000)
    values = values.astype(np.float16).astype(float)
    step = step_size(values)
    assert step == pytest.approx(2.0**-14)
    assert widest_step(values, step) == pytest.approx(2.0**-13)


@pytest.mark.parametrize("step", [0.05, 0.5, 1.0, 3.0])
def test_steps_of_one_size_have_no_wider_ones(step):
    """Nor where one level comes again and again, with all or none of those beside it."""
    values = np.rint(np.random.default_rng(2).normal(size=20_000) / step + 0.3) * step
    assert widest_step(values, step) == step
    values[::7] = 0.0
    assert widest_step(values, step) == step
    values[np.abs(values) < 0.5 * np.max(np.abs(values))] = 0.0
    assert widest_step(values, step) == step
    assert widest_step(np.random.default_rng(3).normal(size=20_000), 0.0) == 0.0


@pytest.mark.parametrize("mean", [0.1, -0.1, 0.1003])
def test_neighbours_of_few_digits_are_equal_by_chance(mean):
    """They were taken for lost packets and left out, which made the rest too quiet."""
    noise = 1e-3 * np.random.default_rng(3).normal(size=60_000)
    rec = gmwm.Recording.from_arrays({"gyro_x": of_digits(mean + noise)}, 100.0, {"gyro": "rad/s"})
    found = gmwm.health(rec)
    assert not found.of(code="held")
    assert found.channels["gyro_x"].held == 0.0
    (rounding,) = found.of(code="rounding")
    assert "where they are smaller" in rounding.text
    assert rounding.values["lsb"] == pytest.approx(1e-3, rel=1e-6)


@pytest.mark.parametrize("digits", [1, 2, 3])
@pytest.mark.parametrize("mean", [0.0, 1.2e-3])
@pytest.mark.parametrize("seed", [3, 4, *map(slow, (5, 6, 7))])
def test_neighbours_of_few_digits_about_zero_are_equal_by_chance(digits, mean, seed):
    noise = of_digits(mean + 1e-3 * np.random.default_rng(seed).normal(size=60_000), digits)
    found = gmwm.health(gmwm.Recording.from_arrays({"gyro_x": noise}, 100.0, {"gyro": "rad/s"}))
    assert not [n for n in found.notices if n.code in ("held", "stuck", "value-repeated")]


def test_few_digits_of_noise_far_below_their_wide_step_are_not_valid():
    noise = 3e-4 * np.random.default_rng(4).normal(size=60_000)
    rec = gmwm.Recording.from_arrays({"gyro_x": of_digits(0.1 + noise)}, 100.0, {"gyro": "rad/s"})
    (rounding,) = gmwm.health(rec).of(code="rounding")
    assert rounding.severity == "bad"


@pytest.mark.parametrize("n", [2, 3, 4, 5, 7, 100, 4097, 200_000])
def test_there_is_no_step_in_numbers_at_random_or_a_constant(n):
    for seed in range(5):
        assert step_size(np.random.default_rng(seed).normal(size=n)) == 0.0
    assert step_size(np.full(n, 3.3)) == 0.0


@pytest.mark.parametrize(
    ("ratio", "place", "is_bad"),
    [(ratio, place, ratio > 3.0) for ratio in (2.5, 3.5, 6.0) for place in (0.0, 0.2, 0.35, 0.5)]
    + [(50.0, 0.5, True)],
)
def test_coarse_steps_are_bad_wherever_the_mean_is(record, ratio, place, is_bad):
    """About the middle of a step all noise has a scatter of half a step: 2.45 times the noise."""
    noise = np.random.default_rng(11).normal(size=20_000) / ratio
    x = 1e-3 * np.rint(noise + place)
    found = gmwm.health(record(accel_x=x)).of("accel_x", "rounding")
    assert any(notice.severity == "bad" for notice in found) is is_bad


def test_noise_before_rounding_is_told(record):
    rng = np.random.default_rng(6)
    x = np.rint(rng.normal(size=50_000) * 0.1 / 0.08) * 0.08
    (notice,) = gmwm.health(record(accel_x=x)).of("accel_x", "rounding")
    assert notice.values["lsb"] == pytest.approx(0.08)
    # Predicted from 16 differences, white noise has 18/17 of its variance; the standard error of
    # a standard deviation from 50,000 samples is 0.3 %.
    assert notice.values["noise"] == pytest.approx(0.1 * np.sqrt(18.0 / 17.0), rel=0.015)
    assert "8.16 mg" in notice.text  # 0.08 m/s^2


def test_a_recording_all_of_which_is_left_out_as_events():
    """Of pairs that are nearly equal, every second prediction error is large."""
    rng = np.random.default_rng(3)
    x = np.repeat(np.round(rng.normal(size=4000), 3), 2)
    x[1::2] += np.round(0.01 * rng.normal(size=4000), 3)
    recording = gmwm.Recording.from_arrays({"gyro_x": x}, 400.0, {"gyro": "rad/s"})
    with pytest.raises(gmwm.InputError, match="all samples missing"):
        gmwm.calibrate(recording, gmwm.WhiteNoise())
