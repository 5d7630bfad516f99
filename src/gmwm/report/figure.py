"""Interactive plots, as the JSON that plotly.js draws and ``report.js`` changes.

Beside ``data``, ``layout`` and ``config`` a figure has ``units``: titles of the y axis in the
field's unit and in SI with the factor from the first; ``toggles``: the traces that a reader may
hide; and ``whatif``: N and K of the curve that sliders move, with the sampling interval.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.calibration import AxisNumbers, BiasCurve, Calibration, Covariate
from gmwm.datasheet import Datasheet
from gmwm.diagnosis import spectrum
from gmwm.estimate import Fit
from gmwm.estimate.result import dense_curves
from gmwm.filter_numbers import FIELD_UNITS, ErrorBudget, root_sum
from gmwm.plotting import COMPONENT_COLOURS, DATA_COLOUR, SUM_COLOUR, deviation_range, styles
from gmwm.process import Model
from gmwm.readers import Channel
from gmwm.report.page import units_of

Figure = dict[str, Any]
Spans = Sequence[tuple[int, int]]

WHATIF = "filter N and K"
"""Name of the curve that sliders move."""

_GRID = "#dddddd"  # the page's style sheet gives it another shade on dark screens
_BESIDE = 1.7  # ratio of averaging times that is left free at both ends
_SHEET = "#9a5b00"
_BELOW = 8.0  # how far below the curves a mark may lie that the axis is stretched for
_PARTS = 128  # means of a recording against its temperature
_SHARE = 100.0  # per cent: residuals beyond are drawn at the edge, with their size
_FILTER = "#c2185b"
_DASHES = ("dash", "dot", "dashdot", "longdash")  # of the first, second ... term of a kind
_TICK = 0.93  # of the height: what was left out is marked above, and no sample is painted over
_BINS = 400  # of the time series: as many as a figure has columns of pixels to show
_PER_OCTAVE = 12
_FIRST_BIN = 4  # of the spectrum: the window reaches over the bins below
_LAYOUT: Figure = {
    "margin": {"l": 62, "r": 12, "t": 12, "b": 44},
    "height": 360,
    "plot_bgcolor": "rgba(0,0,0,0)",
    "paper_bgcolor": "rgba(0,0,0,0)",
    "hovermode": "closest",
    "showlegend": False,
    "font": {"family": "system-ui, sans-serif", "size": 12, "color": SUM_COLOUR},
}
_CONFIG = {"displayModeBar": False, "responsive": True}


def overview_figure(calibration: Calibration, quantity: str | None) -> Figure:
    """The fitted curves of the axes of a sensor over their data."""
    fits = {name: fit for name, fit in calibration.items() if fit.wv.quantity == quantity}
    traces: list[Figure] = []
    first = next(iter(fits.values()))
    units = _units("Allan deviation", "u", first)
    factor = units_of("u", first.wv)[1]
    seen: list[FloatArray] = []
    for (colour, _), (name, fit) in zip(styles(fits), fits.items(), strict=True):
        tau, components = dense_curves(fit)
        total = factor * root_sum(list(components.values()))
        value = factor * fit.wv.allan_deviation
        traces.append(_line(tau, total, name, colour, "solid", 1.8))
        points = _points(fit.wv.tau, value, f"{name}, data", colour, 4)
        ends = factor * np.sqrt(2.0 * np.stack([fit.wv.lower, fit.wv.upper]))
        bars = _bars(value, ends[0], ends[1], colour)
        traces.append({**points, "error_y": bars, "legendgroup": name})
        seen += [total, value]
    low, high = deviation_range(np.concatenate(seen))
    times = np.sort(np.concatenate([fit.wv.tau for fit in fits.values()]))
    deviations = _axis(units[0][0], 2.0 * low, high)
    layout = {"height": 300, "xaxis": _times(times), "yaxis": deviations}
    return _figure(traces, layout, units=units, toggles=range(0, len(traces), 2))


def deviation_figure(
    fitted: Fit,
    numbers: AxisNumbers,
    *,
    filter_numbers: tuple[float, float] | None = None,
    rivals: Sequence[Model] = (),
    sheet: Datasheet | None = None,
) -> Figure:
    """Allan deviation of the data with intervals, model with its band, terms, and N, B, K.

    filter_numbers: (float, float), N and K of the curve that the sliders move, SI.
    rivals: That describe the data as well: the band covers them.
    """
    wv, factor = fitted.wv, units_of("u", fitted.wv)[1]
    tau, components = dense_curves(fitted)
    total = root_sum(list(components.values()))
    traces = _band(fitted, tau, factor, rivals)
    band = len(traces)
    traces += _terms(tau, {label: factor * curve for label, curve in components.items()})
    stated = sheet.deviation(wv.name, wv.quantity, tau, wv.dt) if sheet else None
    if stated is not None:
        traces.append(_line(tau, factor * stated, "data sheet", _SHEET, "longdashdot", 2.0))
    traces.append(_line(tau, factor * total, "model", SUM_COLOUR, "solid", 2.2))
    value = factor * wv.allan_deviation
    low, high = factor * np.sqrt(2.0 * wv.lower), factor * np.sqrt(2.0 * wv.upper)
    points = _points(wv.tau, value, f"data, {100.0 * wv.confidence:g} % interval", DATA_COLOUR, 6)
    traces.append({**points, "error_y": _bars(value, low, high, DATA_COLOUR)})
    more: Figure = {}
    if filter_numbers is not None:
        more["whatif"] = {"curve": WHATIF, "factor": factor}
        N, K = filter_numbers
        curve = factor * np.sqrt(N**2 / tau + K**2 * tau / 3.0)
        traces.append({**_line(tau, curve, WHATIF, _FILTER, "dot", 2.4), "visible": False})
    marks = _marks(numbers, fitted)
    # One box for both ends of the band, and one for the lines and marks of N, B and K.
    toggles = [*range(1, band), *range(band, len(traces)), len(traces) + len(marks) - 1]
    traces += marks
    bottom, top = deviation_range(np.concatenate([factor * total, value]))
    lowest = min([bottom, *(0.4 * y for y in marks[-1]["y"] if y > bottom / _BELOW)])
    units = _units("Allan deviation", "u", fitted)
    layout = {"xaxis": _times(wv.tau), "yaxis": _axis(units[0][0], lowest, top)}
    return _figure(traces, layout, units=units, toggles=toggles, **more)


def _band(fitted: Fit, tau: FloatArray, factor: float, rivals: Sequence[Model]) -> list[Figure]:
    """The 95 % band of the fitted curve; nothing where it is not known."""
    with np.errstate(all="ignore"):
        _, *ends = fitted.deviation_interval(tau, rivals=rivals)
    if not fitted.keys or not np.all(np.isfinite(ends)):
        return []
    name = "95 % band of the models that fit equally well" if rivals else "95 % band of the model"
    low, high = (_line(tau, factor * each, name, "#8a8a8a", "solid", 0.0) for each in ends)
    low |= {"name": f"{name}, lower end", "legendgroup": name, "hoverinfo": "skip"}
    return [low, {**high, "fill": "tonexty", "fillcolor": "rgba(130,130,130,0.28)"}]


def _terms(x: FloatArray, curves: Mapping[str, FloatArray]) -> list[Figure]:
    """Dashed curves of what a sum is made of, in the colours of their kinds."""
    shown = zip(styles(curves), curves.items(), strict=True)
    return [
        _line(x, curve, label, colour, _DASHES[turn % len(_DASHES)], 1.5)
        for (colour, turn), (label, curve) in shown
        if np.any(curve > 0.0)
    ]


def _marks(numbers: AxisNumbers, fitted: Fit) -> list[Figure]:
    """N where its line passes 1 s, K where its line passes 3 s, 0.664 B at the lowest point."""
    name, lines = "N, B, K of the sensor", numbers.lines()
    ends = fitted.wv.tau[[0, -1]] * [0.5, 2.0]
    texts = [
        [each.replace(" = ", " ").replace("<=", "≤").replace("+-", "±") for each in labels]
        for labels in (lines, numbers.lines("si"))
    ]
    traces, places = [], []
    for (colour, _), (label, line) in zip(styles(lines), lines.items(), strict=True):
        slope, height, at, _ = line
        trace = _line(ends, height * ends**slope, f"{label[0]} line", colour, "dot", 1.0)
        traces.append({**trace, "legendgroup": name})
        places.append((at, height * at**slope))
    marks = _scatter(
        np.array([at for at, _ in places]),
        np.array([y for _, y in places]),
        name,
        mode="markers+text",
        text=texts[0],
        si=texts[1],
        textposition=["top right" if label[0] == "N" else "bottom center" for label in lines],
        textfont={"size": 13, "color": SUM_COLOUR},
        # Open, so that a point of the data beneath is seen.
        marker={"symbol": "diamond-open", "size": 11, "color": SUM_COLOUR, "line": {"width": 2}},
        hovertemplate="%{text}<br>%{y:.4g} at %{x:.4g} s<extra></extra>",
        legendgroup=name,
    )
    return [*traces, marks]


def residual_figure(fitted: Fit) -> Figure:
    """Data over model in per cent of the deviation, with the data's interval."""
    at, wv = fitted.goodness, fitted.wv
    shown = np.flatnonzero(np.isfinite(at.residual) & np.isfinite(at.misfit))
    misfit = 100.0 * at.misfit[shown]
    # The interval of the data, about the misfit.
    share = np.sqrt(np.stack([wv.lower, wv.upper]) / np.maximum(wv.variance, np.finfo(float).tiny))
    low, high = (100.0 + misfit) * share[:, shown] - 100.0
    well = np.maximum(np.abs(low), np.abs(high))[at.dof[shown] > 30.0]
    reach = float(min(1.15 * np.max([5.0, *well, *np.abs(misfit)]), _SHARE))
    inside = np.abs(misfit) <= reach
    clipped, colour = np.clip(misfit, -0.96 * reach, 0.96 * reach), COMPONENT_COLOURS[0]
    points = _points(at.tau[shown], clipped, "data over model", colour, 7)
    rows = zip(misfit, at.residual[shown], at.dof[shown], strict=True)
    points |= {
        "mode": "markers+text",
        "text": ["" if ok else f"{x:+.0f} %" for ok, x in zip(inside, misfit, strict=True)],
        "textposition": "middle left",
        "error_y": _bars(misfit, low, high, colour),
        "customdata": [[float(f"{value:.4g}") for value in row] for row in rows],
        "hovertemplate": "%{x:.4g} s: deviation %{customdata[0]:+.2g} % off the model, "
        "%{customdata[1]:+.2f} standard errors, %{customdata[2]:.3g} degrees of freedom"
        "<extra></extra>",
    }
    points["marker"]["symbol"] = [
        "circle" if ok else "triangle-up" if value > 0.0 else "triangle-down"
        for ok, value in zip(inside, misfit, strict=True)
    ]
    shares = _linear("data - model [%]") | {"range": [-reach, reach], "zeroline": True}
    shares |= {"zerolinecolor": SUM_COLOUR}
    layout = {"height": 190, "xaxis": _times(at.tau), "yaxis": shares}
    return _figure([points], layout)


