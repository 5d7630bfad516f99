"""Numbers for filters from curves in motion."""

import re
from dataclasses import replace

import numpy as np
import pytest

import gmwm
from gmwm import QuantizationNoise, RandomWalk, WhiteNoise
from gmwm.issues import notice
from gmwm.motion import InMotion, MotionCurve

DT = 0.008
TAU = DT * 2.0 ** np.arange(10)  # up to 4.1 s
KINDS = ("gyro", "accel")
AXES = [f"{kind}_{axis}" for kind in KINDS for axis in "xyz"]


def in_motion(variances, static=None):
    """A result of four IMUs of 60 s with given Allan variances of all axes, one each."""
    four = np.ones((3, TAU.size))
    rest = np.full(TAU.size, np.nan) if static is None else static
    curves = tuple(
        MotionCurve(f"imu {k}", name, name.partition("_")[0], TAU, each, 0.9 * each, 1.2 * each,
                    each * four, 2.0 * each * four, np.ones(TAU.size), rest,
                    four[0], 0.1 * four[0])
        for k, each in enumerate(variances, start=1)
        for name in AXES
    )  # fmt: skip
    labels = tuple(f"imu {k}" for k in range(1, len(variances) + 1))
    return InMotion(labels, (60.0,), curves, (), ())


def allan(model, tau=TAU):
    return 2.0 * model.haar_variance(np.asarray(tau, dtype=float), DT)


def test_a_sum_of_the_three_terms_is_found():
    truth = QuantizationNoise(2e-4) + WhiteNoise(1e-4) + RandomWalk(1e-3)
    model = in_motion([allan(truth)]).models()["gyro_x"]
    assert model.params == pytest.approx(truth.params, rel=1e-6)


@pytest.mark.parametrize("interval", [0.01, 0.1, 0.5])
def test_bounded_angles_need_an_n_that_falls_with_the_interval(interval):
    """N^2/t is 3 Q^2/t^2 at the interval; the walk has a hundredth at the end."""
    found = in_motion([allan(QuantizationNoise(2e-4))]).numbers(interval, 2.0)["gyro_z"]
    assert found.params["N"] == pytest.approx(2e-4 * np.sqrt(3.0 / interval), rel=0.01)
    assert found.params["K"] ** 2 * 2.0 / 3.0 == pytest.approx(3.0 * (2e-4 / 2.0) ** 2 / 100.0)


def test_errors_grow_at_most_as_predicted():
    """Of every IMU and axis, at all times between the limits."""
    rng = np.random.default_rng(4)
    variances = allan(QuantizationNoise(1e-3) + WhiteNoise(1e-3)) * rng.uniform(0.5, 2.0, (4, 10))
    found = in_motion(variances)
    used, ends = slice(4, 8), (TAU[4], TAU[7])
    second, all_imus = found.numbers(*ends, imu="imu 2"), found.numbers(*ends)
    assert set(second) == set(all_imus) == set(AXES)
    ratio = allan(second["accel_x"])[used] / variances[1, used]
    assert ratio.min() == pytest.approx(1.0)  # it touches the curve
    ratio = allan(all_imus["accel_x"])[used] / variances[:, used]
    assert ratio.min() == pytest.approx(1.0)
    above = found.numbers(*ends, upper=True)["accel_x"].params
    assert above["N"] == pytest.approx(np.sqrt(1.2) * all_imus["accel_x"].params["N"])
    model = found.models("imu 3")["gyro_y"]
    assert np.all(allan(model) >= variances[2] * (1.0 - 1e-9))


def test_what_is_known_at_rest_counts_where_motion_shows_less():
    static = allan(WhiteNoise(1e-3))
    found = in_motion([0.5 * static], static).numbers()["gyro_x"]
    assert found.params["N"] == pytest.approx(1e-3, rel=0.01)


