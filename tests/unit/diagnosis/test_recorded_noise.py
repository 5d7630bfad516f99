"""Predictions, events, outliers, tails, changes of the noise and drift: every number they give."""

import numpy as np
import pytest

from gmwm import Recording
from gmwm.diagnosis.contamination import (
    Tails,
    _clustering,
    contamination,
    contamination_notice,
    heavy_tails,
    tails_notice,
)
from gmwm.diagnosis.drift import drift_notice, part_means, variance_notice
from gmwm.diagnosis.events import (
    _level,
    _longest_chain,
    event_notice,
    find_events,
    with_single_outliers,
)
from gmwm.diagnosis.innovations import Signal, innovations, robust_scale, running_scale
from gmwm.diagnosis.pairs import crosstalk_notices, temperature_notices
from recorded import assert_as_recorded, edge, first

RNG = np.random.default_rng(11)
NOISE = RNG.normal(size=20_000)
SHORT = NOISE[:4000]
WALK = np.cumsum(RNG.normal(size=20_000))


def gyro(dt=0.01, step=0.0, scatter=1.0):
    return Signal("gyro_x", "rad/s", dt, step, scatter)


def summary(errors):
    return errors and [errors.values, errors.scale, errors.known, errors.level, errors.rounding]


def test_predictions():
    found = {}
    gappy = SHORT.copy()
    gappy[[0, 5, 6, 100, 130, 131, 150, 3990]] = np.nan
    gappy[2000:2040] = np.nan
    resonant = np.convolve(NOISE, [1.0, -1.2, 0.8, -0.3])[:9000]
    for name, values in {
        "white": SHORT, "gappy": gappy, "walk": WALK[:4000], "resonant": resonant,
        "loud": np.where(np.arange(20_000) < 9000, 1.0, 3.0) * NOISE, "constant": np.ones(100),
        "alternating": np.tile([1.0, -1.0], 50), "short": SHORT[:80], "64": SHORT[:64],
        "65": SHORT[:65], "holes": np.where(np.arange(200) % 3 == 0, np.nan, SHORT[:200]),
    }.items():  # fmt: skip
        found[name] = summary(innovations(values, 0.0))
    for step in (0.5, 2.0):
        found[f"step {step}"] = summary(innovations(np.round(SHORT / step) * step, step))
    few = np.where(np.arange(300) % 20 < 17, SHORT[:300], np.nan)
    found["pieces"] = summary(innovations(few, 0.0))
    found["scales"] = [
        robust_scale(np.array(values, dtype=float), floor) for values, floor in (
            (np.arange(1, 10), 0.0), (np.arange(1, 10), 9.0), ([0, 0, 0, 0, 1], 0.0),
            ([0, 0, 0, 0, 1], 0.5), ([1, -1, 1, -1, 100], 0.0), ([1, 2, 3, 5.5, 8, 13, 21], 0.0),
        )
    ]  # fmt: skip
    for n in (100, 4095, 4096, 6143, 6144, 8192, 20_000):
        values = np.where(np.arange(n) % 4096 < 2100, 1.0, 5.0) * NOISE[:n]
        scale = running_scale(values, 0.0)
        found[f"running {n}"] = scale
    assert_as_recorded("diagnosis/predictions", found)


def spiked(height, at=(1000,), length=1, values=SHORT):
    values = values.copy()
    for k in at:
        values[k : k + length] += height
    return values


def events_of(values, step=0.0, tails=None):
    return find_events(innovations(values, step), tails)


def told(values, events):
    return event_notice(gyro(), values, events)


def test_events():
    found = {}
    heavy = Tails("student", 4.0, 0.8)
    for name, tails in (
        ("gaussian", None),
        ("student", heavy),
        ("power", Tails("power", 1.0, 0.7)),
    ):
        found[name] = edge(lambda h, tails=tails: events_of(spiked(h), tails=tails), 2.0, 900.0, 12)
        chain = edge(
            lambda h, tails=tails: events_of(spiked(h, range(1000, 1040, 4)), tails=tails),
            2.0, 900.0, 12,
        )  # fmt: skip
        found[f"{name} chain"] = chain
    found["ringing"] = events_of(spiked(1.0, (500,), 1) + 40.0 * np.exp(
        -((np.arange(4000.0) - 2000) / 30) ** 2) * np.cos(np.arange(4000.0)))  # fmt: skip
    for apart in (10, 24, 25, 26, 33, 34, 42, 50):
        found[f"apart {apart}"] = events_of(spiked(30.0, (1000, 1000 + apart)))
    found["ends"] = events_of(spiked(30.0, (1, 3998)))
    found["rounded"] = edge(lambda h: events_of(np.round(spiked(h)), 1.0), 2.0, 30.0, 10)
    one = spiked(30.0, (50, 1000), 3)
    found["notice"] = told(one, events_of(one))
    found["one"] = told(spiked(8.0), events_of(spiked(8.0)))
    for count in (1, 2, 4, 5):
        values = spiked(-20.0, range(300, 300 + 500 * count, 500))
        found[f"{count} events"] = told(values, events_of(values))
    found["harmful from"] = edge(
        lambda h: told(spiked(h), ((990, 1010),)).severity == "warning", 3.0, 60.0, 12
    )
    missing = spiked(30.0)
    missing[985:1000] = np.nan
    found["gap beside"] = told(missing, ((998, 1010),))
    found["all"] = told(SHORT, ((0, 4000),))
    slope = spiked(5.0) + np.arange(4000) * 0.01
    found["slope"] = told(slope, ((900, 1200),))
    found["chains"] = [_longest_chain(heavy, n) for n in (100, 10_000)]
    assert_as_recorded("diagnosis/events", found)


