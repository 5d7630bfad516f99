"""Curves against covariates, estimated beside the noise."""

from dataclasses import replace

import numpy as np
import pytest

import gmwm
from gmwm import RandomWalk, WhiteNoise
from gmwm._core.spool import Spool, is_spooled
from gmwm.calibration.covariates import designs_of, wanted

N, K, SIZE, DT = 1e-3, 5e-5, 2048, 0.5
CUBIC = np.array([0.02, 0.008, 0.006])
MODEL = WhiteNoise() + RandomWalk()


def warm_up(size=SIZE):
    return 25.0 + 40.0 * (1.0 - np.exp(-4.0 * np.arange(size) / size))


def cubic(temperature):
    u = (np.asarray(temperature) - 45.0) / 20.0
    return CUBIC @ np.array([u, u**2, u**3])


def recording(seed=1, temperature=None, more=0.0, size=SIZE):
    temperature = warm_up(size) if temperature is None else temperature
    x = (WhiteNoise(N) + RandomWalk(K)).simulate(size, DT, seed)
    arrays = {"gyro_x": 0.3 + x + cubic(temperature) + more, "temperature": temperature}
    return gmwm.Recording.from_arrays(arrays, 1.0 / DT, {"gyro": "rad/s", "temperature": "degC"})


def calibrated(rec, words="cubic", **others):
    others = {"model": MODEL, "jobs": 1} | others
    return gmwm.calibrate(rec, covariates={"temperature": words}, **others)


@pytest.fixture(scope="module")
def result():
    return calibrated(recording())


def off(curve, at):
    """Errors of a curve against its centre, and half their intervals."""
    _, value, error = curve.band(at)
    true = cubic(at) - cubic(curve.main.centre)
    return value - curve(curve.main.centre) - true, error


@pytest.mark.parametrize("gap", [slice(0, 150), slice(100, 300)])
def test_where_the_temperature_is_missing_samples_are_left_out(gap):
    temperature = warm_up()
    temperature[gap] = np.nan
    rec = recording()
    cut = rec["gyro_x"].values.copy()
    cut[gap] = np.nan
    arrays = {"gyro_x": cut, "temperature": warm_up()}
    units = {"gyro": "rad/s", "temperature": "degC"}
    without_samples = calibrated(gmwm.Recording.from_arrays(arrays, 1.0 / DT, units))
    arrays = {"gyro_x": rec["gyro_x"].values, "temperature": temperature}
    found = calibrated(gmwm.Recording.from_arrays(arrays, 1.0 / DT, units))
    (said,) = [each for each in found.notices if each.code == "covariate-missing"]
    assert said.values["length"] == pytest.approx((gap.stop - gap.start) * DT, abs=8.0)
    assert found["gyro_x"].valid
    difference, error = off(found.curves["gyro_x"], np.array([38.0, 50.0, 60.0]))
    assert np.all(np.abs(difference) < 2.5 * error)
    fit, other = found["gyro_x"].params, without_samples["gyro_x"].params
    assert fit["K"] == pytest.approx(other["K"], rel=0.3)


def test_a_curve_is_found_with_its_noise(result):
    curve, fit = result.curves["gyro_x"], result["gyro_x"]
    at = np.linspace(curve.main.low, curve.main.high, 12)
    difference, error = off(curve, at)
    assert np.all(np.abs(difference) < 2.0 * error)
    assert np.max(error) < 0.2 * np.ptp(cubic(at))
    low, high = fit.interval(0.999)["K"]
    assert low <= K <= high
    assert fit.valid


def test_a_polynomial_about_any_temperature_is_the_curve(result):
    curve = result.curves["gyro_x"]
    at = np.linspace(curve.main.low, curve.main.high, 5)
    for reference in (None, 25.0, 0.0):
        origin = curve.main.centre if reference is None else reference
        powers = curve.polynomial(reference)
        assert powers.size == 4
        np.testing.assert_allclose(np.polyval(powers[::-1], at - origin), curve(at), rtol=1e-9)


def test_a_curve_is_not_extrapolated(result):
    curve = result.curves["gyro_x"]
    with pytest.raises(gmwm.InputError, match=r"known from 25\.\d+ to 64\.\d+ degC"):
        curve(70.0)


