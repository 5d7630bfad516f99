# ruff: noqa: E501 - tables
"""Departures, screening, summaries and judgements: every number and notice, as it was."""

from dataclasses import replace

import numpy as np

import gmwm
from gmwm import Channel, GaussMarkov, RandomWalk, Recording, Resonance, Sinusoid, WhiteNoise
from gmwm._core.notices import Notice
from gmwm.calibration import Departure, departures, tuning
from gmwm.calibration.channel import ChannelModel
from gmwm.calibration.entrance import _check_together, _left_out, _reason_to_skip, _usable
from gmwm.calibration.judgement import judged, with_one_remedy
from gmwm.calibration.screening import (
    _is_much,
    _outcome,
    screened,
    stretches_at_rest,
    terms_of,
    with_treatment,
)
from gmwm.calibration.stationarity.departure_notices import (
    _is_between_two_levels,
    _removed_notice,
    departure_notice,
    with_departures,
)
from gmwm.calibration.stationarity.departures import _basis, _share
from gmwm.calibration.stationarity.means import Means
from gmwm.calibration.stationarity.removal import _independent, variance_without, without_departures
from gmwm.calibration.stationarity.shapes import _ladder
from gmwm.calibration.summary import (
    Floor,
    floor,
    noise_density,
    random_walk,
    sentence,
    white_density,
)
from gmwm.diagnosis import health
from recorded import assert_as_recorded, edge, first, refused

N = 3000
T = np.arange(N) * 1.0
NOISE = np.random.default_rng(4).normal(size=N)
GYRO = {"gyro": "rad/s"}


def fit(x, model=None, dt=1.0):
    model = WhiteNoise() + RandomWalk() if model is None else model
    return gmwm.fit(model, Channel("gyro_x", x, dt, "gyro", "rad/s"))


CURVES = {
    "down": -0.6 * (T > 400), "both": 0.8 * (T > 900) - 0.9 * (T > 2100), "transient": 3.0 * np.exp(-T / 150),
}  # fmt: skip


def test_departures():
    found = {}
    for name in ("down", "both", "transient"):
        x = NOISE + CURVES[name]
        if name == "down":
            x[1000:1200] = np.nan
        one = fit(x)
        there = departures(one)
        found[name] = there
        told = with_departures(one, ["a"], [there], [()], [()])
        found[f"{name} notices"] = told.notices[len(one.notices) :]
        if there and there[0].is_evident:
            of = Channel("gyro_x", x, 1.0, "gyro", "rad/s")
            left = variance_without(of, there)
            found[f"{name} left"] = left.variance
            removed = with_departures(one, ["a", "b"], [(), there], [there, ()],
                                      [(one.wv, left), (one.wv, one.wv)], removing=True)  # fmt: skip
            found[f"{name} removed"] = removed.notices[len(one.notices) :]
            rec = Recording((of, replace(of, name="gyro_y")), "log")
            rest = without_departures(rec, {"gyro_x": told})
            found[f"{name} rest"] = [
                float(np.nansum(channel.values * T)) for channel in rest.channels
            ]
    assert_as_recorded("calibration/departures", found, rtol=1e-4)


def test_parts_of_departures():
    found = {}
    found["ladder"] = [_ladder(1.0, 3.0), _ladder(2.0, 2.1)]
    wv = gmwm.wavelet_variance(np.where(T % 700 < 40, np.nan, NOISE), 0.5)
    means = Means.of(wv, tuning.MOST_MEANS)
    covariance = means.covariance(lambda f, _: np.ones_like(f))
    found["means"] = [means.blocks.size, means.samples, means.step, means.length, means.first.size,
                      float(np.trace(covariance)), float(covariance[3, 4]), float(covariance.sum())]  # fmt: skip
    found["basis"] = _basis([np.array([[1.0, 0, 0], [2.0, 0, 0], [1.0, 1, 0]])]).shape
    one = fit(NOISE)
    found["share"] = [_share(np.cos(np.arange(100) / k), 8.0, one) for k in (2.0, 20.0)]
    for kind in ("step", "transient", "drift-at-start", "slow-period"):
        some = Departure(kind, (100.0, 90.0, 120.0), (1.0, 0.5, 1.5), 200.0, 0.5, 0.7)
        found[f"curve {kind}"] = some.curve(T[80:130:10])
        for evidence, share in ((200.0, 0.5), (99.0, 0.18), (1e9, 1.2)):
            one_of = replace(some, evidence=evidence, share=share)
            found[f"{kind} {evidence} {share}"] = [
                departure_notice(one_of, "rad/s"), departure_notice(one_of, "m/s^2", stays=True),
                _removed_notice(one_of, "rad/s"),
            ]  # fmt: skip
        found[f"edges {kind}"] = [
            edge(lambda e, s=some: replace(s, evidence=e).is_evident, 10.0, 1e3),
            edge(lambda e, s=some: departure_notice(replace(s, share=e), "u").severity == "bad", 0.1, 0.9),
        ]  # fmt: skip

    def steps(*sizes, half=0.1):
        return [
            Departure("step", (k, k, k), (a, a - half, a + half), 1e3, 0.5)
            for k, a in enumerate(sizes)
        ]

    found["levels"] = [
        _is_between_two_levels(steps(*sizes))
        for sizes in ((1, -1), (1, -1, 1), (-1, 1, -1), (1, 1, 1), (1, -1, 3), (5, 1, -1, 1), (1, -1, -1, 1))
    ]  # fmt: skip
    found["other size"] = edge(lambda a: _is_between_two_levels(steps(1, -1, a)), 1.0, 3.0)
    found["errors"] = edge(lambda a: _is_between_two_levels(steps(1, -1, 1, half=a)), 0.01, 3.0)
    lots = with_departures(one, ["a"], [()], [steps(*range(1, 5))], [(one.wv, one.wv)])
    more = with_departures(one, ["a"], [()], [steps(*range(1, 6))], [(one.wv, one.wv)])
    found["many"] = [[n.code for n in each.notices[len(one.notices) :]] for each in (lots, more)]
    found["taken"] = edge(
        lambda a: any(n.code == "departures-removed" for n in with_departures(
            one, ["a"], [()], [steps(1)], [(replace(one.wv, variance=a * one.wv.variance), one.wv)]
        ).notices), 1.0, 3.0,
    )  # fmt: skip
    found["independent"] = np.abs(_independent(np.array([T > 1000, T > 2000, T > 2900], dtype=float),
                                               np.array([1.0, 2.0, 3.0])))  # fmt: skip
    assert_as_recorded("calibration/parts_of_departures", found, rtol=1e-4)


