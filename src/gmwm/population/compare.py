"""`compare`: several recordings or units of a sensor side by side."""

import os
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import chain, count
from pathlib import PurePath
from typing import Any, TypeVar

import numpy as np

from gmwm._core import checks
from gmwm._core.distributions import chi2
from gmwm._core.typing import Progress
from gmwm.calibration import Calibration, calibrate
from gmwm.errors import InputError, printable
from gmwm.estimate import Fit
from gmwm.filter_numbers import AxisFilterNumbers, bound
from gmwm.issues import Notice, notice
from gmwm.population import tuning
from gmwm.population.comparison import AxisComparison, SensorComparison
from gmwm.population.curves import Equality
from gmwm.population.unit import Choice
from gmwm.readers import Recording, is_frame
from gmwm.selection import select
from gmwm.variance import WaveletVariance

_LONGEST_LABEL = 28  # characters

Sourced = TypeVar("Sourced", Calibration, Recording)


def compare(
    sources: Sequence[Any] | Mapping[str, Any],
    *,
    horizon: float = 60.0,
    progress: Progress | None = None,
) -> SensorComparison:
    """Compare calibrations of a sensor on several days, or of several units of a kind.

    Between recordings of one sensor the selected models differ far more than the curves. So curves
    are tested for equality, level by level with their covariances; N, B and K come from one
    structure for all recordings, as in `gmwm.fleet`; and `gmwm.bound` gives N and K for a filter,
    whatever the structure.

    Parameters
    ----------
    sources : sequence or mapping of str to each
        Two or more: `Calibration`, the path of a saved one, or a `Recording` or DataFrame, which
        is calibrated first; or an Allan curve, or those of `gmwm.read_curves`, at the same
        averaging times. The keys of a mapping name them.
    horizon : float, optional
        Longest outage that the filter numbers are for, s.
    progress : callable, optional
        Called as ``progress(done, total, channel)``.

    Raises
    ------
    InputError
        If there are fewer than two different recordings, one cannot be used, or they have no
        channel in common.

    Notes
    -----
    The test of a channel is the sum of squares of the cube roots of the wavelet variances about
    their generalized mean, with the covariances that the models imply: chi-square with (R - 1) J
    degrees of freedom for R recordings of J levels of the same noise. Channels are tested together
    at 5 % (Holm 1979). Channels that differ by less than 10 % of the deviation in every part of the
    curve are called close: with a million samples a change of temperature shows.
    """
    horizon = checks.positive("horizon", horizon, "give the longest outage in seconds")
    single = isinstance(
        sources, str | os.PathLike | Calibration | Recording | WaveletVariance
    ) or is_frame(sources)
    if single or not isinstance(sources, Iterable):
        raise InputError(
            f"{checks.shown(sources)} is not a list of recordings: give two calibrations or more"
        )
    if isinstance(sources, Mapping):
        named = {printable(str(label)): _calibration(each) for label, each in sources.items()}
    else:
        given = list(sources)
        paths = [each if isinstance(each, str | os.PathLike) else "" for each in given]
        named = labelled([_calibration(each) for each in given], paths)
    calibrations, notices = _different(named)
    names = dict.fromkeys(n for each in calibrations.values() for n in (*each, *each.skipped))
    members = {name: _members(name, calibrations) for name in names}
    for name, (_, out) in members.items():
        notices += [replace(why, where=name, source=label) for label, why in out.items()]
    shared = [name for name, (fits, _) in members.items() if len(fits) > 1]
    if not shared:
        why = next((str(replace(n, hint="")) for n in notices if n.source), "")
        raise InputError(
            f"there is nothing to compare: {why or 'they have no channel in common'}; give "
            "recordings of one rate that have a channel in common"
        )
    tests = {name: Equality.of(list(members[name][0].values())) for name in shared}
    p_values = _holm({name: test.p_value for name, test in tests.items()})
    axes = {}
    tell = progress or (lambda *_: None)
    for done, name in enumerate(names):
        tell(done, len(names), name)
        tested = tests.get(name), p_values.get(name, float("nan"))
        axes[name], found = _axis(name, members[name], tested, horizon)
        notices += found
    tell(len(names), len(names), "")
    for name, axis in axes.items():
        if axis.state in ("close", "differ"):
            values: dict[str, Any] = {"p_value": axis.p_value}
            for worst in axis.main[:1]:
                values |= {"extent": worst.extent, "sigma": worst.sigma, "tau": worst.longest}
            notices.append(notice(f"curves-{axis.state}", name, values, sentence=axis.sentence))
    # How well so many recordings know their spread.
    dof = len(calibrations) - 1
    tails = 0.5 - 0.5 * tuning.SPREAD, 0.5 + 0.5 * tuning.SPREAD
    high, low = (float(np.sqrt(dof / chi2.ppf(tail, dof))) for tail in tails)
    spread = {"recordings": len(calibrations), "factor": high}
    notices.append(notice("few-recordings", values=spread, low=low))
    return SensorComparison(calibrations, axes, horizon, tuple(notices))


