"""Steps, transients and slow periods: found, with their sizes, and not in noise."""

import itertools
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.stats import binom

import gmwm
from gmwm import BiasInstability, GaussMarkov, RandomWalk, RateRamp, Recording, WhiteNoise
from gmwm.calibration import departures
from gmwm.cli.options import with_option
from marks import every, slow

DT = 1.0
N = 7200
TIME = DT * np.arange(N)
SAMPLE = 1e-3  # standard deviation of a sample of the white noise at 100 Hz
WHITE = WhiteNoise(1e-4)
WALK = WHITE + RandomWalk(2e-6)
STEP = np.asarray(TIME >= 4300.0, dtype=float)


def fitted(x, model=None):
    return gmwm.fit(model or WhiteNoise() + RandomWalk(), x, DT)


def noise(seed, model=WALK):
    return gmwm.simulate(model, N, DT, seed)


def recording(x, rate=1.0 / DT):
    return Recording.from_arrays({"gyro_x": x}, rate, {"gyro": "rad/s"}, source="bench.csv")


@pytest.mark.parametrize("seed", [1, 2, slow(3)])
def test_a_settling_slower_than_a_third_of_the_record_is_found(seed):
    """It was a valid random walk, or a drift that ends."""
    time = np.arange(1800.0)
    x = np.random.default_rng([91001, seed]).standard_normal(1800) + 3.0 * np.exp(-time / 1200.0)
    (found,) = departures(fitted(1e-4 * x))
    assert found.kind == "transient"
    assert found.time[1] <= 1200.0 <= found.time[2]


@pytest.mark.parametrize(("size", "seed"), [(0.5, 1), slow(-1.0, 2), (-1.0, 1), (3.0, 3)])
def test_a_step_is_found_with_its_size(size, seed):
    # It passes for a random walk: no test of the wavelet variances fails.
    fit = fitted(noise(seed) + size * SAMPLE * STEP)
    (found,) = departures(fit)
    assert found.kind == "step"
    assert found.time[1] <= 4300.0 <= found.time[2]
    assert found.time[2] - found.time[1] < 200.0
    # 95 % intervals, widened to one in a thousand: 1.7 half widths.
    value, low, high = found.size
    assert abs(value - size * SAMPLE) < 1.7 * 0.5 * (high - low)
    assert high - low < 0.6 * SAMPLE


@pytest.mark.parametrize(
    ("kind", "curve", "time"),
    [
        ("transient", np.exp(-TIME / 600.0), 600.0),
        ("drift-at-start", np.maximum(1.0 - TIME / 900.0, 0.0), 900.0),
        ("slow-period", np.sin(2.0 * np.pi * TIME / 1500.0 + 1.0), 1500.0),
        slow("slow-period", np.sin(2.0 * np.pi * TIME / 1500.0), 1500.0),
        ("slow-period", np.sin(3.0 * np.pi * TIME / TIME[-1]), TIME[-1] / 1.5),
    ],
)
def test_other_departures_are_found(kind, curve, time):
    fit = fitted(noise(1) + SAMPLE * curve)
    found = departures(fit)[0]
    assert found.kind == kind
    assert found.time[1] < time < found.time[2] or abs(found.time[0] / time - 1.0) < 0.15
    value, low, high = found.size
    assert value == pytest.approx(SAMPLE, rel=0.2)
    assert abs(value - SAMPLE) < 1.7 * 0.5 * (high - low)
    assert value == pytest.approx(0.5 * (low + high))
    assert found.share > 0.5


STATIONARY = {
    "N": WHITE,
    "N+K": WALK,
    "N+10K": WHITE + RandomWalk(2e-5),
    "N+GM of 60 s": WHITE + GaussMarkov(3e-5, 60.0),
    "N+GM of 1000 s": WHITE + GaussMarkov(3e-5, 1000.0),
    "N+2GM": WHITE + GaussMarkov(3e-5, 20.0) + GaussMarkov(4e-5, 1500.0),
    "N+B": WHITE + BiasInstability(1.5e-5),
    "B": WhiteNoise(1e-5) + BiasInstability(5e-5),
}


