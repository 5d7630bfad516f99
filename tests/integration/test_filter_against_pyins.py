"""The navigation filter against that of pyins: the same IMU, fixes and noise models.

pyins propagates by matrix exponentials and has its own mechanization, so that figures agree, not
bit by bit. It leaves out how the Coriolis acceleration changes with attitude and latitude, takes a
bias off after the coning and sculling terms, and its gravity falls linearly with height: together
some millimetres after an outage of a minute near the ellipsoid.
"""

import warnings
from dataclasses import dataclass

import numpy as np
import pytest

import gmwm
from error_models import noisy
from gmwm import GaussMarkov, RandomWalk, WhiteNoise
from gmwm.ins import Outage, SensorModels, Trajectory, emulate, gnss, helicopter_mapping, navigate
from gmwm.ins.geometry import ned_difference

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    pyins = pytest.importorskip("pyins")
    pd = pytest.importorskip("pandas")

pytestmark = [
    pytest.mark.filterwarnings("ignore"), pytest.mark.usefixtures("interpreted_pyins")
]  # fmt: skip

DT = 1.0 / 32.0  # sums of it are exact, so both filters cut their steps at the same epochs
STEP = 8 * DT
INITIAL = gmwm.ins.InitialSd(
    position=2.0, velocity=0.1, tilt=np.radians(0.1), heading=np.radians(0.5)
)
POSITION_SD, VELOCITY_SD = 1.0, 0.05


@dataclass(frozen=True)
class Triad:
    """Errors of three like sensors: white noise, a bias that walks, one Gauss-Markov process."""

    N: float
    bias_sd: float
    K: float
    sigma: float
    tau: float

    @property
    def model(self):
        return WhiteNoise(self.N) + RandomWalk(self.K) + GaussMarkov(self.sigma, self.tau)


GYRO = Triad(N=5e-5, bias_sd=5e-5, K=2e-6, sigma=3e-5, tau=25.0)
ACCEL = Triad(N=1e-3, bias_sd=2e-3, K=5e-5, sigma=1e-3, tau=40.0)


def estimation_model(triad):
    """The triad for pyins: its own bias, and Gauss-Markov states that decay between fixes."""

    class WithMarkov(pyins.inertial_sensor.EstimationModel):
        def __init__(self):
            super().__init__(bias_sd=triad.bias_sd, noise=triad.N, bias_walk=triad.K)
            wide = np.zeros((6, 6))
            wide[3:, 3:] = -np.eye(3) / triad.tau
            self.F = wide
            self.G = np.eye(6)
            self.H = np.hstack([np.eye(3), np.eye(3)])
            self.P = np.diag([triad.bias_sd**2] * 3 + [triad.sigma**2] * 3)
            self.q = np.repeat([triad.K, triad.sigma * np.sqrt(2.0 / triad.tau)], 3)
            self.n_states = self.n_noises = 6
            self.states = ["bias_x", "bias_y", "bias_z", "gm_x", "gm_y", "gm_z"]
            self.markov = np.zeros(3)

        def reset_estimates(self):
            super().reset_estimates()
            self.markov = np.zeros(3)

        def update_estimates(self, x):
            self.bias = self.bias + x[:3]
            self.markov = self.markov + x[3:]

        def get_estimates(self):
            return pd.Series(np.hstack([self.bias, self.markov]), index=self.states)

        def correct_increments(self, dt, increments):
            if isinstance(increments, pd.Series):
                return increments - (self.bias + self.markov) * dt
            decay = np.exp(-DT / triad.tau * np.arange(len(increments) + 1))[:, None]
            corrected = increments - (self.bias + decay[:-1] * self.markov) * DT
            # Whole batches are integrated once: the next one begins where this one ends.
            self.markov = self.markov * decay[-1]
            return corrected

    return WithMarkov()


@dataclass(frozen=True)
class Flight:
    truth: object
    imu: object
    aiding: object


def flight(duration, seed, *, velocity, outages=(), start=0.0):
    """A helicopter near the ellipsoid, from some time of its flight on."""
    place = (np.radians(46.5), np.radians(6.6), -100.0)
    whole = helicopter_mapping(duration=start + duration, dt=DT, start=place)
    truth = whole.segment(start, start + duration)
    rng = np.random.default_rng(seed)
    sensors = models()
    imu = noisy(emulate(truth), sensors, rng)
    aiding = gnss(truth, position_sd=POSITION_SD, velocity_sd=VELOCITY_SD if velocity else None)
    return Flight(truth, imu, aiding.noisy(rng).without(outages))


def models():
    return SensorModels.of(
        {"gyro": GYRO.model, "accel": ACCEL.model},
        bias_sd={"gyro": GYRO.bias_sd, "accel": ACCEL.bias_sd},
    )