def _calibration(source: Any) -> Calibration:
    if isinstance(source, Calibration):
        return source
    if isinstance(source, str | os.PathLike):
        return Calibration.load(source)
    if isinstance(source, Recording) or is_frame(source):
        return calibrate(source)
    if isinstance(source, WaveletVariance):
        source = {source.name or "curve": source}
    curves = [*source.values()] if isinstance(source, Mapping) else []
    if curves and all(isinstance(each, WaveletVariance) for each in curves):
        fits, first = {name: select(each).fit for name, each in source.items()}, curves[0]
        return Calibration(fits, {}, "curve", 1.0 / first.dt, first.n)
    raise InputError(
        f"{checks.shown(source)} is neither a calibration nor a recording: give a "
        "result of gmwm.calibrate or its path, a recording from gmwm.read, or curves"
    )


def labelled(
    calibrations: Sequence[Sourced], paths: Sequence[str | os.PathLike[str]]
) -> dict[str, Sourced]:
    """Calibrations or recordings by short labels.

    A label is the name of the recording; where recordings have one name, it is what differs between
    the paths of the files that were given (empty if there is none), or else a number.
    """
    names = []
    for place, each in enumerate(calibrations):
        first = PurePath(each.source.replace("\\", "/").split(", ")[0])
        stem = PurePath(first.stem).stem  # of day1.csv.gz, too
        names.append(printable(stem[:_LONGEST_LABEL]) or f"recording {place + 1}")
    wanted = list(names)
    for name in (name for name, number in Counter(names).items() if number > 1):
        same = [place for place, each in enumerate(names) if each == name]
        known = [PurePath(paths[k]) if str(paths[k]) else PurePath() for k in same]
        parts = [list(path.parent.parts) + [path.stem] * bool(path.name) for path in known]
        for end in (0, -1):
            while all(parts) and len({own[end] for own in parts}) == 1:
                for own in parts:
                    own.pop(end)
        for place, part in zip(same, map("/".join, parts), strict=True):
            wanted[place] = printable(part[-_LONGEST_LABEL:]) or name
    found: dict[str, Sourced] = {}
    for name, calibration in zip(wanted, calibrations, strict=True):
        labels = chain([name], (f"{name} ({copy})" for copy in count(2)))
        found[next(each for each in labels if each not in found)] = calibration
    return found


def _different(given: Mapping[str, Calibration]) -> tuple[dict[str, Calibration], list[Notice]]:
    """Each recording once, and notices of copies."""

    def is_same(a: Calibration, b: Calibration) -> bool:
        shared = [name for name in a if name in b]
        return bool(shared) and all(
            np.array_equal(a[name].wv.variance, b[name].wv.variance) for name in shared
        )

    kept: dict[str, Calibration] = {}
    notices = []
    for label, each in given.items():
        same = [other for other, known in kept.items() if is_same(each, known)]
        if same:
            copy = notice("same-recording", values={"other": same[0]})
            notices.append(replace(copy, source=label))
        else:
            kept[label] = each
    if len(kept) < 2:
        why = "; ".join(f"{n.source} is {n.text}" for n in notices) or f"there is {len(kept)}"
        raise InputError(f"a comparison needs two recordings or more ({why}): give another one")
    return kept, notices


