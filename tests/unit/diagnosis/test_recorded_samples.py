# ruff: noqa: E501 - tables
"""Missing, stuck, cut-off and repeated samples: every notice in full, and where each begins."""

import numpy as np
import pytest

from gmwm import Channel
from gmwm.diagnosis.innovations import Signal, innovations
from gmwm.diagnosis.resolution import is_coarse, rounding_notice, step_size
from gmwm.diagnosis.samples import (
    _longest_by_chance,
    _slowest_fall,
    abrupt_end_notice,
    dead_notice,
    gap_notices,
    hole_notice,
    is_dithered,
    length_notice,
    repeated_value_notice,
    saturation_notice,
    stuck_notice,
)
from gmwm.diagnosis.unmeasured import (
    held_notice,
    held_share,
    interpolation_notice,
    leaves_runs,
    repetition,
    repetition_notice,
    thinned,
)
from recorded import assert_as_recorded, edge, first

NOISE = np.random.default_rng(7).normal(size=20_000)
SHORT = NOISE[:4000]


def gyro(dt=0.01, step=0.0, scatter=1.0):
    return Signal("gyro_x", "rad/s", dt, step, scatter)


def channel(values, name="gyro_x", dt=0.01):
    return Channel(name, np.asarray(values, dtype=float), dt, "gyro", "rad/s")


def steps(counts, start=0):
    """Whole numbers, of each so many, in an order by chance."""
    values = np.repeat(np.arange(start, start + len(counts), dtype=float), counts)
    return np.random.default_rng(1).permutation(values)


def bell(half, top=400, wide=6.0):
    """Counts of a bell of steps from -half to half."""
    place = np.arange(-half, half + 1)
    return np.rint(top * np.exp(-0.5 * (place / wide) ** 2)).astype(int)


def test_falls_of_tails():
    # 4 (1 + 3 sqrt(1/100 + 1/25)) is above 1; 1/100 (1 + 3 sqrt(1/10 + 1/1000)) = 0.01953.
    assert _slowest_fall(100, 25) == _slowest_fall(0, 9) == _slowest_fall(9, 0) == 1.0
    assert _slowest_fall(10, 1000) == pytest.approx(0.0195341, rel=1e-5)
    assert _slowest_fall(1, 16) == pytest.approx((1 + 3 * np.sqrt(17 / 16)) / 16)


def test_runs_by_chance():
    # A step of 2 sqrt(2) s keeps erf(1) = 0.8427 of the samples: its 94th power is below 1e-3/1e4.
    noise = np.sqrt(1.0 + 8.0 / 12.0)
    assert _longest_by_chance(10_000, 2.0**1.5, noise) == 96
    assert _longest_by_chance(100, 0.0, 1.0) == 3
    assert _longest_by_chance(100, 1.0, 0.0) == 100
    assert _longest_by_chance(1000, 1e-3, 1.0) == 3


def stuck(length, values=NOISE, step=0.0, at=500):
    values = np.round(values / step) * step if step else values.copy()
    values[at : at + length] = values[at]
    return stuck_notice(gyro(step=step), values, innovations(values, step))


def test_stuck():
    found = {}
    for step in (0.0, 0.5, 1.5):
        longest = first(lambda n, step=step: stuck(n, step=step), range(2, 60))
        found[f"first {step}"] = longest
        found[f"just {step}"] = stuck(longest, step=step)
        found[f"long {step}"] = stuck(300, step=step)
    found["bad from"] = first(lambda n: stuck(n).severity == "bad", range(1990, 2010))
    twice = NOISE.copy()
    twice[100:140], twice[300:390], twice[2000:2100] = 1.25, -0.5, np.nan
    found["twice"] = stuck_notice(gyro(dt=0.5), twice, innovations(twice, 0.0))
    assert_as_recorded("diagnosis/stuck", found)


def test_saturation():
    found = {}
    for step in (0.0, 0.25):

        def cut(limit, step=step, both=False, quiet=NOISE):
            values = np.minimum(NOISE, limit)
            values = np.maximum(values, -limit) if both else values
            values = np.round(values / step) * step if step else values
            return saturation_notice(gyro(step=step), values, values if quiet is NOISE else quiet)

        found[f"from {step}"] = edge(cut, 1.0, 4.0, 9)
        found[f"cut {step}"] = cut(1.5)
        found[f"both {step}"] = cut(2.0, both=True)
        found[f"shocks {step}"] = cut(2.0, quiet=NOISE[:10])
    for last in range(6, 10):
        found[f"last {last}"] = saturation_notice(gyro(step=1.0), steps([*bell(20)[:25], last, 0, 0, 0][:26]), np.ones(0))  # fmt: skip
    counts = [100, 300, 500, 300, 100, 40]
    found["end"] = first(
        lambda n: saturation_notice(gyro(step=1.0), steps([*counts, n]), np.ones(0)), range(5, 200)
    )
    found["beginning"] = first(
        lambda n: saturation_notice(gyro(step=1.0), steps([n, *counts[::-1]]), np.ones(0)),
        range(5, 200),
    )
    for quiet in (1, 2, 3):  # of 2000 samples one in a thousand
        values = steps([200, 300, 900, 400, 50, 150])
        told = saturation_notice(gyro(step=1.0), values, np.full(quiet, 5.0))
        found[f"quiet {quiet}"] = told.severity
    assert_as_recorded("diagnosis/saturation", found)