@pytest.mark.parametrize("model", every(2, STATIONARY.values()), ids=STATIONARY)
def test_stationary_noise_has_departures_in_one_of_a_hundred_records_at_most(model):
    """And a fit is not valid for one in one of 200 records (`python benchmarks/departures.py`)."""
    runs = 4
    free = fitted(noise(0), WhiteNoise() + RandomWalk())
    records = [noise(100 + seed, model) for seed in range(runs)]
    found = [x for x in records if departures(free, gmwm.wavelet_variance(x, dt=DT))]
    assert len(found) <= binom.isf(1e-3, runs, 0.01)
    fits = [gmwm.calibrate(recording(x), screening=())["gyro_x"] for x in found]
    assert sum("stationary" in fit.reasons for fit in fits) <= binom.isf(0.01, runs, 0.005)


@pytest.mark.parametrize(("size", "is_valid"), [(0.11, True), (0.13, False)])
def test_a_fit_is_not_valid_from_an_evidence_of_1000_on(size, is_valid):
    """Of healthy records one in 740 has as much; a step has to be 10 % larger than for 100."""
    x = noise(21) + size * SAMPLE * STEP
    fit = gmwm.calibrate(recording(x), WhiteNoise() + RandomWalk(), screening=())["gyro_x"]
    (step,) = [each for each in fit.notices if each.code == "step"]
    assert step.values["share"] > 0.5
    assert ("stationary" not in fit.reasons) is is_valid is (step.severity == "warning")
    assert (100.0 < step.values["evidence"] < 1000.0) is is_valid


@pytest.mark.parametrize(
    ("curve", "size"),
    [
        (STEP, 0.07),
        (np.exp(-TIME / 600.0), 0.15),
        slow(np.maximum(1.0 - TIME / 900.0, 0.0), 0.12),
        (np.sin(2.0 * np.pi * TIME / 1500.0 + 1.0), 0.03),
        slow(np.sin(3.0 * np.pi * TIME / TIME[-1]), 0.06),
        slow(np.sin(np.pi * TIME / TIME[-1]), 0.12),
    ],
    ids=["step", "transient", "drift", "period", "1.5 periods", "half a period"],
)
def test_sizes_of_the_study_are_found_in_white_noise(curve, size):
    """`python benchmarks/departures.py power` finds them in 95 % of the records."""
    for seed in range(2):
        assert departures(fitted(noise(seed, WHITE) + size * SAMPLE * curve))


def test_a_step_of_a_tenth_of_a_sample_deviation_in_an_hour_at_100_hz():
    x = np.random.default_rng(3).normal(size=360_000)
    x[200_000:] += 0.1
    (found,) = departures(gmwm.fit(WhiteNoise() + RandomWalk(), x, 0.01))
    assert found.kind == "step"
    assert found.time[0] == pytest.approx(2000.0, abs=60.0)
    assert found.size[0] == pytest.approx(0.1, rel=0.2)


def test_a_walk_that_is_seen_once_is_no_departure():
    # Beside so little white noise the walk makes all levels, and any of its moves looks like much.
    walks = [departures(fitted(noise(seed, RandomWalk(1e-4)), RandomWalk())) for seed in range(4)]
    assert not any(walks)


def test_size_and_sign_follow_the_data_and_time_is_reversed_with_it():
    x = noise(4) + SAMPLE * STEP
    (found,) = departures(fitted(x))
    (scaled,) = departures(fitted(-3e4 * x + 7.0))
    assert scaled.size[0] == pytest.approx(-3e4 * found.size[0], rel=1e-3)
    assert np.log(scaled.evidence) == pytest.approx(np.log(found.evidence), rel=1e-2)
    (reversed_,) = departures(fitted(x[::-1]))
    assert reversed_.size[0] == pytest.approx(-found.size[0], rel=0.05)
    assert reversed_.time[0] == pytest.approx(N * DT - found.time[0], abs=60.0)


