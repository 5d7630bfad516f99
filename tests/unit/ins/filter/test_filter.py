"""The navigation filter: its errors have its covariance; hard places, long runs, bad input."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy import stats

import gmwm
from error_models import noisy, triads
from free_inertial import integrate
from gmwm import GaussMarkov, RandomWalk, RateRamp, Resonance, Sinusoid, WhiteNoise
from gmwm.errors import InputError
from gmwm.ins import Aiding, Fixes, SensorModels, emulate, gnss, helicopter_mapping, navigate
from gmwm.ins.geometry import matrix_from_rotation_vector, matrix_from_rpy, rpy_from_matrix
from marks import every, slow

SENSORS = triads(
    WhiteNoise(5e-5) + GaussMarkov(1e-4, 5.0) + GaussMarkov(5e-5, 200.0),
    WhiteNoise(1e-3) + GaussMarkov(2e-3, 2.0) + GaussMarkov(1e-3, 100.0),
)
INITIAL = gmwm.ins.InitialSd(
    position=1.0, velocity=0.1, tilt=np.radians(0.1), heading=np.radians(0.3)
)
TAIL = 1e-7
"""Chance that a right filter fails one check on one side; there are some thousand."""


def started(truth, rng):
    """An estimate of the first state with errors drawn from `INITIAL`."""
    first, x = truth.state(0), INITIAL.deviations * rng.standard_normal(9)
    radius = 6.37e6
    lla = first.lla + np.array([x[0] / radius, x[1] / (radius * np.cos(first.lla[0])), -x[2]])
    turned = matrix_from_rotation_vector(-x[6:]) @ matrix_from_rpy(first.rpy)
    return gmwm.ins.NavState(lla, first.velocity + x[3:6], rpy_from_matrix(turned))


@dataclass(frozen=True)
class Ensemble:
    """Runs of one flight: errors and covariances at some epochs, (runs, epochs, ...)."""

    error: np.ndarray
    covariance: np.ndarray
    sensor_error: np.ndarray
    sensor_covariance: np.ndarray
    squares: np.ndarray  # of standard innovations, one row a run

    def check(self):
        """NEES of all, of parts and of the sensors within their chi-square bands; NIS too."""
        parts = {"all": slice(0, 9), "position": slice(0, 3), "velocity": slice(3, 6),
                 "attitude": slice(6, 9)}  # fmt: skip
        found = {}
        for name, part in parts.items():
            found[name] = _nees(self.error[..., part], self.covariance[..., part, part])
        found["sensors"] = _nees(self.sensor_error, self.sensor_covariance)
        runs = len(self.error)
        for name, nees in found.items():
            size = 9 if name == "all" else 6 if name == "sensors" else 3
            for epoch, total in enumerate(nees.sum(axis=0)):
                low, high = stats.chi2.ppf([TAIL, 1.0 - TAIL], size * runs)
                assert low < total < high, (name, epoch, total / (size * runs))
        count = int(np.isfinite(self.squares).sum())
        if count:
            low, high = stats.chi2.ppf([TAIL, 1.0 - TAIL], count)
            assert low < np.nansum(self.squares) < high, np.nansum(self.squares) / count


def _nees(error, covariance):
    solved = np.linalg.solve(covariance, error[..., None])[..., 0]
    return np.sum(error * solved, axis=-1)


def ensemble(truth, aiding, runs, *, before, sensors=SENSORS, step=0.1, seed=1):
    """Runs with noise, sensor errors and initial errors as the filter takes them to be."""
    imu, rng = emulate(truth), np.random.default_rng(seed)
    records = []
    for _ in range(runs):
        drawn = sensors.simulate(imu.n, imu.dt, rng)
        with_noise = imu.with_errors(drawn.total[:, :3], drawn.total[:, 3:])
        solution = navigate(
            with_noise, started(truth, rng), sensors, aiding.noisy(rng), initial_sd=INITIAL,
            step=step, interval=50.0, before=before,
        )  # fmt: skip
        assert solution.diverged_at is None
        at = np.rint(solution.time / imu.dt).astype(int)
        kept = at < imu.n
        records.append(
            (
                solution.errors(truth)[kept],
                solution.covariance[kept],
                drawn.slow[at[kept]] - solution.sensor_errors[kept],
                solution.sensor_covariance[kept],
                solution.innovations.standard.ravel() ** 2,
            )
        )
    return Ensemble(*(np.array(each) for each in zip(*records, strict=True)))


def aided(kind, truth):
    """Aiding of several kinds along a truth."""
    if kind == "position":
        return gnss(truth)
    if kind == "antenna":
        return gnss(
            truth, velocity_sd=(0.05, 0.05, 0.1), lever_arm=(1.0, -0.5, -1.2), imu=emulate(truth)
        )
    if kind == "coloured":
        return gnss(
            truth, position_sd=0.3, coloured_sd=(1.5, 1.5, 3.0), coloured_tau=60.0, velocity_sd=0.1
        ) + gmwm.ins.barometer(truth, 2.0, 1.0)
    return (
        gnss(truth) + gmwm.ins.standstills(truth, 0.5, 0.02) + gmwm.ins.barometer(truth, 5.0, 2.0)
    )


KINDS = {
    "position": helicopter_mapping,
    "antenna": helicopter_mapping,
    "coloured": helicopter_mapping,
    "car": gmwm.ins.car_drive,
}


@pytest.mark.parametrize("kind", every(2, KINDS))
@pytest.mark.parametrize(
    ("duration", "dt", "outage", "runs", "seed"),
    [(300.0, 0.05, 180.0, 24, 1), slow(900.0, 0.01, 600.0, 200, 2)],
)
def test_errors_have_the_covariance_of_the_filter(kind, duration, dt, outage, runs, seed):
    truth = KINDS[kind](duration=duration, dt=dt)
    aiding = aided(kind, truth).without([gmwm.ins.Outage(outage, 60.0)])
    ensemble(truth, aiding, runs, before=[outage + 60.0], seed=seed).check()


def flown(truth, aiding, *, sensors=SENSORS, seed=3, step=0.1, interval=1.0, before=()):
    """One run with noise; the solution and its errors over their standard deviations."""
    rng = np.random.default_rng(seed)
    imu = noisy(emulate(truth), sensors, rng)
    solution = navigate(
        imu, started(truth, rng), sensors, aiding.noisy(rng), initial_sd=INITIAL,
        step=step, interval=interval, before=before,
    )  # fmt: skip
    return solution, solution.errors(truth) / solution.sd


PLACES = {
    "north": (1.38, 0.3, 100.0),
    "south": (-1.38, -2.0, 3000.0),
    "equator": (0.0, 0.0, 0.0),
    "date line": (-0.3, np.pi - 2e-6, 50.0),
}


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("heading", [0.5 * np.pi, np.pi])
def test_any_place_and_heading(place, heading):
    """East across the date line; south with a heading that goes to and fro across 180 deg."""
    truth = helicopter_mapping(
        duration=200.0, dt=0.02, start=PLACES[place], heading=heading, strip=600.0
    )
    aiding = gnss(truth, velocity_sd=0.1)
    _, standard = flown(truth, aiding)
    # 200 epochs of 9 errors, of which those far apart are independent.
    assert np.abs(standard).max() < 6.0
    assert 0.3 < np.mean(standard**2) < 3.0


def test_fixes_may_give_longitudes_on_the_other_side():
    truth = helicopter_mapping(duration=120.0, dt=0.02, start=PLACES["date line"], heading=1.57)
    aiding = gnss(truth).noisy(np.random.default_rng(1))
    position = aiding.fixes[0]
    other = replace(position, value=position.value - [0.0, 2.0 * np.pi, 0.0])
    imu, first = emulate(truth), truth.state(0)
    here = navigate(imu, first, SENSORS, aiding)
    there = navigate(imu, first, SENSORS, replace(aiding, fixes=(other,)))
    np.testing.assert_allclose(there.lla, here.lla, atol=1e-12)


@pytest.fixture(scope="module")
def hop():
    """30 s of a climb and a start."""
    return helicopter_mapping(duration=90.0, dt=0.02).segment(60.0, 90.0)


def gnss_at(truth, epochs, sd):
    time = np.asarray(epochs, dtype=float) * truth.dt
    return Aiding((Fixes("position", time, truth.lla[epochs], np.full((time.size, 3), sd)),))


def test_fixes_at_the_first_and_the_last_epoch(hop):
    aiding = gnss_at(hop, [0, hop.n], 0.01)
    solution = navigate(
        emulate(hop), hop.state(0), SENSORS, aiding, initial_sd=INITIAL,
        before=[0.0, hop.duration], second_order=False,
    )  # fmt: skip
    assert solution.before.tolist() == [True] + [False] * 30 + [True, False]
    np.testing.assert_allclose(solution.sd[0, :3], INITIAL.position)
    for after in (1, -1):
        np.testing.assert_allclose(solution.sd[after, :3], 0.01, rtol=0.02)
    assert np.all(solution.sd[-2, :3] > 0.1)
    assert np.all(np.isfinite(solution.innovations.standard))


def test_many_fixes_at_an_epoch_are_one_better_fix(hop):
    imu, first = emulate(hop), hop.state(0)
    fixes = gnss_at(hop, [0, 500, 500, 500, 500], 2.0)
    four = navigate(imu, first, SENSORS, fixes, second_order=False)
    fixes = gnss_at(hop, [0], 2.0) + gnss_at(hop, [500], 1.0)
    one = navigate(imu, first, SENSORS, fixes, second_order=False)
    np.testing.assert_allclose(four.covariance, one.covariance, rtol=1e-6, atol=1e-14)
    np.testing.assert_allclose(four.velocity, one.velocity, atol=1e-8)


def test_without_fixes_it_is_the_free_inertial_solution(hop):
    imu = emulate(hop)
    solution = navigate(
        imu, hop.state(0), SENSORS, Aiding(), interval=hop.duration, second_order=False
    )
    free = integrate(imu, hop.state(0))
    assert solution.innovations.time.size == 0
    # The attitude matrix is cleaned at other epochs.
    np.testing.assert_allclose(solution.lla[-1], free.lla[-1], rtol=1e-12)
    np.testing.assert_allclose(solution.velocity[-1], free.velocity[-1], atol=1e-11)


def test_no_sensor_states(hop):
    white = SensorModels.of({"gyro": WhiteNoise(1e-4), "accel": WhiteNoise(1e-3)})
    solution, standard = flown(hop, gnss(hop), sensors=white)
    assert solution.state_names == () and solution.states.size == 0
    assert not np.any(solution.sensor_errors) and not np.any(solution.sensor_covariance)
    assert np.abs(standard).max() < 6.0


def test_thirty_sensor_states_and_every_kind_of_block():
    truth = helicopter_mapping(duration=150.0, dt=0.02)
    gyro = WhiteNoise(5e-5) + GaussMarkov(1e-4, 3.0) + Resonance(1e-4, 5.0, 0.1) + RandomWalk(1e-6)
    accel = (
        WhiteNoise(1e-3)
        + gmwm.QuantizationNoise(1e-5)
        + Sinusoid(1e-3, 0.3)
        + GaussMarkov(1e-3, 40.0)
    )
    sensors = SensorModels.of(
        {"gyro": gyro, "gyro_z": gyro + RateRamp(1e-7), "accel": accel,
         "accel_y": gmwm.AR([1.5, -0.7], 1e-8) + accel},
        bias_sd={"gyro": 5e-5, "accel": 1e-3},
    )  # fmt: skip
    ensemble(truth, gnss(truth, velocity_sd=0.1), 25, before=[], sensors=sensors, seed=7).check()


def test_a_covariance_step_of_ten_samples_is_as_good_as_one():
    truth = helicopter_mapping(duration=150.0, dt=0.02)
    aiding = gnss(truth).without([gmwm.ins.Outage(90.0, 40.0)])
    fine, _ = flown(truth, aiding, step=0.02, before=[130.0])
    coarse, _ = flown(truth, aiding, step=0.2, before=[130.0])
    np.testing.assert_allclose(coarse.sd, fine.sd, rtol=2e-3)
    difference = coarse.errors(truth) - fine.errors(truth)
    assert np.abs(difference / fine.sd).max() < 0.02


def test_an_estimated_sensor_error_decays_in_an_outage():
    truth = helicopter_mapping(duration=120.0, dt=0.02)
    sensors = SensorModels.of(
        {"gyro": WhiteNoise(1e-5), "accel": WhiteNoise(1e-4) + GaussMarkov(0.02, 10.0)}
    )
    aiding = gnss(truth, position_sd=0.05, velocity_sd=0.01).without([gmwm.ins.Outage(80.0, 50.0)])
    solution, _ = flown(truth, aiding, sensors=sensors)
    found, time = solution.sensor_errors[80:120, 3:], solution.time[80:120] - 80.0
    assert np.abs(found[0]).min() > 1e-3
    np.testing.assert_allclose(found, found[0] * np.exp(-time / 10.0)[:, None], rtol=1e-9)


@pytest.mark.parametrize("wrong", [1e4, 1e7])
def test_a_filter_that_diverges_says_when(wrong):
    truth = helicopter_mapping(duration=60.0, dt=0.02)
    huge = SensorModels.of({"gyro": WhiteNoise(1e-4), "accel": WhiteNoise(1e-3)}, {"accel": wrong})
    imu = emulate(truth)
    errors = np.full((imu.n, 3), wrong)
    solution = navigate(imu.with_errors(0.0 * errors, errors), truth.state(0), huge, Aiding())
    assert solution.diverged_at is not None and 0.0 < solution.diverged_at < 60.0
    assert solution.time[-1] < solution.diverged_at
    assert np.all(np.isfinite(solution.lla)) and np.all(np.isfinite(solution.covariance))
    assert np.all(np.isfinite(solution.errors(truth)))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"before": [31.0]}, "before = 31 s: the IMU record goes from 0 to 30 s"),
        ({"before": [np.nan]}, "before = nan s"),
        ({"interval": 0.0}, "interval = 0.0"),
        ({"step": -1.0}, "step = -1.0"),
        ({"aiding": Aiding((Fixes("position", np.array([40.0]), np.zeros((1, 3)),
          np.ones((1, 3))),))}, "position fix at 40 s"),
        ({"aiding": Aiding(coloured_sd=(1.0, 1.0, 1.0), fixes=(Fixes("height", np.ones(1),
          np.zeros((1, 3)), np.ones((1, 3))),))}, "coloured_sd without position fixes"),
        ({"initial": gmwm.ins.NavState(np.array([1.56, 0.0, 0.0]), np.zeros(3), np.zeros(3))},
         "too near a"),
        ({"initial_sd": {"tilt": 0.0}}, "initial tilt = 0.0"),
    ],
)  # fmt: skip
def test_what_cannot_be_used_is_said_in_one_sentence(hop, options, words):
    given = {"aiding": Aiding(), "initial": hop.state(0), **options}
    imu, initial, aiding = emulate(hop), given.pop("initial"), given.pop("aiding")
    with pytest.raises(InputError, match=words) as caught:
        if "initial_sd" in given:
            given["initial_sd"] = gmwm.ins.InitialSd(**given["initial_sd"])
        navigate(imu, initial, SENSORS, aiding, **given)
    assert "\n" not in str(caught.value)