def density_figure(fitted: Fit, channel: Channel, spans: Spans) -> Figure:
    """Square root of the spectral density: samples, model and its terms."""
    factor = units_of("u/sqrt(Hz)", fitted.wv)[1]
    frequency, root = _density(channel, spans)
    traces = [_line(frequency, factor * root, "data", "#7f8c99", "solid", 1.2)]
    grid = np.geomspace(frequency[0], frequency[-1], 160)
    curves: dict[str, FloatArray] = {}
    for label, term in zip(fitted.model.term_labels(), fitted.model.terms, strict=True):
        if term.has_spectrum() and not term.is_line and not term.is_drift:
            curves[label] = factor * np.sqrt(np.maximum(term.psd(grid, channel.dt), 0.0))
    if curves:
        total = root_sum(list(curves.values()))
        traces += [*_terms(grid, curves), _line(grid, total, "model", SUM_COLOUR, "solid", 2.0)]
    units = _units("density", "u/sqrt(Hz)", fitted)
    known = root[root > 0.0]
    densities = _axis(units[0][0], 0.4 * factor * known.min(), 2.5 * factor * known.max())
    layout = {"height": 300, "xaxis": _axis("frequency [Hz]"), "yaxis": densities}
    return _figure(traces, layout, units=units, toggles=range(len(traces)))