def test_times_beyond_the_curves_are_rejected():
    found = in_motion([allan(WhiteNoise(1e-3))])
    with pytest.raises(gmwm.InputError, match=r"these flights show 0.008 s to 4.1 s in motion"):
        found.numbers(0.1, 60.0)
    with pytest.raises(gmwm.InputError, match="give times between"):
        found.numbers(1.0, 0.5)


def test_filters_with_these_numbers_are_certified():
    """Of bounded angle without white noise; numbers at rest are overconfident by far."""
    found = in_motion([allan(QuantizationNoise(1e-4))], allan(WhiteNoise(1e-6)))

    def nees(numbers):
        given = {kind: tuple(numbers[f"{kind}_x"].params[k] for k in "NK") for kind in KINDS}
        times = {"outages": (1.0,), "keyframe": 0.1, "rate": 1.0 / DT}
        checks = gmwm.certify(found.models(), given, **times).checks
        return [each.nees for each in checks if each.consumer == "keyframes"]

    assert max(nees(found.numbers(0.1, 1.0))) <= 1.05
    assert min(nees(found.at("rest").numbers(0.1, 1.0))) > 100.0


def test_numbers_in_use_are_judged_in_motion_beside_the_bench(run, tmp_path):
    """A bounded angle Q has an Allan variance of 3 Q^2/t^2, N predicts N^2/t and K K^2 t/3."""
    Q, N, K = 1e-3, 1e-4, 1e-5
    found = in_motion([allan(QuantizationNoise(Q))])
    bench = {name: WhiteNoise(N) + RandomWalk(K) for name in AXES}
    judged = gmwm.certify(bench, {kind: (N, K) for kind in KINDS}, rate=1.0 / DT, motion=found)
    for each in (check for check in judged.of("motion") if check.where == "gyro_x"):
        expected = 3.0 * (Q / each.time) ** 2 / (N**2 / each.time + K**2 * each.time / 3.0)
        assert each.nees == pytest.approx(expected, rel=0.02)
    of_two = replace(found, notices=(notice("motion-two-imus"),))
    numbers = {kind: (N, K) for kind in KINDS}
    again = gmwm.certify(bench, numbers, rate=1.0 / DT, motion=of_two)
    assert "motion-two-imus" in [each.code for each in again.notices]
    assert "overconfident" in judged.text()
    assert (
        "take the row 'in motion', for outages of 60 s at rest, 1 s in motion: gyro N"
        in " ".join(judged.text().split())
    )
    enough = {kind: (judged.causes[-1].N, judged.causes[-1].K) for kind in KINDS}
    found.save(tmp_path / "motion.json")
    units = {"gyro": "rad/s", "accel": "m/s^2"}
    arrays = {name: model.simulate(2000, DT, k) for k, (name, model) in enumerate(bench.items())
              if name.endswith("x")}  # fmt: skip
    recording = gmwm.Recording.from_arrays(arrays, 1.0 / DT, units)
    gmwm.calibrate(recording, "N+K", screening=()).save(tmp_path / "bench.json")
    N, K = (",".join(str(enough[kind][k]) for kind in KINDS) for k in range(2))
    flags = ("-N", N, "-K", K, "--motion", tmp_path / "motion.json")
    code, out, _ = run("certify", tmp_path / "bench.json", *flags, "-o", "certificate.json")
    assert code == 0
    assert "safe on all axes" in out
    kept = gmwm.load(tmp_path / "certificate.json")
    assert max(each.nees for each in kept.of("motion")) == pytest.approx(1.0, abs=1e-3)
    code, _, error = run("certify", *flags[:4], tmp_path / "bench.json", "--motion", "bench.json")
    assert (code, error.partition(":")[0]) == (2, "gmwm")
    assert "bench.json: this is not a motion: give a file that was saved from one" in error


