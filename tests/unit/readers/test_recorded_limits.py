# ruff: noqa: E501 - tables
"""Where answers of the readers change: one number on either side of each limit."""

import numpy as np
import pytest

import gmwm
from gmwm import InputError, Recording
from gmwm.readers.at_rest.rotation import steady_turn, turning_gravity
from gmwm.readers.clock import Clock, timing_of
from gmwm.readers.clock.civil_time import is_time_of_day
from gmwm.readers.clock.jumps import Jumps
from gmwm.readers.clock.stamps import _unwrapped
from gmwm.readers.clock.tracking import follow
from gmwm.readers.clock.uneven import _bursts, followed
from gmwm.readers.layout import find_layout
from gmwm.readers.missing import without_sentinels
from gmwm.readers.reader import read
from recorded import assert_as_recorded, edge, first, refused

SI = {"gyro": "rad/s", "accel": "m/s^2"}
RNG = np.random.default_rng(17)
NOISE = RNG.normal(size=2000)
EVEN = np.arange(2000.0)


def clock(stamps, values=None):
    values = np.arange(stamps.size) if values is None else values

    def same(order):
        return np.append(False, values[order][1:] == values[order][:-1])

    return Clock("log", "column 't'", stamps, 1.0, "s", "line {}".format, same, stamps.size)


def outcome(stamps):
    try:
        found = timing_of(clock(stamps))
    except InputError as error:
        return [error.code, str(error)]
    return [found.rate, [notice.code for notice in found.notices], found.jumps.total]


def works(stamps):
    return not isinstance(outcome(stamps)[0], str)


def told(code, stamps):
    found = outcome(stamps)
    return code in (found[1] if isinstance(found[0], float) else found[0])


def test_limits_of_clocks():
    n = 600
    steps = np.arange(n) * 0.01
    found = {
        "sharp change": edge(
            lambda a: works(np.cumsum(np.where(np.arange(n) < 300, 1.0, a))), 1.2, 2.0, 12
        ),
        "slow change": edge(
            lambda a: works(np.cumsum(np.where(np.arange(n) < 300, a, 1.0))), 1.2, 2.0, 12
        ),
        "shown": edge(
            lambda a: "vary" in timing_of(clock(steps + a * 0.01 * NOISE[:n])).notices[0].text,
            1e-6, 1e-3, 12,
        ),
        "in us": edge(
            lambda a: " us rms" in timing_of(clock(EVEN[:n] * a * (1 + 1e-7 * EVEN[:n])
                                                   + 0.05 * a * NOISE[:n])).notices[0].text,
            1e-3, 0.5, 9,
        ),
        "fastest": edge(lambda rate: told("rate-unlikely", EVEN[:n] / rate), 100.0, 9e4, 14),
        "slowest": edge(lambda rate: told("rate-unlikely", EVEN[:n] / rate), 0.1, 100.0, 14),
        "one late": edge(
            lambda a: outcome((EVEN[:n] - a * (EVEN[:n] == 300)) * 0.01)[2:] == [0.0], 0.3, 0.99, 9
        ),
        "short": edge(
            lambda a: followed_too((EVEN[:n] + a * (EVEN[:n] == 300)) * 0.01), 0.3, 0.7, 12
        ),
        "long": edge(lambda a: outcome((EVEN[:n] + a * (EVEN[:n] > 300)) * 0.01)[2] > 0, 0.1, 1.0, 12),
        "shortest": [works(EVEN[:n] * step) for step in (0.5e-100, 2e-100, 0.5e100, 2e100)],
        "finest": edge(lambda a: works(a + EVEN[:n] * 0.01), 1e12, 1e16, 12),
        "wrap": edge(lambda a: _unwrapped(np.where(EVEN < 99, EVEN, EVEN - 2.0**16 + a)) is None,
                     2.0, 400.0, 12),
        "wrap back": edge(lambda a: _unwrapped(np.where(EVEN < 99, EVEN, EVEN - 2.0**16 - a)) is None,
                          0.01, 400.0, 12),
        "set": [
            works(sum((10 + 1990 * k / count < EVEN) * 5000.0 for k in range(count)) + EVEN)
            for count in range(1, 9)
        ],
        "set back": [
            works(EVEN - sum((10 + 1990 * k / count < EVEN) * 80.0 for k in range(count)))
            for count in range(1, 9)
        ],
    }  # fmt: skip
    for share in (0.005, 0.01, 0.03):
        lost = EVEN[RNG.random(2000) > share]
        found[f"lost {share}"] = outcome((lost + 0.1 * NOISE[: lost.size]) * 0.01)
        found[f"half grid {share}"] = outcome(
            np.cumsum(1.0 + 0.5 * (np.random.default_rng(1).random(2000) < share)) * 0.01
        )
    assert_as_recorded("readers/limits_of_clocks", found)


