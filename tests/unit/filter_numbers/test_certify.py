"""Certificates: true errors beside believed ones, and what makes numbers larger."""

import math

import numpy as np
import pytest

import gmwm
from error_models import DT, TRUTHS
from gmwm import GaussMarkov, Imperfections, InputError, Motion, RandomWalk, WhiteNoise
from gmwm.ins import SensorModels, car_drive, covariance_analysis, loiter_with_outages

ONE = TRUTHS["one"]
SENSOR = {
    f"{kind}_{axis}": model
    for kind, model in (
        ("gyro", WhiteNoise(1e-4) + GaussMarkov(5e-5, 60.0)),
        ("accel", WhiteNoise(1e-3) + GaussMarkov(2e-3, 30.0)),
    )
    for axis in "xyz"
}
SHEET = {"gyro": (1e-4, 1e-8), "accel": (1e-3, 1e-6)}


@pytest.fixture(scope="module")
def sheet():
    """Numbers of a data sheet, with no word of the slow terms."""
    return gmwm.certify(SENSOR, SHEET, dt=0.1)


def factors(certificate, quantity):
    return {
        cause.name: (cause.N_factor, cause.K_factor)
        for cause in certificate.causes
        if cause.quantity == quantity
    }


def test_a_data_sheet_is_too_optimistic_for_every_consumer(sheet):
    assert {check.consumer for check in sheet.checks} == {"free", "outage", "keyframes"}
    # Between keyframes of a second the slow error of a gyro is as good as constant.
    assert all(check.nees > 0.99 for check in sheet.checks)
    for check in sheet.of("outage"):
        assert check.nees > 2.0
        assert check.true > 1.15 * check.believed
    assert sheet.worst.nees == max(check.nees for check in sheet.checks)


def test_numbers_of_a_heading_that_are_too_small_are_not_hidden_by_its_start():
    truth = {"gyro_z": WhiteNoise(1e-4) + RandomWalk(1e-7)}
    small, right = (gmwm.certify(truth, {"gyro": (N, 1e-7)}).of("free") for N in (1e-5, 1e-4))
    assert all(each.nees > 20.0 for each in small)
    assert all(each.nees == pytest.approx(1.0) for each in right)


def test_its_errors_are_those_of_a_covariance_analysis(sheet):
    scenario = loiter_with_outages((10.0, 60.0), 0.1)
    believed = SensorModels.of(sheet.numbers)
    analysis = covariance_analysis(scenario, SensorModels.of(SENSOR), believed)
    for check, outage in zip(sheet.of("outage"), scenario.outages, strict=True):
        at = analysis.index(outage.end)
        assert check.time == outage.duration
        assert check.true == pytest.approx(np.hypot(*analysis.sd[at, :2]))
        assert check.believed == pytest.approx(np.hypot(*analysis.predicted_sd[at, :2]))
        assert check.nees == pytest.approx(analysis.nees()[at])


def test_numbers_in_other_units_are_named():
    degrees = {"gyro": (np.degrees(1e-4), np.degrees(1e-6)), "accel": (2e-3, 1e-4)}
    models = {"gyro_x": ONE, "accel_x": WhiteNoise(1e-3) + GaussMarkov(2e-3, 30.0)}
    found = [n for n in gmwm.certify(models, degrees, dt=0.1).notices if n.code == "other-units"]
    assert [n.where for n in found] == ["gyro"]
    assert 40.0 < found[0].values["factor"] < 80.0
    assert "rad/s/sqrt(Hz)" in str(found[0])


def test_the_numbers_that_it_recommends_pass(sheet):
    again = gmwm.certify(SENSOR, sheet.recommended, dt=0.1)
    for check in again.checks:
        assert check.nees < 1.001
        assert check.true < 1.001 * check.believed
        assert check.believed < 1.6 * check.true
    causes = factors(again, "gyro")
    assert causes["error model"] == pytest.approx((1.0, 1.0), rel=1e-3)


