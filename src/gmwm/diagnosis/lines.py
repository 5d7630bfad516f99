"""The periodogram, and its lines: peaks too high for noise and too narrow for a resonance."""

from dataclasses import dataclass

import numpy as np
from scipy import fft

from gmwm._core.distributions import fisher
from gmwm._core.text import brief, readable
from gmwm._core.typing import BoolArray, FloatArray, IntArray, inner
from gmwm.diagnosis import tuning
from gmwm.issues import Notice, notice

POWER_INFLATION = 1.0 + 2.0 * (4.0 / 9.0 + 1.0 / 36.0)
"""Variance of means of neighbouring Hann periodogram bins, over that of independent ones."""

_HALF_OCTAVE = tuning.BANDS_PER_OCTAVE // 2
_LOG_VARIANCE = np.pi**2 / 6.0  # of the logarithm of an exponential variate


@dataclass(frozen=True, eq=False)
class Bands:
    """Mean logarithm of the spectrum in J bands of equal width in log frequency."""

    edges: IntArray  # (J + 1,), bins of the spectrum
    frequency: FloatArray  # Hz
    level: FloatArray  # logarithm of the density
    variance: FloatArray  # of the level
    smooth: FloatArray  # running median of the level over an octave


@dataclass(frozen=True, eq=False)
class Spectrum:
    """One-sided periodogram with a Hann window."""

    density: FloatArray  # (n // 2 + 1,), u^2/Hz
    resolution: float  # distance of the bins, Hz
    dt: float  # s

    @property
    def frequency(self) -> FloatArray:
        """Frequency of each bin, Hz."""
        return np.asarray(self.resolution * np.arange(self.density.size), dtype=float)


def spectrum(values: FloatArray, dt: float) -> Spectrum:
    """Periodogram of a series (n,) without its linear trend; straight lines bridge gaps (NaN).

    It has unit gain for density; a line of amplitude A has the area A^2/2.
    """
    n = values.size
    place = np.arange(n, dtype=float)
    known = ~np.isnan(values)
    filled = values if np.all(known) else np.interp(place, place[known], values[known])
    centred = place - np.mean(place)
    trend = inner(centred, filled) / inner(centred, centred)
    centred *= -trend
    tapered = filled - np.mean(filled)
    tapered += centred
    del filled, centred
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * (place + 0.5) / n)
    tapered *= window
    # What is missing has no power of its own.
    weight = float(np.sum(window[known] ** 2))
    del place, window
    power = np.abs(fft.rfft(tapered, overwrite_x=True)) ** 2
    return Spectrum(2.0 * dt / weight * power, 1.0 / (n * dt), dt)


def bands(spectrum: Spectrum, left_out: BoolArray | None = None) -> Bands:
    """Band levels and their running median, which lines and narrow bumps hardly move."""
    logs = np.log(np.maximum(spectrum.density, np.finfo(float).tiny)) + np.euler_gamma
    used = np.ones(logs.size)
    if left_out is not None:
        used[left_out] = 0.0
    edges = _edges(logs.size - 1)  # the last bin, at half the rate, is another distribution
    within = slice(edges[-1])
    sums, counts = (np.add.reduceat(x[within], edges[:-1]) for x in (logs * used, used))
    kept = counts >= 0.5 * np.diff(edges)
    # A band that is nearly all line takes the level of its neighbours.
    places = np.arange(kept.size)
    level = np.interp(places, places[kept], sums[kept] / counts[kept])
    counts = np.where(kept, counts, 0.5 * np.diff(edges))
    middle = np.sqrt(edges[:-1] * (edges[1:] - 1.0)) * spectrum.resolution
    variance = _LOG_VARIANCE * POWER_INFLATION / counts
    # Running median over an octave; beyond the ends the curve goes on turned by 180 degrees.
    reach = min(_HALF_OCTAVE, level.size - 1)
    before = 2.0 * np.median(level[:3]) - level[reach:0:-1]
    after = 2.0 * np.median(level[-3:]) - level[-2 : -reach - 2 : -1]
    longer = np.concatenate([before, level, after])
    windows = np.lib.stride_tricks.sliding_window_view(longer, 2 * reach + 1)
    return Bands(edges, middle, level, variance, np.asarray(np.median(windows, axis=1)))


def background(spectrum: Spectrum, found: Bands) -> FloatArray:
    """Density of the smooth background at every bin, u^2/Hz."""
    place = np.log(np.maximum(spectrum.frequency, 0.5 * spectrum.resolution))
    return np.exp(np.interp(place, np.log(found.frequency), found.smooth))


