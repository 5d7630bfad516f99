"""Monte Carlo: what it promises about seeds, filters, workers, interruptions and initial errors."""

from dataclasses import dataclass, fields, replace

import numpy as np
import pytest
from scipy.stats import chi2, kstest

import gmwm
from error_models import triads
from gmwm import GaussMarkov, RandomWalk, WhiteNoise
from gmwm.errors import InputError
from gmwm.ins import FilterErrors, InitialSd, Outage, Scenario, SensorModels, Simulated, gnss
from gmwm.ins.geometry import matrix_from_rpy
from gmwm.ins.sensors import AXES
from gmwm.ins.simulation import GROUPS
from gmwm.ins.simulation.trials import disturbed
from gmwm.readers.recording import Recording

DT = 0.05
TRUTH = gmwm.ins.helicopter_mapping(duration=130.0, dt=DT).segment(70.0, 130.0)
GOOD = triads(
    WhiteNoise(1e-4) + GaussMarkov(2e-4, 20.0), WhiteNoise(1e-3) + GaussMarkov(3e-3, 50.0)
)
POOR = SensorModels.of({"gyro": WhiteNoise(1e-4), "accel": WhiteNoise(1e-3)})
SCENARIO = Scenario(TRUTH, gnss(TRUTH), (Outage(30.0, 20.0),), interval=5.0)


def assert_same(first: FilterErrors, second: FilterErrors):
    for each in fields(FilterErrors):
        np.testing.assert_array_equal(getattr(first, each.name), getattr(second, each.name))


def study(runs=3, seed=1, filters=None, scenario=SCENARIO, source=None, **options):
    filters = {"good": GOOD} if filters is None else filters
    return gmwm.ins.monte_carlo(scenario, source or Simulated(GOOD), filters, runs, seed, **options)


@pytest.fixture(scope="module")
def reference():
    return study(12)["good"]


# ---- Seeds, filters, workers ----


def test_a_seed_gives_one_result(reference):
    assert reference.runs == 12
    assert_same(study(12)["good"], reference)
    assert not np.any(study(2, seed=2)["good"].error == reference.error[:2])


@pytest.mark.slow
def test_the_result_does_not_depend_on_workers(reference):
    """But for the last digit: vector instructions follow the alignment of arrays."""
    found = study(12, jobs=2)["good"]
    for each in fields(FilterErrors):
        expected = getattr(reference, each.name)
        scale = np.nanmax(np.abs(expected)) if expected.dtype == float else 0.0
        np.testing.assert_allclose(
            getattr(found, each.name), expected, rtol=1e-7, atol=1e-9 * scale
        )


def test_a_filter_does_not_change_the_others(reference):
    both = study(3, filters={"poor": POOR, "good": GOOD, "again": GOOD})
    assert list(both.filters) == ["poor", "good", "again"]
    assert_same(both["good"], both["again"])
    np.testing.assert_array_equal(both["good"].error, reference.error[:3])
    # The same errors: at the first epoch nothing but the initial error is there.
    np.testing.assert_array_equal(both["poor"].error[:, 0], both["good"].error[:, 0])
    assert np.all(both["poor"].error[:, -1] != both["good"].error[:, -1])


# ---- Interruptions ----


def test_a_study_can_be_made_longer(tmp_path, reference):
    study(5, folder=tmp_path)
    seen = []
    assert_same(
        study(12, folder=tmp_path, progress=lambda done, *_: seen.append(done))["good"], reference
    )
    assert seen == list(range(5, 13))


def other_scenarios():
    # The same rows, slower: only the sampling interval differs.
    late = replace(TRUTH, dt=2.0 * DT)
    moved = replace(TRUTH, velocity=TRUTH.velocity + 1e-9)
    plain = gnss(TRUTH)
    fixes = plain.fixes[0]
    return {
        "dt": Scenario(late, gnss(TRUTH), SCENARIO.outages, interval=5.0),
        "velocity": replace(SCENARIO, trajectory=moved),
        "outages": replace(SCENARIO, outages=(Outage(30.0, 20.05),)),
        "initial": replace(SCENARIO, initial_sd=InitialSd(heading=0.01)),
        "step": replace(SCENARIO, step=0.2),
        "interval": replace(SCENARIO, interval=6.0),
        "lever arm": replace(SCENARIO, aiding=replace(plain, lever_arm=[0.0, 0.0, 1.0])),
        "noise": replace(SCENARIO, aiding=gnss(TRUTH, position_sd=(1.0, 1.0, 1.5 + 1e-12))),
        "colour": replace(SCENARIO, aiding=gnss(TRUTH, coloured_sd=(0.1, 0.0, 0.0))),
        "kind": replace(SCENARIO, aiding=replace(plain, fixes=(replace(fixes, kind="velocity"),))),
        "barometer": replace(SCENARIO, aiding=plain + gmwm.ins.barometer(TRUTH)),
    }