def series_figure(fitted: Fit, channel: Channel, spans: Spans) -> Figure:
    """The time series in bins, less its mean, with what was left out of it."""
    factor, end = units_of("u", fitted.wv)[1], channel.n * channel.dt
    unit, scale = ("h", 3600.0) if end > 7200.0 else ("min", 60.0) if end > 600.0 else ("s", 1.0)
    time, *values = _bins(channel, spans)
    time, (mean, low, high) = time / scale, (factor * each for each in values)
    edge = {**_line(time, low, "smallest", SUM_COLOUR, "solid", 0), "hoverinfo": "skip"}
    filled = {"fill": "tonexty", "fillcolor": "rgba(0,114,178,0.35)"}
    line = _line(time, mean, "mean of the bin", SUM_COLOUR, "solid", 1.2)
    traces: list[Figure] = [
        edge,
        {**edge, "name": "largest", "y": _plain(high), **filled},
        {**line, "hovertemplate": f"%{{y:.4g}} at %{{x:.4g}} {unit}<extra></extra>"},
    ]
    units = _units("signal - mean", "u", fitted)
    mark = {"type": "rect", "yref": "paper", "y0": _TICK, "y1": 1, "fillcolor": "#d55e00"}
    mark |= {"line": {"width": 0}}
    out = [{"x0": first / scale, "x1": last / scale} for first, last in _gone(channel, spans)[:500]]
    layout = {
        "height": 220,
        "xaxis": _linear(f"time [{unit}]"),
        "yaxis": _linear(units[0][0]),
        "shapes": [mark | ends for ends in out],
    }
    return _figure(traces, layout, units=units)


