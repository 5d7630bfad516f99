"""Models from Allan curves without their samples."""

import json

import numpy as np
import pytest
from scipy.io import savemat

import gmwm
from gmwm import GaussMarkov, QuantizationNoise, RandomWalk, WhiteNoise
from gmwm.errors import InputError
from marks import slow

DT = 0.05
NK = WhiteNoise(1e-4) + RandomWalk(3e-6)


TAU = DT * 2.0 ** np.arange(14)


def exact(model=NK, tau=TAU, **options):
    """The curve of a model."""
    return gmwm.curve(tau, model.haar_variance(tau, DT), kind="wavelet", rate=1 / DT, **options)


def measured(x, **options):
    """Its Allan deviation at 60 averaging times in equal steps of their logarithm."""
    found = gmwm.deviations(x, DT, ["overlapping"], np.geomspace(DT, x.size * DT / 6.0, 60))
    return gmwm.curve(
        found.tau["overlapping"], found.deviation["overlapping"], rate=1 / DT, **options
    )


def same(fit, other, **tolerance):
    for key, value in other.params.items():
        assert fit.params[key] == pytest.approx(value, **tolerance)


@pytest.mark.parametrize(("kind", "power"), [("deviation", 1), ("variance", 2), ("wavelet", 2)])
def test_the_curve_of_a_model_gives_its_parameters(kind, power):
    tau = np.geomspace(0.05, 3000.0, 40)
    deviation = np.sqrt(2.0 * NK.haar_variance(tau, DT)) / np.deg2rad(1.0 / 3600.0)
    values = deviation**power * (0.5 if kind == "wavelet" else 1.0)
    curve = gmwm.curve(tau, values, kind=kind, rate=20.0, duration=1e4, unit="deg/h", name="gyro_x")
    fit = gmwm.fit("N + K", curve)
    same(fit, NK, rel=1e-4)
    assert (curve.quantity, curve.unit, fit.wv.n) == ("gyro", "rad/s", 200_000)


def test_octaves_of_a_series_give_the_fit_to_the_series():
    x = NK.simulate(50_000, DT, 1)
    wv = gmwm.wavelet_variance(x, DT)
    octaves = gmwm.curve(wv.tau, wv.variance, kind="wavelet", rate=20.0, duration=x.size * DT)
    fit, other = gmwm.fit("N + K", octaves), gmwm.fit("N + K", wv)
    same(fit, other, rel=1e-6)
    assert fit.stderr == pytest.approx(other.stderr, rel=1e-3)


@pytest.mark.parametrize("cut", [False, True], ids=["any times", "octaves without the ends"])
def test_other_times_hardly_change_the_fit(cut):
    x = NK.simulate(100_000, DT, 2)
    wv = gmwm.wavelet_variance(x, DT)
    some = {"kind": "wavelet", "rate": 20.0, "duration": x.size * DT}
    curve = gmwm.curve(wv.tau[2:-1], wv.variance[2:-1], **some) if cut else measured(x)
    fit, other = gmwm.fit("N + K", curve), gmwm.fit("N + K", wv)
    same(fit, other, rel=0.1)
    for key, (low, high) in other.interval(0.95).items():
        assert low < fit.params[key] < high


@pytest.mark.filterwarnings("ignore::gmwm.errors.FitWarning")
@pytest.mark.parametrize(
    ("name", "truth"),
    [
        ("N + K", NK),
        slow("N + GM", WhiteNoise(1e-4) + GaussMarkov(5e-5, 30.0)),
        slow("Q + N + K", QuantizationNoise(1e-5) + NK),
    ],
)
@pytest.mark.slow
def test_intervals_hold_the_truth(name, truth):
    runs, held = 30, {key: 0 for key in truth.params}
    for run in range(runs):
        wv = gmwm.wavelet_variance(truth.simulate(20_000, DT, [5, run]), DT)
        some = {"kind": "wavelet", "rate": 20.0, "duration": 1000.0}
        fit = gmwm.fit(name, gmwm.curve(wv.tau[1:-2], wv.variance[1:-2], **some))
        for key, (low, high) in fit.interval(0.95).items():
            held[key] += low <= truth.params[key] <= high
    assert min(held.values()) >= 24, held  # fewer with a probability of 4e-4


def test_errors_of_reading_are_allowed_for():
    values = NK.haar_variance(TAU, DT) * np.exp(0.1 * np.random.default_rng(3).normal(size=14))
    read, taken = (
        gmwm.curve(TAU, values, kind="wavelet", rate=20.0, duration=1e5, error=each)
        for each in (5.0, 0.0)
    )
    fit = gmwm.fit("N + K", read, method=gmwm.GMWM(discrepancy=0.0))
    assert fit.p_value > 0.01
    assert np.all(read.dof < taken.dof)
    low, high = fit.interval(0.95)["N"]
    assert low < 1e-4 < high