def test_abrupt_ends():
    found = {}
    slow = NOISE + np.sin(np.arange(NOISE.size) / 900.0)
    for name, values in {
        "rectified": np.abs(NOISE), "negative": -np.abs(NOISE), "plain": NOISE, "slow": slow,
        "uniform": np.random.default_rng(2).uniform(-1, 1, 12_000),
        "wrapped": (slow + 2.0) % 4.0 - 2.0, "short": np.abs(SHORT[:1500]),
        "least": np.abs(NOISE[:4095]), "enough": np.abs(NOISE[:4096]),
    }.items():  # fmt: skip
        scatter = float(np.std(values))
        found[name] = abrupt_end_notice(gyro(scatter=scatter), values)
        for step in (0.1, 0.45):
            rounded = np.round(values / step) * step
            found[f"{name} {step}"] = abrupt_end_notice(gyro(step=step, scatter=scatter), rounded)
    values = np.abs(NOISE)

    def ended(scatter):
        return abrupt_end_notice(gyro(scatter=scatter), values)

    def coarse(step):
        return abrupt_end_notice(gyro(step=step), np.round(values / step) * step)

    found["cut"] = edge(lambda a: abrupt_end_notice(gyro(), NOISE[-a < NOISE]), 0.1, 9.0, 12)
    found["ends"] = [
        abrupt_end_notice(gyro(), NOISE[-a < NOISE]) for a in (1.2, 1.5, 1.6, 1.7, 1.8)
    ]
    found["coarse"] = [coarse(step) is not None for step in (0.02, 0.05, 0.1, 0.2, 0.4)]
    found["scatters"] = [ended(scatter) for scatter in (1e-3, 0.01, 0.1, 10.0)]
    assert_as_recorded("diagnosis/abrupt_ends", found)


def test_holes():
    base = bell(20)
    found = {}
    for wide in (2, 3, 4, 8):
        counts = base.copy()
        counts[22 : 22 + wide] = 0
        found[f"wide {wide}"] = hole_notice(gyro(step=0.5, scatter=3.0), steps(counts, -5) * 0.5)
    counts = base.copy()
    counts[22:26] = 0
    found["harmful"] = edge(
        lambda scatter: (
            hole_notice(gyro(step=1.0, scatter=scatter), steps(counts)).severity == "bad"
        ),
        2.0,
        30.0,
    )
    for place, least in ((20, 5), (21, 5), (26, 5), (28, 5)):
        found[f"edge {place}"] = first(
            lambda n, place=place: hole_notice(
                gyro(step=1.0, scatter=3.0), steps([*counts[:place], n, *counts[place + 1 :]])
            ),
            range(least, 400),
        )
    few = np.array([20, 20, 20, 0, 0, 0, 0, 20, 20, 20])
    found["few"] = hole_notice(gyro(step=1.0, scatter=3.0), steps(few))
    found["seven"] = hole_notice(gyro(step=1.0, scatter=3.0), steps(np.where(few, 7, 0)))
    found["eight"] = hole_notice(gyro(step=1.0, scatter=3.0), steps(np.where(few, 8, 0)))
    found["two"] = hole_notice(gyro(step=1.0, scatter=3.0), steps([*few[:7], *(9, 9, 9), 0, 0, 0, 0, 0, 9, 9, 9]))  # fmt: skip
    found["coarse"] = hole_notice(gyro(step=1.0, scatter=0.99), steps(few))
    found["fine"] = hole_notice(gyro(step=1.0), steps(few)) is not None
    found["range"] = [
        hole_notice(gyro(step=1.0, scatter=3.0), np.append(steps(few), far)) is not None
        for far in (1e6, 1e6 + 1)
    ]
    assert_as_recorded("diagnosis/holes", found)


def with_value(count, value=0.5, size=4000, step=0.0):
    values = np.round(NOISE[:size] / step) * step if step else NOISE[:size].copy()
    values[np.linspace(10, size - 10, count).astype(int)] = value
    return repeated_value_notice(gyro(step=step), values)