def followed_too(stamps):
    try:
        return timing_of(clock(stamps)).jitter > 0.0 and bool(
            [n for n in timing_of(clock(stamps)).notices if n.code == "stamps-astray"]
        )
    except InputError:
        return True


def test_uneven_clocks_row_by_row():
    found = {}
    for name, stamps in {
        "jitter": EVEN + 0.3 * NOISE, "lost": (EVEN + 0.2 * NOISE)[np.abs(NOISE) < 1.7],
        "set": EVEN + 0.2 * NOISE - 90.0 * (EVEN > 700), "ahead": EVEN + 0.2 * NOISE + 9e4 * (EVEN > 700),
        "bursts": EVEN // 3 * 3 + 0.05 * np.repeat(NOISE[:667], 3)[:2000], "stall": np.maximum(EVEN, 740.0 * ((EVEN > 700) & (EVEN < 740))) + 0.1 * NOISE,
        "twice": np.insert(EVEN, [500, 900], [499, 899]) + 0.0, "fast": EVEN * 1.3 + 0.1 * NOISE,
        "drift": EVEN * (1 + 1e-6 * EVEN) + 0.1 * NOISE, "short": (EVEN + 0.3 * NOISE)[:80],
    }.items():  # fmt: skip
        same = np.append(False, np.diff(stamps) == 0.0)
        one = followed(stamps, same if name == "twice" else same & False, stamps.size)
        found[name] = one and [
            one.interval, one.burst, one.is_a_clock, one.advance, np.flatnonzero(one.is_set), one.late,
        ]  # fmt: skip
    found["bursts of"] = [_bursts(np.array(stamps))[0] for stamps in (
        [0, 0, 1, 1, 2, 2], [0, 1, 1, 2, 3], [0, 0, 0, 1, 1, 1, 2, 2], [0, 1, 1, 2, 2, 3])]  # fmt: skip
    still = [followed(np.append(np.zeros(n), 1.0 + np.arange(2000 - n)), np.zeros(2000, dtype=bool), 2000) is None
             for n in (249, 250, 251, 252)]  # fmt: skip
    found["stands"] = still
    assert_as_recorded("readers/followed", found)


