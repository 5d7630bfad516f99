"""Lines and resonances: every number of them, and where each begins to be seen."""

import numpy as np

from gmwm.diagnosis.spectral import line_notices, peaks, resonance_notice, spectrum
from gmwm.diagnosis.spectral.lines import (
    Line,
    _families,
    _foot,
    _limits,
    _local_background,
    _scores,
    find_lines,
)
from gmwm.diagnosis.spectral.resonances import Bump, _points, _same, _sides, find_resonances
from gmwm.diagnosis.spectral.spectrum import _edges, _running_median, background, bands
from gmwm.process import Resonance
from recorded import assert_as_recorded, edge, first

NOISE = np.random.default_rng(12).normal(size=16_000)
TIME = np.arange(NOISE.size)


def test_spectra_and_their_backgrounds():
    found = {}
    gappy = NOISE[:6000].copy()
    gappy[100:700] = np.nan
    for name, values in {
        "white": NOISE[:6000], "odd": NOISE[:5001], "gappy": gappy,
        "walk": np.cumsum(NOISE[:6000]), "trend": NOISE[:1000] + TIME[:1000], "short": NOISE[:512],
    }.items():  # fmt: skip
        power = spectrum(values, 0.01)
        one = bands(power)
        left = np.zeros(power.density.size, dtype=bool)
        left[60:75], left[200:203], left[-30:] = True, True, True
        other = bands(power, left)
        found[name] = {
            "density": power.density, "frequency": power.frequency,
            "edges": one.edges, "level": one.level, "variance": one.variance,
            "smooth": one.smooth, "middle": one.frequency,
            "background": background(power, one), "left out": other.level,
            "left variance": other.variance, "left smooth": other.smooth,
            "local": [a for a in _local_background(power.density, background(power, one))],
        }  # fmt: skip
    found["edges"] = [_edges(n) for n in (4, 11, 12, 13, 400)]
    found["median"] = [_running_median(NOISE[:n]) for n in (3, 5, 30)]
    # A line of amplitude A has the area A^2 / 2.
    line = spectrum(3.0 * np.sin(2.0 * np.pi * 0.1 * np.arange(1000)), 0.5)
    assert np.isclose(np.sum(line.density) * line.resolution, 4.5, rtol=1e-4)
    assert_as_recorded("diagnosis/spectra", found)


def lined(amplitude, frequency=0.1, values=NOISE, wander=0.0):
    phase = 2.0 * np.pi * frequency * TIME[: values.size]
    return values + amplitude * np.sin(phase + wander * np.cumsum(NOISE[: values.size]))


def seen(values, dt=0.01):
    lines, bumps = peaks(values, dt)
    told = [*line_notices("a", "rad/s", lines), *(resonance_notice("a", "rad/s", b) for b in bumps)]
    return {"lines": lines, "bumps": bumps, "notices": told}


def test_lines():
    found = {}
    short = NOISE[:6000]
    for frequency in (0.0035, 0.2, 0.47):
        found[f"from {frequency}"] = edge(
            lambda a, f=frequency: peaks(lined(a, f, short), 0.01)[0], 0.02, 0.6, 6
        )
        found[f"at {frequency}"] = peaks(lined(1.0, frequency, short), 0.01)[0]
    for wander in (0.003, 0.1):
        found[f"wanders {wander}"] = peaks(lined(3.0, 0.2, wander=wander), 0.01)
    many = short + sum(
        (0.4 + 0.1 * k) * np.sin(2.0 * np.pi * (0.03 + 0.0531 * k) * TIME[:6000]) for k in range(8)
    )
    found["many"] = seen(many)
    found["harmonics"] = seen(short + sum(np.sin(0.35 * k * TIME[:6000]) / k for k in (1, 2, 3, 5)))
    walk = np.cumsum(NOISE[:6000])
    found["walk"] = seen(lined(9.0, 0.05, walk))
    found["square"] = seen(np.sign(np.sin(2.0 * np.pi * TIME[:4096] / 64.0)))
    found["slow"] = edge(lambda f: peaks(lined(2.0, f, short), 0.01)[0], 1e-3, 0.01, 5)
    gappy = lined(1.0, 0.1, short)
    gappy[1000:1900] = np.nan
    found["gappy"] = seen(gappy)
    gappy[1000:4001] = np.nan
    found["half"] = seen(gappy)
    found["short"] = [bool(peaks(lined(9.0, 0.2, short[:n]), 0.01)[0]) for n in (511, 512)]
    found["none"] = seen(np.zeros(600))
    assert_as_recorded("diagnosis/lines", found, rtol=1e-4)