def test_several_are_found_beside_each_other():
    x = noise(5) + SAMPLE * STEP - 1.5 * SAMPLE * (TIME > 1500.0)
    found = departures(fitted(x))
    assert [one.kind for one in found] == ["step", "step"]
    assert sorted(one.time[0] for one in found) == pytest.approx([1500.0, 4300.0], abs=60.0)


def test_shares_of_steps_as_far_from_either_end_are_as_the_squares_of_their_sizes():
    level = np.searchsorted([2880.0, 4320.0], TIME, side="right")
    first, second = departures(fitted(noise(5, WHITE) + SAMPLE * level))
    assert first.time[0] + second.time[0] == pytest.approx(N * DT, abs=20.0)
    ratio = (first.size[0] / second.size[0]) ** 2
    assert first.share / second.share == pytest.approx(ratio, rel=0.02)


def test_a_step_beside_a_ramp_of_the_model():
    x = noise(6) + 2e-6 * TIME
    model = WhiteNoise() + RandomWalk() + RateRamp()
    assert departures(fitted(x, model)) == ()
    (found,) = departures(fitted(x + 2.0 * SAMPLE * STEP, model))
    assert found.kind == "step"
    assert found.size[0] == pytest.approx(2.0 * SAMPLE, rel=0.2)


def test_a_drift_of_the_whole_record_is_no_transient():
    # It has a test of its own when a model is selected.
    found = departures(fitted(noise(7) + 2e-6 * TIME))
    assert found == ()


def test_gaps_do_not_hide_a_step():
    x = noise(8) + 2.0 * SAMPLE * STEP
    x[2000:2400] = np.nan
    x[np.random.default_rng(1).random(N) < 0.005] = np.nan
    found = departures(fitted(x))[0]
    assert found.kind == "step"
    assert found.time[1] - 60.0 <= 4300.0 <= found.time[2] + 60.0


def test_a_step_beside_a_record_that_begins_with_a_gap():
    # Steps before its first block have no differences: their singular values did not converge.
    x = noise(8) + 4.0 * SAMPLE * (TIME > 680.0)
    x[:640] = np.nan
    (found,) = departures(fitted(x))
    assert found.kind == "step"
    assert found.time[1] <= 680.0 <= found.time[2]


def test_too_short_a_record_has_none():
    x = noise(9)[:12]
    assert departures(fitted(x, WhiteNoise())) == ()


# -- in a calibration -----------------------------------------------------------------------------


def test_a_calibration_reports_it_by_the_channel_and_it_can_be_taken_off(tmp_path):
    rec = recording(noise(10) + SAMPLE * STEP)
    found = gmwm.calibrate(rec)
    fit = found["gyro_x"]
    assert not fit.valid
    assert not found.valid
    assert "stationary" in fit.reasons
    (notice,) = [one for one in fit.notices if one.code == "step"]
    assert notice.severity == "bad"
    assert notice.values["lower"] < SAMPLE < notice.values["upper"]
    assert notice.values["time"] == pytest.approx(4300.0, abs=30.0)
    assert notice.values["evidence"] > 100.0
    assert "remove_departures" in notice.hint
    assert "--remove-departures" in with_option(notice).hint
    again = gmwm.load(found.save(tmp_path / "cal.json"))
    assert again["gyro_x"].notices == fit.notices
    clean = gmwm.without_departures(rec, again)
    assert 0 < clean["gyro_x"].missing < 0.05 * N
    # What can be derived may be absent, as in files of before.
    derived = {"evident", "removable"}
    kept = tuple(
        replace(each, values={k: v for k, v in each.values.items() if k not in derived})
        for each in fit.notices
    )
    same = gmwm.without_departures(rec, {"gyro_x": replace(fit, notices=kept)})
    np.testing.assert_array_equal(same["gyro_x"].values, clean["gyro_x"].values)
    better = gmwm.calibrate(clean)["gyro_x"]
    assert better.valid
    assert "stationary" not in better.reasons
    low, high = better.interval(0.99)["K"]
    assert low < 2e-6 < high