def test_a_shorter_recording_is_less_certain_and_the_shortest_is_assumed():
    long, short = exact(duration=1e5), exact()
    assert short.n * DT == pytest.approx(2.0 * short.tau[-1])
    assert np.all(short.dof < long.dof)
    assert gmwm.fit("N + K", short).stderr["N"] > 2.0 * gmwm.fit("N + K", long).stderr["N"]


def test_everything_that_takes_wavelet_variances_takes_it(tmp_path):
    curve = exact(unit="rad/s", name="gyro_x", duration=1e4)
    chosen = gmwm.select(curve)
    assert set(chosen.fit.keys) == {"N", "K"}
    for drawn in (curve.plot(), chosen.fit.plot(), chosen.plot()):
        drawn.figure.canvas.draw()
    numbers = gmwm.bound(chosen.fit, level=0.95)
    assert 0.9e-4 < numbers.N < 1.1e-4
    other = exact(WhiteNoise(1e-3) + RandomWalk(1e-5), unit="m/s^2", name="accel_x")
    fits = {"gyro_x": chosen.fit, "accel_x": gmwm.fit("N + K", other)}
    assert "gyroscope_noise_density" in str(gmwm.export(gmwm.bound(fits), "kalibr"))
    chosen.fit.save(tmp_path / "fit.json")
    loaded = gmwm.load(tmp_path / "fit.json")
    assert loaded.wv.to_dict() == curve.to_dict()
    assert str(curve).startswith("gyro_x: curve from 0.05 to 409.6 s of 200,000 samples at 20 Hz\n")
    both = gmwm.fit("N + K", [curve, curve])
    assert both.stderr["N"] == pytest.approx(chosen.fit.stderr["N"] / np.sqrt(2.0), rel=0.02)


def test_curves_are_compared():
    axis = {"unit": "rad/s", "name": "gyro_x"}
    one, near, noisier = (
        exact(WhiteNoise(N) + RandomWalk(3e-6), duration=1e4, **axis)
        for N in (1e-4, 1.0001e-4, 1.3e-4)
    )
    assert gmwm.compare([one, near])["gyro_x"].state == "agree"
    assert gmwm.compare({"a": {"gyro_x": one}, "b": noisier})["gyro_x"].state == "differ"


@pytest.mark.parametrize(
    ("use", "words"),
    [
        (lambda c: gmwm.fit("N + R", c), "no ramp can be estimated"),
        (lambda c: gmwm.fit(WhiteNoise() + gmwm.RateRamp(1e-9), c), "fit a model without RateRamp"),
        (lambda c: gmwm.fit("N", c, method="mle"), "needs the samples"),
        (lambda c: gmwm.fit("N", exact(tau=DT * 1.6 ** np.arange(16)), method="allan"), "octaves"),
        (lambda c: gmwm.fit("N", [c, exact(tau=3 * c.tau)]), "fit curves one by one"),
        (lambda c: gmwm.wavelet_variance(c), "has no samples"),
        (lambda c: gmwm.deviations(c), "has no samples"),
        (lambda c: gmwm.health(c), "not a recording of samples"),
        (lambda c: gmwm.find_still(c), "not a recording of samples"),
        (lambda c: gmwm.calibrate(c), "not a recording of samples"),
        (lambda c: gmwm.compare([c, exact(tau=3 * c.tau)]), "different averaging times"),
        (lambda c: gmwm.compare([c, 3]), "a calibration nor a recording"),
    ],
)
def test_what_needs_samples_says_so(use, words):
    with pytest.raises(InputError) as caught:
        use(exact())
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (([1.0, 2.0], [1.0]), "equal lengths"),
        (([1.0, 2.0, 4.0, 8.0], [1.0, 1.0, 0.0, 1.0]), "not positive"),
        (([1.0, 2.0, 4.0, np.inf], [1.0] * 4), "not positive"),
        (([1.0, 1.1, 1.2, 1.3, 2.0], [1.0] * 5), "give at least 4"),
        (([1.0, 2.0, 4.0, 8.0], [1.0] * 4, {"duration": 15.0}), "less than twice the longest"),
        (([1.0, 2.0, 4.0, 8.0], [1.0] * 4, {"unit": "m"}), "neither an angular rate nor"),
        (([1.0, 2.0, 4.0, 8.0], [1.0] * 4, {"kind": "adev"}), "kind = 'adev'"),
        (([1.0, 2.0, 4.0, 8.0], [1.0] * 4, {"error": -1.0}), "error = -1.0"),
        (([1.0, 2.0, 4.0, 8.0], [1.0] * 4, {"error": 300.0}), "less than 100"),
        (([1.0, 2.0, 4.0, 4.0, 8.0], [1.0, 0.7, 0.5, 0.3, 0.3]), "two values at one"),
        ((["a"] * 4, [1.0] * 4), "not a number"),
    ],
)
def test_bad_input(arguments, words):
    tau, values, options = (*arguments, {})[:3]
    with pytest.raises(InputError) as caught:
        gmwm.curve(tau, values, **options)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("key", "value"), [("tau", [0.05, 0.05]), ("variance", [1.0]), ("n", 10), ("error", -0.1)]
)
def test_damaged_documents_are_rejected(key, value):
    content = exact().to_dict()
    content[key] = value
    with pytest.raises(InputError):
        gmwm.Curve.from_dict(content)