def test_a_curve_comes_back_from_its_file(result, tmp_path):
    again = gmwm.load(result.save(tmp_path / "cal.json"))
    curve, before = again.curves["gyro_x"], result.curves["gyro_x"]
    for one, other in zip(curve.band(), before.band(), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12)
    assert str(curve) == str(before)


def test_the_degree_is_chosen():
    line = 0.01 * (warm_up() - 45.0) / 20.0 - cubic(warm_up())
    assert calibrated(recording(2, more=line), "auto").curves["gyro_x"].degree == 1
    assert calibrated(recording(2), "auto").curves["gyro_x"].degree == 3


@pytest.mark.parametrize("size", [18_000, 20_000])
def test_the_degree_is_chosen_at_any_length(size):
    """Means of the samples and the temperature were up to a thirtieth of the record apart."""
    knots = size * np.array([0.0, 0.2, 0.25, 0.45, 0.5, 0.7, 0.75, 1.0])
    soaks = np.interp(np.arange(size), knots, [25.0, 25.0, 45.0, 45.0, 65.0, 65.0, 35.0, 35.0])
    cal = calibrated(recording(4, soaks, size=size), "auto")
    assert cal.curves["gyro_x"].degree == 3
    assert cal["gyro_x"].valid
    difference, error = off(cal.curves["gyro_x"], np.array([30.0, 50.0, 60.0]))
    assert np.all(np.abs(difference) < 2.0 * error)


@pytest.mark.parametrize("constant", ["auto", "256 s"])
def test_settling_that_a_warm_up_imitates_is_rejected(constant):
    """exp(-2 t / tau) is a square of the temperature; a choice was wrong by eight intervals."""
    temperature = 25.0 + 40.0 * (1.0 - np.exp(-DT * np.arange(SIZE) / 512.0))
    rec = recording(1, temperature, 0.02 * np.exp(-DT * np.arange(SIZE) / 256.0))
    words = {"temperature": "auto" if constant == "auto" else "cubic", "settling": constant}
    with pytest.raises(gmwm.InputError, match="cannot be separated: leave it out, record cycles"):
        gmwm.calibrate(rec, MODEL, covariates=words, jobs=1)


def test_hysteresis_and_settling_are_regressors():
    temperature = 45.0 - 20.0 * np.cos(4.0 * np.pi * np.arange(SIZE) / SIZE)
    late, keep = temperature.copy(), np.exp(-DT / 60.0)
    for k in range(1, SIZE):
        late[k] = keep * late[k - 1] + (1.0 - keep) * temperature[k]
    settling = 0.02 * np.exp(-DT * np.arange(SIZE) / 40.0)
    more = 0.02 * (late - temperature) / 20.0 + settling
    rec = recording(3, temperature, more)
    cal = gmwm.calibrate(
        rec, MODEL, covariates={"temperature": "cubic, lag", "settling": "40 s"}, jobs=1
    )
    curve = cal.curves["gyro_x"]
    by_kind = {each.kind: k for k, each in enumerate(curve.regressors)}
    lag = by_kind["lag"]
    assert 30.0 < curve.regressors[lag].constant < 120.0
    error = curve.errors(np.eye(curve.values.size))
    assert curve.values[lag] == pytest.approx(0.02, rel=0.4)
    assert abs(curve.values[by_kind["settling"]] - 0.02) < 2.0 * error[by_kind["settling"]]
    assert cal["gyro_x"].valid


def test_a_curve_leaves_nothing_of_a_clean_channel():
    """Curve and samples were half a sample apart: K^2 was a tenth too large in two cycles."""
    temperature = 45.0 - 20.0 * np.cos(4.0 * np.pi * np.arange(SIZE) / SIZE)
    arrays = {"gyro_x": cubic(temperature), "temperature": temperature}
    units = {"gyro": "rad/s", "temperature": "degC"}
    rec = gmwm.Recording.from_arrays(arrays, 1.0 / DT, units)
    design = designs_of([rec], wanted({"temperature": "cubic"}))["gyro_x"]
    left = design.without(rec["gyro_x"], 0).values
    assert np.std(left[8:-8]) < 1e-3 * np.std(cubic(temperature))