def test_the_truth_passes_exactly():
    walks = {name: WhiteNoise(1e-3) + RandomWalk(1e-5) for name in ("gyro_x", "gyro_z", "accel_x")}
    found = gmwm.certify(walks, walks, bias_sd=1e-3)
    for check in found.checks:
        assert check.nees == pytest.approx(1.0, abs=1e-4)
        assert check.true == pytest.approx(check.believed, rel=1e-4)


def test_relative_poses_are_those_of_a_simulated_filter():
    """300 runs: rotation between keyframes, the bias estimated from the ones before."""
    truth, (N, K), sd = WhiteNoise(1e-3) + GaussMarkov(4e-3, 15.0), (1.2e-3, 3e-4), 5e-3
    chain = gmwm.filter_numbers.Chain(1, 2e-3, 40.0, 1.0, is_relative=True)
    found = chain.errors(truth, WhiteNoise(N) + RandomWalk(K), 0.1, (1.0,), believed_sd=sd)
    rng, runs, per = np.random.default_rng(8), 300, 10
    errors = np.array([truth.simulate(41 * per, 0.1, rng) for _ in range(runs)])
    turned = errors.reshape(runs, 41, per).sum(axis=2) * 0.1
    b, P = np.zeros(runs), np.array([[1e-4, 0.0], [0.0, sd**2]])
    angle = 0.01 * rng.standard_normal(runs)
    step, noise = np.array([[1.0, 0.1], [0.0, 1.0]]), np.diag([N**2 * 0.1, K**2 * 0.1])
    for k in range(41):
        angle = angle + turned[:, k] - b
        for _ in range(per):
            P = step @ P @ step.T + noise
        if k == 40:
            break
        gain = P[:, 0] / (P[0, 0] + 4e-6)
        b += gain[1] * (angle + 2e-3 * rng.standard_normal(runs))
        P -= np.outer(gain, P[0])
        P[0], P[:, 0], angle = 0.0, 0.0, 0.0
    assert found.predicted[0, 0, 0] == pytest.approx(P[0, 0], rel=1e-6)
    assert np.mean(angle**2) == pytest.approx(found.actual[0, 0, 0], rel=4.0 * np.sqrt(2.0 / runs))


def test_causes_multiply_the_numbers(sheet):
    gyro = factors(sheet, "gyro")
    assert list(gyro) == ["in use", "error model"]
    assert gyro["error model"][1] > 100.0
    found = gmwm.certify(
        SENSOR, SHEET, dt=0.1, motion="drone",
        imperfections=Imperfections(
            scale_error=0.01, misalignment=0.005, g_sensitivity=1e-4, time_offset=0.005,
            vibration_rectification=1e-3, vibration=5.0,
        ),
    )  # fmt: skip
    names = ["scale error", "misalignment", "g-sensitivity", "time offset"]
    assert list(factors(found, "gyro"))[2:] == [*names, "all together"]
    assert list(factors(found, "accel"))[2:] == [
        "scale error", "misalignment", "time offset", "vibration rectification", "all together",
    ]  # fmt: skip
    for quantity in ("gyro", "accel"):
        causes = [cause for cause in found.causes if cause.quantity == quantity]
        assert max(cause.N for cause in causes) == causes[-1].N
        assert all(cause.N >= causes[1].N * 0.999 for cause in causes[2:])
    codes = {notice.where for notice in found.notices if notice.code == "estimate-it"}
    assert codes == {"gyro", "accel"}


def test_numbers_for_a_time_offset_say_that_its_error_does_not_grow():
    motion, late = Motion(0.4, 1.5, 0.2), Imperfections(time_offset=0.005)
    found = gmwm.certify({"gyro_x": WhiteNoise(1e-4)}, {"gyro_x": (1e-4, 1e-6)}, outages=(30.0,),
                         imperfections=late, motion=motion)  # fmt: skip
    (notice,) = (n for n in found.notices if n.code == "bounded-error")
    # The angle is that of the motion at two times; between 150 intervals of 30 s of six motions.
    rate = [GaussMarkov(0.4, 0.2).simulate(450_000, 0.01, seed) for seed in range(6)]
    gained = 0.005 * np.concatenate([np.diff(each[::3000]) for each in rate])
    white = late.terms("gyro", motion)["time offset"].N
    assert white * np.sqrt(30.0) / np.std(gained) == pytest.approx(notice.values["factor"], rel=0.1)


