"""Resonances: bumps of the spectrum above its smooth background."""

from collections.abc import Iterable
from dataclasses import asdict, dataclass

import numpy as np

from gmwm._core.distributions import norm
from gmwm._core.text import brief, readable
from gmwm._core.typing import BoolArray, FloatArray
from gmwm.diagnosis import tuning
from gmwm.diagnosis.lines import (
    POWER_INFLATION,
    Bands,
    Line,
    Spectrum,
    background,
    bands,
    find_lines,
    spectrum,
)
from gmwm.issues import Notice, notice
from gmwm.process import Resonance

# Logarithms of frequency over that of the band, of damping and of height; background.
_LOW = np.array([-0.2, np.log(1e-5), -5.0, -8.0, -8.0, -8.0])
_HIGH = np.array([0.2, np.log(0.9), 16.0, 8.0, 8.0, 8.0])
_STEP = 1e-4
_ROUNDS = 60
_MOST_DAMPED = 1e8
_GAIN = 1e-9  # of the deviance


@dataclass(frozen=True)
class Bump:
    """A resonance of second order on a smooth background."""

    frequency: float  # undamped natural frequency, Hz
    damping: float  # damping ratio
    sigma: float  # standard deviation, u
    ratio: float  # of the density at the peak, background included, to the background


def find_resonances(
    spectrum: Spectrum,
    found: Bands,
    smooth: FloatArray,
    left_out: BoolArray,
    known: tuple[Bump, ...] = (),
) -> tuple[Bump, ...]:
    """Resonances by their height, highest first, with those that are known.

    Bands that stand out of the running median by more than Gaussian noise would, and by half, are
    candidates, around which a resonance on the background is fitted by Whittle's likelihood.
    """
    height = found.level - found.smooth
    count = height.size
    if count < tuning.FEWEST_BANDS:
        return known
    median_error = 0.5 * np.pi * np.mean(found.variance) / min(25, count)
    limit = norm.isf(tuning.FALSE_ALARM / count) * np.sqrt(found.variance + median_error)
    stands_out = height > np.maximum(limit, np.log(tuning.LEAST_PEAK))
    excess = np.where(stands_out & (found.edges[:-1] >= tuning.SLOWEST_BIN), height, 0.0)
    bumps = list(known)
    for _ in range(2 * tuning.MOST_RESONANCES):
        j = int(np.argmax(excess))
        if excess[j] <= 0.0 or len(bumps) >= tuning.MOST_RESONANCES:
            break
        low = np.flatnonzero(height[:j] < height[j] / 3.0)
        high = np.flatnonzero(height[j + 1 :] < height[j] / 3.0)
        start = int(low[-1]) + 1 if low.size else 0
        stop = j + 1 + int(high[0]) if high.size else count
        excess[start:stop] = 0.0
        if start == 0 or stop == count:
            continue  # no peak: the spectrum only rises towards its end
        bump = _fitted(spectrum, smooth, left_out, float(found.frequency[j]), float(height[j]))
        if bump is not None and not any(_same(bump, other) for other in bumps):
            bumps.append(bump)
    return tuple(sorted(bumps, key=lambda bump: -bump.ratio))


def resonance_notice(name: str, unit: str, bump: Bump) -> Notice:
    """Say where it is, how damped and how high."""
    times, shown = brief(bump.ratio), readable(bump.sigma, unit)
    return notice("resonance", name, asdict(bump), times=times, shown=shown)


def _same(bump: Bump, other: Bump) -> bool:
    wide = max(bump.damping * bump.frequency, other.damping * other.frequency)
    return abs(bump.frequency - other.frequency) < 2.0 * wide


def _fitted(
    spectrum: Spectrum,
    smooth: FloatArray,
    left_out: BoolArray,
    centre: float,
    height: float,
    line: Line | None = None,
) -> Bump | None:
    """Whittle fit of a resonance on a background whose logarithm is a parabola in log f."""
    ratio = 1.0 + tuning.FEET * line.width / centre if line else tuning.FITTED_OCTAVES
    start = max(int(centre / ratio / spectrum.resolution), 1)
    stop = min(int(centre * ratio / spectrum.resolution), spectrum.density.size - 1)
    f, power, weight = _points(spectrum, left_out, start, stop)
    level = float(np.interp(centre, spectrum.frequency, smooth))
    power = power / level
    # A resonance of half width g has the extent pi g, its bins being exponential variates.
    dampings = [line.width / (np.pi * centre)] if line else tuning.DAMPING_STARTS
    starts = np.zeros((len(dampings), _LOW.size))
    starts[:, 1], starts[:, 2] = np.log(dampings), np.log(np.expm1(height))
    if line:
        starts[:, 2], starts[:, 3] = np.log(np.max(power)), np.log(np.median(power))
    fits = [_scored(start, f, power, weight, centre, spectrum.dt) for start in starts]
    free, _ = min(fits, key=lambda result: result[1])
    unit = _unit(free, centre, spectrum.dt)
    bottom = float(np.interp(unit.frequency, f, _floor(free, np.log(f / centre))))
    peak = float(np.exp(free[2]))
    ratio = (bottom + peak) / bottom
    narrowest = 0.0 if line else tuning.NARROWEST
    if ratio < tuning.LEAST_PEAK or not narrowest <= unit.damping <= tuning.WIDEST:
        return None
    if line:
        expected = _bump(free, f, centre, spectrum.dt) + _floor(free, np.log(f / centre))
        if np.mean(weight * (power / expected - 1.0) ** 2) > tuning.MISFIT * POWER_INFLATION:
            return None
    height_of_unit = 2.0 * float(unit.psd(np.array([unit.frequency]), spectrum.dt)[0])
    sigma = float(np.sqrt(peak * level / height_of_unit))
    return Bump(float(unit.frequency), float(unit.damping), sigma, ratio)