def sprinkled(share, height=10.0, values=SHORT):
    values = values.copy()
    at = np.random.default_rng(2).random(values.size) < share
    values[at] += height * np.sign(NOISE[: values.size][at])
    return values


def test_outliers():
    found = {}

    def share_of(share, height=10.0, values=SHORT):
        errors = innovations(sprinkled(share, height, values), 0.0)
        return contamination(errors, find_events(errors))

    found["shares"] = [share_of(share) for share in (0.0, 0.002, 0.01, 0.05)]
    found["from"] = edge(share_of, 1e-4, 0.02, 10)
    found["notice"] = [contamination_notice("a", share) for share in (0.0, 0.0123)]
    for name, values in (
        ("white", NOISE[:9000]), ("walk", WALK[:9000]), ("slow", NOISE[:9000] + WALK[:9000] / 20),
    ):  # fmt: skip
        for share in (0.003, 0.03):
            x = sprinkled(share, 30.0, values)
            x[4000:4010] = np.nan
            errors = innovations(x, 0.0)
            for events in ((), ((10, 20),), ((10, 700),)):
                marks = with_single_outliers(events, errors, x, 0.0)
                found[f"{name} {share} {events}"] = [
                    len(marks), marks[:3], sum(b - a for a, b in marks), sum(a for a, _ in marks),
                ]  # fmt: skip
        level, scale = _level(values)
        found[f"{name} level"] = [level, scale]
    found["rounded"] = with_single_outliers(
        (), innovations(np.round(SHORT), 1.0), np.round(sprinkled(0.002)), 1.0
    )
    for n in (49, 391, 392):
        found[f"level {n}"] = float(np.sum(_level(WALK[:n])[0]))
    assert_as_recorded("diagnosis/outliers", found)


