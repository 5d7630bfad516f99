"""Covariance analysis: against the filter's own covariance, laws of linearity, and Monte Carlo."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2, t

from error_models import triads
from gmwm import AR, GaussMarkov, QuantizationNoise, RandomWalk, RateRamp, Resonance, WhiteNoise
from gmwm.errors import InputError
from gmwm.ins.covariance import covariance_analysis
from gmwm.ins.filter.aiding import Aiding, Outage, barometer, gnss, standstills
from gmwm.ins.filter.filter import Filter, InitialSd
from gmwm.ins.increments import emulate
from gmwm.ins.sensors import SensorModels
from gmwm.ins.simulation.consistency import GROUPS
from gmwm.ins.simulation.trials import Scenario, Simulated, monte_carlo
from gmwm.ins.trajectory.missions import car_drive, fixed_wing_loiter, helicopter_mapping
from marks import slow

DT = 0.05
TRUTH = helicopter_mapping(duration=270.0, dt=DT).segment(70.0, 270.0)
IMU = emulate(TRUTH)
AIDING = gnss(
    TRUTH, velocity_sd=0.05, lever_arm=(1.0, -0.5, -2.0), coloured_sd=(0.5, 0.0, 1.0),
    coloured_tau=60.0, imu=IMU,
) + barometer(TRUTH, 2.0)  # fmt: skip
# Laws of the linear filter.
RICH = Scenario(TRUTH, AIDING, (Outage(100.0, 60.0),), interval=4.0, second_order=False)
PLAIN = Scenario(TRUTH, gnss(TRUTH), (Outage(100.0, 60.0),), interval=4.0, second_order=False)

EVERYTHING = SensorModels.of(
    {
        "gyro": WhiteNoise(1e-4) + GaussMarkov(2e-4, 20.0) + Resonance(1e-4, 1.0, 0.2),
        "gyro_z": WhiteNoise(2e-4) + GaussMarkov(1e-4, 0.03) + GaussMarkov(1e-4, 300.0),
        "accel": WhiteNoise(1e-3) + GaussMarkov(3e-3, 50.0) + RandomWalk(1e-4),
        "accel_x": WhiteNoise(1e-3) + QuantizationNoise(1e-4) + AR([0.9], 1e-7),
    },
    {"gyro": 1e-5, "accel": 1e-3},
)
FULL = triads(
    WhiteNoise(1e-4) + GaussMarkov(4e-4, 10.0) + GaussMarkov(1e-4, 300.0),
    WhiteNoise(1e-3) + GaussMarkov(3e-3, 10.0) + GaussMarkov(3e-3, 200.0),
)
SLOW_ONLY = triads(
    WhiteNoise(1e-4) + GaussMarkov(1e-4, 300.0), WhiteNoise(1e-3) + GaussMarkov(3e-3, 200.0)
)
STATELESS = SensorModels.of({"gyro": WhiteNoise(2e-4), "accel": WhiteNoise(2e-3)})


def scaled(models, factor):
    """All standard deviations times a factor."""
    amplitudes = ("N", "K", "sigma", "Q", "R")
    changed = {}
    for axis, model in models.models.items():
        values = {
            key: value * (factor if key.partition("_")[0] in amplitudes else 1.0)
            for key, value in model.params.items()
        }
        changed[axis] = model.with_params(values)
    return SensorModels(changed, {axis: factor * sd for axis, sd in models.bias_sd.items()})


def relative(first, second, scale=None):
    """Largest difference of two covariances in their standard deviations."""
    sd = np.sqrt(np.diagonal(second if scale is None else scale, axis1=1, axis2=2))
    alive = np.all(sd > 0.0, axis=0)
    if not np.any(alive):
        return float(np.abs(first - second).max())
    box = (sd[:, :, None] * sd[:, None])[:, alive][:, :, alive]
    return float(np.abs((first - second)[:, alive][:, :, alive] / box).max())


# ---- Truth and filter are one ----


@pytest.mark.parametrize("step", [0.05, 0.1, 0.15, 0.5])
@pytest.mark.parametrize("scenario", [RICH, PLAIN, replace(PLAIN, aiding=Aiding())])
def test_a_true_model_gives_the_covariance_that_the_filter_predicts(scenario, step):
    found = covariance_analysis(replace(scenario, step=step), EVERYTHING, EVERYTHING)
    assert relative(found.actual, found.predicted) < 1e-9
    assert relative(found.sensor_actual, found.sensor_predicted) < 1e-9
    np.testing.assert_allclose(found.nees(), 1.0, atol=1e-8)


@pytest.mark.parametrize("step", [0.05, 0.15, 0.25])
@pytest.mark.parametrize("believed", [EVERYTHING, SLOW_ONLY, STATELESS])
def test_the_prediction_is_that_of_the_filter_itself(believed, step):
    """Run on error-free increments and fixes; steps of one, three and five samples."""
    scenario = replace(RICH, step=step)
    found = covariance_analysis(scenario, FULL, believed)
    aiding = AIDING.without(scenario.outages)
    ready = Filter.of(believed, aiding, DT, step, second_order=False)
    events, outputs = aiding.events(DT, TRUTH.n), scenario.outputs()
    solution = ready.run(IMU, TRUTH.state(0), scenario.initial_sd, events, outputs)
    np.testing.assert_array_equal(found.time, solution.time)
    np.testing.assert_array_equal(found.before, solution.before)
    assert relative(solution.covariance, found.predicted) < 1e-4
    assert relative(solution.sensor_covariance, found.sensor_predicted) < 1e-4


def test_standstills_and_uneven_epochs():
    """A car, fixes every 0.7 s and outputs every 1.1 s: steps of all lengths."""
    truth = car_drive(duration=100.0, dt=DT)
    aiding = gnss(truth, 0.7, velocity_sd=0.1) + standstills(truth, 0.3)
    scenario = Scenario(truth, aiding, (Outage(50.0, 20.3),), interval=1.1, step=0.2)
    found = covariance_analysis(scenario, EVERYTHING, EVERYTHING)
    assert relative(found.actual, found.predicted) < 1e-9
    ready = Filter.of(EVERYTHING, aiding, DT, 0.2)
    events = aiding.without(scenario.outages).events(DT, truth.n)
    initial = (truth.state(0), scenario.initial_sd)
    solution = ready.run(emulate(truth), *initial, events, scenario.outputs())
    # The filter's estimate is not quite the truth: some centimetres after the outage.
    assert relative(solution.covariance, found.predicted) < 1e-3


def test_a_filter_without_sensor_states():
    found = covariance_analysis(PLAIN, STATELESS, STATELESS)
    assert relative(found.actual, found.predicted) < 1e-9
    assert not np.any(found.sensor_actual)
    assert not np.any(found.sensor_predicted)
    # What it does not estimate is its error.
    wrong = covariance_analysis(PLAIN, FULL, STATELESS)
    sd = np.sqrt(np.diagonal(wrong.sensor_actual, axis1=1, axis2=2))
    expected = [np.hypot(4e-4, 1e-4)] * 3 + [np.hypot(3e-3, 3e-3)] * 3
    np.testing.assert_allclose(sd, np.tile(expected, (sd.shape[0], 1)), rtol=1e-9)


# ---- Laws ----


@pytest.mark.parametrize("believed", [EVERYTHING, SLOW_ONLY])
def test_twice_all_standard_deviations_give_twice_the_errors(believed):
    aiding = replace(
        AIDING,
        fixes=tuple(replace(each, sd=2.0 * each.sd) for each in AIDING.fixes),
        coloured_sd=2.0 * np.asarray(AIDING.coloured_sd),
    )
    sd = RICH.initial_sd
    wide = InitialSd(2.0 * sd.position, 2.0 * sd.velocity, 2.0 * sd.tilt, 2.0 * sd.heading)
    twice = replace(RICH, aiding=aiding, initial_sd=wide)
    once = covariance_analysis(RICH, FULL, believed)
    found = covariance_analysis(twice, scaled(FULL, 2.0), scaled(believed, 2.0))
    if believed is SLOW_ONLY:  # an autoregression has no amplitude to be doubled
        assert relative(found.predicted, 4.0 * once.predicted) < 1e-9
        assert relative(found.actual, 4.0 * once.actual) < 1e-9
        assert relative(found.sensor_actual, 4.0 * once.sensor_actual) < 1e-9
        np.testing.assert_allclose(found.sd, 2.0 * once.sd, rtol=1e-9)
        np.testing.assert_allclose(found.nees(), once.nees(), rtol=1e-8)


def test_the_true_covariance_is_linear_in_the_variances_of_the_truth():
    """Gains depend on what is believed alone."""
    actual = [
        covariance_analysis(RICH, scaled(FULL, np.sqrt(factor)), SLOW_ONLY).actual
        for factor in (1.0, 3.0, 5.0)
    ]
    middle = 0.5 * (actual[0] + actual[2])
    assert relative(actual[1], middle) < 1e-9
    assert relative(actual[0], actual[2]) > 0.1


@pytest.mark.parametrize("believed", [SLOW_ONLY, STATELESS, EVERYTHING, scaled(FULL, 3.0)])
def test_no_filter_is_better_than_that_of_the_truth(believed):
    best = covariance_analysis(PLAIN, FULL, FULL).actual
    other = covariance_analysis(PLAIN, FULL, believed).actual
    sd = np.sqrt(np.diagonal(best, axis1=1, axis2=2))
    excess = (other - best) / (sd[:, :, None] * sd[:, None])
    assert np.linalg.eigvalsh(excess).min() > -1e-8
    assert np.linalg.eigvalsh(excess).max() > 1e-3


@pytest.mark.parametrize("part", [slice(0, 3), slice(0, 6), slice(0, 9)])
def test_score_is_least_with_the_truth(part):
    best = covariance_analysis(PLAIN, FULL, FULL).score(part)
    for believed in (SLOW_ONLY, STATELESS, scaled(FULL, 1.2), scaled(FULL, 0.8)):
        assert np.all(covariance_analysis(PLAIN, FULL, believed).score(part)[1:] > best[1:])


# ---- A ramp: a known mean of the errors ----


def test_a_ramp_unknown_to_the_filter_shows_as_its_bias():
    """The filter itself, run on the ramp alone without any noise, makes exactly that error."""
    rates = {"gyro_z": 2e-7, "accel_x": -2e-6}

    def ramped(factor):
        return SensorModels.of(
            {
                axis: model + RateRamp(factor * rates[axis]) if axis in rates else model
                for axis, model in FULL.models.items()
            }
        )

    without = covariance_analysis(PLAIN, FULL, FULL).actual
    extra = covariance_analysis(PLAIN, ramped(1.0), FULL).actual - without
    errors = np.zeros((TRUTH.n, 6))
    for axis, rate in rates.items():
        number = list(FULL.models).index(axis)
        errors[:, number] = RateRamp(rate).simulate(TRUTH.n, DT, np.random.default_rng(0))
    aiding = PLAIN.aiding.without(PLAIN.outages)
    ready = Filter.of(FULL, aiding, DT, second_order=False)
    events = aiding.events(DT, TRUTH.n)

    def filtered(imu):
        found = ready.run(imu, TRUTH.state(0), PLAIN.initial_sd, events, PLAIN.outputs())
        return found.errors(TRUTH)

    bias = filtered(IMU.with_errors(errors[:, :3], errors[:, 3:])) - filtered(IMU)
    size = np.abs(bias).max(axis=0)
    np.testing.assert_allclose(
        extra / np.outer(size, size), bias[:, :, None] * bias[:, None] / np.outer(size, size),
        atol=0.02,
    )  # fmt: skip
    steep = covariance_analysis(PLAIN, ramped(100.0), FULL)
    assert relative(steep.actual - without, 1e4 * extra, steep.actual) < 1e-6
    assert steep.nees().max() > 1.2


def with_ramp(rate):
    return SensorModels.of({axis: model + RateRamp(rate) for axis, model in FULL.models.items()})


def test_a_ramp_that_the_filter_has_a_state_for_is_consistent():
    found = covariance_analysis(PLAIN, with_ramp(1e-6), with_ramp(1e-6))
    without = covariance_analysis(PLAIN, FULL, FULL)
    # Of the ramps' sizes at their standard deviations; whether signs are lucky makes a difference.
    assert np.all(found.nees() < 1.15) and np.all(found.nees() > 0.85)
    assert np.all(np.trace(found.predicted, axis1=1, axis2=2)
                  > 0.999 * np.trace(without.predicted, axis1=1, axis2=2))  # fmt: skip


@pytest.mark.parametrize("rate", [22.0, 100.0])  # deg/h/h
def test_a_ramp_that_does_not_exist_makes_no_filter_too_sure(rate):
    """Believed to be known, it gave NEES of 1.4 and 8.8 two hours after switching on."""
    dt = 1.0
    truth = fixed_wing_loiter(duration=7200.0, dt=dt)
    gyro = WhiteNoise(np.radians(0.1) / 60.0) + RandomWalk(2e-8)
    accel = WhiteNoise(1e-3) + RandomWalk(1e-6)
    true = SensorModels.of({"gyro": gyro, "accel": accel}, {"gyro": 1e-5, "accel": 1e-3})
    slope = RateRamp(np.radians(rate) / 3600.0**2)
    believed = SensorModels.of({"gyro": gyro + slope, "accel": accel}, true.bias_sd)
    scenario = Scenario(truth, gnss(truth, 10.0), (Outage(7140.0, 50.0),), interval=600.0, step=1.0)
    found = covariance_analysis(scenario, true, believed)
    for part in (slice(0, 3), slice(6, 9)):
        nees = found.nees(part)[-3:]
        assert np.all(nees < 1.01) and np.all(nees > 0.7)


# ---- Monte Carlo ----


def agreement(scenario, full, believed, runs, seed):
    """Squares of Monte Carlo errors in their true standard deviations, (R, K, 9 + 6)."""
    study = monte_carlo(scenario, Simulated(full), {"wrong": believed}, runs, seed)["wrong"]
    found = covariance_analysis(scenario, full, believed)
    sensor = np.sqrt(np.diagonal(found.sensor_actual, axis1=1, axis2=2))
    assert study.diverged == 0
    squares = np.concatenate(
        [(study.error / found.sd) ** 2, (study.sensor_error / sensor) ** 2], axis=2
    )
    # The last epoch has no sample of its own.
    return squares[:, :-1], study, found


def assert_agree(squares, chance=1e-5):
    runs, epochs, components = squares.shape
    total = squares.sum(axis=0)
    # Neighbouring epochs are alike, so that the bound on all of them is rather too wide.
    each = chance / (epochs * components)
    low, high = chi2.ppf([each, 1.0 - each], runs)
    assert total.min() > low
    assert total.max() < high
    # Each component's mean over the time, by its scatter over the runs.
    each = squares.mean(axis=1)
    score = (each.mean(axis=0) - 1.0) / (each.std(axis=0, ddof=1) / np.sqrt(runs))
    assert np.abs(score).max() < t.isf(chance / components, runs - 1)


@pytest.mark.parametrize("believed", [SLOW_ONLY, slow(STATELESS)])
def test_wrong_models_agree_with_monte_carlo(believed):
    aiding = gnss(TRUTH, coloured_sd=(0.5, 0.5, 1.0), coloured_tau=30.0) + barometer(TRUTH, 2.0)
    squares, study, found = agreement(replace(PLAIN, aiding=aiding), FULL, believed, 60, 1)
    assert_agree(squares)
    # The errors differ clearly from what is predicted, so that the agreement means something.
    end = found.index(160.0)
    assert found.nees()[end] > 1.5
    for i, part in enumerate(GROUPS.values()):
        ratio = study.nees[:, end, i] / (part.stop - part.start)
        error = ratio.std(ddof=1) / np.sqrt(ratio.size)
        assert abs(ratio.mean() - found.nees(part)[end]) < 5.0 * error


# ---- What cannot be used ----


def test_an_epoch_that_was_not_kept():
    found = covariance_analysis(PLAIN, FULL, STATELESS)
    assert found.time[found.index(160.0)] == pytest.approx(160.0)
    assert found.before[found.index(160.0)]
    assert not found.before[found.index(160.0, before=False)]
    with pytest.raises(InputError, match=r"no errors were kept at 161\.3 s"):
        found.index(161.3)


# ---- Where it does not hold ----


@pytest.mark.parametrize(
    ("tilt", "heading", "reported"), [(1.0, 10.0, 0), (8.0, 10.0, 1), (1.0, 40.0, 1)]
)
def test_attitude_errors_beyond_linearity_are_reported(tilt, heading, reported):
    start = InitialSd(tilt=np.radians(tilt), heading=np.radians(heading))
    scenario = Scenario(TRUTH, Aiding(()), (Outage(10.0, 20.0),), start, interval=10.0)
    found = covariance_analysis(scenario, FULL, FULL)
    assert [each.code for each in found.notices] == ["outside-linearity"] * reported
    for each in found.notices:
        sd = found.sd[found.index(30.0), 6:]
        assert each.values["tilt"] == pytest.approx(max(sd[:2]))
        assert each.values["heading"] == pytest.approx(sd[2])