def test_keyframes_may_be_farther_apart_than_the_longest_outage_lasts():
    found = gmwm.certify({"gyro_x": ONE}, (1e-4, 1e-6), outages=(10.0,), keyframe=30.0)
    assert "1 sigma after 10 s" in str(found)


def test_the_uncertainty_of_a_fit_is_a_cause():
    fit = gmwm.fit(WhiteNoise() + GaussMarkov(), ONE.simulate(3600, 1.0, 5), 1.0)
    found = gmwm.certify(fit, (8e-5, 1e-7), keyframe=2.0)
    names = factors(found, "")
    assert names["error model, to 95 %"][1] > 1.05
    assert found.of("outage") == ()
    assert [notice.code for notice in found.notices] == ["no-navigation-filter"]


def test_what_the_navigation_filter_cannot_hold_is_left_out_with_a_notice():
    models = SENSOR | {"gyro_x": WhiteNoise(1e-4) + gmwm.BiasInstability(3e-5)}
    found = gmwm.certify(models, SHEET, dt=0.1)
    assert found.of("outage") == ()
    assert len(found.of("free")) == 12
    assert [notice.code for notice in found.notices] == ["no-navigation-filter"]


def test_the_verdict_follows_the_numbers():
    models = {name: model for name, model in SENSOR.items()}
    safe = gmwm.bound(models, "N+K", horizon=60.0, shared=True, dt=0.1)
    large = {kind: (10.0 * one.N, 10.0 * one.K) for kind, one in
             (("gyro", safe["gyro_x"]), ("accel", safe["accel_x"]))}  # fmt: skip
    kept, loose = (
        " ".join(str(gmwm.certify(models, given, dt=0.1)).split()) for given in (safe, large)
    )
    assert "safe on all axes" in kept and "- keep the numbers" in kept
    assert "safe on all axes" in loose and "less than half of those in use, and as safe" in loose


# ---- Motion ----


def test_motion_of_a_recording():
    rng = np.random.default_rng(2)
    rate, accel = GaussMarkov(0.5, 0.4), GaussMarkov(2.0, 0.4)
    recording = gmwm.Recording.from_arrays(
        {
            "gyro_x": rate.simulate(60_000, DT, rng) + 0.1,
            "gyro_y": rate.simulate(60_000, DT, rng),
            "accel_z": accel.simulate(60_000, DT, rng) + 9.8,
        },
        100.0,
        {"gyro": "rad/s", "accel": "m/s^2"},
    )
    motion = Motion.of(recording)
    # 600 s have 750 independent values.
    assert motion.rate == pytest.approx(0.5, rel=0.15)
    assert motion.accel == pytest.approx(2.0, rel=0.15)
    assert motion.memory == pytest.approx(0.4, rel=0.3)
    assert Motion.of(motion) is motion
    with pytest.raises(InputError, match="no accel channel"):
        Motion.of(gmwm.Recording.from_arrays({"gyro_x": np.ones(9)}, 1.0, {"gyro": "rad/s"}))


def test_terms_of_imperfections():
    motion = Motion(0.5, 2.0, 0.2)
    terms = Imperfections(0.01, 0.002, 1e-4, 0.003).terms("gyro", motion)
    assert terms["scale error"] == GaussMarkov(0.005, 0.2)
    assert terms["misalignment"].sigma == pytest.approx(math.sqrt(2.0) * 0.001)
    assert terms["g-sensitivity"].sigma == pytest.approx(2e-4)
    f = np.geomspace(1e-3, 40.0, 50)
    moved = GaussMarkov(0.5, 0.2).psd(f, 1e-4) * (2.0 * np.pi * f * 0.003) ** 2
    assert np.all(moved < terms["time offset"].psd(f, 1e-4))
    assert moved[-1] == pytest.approx(terms["time offset"].psd(f, 1e-4)[-1], rel=0.01)
    assert Imperfections(0.01).terms("accel", motion)["scale error"].sigma == pytest.approx(0.02)
    vibrating = Imperfections(vibration_rectification=1e-3, vibration=4.0)
    assert vibrating.terms("gyro", None) == {}
    assert vibrating.terms("accel", None)["vibration rectification"].sigma == pytest.approx(0.016)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"outages": ()}, "outages is empty: give at least one"),
        ({"outages": (0.0,)}, "outages = 0.0"),
        ({"keyframe": 0.01}, "two sampling intervals"),
        ({"motion": "boat"}, "motion 'boat' is not known: write handheld, drone, car, fixed-wing"),
        ({"imperfections": Imperfections(scale_error=0.01)}, "have no effect at rest"),
        ({"source": gmwm.QuantizationNoise(1e-3)}, "no term that white noise"),
    ],
)
def test_what_cannot_be_used(options, message):
    with pytest.raises(InputError, match=message):
        gmwm.certify(**({"source": ONE, "numbers": (1e-4, 1e-6)} | options))
    with pytest.raises(InputError, match=r"scale_error = -0\.1"):
        Imperfections(scale_error=-0.1)


