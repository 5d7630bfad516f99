# ruff: noqa: E501 - tables of stamps
"""Clocks of all sorts, and sensors at rest: rate, jumps and notices in full, and their edges."""

import numpy as np
import pytest

from gmwm import InputError, Recording
from gmwm.readers.at_rest import rest_notices
from gmwm.readers.at_rest.rotation import block_means, steady_turn, turning_gravity
from gmwm.readers.binary import layout_of
from gmwm.readers.clock import Clock, Jumps, timing_of
from gmwm.readers.clock.beat import without_beat
from gmwm.readers.clock.civil_time import is_time_of_day, seconds_of_day, without_summer_time
from gmwm.readers.clock.jumps import find_change, find_jumps, find_shifts
from gmwm.readers.clock.line import interval_of
from gmwm.readers.clock.stamps import _unwrapped
from gmwm.readers.clock.unit_of_time import without_unit
from gmwm.readers.missing import without_sentinels
from recorded import assert_as_recorded, edge, first, refused, to_nine_places

N = 1200
RNG = np.random.default_rng(9)
NOISE = RNG.normal(size=N)
EVEN = np.arange(N)
U = RNG.random(N)


def lost(*places, stamps=EVEN):
    return np.delete(stamps, list(places))


def shifted(at, by, stamps=EVEN):
    return stamps + by * (np.arange(stamps.size) >= at)