def drawn(law, n=20_000):
    rng = np.random.default_rng(8)
    return {
        "gaussian": lambda: rng.normal(size=n), "laplace": lambda: rng.laplace(size=n),
        "student 3": lambda: rng.standard_t(3, size=n),
        "student 6": lambda: rng.standard_t(6, size=n),
        "cauchy": lambda: rng.standard_cauchy(size=n),
        "mixture": lambda: rng.normal(size=n) * np.where(rng.random(n) < 0.02, 8.0, 1.0),
        "bursts": lambda: rng.standard_t(4, size=n) * np.repeat(rng.choice([1, 3.0], n // 20), 20),
    }[law]()  # fmt: skip


@pytest.mark.parametrize("law", ["laplace", "student 3", "mixture", "bursts", "cauchy"])
def test_heavy_tails(law):
    found = {}
    values = drawn(law)
    errors = innovations(values, 0.0)
    tails = heavy_tails(errors)
    found["law"] = tails
    found["notice"] = tails_notice("a", errors, tails)
    found["clustering"] = _clustering(np.abs(values))
    if tails is not None:
        found["beyond"] = tails.beyond(np.array([1.0, 4.0, 30.0]))
        found["distance"] = [tails.distance(chance) for chance in (0.5, 1e-3, 1e-8)]
    if law == "laplace":
        found["rounding"] = edge(
            lambda step: heavy_tails(innovations(np.round(values[:6000] / step) * step, step)),
            0.3, 3.0, 5,
        )  # fmt: skip
    assert_as_recorded(f"diagnosis/tails_{law.replace(' ', '_')}", found, rtol=1e-4)


def changed(factor, start, stop, values=NOISE):
    size = np.ones(values.size)
    size[start:stop] = factor
    return values * size


def variance_of(values, **more):
    errors = innovations(values, 0.0)
    return variance_notice(gyro(step=more.pop("step", 0.0)), errors, errors.known, **more)


def test_changes_of_the_noise():
    found = {}
    for name, (start, stop) in {
        "second half": (10_000, 20_000), "tenth": (4000, 6000), "last": (18_000, 20_000),
        "short": (5000, 5400), "quarter": (0, 5000),
    }.items():  # fmt: skip
        for factor in (0.5, 1.15, 4.0):
            found[f"{name} {factor}"] = variance_of(changed(factor, start, stop))
        found[f"{name} from"] = edge(
            lambda f, a=start, b=stop: variance_of(changed(f, a, b)), 1.01, 1.8, 7
        )
    found["large from"] = edge(
        lambda f: variance_of(changed(f, 10_000, 20_000)).severity == "bad", 1.07, 2.0, 8
    )
    swell = NOISE * (1.0 + 0.3 * np.sin(np.arange(20_000) / 200.0))
    found["swell"] = variance_of(swell)
    found["heavy"] = variance_of(swell, is_heavy=True)
    found["coarse"] = [variance_of(swell, step=step) is None for step in (1.9, 2.1)]
    ramp = NOISE[:1500] * np.linspace(1.0, 2.0, 1500)
    found["short"] = [variance_of(ramp[:n]) for n in (990, 1100, 1500)]
    half = np.where(np.arange(4000) < 2000, 0.0, SHORT)
    found["half still"] = variance_of(half)
    spotted = innovations(NOISE, 0.0)
    usable = spotted.known & (np.arange(20_000) % 2000 > 1945)
    found["few"] = variance_notice(gyro(), spotted, usable)
    assert_as_recorded("diagnosis/variance", found)


def test_drift():
    found = {}
    x = np.arange(20_000) / 20_000.0
    for name, values in {
        "walk": WALK / 100.0 + NOISE, "none": NOISE, "ramp": NOISE + 9.0 * x,
        "down": NOISE - 9.0 * x, "both": NOISE + WALK / 100.0 + 30.0 * x, "constant": 0.0 * x,
        "8191": NOISE[:8191] + x[:8191] * 20, "8192": NOISE[:8192] + x[:8192] * 20,
        "gaps": np.where((x > 0.3) & (x < 0.6), np.nan, NOISE + 9.0 * x),
        "half": np.where(x > 0.49, np.nan, NOISE + 9.0 * x),
        "most": np.where(x > 0.52, np.nan, NOISE + 9.0 * x),
    }.items():  # fmt: skip
        found[name] = drift_notice(gyro(), values)
    found["ramp from"] = edge(lambda a: drift_notice(gyro(dt=1.0), NOISE + a * x), 0.01, 9.0, 12)
    bend = np.sin(6.0 * x)
    found["bend from"] = edge(lambda a: drift_notice(gyro(dt=1.0), NOISE + a * bend), 0.01, 9.0, 12)
    found["straight from"] = edge(
        lambda a: drift_notice(gyro(dt=1.0), NOISE + bend + a * x).code == "drift"
        and drift_notice(gyro(dt=1.0), NOISE + bend + a * x).severity == "warning", 0.1, 90.0, 12,
    )  # fmt: skip
    gaps = np.where(np.arange(20) % 5 < 2, np.nan, np.arange(20.0))
    found["means"] = [part_means(gaps, 4, least) for least in (0.0, 0.5, 0.6, 0.7)]
    assert_as_recorded("diagnosis/drift", found)


def test_what_channels_share():
    found = {}
    a, b = NOISE[:5000].astype(np.float32), NOISE[5000:10_000].astype(np.float32)

    def correlated(r, n=5000):
        mixed = (r * a + np.sqrt(1.0 - r * r) * b)[:n].astype(np.float32)
        return crosstalk_notices({"x": a[:n], "y": mixed, "z": NOISE[-n:].astype(np.float32)})

    found["pairs"] = [correlated(r) for r in (0.0, 0.1, 0.5)]
    found["long from"] = edge(correlated, 1e-3, 0.5, 12)
    found["short from"] = edge(lambda r: correlated(r, 500), 1e-3, 0.5, 12)
    found["strong from"] = edge(lambda r: correlated(r)[0].severity == "warning", 0.1, 0.6, 12)
    found["known"] = first(lambda n: correlated(0.9, n), range(50, 80))
    x = np.arange(20_000) / 20_000.0
    warm = 20.0 + np.sin(40.0 * x) + 5.0 * x

    def followed(slope, n=20_000, noise=NOISE):
        channels = {"gyro_x": (noise + slope * warm)[:n], "gyro_y": WALK[:n] / 100.0}
        channels |= {"temperature": warm[:n], "temperature_2": warm[:n] + WALK[:n] * 1e-3}
        units = {"gyro": "rad/s", "temperature": "degC"}
        return temperature_notices(Recording.from_arrays(channels, 100.0, units))

    found["temperature"] = [followed(slope) for slope in (0.0, 1.0, -3.0)]
    found["from"] = edge(followed, 1e-3, 3.0, 11)
    found["length"] = first(lambda n: followed(9.0, n, 0.0 * NOISE), range(2030, 2070))
    found["parts"] = first(
        lambda n: followed(9.0, noise=np.where(np.arange(20_000) < 312 * n, 0.0, np.nan)),
        range(10, 30),
    )
    assert_as_recorded("diagnosis/shared", found)