@pytest.mark.parametrize("K", [1e-9, 1e-3])
def test_numbers_that_suffice_in_motion_suffice_on_the_bench(K):
    """Also where the walk at rest is above that of a flight; judged are axes that it shows."""
    found = in_motion([allan(QuantizationNoise(1e-3))])
    shown = replace(found, curves=tuple(c for c in found.curves if c.quantity == "gyro"))
    bench = {name: WhiteNoise(1e-4) + RandomWalk(K) for name in AXES}

    def judged(numbers):
        return gmwm.certify(bench, numbers, outages=(60.0,), rate=1.0 / DT, motion=shown)

    first = judged({kind: (1e-5, 1e-10) for kind in KINDS})
    assert {each.where for each in first.of("motion")} == set(AXES[:3])
    text = " ".join(first.text().split())
    assert "take the row 'in motion' and the row 'error model'" in text
    rows = {each.quantity: (each.N, each.K) for each in first.causes if each.name != "in use"}
    assert max(each.nees for each in judged(rows).checks) == pytest.approx(1.0, abs=0.05)


def test_motion_of_other_axes_is_rejected():
    found = in_motion([allan(WhiteNoise(1e-3))])
    with pytest.raises(gmwm.InputError, match="the motion has only gyro_x, gyro_y, gyro_z, acc"):
        gmwm.certify(WhiteNoise(1e-4) + RandomWalk(1e-5), (1e-4, 1e-5), motion=found)


def test_export_writes_the_numbers():
    truth = QuantizationNoise(2e-3) + WhiteNoise(1e-3)
    found = in_motion([allan(truth), 4.0 * allan(truth)])
    numbers = found.numbers(0.1, 2.0)
    text = gmwm.export(found, "kalibr", horizon=2.0)
    assert f"gyroscope_noise_density: {numbers['gyro_x'].params['N']:.6e}" in text
    assert "N+K for outages up to 2 s, motion" in text
    by_axis = gmwm.export(found, "gtsam")
    # White noise is at most as large as the numbers say, at the horizon it has a NEES below 1.
    assert "NEES at 1 s: gyro 0." in by_axis
    with pytest.raises(gmwm.InputError, match="these flights show"):
        gmwm.export(found, "kalibr", horizon=60.0)


def test_exports_are_for_the_interval_of_the_updates(run, tmp_path):
    """Bounded angles at 1 s need an N that is less by the root of ten than at 0.1 s."""
    found = in_motion([allan(QuantizationNoise(1e-3))])
    found.save(tmp_path / "motion.json")
    densities = []
    for given in ({}, {"interval": 1.0, "horizon": 2.0}):
        flags = [part for name, value in given.items() for part in (f"--{name}", value)]
        code, out, error = run("export", tmp_path / "motion.json", "--to", "kalibr", *flags)
        assert (code, error) == (0, "")
        assert f"updates every {given.get('interval', 0.1):g} s" in out
        assert out == gmwm.export(found, "kalibr", **given)
        densities.append(float(re.search(r"gyroscope_noise_density: (\S+)", out)[1]))
        assert "gyro_x" in gmwm.export(found, "state-space", **given)
    assert densities[0] / densities[1] == pytest.approx(np.sqrt(10.0), rel=0.02)
    with pytest.raises(gmwm.InputError, match="applies to noise in motion only"):
        gmwm.export([], "kalibr", interval=1.0)


def test_page_shows_curves_factors_and_numbers(tmp_path):
    rest = allan(WhiteNoise(1e-4))
    found = in_motion([allan(QuantizationNoise(1e-3) + WhiteNoise(1e-3))] * 3, rest)
    shown = replace(found, curves=tuple(c for c in found.curves if c.quantity == "gyro"))
    page = shown.report(tmp_path / "motion.html").read_text()
    # Of each axis, and the factor and coherence of the sensor; vibration is not known.
    assert page.count("<svg") == 5
    N = found.numbers()["gyro_x"].params["N"]
    assert f"{N:.2e} SI" in page
    assert "at rest" in page
    assert "default-src" in page