def test_bias_follows_the_power_of_vibration(tmp_path):
    """Of a shaker: the column is kept by its name, and its power may be in g^2."""
    power = 2.0 * (1.0 - np.cos(4.0 * np.pi * np.arange(SIZE) / SIZE))
    bias = 0.01 * power + N / np.sqrt(DT) * np.random.default_rng(4).normal(size=SIZE)
    columns = {"time [s]": DT * np.arange(SIZE), "accel_x [m/s^2]": bias}
    columns["vibration [g^2]"] = power / 9.80665**2
    rows = np.column_stack([*columns.values()])
    path = tmp_path / "shaker.csv"
    np.savetxt(path, rows, "%.9g", ",", header=",".join(columns), comments="")
    found = gmwm.calibrate(gmwm.read(path), covariates={"vibration": "linear"}, model="N", jobs=1)
    curve = found.curves["accel_x"]
    _, value, error = curve.band(np.array([0.5, 3.5]))
    assert np.diff(value)[0] == pytest.approx(0.03, abs=2.0 * error.sum())
    assert error.sum() < 1e-3


def test_channels_of_two_rates_have_curves():
    fast, slow = recording(4), recording(5, temperature=warm_up()[::2], size=SIZE // 2)
    other = replace(slow["gyro_x"], name="gyro_y", dt=2.0 * DT)
    rec = replace(fast, channels=(*fast.channels, other))
    cal = calibrated(rec)
    for curve in cal.curves.values():
        difference, error = off(curve, np.linspace(curve.main.low, curve.main.high, 8))
        assert np.all(np.abs(difference) < 2.0 * error)
    assert sorted(cal.curves) == ["gyro_x", "gyro_y"]


def test_samples_on_disk_stay_there():
    rec = recording()
    spool = Spool(1)
    spool.append(rec["gyro_x"].values[:, None])
    on_disk = replace(rec["gyro_x"], values=spool.array()[:, 0])
    design = designs_of([rec], wanted({"temperature": "cubic"}))["gyro_x"]
    left = design.without(on_disk, 0).values
    assert is_spooled(left)
    np.testing.assert_array_equal(left, design.without(rec["gyro_x"], 0).values)


def test_without_covariates_nothing_changes(result):
    assert gmwm.calibrate(recording(), MODEL, jobs=1).curves == {}


def test_soaks_have_one_curve():
    """Each recording has a level of its own; together they see the whole range."""
    spans = [(25.0, 45.0), (40.0, 65.0)]
    parts = [
        recording(seed, np.linspace(*span, SIZE), more=0.1 * seed)
        for seed, span in enumerate(spans)
    ]
    curve = calibrated(parts).curves["gyro_x"]
    assert (curve.main.low, curve.main.high) == pytest.approx((25.0, 65.0), abs=0.1)
    difference, error = off(curve, np.linspace(curve.main.low, curve.main.high, 8))
    assert np.all(np.abs(difference) < 2.0 * error)


@pytest.mark.parametrize(
    ("covariates", "said"),
    [
        ({}, "write it like"),
        ({"temperature": "round"}, "write auto, linear"),
        ({"pressure": "linear"}, "no channel 'pressure' as a covariate: it has temperature"),
        ({"settling": "cubic"}, "write auto, linear"),
        ({"temperature": "cubic, lag -5 s"}, "write auto, linear"),
    ],
)
def test_what_cannot_be_a_covariate_is_said(covariates, said):
    with pytest.raises(gmwm.InputError, match=said):
        gmwm.calibrate(recording(), MODEL, covariates=covariates, jobs=1)


@pytest.mark.parametrize(("value", "said"), [(30.0, "does not change"), (np.nan, "has no values")])
def test_a_constant_temperature_is_no_covariate(value, said):
    with pytest.raises(gmwm.InputError, match=f"temperature {said}"):
        calibrated(recording(temperature=np.full(SIZE, value)))


@pytest.mark.slow
def test_intervals_of_a_warm_up_cover_and_the_walk_is_whole():
    """Least squares covers a quarter of the curve, and leaves three quarters of K^2."""
    held, square = [], []
    for seed in range(60):
        cal = calibrated(recording([9, seed]), screening=())
        curve = cal.curves["gyro_x"]
        difference, error = off(curve, np.linspace(curve.main.low, curve.main.high, 8))
        held.append(np.mean(np.abs(difference) <= error))
        square.append((cal["gyro_x"].params["K"] / K) ** 2)
    # Points of a curve are nearly one draw: a binomial of 60 at 0.93, three deviations.
    assert np.mean(held) > 0.93 - 3.0 * np.sqrt(0.93 * 0.07 / 60)
    assert abs(np.mean(square) - 1.0) < 3.0 * np.std(square) / np.sqrt(60) + 0.05


def test_a_curve_along_the_record_is_what_was_added(result):
    """At once and in parts: what it subtracts is the curve at every sample."""
    curve, at = result.curves["gyro_x"], warm_up()
    along = curve.along({"temperature": at}, DT)
    np.testing.assert_allclose(along, curve(at) - curve(curve.main.centre), atol=1e-12)
    with pytest.raises(gmwm.InputError, match="known from"):
        curve.along({"temperature": warm_up() + 10.0}, DT)
    with pytest.raises(gmwm.InputError, match="needs values of temperature: give them"):
        curve.along({"voltage": at}, DT)


def test_a_log_that_picks_samples_has_the_curve_and_not_the_noise():
    """Single samples of 20 Hz at 2 Hz: the density is ten times that of the sensor, and said."""
    temperature = warm_up(10 * SIZE)
    x = WhiteNoise(N).simulate(10 * SIZE, 0.05, 6) + cubic(temperature)
    arrays = {"gyro_x": x[::10], "temperature": temperature[::10]}
    units = {"gyro": "rad/s", "temperature": "degC"}
    cal = calibrated(gmwm.Recording.from_arrays(arrays, 2.0, units), model="N")
    difference, error = off(cal.curves["gyro_x"], np.linspace(26.0, 64.0, 8))
    assert np.all(np.abs(difference) < 2.0 * error)
    assert cal["gyro_x"].params["N"] == pytest.approx(np.sqrt(10.0) * N, rel=0.1)
    (said,) = [each for each in cal.notices if each.code == "slow-log"]
    assert said.severity == "warning"
    fast = gmwm.Recording.from_arrays({name: x[:SIZE] for name, x in arrays.items()}, 20.0, units)
    assert all(each.code != "slow-log" for each in calibrated(fast, "linear", model="N").notices)


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (("temperature", "time"), "change together"),
        (("temperature",), "name one as the covariate, such as temperature_a"),
    ],
)
def test_covariates_that_cannot_be_separated_or_chosen_are_rejected(names, message):
    rising = np.linspace(20.0, 50.0, SIZE)
    x = WhiteNoise(N).simulate(SIZE, DT, 1)
    columns = {"temperature": rising} if len(names) > 1 else {
        "temperature_a": rising, "temperature_b": rising[::-1]
    }  # fmt: skip
    units = {
        "gyro": "rad/s",
        "temperature": "degC",
        "temperature_a": "degC",
        "temperature_b": "degC",
    }
    rec = gmwm.Recording.from_arrays({"gyro_x": x, **columns}, 1.0 / DT, units)
    with pytest.raises(gmwm.InputError, match=message):
        gmwm.calibrate(rec, covariates=dict.fromkeys(names, "linear"), model=MODEL, jobs=1)