def test_parts_of_lines():
    found = {}
    grid, limits = _limits(3000, np.array([80.0, 200.0, 900.0]))
    found["grid"], found["limits"] = grid, limits
    found["few"] = _limits(99, np.array([10.0, 20.0]))
    ratio = 1.0 + 3.0 * np.abs(np.sin(np.arange(3001) ** 2 / 700.0))
    score, best = _scores(ratio, np.linspace(80.0, 900.0, 3001), grid, limits, 0, 3000)
    found["scores"], found["best"] = score, best
    part, width = _scores(ratio, np.linspace(80.0, 900.0, 3001), grid, limits, 700, 760)
    assert np.allclose(part, score[700:760]) and np.array_equal(width, best[700:760])
    found["zeros"] = np.flatnonzero(score == 0.0).tolist()[:60]
    hill = np.where(np.abs(np.arange(500) - 250) < 40, 9.0, 1.0)
    found["feet"] = [_foot(hill, k, width) for k in (215, 250, 288, 2, 498) for width in (1, 8, 20)]
    made = [
        Line(f, a, 9.0, w, 1, 2) for f, a, w in (
            (10.0, 1.0, 0.01), (20.0, 3.0, 0.01), (30.2, 0.5, 0.01), (30.9, 0.4, 0.01),
            (7.0, 2.0, 0.2), (14.13, 0.3, 0.01), (14.3, 0.2, 0.05), (41.0, 0.1, 0.5),
        )
    ]  # fmt: skip
    families = _families(tuple(made))
    found["families"] = [[a.frequency, [b.frequency for b in h]] for a, h in families]
    for f in (10.0, 100.0):
        found[f"off {f}"] = edge(
            lambda off, f=f: len(_families((Line(f, 1.0, 9.0, 1e-3 * f, 1, 2),
                                            Line(3.0 * f + off, 1.0, 9.0, 0.0, 1, 2)))) == 2,
            1e-3, 5.0, 14,
        )  # fmt: skip
        found[f"wide {f}"] = edge(
            lambda off, f=f: len(_families((Line(f, 1.0, 9.0, f, 1, 2),
                                            Line(3.0 * f + off, 1.0, 9.0, 0.0, 1, 2)))) == 2,
            1e-3, 5.0, 14,
        )  # fmt: skip
    many = tuple(Line(1.0 + 0.37 * k, 1.0 / (k + 1), 5.0, 1e-3, 1, 2) for k in range(6))
    found["notices"] = [line_notices("a", "m/s^2", many[:n]) for n in (1, 4, 5, 6)]
    short = spectrum(NOISE[:64], 1.0)
    assert find_lines(short, np.ones(33)) == ()
    assert_as_recorded("diagnosis/parts_of_lines", found)


def bumpy(sigma, frequency=12.0, damping=0.05, n=6000):
    hum = Resonance(1.0, frequency, damping).simulate(n, 0.01, 5)
    return NOISE[:n] + sigma * hum


def test_resonances():
    found = {}
    for name, values in {
        "narrow": bumpy(1.0, damping=0.01), "wide": bumpy(3.0, damping=0.12),
        "two": bumpy(1.0, 5.0) + bumpy(1.0, 41.0, 0.03), "line": lined(1.0, 0.11, bumpy(1.0)),
    }.items():  # fmt: skip
        found[name] = seen(values)
    found["from"] = edge(lambda a: peaks(bumpy(a), 0.01)[1], 0.2, 0.8, 6)
    found["damping"] = bool(peaks(bumpy(2.0, damping=0.9), 0.01)[1])
    assert_as_recorded("diagnosis/resonances", found, rtol=1e-3)


def test_parts_of_resonances():
    found = {}
    height = np.array([0.0, 0.5, 1.0, 3.0, 2.0, 1.1, 0.9, 2.9, 0.0])
    found["sides"] = [_sides(height, j) for j in range(1, 8)]
    one = Bump(10.0, 0.05, 1.0, 5.0)
    found["same"] = edge(lambda off: _same(one, Bump(10.0 + off, 0.02, 1.0, 5.0)), 0.01, 9.0)
    found["other"] = edge(lambda off: _same(one, Bump(10.0 + off, 0.2, 1.0, 5.0)), 0.01, 90.0)
    power = spectrum(NOISE[:2000], 0.01)
    left = np.zeros(1001, dtype=bool)
    left[300:340] = True
    for start, stop in ((10, 60), (250, 900), (301, 320)):
        found[f"points {start}"] = [each for each in _points(power, left, start, stop)
                                    if each.size]  # fmt: skip
    loud = bands(spectrum(bumpy(1.0, n=2000), 0.01))
    found["bands"] = loud.level.size
    few = first(lambda n: bands(spectrum(NOISE[:n], 0.01)).level.size >= 24, range(200, 600))
    found["few"] = few
    for n in (few - 1, few):
        power = spectrum(bumpy(9.0, 25.0, n=n), 0.01)
        one = bands(power)
        none = np.zeros(power.density.size, dtype=bool)
        found[f"of {n}"] = find_resonances(power, one, background(power, one), none)
    assert_as_recorded("diagnosis/parts_of_resonances", found)