def test_following_a_chunk_at_a_time():
    found = {}
    n = 1500
    noise = NOISE[:n]
    base = EVEN[:n] + 0.1 * noise
    costs = np.array([5.0, 5.0, 25.0, 8.0, 0.0])
    for name, x in {
        "even": base, "lost": np.delete(base, [299, 300, 301, 600, 601, 650, 900]), "set": base - 40.0 * (EVEN[:n] > 598),
        "far": base + 40.0 * (EVEN[:n] > 301), "stall": np.maximum(base, 640.0 * (np.abs(EVEN[:n] - 620) < 20)),
        "gaps": base + 2.0 * (EVEN[:n] > 295) + 3.0 * (EVEN[:n] > 305) + 4.0 * (EVEN[:n] > 310) + 5.0 * (EVEN[:n] > 599),
        "twice": np.insert(base, [300, 600, 601], base[[299, 599, 600]]), "noisy": EVEN[:n] + 0.45 * noise,
    }.items():  # fmt: skip
        same = np.append(False, np.diff(x) == 0.0)
        for chunk, sigma, memory, age, limit, more in (
            (300, 0.1, 128, 16, 1e3, 0.0), (2000, 0.3, 1024, 16, 30.0, 5.0), (301, 0.1, 64, 64, 1e3, 5.0),
        ):  # fmt: skip
            advance, is_set = np.zeros(x.size, dtype=np.int64), np.zeros(x.size, dtype=bool)
            spent = follow(x, same, limit, float(x[0]), sigma, memory, age,
                           np.append(costs[:4], more), advance, is_set, chunk)  # fmt: skip
            found[f"{name} {chunk}"] = [spent, advance, np.flatnonzero(is_set)]
    assert_as_recorded("readers/follow", found)


