# ruff: noqa: E501 - tables
"""Motion, rest, vibration and whole recordings: every stretch, and where each begins."""

import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np

import gmwm
from gmwm import Recording
from gmwm.diagnosis.check import _clock, _unusable
from gmwm.diagnosis.motion import find_motion, motion_notices
from gmwm.diagnosis.motion.motion import (
    Motion,
    Move,
    _angle,
    _changing,
    _fastest,
    _runs,
    _smooth,
    _still,
    _tilts_slowly,
    _white,
    is_moved_with,
)
from gmwm.diagnosis.still import Still, find_still, rest_of, vibration_notice
from gmwm.diagnosis.still.blocks import blocks_of
from gmwm.diagnosis.still.loudness import _changes, _split, loudness
from gmwm.diagnosis.still.stretches import (
    _floor,
    _has_band,
    _quiet,
    _runs as quiet_runs,
)
from recorded import assert_as_recorded, edge, first, summed

RATE, SECONDS = 50.0, 60
N = int(RATE * SECONDS)
RNG = np.random.default_rng(21)
NOISE = RNG.normal(size=(6, N))
UNITS = {"gyro": "rad/s", "accel": "m/s^2", "temperature": "degC"}
NAMES = ("gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z")
T = np.arange(N) / RATE


def record(rates=None, angle=0.0, noise=NOISE, names=NAMES, **more):
    """At rest but for rates about x, rad/s, and a tilt about it, rad."""
    rows = noise * np.array([[1e-3]] * 3 + [[1e-2]] * 3)
    rows[0] += 0.0 if rates is None else rates
    rows[4] += 9.8 * np.sin(angle)
    rows[5] += 9.8 * np.cos(angle)
    channels = {name: row for name, row in zip(NAMES, rows, strict=True) if name in names}
    return Recording.from_arrays(channels | more, RATE, UNITS, source="log")


def between(a, b, height=1.0):
    return np.where((a <= T) & (b > T), height, 0.0)


def step_at(a, height):
    return np.where(a <= T, height, 0.0)


def answers(recording):
    motion, still = find_motion(recording), find_still(recording)
    told = rest_of(recording)
    return {
        "motion": summed([motion.moves, motion.static]), "steady": motion.turns_steadily,
        "still": summed(still), "total": still.total,
        "notices": [*motion_notices(motion), told and told.notice(), vibration_notice(recording)],
    }  # fmt: skip


LOGS = {
    "rest": {}, "turn": {"rates": between(20, 30, 0.5)},
    "tilt": {"angle": step_at(25, 0.1)},
    "long move": {"rates": between(12, 44, 0.1), "angle": step_at(30, 0.4)},
    "begins moving": {"rates": between(0, 11, 1.0)},
    "short rests": {"rates": sum(between(a, a + 4, 0.3) for a in range(3, 60, 11))},
    "never": {"rates": 0.5 * np.sin(T)}, "slow tilt": {"angle": 0.2 * T / 60},
    "sways": {"angle": 0.05 * np.sin(T / 4), "rates": 0.05 / 4 * np.cos(T / 4)},
    "steady": {"angle": T / 5, "rates": np.full(N, 0.2)},
    "gyro only": {"rates": between(20, 30, 0.5), "names": NAMES[:3]},
    "accel only": {"angle": step_at(25, 0.1), "names": NAMES[3:]},
}  # fmt: skip


def test_motion_and_rest():
    found = {name: answers(record(**log)) for name, log in LOGS.items()}
    gappy = NOISE.copy()
    gappy[2, 700:900], gappy[1, :60] = np.nan, np.nan
    found["gaps"] = answers(record(between(40, 50, 0.2), noise=gappy))
    loud = NOISE * np.where((T > 20) & (T < 42), 3.0, 1.0)
    found["loud"] = answers(record(noise=loud))
    humming = NOISE + 4.0 * np.sin(12.0 * 2 * np.pi * T) * ((T > 5) & (T < 30))
    found["humming"] = answers(record(between(30, 33, 0.5), noise=humming))
    short = [record(noise=NOISE)[name].values for name in NAMES]
    for n in (1499, 1500, 96, 95):
        cut = Recording.from_arrays(
            {name: x[:n] for name, x in zip(NAMES, short, strict=True)}, RATE, UNITS
        )
        found[f"of {n}"] = [find_motion(cut).static, blocks_of(cut) is None, find_still(cut)]
    assert_as_recorded("diagnosis/motion", found)