def _edges(last: int) -> IntArray:
    """Bins at which bands begin: a 24th of an octave, but eight bins at least."""
    edges = [4]
    while edges[-1] < last:
        width = round(edges[-1] * (2.0 ** (1.0 / tuning.BANDS_PER_OCTAVE) - 1.0))
        edges.append(edges[-1] + max(tuning.FEWEST_IN_BAND, width))
    if edges[-1] > last:
        edges.pop()
    return np.array(edges)


_CLIP = np.log(np.log(100.0))  # one bin of noise in a hundred is higher
_EIGENVALUE = 8.0 / 3.0  # largest of the correlation of Hann bins, 1 + 2 (2/3 + 1/6)


@dataclass(frozen=True)
class Line:
    """A periodic line."""

    frequency: float  # Hz
    amplitude: float  # of a sinusoid of the same power, u
    ratio: float  # density over that of the surroundings
    width: float  # over which it is smeared, Hz
    start: int  # first bin
    stop: int  # the bin after the last


def find_lines(spectrum: Spectrum, smooth: FloatArray) -> tuple[Line, ...]:
    """Lines by their power, strongest first.

    The mean of m = 1, 2, 4, ... neighbouring bins, over the local background, is compared with an
    F quantile for `tuning.FALSE_ALARM` in all bins and widths together (Bonferroni), whose degrees
    of freedom come from the largest eigenvalue of the correlation between Hann bins.
    """
    last = spectrum.density.size - 1
    if last <= tuning.FIRST_BIN + 2 * tuning.UNRESOLVED:
        return ()
    local, freedom = _local_background(spectrum.density, smooth)
    # A filter leaves so little beyond its band that rounding of the computer has peaks there.
    local = np.maximum(local, tuning.LEAST_LINE**2 * float(np.sum(spectrum.density)))
    ratio = spectrum.density / local
    # Largest ratios of noise by width, on a grid of degrees of freedom of the background.
    widths = [2**i for i in range(int(np.log2(max(int(tuning.NARROW * last), 1))) + 1)]
    grid = np.geomspace(np.min(freedom), np.max(freedom) * 1.001, 12)
    chance = tuning.FALSE_ALARM / (last * len(widths))
    limits = {}
    for width in widths:
        eigenvalue = _EIGENVALUE if width > 2 else 1.0 + 2.0 / 3.0 * (width - 1)
        limits[width] = fisher.isf(chance, 2.0 * width / eigenvalue, grid)
    score, best = _scores(ratio, freedom, grid, limits, 0, last)
    lines: list[Line] = []
    for _ in range(tuning.MOST_LINES):
        k = int(np.argmax(score))
        if score[k] <= 1.0:
            break
        line = _measured(spectrum, local, k, int(best[k]))
        widest = max(tuning.NARROW * line.frequency, tuning.UNRESOLVED * spectrum.resolution)
        if not line.width > widest:
            lines.append(line)
        # What it takes, and half of that on both sides, is noise from here on.
        margin = (line.stop - line.start) // 2
        ratio[max(line.start - margin, 0) : line.stop + margin] = 1.0
        reach = margin + max(limits)
        low, high = max(line.start - reach, 0), min(line.stop + reach, last)
        score[low:high], best[low:high] = _scores(ratio, freedom, grid, limits, low, high)
    return tuple(sorted(lines, key=lambda line: -line.amplitude))


def line_notices(name: str, unit: str, lines: tuple[Line, ...]) -> list[Notice]:
    """One notice for each of the strongest lines and its harmonics, one for the rest."""
    families = _families(lines)
    notices = []
    for main, harmonics in families[: tuning.NAMED_LINES]:
        values = {key: getattr(main, key) for key in ("frequency", "amplitude", "ratio", "width")}
        values["harmonics"] = float(len(harmonics))
        at = ", ".join(f"{line.frequency:.4g}" for line in harmonics)
        words = {"also": f", with harmonics at {at} Hz" if harmonics else ""}
        words |= {"shown": readable(main.amplitude, unit), "times": brief(main.ratio, 3)}
        notices.append(notice("line", name, values, severity="warning", **words))
    if rest := families[tuning.NAMED_LINES :]:
        main, count = rest[0][0], float(len(rest))
        values = {"count": count, "frequency": main.frequency, "amplitude": main.amplitude}
        shown = readable(main.amplitude, unit)
        notices.append(notice("line", name, values, variant="weak", hint="", shown=shown))
    return notices