def curve_figure(fitted: Fit, curve: BiasCurve, one: Covariate) -> Figure:
    """A curve against a covariate, with its 95 % band, less its value at the centre."""
    factor = units_of("u", fitted.wv)[1]
    x, value, error = curve.band(of=one.name)
    value = factor * (value - curve(one.centre, one.name))
    ends = (value - factor * error, value + factor * error)
    band = [_line(x, each, "95 % band", "#8a8a8a", "solid", 0.0) for each in ends]
    band[1] |= {"fill": "tonexty", "fillcolor": "rgba(130,130,130,0.28)"}
    units = _units("curve", "u", fitted)
    traces = [*band, _line(x, value, "curve", SUM_COLOUR, "solid", 2.0)]
    return _against(one, traces, units[0][0], units)


def leftover_figures(fitted: Fit, curve: BiasCurve) -> list[Figure]:
    """What the curve leaves, in means of blocks, and the size of the noise, against a covariate."""
    one, held, found = curve.main, fitted.wv.regressors, list[Figure]()
    if one is not None and held is not None:
        own = [(each.covariate, each.power) for each in curve.regressors].index((one.name, 1))
        rows = []
        for part in held.parts:
            left = part.blocks - (curve.values - held.removed) @ part.columns
            both = np.stack([one.centre + one.half * part.columns[own], left - np.nanmean(left)])
            size = -(-left.size // _PARTS)
            rows.append(both[:, : left.size // size * size].reshape(2, -1, size).mean(axis=2))
        x, left = np.hstack(rows)
        units = _units("signal - curve", "u", fitted)
        points = _points(x, units_of("u", fitted.wv)[1] * left, "means", COMPONENT_COLOURS[0], 4)
        found.append(_against(one, [points], units[0][0], units))
    if curve.scaling is not None and curve.covariates:
        one, own_noise = curve.covariates[0], curve.scaling
        x = np.linspace(one.low, one.high, 50)
        points = _points(own_noise.places, own_noise.deviation, "parts", COMPONENT_COLOURS[0], 4)
        line = _line(x, own_noise.factor(x), "growth", SUM_COLOUR, "solid", 2.0)
        found.append(_against(one, [points, line], "fast noise / model"))
    return found


def _against(
    one: Covariate, traces: list[Figure], title: str, units: Sequence[tuple[str, float]] = ()
) -> Figure:
    """A small figure against a covariate."""
    for each in traces:
        each["hovertemplate"] = f"%{{y:.4g}} at %{{x:.4g}} {one.unit}"
    axes = {"xaxis": _linear(f"{one.name} [{one.unit}]"), "yaxis": _linear(title)}
    return _figure(traces, {"height": 220, **axes}, units=units)


def growth_figure(known: ErrorBudget, unknown: ErrorBudget, of: str, quantity: str) -> Figure:
    """Growth of an error in an outage: parts, total, and total for unknown slow errors."""
    unit, times = FIELD_UNITS[quantity], np.array(known.grid)
    curves = known.curves(of, quantity)
    traces = _terms(times, curves)
    for budget, label, dash, width in (
        (known, "total, slow errors known", "solid", 3.0),
        (unknown, "total, nothing known", "dot", 2.0),
    ):
        parts = list(budget.curves(of, quantity).values())
        if parts:
            traces.append(_line(times, root_sum(parts), label, SUM_COLOUR, dash, width))
    title = f"{of} {quantity} [{unit}]"
    layout = {
        "height": 280,
        "xaxis": _axis("outage [s]") | {"tickvals": known.times, "minor": {}},
        "yaxis": _axis(title[0].upper() + title[1:]) | {"dtick": 2},
    }
    return _figure(traces, layout, toggles=range(len(traces)))


def _figure(
    traces: list[Figure],
    layout: Figure,
    *,
    units: Sequence[tuple[str, float]] = (),
    toggles: Iterable[int] = (),
    **more: Any,
) -> Figure:
    more |= {"units": list(units), "toggles": list(toggles), "config": _CONFIG}
    return {"data": traces, "layout": _LAYOUT | layout, **more}


def _units(title: str, unit: str, fitted: Fit) -> list[tuple[str, float]]:
    """Title of the axis and factor from the unit drawn first, for the field's unit and SI."""
    field, scale, si = units_of(unit, fitted.wv)
    own = [(f"{title} [{field}]", 1.0)] if field != si else []
    return [*own, (f"{title} [{si}]", 1.0 / scale)]


def _points(x: FloatArray, y: FloatArray, label: str, colour: str, size: int) -> Figure:
    marker = {"color": colour, "size": size}
    hover = "%{y:.4g} at %{x:.4g} s"
    return _scatter(x, y, label, mode="markers", marker=marker, hovertemplate=hover)


def _line(x: FloatArray, y: FloatArray, label: str, colour: str, dash: str, width: float) -> Figure:
    line = {"color": colour, "dash": dash, "width": width}
    hover = "%{y:.4g} at %{x:.4g}"
    return _scatter(x, y, label, mode="lines", line=line, hovertemplate=hover)


def _scatter(x: FloatArray, y: FloatArray, label: str, **style: Any) -> Figure:
    return {"type": "scatter", "name": label, "x": _plain(x), "y": _plain(y), **style}


def _bars(value: FloatArray, low: FloatArray, high: FloatArray, colour: str) -> Figure:
    above, below = (_plain(np.maximum(each, 0.0)) for each in (high - value, value - low))
    style = {"type": "data", "symmetric": False, "color": colour, "thickness": 1.2, "width": 3}
    return {**style, "array": above, "arrayminus": below}


def _plain(values: FloatArray) -> list[float | None]:
    """Five digits are more than a screen shows, and JSON has no infinity."""
    return [float(f"{v:.5g}") if np.isfinite(v) else None for v in np.asarray(values).tolist()]


def _times(tau: FloatArray) -> Figure:
    """The axis of averaging times, the same for all figures of a channel."""
    ends = np.log10([tau[0] / _BESIDE, tau[-1] * _BESIDE])
    return {**_axis("averaging time [s]"), "range": ends.tolist()}


def _axis(title: str, low: float | None = None, high: float = 1.0) -> Figure:
    """A logarithmic axis, between two values where they are given."""
    minor = {"ticks": "outside", "ticklen": 3}
    style = {"type": "log", "exponentformat": "power", "dtick": 1, "ticks": "outside"}
    ends = {} if low is None else {"range": [float(np.log10(low)), float(np.log10(high))]}
    return {**_linear(title), **style, "minor": minor, **ends}


def _linear(title: str) -> Figure:
    frame = {"gridcolor": _GRID, "linecolor": "#888888", "mirror": True, "zeroline": False}
    return {"title": {"text": title, "standoff": 6}, **frame}


# -- samples ---------------------------------------------------------------------------------------


def _used(channel: Channel, spans: Spans) -> FloatArray:
    """The samples of a channel, NaN where they were left out."""
    values = np.array(channel.values, dtype=float)
    for start, stop in spans:
        values[start:stop] = np.nan
    return values


def _bins(channel: Channel, spans: Spans) -> FloatArray:
    """Middle (s), mean, smallest and largest of used samples in bins, less their mean, (4, b)."""
    values = _used(channel, spans)
    values -= np.nanmean(values)
    edges = np.unique(np.linspace(0, values.size, min(_BINS, values.size) + 1).astype(int))
    first, known = edges[:-1], ~np.isnan(values)
    with np.errstate(invalid="ignore"):
        counts = np.add.reduceat(known, first, dtype=float)
        mean = np.add.reduceat(np.where(known, values, 0.0), first) / counts
        low, high = np.fmin.reduceat(values, first), np.fmax.reduceat(values, first)
    return np.array([0.5 * (first + edges[1:]) * channel.dt, mean, low, high])


def _gone(channel: Channel, spans: Spans) -> list[tuple[float, float]]:
    """First and last time (s) of what was left out, joined where a gap could not be seen."""
    width = 0.5 * channel.dt * channel.n / _BINS
    gone: list[tuple[float, float]] = []
    for start, stop in spans:
        first, last = start * channel.dt - width, stop * channel.dt + width
        if gone and first <= gone[-1][1]:
            first = gone.pop()[0]
        gone.append((first, last))
    return gone


def _density(channel: Channel, spans: Spans) -> tuple[FloatArray, FloatArray]:
    """Frequency (Hz) and root of the two-sided density of a channel, by twelfths of an octave."""
    found = spectrum(_used(channel, spans), channel.dt)
    octaves = np.log2(found.density.size / _FIRST_BIN)
    grid = np.linspace(0.0, octaves, int(_PER_OCTAVE * octaves) + 1)
    edges = np.unique(np.rint(_FIRST_BIN * 2.0**grid)).astype(int)
    mean = np.add.reduceat(found.density[: edges[-1]], edges[:-1]) / np.diff(edges)
    middle = 0.5 * (edges[:-1] + edges[1:] - 1) * found.resolution
    return middle, np.sqrt(0.5 * mean)