def test_repeated_values():
    found = {}
    for step in (0.0, 0.05, 0.5):
        found[f"from {step}"] = first(lambda n, step=step: with_value(n, step=step), range(3, 3000))
        found[f"much {step}"] = with_value(1500, step=step)
    found["bad"] = first(lambda n: with_value(n).severity == "bad", range(150, 250))
    found["end"] = with_value(300, value=9.0)
    found["low end"] = with_value(300, value=-9.0)
    found["near end"] = with_value(300, value=float(np.sort(SHORT)[1]))
    found["coarse"] = repeated_value_notice(gyro(step=1.0, scatter=0.9), np.zeros(9))
    found["runs"] = repeated_value_notice(gyro(), np.where(np.arange(4000) % 1000 < 400, 0.5, SHORT))  # fmt: skip
    # Cut towards zero: about twice as many zeros as ones on either side.
    for scale in (1.0, 2.0, 5.0, 20.0):
        values = np.trunc(NOISE * scale)
        found[f"cut {scale}"] = repeated_value_notice(gyro(step=1.0, scatter=scale), values)
    for one, two in ((50, 40), (300, 260), (20, 15), (7, 7), (8, 8)):
        found[f"zeros {one}"] = first(
            lambda n, one=one, two=two: repeated_value_notice(
                gyro(step=1.0, scatter=2.0),
                steps([two - two // 3, two, one, n, one, two, two // 2], -3),
            ),
            range(8, 1500),
        )
    assert_as_recorded("diagnosis/repeated_values", found)


def test_rounding_and_what_is_dithered():
    found = {}
    for text, values in {
        "plain": SHORT, "fine": np.round(SHORT, 2),
        "thirds": np.round(np.round(SHORT * 30) / 30, 5),
        "one": np.ones(5), "few": np.array([0.0, 1.0, 2.5]), "many": np.arange(0.0, 90.0, 3.0),
        "double": 2.0 * np.round(SHORT * 4), "odd": np.round(SHORT * 2) * 3 + 1,
        "pi": np.pi * np.round(SHORT * 2), "large": 1e6 + np.round(SHORT, 1),
        "rare": np.where(np.arange(4000) % 400 == 5, 0.5, np.round(SHORT)),
        "mixed": np.where(np.arange(4000) % 3, np.round(SHORT * 5) / 5, np.round(SHORT * 2) / 2),
        "long": np.round(np.tile(NOISE, 4), 1),
        "bits": np.round(np.random.default_rng(3).normal(size=300) * 20) / 64,
    }.items():  # fmt: skip
        found[text] = step_size(values)
    for digits in range(1, 6):
        found[f"jitter {digits}"] = step_size(
            np.round(SHORT * 8) / 8 + 0.125 * 0.3 * 10.0**-digits * NOISE[4000:8000]
        )
    found["levels"] = [
        [step_size(np.resize(NOISE[:n], m)) for m in (n + 1, 2 * n - 1, 2 * n, 2 * n + 1)] for n in (6, 7, 8)
    ]  # fmt: skip
    found["counts"] = [
        [step_size(np.resize(np.arange(n) + 0.01 * NOISE[:n], m)) for m in (2 * n - 1, 2 * n, 2 * n + 1)]
        for n in (6, 7, 8, 9)
    ]  # fmt: skip
    places = np.repeat(np.arange(40.0), 3)
    found["lattice"] = edge(lambda a: step_size(places + a * NOISE[:120]) == 0.0, 1e-4, 0.5, 12)
    found["level"] = edge(lambda a: step_size(np.arange(40.0) + a * NOISE[:40]), 1e-4, 0.5, 12)
    for scatter in (0.2, 0.4, 0.6, 1.0, 1.1, 2.5):
        found[f"notice {scatter}"] = rounding_notice(gyro(step=1.0, scatter=scatter))
    found["severe"] = [
        edge(
            lambda s, bad=bad: rounding_notice(gyro(step=1.0, scatter=s)).severity == bad, low, high
        )
        for bad, low, high in (("bad", 0.1, 0.6), ("warning", 0.6, 1.5), ("note", 1.5, 3.0))
    ]
    found["coarse"] = edge(lambda a: is_coarse(np.round(SHORT * a), 1.0), 0.1, 1.0, 10)
    found["coarse one"] = edge(lambda a: is_coarse(np.round(SHORT[:90] * a), 1.0), 0.1, 1.0, 8)
    found["dithered"] = edge(lambda a: is_dithered(np.round(SHORT * a), 1.0), 0.1, 2.0, 10)
    runs = np.repeat(SHORT[:60], 31)
    found["runs"] = [
        is_dithered(np.concatenate([np.repeat(SHORT[:9], n), SHORT[100 : 100 + m]]), step)
        for n in (31, 32) for m in (31, 32, 33, 34) for step in (0.0, 0.1)
    ]  # fmt: skip
    found["free"] = is_dithered(runs, 0.0)
    assert_as_recorded("diagnosis/rounding", found)


def test_gaps_lengths_and_dead():
    found = {}
    values = SHORT.copy()
    values[[0, 1, 5, 3998, 3999]] = np.nan
    found["gap"] = gap_notices([channel(values)], 0.02)
    found["some"] = gap_notices([channel(np.where(SHORT > 1.0, np.nan, SHORT))], 0.02)
    found["most"] = gap_notices([channel(np.where(SHORT > -0.5, np.nan, SHORT))], 0.02)
    found["all"] = gap_notices([channel(values * np.nan), channel(SHORT, "b")], 0.5)
    found["lengths"] = [length_notice(n, 4.0) for n in (14_399, 14_400)]
    found["dead"] = dead_notice(channel(np.full(9, 0.25)))
    found["alive"] = dead_notice(channel(SHORT))
    found["gone"] = dead_notice(channel(np.full(9, np.nan)))
    assert_as_recorded("diagnosis/gaps", found)


def held(share, step=0.0, rng=5, size=4000):
    values = np.round(NOISE[:size] / step) * step if step else NOISE[:size].copy()
    again = np.flatnonzero(np.random.default_rng(rng).random(size) < share)
    for k in again[again > 0]:
        values[k] = values[k - 1]
    return values, step


def test_held_samples():
    found = {}
    for step in (0.0, 0.05, 0.3):
        for share in (0.004, 0.02, 0.1, 0.3):
            values, _ = held(share, step)
            found[f"{step} {share}"] = [*held_share(values, step, 1.0), leaves_runs(values)]
        found[f"from {step}"] = edge(
            lambda share, step=step: held_share(*held(share, step), 1.0)[0] > 0.0, 1e-3, 0.4, 9
        )
    lattice = np.round(NOISE[:4000] / 0.25) * 0.25 * (1 + 1e-3 * np.arange(4000) / 4000)
    found["lattice"] = [held_share(lattice, 0.0, scatter) for scatter in (0.5, 1.0, 2.0)]
    found["runs"] = [leaves_runs(np.where(np.arange(200) % n, NOISE[:200], np.nan))
                     for n in (15, 16, 17, 18)]  # fmt: skip
    found["notices"] = [
        held_notice("a", share, 0.01, is_even=even) for share in (0.04, 0.05, 0.06)
        for even in (True, False)
    ]  # fmt: skip
    assert_as_recorded("diagnosis/held", found)


def test_repeated_and_interpolated_samples():
    found = {}
    for times, start in ((1, 0), (2, 1), (3, 0), (5, 4)):
        one = channel(np.repeat(SHORT[:400], times)[start:], dt=0.005)
        seen = repetition(one)
        found[f"{times} times"] = [
            seen, seen and repetition_notice(one, seen), seen and thinned(one, seen).values[:4],
            seen and thinned(one, seen).dt,
        ]  # fmt: skip
    found["few"] = [repetition(channel(np.repeat(SHORT[:n], 2))) is not None for n in (64, 65, 66)]

    def filled(share, far=0.0, step=0.0):
        values = SHORT.copy()
        there = np.random.default_rng(4).random(4000) >= share
        place = np.arange(4000)
        values = np.interp(place, place[there], values[there])
        values += far * NOISE[4000:8000]
        return interpolation_notice(channel(np.round(values / step) * step if step else values))

    found["filled"] = [filled(share) for share in (0.0, 0.01, 0.03, 0.08, 0.3)]
    found["from"] = edge(filled, 1e-3, 0.1, 9)
    found["bad from"] = edge(lambda share: filled(share).severity == "bad", 0.03, 0.1, 9)
    found["whole from"] = edge(lambda share: filled(share).code == "interpolated", 0.05, 0.3, 9)
    found["near"] = edge(lambda far: filled(0.1, far), 1e-9, 1e-2, 9)
    found["step"] = edge(lambda step: filled(0.1, step=step), 1e-6, 1e-1, 9)
    slow = np.interp(np.arange(4000) * 0.37, np.arange(4000), SHORT)
    found["slow"] = interpolation_notice(channel(slow))
    found["line"] = interpolation_notice(channel(np.arange(4000.0)))
    found["short"] = [interpolation_notice(channel(slow[:n])) is not None for n in (65, 66, 67, 90)]
    assert_as_recorded("diagnosis/interpolated", found)