@pytest.mark.parametrize("change", [*other_scenarios()])
def test_the_folder_of_another_scenario_is_refused(tmp_path, change):
    study(1, folder=tmp_path)
    study(1, folder=tmp_path, scenario=replace(SCENARIO))
    with pytest.raises(InputError, match="belongs to another study"):
        study(1, folder=tmp_path, scenario=other_scenarios()[change])


def test_the_folder_of_other_models_is_refused(tmp_path):
    study(1, folder=tmp_path)
    tiny = {"gyro": WhiteNoise(1e-4 * (1.0 + 1e-15)) + GaussMarkov(2e-4, 20.0)}
    bias = SensorModels.of(GOOD, {"gyro_x": 1e-9})
    models = (SensorModels.of(tiny | {"accel": GOOD.models["accel_x"]}), bias, POOR)
    changes = [
        *({"filters": {"good": each}} for each in models),
        *({"source": Simulated(each)} for each in models),
        {"filters": {"Good": GOOD}},
        {"filters": {"good": GOOD, "poor": POOR}},
        {"seed": 2},
        {"source": recorded(1)},
    ]
    for change in changes:
        with pytest.raises(InputError, match="belongs to another study"):
            study(1, folder=tmp_path, **change)


# ---- Recorded errors ----


def recorded(stretches, extra=0):
    values = np.random.default_rng(5).standard_normal((stretches * TRUTH.n + extra, 6)) * 1e-3
    arrays = dict(zip(AXES, values.T, strict=True))
    given_in = Recording.from_arrays(arrays, 1.0 / DT, {"gyro": "rad/s", "accel": "m/s^2"}, "a.csv")
    return gmwm.ins.Recorded.of(given_in, TRUTH.duration)


