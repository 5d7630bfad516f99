"""Missing, dead, stuck and saturated samples."""

import numpy as np
import pytest
from examining import examined, only

import gmwm
from gmwm import RandomWalk, WhiteNoise
from gmwm.diagnosis.samples import cut_off_or_abrupt_end
from marks import every, slow

SEEDS = range(30)


def white(n, seed):
    return np.random.default_rng(seed).normal(size=n)


def kinds(found, channel):
    return {notice.code for notice in found.of(channel)}


def test_a_stuck_value_is_found_and_placed(record):
    x = white(20_000, 1)
    x[5000:5040] = x[4999]
    (notice,) = gmwm.health(record(gyro_x=x)).of("gyro_x", "stuck")
    assert notice.values["longest"] == 41
    assert notice.values["time"] == pytest.approx(49.99)


def test_a_sensor_that_is_stuck_most_of_the_time_is_bad(record):
    x = np.round(white(20_000, 2), 2)
    x[5000:16_000] = x[4999]
    (notice,) = gmwm.health(record(gyro_x=x)).of("gyro_x", "stuck")
    assert notice.severity == "bad"


@pytest.mark.parametrize("step", every(3, [0.0, 0.01, 0.3, 0.5, 1.0, 2.0, 5.0, 20.0]))
def test_rounding_explains_runs_of_equal_samples_and_tails_are_not_saturation(record, step):
    for seed in SEEDS:
        x = white(3000, seed)
        if step:
            x = np.rint((x + 0.1 * seed) / step) * step
        assert not {"stuck", "saturation"} & kinds(gmwm.health(record(gyro_x=x)), "gyro_x")


def test_rounded_noise_of_low_bandwidth_is_not_stuck(record):
    smooth = gmwm.simulate(RandomWalk(0.3) + WhiteNoise(0.01), n=50_000, dt=0.01, seed=3)
    x = np.rint(smooth / 0.1) * 0.1
    assert "stuck" not in kinds(gmwm.health(record(gyro_x=x)), "gyro_x")


def test_a_dead_channel_is_bad(record):
    found = gmwm.health(record(gyro_x=np.full(1000, 0.5), gyro_y=white(1000, 4)))
    (notice,) = found.of("gyro_x")
    assert (notice.code, notice.severity) == ("dead", "bad")
    assert found.worst == "bad"
    assert found.events("gyro_x") == found.lines("gyro_x") == found.resonances("gyro_x") == ()


@pytest.mark.parametrize(
    ("ends", "step"),
    [((-np.inf, 1.5), 0.0), ((-np.inf, 1.5), 0.3), ((-2.1, 2.1), 0.0), ((-2.1, 2.1), 0.01),
     ((-2.1, 2.1), 0.3), ((-np.inf, 2.7), 0.0), ((-np.inf, 2.7), 0.01)],
)  # fmt: skip
def test_saturation_is_found(record, ends, step):
    x = np.clip(white(20_000, 5), *ends)
    if step:
        x = np.rint(x / step) * step
    (notice,) = gmwm.health(record(accel_x=x)).of("accel_x", "saturation")
    assert notice.values["highest"] == pytest.approx(ends[1], abs=0.51 * step)
    assert notice.severity == "bad"


def test_all_missing_and_mostly_missing(record):
    x = white(2000, 6)
    mostly = x.copy()
    mostly[500:1700] = np.nan
    found = gmwm.health(record(gyro_x=np.full(2000, np.nan), gyro_y=mostly, gyro_z=x))
    assert [f.severity for f in found.of("gyro_x")] == ["bad"]
    (gap,) = found.of("gyro_y", "gap")
    assert gap.severity == "bad"
    assert gap.values["missing"] == 1200
    assert not found.of("gyro_z", "gap")


def test_every_other_sample_missing_is_survived(record):
    x = white(5000, 9)
    x[::2] = np.nan
    found = gmwm.health(record(gyro_x=x))
    assert "length" in kinds(found, "gyro_x")


STEPS = (0.0, 0.1, 0.3, 1.0, 3.0)


@pytest.mark.parametrize("step", STEPS)
def test_noise_that_thins_out_has_no_abrupt_end(step):
    rng = np.random.default_rng(8)
    time = np.arange(5000)
    laws = {
        "gyro_x": rng.normal(size=5000),
        "gyro_y": rng.standard_t(3, 5000),
        "gyro_z": rng.laplace(size=5000) + 0.1 * np.cumsum(rng.normal(size=5000)),
        "accel_x": np.cumsum(rng.normal(size=5000)),
        "accel_y": rng.normal(size=5000) + 30.0 * np.sin(time / 40.0),
        "accel_z": rng.normal(size=5000) + 0.01 * time,
    }
    for x in laws.values():
        x = np.rint(x / step + 0.2) * step if step else x
        assert only(cut_off_or_abrupt_end(examined(x, unit="u", step=step))) is None


@pytest.mark.parametrize("step", STEPS[:2])
def test_the_ends_at_which_samples_are_cut_are_named(step):
    x = white(100_000, 9) + 0.3 * np.sin(np.arange(100_000) / 500.0)

    def ends(values):
        found = only(cut_off_or_abrupt_end(examined(values, unit="u", step=step)))
        return found.severity, found.values["lowest"], found.values["highest"]

    x = np.rint(x / step) * step if step else x
    near = pytest.approx
    assert ends(np.abs(x)) == ("bad", near(0.0, abs=1e-3), near(0.0, abs=1e-3))
    assert ends((x + 1.5) % 3.0) == ("bad", near(0.0, abs=1e-3), near(3.0 - step, abs=1e-3))
    assert ends(x[x < 1.45]) == ("bad", near(1.45, abs=0.06), near(1.45, abs=0.06))
    # Samples that are sorted out beyond 2.2 deviations make the noise a tenth smaller at most.
    assert ends(x[x < 2.25])[0] == "warning"


@pytest.mark.parametrize(("step", "severity"), [(0.1, "bad"), (0.02, "warning"), (0.5, "bad")])
@pytest.mark.parametrize("law", ["normal", slow("laplace")])
def test_samples_cut_towards_zero_are_named_and_rounded_ones_are_not(step, severity, law):
    scale = {"normal": 1.0, "laplace": 0.6}[law]
    noise = getattr(np.random.default_rng(3), law)(0.0, scale, size=200_000)
    channels = {"gyro_x": np.trunc(noise / step) * step, "gyro_y": np.rint(noise / step) * step}
    rec = gmwm.Recording.from_arrays(channels, 100.0, {"gyro": "deg/s"})
    (notice,) = gmwm.health(rec).of(code="value-repeated")
    assert (notice.where, notice.severity) == ("gyro_x", severity)