def test_a_calibration_takes_it_off_on_request_and_reports_that():
    rec = recording(noise(10) + SAMPLE * STEP)
    model = WhiteNoise() + RandomWalk()
    assert not gmwm.calibrate(rec, model)["gyro_x"].valid
    fit = gmwm.calibrate(rec, model, remove_departures=True)["gyro_x"]
    (notice,) = [one for one in fit.notices if one.code == "step"]
    assert (notice.severity, notice.hint, notice.values["removed"]) == ("note", "subtracted", True)
    assert fit.valid, fit.message
    low, high = fit.interval(0.99)["K"]
    assert low < 2e-6 < high


def test_of_several_recordings_it_is_named_which():
    first, second = recording(noise(13)), recording(noise(14) + SAMPLE * STEP)
    both = [Recording(first.channels, "a.csv"), Recording(second.channels, "b.csv")]
    fit = gmwm.calibrate(both, WhiteNoise() + RandomWalk())["gyro_x"]
    (notice,) = [one for one in fit.notices if one.code == "step"]
    assert notice.source == "b.csv"


def test_several_steps_have_one_remedy_for_the_whole_recording():
    """Each had its own cuts, and nothing named the part that is without any."""
    late = np.where(0.9 * TIME[-1] < TIME, 1.0, 0.0)
    channels = {"gyro_x": noise(16) + SAMPLE * STEP, "gyro_y": noise(17) + 2.0 * SAMPLE * late}
    found = gmwm.calibrate(
        Recording.from_arrays(channels, 1.0 / DT, {"gyro": "rad/s"}), WhiteNoise() + RandomWalk()
    )
    (advice,) = [one for one in found.notices if one.code == "longest-part"]
    steps = [n for fit in found.values() for n in fit.notices if n.code == "step"]
    edges = sorted((n.values["time_lower"], n.values["time_upper"]) for n in steps)
    kept = max(
        (b[0] - a[1], a[1], b[0]) for a, b in pairwise([(0, 0.0), *edges, (found.duration, 0)])
    )
    assert (advice.values["start"], advice.values["stop"]) == pytest.approx(kept[1:])
    assert {n.hint for n in steps} == {"subtract all of them (remove_departures=True)"}
    hint = with_option(advice).hint
    assert f"--start {np.ceil(kept[1]):g}" in hint or f"--stop {np.floor(kept[2]):g}" in hint
    assert with_option(steps[0]).hint == "rerun with --remove-departures"


def test_a_recording_of_another_kind_is_refused():
    rec = recording(noise(15) + SAMPLE * STEP)
    fits = gmwm.calibrate(rec, WhiteNoise() + RandomWalk())
    with pytest.raises(gmwm.InputError, match="give the recording that was calibrated"):
        gmwm.without_departures(recording(np.zeros(100) + np.arange(100.0)), fits)


def test_a_pulse_is_two_steps_of_one_size_and_both_are_removed():
    n, dt = 36_000, 0.1
    place = np.arange(n)
    x = WhiteNoise(1e-4).simulate(n, dt, seed=0) + 3e-4 * ((place > 18_000) & (place < 19_000))
    rec = gmwm.Recording.from_arrays({"gyro_x": x}, 1.0 / dt, {"gyro": "rad/s"})
    fit = gmwm.calibrate(rec, WhiteNoise(), screening=(), remove_departures=True)["gyro_x"]
    gone = [notice.values for notice in fit.notices if notice.code == "step"]
    assert [each["removed"] for each in gone] == [True, True]
    assert sorted(each["size"] for each in gone) == pytest.approx([-3e-4, 3e-4], abs=3e-5)
    assert fit.valid
    assert fit.params["N"] == pytest.approx(1e-4, rel=0.02)