def test_limits_of_columns(tmp_path):
    path = tmp_path / "a.csv"
    found = {}
    rows = np.column_stack(
        [0.01 * np.arange(200), RNG.normal(size=(200, 6)) * 0.01 + [0, 0, 0, 0, 0, 9.8]]
    )
    names = "time_s,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z"

    def outcome_of(extra, label):
        lines = [
            ",".join(f"{v:.6g}" for v in (*row, more))
            for row, more in zip(rows, extra, strict=True)
        ]
        path.write_text("\n".join([f"{names},{label}", *lines, ""]))
        try:
            return len(read(path, units=SI))
        except InputError as error:
            return error.code

    k = np.arange(200)
    found["turns"] = [outcome_of(k // every % 2, "imu_id") for every in (8, 9, 10, 11, 12)]
    found["sensors"] = [outcome_of(k % several, "id") for several in (1, 2, 16, 17)]
    found["named"] = [
        outcome_of(k % 2, name) for name in ("sensor", "device_id", "inst", "identity")
    ]

    def beyond(value):
        changed = rows.copy()
        changed[50, 1] = value
        path.write_text(
            "\n".join([names, *(",".join(f"{v:.9g}" for v in row) for row in changed), ""])
        )
        return any(notice.code == "sentinel" for notice in read(path, units=SI).notices)

    found["beyond"] = edge(beyond, 1e3, 1e9, 9)
    lines = [f"{j},1\n" for j in range(130)]
    for at in (98, 99, 100, 101):
        text = "".join([*lines[:at], "x,1\n", *lines[at:]])
        found[f"layout {at}"] = len(find_layout("a", text.encode()).notices)
    dated = ["2024-01-01T00:00:00,1\n"] * 130
    for at in (98, 99, 100, 101):
        found[f"dates {at}"] = list(
            find_layout("a", "".join([*dated[:at], "5,1\n", *dated[at:]]).encode()).dates
        )
    for step in (9e-6, 1.1e-5, 59.0, 61.0):
        made = np.zeros(80, gmwm.readers.binary.LAYOUTS["KF-GINS"].record)
        made["time"] = step * np.arange(80)
        (tmp_path / "a.dat").write_bytes(made.tobytes())
        found[f"binary {step}"] = refused(lambda: read(tmp_path / "a.dat", layout="KF-GINS").rate)
    assert_as_recorded("readers/limits_of_columns", found)


def test_limits_of_the_day_of_codes_and_of_bursts():
    found = {}
    for every in (9, 10, 11, 12, 60):
        minutes = np.arange(400) // every
        found[f"day {every}"] = is_time_of_day(
            minutes * 100.0 + np.arange(400) % every * (60.0 / every)
        )
    for wrong in (1, 2, 3, 4):
        minutes = np.arange(240) // 60
        stamps = minutes * 100.0 + np.arange(240) % 60
        for k in range(1, wrong):
            stamps[60 * k :] += 1.0
        found[f"uneven {wrong}"] = is_time_of_day(stamps)
    base = NOISE[:900] * 0.1
    for beside in range(8):
        values = base.copy()
        values[50:850:80] = 77.5
        values[51 : 51 + 80 * beside : 80] = 40.0 + np.arange(beside)
        found[f"beside {beside}"] = int(np.isnan(without_sentinels("a", values, 1e6, str)[0]).sum())
        values = base.copy()
        values[50:850:80] = 77.5
        values[60 : 60 + 80 * beside : 80] = 70.0 + np.arange(beside)
        found[f"near {beside}"] = int(np.isnan(without_sentinels("a", values, 1e6, str)[0]).sum())
    found["narrow"] = edge(
        lambda a: without_sentinels("a", np.where(EVEN % 400 == 7, a, np.round(NOISE) * (EVEN % 9 == 0)), 1e6, str)[1],
        1.0, 300.0, 12,
    )  # fmt: skip
    for count in (19, 20, 21, 22):
        for length in (31, 32, 33):
            rows = np.arange(1, count + 1) * length
            jumps = Jumps(rows, np.full(count, 9.0), np.full(count, 8.0), 1.0)
            found[f"bursts {count} {length}"] = jumps.are_bursts
    for odd in range(6):
        rows = np.arange(1, 42) * 8
        missing = np.where(np.arange(41) < odd, 7.0, 8.0)
        found[f"odd bursts {odd}"] = Jumps(rows, missing + 1, missing, 1.0).are_bursts
        found[f"odd rhythm {odd}"] = Jumps(
            rows, missing * 0 + 2, np.where(np.arange(41) < odd, 2.0, 1.0), 1.0
        ).are_rounding
        some = rows + np.where(np.arange(41) % 6 < odd, np.round(4 * NOISE[:41]).astype(int), 0)
        found[f"odd places {odd}"] = Jumps(some, missing * 0 + 2, missing * 0 + 1, 1.0).are_rounding
    assert_as_recorded("readers/limits", found)


@pytest.mark.parametrize("rate", [0.05, 0.3])
def test_limits_of_turning(rate):
    t = np.arange(2000) / 50.0
    angle = rate * t
    found = {}

    def turned(noise, cone=1.0, stop=2000, gyro=1.0):
        force = 9.8 * np.stack(
            [np.sqrt(1 - cone**2) + 0 * t, cone * np.sin(angle), cone * np.cos(angle)]
        )
        force = force + noise * np.stack([np.roll(NOISE, k) for k in range(3)])
        turn = gyro * (np.stack([rate + 0 * t, 0 * t, 0 * t]) + 0.1 * np.sin(t))
        force[1, 300:400] = np.nan
        channels = {f"accel_{a}": x[:stop] for a, x in zip("xyz", force, strict=True)}
        channels |= {f"gyro_{a}": x[:stop] for a, x in zip("xyz", turn, strict=True)}
        return Recording.from_arrays(channels, 50.0, SI)

    found["noise"] = edge(lambda a: steady_turn(turned(a), 50) > 0.0, 0.01, 90.0, 10)
    found["cone"] = edge(lambda a: steady_turn(turned(1e-4, a), 50) > 0.0, 1e-3, 0.9, 10)
    found["short"] = first(lambda n: steady_turn(turned(1e-3, stop=n), 50) > 0.0, range(100, 2001))
    found["rates"] = [
        steady_turn(turned(noise), size) for noise in (0.01, 1.0) for size in (10, 50)
    ]
    found["gravity"] = [
        turning_gravity(turned(0.1, gyro=g), 50, parts) for g in (1.0, 2.0) for parts in (1, 3)
    ]
    found["few"] = [turning_gravity(turned(0.1, stop=n), 50) is None for n in (199, 200, 201)]
    assert_as_recorded(f"readers/turning_{rate}", found, rtol=1e-4)