# -- files ----------------------------------------------------------------------------------------

X, Y = (np.sqrt(2.0 * each.haar_variance(TAU, DT)) for each in (NK, NK + GaussMarkov(1e-5, 9.0)))


def check(found):
    assert list(found) == ["gyro_x", "gyro_y"]
    for curve, deviation in zip(found.values(), (X, Y), strict=True):
        np.testing.assert_allclose(curve.allan_deviation, deviation, rtol=1e-6)
        np.testing.assert_allclose(curve.tau, TAU, rtol=1e-6)
        assert curve.quantity == "gyro"


def test_tables_have_curves_by_axis(tmp_path):
    head = "tau [s],gyro_x [rad/s],gyro_y [rad/s],n\n"
    rows = "\n".join(f"{t},{x},{y},7" for t, x, y in zip(TAU, X, Y, strict=True))
    (tmp_path / "a.csv").write_text(head + rows + "\n")
    check(gmwm.read_curves(tmp_path / "a.csv"))
    savemat(tmp_path / "a.mat", {"tau": TAU, "gyro_x": X, "gyro_y": Y})
    check(gmwm.read_curves(tmp_path / "a.mat", unit={"gyro": "rad/s"}))
    np.savez(tmp_path / "a.npz", tau=TAU, gyro_x=X, gyro_y=Y)
    check(gmwm.read_curves(tmp_path / "a.npz", unit="rad/s"))
    content = {"note": "bench 3", "tau": list(TAU), "gyro_x [rad/s]": list(X)}
    (tmp_path / "a.json").write_text(json.dumps(content | {"gyro_y [rad/s]": list(Y)}))
    check(gmwm.read_curves(tmp_path / "a.json"))


def test_text_files_of_imu_utils(tmp_path):
    per_hour = np.rad2deg(3600.0)
    for axis, values in (("t", TAU), ("x", X * per_hour), ("y", Y * per_hour), ("z", X)):
        (tmp_path / f"data_imu_gyr_{axis}.txt").write_text("\n".join(map(repr, values.tolist())))
    found = gmwm.read_curves(tmp_path / "data_imu_gyr_t.txt")
    assert list(found) == ["gyro_x", "gyro_y", "gyro_z"]
    found.pop("gyro_z")
    check(found)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.csv", "a,gyro_x\n1,2\n2,3\n", "has no column of averaging times: name one tau"),
        ("a.csv", "tau,gyro_x\n1,2\n2,3\n", "unit of gyro_x: write it as in gyro_x [deg/h]"),
        ("a.csv", "tau,gyro_x [deg/h]\n1,2\n2,3\n", "a.csv, gyro_x [deg/h]: a curve has 2"),
        ("a.json", "[1, 2]", "is not an object of lists of one length"),
        ("a.json", '{"tau": [1, 2], "gyro_x": [1]}', "is not an object of lists of one length"),
        ("a_t.txt", "1\n2\n", "must be named data_NAME_gyr_t.txt"),
    ],
)
def test_files_that_are_no_curves(tmp_path, name, text, words):
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError) as caught:
        gmwm.read_curves(tmp_path / name)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("head", "scale"), [("tau [h]", 3600.0), ("tau_ms", 1e-3), ("Tau (min)", 60.0), ("tau", 1.0)]
)
def test_averaging_times_are_read_in_their_unit(tmp_path, head, scale):
    tau = 0.01 * 2.0 ** np.arange(14)
    rows = np.column_stack([tau / scale, 1e-3 / np.sqrt(tau)])
    np.savetxt(tmp_path / "c.csv", rows, "%.9g", ",", header=f"{head},gyro_x [rad/s]", comments="")
    (found,) = gmwm.read_curves(tmp_path / "c.csv", duration=3600).values()
    np.testing.assert_allclose(found.tau, tau, rtol=1e-6)


@pytest.mark.parametrize(
    ("head", "message"),
    [
        ("tau,gyro_x [deg/h],tau_y,gyro_y [deg/h]", "has 2 columns of averaging times"),
        ("tau,gyro_x [deg/h],gyro_x [deg/h]", "two columns of the same name"),
        ("tau [furlong],gyro_x [deg/h]", "not a known unit of time"),
        ("tau,gyro_x [ug]", "'ug' is not a unit of gyro_x"),
    ],
)
def test_columns_that_contradict_are_rejected(tmp_path, head, message):
    rows = np.tile(0.01 * 2.0 ** np.arange(14)[:, None], (1, head.count(",") + 1))
    np.savetxt(tmp_path / "c.csv", rows, "%.9g", ",", header=head, comments="")
    with pytest.raises(gmwm.InputError, match=message):
        gmwm.read_curves(tmp_path / "c.csv", duration=3600)