def test_where_motion_begins():
    def moves(**log):
        return bool(find_motion(record(**log)).moves)

    found = {
        "turn": edge(lambda r: moves(rates=between(20, 40, r)), 1e-3, 0.5, 6),
        "noisy turn": edge(
            lambda r: moves(rates=between(20, 40, r), noise=100 * NOISE), 1e-2, 5.0, 9
        ),
        "tilt": edge(lambda a: moves(angle=step_at(30, a)), 1e-3, 0.5, 6),
        "slow tilt": edge(lambda a: moves(angle=a * T / 60), 1e-3, 0.5, 6),
        "sway": edge(
            lambda a: moves(angle=a * np.sin(T / 4), rates=a / 4 * np.cos(T / 4)), 1e-4, 0.1, 8
        ),
        "still sway": edge(
            lambda a: find_still(record(rates=a * np.sin(2.0 * T))).longest < 20, 1e-4, 0.5, 8
        ),
    }  # fmt: skip
    found["rest of"] = [
        [len(find_still(record(between(a, 40, 0.5))).stretches), find_still(record(between(a, 55, 0.5))).longest]
        for a in (9.6, 10.1, 10.6, 11.1)
    ]  # fmt: skip
    assert_as_recorded("diagnosis/motion_edges", found, rtol=1e-4)


def test_parts_of_motion():
    found = {}
    series = np.concatenate([np.zeros(20), np.ones(5), np.zeros(15)]) + 0.01 * NOISE[0, :40]
    found["changing"] = [
        np.flatnonzero(_changing(series, limit, least)) for limit, least in ((0.5, 0.0), (0.5, 1.0),
                                                                             (1e-4, 1e-9))
    ]  # fmt: skip
    found["changing from"] = edge(lambda limit: _changing(series, limit, 0.0).any(), 0.1, 9.0)
    found["changing least"] = edge(lambda least: _changing(series, 0.0, least).any(), 1e-3, 9.0)
    found["runs"] = _runs(np.array([True] * 10 + [False] + [True] * 9 + [False] * 3 + [True] * 11))
    found["smooth"] = _smooth(NOISE[:2, :9].T)
    holes = np.where(np.arange(N) % 7 == 3, np.nan, NOISE[0])
    found["white"] = [_white(x, 50) for x in (NOISE[0], holes, np.repeat(NOISE[0], 2), 0 * holes)]
    rate = np.repeat([[0.0], [0.01], [0.017], [0.018], [0.3]], 10, axis=0) + 0.001
    runs = [(0, 10), (10, 20), (20, 30), (30, 40), (40, 50)]
    found["still"] = [_still(rate, some) for some in (runs, runs[1:], [])]
    found["fastest"] = [
        _fastest(rate, runs[:1]), _fastest(rate, []), _fastest(rate[:, :0], []),
        _fastest(rate, runs[:2], slice(12, 33)),
    ]  # fmt: skip
    angles = np.repeat([0.0, 0.3], 10)
    force = 9.8 * np.stack([0 * angles, np.sin(angles), np.cos(angles)], axis=1)
    found["angle"] = [_angle(each) for each in (force, force[1:], force[:, :2], 0.499 * force)]
    found["weak"] = edge(lambda a: _angle(a * force) > 0.0, 0.1, 0.9)
    slow = 9.8 * np.linspace(0.0, 0.2, 60)[:, None] * np.array([[0.0, 1.0, 0.0]]) + [0.0, 0.0, 9.8]
    walk = np.cumsum(NOISE[:3, :60], axis=1).T
    found["slow"] = edge(lambda a: _tilts_slowly(slow + a * walk), 1e-3, 3.0)
    found["least tilt"] = edge(lambda a: _tilts_slowly(slow * [0.0, a, 1.0]), 0.05, 1.0)
    tilt = Move(10.0, 12.0, 2.0, 0.1, 0.2)
    found["is tilt"] = [
        edge(lambda a: replace(tilt, tilt=a).is_tilt, 1e-3, 1.0),
        edge(lambda a: replace(tilt, length=a).is_tilt, 1.0, 99.0),
    ]
    turn = Move(30.0, 40.0, 10.0, 1.0, 0.0)
    motion = Motion((tilt, turn), ((0.0, 10.0), (12.0, 30.0)))
    events = ((5, 9), (97, 103), (110, 115), (119, 125), (299, 300), (400, 401), (401, 402))
    found["joined"] = [motion.joined(events, 0.1), motion.outside(events, 0.1),
                       replace(motion, static=()).outside(events, 0.1)]  # fmt: skip
    many = tuple(Move(10.0 * k, 10.0 * k + k, 1.0 * k, 0.01 * k, 0.01 * k) for k in range(1, 6))
    for k, some in enumerate((many, many[:1], many[3:], (*many, tilt, replace(tilt, start=9.0)))):
        for steady in (False, True):
            found[f"notices {k} {steady}"] = motion_notices(Motion(some, motion.static, steady))
    found["no rest"] = motion_notices(Motion(many, ()))
    for jitter in (None, 0.0999, 0.1, 0.3, 0.301):
        found[f"jitter {jitter}"] = _clock(replace(record(), jitter=jitter))
    found["moved with"] = edge(
        lambda a: is_moved_with(gmwm.Channel("a", a * NOISE[0], 1.0, "gyro", "rad/s")), 1e3, 1e9
    )
    half = [np.where(np.arange(100) < n, np.nan, 1.0) for n in (50, 51)]
    found["missing"] = [is_moved_with(gmwm.Channel("a", x, 1.0, "gyro", "rad/s")) for x in half]
    found["unusable"] = [
        _unusable(gmwm.Channel("a", x, 1.0, "gyro", "rad/s"))
        for x in (NOISE[0], 1e80 * NOISE[0], np.array([1.0, np.inf, -np.inf]))
    ]
    assert_as_recorded("diagnosis/parts_of_motion", found)


