"""The error budget: field numbers, sums, tables, curves, refusals and the command."""

import re

import matplotlib

matplotlib.use("Agg")

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import gmwm
from gmwm import GaussMarkov, RandomWalk, RateRamp, WhiteNoise, error_budget
from gmwm.process import CATALOGUE

pytestmark = pytest.mark.usefixtures("closed_figures")

G = 9.80665
DEG = np.pi / 180.0
DT = 0.01
GYRO = WhiteNoise(2e-5) + GaussMarkov(1e-5, 100.0) + RandomWalk(1e-7)
ACCEL = (
    WhiteNoise(1e-3)
    + gmwm.BiasInstability(1e-4)
    + GaussMarkov(2e-4, 5.0)
    + GaussMarkov(1e-4, 300.0)
)
IMU = {f"{kind}_{axis}": m for kind, m in (("gyro", GYRO), ("accel", ACCEL)) for axis in "xyz"}


@pytest.fixture(scope="module")
def budget():
    return error_budget(IMU, dt=DT)


@pytest.fixture(scope="module")
def calibration():
    rng = np.random.default_rng(3)
    n = 4000
    channels = [
        gmwm.Channel("gyro_x", WhiteNoise(1e-3).simulate(n, DT, rng), DT, "gyro", "rad/s"),
        gmwm.Channel("accel_y", WhiteNoise(2e-3).simulate(n, DT, rng), DT, "accel", "m/s^2"),
        gmwm.Channel("voltage", WhiteNoise(1.0).simulate(n, DT, rng), DT, None, "V"),
    ]
    return gmwm.calibrate(gmwm.Recording(tuple(channels), source="bench.csv"), WhiteNoise())


# -- numbers --------------------------------------------------------------------------------------


def test_the_units_on_data_sheets():
    # 0.3 deg/sqrt(h) over an hour; 60 ug/sqrt(Hz) is 0.0353 m/s/sqrt(h).
    models = {"gyro_z": WhiteNoise(0.3 * DEG / 60.0), "accel_z": WhiteNoise(60e-6 * G)}
    found = error_budget(models, [3600.0], dt=DT)
    assert np.degrees(found.total("gyro_z")["attitude"]) == pytest.approx([0.3], rel=1e-6)
    assert found.total("accel_z")["velocity"] == pytest.approx([60e-6 * G * 60.0], rel=1e-6)


def test_ten_degrees_an_hour_of_drift_by_hand():
    # A bias of 10 deg/h that nobody knows, held by a very long correlation time.
    bias = 10.0 * DEG / 3600.0
    found = error_budget({"gyro_x": GaussMarkov(bias, 1e9)}, [60.0], dt=DT, calibrated=False)
    total = found.total("gyro_x")
    assert np.degrees(total["attitude"]) == pytest.approx([10.0 / 60.0], rel=1e-4)
    assert total["velocity"] == pytest.approx([G * bias * 60.0**2 / 2.0], rel=1e-4)
    assert total["position"] == pytest.approx([G * bias * 60.0**3 / 6.0], rel=1e-4)


def test_each_channel_acts_on_what_it_can(budget):
    found = {name: budget.quantities(name) for name in budget.channels}
    tilting, pushing = ("attitude", "velocity", "position"), ("velocity", "position")
    assert found == {
        "gyro_x": tilting, "gyro_y": tilting, "gyro_z": ("attitude",),
        "accel_x": pushing, "accel_y": pushing, "accel_z": pushing,
    }  # fmt: skip
    # Without an axis in its name a gyro is taken for one that tilts.
    assert error_budget({"gyro": GYRO}, dt=DT).quantities("gyro") == tilting


@pytest.mark.parametrize("calibrated", [True, False])
def test_terms_add_up_by_their_squares(calibrated):
    whole = error_budget(IMU, dt=DT, calibrated=calibrated)
    for name, model in [*IMU.items()][1::2]:
        parts = [
            error_budget({name: term}, dt=DT, calibrated=calibrated).total(name)
            for term in model.terms
        ]
        for quantity, total in whole.total(name).items():
            squares = np.sum([part[quantity] ** 2 for part in parts], axis=0)
            assert total**2 == pytest.approx(squares)
    flat = [name for name in IMU if name.endswith(("x", "y"))]
    for quantity, total in whole.total().items():
        squares = [whole.total(name).get(quantity, np.zeros(4)) ** 2 for name in flat]
        assert total**2 == pytest.approx(np.sum(squares, axis=0))


@settings(deadline=None, max_examples=15)
@given(
    st.sampled_from([p for kind in CATALOGUE for p in kind.examples()]),
    st.sampled_from(["gyro_x", "gyro_z", "accel_z"]),
    st.booleans(),
)
def test_errors_are_positive_and_end_on_the_curve(process, name, calibrated):
    found = error_budget({name: process}, [0.5, 3.0, 20.0], dt=0.05, calibrated=calibrated)
    for row in found.rows:
        assert np.all(np.isfinite(row.values))
        assert np.all(np.array(row.values) > 0.0)
        assert row.curve[0] == pytest.approx(row.values[0], rel=1e-5)
        assert row.curve[-1] == pytest.approx(row.values[-1], rel=1e-5)


def test_a_ramp_counts_by_its_absolute_value():
    down, up = (error_budget({"gyro_z": RateRamp(r)}, [100.0], dt=1e-4) for r in (-1e-6, 1e-6))
    assert down.rows[0].component == "rate ramp, |R|"
    assert down.rows == up.rows
    assert down.rows[0].values == pytest.approx([1e-6 * 100.0**2 / 2.0], rel=1e-5)