def _members(
    name: str, calibrations: Mapping[str, Calibration]
) -> tuple[dict[str, Fit], dict[str, Notice]]:
    """Fits of a channel that can be compared, and why the others cannot."""
    fits: dict[str, Fit] = {}
    out: dict[str, Notice] = {}
    for label, each in calibrations.items():
        if name in each.skipped:
            out[label] = notice("channel-skipped", reason=each.skipped[name].text)
        elif name not in each:
            out[label] = notice("channel-missing")
        else:
            # What makes a curve other than noise alone.
            bad = [n for n in each[name].notices if n.severity == "bad" and n.issue.topic != "fit"]
            bad = [n for n in bad if n.issue.lacks not in ("", "units_agree")]
            if bad:
                out[label] = notice("not-noise", values={"reason": bad[0].code}, bad=bad[0].text)
            else:
                fits[label] = each[name]
    unlike = _unlike(fits)
    return {k: fit for k, fit in fits.items() if k not in unlike}, out | unlike


def _unlike(fits: Mapping[str, Fit]) -> dict[str, Notice]:
    """Fits of another rate, unit or wavelet than most have."""

    def is_like(a: Fit, b: Fit) -> bool:
        near = abs(np.log(a.wv.dt / b.wv.dt)) < tuning.SAME_RATE
        return bool(near and (a.wv.unit, a.wv.wavelet) == (b.wv.unit, b.wv.wavelet))

    if not fits:
        return {}
    # A tie is won by the higher rate, so that the order of the recordings changes nothing.
    usual = max(
        fits.values(), key=lambda fit: (sum(is_like(fit, f) for f in fits.values()), -fit.wv.dt)
    )
    most = [label for label, fit in fits.items() if is_like(fit, usual)]
    found = {}
    for label, fit in ((label, fit) for label, fit in fits.items() if label not in most):
        code = "rates-differ" if fit.wv.unit == usual.wv.unit else "units-differ"
        values = {"rate": 1.0 / fit.wv.dt, "usual": 1.0 / usual.wv.dt}
        words: dict[str, Any] = {"own": fit.wv.unit, "common": usual.wv.unit}
        words["others"] = most[0] if len(most) == 1 else "the others"
        found[label] = notice(code, values=values, **words)
    return found


def _axis(
    name: str,
    members: tuple[dict[str, Fit], dict[str, Notice]],
    tested: tuple[Equality | None, float],
    horizon: float,
) -> tuple[AxisComparison, list[Notice]]:
    """A channel: its fits, recordings left out, test and p-value, made into a comparison."""
    (fits, out), (test, p_value) = members, tested
    structure = Choice({name: fits}, is_given=False)(name)
    covering, notices = _covering(name, fits, horizon)
    for label, fit in fits.items():
        codes = ", ".join(n.code for n in fit.notices if n.severity == "bad")
        if codes:
            values, hint = {"reasons": codes}, "the curve is compared all the same"
            invalid = notice(
                "fit-not-valid", name, values, variant="compared", severity="note", hint=hint
            )
            notices.append(replace(invalid, source=label))
    axis = AxisComparison(name, fits, out, test, p_value, structure, covering)
    return axis, notices


def _holm(p_values: Mapping[str, float]) -> dict[str, float]:
    """p-values for all tests together (Holm 1979); NaN stays."""
    known = sorted((p, name) for name, p in p_values.items() if np.isfinite(p))
    adjusted, largest = dict(p_values), 0.0
    for place, (p, name) in enumerate(known):
        largest = max(largest, min(1.0, (len(known) - place) * p))
        adjusted[name] = largest
    return adjusted


def _covering(
    name: str, fits: Mapping[str, Fit], horizon: float
) -> tuple[dict[str, AxisFilterNumbers], list[Notice]]:
    """Filter numbers that cover all recordings of a channel, by recording, and what is missing."""
    notices = []
    # The end of a name tells `bound` whether a gyro turns the heading.
    group = {f"{label} {name}": fit for label, fit in fits.items()}
    for label, fit in fits.items():
        try:
            bound(fit, horizon=horizon)
        except InputError as error:
            del group[f"{label} {name}"]
            notices.append(replace(notice("no-numbers", name, error=error), source=label))
    try:
        found = bound(group, horizon=horizon, shared=True) if group else {}
    except InputError as error:
        return {}, [*notices, notice("no-numbers", name, error=error)]
    return {label.removesuffix(f" {name}"): each for label, each in found.items()}, notices