def test_constant_channels_are_rejected_beside_a_covariate_too():
    arrays = {"gyro_x": np.ones(SIZE), "temperature": warm_up()}
    rec = gmwm.Recording.from_arrays(arrays, 1.0 / DT, {"gyro": "rad/s", "temperature": "degC"})
    with pytest.raises(gmwm.InputError, match="constant"):
        calibrated(rec)


@pytest.mark.parametrize("constant", [0.0, 60.0])
def test_a_lag_that_the_curve_lacks_is_said(constant):
    """Hysteresis was a random walk of ten times the size, without a word."""
    temperature = 45.0 - 20.0 * np.cos(4.0 * np.pi * np.arange(SIZE) / SIZE)
    keep = np.exp(-DT / constant) if constant else 0.0
    late = temperature.copy()
    for k in range(1, SIZE):
        late[k] = keep * late[k - 1] + (1.0 - keep) * temperature[k]
    cal = calibrated(recording(3, temperature, 0.02 * (late - temperature) / 20.0))
    said = [each for each in cal["gyro_x"].notices if each.code == "curve-lags"]
    assert bool(said) == bool(constant)
    departures = [n for n in cal["gyro_x"].notices if n.issue.topic == "departure"]
    assert not any(n.values.get("removable") for n in departures)
    if said:
        assert 20.0 < said[0].values["constant"] < 180.0
        again = calibrated(
            recording(3, temperature, 0.02 * (late - temperature) / 20.0), "cubic,lag"
        )
        assert not any(each.code == "curve-lags" for each in again["gyro_x"].notices)