def peer(data):
    """Position (lla), predicted position sd and times of the filter of pyins."""
    first, truth = data.truth.state(0), data.truth
    pva = pd.Series(
        [*np.degrees(first.lla[:2]), first.lla[2], *first.velocity, *np.degrees(first.rpy)],
        index=pyins.util.TRAJECTORY_COLS, name=0.0,
    )  # fmt: skip
    # pyins wants a sample before the first one, for the coning of that.
    rows = np.hstack([data.imu.rotation, data.imu.velocity])
    readings = pd.DataFrame(
        np.vstack([rows[:1], rows]), index=DT * np.arange(truth.n + 1),
        columns=pyins.util.GYRO_COLS + pyins.util.ACCEL_COLS,
    )  # fmt: skip
    measurements = []
    for fixes in data.aiding.fixes:
        if fixes.kind == "position":
            lla = fixes.value * [180.0 / np.pi, 180.0 / np.pi, 1.0]
            table = pd.DataFrame(lla, index=fixes.time, columns=pyins.util.LLA_COLS)
            measurements.append(pyins.measurements.Position(table, POSITION_SD))
        else:
            table = pd.DataFrame(fixes.value, index=fixes.time, columns=pyins.util.VEL_COLS)
            measurements.append(pyins.measurements.NedVelocity(table, VELOCITY_SD))
    found = pyins.filters.run_feedback_filter(
        pva, INITIAL.position, INITIAL.velocity, np.degrees(INITIAL.tilt),
        np.degrees(INITIAL.heading),
        pyins.strapdown.compute_increments_from_imu(readings, "increment"),
        estimation_model(GYRO), estimation_model(ACCEL), measurements, time_step=STEP,
    )  # fmt: skip
    time = np.asarray(found.trajectory_sd.index)
    whole = np.isclose(time, np.rint(time), atol=1e-9) & (time < truth.duration)
    at = found.trajectory.loc[time[whole]]
    lla = at[pyins.util.LLA_COLS].to_numpy() * [np.pi / 180.0, np.pi / 180.0, 1.0]
    sd = found.trajectory_sd.loc[time[whole], pyins.util.NED_COLS].to_numpy()
    return time[whole], lla, sd


def compared(data):
    """Largest difference of positions (m) and of predicted sd (relative), and where we are."""
    time, lla, sd = peer(data)
    ours = navigate(
        data.imu, data.truth.state(0), models(), data.aiding, initial_sd=INITIAL, step=STEP,
        second_order=False,  # pyins is linear
    )  # fmt: skip
    n = time.size
    np.testing.assert_allclose(ours.time[:n], time)
    apart = np.abs(ned_difference(ours.lla[:n], lla)).max(axis=1)
    wider = np.abs(ours.sd[:n, :3] / sd - 1.0).max(axis=1)
    return apart, wider, ours


def check(data, apart_by=0.01):
    apart, wider, ours = compared(data)
    print(f"positions {1e3 * apart.max():.2g} mm, predicted sd {1e2 * wider.max():.2g} %")
    assert wider.max() < 1e-3
    assert apart.max() < apart_by
    return ours


def test_the_same_solution_with_an_outage_in_a_short_flight():
    ours = check(flight(14.0, 1, velocity=True, outages=[Outage(5.0, 7.0)], start=80.0))
    assert ours.sd[11, 1] > 1.2 * ours.sd[5, 1]


@pytest.mark.slow
def test_the_same_solution_with_fixes_between_samples():
    """Both propagate to the fix; pyins from the epoch before, and with the row of that epoch."""
    parts = 4
    place = (np.radians(46.5), np.radians(6.6), -100.0)
    fine = helicopter_mapping(duration=94.0, dt=DT / parts, start=place).segment(80.0, 94.0)
    truth = Trajectory(DT, *(each[::parts] for each in (fine.lla, fine.velocity, fine.rpy)))
    rng = np.random.default_rng(4)
    aiding = gnss(fine, 1.0 + DT / parts, position_sd=POSITION_SD, velocity_sd=VELOCITY_SD)
    imu = noisy(emulate(truth), models(), rng)
    data = Flight(truth, imu, aiding.noisy(rng))
    assert np.any(data.aiding.events(DT, truth.n).offset)
    apart, wider, ours = compared(data)
    # Within a sample of a fix, one filter has used it and the other has not.
    near = np.abs(ours.time[: apart.size, None] - data.aiding.fixes[0].time).min(axis=1) < DT
    assert np.count_nonzero(~near[1:]) > 0
    assert wider[~near].max() < 0.02
    assert apart[~near].max() < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("velocity", [False, True])
def test_the_same_solution_with_fixes(velocity):
    check(flight(180.0, 2, velocity=velocity), 0.005)


@pytest.mark.slow
@pytest.mark.parametrize("velocity", [False, True])
def test_the_same_solution_after_an_outage(velocity):
    """At the end it is 10 to 30 m wide (1 sigma)."""
    ours = check(flight(180.0, 2, velocity=velocity, outages=[Outage(100.0, 60.0)]), 0.02)
    assert ours.sd[159, 1] > 10.0