STAMPS = {
    "even": EVEN * 0.01, "jitter": (EVEN + 0.05 * NOISE) * 0.01, "one lost": lost(500) * 0.01,
    "three lost": lost(100, 500, 501, 900) * 0.01, "ends": lost(1, 1197) * 0.01,
    "half lost": lost(*range(300, 905)) * 0.01, "more lost": lost(*range(200, 905)) * 0.01,
    "far": shifted(600, 1e6) * 0.01, "off grid": shifted(600, 3.4) * 0.01,
    "off grid below": shifted(600, 3.24) * 0.01, "shift": shifted(600, 0.45) * 0.01,
    "many off grid": sum(shifted(k, 1.4) for k in range(0, 1100, 60)) / 19 * 0.01,
    "late": (EVEN + 3.0 * (EVEN == 700) + 0.6 * (EVEN == 800)) * 0.01,
    "noisy": (EVEN + 0.3 * NOISE) * 0.01, "noisy lost": (EVEN + 0.3 * NOISE)[U > 0.03] * 0.01,
    "wild": (EVEN + 3.0 * NOISE) * 0.01, "bursts": (EVEN // 4 * 4 + 3) * 0.01,
    "bursts lost": (EVEN // 4 * 4 + 3)[U > 0.01] * 0.01, "pairs": np.repeat(EVEN[:600], 2) * 0.01,
    "close bursts": (EVEN // 8 * 8 + 1e-3 * (EVEN % 8)) * 0.01,
    "set back": shifted(600, -300.0) * 0.01, "set ahead": shifted(600, 5000.0) * 0.01,
    "twice": np.insert(EVEN, [300, 700], [299, 699]) * 0.01,
    "rate changes": np.cumsum(np.where(EVEN < 600, 1.0, 1.3)) * 0.01,
    "rate jumps": np.cumsum(np.where(EVEN < 600, 1.0, 1.6)) * 0.01,
    "rounded": np.round(EVEN * 1.4) * 1e-3, "coarse": np.floor(EVEN / 3.3) * 0.01,
    "in turns": (EVEN + 0.2 * (EVEN % 2)) * 0.01, "in turns lost": lost(101, 400, stamps=EVEN + 0.2 * (EVEN % 2)) * 0.01,
    "wrapped": (EVEN * 100.0 + 1000.0) % 2.0**16 * 1e-4, "slow": EVEN * 5.0, "fast": EVEN * 2e-5,
    "too fast": EVEN * 1e-5, "constant": EVEN * 0.0, "backwards": -EVEN * 0.01,
    "reordered": EVEN[np.argsort(EVEN + 20.0 * U)] * 0.01, "one back": np.where(EVEN == 500, 0, EVEN) * 0.01,
    "stalls": (EVEN + np.maximum(0, 20.0 - np.abs(EVEN % 400 - 200))) * 0.01,
    "nan": np.where(EVEN == 5, np.nan, EVEN), "nans": np.where(EVEN % 9 == 5, np.nan, EVEN),
    "copies": np.concatenate([EVEN[:300], EVEN[250:]]) * 0.01, "huge": EVEN * 1e200,
    "large": 1.7e9 + EVEN * 0.01, "finest": 1e15 + EVEN * 0.5,
}  # fmt: skip


def clock(stamps, seconds=1.0, unit="s", column="column 't'", values=None):
    values = np.arange(stamps.size) if values is None else values

    def same(order):
        return np.append(False, values[order][1:] == values[order][:-1])

    return Clock("log", column, stamps, seconds, unit, "line {}".format, same, stamps.size)


def timed(given, expected=None):
    found = refused(lambda: timing_of(given, expected))
    if isinstance(found, list):
        return found
    jumps = found.jumps
    samples = jumps.sample(np.arange(0, given.stamps.size, 97))
    spread = jumps.spread(given.stamps * 0 + 1.0)
    return {
        "rate": found.rate, "jitter": round(found.jitter, 9), "interval": jumps.interval,
        "notices": to_nine_places(found.notices), "repeated": jumps.repeated, "set": jumps.set_at,
        "jumps": [jumps.rows, np.round(jumps.steps, 9), jumps.missing, jumps.off_grid],
        "samples": [int(samples.sum()), float(np.nansum(spread * np.arange(spread.size)))],
    }  # fmt: skip


def test_clocks():
    found = {name: timed(clock(stamps)) for name, stamps in STAMPS.items()}
    repeats = np.repeat(np.arange(600), 2)
    found["pairs again"] = timed(clock(STAMPS["pairs"], values=repeats))
    found["twice again"] = timed(
        clock(STAMPS["twice"], values=np.insert(EVEN, [300, 700], [299, 699]))
    )
    copied = np.concatenate([EVEN[:300], EVEN[250:]])
    found["copies again"] = timed(clock(STAMPS["copies"], values=copied))
    for step in (0.01, 10.0, 1e4, 1e7, 3e-4, 1e12):
        for expected, unit in ((None, ""), (100.0, ""), (7.0, ""), (100.9, "foo")):
            some = clock(EVEN[:200] * step, None, unit)
            found[f"unit {step} {expected} {unit}"] = timed(some, expected)
    found["in ms"] = timed(clock(lost(50) * 10.0, 1e-3, "ms"))
    for bits in (16, 32):
        wrapped = (EVEN * 100.0 * 2.0 ** (bits - 16) + 1000.0) % 2.0**bits
        found[f"wraps {bits}"] = timed(clock(wrapped, 1e-4 * 2.0 ** (16 - bits), "us"))
    assert_as_recorded("readers/clocks", found)


def test_where_clocks_change():
    def rate(stamps):
        return timing_of(clock(stamps)).rate

    def told(code, stamps):
        try:
            return any(notice.code == code for notice in timing_of(clock(stamps * 0.01)).notices)
        except InputError as error:
            return error.code == code

    found = {
        "shift": edge(lambda a: told("clock-shifts", shifted(600, a)), 0.1, 0.49, 9),
        "noisy shift": edge(
            lambda a: told("clock-shifts", shifted(600, a, EVEN + 0.08 * NOISE)), 0.01, 0.49, 9
        ),
        "jump": edge(lambda a: told("clock-jumps", shifted(600, a)), 0.1, 1.5, 9),
        "off grid": edge(lambda a: told("clock-off-grid", shifted(600, a)), 3.01, 3.49, 12),
        "change": edge(
            lambda a: told("rate-changes", np.cumsum(np.where(EVEN < 600, 1.0, 1.0 + a))),
            1e-3, 0.4, 12,
        ),
        "noisy change": edge(
            lambda a: told(
                "rate-changes", np.cumsum(np.where(EVEN < 600, 1.0, 1.0 + a) + 0.1 * NOISE)
            ), 1e-3, 0.4, 12,
        ),
        "beat": edge(lambda a: told("stamps-in-turns", EVEN + a * (EVEN % 2)), 0.05, 0.3, 10),
        "no clock": edge(lambda a: told("clock", EVEN + a * NOISE), 0.1, 9.0, 5),
        "astray": edge(lambda a: told("stamps-astray", EVEN + a * (EVEN == 500)), 0.6, 99.0, 6),
        "units": [
            edge(lambda s: without_unit("log", "column 't'", s) is None, low, high)
            for low, high in ((1e-7, 1e-3), (1e-3, 90.0))
        ],
        "shortest": first(lambda n: find_change(np.cumsum(np.where(np.arange(n) < n // 2, 1.0, 2.0))),
                          range(40, 200)),
        "parts": first(lambda n: find_shifts(shifted(n // 2, 0.4, np.arange(n) * 1.0),
                                             find_jumps(np.arange(n) * 1.0)), range(300, 900)),
    }  # fmt: skip
    assert rate(STAMPS["jitter"]) == pytest.approx(100.0, rel=1e-4)
    assert_as_recorded("readers/clock_edges", found)


def test_parts_of_clocks():
    found = {}
    for name in ("noisy", "jitter", "even", "late"):
        x = STAMPS[name]
        found[f"line {name}"] = [
            interval_of(x, EVEN, EVEN < 0), interval_of(x, EVEN, EVEN == 400),
            interval_of(x, EVEN * 2, (EVEN == 10) | (EVEN == 900)),
        ]  # fmt: skip
        shifts = find_shifts(shifted(650, 0.004, shifted(300, 0.005, x)), find_jumps(EVEN * 0.01))
        found[f"shifts {name}"] = shifts
    for share in (0.1, 0.13, 0.2, 0.41, 0.43):
        for x in (EVEN + 2 * share * (EVEN % 2), EVEN - 2 * share * (EVEN % 2)):
            beat = without_beat(lost(7, 300, 301, stamps=x)[:200])
            found[f"beat {share} {x[1] > 1}"] = beat and [beat.share, np.round(beat.stamps, 6)[:12],
                                                          float(np.sum(beat.stamps))]  # fmt: skip
    found["beats"] = [
        edge(lambda a: without_beat(EVEN + 0.4 * (EVEN % 2) + a * NOISE), 1e-3, 1.0, 12),
        first(lambda n: without_beat(np.arange(n) + 0.4 * (np.arange(n) % 2)), range(50, 80)),
        first(lambda n: without_beat(lost(*range(20, 20 + 7 * n, 7), stamps=EVEN + 0.4 * (EVEN % 2))) is None,
              range(160)),
    ]  # fmt: skip
    for rows in (
        [10, 20, 30, 40], [10, 20, 30, 41], [10, 21, 30, 39, 50, 61], [10, 20, 30], [7, 14, 29, 36, 43],
        list(range(8, 300, 8)), list(range(8, 170, 8)), [*range(8, 300, 8), 302], list(range(40, 1200, 40)),
    ):  # fmt: skip
        for missing in (1.0, 3.0):
            jumps = Jumps(
                np.array(rows), np.full(len(rows), missing + 1.2), np.full(len(rows), missing), 1.0
            )
            found[f"{rows[:4]} {len(rows)} {missing}"] = [
                jumps.are_rounding, jumps.are_bursts, jumps.total, jumps.longest, jumps.off_grid,
            ]  # fmt: skip
    jumps = Jumps(np.array([3, 8]), np.array([3.0, 2.3]), np.array([2.0, 1.0]), 1.0, np.array([5]))
    found["spread"] = [str(jumps.spread(np.arange(12.0))), jumps.sample(np.arange(-1, 12))]
    inner = jumps.among(np.arange(0, 40, 2), np.array([1, 9]))
    found["among"] = [inner.rows, inner.repeated, inner.set_at]
    for bits, stamps in (
        (16, EVEN * 130.0),
        (32, EVEN * 9e6),
        (16, EVEN // 2 * 300.0),
        (16, EVEN * 9e3),
    ):
        some = _unwrapped(stamps % 2.0**bits)
        found[f"wrap {bits} {stamps[2]}"] = (
            None if some is None else float(np.max(np.abs(some - stamps)))
        )
    for stamps in (105950.0 + EVEN[:60] * 0.5, 235950.0 + EVEN[:60]):
        found[f"day {stamps[0]}"] = [is_time_of_day(stamps), float(seconds_of_day(stamps)[-1])]
    seconds = 86390.0 + EVEN[:400] * 0.5
    day = seconds % 86400.0
    digits = day // 3600 * 1e4 + day % 3600 // 60 * 100 + day % 60
    found["digits"] = [is_time_of_day(digits), seconds_of_day(digits)[[0, 19, 20, 399]]]
    for k, bad in enumerate(
        (digits - 1e5, digits + 9e5, digits * 1.0001, digits[:3], digits[:100:30])
    ):
        found[f"no day {k}"] = is_time_of_day(bad)
    for by in (3600.0, -3600.0, 3600.24, 3600.26, 3590.0, 7200.0):
        stamps, told = without_summer_time(shifted(600, by, EVEN * 0.1), "line {}".format)
        found[f"summer {by}"] = [float(stamps[-1]), told]
    twice = shifted(900, -3600.0, shifted(300, 3600.0, EVEN * 4.0))
    found["summer"] = [float(without_summer_time(twice, str)[0][-1]),
                       without_summer_time(shifted(100, 3600.0, twice), str)[1],
                       without_summer_time(shifted(600, 3607.0, EVEN * 4.0), str)[1]]  # fmt: skip
    assert_as_recorded("readers/parts_of_clocks", found)


def test_sentinels():
    found = {}
    base = NOISE[:600] * 0.1
    where = "line {}".format
    for code in (999.0, -999.25, -99.99, 99.0, 9999999.0, 99999999.0, 32767.0, -32768.0, 65535.0,
                 8388607.0, 2.0**31, -(2.0**63), 77.5, 3e7, -3e7, 2.0, 1.5):  # fmt: skip
        for count in (2, 3):
            values = base.copy()
            values[np.linspace(5, 590, count).astype(int)] = code
            clean, told = without_sentinels("a", values, 1e7, where)
            found[f"{code} {count}"] = [int(np.sum(np.isnan(clean))), told]
    for name, k in (("from", 3), ("pair", 1)):
        found[name] = [
            edge(lambda c, k=k: without_sentinels(
                "a", np.where(np.isin(np.arange(600), [50, 300, 420][:k]), c, base), 1e7, where)[1],
                0.5, 90.0, 12),
        ]  # fmt: skip
    ramp = base.copy()
    ramp[100:130] = np.abs(np.arange(30) - 15.0) * 5
    ramp[300:400:20] = 50.0
    found["passing"] = without_sentinels("a", ramp, 1e7, where)[1]
    some = np.where(np.arange(600) % 9 == 0, 999.0, np.round(base, 1) * 0)
    found["constant"] = without_sentinels("a", some, 1e7, where)[1]
    found["most"] = [
        without_sentinels("a", np.where(np.arange(600) < n, -9999.0, base), 1e7, where)[1][
            0
        ].severity
        for n in (60, 61)
    ]
    assert_as_recorded("readers/sentinels", found)


ACCEL = RNG.normal(size=(3, N)) * 1e-2 + np.array([[0.1], [-0.2], [9.8]])
GYRO = RNG.normal(size=(3, N)) * 1e-3
SI = {"gyro": "rad/s", "accel": "m/s^2"}
IN_SI = {f"{s}_{a}": u for s, u in SI.items() for a in "xyz"}


def at_rest(gyro=GYRO, accel=ACCEL, units=IN_SI, given=SI, columns=False, layout=False, rate=100.0):
    from gmwm._core.units import SI_UNIT, factor

    rows = zip("xyz", gyro, strict=True), zip("xyz", accel, strict=True)
    channels = {f"gyro_{a}": x for a, x in rows[0]} | {f"accel_{a}": x for a, x in rows[1]}
    scaled = {name: x * factor(units[name], SI_UNIT[name[:-2]]) for name, x in channels.items()}
    recording = Recording.from_arrays(scaled, rate, SI, source="log")
    return refused(lambda: rest_notices(recording, units, given, columns, has_layout=layout))


def test_sensors_at_rest():
    found = {}
    swapped = {"gyro": ACCEL, "accel": GYRO}
    for name, more in {
        "right": {}, "in g": {"accel": ACCEL / 9.80665}, "in mg": {"accel": ACCEL * 102.0, "given": {}},
        "in g, not given": {"accel": ACCEL / 9.80665, "given": {}}, "swapped": swapped,
        "swapped, given": swapped | {"columns": True}, "none": {"accel": ACCEL - ACCEL.mean(1)[:, None]},
        "twice": {"accel": 2.0 * ACCEL}, "half": {"accel": 0.5 * ACCEL, "layout": True, "given": {}},
        "tenth": {"accel": 0.15 * ACCEL, "layout": True, "given": {}}, "increments": {"accel": 0.01 * ACCEL},
        "gyro g units": {"units": {**IN_SI, "gyro_x": "deg/s", "gyro_y": "deg/s", "gyro_z": "deg/s"}},
        "mixed": {"units": {**IN_SI, "gyro_x": "deg/s"}}, "turning": {"gyro": GYRO + 0.06},
        "loud": {"gyro": 100.0 * GYRO}, "large": {"gyro": GYRO + 1.0},
        "fog": {"gyro": GYRO * 1e-3 + 1e-3}, "earth": {"gyro": GYRO * 1e-5 + 7.29e-5 * 57.3 / 3**0.5},
        "dead": {"gyro": GYRO * 0.0}, "holes": {"gyro": np.where(U < 0.5, np.nan, GYRO + 0.06)},
    }.items():  # fmt: skip
        found[name] = at_rest(**more)

    def told(code, **more):
        return any(getattr(each, "code", "") == code for each in at_rest(**more))

    found["edges"] = [
        edge(lambda a: told("mean-rate", gyro=GYRO + a), 1e-2, 0.2, 9),
        edge(lambda a: told("gyro-unit", gyro=GYRO * a), 1.0, 900.0, 9),
        edge(lambda a: told("gyro-unit", gyro=GYRO + a), 0.1, 9.0, 9),
        edge(lambda a: told("gyro-unit", gyro=GYRO * 4e-3 + a), 4.2e-5, 1e-2, 9),
        edge(lambda a: told("gyro-unit", gyro=GYRO * 1e-3 + a), 4.2e-5, 1e-4, 9),
        edge(lambda a: told("gyro-unit", gyro=GYRO * a + 4.2e-5), 1e-8, 1e-4, 9),
        edge(lambda a: told("gyro-unit", gyro=GYRO * a + 1e-3), 1e-4, 1.0, 9),
        edge(lambda a: told("gyro-unit", gyro=GYRO * 1e-5 + 7.292115e-5 * 57.29578 / 3**0.5 * a), 0.9, 1.0, 9),
        edge(lambda a: told("gravity", accel=ACCEL * a), 1.0, 1.8, 9),
        edge(lambda a: told("gravity", accel=ACCEL * a), 0.3, 1.0, 9),
        edge(lambda a: told("gravity", accel=ACCEL * a), 0.05, 0.3, 9),
        edge(lambda a: told("gravity", accel=ACCEL * 0.5 + a * NOISE), 0.1, 5.0, 9),
        edge(lambda a: told("swapped", gyro=ACCEL * a, accel=GYRO, columns=True), 1.0, 1.2, 9),
        edge(lambda a: told("swapped", gyro=ACCEL + a * NOISE, accel=GYRO, columns=True), 0.05, 3.0, 9),
        edge(lambda a: told("swapped", gyro=ACCEL, accel=ACCEL * a, columns=True), 1.0, 1.4, 9),
        edge(lambda a: isinstance(at_rest(accel=ACCEL * a, layout=True, given={}), list), 0.21, 0.9, 9),
        edge(lambda a: isinstance(at_rest(accel=ACCEL * a, layout=True, given={}), list), 1.2, 3.0, 9),
    ]  # fmt: skip
    t = EVEN / 100.0
    for rate in (0.02, 0.3, 2.0):
        for unit in (1.0, 57.3, 0.3):
            angle = rate * t
            force = 9.8 * np.stack([0 * t, np.sin(angle), np.cos(angle)]) + ACCEL * 0.01
            turn = np.stack([0 * t + rate, 0 * t, 0 * t]) * np.sin(t) * unit + GYRO * 0.1
            angle = rate * (1.0 - np.cos(t))
            swings = 9.8 * np.stack([0 * t, np.sin(angle), np.cos(angle)]) + ACCEL * 0.01
            channels = {f"gyro_{a}": x for a, x in zip("xyz", turn, strict=True)}
            for kind, values in (("turns", force), ("swings", swings)):
                more = {f"accel_{a}": x for a, x in zip("xyz", values, strict=True)}
                recording = Recording.from_arrays(channels | more, 100.0, SI)
                found[f"{kind} {rate} {unit}"] = [
                    steady_turn(recording, 100), turning_gravity(recording, 50),
                    turning_gravity(recording, 50, 4), at_rest(gyro=turn, accel=values),
                ]  # fmt: skip
    holes = np.where(np.arange(24) % 8 < np.arange(24) // 8 * 3, np.nan, np.arange(24.0))
    found["blocks"] = str(block_means([holes, np.arange(24.0)], 8))
    assert_as_recorded("readers/at_rest", found)


def test_layouts():
    found = {}
    for text in ("IMAR", "ln200", "LN200IG", "IXSEA", "navchip_int", "NAVCHIP_FLT", "kf-gins", "int16,1e-4,1e-3",
                 "float32,1,2,rates,big", "float64, 1, 2, little", "int64,1,1,increments", "int8,1,1",
                 "int16,1", "int16,0,1", "int16,1,0", "int16,1e999,1", "int16,1,1e999", "int16,1.2.3,1",
                 "int32,1,1,odd", "int32,-1,1", ""):  # fmt: skip
        made = refused(lambda t=text: layout_of(t))
        found[text] = made if isinstance(made, list) else [made, str(made.record)]
    assert_as_recorded("readers/layouts", found)