def test_parts_of_rest():
    found = {}
    scatter = np.exp(0.3 * RNG.normal(size=(240, 2)))
    scatter[100:140] *= 4.0
    scatter[30], scatter[60:63, 0], scatter[:4, 1] = np.nan, 9.0, 0.0
    floor = _floor(scatter, 13)
    found["floor"] = floor
    found["quiet"] = np.flatnonzero(~_quiet(scatter, floor, 13))
    for axes in (1, 2):
        flat = np.ones((40, 2))
        found[f"together {axes}"] = edge(
            lambda a, axes=axes, flat=flat: _quiet(flat * ([a, a] if axes == 2 else [a, 1.0]),
                                                   np.ones(2), 13)[20], 1.0, 9.0,
        )  # fmt: skip
    found["by chance"] = edge(lambda a: _quiet(a * np.ones((40, 1)), np.ones(1), 400)[20], 1.0, 9.0)
    rate = np.repeat([0.0, 0.0, 0.017, 0.019], 50)[:, None]
    quiet = np.ones(200, dtype=bool)
    for gaps in ((50,), (50, 51, 52, 53), (50, 51, 52, 53, 54), (20, 39), (30, 51), (100,), (150,)):
        where = quiet.copy()
        where[list(gaps)] = False
        found[f"runs {gaps}"] = quiet_runs(where, 200, rate)
    found["band"] = [
        edge(lambda a, f=f: _has_band(NOISE[0] + a * np.sin(f * T), 1 / RATE), 0.05, 9.0, 9)
        for f in (10.0, 60.0, 150.0)
    ]
    found["short band"] = edge(
        lambda a: _has_band(NOISE[0, :300] + a * np.sin(60.0 * T[:300]), 1 / RATE), 0.05, 9.0, 9
    )
    logs = 0.1 * NOISE[0, :400] + np.where(
        (np.arange(400) > 151) & (np.arange(400) < 290), 0.9, 0.0
    )
    found["changes"] = [_changes(logs), _changes(logs[:160]), _changes(0.1 * NOISE[1, :400])]
    found["split"] = [_split(logs, a, b) for a, b in ((100, 200), (150, 155), (0, 160), (280, 300))]

    def loud(a, start=151, stop=290, axes=1, step=0.0):
        x = 0.1 * NOISE[:2, :400].T
        x[start:stop, :axes] += a
        return loudness(np.exp(x), np.full(2, step))

    for axes in (1, 2):
        one = loud(1.0, axes=axes)
        found[f"loud {axes}"] = [np.flatnonzero(np.diff(one.loud)), one.ratio]
        found[f"from {axes}"] = edge(lambda a, n=axes: loud(a, axes=n).loud.any(), 0.1, 2.0, 9)
    found["stepped"] = edge(lambda step: loud(1.0, step=step).loud.any(), 0.1, 9.0, 9)
    found["shortest"] = [
        first(lambda n, a=a: loud(a, stop=151 + n).loud.any(), range(4, 120))
        for a in (0.7, 2.0, 4.0)
    ]
    found["fewest"] = first(
        lambda n: loudness(np.exp(np.where(np.arange(n) < n // 2, 0.0, 2.0))[:, None],
                           np.zeros(1)).loud.any(), range(90, 160),
    )  # fmt: skip
    assert loud(0.0).ratio == 1.0
    dead = np.exp(0.1 * NOISE[:2, :400].T)
    dead[:90, 0] = 0.0
    dead[200:300] *= 5.0
    for step in (0.0, 0.5, 2.0):
        found[f"dead {step}"] = np.flatnonzero(np.diff(loudness(dead, np.full(2, step)).loud))
    assert_as_recorded("diagnosis/parts_of_rest", found)


def test_stretches_of_vibration_are_listed(monkeypatch):
    found = {}
    for count in (0, 1, 3, 4, 6):
        loud = tuple((10.0 * k, 10.0 * k + 1 + k % 4) for k in range(count))
        made = SimpleNamespace(loud_stretches=loud, loudness=SimpleNamespace(ratio=1.75))
        monkeypatch.setattr(
            sys.modules["gmwm.diagnosis.still.blocks"], "blocks_of", lambda _, m=made: m
        )
        found[f"{count}"] = vibration_notice(record())
    for count in (1, 8, 9):
        still = Still(
            tuple((10.0 * k, 10.0 * k + 5) for k in range(count)), 5.0, ((5.0, 7.0),), 100.0
        )
        found[f"still {count}"] = [still.notice(), still.total, still.timeline]
    assert_as_recorded("diagnosis/listed", found)


def test_whole_recordings():
    found = {}
    rough = NOISE.copy()
    rough[0, 700:720], rough[3, 100], rough[4, 1500:1600] = 40.0, 60.0, np.nan
    rough[5] = np.where(np.arange(N) % 4, np.roll(rough[5], 1), rough[5])
    rough[1, 1:] = rough[1, :-1] * 0.3 + np.round(rough[0, 1:])
    rec = record(noise=rough, temperature=20.0 + T / 9)
    one = gmwm.health(rec)
    found["rough"] = {"text": str(one), "repr": repr(one)}
    found["masked"] = [[c.missing, float(np.nansum(c.values * T))]
                       for c in one.masked(rec).values()]  # fmt: skip
    spiked = NOISE[2].copy()
    spiked[400] += 90.0
    slow = 0.25 * NOISE[1] + np.cumsum(NOISE[3]) * 0.02
    hum = gmwm.Resonance(0.3, 9.0, 0.02).simulate(N, 1 / RATE, 2)
    odd = record(names=(), gyro_x=np.repeat(spiked[:1000], 3), gyro_y=np.round(slow + hum),
                 gyro_z=np.append(NOISE[0][:1], np.repeat(spiked, 3)[: N - 1]))  # fmt: skip
    found["odd"] = gmwm.health(odd).content()
    for n in (127, 128):
        rest = {name: channel.values[:n] for name, channel in record().items()}
        found[f"blocks {n}"] = blocks_of(Recording.from_arrays(rest, RATE, UNITS)) is None
    assert_as_recorded("diagnosis/whole", found)