def test_a_pulse_of_two_sizes_keeps_them():
    x = noise(20, WHITE) + 0.4 * SAMPLE * ((TIME > 2000.0) - 0.6 * (TIME > 4000.0))
    up, down = sorted(departures(fitted(x)), key=lambda each: each.time[0])
    assert up.size[0] == pytest.approx(0.4 * SAMPLE, rel=0.03)
    assert down.size[0] == pytest.approx(-0.24 * SAMPLE, rel=0.03)


def test_what_was_taken_off_is_what_the_model_lacks():
    # One step of a telegraph bias looks like an accident, and is no less of its error.
    rec = recording(noise(10, WHITE) + 0.4 * SAMPLE * STEP)
    fit = gmwm.calibrate(rec, WhiteNoise(), remove_departures=True)["gyro_x"]
    (notice,) = [one for one in fit.notices if one.code == "departures-removed"]
    assert notice.severity == "warning"
    tau, ratio = notice.values["tau"], notice.values["ratio"]
    assert tau > 1000.0 and ratio > 5.0
    assert fit.valid


@pytest.mark.parametrize("seed", [0, slow(1), slow(2)])
def test_how_many_times_a_step_enlarges_the_deviation_is_judged_by_the_model(seed):
    """The coarsest level of the rest has one degree of freedom: its ratios are 12 to 20."""
    x = noise(seed, WHITE) + 0.1 * SAMPLE * STEP
    fit = gmwm.calibrate(recording(x), WhiteNoise(), remove_departures=True)["gyro_x"]
    (notice,) = [one for one in fit.notices if one.code == "departures-removed"]
    tau = np.array([notice.values["tau"]])
    step = (0.1 * SAMPLE) ** 2 * tau / (6.0 * (N * DT - 2.0 * tau))
    expected = np.sqrt(1.0 + step / fit.model.haar_variance(tau, DT))
    assert notice.values["ratio"] == pytest.approx(expected[0], rel=0.12)


def test_the_noise_that_an_estimated_step_takes_is_given_back():
    """Without that, the coarsest levels of white noise come out too small."""
    ratios = []
    for seed in range(6):
        x = noise(500 + seed, WHITE) + SAMPLE * (TIME > 2000.0) - SAMPLE * (TIME > 5000.0)
        fit = gmwm.calibrate(recording(x), WhiteNoise(), screening=(), remove_departures=True)
        wv = fit["gyro_x"].wv
        ratios.append(wv.variance[8:] / WHITE.haar_variance(wv.tau[8:], DT))
    spread = np.std(ratios, axis=0) / np.sqrt(len(ratios))
    assert np.all(np.abs(np.mean(ratios, axis=0) - 1.0) < 3.5 * spread)


def test_a_level_that_changes_five_times_is_noise_of_the_sensor():
    x = noise(20, WHITE) + SAMPLE * (np.searchsorted(np.arange(1, 6) * 1200.0, TIME) % 2)
    fit = gmwm.calibrate(recording(x), WhiteNoise(), remove_departures=True)["gyro_x"]
    (notice,) = [one for one in fit.notices if one.code == "departures-many"]
    assert notice.values["removed"] >= 5
    assert "stationary" in fit.reasons


def test_a_tenth_of_the_deviation_makes_a_fit_invalid():
    sizes = (0.05, 3.0)
    model = WhiteNoise() + GaussMarkov()
    for size, seed in itertools.product(sizes, (21, 22)):
        x = noise(seed, WHITE + GaussMarkov(1e-4, 30.0)) + size * SAMPLE * np.exp(-TIME / 600.0)
        fit = gmwm.calibrate(recording(x), model, screening=())["gyro_x"]
        for notice in (each for each in fit.notices if each.code == "transient"):
            is_sure = notice.values["evidence"] >= 1000.0
            assert (notice.severity == "bad") is (is_sure and notice.values["share"] > 0.19)
            assert ("stationary" in fit.reasons) is (notice.severity == "bad")
