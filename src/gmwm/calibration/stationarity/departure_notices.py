"""What a calibration reports of departures from stationary noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gmwm._core.distributions import chi2
from gmwm._core.notices import Notice, Severity
from gmwm._core.text import brief, readable
from gmwm.calibration import tuning
from gmwm.calibration.stationarity.departures import WIDE, Departure
from gmwm.estimate import Fit
from gmwm.variance import WaveletVariance


def with_departures(
    fitted: Fit,
    sources: Sequence[str],
    found: Sequence[Sequence[Departure]],
    removed: Sequence[Sequence[Departure]],
    curves: Sequence[Sequence[WaveletVariance]],
    *,
    removing: bool = False,
) -> Fit:
    """A fit with a notice of each departure; not valid if one accounts for much of the noise.

    sources: Of its recordings; named where there are several.
    found, removed: What each recording has, and what was taken off before the fit.
    curves: Of each recording, before that was taken off and without it.
    removing: Whether departures were to be taken off: those that are left are no more.
    """
    unit = fitted.wv.unit
    notices = [
        replace(notice, source=source if len(sources) > 1 else "")
        for source, there, gone, both in zip(sources, found, removed, curves, strict=True)
        for notice in (
            *_found_notices(there, unit, removing=removing),
            *(_removed_notice(each, unit) for each in gone),
            *(_taken_notices(gone, *both) if gone else ()),
        )
    ]
    return replace(fitted, notices=(*fitted.notices, *notices)) if notices else fitted


def _taken_notices(
    removed: Sequence[Departure], before: WaveletVariance, after: WaveletVariance
) -> list[Notice]:
    """What a model lacks without what was taken off, and whether that was noise of the sensor."""
    levels = min(before.tau.size, after.tau.size)  # what is taken off leaves gaps
    rest = after.variance[:levels]
    ratio = np.divide(before.variance[:levels], rest, out=np.zeros(levels), where=rest > 0.0)
    lost = np.sqrt(np.maximum(ratio, 0.0))
    most = int(np.argmax(lost))
    notices = []
    if lost[most] ** 2 * (1.0 - tuning.HARMFUL_SHARE) > 1.0:
        values = {"tau": float(after.tau[most]), "ratio": float(lost[most])}
        text = (
            f"with what was taken off, the record has {brief(values['ratio'])} times the deviation "
            f"at tau = {values['tau']:.3g} s: the model holds where nothing like it comes again"
        )
        hint = "find its cause, or let a slow term of the model describe it"
        notices.append(Notice("departures-removed", "warning", "", text, values, hint))
    between = _is_between_two_levels(removed)
    if between or len(removed) > tuning.MOST_REMOVED:
        how = "steps between two levels" if between else "changes so often"
        text = (
            f"{len(removed)} departures were taken off: a level that {how} is noise of the sensor"
        )
        values = {"removed": len(removed), "two_levels": between}
        hint = "fit a slow term in place of it, such as a Gauss-Markov process"
        notices.append(Notice("departures-many", "bad", "", text, values, hint))
    return notices


def _found_notices(found: Sequence[Departure], unit: str, *, removing: bool) -> list[Notice]:
    """Of what was not taken off: for a level that jumps between two, the slow terms stand."""
    evident = [each for each in found if each.is_evident]
    many = len(evident) > tuning.MOST_REMOVED and _is_between_two_levels(evident)
    notices = [
        departure_notice(each, unit, stays=removing, back=_way_back(each, found)) for each in found
    ]
    if removing or not many:
        return notices
    text = (
        f"{len(evident)} departures: a level that steps between two levels is noise of the "
        "sensor, for which the slow terms of the model stand"
    )
    values = {"removed": 0, "two_levels": True}
    jumps = Notice("departures-many", "warning", "", text, values, "find what switches so")
    return [jumps, *map(_alone, notices)]


def _way_back(step: Departure, found: Sequence[Departure]) -> Departure | None:
    """The other step of a pulse, whose share is that of both."""
    alike = (o for o in found if o is not step and (o.kind, o.share) == (step.kind, step.share))
    return next(alike, None) if step.share else None


def _alone(notice: Notice) -> Notice:
    """What it is, without what follows from it."""
    return replace(notice, severity="note", text=notice.text.partition(";")[0], hint="")


def _is_between_two_levels(removed: Sequence[Departure]) -> bool:
    """Whether three steps in a row, of sizes that are well known, go up and down by the same."""
    steps = sorted((each.time[0], each.size) for each in removed if each.kind == "step")
    sizes = np.array([size * (-1) ** i for i, (_, (size, _, _)) in enumerate(steps)])
    errors = np.array([(high - low) / (2.0 * WIDE) for _, (_, low, high) in steps])
    for i in range(sizes.size - 2):
        three, weights = sizes[i : i + 3], errors[i : i + 3] ** -2.0
        if np.any(errors[i : i + 3] > tuning.WELL_KNOWN * np.abs(three)):
            continue
        rest = three - np.average(three, weights=weights)
        alike = chi2.sf(float(weights @ rest**2), 2) > tuning.OTHER_SIZE
        if alike and abs(float(np.sum(np.sign(three)))) == three.size:
            return True
    return False


def _removed_notice(found: Departure, unit: str) -> Notice:
    """Of what a fit is without."""
    notice = _alone(departure_notice(found, unit))
    return replace(notice, values={**notice.values, "removed": True}, hint="taken off")


def departure_notice(
    found: Departure, unit: str, *, stays: bool = False, back: Departure | None = None
) -> Notice:
    """What it is, and whether a fit beside it is valid.

    unit: Of the channel, SI.
    stays: Whether taking it off was tried, so that it is no advice.
    back: The other step of a pulse.
    """
    size, low, high = (readable(each, unit, sign=True) for each in found.size)
    size = f"{size} ({low} .. {high})"
    time, first, last = (f"{each:.4g}" for each in found.time)
    when = f"{time} s ({first} .. {last})"
    what, remedy = {
        "step": (
            f"a step of {size} at {when}",
            "calibrate the part before it or after it",
        ),
        "transient": (
            f"a transient of {size} at the start with a time constant of {when}",
            "leave out the first three time constants",
        ),
        "drift-at-start": (
            f"a drift by {size} from the start, which ends at {when}: a transient after switching "
            "on and no rate ramp",
            "leave it out",
        ),
        "slow-period": (
            f"a period of {when} with an amplitude of {size}",
            "find what varies so, such as the temperature",
        ),
    }[found.kind]
    harmful = found.share > tuning.HARMFUL_SHARE
    severity: Severity
    if found.is_evident:
        severity = "bad" if harmful else "warning"
        part = f"up to {100.0 * found.share:.0f} %" if found.share < 1.0 else "all"
        who = f"it and the step at {back.time[0]:.4g} s account" if back else "it accounts"
        text = (
            f"{what}; {who} for {part} of the model's wavelet variance, so that slow "
            "terms of the model are too large"
        )
        hint = remedy if stays else f"{remedy}, or take it off (remove_departures=True)"
    else:
        severity = "warning" if harmful else "note"
        text = f"{what}, or slow noise: this record cannot distinguish them"
        hint = "a longer record can"
    names = ("time", "time_lower", "time_upper", "size", "lower", "upper")
    values = dict(zip(names, (*found.time, *found.size), strict=True))
    values |= {"phase": found.phase, "evidence": found.evidence, "share": found.share}
    values |= {"evident": found.is_evident, "removable": found.is_evident and not stays}
    return Notice(found.kind, severity, "", text, values, hint)
