"""Steps, transients and slow periods: found, with their sizes, and not in noise."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.stats import binom

import gmwm
from gmwm import GaussMarkov, InputError, RandomWalk, RateRamp, Recording, WhiteNoise
from gmwm.calibration import Departure, departures
from gmwm.calibration.stationarity.departure_notices import (
    _found_notices,
    _is_between_two_levels,
    _taken_notices,
    departure_notice,
)
from gmwm.calibration.stationarity.removal import variance_without
from gmwm.calibration.tuning import EVIDENT
from gmwm.cli.hints import with_option
from marks import slow

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


@pytest.mark.parametrize(("size", "seed"), [(0.5, 1), slow(-1.0, 2), (-1.0, 1), (3.0, 3)])
def test_a_step_is_found_with_its_size(size, seed):
    # It passes for a random walk: no test of the wavelet variances fails.
    fit = fitted(noise(seed) + size * SAMPLE * STEP)
    (found,) = departures(fit)
    assert found.kind == "step"
    assert found.is_evident
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
    assert found.is_evident
    assert found.time[1] < time < found.time[2] or abs(found.time[0] / time - 1.0) < 0.15
    value, low, high = found.size
    assert value == pytest.approx(SAMPLE, rel=0.2)
    assert abs(value - SAMPLE) < 1.7 * 0.5 * (high - low)
    assert value == pytest.approx(0.5 * (low + high))
    assert found.share > 0.5


@pytest.mark.parametrize(
    "model",
    [
        WALK,
        WHITE,
        slow(WHITE + RandomWalk(2e-5)),
        slow(WHITE + GaussMarkov(3e-5, 1000.0)),
        WHITE + GaussMarkov(3e-5, 20.0) + GaussMarkov(4e-5, 1500.0),
    ],
    ids=["N+K", "N", "N+10K", "N+GM", "N+2GM"],
)
def test_noise_has_none(model):
    runs = 3
    free = gmwm.process.as_model(model).opened()
    count = 0
    for seed in range(runs):
        count += any(one.is_evident for one in departures(fitted(noise(100 + seed, model), free)))
    assert count <= binom.isf(1e-4, runs, 1.0 / EVIDENT)


def test_a_walk_that_is_seen_once_is_no_departure():
    # Beside so little white noise the walk makes all levels, and any of its moves looks like much.
    walks = [departures(fitted(noise(seed, RandomWalk(1e-4)), RandomWalk())) for seed in range(4)]
    assert not any(one.is_evident for found in walks for one in found)


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
    assert not any(one.is_evident for one in found)


def test_gaps_do_not_hide_a_step():
    x = noise(8) + 2.0 * SAMPLE * STEP
    x[2000:2400] = np.nan
    x[np.random.default_rng(1).random(N) < 0.005] = np.nan
    (found,) = departures(fitted(x))
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
    assert not fit.reasons["stationary"]
    (notice,) = [one for one in fit.notices if one.code == "step"]
    assert notice.severity == "bad"
    assert notice.values["lower"] < SAMPLE < notice.values["upper"]
    assert notice.values["time"] == pytest.approx(4300.0, abs=30.0)
    assert notice.values["evidence"] > EVIDENT
    assert "remove_departures" in notice.hint
    assert "or --start" in with_option(notice).hint
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
    assert better.reasons["stationary"]
    low, high = better.interval(0.99)["K"]
    assert low < 2e-6 < high


def test_a_calibration_takes_it_off_on_request_and_reports_that():
    rec = recording(noise(10) + SAMPLE * STEP)
    model = WhiteNoise() + RandomWalk()
    assert not gmwm.calibrate(rec, model)["gyro_x"].valid
    fit = gmwm.calibrate(rec, model, remove_departures=True)["gyro_x"]
    (notice,) = [one for one in fit.notices if one.code == "step"]
    assert (notice.severity, notice.hint, notice.values["removed"]) == ("note", "taken off", True)
    assert fit.valid, fit.message
    low, high = fit.interval(0.99)["K"]
    assert low < 2e-6 < high


def test_what_stays_is_not_to_be_taken_off_again():
    rec = recording(noise(10) + SAMPLE * STEP)
    (there,) = departures(gmwm.calibrate(rec, WhiteNoise() + RandomWalk())["gyro_x"])
    before, after = (departure_notice(there, "rad/s", stays=stays) for stays in (False, True))
    assert "remove" in before.hint and before.values["removable"]
    assert not after.values["removable"]
    for notice in (after, with_option(after)):
        assert "remove" not in notice.hint and notice.hint.startswith("calibrate the part")
    assert "or --start" in with_option(after).hint
    unsure = departure_notice(replace(there, evidence=EVIDENT / 2.0), "rad/s")
    assert with_option(unsure).hint == unsure.hint == "a longer record can"


def test_the_noise_that_an_estimated_step_takes_is_given_back():
    # Generalized least squares under white noise is the difference of the means of both parts.
    n, runs = 256, 400
    unit = np.arange(n) > 100
    rng = np.random.default_rng(3)
    error = np.sqrt(1.0 / 101 + 1.0 / 155)
    ratios = []
    for _ in range(runs):
        x = rng.standard_normal(n)
        size = x[unit].mean() - x[~unit].mean()
        step = Departure("step", (100.5, 100.5, 100.5),
                         (size, size - 1.96 * error, size + 1.96 * error), 1e3, 0.5)  # fmt: skip
        channel = gmwm.Channel("gyro_x", x, 1.0, "gyro", "rad/s")
        ratios.append(variance_without(channel, [step]).variance)
    expected = WhiteNoise(1.0).haar_variance(2.0 ** np.arange(8), 1.0)
    spread = np.std(ratios, axis=0) / np.sqrt(runs)
    assert np.all(np.abs(np.mean(ratios, axis=0) - expected) < 4.0 * spread)


@pytest.mark.parametrize(
    ("evidence", "share", "severity"),
    [
        (101.0, 0.2, "bad"),
        (101.0, 0.18, "warning"),
        (99.0, 0.2, "warning"),
        (99.0, 0.18, "note"),
    ],
)
def test_what_makes_a_fit_invalid(evidence, share, severity):
    for kind in ("step", "transient", "drift-at-start", "slow-period"):
        found = Departure(kind, (900.0, 800.0, 1000.0), (0.1, 0.05, 0.15), evidence, share)
        notice = departure_notice(found, "rad/s")
        assert (notice.code, notice.severity) == (kind, severity)
        assert notice.values["share"] == share
        assert "+5.73 deg/s (+2.86 deg/s .. +8.59 deg/s)" in notice.text
        assert "900 s (800 .. 1000)" in notice.text


@pytest.mark.parametrize(
    "curve",
    [
        np.exp(-TIME / 600.0),
        np.maximum(1.0 - TIME / 900.0, 0.0),
        np.sin(2.0 * np.pi * TIME / 1500.0 + 1.0),
    ],
    ids=["transient", "drift-at-start", "slow-period"],
)
def test_what_is_taken_off_is_what_was_found(curve):
    rec = recording(noise(12) + 2.0 * SAMPLE * curve)
    fits = gmwm.calibrate(rec, WhiteNoise() + RandomWalk())
    left = gmwm.without_departures(rec, fits)["gyro_x"].values - noise(12)
    assert np.std(left) < 0.25 * np.std(2.0 * SAMPLE * curve)


def test_of_several_recordings_it_is_named_which():
    first, second = recording(noise(13)), recording(noise(14) + SAMPLE * STEP)
    both = [
        Recording(first.channels, "a.csv"),
        Recording(second.channels, "b.csv"),
    ]
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
    assert {n.hint for n in steps} == {"leave it out with the others, or subtract them"}
    hint = with_option(advice).hint
    assert hint.endswith("or --remove-departures, which subtracts them")
    assert f"--start {kept[1]:.6g}" in hint or f"--stop {kept[2]:.6g}" in hint
    assert with_option(steps[0]) == steps[0]


def test_a_recording_of_another_kind_is_refused():
    rec = recording(noise(15) + SAMPLE * STEP)
    fits = gmwm.calibrate(rec, WhiteNoise() + RandomWalk())
    with pytest.raises(InputError, match="is not the one that was calibrated"):
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


@pytest.mark.parametrize(("start", "stop"), [(3000.0, 3120.0), (5004.0, 6100.0), (3010.0, 3040.0)])
def test_a_pulse_whose_steps_are_not_evident_alone(start, stop):
    # A Gauss-Markov process follows it, which then predicts twice the deviation for minutes.
    size = 2.2 * SAMPLE / np.sqrt(stop - start)  # 20 standard errors of its mean
    x = noise(19, WHITE) + size * ((start < TIME) & (stop > TIME))
    found = departures(fitted(x, WhiteNoise() + GaussMarkov()))
    assert [each.kind for each in found] == ["step", "step"]
    up, down = sorted(found, key=lambda each: each.time[0])
    assert up.is_evident and down.is_evident
    assert up.time[1] - 30.0 <= start <= up.time[2]
    assert down.time[1] <= stop <= down.time[2] + 30.0
    told = _found_notices(found, "rad/s", removing=False)
    assert all("it and the step at" in notice.text for notice in told)
    assert not any("it and the step" in n.text for n in _found_notices([up], "u", removing=False))
    if stop - start > 60.0:  # longer than blocks
        assert up.size[1] < size < up.size[2]
        assert down.size[1] < -size < down.size[2]
    fit = gmwm.calibrate(recording(x), WhiteNoise(), remove_departures=True)["gyro_x"]
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
    raw = gmwm.wavelet_variance(rec["gyro_x"])
    model = fit.model.haar_variance(raw.tau, DT)
    assert ratio == pytest.approx(np.max(np.sqrt(raw.variance / model)), rel=0.3)
    assert tau > 1000.0 and ratio > 5.0
    assert fit.valid


def test_pulses_of_several_sizes_are_no_noise_of_the_sensor():
    # As many as a level that jumps between two has: a slow term would predict several times more.
    x = noise(21, WHITE)
    for start, size in ((900.0, 0.1), (3000.0, -0.25), (5200.0, 0.18)):
        x += size * SAMPLE * ((start < TIME) & (start + 150.0 > TIME))
    fit = gmwm.calibrate(recording(x), WhiteNoise() + GaussMarkov(), screening=())["gyro_x"]
    steps = [one for one in fit.notices if one.code == "step" and one.values["evident"]]
    assert len(steps) > 4
    assert not fit.reasons["stationary"]
    assert "departures-many" not in {one.code for one in fit.notices}


def test_what_is_taken_off_may_leave_a_longer_curve():
    # A gap that a step is in is longer than what is missing about another one.
    long = gmwm.wavelet_variance(noise(10), dt=DT)
    short = replace(long, tau=long.tau[:-2], variance=long.variance[:-2])
    for before, after in ((long, short), (short, long)):
        doubled = replace(before, variance=4.0 * before.variance)
        (notice,) = _taken_notices([], doubled, after)
        assert notice.values["ratio"] == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("sizes", "seed", "between"),
    [
        ((1.0, -1.0, 1.0), 20, True),
        slow((-1.0, 1.0, -1.0), 21, True),
        ((1.0, 1.0, -1.0), 22, False),
        ((1.0, -0.6, 1.0), 23, False),
        ((1.0, -1.0), 24, False),
        ((1.0,), 25, False),
    ],
)
def test_three_steps_between_two_levels_are_noise_of_the_sensor(sizes, seed, between):
    curve = sum(size * (1000.0 + 2000.0 * i < TIME) for i, size in enumerate(sizes))
    rec = recording(noise(seed, WHITE) + 0.4 * SAMPLE * curve)
    fit = gmwm.calibrate(rec, WhiteNoise(), remove_departures=True)["gyro_x"]
    assert sum(one.values.get("removed") is True for one in fit.notices) == len(sizes)
    many = [one.values["two_levels"] for one in fit.notices if one.code == "departures-many"]
    assert many == [True] * between
    assert fit.valid is not between


def test_steps_follow_each_other_by_their_likeliest_times():
    def step(time, latest, size):
        return Departure("step", (time, time, latest), (size, size - 0.05, size + 0.05), 1e3, 0.5)

    ends = (900.0, 250.0, 350.0)  # the first may be as late as the others
    steps = [step(100.0 * (k + 1), end, (-1.0) ** k) for k, end in enumerate(ends)]
    notices = _found_notices(
        [*steps, *[step(1e3 + k, 2e3, 1.0) for k in range(2)]], "u", removing=False
    )
    assert notices[0].code == "departures-many"


@pytest.mark.parametrize(("error", "between"), [(0.05, True), (0.2, False)])
@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_three_steps_of_sizes_that_are_hardly_known_are_not_two_levels(unit, error, between):
    steps = [
        Departure(
            "step",
            (1e3 * k,) * 3,
            tuple(unit * (s + 1.96 * error * z) for z in (0, -1, 1)),
            1e3,
            0.5,
        )
        for k, s in enumerate((1.0, -1.0, 1.0), 1)
    ]
    assert _is_between_two_levels(steps) is between


def test_a_bias_that_jumps_between_two_levels_is_noise_of_the_sensor():
    n, dt = 54_000, 0.1
    level = np.cumsum(np.random.default_rng(2).random(n) < 1.0 / 9000.0) % 2
    x = WhiteNoise(1e-4).simulate(n, dt, 2) + 1e-4 * level
    rec = recording(x, 1.0 / dt)
    fit = gmwm.calibrate(rec, WhiteNoise(), screening=(), remove_departures=True)["gyro_x"]
    (notice,) = [one for one in fit.notices if one.code == "departures-many"]
    assert notice.values["removed"] == len([n for n in fit.notices if n.values.get("evident")])
    assert [name for name, holds in fit.reasons.items() if not holds] == ["stationary"]
    # A slow term stands for it, and nothing needs to be taken off.
    fit = gmwm.calibrate(rec, WhiteNoise() + RandomWalk(), screening=())["gyro_x"]
    assert fit.valid
    (notice,) = [one for one in fit.notices if one.code == "departures-many"]
    assert (notice.severity, notice.values["removed"]) == ("warning", 0)
    steps = [one for one in fit.notices if one.code == "step"]
    assert len(steps) > 4
    assert {(one.severity, one.hint) for one in steps} == {("note", "")}