def test_a_budget_of_a_calibration_a_fit_and_a_mapping(calibration):
    whole = error_budget(calibration, (1.0, 5.0))
    assert whole.channels == ("gyro_x", "accel_y")
    models = {name: calibration[name].model for name in whole.channels}
    assert error_budget(models, (1.0, 5.0), dt=DT).rows == whole.rows
    assert error_budget(dict(calibration.fits), (1.0, 5.0)).rows == whole.rows
    single = error_budget(calibration["gyro_x"], (1.0, 5.0))
    assert single.rows == tuple(row for row in whole.rows if row.channel == "gyro_x")
    n = calibration["gyro_x"].params["N"]
    assert single.total("gyro_x")["attitude"] == pytest.approx([n, n * 5.0**0.5])


def test_a_fit_without_a_channel_goes_by_the_name_that_it_is_given():
    fit = gmwm.fit(WhiteNoise(), WhiteNoise(1e-3).simulate(1000, DT, 1), dt=DT)
    assert error_budget({"accel_z": fit}, [1.0]).quantities("accel_z") == ("velocity", "position")


def test_times_come_in_order_and_once():
    assert error_budget({"gyro_x": GYRO}, [60, 1, 60], dt=DT).times == (1.0, 60.0)


def test_the_largest_contribution(budget):
    row, share = budget.largest("attitude", "gyro_z")
    values = {r.component: r.values[-1] for r in budget.rows if r.channel == "gyro_z"}
    assert row.component == max(values, key=values.get)
    assert share == pytest.approx(values[row.component] ** 2 / sum(v**2 for v in values.values()))
    silent = error_budget({"gyro_z": WhiteNoise(0.0)}, dt=DT)
    assert silent.largest("attitude", "gyro_z")[1] == 0.0


# -- notes ----------------------------------------------------------------------------------------


def test_a_tilt_that_is_no_small_angle():
    large = {"gyro_x": GaussMarkov(0.1 * DEG, 1e6)}
    (_, note) = error_budget(large, dt=DT, calibrated=False).notes
    assert note.startswith("at 600 s the tilt exceeds 10 deg")
    # A heading is none.
    heading = {"gyro_z": GaussMarkov(0.1 * DEG, 1e6)}
    assert error_budget(heading, dt=DT, calibrated=False).notes == ()


# -- bad input ------------------------------------------------------------------------------------

REFUSED = {
    "free parameters": (lambda: error_budget({"gyro_x": WhiteNoise()}, dt=DT), "free parameters"),
    "no quantity": (lambda: error_budget({"temp": GYRO}, dt=DT), "a gyro or an accelerometer"),
    "no channels": (lambda: error_budget({}, dt=DT), "models by channel"),
    "a model alone": (lambda: error_budget(GYRO, dt=DT), "a gyro or an accelerometer"),
    "no model": (lambda: error_budget({"gyro_x": 3}, dt=DT), "is not an error model"),
    "interval of NaN": (lambda: error_budget({"gyro_x": GYRO}, dt=np.nan), "dt = nan"),
    "no times": (lambda: error_budget(IMU, [], dt=DT), "give at least one outage length"),
    "no numbers": (lambda: error_budget(IMU, ["soon"], dt=DT), "positive numbers of seconds"),
    "infinite time": (lambda: error_budget(IMU, [1, np.inf], dt=DT), "positive numbers of seconds"),
    "negative time": (lambda: error_budget(IMU, [-1.0], dt=DT), "times = -1.0"),
    "time below dt": (lambda: error_budget(IMU, [0.001, 1], dt=DT), "shorter than the sampling"),
    "total of nothing": (lambda: error_budget(IMU, dt=DT).total("gyro_w"), "has no total 'gyro_w'"),
    "no horizontal": (lambda: error_budget({"gyro_z": GYRO}, dt=DT).total(), "no total"),
    "heading in metres": (
        lambda: error_budget(IMU, dt=DT).plot(of="gyro_z", quantity="position"),
        "gyro_z does not affect the 'position' error",
    ),
}


@pytest.mark.parametrize("what", REFUSED)
def test_bad_input(what):
    call, words = REFUSED[what]
    with pytest.raises(gmwm.InputError, match=re.escape(words)) as refused:
        call()
    assert "\n" not in str(refused.value)


# -- the command ----------------------------------------------------------------------------------


def test_what_to_know(calibration):
    notes = " ".join(error_budget(calibration, (1.0, 3600.0)).notes)
    assert "neither gyro nor accelerometer, left out: voltage" in notes
    assert "a record of 40 s shows little of what happens over more than 4 s" in notes
    assert "the horizontal total lacks gyro_y, accel_x" in notes
    assert "beyond 600 s the Schuler oscillation" in notes
    assert error_budget(IMU, dt=DT).notes == ()


def test_models_that_are_not_valid_are_named():
    series = gmwm.Channel("gyro_x", WhiteNoise(1e-3).simulate(4000, DT, 1), DT, "gyro", "rad/s")
    fit = gmwm.fit(WhiteNoise() + RandomWalk(), series)
    assert not fit.valid
    notes = error_budget(fit, (1.0,)).notes
    assert "the model of gyro_x is not valid: read the notices first" in notes