def _local_background(density: FloatArray, smooth: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean logarithm over neighbours, without those too high for noise; degrees of freedom."""
    k = np.arange(density.size)
    reach = np.maximum(tuning.BESIDE_LINE, (tuning.BESIDE_LINE_FRACTION * k).astype(int))
    high = np.minimum(k + reach + 1, density.size - 1)
    low = np.minimum(np.maximum(k - reach, tuning.FIRST_BIN // 2), high - 1)
    count = high - low
    logs = np.log(np.maximum(density / smooth, np.finfo(float).tiny)) + np.euler_gamma
    level = np.zeros(density.size)
    for cut in (np.inf, _CLIP + np.euler_gamma, _CLIP + np.euler_gamma):
        total = np.concatenate([[0.0], np.cumsum(np.minimum(logs, level + cut))])
        level = (total[high] - total[low]) / count
    # A mean of logarithms of exponential variates has 6/pi^2 of the efficiency.
    freedom = 2.0 * count * (6.0 / np.pi**2) / POWER_INFLATION
    return smooth * np.exp(level), freedom


def _scores(
    ratio: FloatArray,
    freedom: FloatArray,
    grid: FloatArray,
    limits: dict[int, FloatArray],
    start: int,
    stop: int,
) -> tuple[FloatArray, IntArray]:
    """Largest ratio to the limit over all widths, and the width that has it, of some bins.

    The ratio counts where it is above 1, and may be zero elsewhere.
    """
    widest = max(limits)
    low, high = max(start - widest, 0), min(stop + widest, ratio.size - 1)
    total = np.concatenate([[0.0], np.cumsum(ratio[low:high])])
    score, best = np.zeros(stop - start), np.ones(stop - start, dtype=np.int64)
    for width, limit in limits.items():
        slowest = int(width / tuning.NARROW) if width > tuning.UNRESOLVED else 0
        first = max(start, slowest, tuning.FIRST_BIN, low + width // 2)
        end = min(stop, high + 1 - width + width // 2)
        count, begin = end - first, first - width // 2 - low
        if count <= 0:
            continue
        mean = (total[begin + width :][:count] - total[begin:][:count]) / width
        above = np.flatnonzero(mean > np.min(limit))
        value = mean[above] / np.interp(freedom[first + above], grid, limit)
        is_larger = value > score[first - start + above]
        places = (first - start + above)[is_larger]
        score[places], best[places] = value[is_larger], width
    return score, best


def _measured(spectrum: Spectrum, local: FloatArray, k: int, width: int) -> Line:
    """Frequency, amplitude and foot of the line at bin k."""
    density, df = spectrum.density, spectrum.resolution
    surroundings = float(local[k])
    # The feet of a strong line that wanders raise the background beneath it: look beyond them.
    for _ in range(2):
        start, stop = _foot(density / surroundings, k, width)
        reach = max(tuning.BESIDE_LINE, int(tuning.BESIDE_LINE_FRACTION * k))
        sides = local[np.clip([start - reach, stop + reach], tuning.FIRST_BIN, local.size - 2)]
        surroundings = float(min(np.exp(np.mean(np.log(sides))), local[k]))
    bins = np.arange(start, stop)
    excess = density[start:stop] - surroundings
    area = float(np.sum(excess))
    positive = np.maximum(excess, 0.0)
    strong = positive * (positive > 0.05 * np.max(positive))
    frequency = float(np.sum(strong * bins) / np.sum(strong)) * df
    # Bins of equal height that would have the same power and the same sum of squares.
    extent = float(np.sum(positive) ** 2 / np.sum(positive**2))
    ratio = 1.0 + area / (extent * surroundings)
    amplitude = float(np.sqrt(2.0 * max(area, 0.0) * df))
    return Line(frequency, amplitude, ratio, extent * df, start, stop)


def _foot(ratio: FloatArray, k: int, width: int) -> tuple[int, int]:
    """Bins around k over which means stay above the surroundings."""
    step = max(width, 8)
    ends = []
    for sign in (-1, 1):
        at = k
        for _ in range(4 + int(2.0 * tuning.FOOT * k / step)):
            block = ratio[max(at - step // 2, 1) : at + step // 2 + 1]
            if block.size == 0 or np.mean(block) < tuning.FOOT_RATIO:
                break
            at += sign * (step // 2)
        ends.append(int(np.clip(at, 1, ratio.size - 1)))
    return min(ends[0], k - 3), min(max(ends[1], k + 3) + 1, ratio.size - 1)


def _families(lines: tuple[Line, ...]) -> list[tuple[Line, list[Line]]]:
    """Lines with their harmonics, families by the power of their strongest line."""
    families: list[tuple[Line, list[Line]]] = []
    for line in sorted(lines, key=lambda line: line.frequency):
        for main, harmonics in families:
            order = round(line.frequency / main.frequency)
            tolerance = order * max(main.width, 1e-3 * main.frequency) + line.width
            off = abs(line.frequency - order * main.frequency)
            if order > 1 and off <= min(tolerance, 0.01 * line.frequency):
                harmonics.append(line)
                break
        else:
            families.append((line, []))
    return sorted(families, key=lambda family: -family[0].amplitude)