# ---- Numbers in use ----


def test_numbers_by_axis_or_kind():
    truth = {"gyro_x": WhiteNoise(1e-4) + RandomWalk(1e-6), "gyro_z": WhiteNoise(1e-4)}
    given = {"gyro": (1e-4, 1e-6), "gyro_x": (2e-4, 2e-6)}
    found = gmwm.certify(truth, given, outages=(60.0,)).numbers
    one = found["gyro_x"]
    assert (one.form, one.N, one.K, one.horizon) == ("N+K", 2e-4, 2e-6, 60.0)
    assert (one.method, found["gyro_z"].N) == ("given", 1e-4)
    model = WhiteNoise(1e-4) + RandomWalk(1e-6) + GaussMarkov(1e-5, 10.0)
    assert gmwm.certify(ONE, {"": model}).numbers[""].form == "N+K+GM"
    assert gmwm.certify(truth, found, outages=(10.0,)).numbers["gyro_x"] is one


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"accel": (1e-4, 1e-6)}, "no numbers for gyro_x: give them by axis, or for gyro"),
        ({"gyro": (1e-4, -1e-6)}, "N and K of gyro_x = -1e-06"),
        ({"gyro": 1e-4}, "gives no filter numbers"),
        ({"gyro": WhiteNoise(1e-4) + gmwm.QuantizationNoise(1e-4)}, "form = 'N'"),
    ],
)
def test_numbers_that_cannot_be_used(given, message):
    with pytest.raises(InputError, match=message):
        gmwm.certify({"gyro_x": ONE}, given)


@pytest.mark.parametrize("aiding", ["pose", "odometry", "wheels"])
def test_the_truth_passes_with_any_aiding_and_a_data_sheet_does_not(aiding):
    (right,) = gmwm.certify(SENSOR, SENSOR, outages=(10.0,), aiding=aiding, dt=0.1).of(aiding)
    (wrong,) = gmwm.certify(SENSOR, SHEET, outages=(10.0,), aiding=aiding, dt=0.1).of(aiding)
    assert right.nees == pytest.approx(1.0, abs=1e-3)
    assert right.true == pytest.approx(right.believed, rel=1e-3)
    assert wrong.nees > 3.0


def test_a_reference_trajectory_takes_the_place_of_the_loiter():
    drive = car_drive(duration=150.0, dt=0.1)
    (own,) = gmwm.certify(SENSOR, SHEET, outages=(10.0,), reference=drive, dt=0.1).of("outage")
    scenario = loiter_with_outages((10.0,), 0.1, drive)
    believed = gmwm.certify(SENSOR, SHEET, outages=(10.0,), dt=0.1).numbers
    models = SensorModels.of(believed)
    analysis = covariance_analysis(scenario, SensorModels.of(SENSOR), models)
    assert own.nees == pytest.approx(analysis.nees()[analysis.index(scenario.outages[0].end)])
    short = drive.segment(0.0, 100.0)
    (left_out,) = gmwm.certify(SENSOR, SHEET, outages=(10.0,), reference=short, dt=0.1).notices
    assert left_out.code == "no-navigation-filter"