def test_a_channel_of_the_sensor_is_no_covariate():
    with pytest.raises(gmwm.InputError, match="of the sensor itself, not a covariate"):
        gmwm.calibrate(recording(), covariates={"gyro_x": "linear"}, model=MODEL, jobs=1)


def test_a_temperature_needs_a_unit(tmp_path):
    lines = "\n".join(f"{0.01 * k},{k % 7 * 1e-3},{20 + k * 1e-3}" for k in range(2000))
    path = tmp_path / "static.csv"
    path.write_text(f"time [s],gyro_x [rad/s],temperature\n{lines}\n")
    with pytest.raises(gmwm.InputError, match=r"no unit: .* such as temperature \[degC\]"):
        gmwm.calibrate(gmwm.read(path), covariates={"temperature": "linear"}, still=False)


@pytest.mark.parametrize("fault", ["spikes", "off", "frozen"])
def test_where_the_thermometer_fails_it_is_not_used(fault):
    """The range began at -127 degC, the degree was 1, and the fit was not valid, or off."""
    temperature = 45.0 - 20.0 * np.cos(4.0 * np.pi * np.arange(16 * SIZE) / (16 * SIZE))
    temperature += np.random.default_rng(1).normal(0.0, 0.01, temperature.size)
    x = WhiteNoise(N).simulate(temperature.size, DT, 7) + cubic(temperature)
    if fault == "frozen":
        temperature[9000:12000] = temperature[9000]
    else:
        for start in (5000, 15000, 25000):
            temperature[start : start + (1 if fault == "spikes" else 300)] = -127.0
    arrays = {"gyro_x": x, "temperature": temperature}
    units = {"gyro": "rad/s", "temperature": "degC"}
    rec = gmwm.Recording.from_arrays(arrays, 1.0 / DT, units)
    cal = calibrated(rec, "auto", model="N")
    assert any(each.code == "thermometer-fails" for each in cal.notices)
    curve = cal.curves["gyro_x"]
    assert cal["gyro_x"].valid
    assert curve.degree == 3
    assert (curve.main.low, curve.main.high) == pytest.approx((25.0, 65.0), abs=0.2)
    difference, error = off(curve, np.linspace(26.0, 64.0, 8))
    assert np.all(np.abs(difference) < 2.0 * error)


@pytest.mark.parametrize("step", [0.0, 0.5])
@pytest.mark.parametrize("is_soaked", [False, True])
def test_thermometers_that_round_and_soaks_do_not_fail(step, is_soaked):
    s = np.arange(SIZE) / SIZE
    temperature = 45.0 - 20.0 * np.cos(4.0 * np.pi * s)
    if is_soaked:
        temperature = np.select([s < 0.3, s < 0.6], [25.0, 45.0], 65.0)
    if step:
        temperature = step * np.round(temperature / step)
    cal = calibrated(recording(8, temperature))
    assert not any(each.code == "thermometer-fails" for each in cal.notices)


def test_departures_are_not_removed_beside_a_curve():
    """A slow period took the curve with it: a fifth was left of it, in a fit that was valid."""
    temperature = 45.0 - 20.0 * np.cos(4.0 * np.pi * np.arange(SIZE) / SIZE)
    rec = recording(5, temperature, 0.004 * np.sin(12.0 * np.pi * np.arange(SIZE) / SIZE))
    found = calibrated(rec)["gyro_x"].notices
    departed = [each for each in found if each.issue.topic == "departure"]
    assert departed
    assert not any("remove_departures" in each.hint for each in departed)
    with pytest.raises(gmwm.InputError, match="cannot be removed together with covariates"):
        calibrated(rec, remove_departures=True)