def _unit(free: FloatArray, centre: float, dt: float) -> Resonance:
    frequency = min(centre * float(np.exp(free[0])), 0.499 / dt)
    return Resonance(1.0, frequency, float(np.exp(free[1])))


def _floor(free: FloatArray, place: FloatArray) -> FloatArray:
    return np.asarray(np.exp(free[3] + free[4] * place + free[5] * place**2))


def _bump(free: FloatArray, f: FloatArray, centre: float, dt: float) -> FloatArray:
    unit = _unit(free, centre, dt)
    peak = float(unit.psd(np.array([unit.frequency]), dt)[0])
    return np.asarray(np.exp(free[2]) * unit.psd(f, dt) / peak)


def _scored(
    free: FloatArray, f: FloatArray, power: FloatArray, weight: FloatArray, centre: float, dt: float
) -> tuple[FloatArray, float]:
    """Minimize Whittle's deviance by Fisher scoring with Levenberg's damping."""
    place = np.log(f / centre)

    def deviance(expected: FloatArray) -> float:
        return float(np.average(np.log(expected) + power / expected, weights=weight))

    bump, floor = _bump(free, f, centre, dt), _floor(free, place)
    value, damping = deviance(bump + floor), 1e-3
    for _ in range(_ROUNDS):
        expected = bump + floor
        slopes = [
            (_bump(free + step, f, centre, dt) - _bump(free - step, f, centre, dt)) / (2.0 * _STEP)
            for step in _STEP * np.eye(free.size)[:2]
        ]
        columns = [*slopes, bump, floor, floor * place, floor * place**2]
        jacobian = np.column_stack(columns) / expected[:, None]
        weighted = jacobian * weight[:, None]
        information = weighted.T @ jacobian
        score = weighted.T @ (power / expected - 1.0)
        ridge = damping * np.diag(information) + 1e-12 * np.trace(information)
        new = np.clip(free + np.linalg.solve(information + np.diag(ridge), score), _LOW, _HIGH)
        new_bump, new_floor = _bump(new, f, centre, dt), _floor(new, place)
        new_value = deviance(new_bump + new_floor)
        if new_value > value:
            damping *= 10.0
            if damping > _MOST_DAMPED:
                break
            continue
        is_settled = value - new_value < _GAIN
        free, bump, floor, value, damping = new, new_bump, new_floor, new_value, 0.3 * damping
        if is_settled:
            break
    return free, value


def _points(
    spectrum: Spectrum, left_out: BoolArray, start: int, stop: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Frequency, mean density and number of bins of groups of bins without lines."""
    groups = min(tuning.FITTED_POINTS, stop - start)
    edges = np.linspace(start, stop, groups + 1).astype(int)[:-1]
    used = np.where(left_out[:stop], 0.0, 1.0)
    count = np.add.reduceat(used, edges)
    power = np.add.reduceat(used * spectrum.density[:stop], edges)
    place = np.add.reduceat(used * np.arange(stop), edges)
    kept = count > 0.0
    count = count[kept]
    return place[kept] / count * spectrum.resolution, power[kept] / count, count


def peaks(values: FloatArray, dt: float) -> tuple[tuple[Line, ...], tuple[Bump, ...]]:
    """Lines, and resonances of what they leave; none of a series that is short or half missing."""
    known = np.count_nonzero(~np.isnan(values))
    if values.size < tuning.FEWEST_OF_SPECTRUM or known < values.size / 2:
        return (), ()
    power = spectrum(values, dt)
    if not np.any(power.density > 0.0):
        return (), ()
    smooth = background(power, bands(power))
    lines = find_lines(power, smooth)
    occupied = _occupied(power, lines)
    narrow: dict[Line, Bump] = {}
    for line in lines:
        if line.width >= tuning.RESOLVED * power.resolution:
            others = _occupied(power, [each for each in lines if each is not line])
            bump = _fitted(power, smooth, others, line.frequency, np.log(line.ratio), line)
            narrow |= {line: bump} if bump else {}
    lines, bumps = tuple(line for line in lines if line not in narrow), tuple(narrow.values())
    if 2 * np.count_nonzero(occupied) > occupied.size:
        return lines, bumps  # a square wave: hardly anything is left to be a background
    rest = bands(power, occupied)
    return lines, find_resonances(power, rest, background(power, rest), occupied, bumps)


def _occupied(power: Spectrum, lines: Iterable[Line]) -> BoolArray:
    """Bins of lines, and half as many on both sides."""
    occupied = np.zeros(power.density.size, dtype=bool)
    for line in lines:
        margin = (line.stop - line.start) // 2
        occupied[max(line.start - margin, 0) : line.stop + margin] = True
    return occupied