def test_summaries():
    found = {}
    for name, model in {
        "white": WhiteNoise(1e-3), "walk": WhiteNoise(1e-3) + RandomWalk(2e-4),
        "fast": GaussMarkov(1e-2, 0.02) + RandomWalk(1e-4), "slow": GaussMarkov(1e-2, 5.0),
        "hum": WhiteNoise(1e-3) + Resonance(3e-3, 8.0, 0.1), "line": WhiteNoise(1e-3) + Sinusoid(1e-3, 5.0),
    }.items():  # fmt: skip
        one = fit(gmwm.process.as_model(model).simulate(6000, 0.02, 3), gmwm.process.as_model(model).opened()
                  if name not in ("hum", "line") else WhiteNoise() + (
                      Resonance(frequency=8.0, damping=0.1) if name == "hum" else Sinusoid(frequency=5.0)), 0.02)  # fmt: skip
        found[name] = [white_density(one), floor(one), sentence(one)]
        if name in ("white", "walk", "slow"):
            found[f"{name} levels"] = [noise_density(one), random_walk(one)]
    found["bias"] = Floor(0.664, 1.0, False).bias_instability
    assert_as_recorded("calibration/summaries", found, rtol=1e-4)


def test_screening():
    found = {}
    spiky = NOISE.copy()
    spiky[[100, 900, 901]] += 60.0
    spiky += np.sin(2 * np.pi * 0.1 * T) + 2.0 * Resonance(1.0, 0.23, 0.02).simulate(N, 1.0, 1)
    held = np.where(np.arange(N) % 29 == 0, np.roll(NOISE, 1), NOISE)
    outliers = NOISE + 15.0 * (np.random.default_rng(3).random(N) < 0.02)
    many = NOISE + 15.0 * (np.random.default_rng(3).random(N) < 0.12)
    data = {"gyro_x": spiky, "gyro_y": held, "gyro_z": outliers, "accel_x": many,
            "accel_y": np.repeat(NOISE[: N // 2], 2), "accel_z": np.ones(N)}  # fmt: skip
    rec = Recording.from_arrays(data, 1.0, {**GYRO, "accel": "m/s^2"}, source="log")
    for chosen in (("events",), ("outliers", "lines"), gmwm.calibration.SCREENING):
        one = screened(rec, chosen)
        found[f"{len(chosen)} {chosen[:1]}"] = [
            {name: [repr(term) for term in terms] for name, terms in one.extra.items()},
            sorted(one.robust), one.repeated, [c.missing for c in one.recording.channels],
            [f"{n.severity} {n.code} {n.where} {n.values.get('left_out')}" for n in one.notices],
            _left_out(rec, one.recording),
        ]  # fmt: skip
    whole = health(rec)
    found["terms"] = [
        repr(terms_of(whole, "gyro_x", c))
        for c in (("lines",), ("resonances",), ("lines", "resonances"))
    ]
    told = with_treatment(whole.notices, whole, {"gyro_x"}, {"gyro_z"})
    found["treated"] = [[n.code, n.where, n.hint] for n in told]
    found["much"] = first(lambda n: _is_much(((5, 10), (20, 20 + n)), 1000), range(200))
    line = Notice("line", "note", "a", "", {"frequency": 5.0})
    for f in (4.0, 4.89, 4.91, 5.09, 5.11):
        terms = (WhiteNoise(), Sinusoid(frequency=f))
        found[f"outcome {f}"] = [_outcome(line, WhiteNoise() + Sinusoid(frequency=f), ()),
                                 _outcome(line, WhiteNoise() + RandomWalk(), terms),
                                 _outcome(replace(line, code="resonance"), WhiteNoise() + Resonance(frequency=f), ())]  # fmt: skip
    log = {
        f"gyro_{a}": 1e-3 * np.random.default_rng(k).normal(size=6000) for k, a in enumerate("xyz")
    }
    time = np.arange(6000) / 50.0
    for name, turning in {
        "rest": time < 0,
        "end": time > 100,
        "turn": (time > 50) & (time < 70),
        "all": time > 5,
    }.items():
        moved = {**log, "gyro_x": log["gyro_x"] + turning * np.sin(time) * 2.0}
        one = Recording.from_arrays(moved, 50.0, GYRO, source="log")
        found[name] = refused(
            lambda r=one: [
                [p.source, p.n, *(n.code for n in p.notices)] for p in stretches_at_rest(r)
            ]
        )
    assert_as_recorded("calibration/screening", found, rtol=1e-4)


def test_which_channels_are_used_and_judged():
    found = {}
    half = np.where(np.arange(100) < 50, np.nan, NOISE[:100])
    more = np.where(np.arange(100) < 51, np.nan, NOISE[:100])
    for name, x in {"noise": NOISE[:100], "half": half, "more": more, "one": np.ones(100), "gone": half * np.nan,
                    "half one": half * 0 + 1.0, "less one": more * 0 + 1.0}.items():  # fmt: skip
        found[name] = _reason_to_skip(Channel("gyro_x", x, 1.0, "gyro", "rad/s"), ())
    short, fast = (
        Recording.from_arrays({"gyro_x": -NOISE}, rate, GYRO, source="b")
        for rate in (1.0005, 1.002)
    )
    given = Recording.from_arrays({"gyro_x": NOISE}, 1.0, GYRO, source="a")
    for name, other in (("same", short), ("other", fast)):
        try:
            _check_together([given, other])
            alive, dead, sources = _usable([screened(each, ()) for each in (given, other)])
            found[name] = [[c.dt for c in alive["gyro_x"]], dead, sources]
        except gmwm.InputError as error:
            found[name] = str(error)
    one = fit(NOISE)

    def departed(kind, low, high, evident=True, severity="bad", removable=True):
        values = {"time_lower": low, "time_upper": high, "evident": evident, "removable": removable}
        return Notice(kind, severity, "", kind, values, "cut")

    for name, some in {
        "two": [departed("step", 100.0, 120.0), departed("step", 700.0, 720.0)],
        "start": [departed("transient", 10.0, 50.0), departed("drift-at-start", 0.0, 200.0)],
        "one": [departed("step", 100.0, 120.0)], "notes": [departed("step", 1.0, 2.0, severity="note")] * 2,
        "not evident": [departed("step", 1.0, 2.0, evident=False)] * 2,
        "left": [departed("step", 100.0, 120.0, removable=False), departed("step", 500.0, 520.0)],
    }.items():  # fmt: skip
        models = {
            "a": ChannelModel(replace(one, notices=tuple(some)), None),
            "b": Notice("x", "bad", "b", ""),
        }
        for length in (0.0, 1000.0):
            kept, advice = with_one_remedy(models, length)
            found[f"{name} {length}"] = [advice, kept["a"].fit.notices]
    issues = [Notice(code, severity, where, code) for code in ("not-static", "tilt", "stuck", "gap", "held")
              for severity, where in (("bad", ""), ("bad", "gyro_x"), ("warning", "gyro_x"))]  # fmt: skip
    for still in (False, True):
        for quantity in ("gyro", "accel"):
            own = replace(one, wv=replace(one.wv, quantity=quantity))
            found[f"judged {still} {quantity}"] = [
                n.code for n in judged({"gyro_x": ChannelModel(own, None)}, issues, still=still)["gyro_x"].fit.notices
            ]  # fmt: skip
    assert_as_recorded("calibration/channels", found)


def test_a_whole_calibration():
    x = NOISE + 0.6 * (T > 1700) + np.sin(2 * np.pi * 0.1 * T)
    x[50] += 80.0
    rec = Recording.from_arrays({"gyro_x": x, "gyro_y": np.ones(N)}, 1.0, GYRO, source="log")
    found = gmwm.calibrate(rec, WhiteNoise() + RandomWalk(), remove_departures=True)
    whole = {"text": str(found), "notices": found.notices, "skipped": found.skipped,
             "fit": found["gyro_x"].notices, "params": found["gyro_x"].params, "left": found.left_out}  # fmt: skip
    assert_as_recorded("calibration/whole", whole, rtol=1e-4)