def test_fewer_stretches_than_runs_are_noted():
    found = study(9, source=recorded(3, extra=TRUTH.n // 2))
    assert found["good"].runs == 3
    (notice,) = found.notices
    assert notice.code == "fewer-runs"
    assert notice.text.startswith("3 runs instead of 9")
    assert study(2, source=recorded(3)).notices == ()
    # True sensor errors are not known.
    assert np.all(np.isnan(found["good"].sensor_nees))
    assert np.all(np.isnan(found["good"].sensor_error))
    assert np.all(np.isfinite(found["good"].nees))


# ---- Initial errors ----


def test_initial_errors_have_the_covariance_claimed():
    sd = InitialSd(position=3.0, velocity=0.2, tilt=0.02, heading=0.05)
    state = gmwm.ins.NavState(np.array([0.8, 3.1, 500.0]), np.array([40.0, -25.0, 3.0]),
                     np.array([0.4, -0.3, 2.5]))  # fmt: skip
    rng = np.random.default_rng(6)
    count = 1500
    turned = np.array([error_of(disturbed(state, sd, rng), state) for _ in range(count)])
    # Drawn in their own order and sign, to first order in the angles.
    rng = np.random.default_rng(6)
    given_out = np.array([rng.standard_normal(9) for _ in range(count)])
    standard = turned / sd.deviations
    np.testing.assert_allclose(standard, given_out, atol=0.05)
    np.testing.assert_allclose(standard.mean(axis=0), 0.0, atol=4.0 / np.sqrt(count))
    np.testing.assert_allclose(np.cov(standard.T), np.eye(9), atol=5.0 / np.sqrt(count))


def error_of(estimate, truth):
    """Errors as a solution reports them."""
    one = np.zeros((1, 9, 9))
    still = replace(
        TRUTH,
        lla=np.tile(truth.lla, (2, 1)),
        velocity=np.tile(truth.velocity, (2, 1)),
        rpy=np.tile(truth.rpy, (2, 1)),
    )
    solution = gmwm.ins.Solution(
        time=np.zeros(1), before=np.zeros(1, dtype=bool), lla=estimate.lla[None],
        velocity=estimate.velocity[None], matrix=matrix_from_rpy(estimate.rpy)[None],
        covariance=one, sensor_errors=np.zeros((1, 6)), sensor_covariance=np.zeros((1, 6, 6)),
        innovations=None, state_names=(), states=np.zeros(0), state_covariance=np.zeros((0, 0)),
    )  # fmt: skip
    return solution.errors(still)[0]


def test_the_first_nees_is_right_and_stays_so_without_aiding():
    """A flight at 30 m/s: a wrong sign of the attitude error would show within seconds."""
    free = Scenario(
        TRUTH.segment(0.0, 20.0),
        gmwm.ins.Aiding(),
        initial_sd=InitialSd(1.0, 0.1, 0.01, 0.03),
        interval=4.0,
    )
    found = study(200, scenario=free)["good"]
    total = found.nees.sum(axis=0)
    for i, part in enumerate(GROUPS.values()):
        dof = 200 * (part.stop - part.start)
        low, high = chi2.ppf([1e-5, 1.0 - 1e-5], dof)
        assert np.all((low < total[:, i]) & (total[:, i] < high))
    first = found.nees[:, 0, 3]
    assert kstest(first, chi2(9).cdf).pvalue > 1e-4
    np.testing.assert_allclose(
        found.sd[:, 0], np.tile([1.0] * 3 + [0.1] * 3 + [0.01, 0.01, 0.03], (200, 1)), rtol=1e-3
    )


# ---- What is kept ----


@dataclass(frozen=True)
class Given:
    """The errors of each run as they are told."""

    errors: tuple[np.ndarray, ...]
    available = None

    def draw(self, run, n, dt, rng):
        return gmwm.ins.SensorErrors(self.errors[run], self.errors[run])


def test_sensor_errors_are_those_of_the_sample_after_an_epoch():
    slow = np.repeat([1e-4, 1e-3], 3) + 1e-9 * np.arange(TRUTH.n)[:, None]
    found = study(1, source=Given((slow,)))
    runs, solution = found["good"], found.example["good"]
    k = runs.index(50.0)
    j = int(np.flatnonzero(solution.before & (solution.time == 50.0))[0])
    np.testing.assert_allclose(
        runs.sensor_error[0, k], solution.sensor_errors[j] - slow[1000], atol=1e-14
    )
    # No sample follows the last epoch.
    assert np.all(np.isnan(runs.sensor_error[0, -1]))
    assert np.isnan(runs.sensor_nees[0, -1])
    assert np.all(np.isfinite(runs.sensor_nees[0, :-1]))


def test_a_random_walk_that_starts_at_zero_counts_from_its_first_step():
    walk = triads(WhiteNoise(1e-4) + GaussMarkov(2e-4, 20.0), WhiteNoise(1e-3) + RandomWalk(1e-4))
    runs = study(60, filters={"walk": walk}, source=Simulated(walk))["walk"]
    assert np.all(np.isnan(runs.sensor_nees[:, 0]))
    assert np.all(np.isfinite(runs.sensor_nees[:, 1:-1]))
    at = runs.index(50.0)
    low, high = chi2.ppf([1e-5, 1.0 - 1e-5], 60 * 6)
    assert low < np.sum(runs.sensor_nees[:, at]) < high


# ---- Divergence ----


def test_a_filter_that_diverges_is_counted():
    wild = np.zeros((5, TRUTH.n, 6))
    wild[[1, 3], TRUTH.n // 2 :, 3:] = 1e9
    found = study(5, source=Given(tuple(wild)))["good"]
    assert found.diverged == 2
    lost = np.isnan(found.error[:, :, 0])
    assert not np.any(lost[[0, 2, 4]])
    for run in (1, 3):
        first = int(np.argmax(lost[run]))
        assert first > 0
        assert found.time[first] == pytest.approx(30.0, abs=6.0)
        assert np.all(np.isnan(found.error[run, first:]))
        assert np.all(np.isnan(found.nees[run, first:]))
        assert np.all(np.isfinite(found.error[run, :first]))
        assert np.isfinite(found.nis[run]).all()


# ---- Scenarios and input ----


def test_epochs_kept():
    scenario = replace(SCENARIO, outages=(Outage(10.0, 10.0), Outage(30.0, 20.35)))
    outputs = scenario.outputs()
    time = outputs.time(DT)
    np.testing.assert_allclose(time[outputs.before == 1], [20.0, 50.35])
    # Every second of an outage.
    seconds = np.concatenate([np.arange(0.0, 60.1, 5.0), np.arange(10.0, 20.0), np.arange(30, 51)])
    np.testing.assert_allclose(time[outputs.before == 0], np.unique(seconds), atol=1e-9)
    assert np.all(np.diff(time) >= 0.0)
    found = study(1, scenario=scenario)["good"]
    assert found.time[found.index(50.35)] == pytest.approx(50.35)


def test_an_outage_beyond_the_end_is_refused():
    Scenario(TRUTH, gnss(TRUTH), (Outage(40.0, 20.0),))
    with pytest.raises(InputError, match=r"from 40 s to 60\.05 s goes beyond the end"):
        Scenario(TRUTH, gnss(TRUTH), (Outage(40.0, 20.05),))


def test_an_outage_that_ends_between_epochs_is_refused():
    with pytest.raises(InputError, match=r"ends at 50\.02 s, between two epochs .* 0\.05 s"):
        Scenario(TRUTH, gnss(TRUTH), (Outage(30.0, 20.02),))
    # Sums of decimal fractions are not exact.
    Scenario(TRUTH, gnss(TRUTH), (Outage(0.1, 0.2), Outage(59.9, 0.1)))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"filters": {}}, "no filter"),
        ({"runs": 0}, "runs = 0"),
        ({"runs": 2.5}, r"runs = 2\.5"),
        ({"seed": -1}, "seed = -1"),
        ({"scenario": replace(SCENARIO, step=-0.1)}, "step"),
        ({"scenario": replace(SCENARIO, interval=-1.0)}, "interval"),
    ],
)
def test_what_cannot_be_used(options, message):
    with pytest.raises(InputError, match=message):
        study(**options)
