"""The first screen: what an engineer came for, axis by axis."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from gmwm._core.notices import Notice
from gmwm._core.text import brief, per_cent
from gmwm._core.units import field_units, si_parameter_unit
from gmwm.calibration import AMBIGUITY, Calibration, floor
from gmwm.diagnosis import gathered
from gmwm.estimate import Fit
from gmwm.export import Triad
from gmwm.report.health import counted, findings
from gmwm.report.numbers import SHOWN, Certified
from gmwm.report.text import duration_text

_WHY = {
    "misfit": "the model misses the data",
    "level-missed": "the model misses one level",
    "amplitude-bound": "a term was not found",
    "search-limit": "a correlation time beyond reach",
    "redundant-term": "a term is not needed",
    "undetermined": "record too short for model",
    "indistinct-terms": "two terms look alike",
    "confounded": "terms cannot be separated",
    "too-few-levels": "record too short",
    "not-converged": "the search did not converge",
    "no-curvature": "the search did not converge",
    "drift-in-state": "the drift is no ramp",
    "no-region": "no straight region found",
    "wrong-slope": "slopes contradict the model",
    "recordings-differ": "the recordings disagree",
    "not-static": "the sensor moved",
    "tilt": "the sensor tilted",
    "rate-changes": "the sampling rate changed",
    "rounding": "steps coarser than the noise",
    "saturation": "samples cut off at range",
    "abrupt-end": "samples that end abruptly",
    "stuck": "values that stick",
    "held": "samples that repeat the one before",
    "filled": "samples put between others",
    "value-repeated": "one value stands for many",
    "variance": "the noise comes and goes",
    "step": "the bias stepped",
    "transient": "a transient at the start",
    "drift-at-start": "drift after switching on",
    "slow-period": "a slow period stands out",
    "departures-many": "the bias steps to and fro",
}
"""Code of a notice that makes a fit invalid -> why, in about five words."""

_AIM = 0.1  # relative standard error of the deviation that is well enough known

_COVERS = ("more-than-white-noise", "more-than-random-walk")


def answer(calibration: Calibration, numbers: Mapping[float, Certified]) -> dict[str, Any]:
    """Content of the first screen."""
    certified = numbers[SHOWN]
    rows = [_row(name, fit, calibration, certified) for name, fit in calibration.items()]
    return {
        "health": verdict(calibration),
        "horizon": f"{SHOWN:g} s",
        "rows": rows,
        "bounds": {letter: any(_is_bound(row[letter]) for row in rows) for letter in "NKB"},
        "length": length_sentence(calibration, SHOWN),
        "boxes": [_box(each, calibration) for each in numbers.values()],
    }


def verdict(calibration: Calibration) -> dict[str, str]:
    """The health of sensor and recording in one line."""
    found = findings(calibration)
    is_severe = any(n.severity == "bad" for n in gathered(calibration.notices))
    removed = dict.fromkeys(n.where for n in found if n.values.get("removed"))
    causes: dict[str, list[str]] = {}
    for name, fit in calibration.items():
        if not fit.valid:
            causes.setdefault(trust(name, fit, calibration)[1], []).append(name)
    parts = [f"{', '.join(names)} not valid: {cause}" for cause, names in causes.items()]
    parts += [f"{', '.join(calibration.skipped)} without a model"] if calibration.skipped else []
    parts += [_counted(found, severity, calibration) for severity in ("bad", "warning")]
    if removed:
        parts.append(f"departures from noise taken off ({', '.join(removed)})")
    text = "; ".join(filter(None, parts))
    if is_severe or causes or calibration.skipped:
        all_out = not any(fit.valid for fit in calibration.values())
        state, word = ("bad", "Not healthy") if all_out or is_severe else ("care", "Usable in part")
        return {"state": state, "word": word, "text": text}
    if not calibration.is_examined:
        return {"state": "care", "word": "Not examined", "text": "the fits are valid"}
    if text:
        return {"state": "care", "word": "Healthy, with care", "text": text}
    text = "nothing was found that spoils the estimates"
    return {"state": "good", "word": "Healthy", "text": text}


def _counted(notices: Sequence[Notice], severity: str, channels: Iterable[str]) -> str:
    """How many of a severity, and where: in which channels, of which parameters or not."""
    texts = ", ".join(each.where for each in notices if each.severity == severity).split(", ")
    places = (next((c for c in channels if f"{text} ".startswith(f"{c} ")), text) for text in texts)
    where = ", ".join(filter(None, dict.fromkeys(places)))
    count = counted(notices, severity)
    return f"{count} ({where})" if where else count


def trust(name: str, fit: Fit, calibration: Calibration) -> tuple[bool, str]:
    """Whether the numbers of a channel can be used, and why, in about five words."""
    for notice in fit.notices:
        if notice.severity == "bad":
            return False, _WHY.get(notice.code, notice.code.replace("-", " "))
    at = fit.goodness
    fits = "fits the data"
    if at.worst is not None:
        share = per_cent(abs(at.worst[0]))
        fits = f"fits within {share} up to {at.known_to:.3g} s"
    tied = next((n for n in calibration.notices if n.code == AMBIGUITY and n.where == name), None)
    return True, f"{fits}, {tied.values.get('models', 2):g} models fit alike" if tied else fits


def quantity_text(value: float, unit: str, fit: Fit) -> dict[str, str]:
    """A value in the field's first unit and in SI."""
    si = si_parameter_unit(unit, fit.wv.quantity)
    if fit.wv.quantity is None and fit.wv.unit:
        si = unit.replace("u", fit.wv.unit, 1)
    found = field_units(unit, fit.wv.quantity)
    own = (found[0].per_si, found[0].unit) if found else (1.0, si)
    return {"field": f"{brief(value * own[0], 3)} {own[1]}", "si": f"{value:.3g} {si}"}


def bias_instability(fit: Fit) -> dict[str, str]:
    """B from the lowest point of the curve; an upper bound where it falls to the end."""
    low = floor(fit)
    sign = "≤ " if low.falls else ""
    text = quantity_text(low.bias_instability, "u", fit)
    return {key: sign + each for key, each in text.items()}


def slow_terms(fit: Fit) -> list[dict[str, str]]:
    """The terms that do not average out within a second, in words."""
    shown = []
    params = {(item.term, item.parameter.name): item for item in fit.model.parameters}
    for place, term in enumerate(fit.model.terms):
        size = term.linear_parameter
        times = [v for k, v in term.values.items() if k == "tau" and v is not None]
        is_slow = term.is_walk or term.is_drift or any(tau > 1.0 for tau in times)
        if not is_slow or size is None:
            continue
        item = params[place, size.name]
        bounds = fit.upper_bounds
        sign = "< " if item.key in bounds else ""
        value = bounds.get(item.key, item.value or 0.0)
        text = quantity_text(value, size.unit, fit)
        tail = f", {brief(times[0], 3)} s" if times and not sign else ""
        word = "ramp" if term.is_drift else "walk" if term.is_walk else "GM"
        shown.append({key: f"{word} {sign}{each}{tail}" for key, each in text.items()})
    return shown


def _row(name: str, fit: Fit, calibration: Calibration, certified: Certified) -> dict[str, Any]:
    is_valid, why = trust(name, fit, calibration)
    return {
        "name": name,
        **{letter: _number(certified, name, letter, fit) for letter in "NK"},
        "B": bias_instability(fit),
        "slow": slow_terms(fit),
        "valid": is_valid,
        "why": why,
        "known": known_at(fit, SHOWN),
    }


def _is_bound(text: Mapping[str, str] | None) -> bool:
    return text is not None and text["si"].startswith("≤")


def _number(certified: Certified, name: str, letter: str, fit: Fit) -> dict[str, str] | None:
    if name not in certified.axes:
        return None
    unit = {"N": "u/sqrt(Hz)", "K": "u/s/sqrt(Hz)"}[letter]
    text = quantity_text(getattr(certified.axes[name], letter), unit, fit)
    sign = "≤ " if letter in certified.axes[name].upper else ""
    return {key: sign + each for key, each in text.items()}


def _box(certified: Certified, calibration: Calibration) -> dict[str, Any]:
    groups: dict[str, list[dict[str, Any]]] = {}
    if certified.triads:
        rows = [_of_all_axes(triad, certified.horizon, calibration) for triad in certified.triads]
        title = "One value for all axes of a sensor, as Kalibr, OpenVINS and VINS read it"
        if any(row["invalid"] for row in rows):
            title += (
                ": made from all models, also those not valid; at worst too large for a valid "
                "axis, as good as its model for another"
            )
        groups[title] = rows
    rows = groups.setdefault("Each axis by itself", [])
    for name, fit in calibration.items():
        if name in certified.axes:
            each = certified.axes[name]
            row = {letter: _number(certified, name, letter, fit) for letter in "NK"}
            start = quantity_text(each.initial_sd, "u", fit)
            nees = _consistency([each.nees], certified.horizon)
            invalid = [] if fit.valid else [name]
            rows.append({"name": name, **row, "start": start, "nees": nees, "invalid": invalid})
    return {
        "horizon": f"{certified.horizon:g}",
        "shown": certified.horizon == SHOWN,
        "groups": groups,
        "texts": certified.texts,
        "problem": certified.problem,
        "notes": certified.notes,
        "covers": [
            (name, "; ".join(texts))
            for name, axis in certified.axes.items()
            if (texts := [n.text for n in axis.notices if n.code in _COVERS])
        ],
    }


def _of_all_axes(triad: Triad, horizon: float, calibration: Calibration) -> dict[str, Any]:
    """A row of what files hold that have one value for the axes of a sensor."""
    fit = calibration[triad.axes[0].name]
    values = {"N": (triad.N, "u/sqrt(Hz)"), "K": (triad.K, "u/s/sqrt(Hz)")}
    invalid = [axis.name for axis in triad.axes if not calibration[axis.name].valid]
    row: dict[str, Any] = {"name": triad.quantity, "invalid": invalid}
    for letter, (value, unit) in values.items():
        sign = "≤ " if triad.is_upper(letter) else ""
        row[letter] = {key: sign + each for key, each in quantity_text(value, unit, fit).items()}
    row["start"] = quantity_text(triad.initial_sd, "u", fit)
    row["nees"] = _consistency(list((triad.shared_nees or {}).values()), horizon)
    return row


def _consistency(found: Sequence[Mapping[float, float]], time: float) -> str:
    """NEES of axes at a time: their range."""
    values = [nees for each in found if np.isfinite(nees := each.get(time, float("nan")))]
    ends = dict.fromkeys(f"{each:.2g}" for each in (min(values), max(values))) if values else ()
    return " to ".join(ends) or "not predicted"


def known_at(fit: Fit, tau: float) -> float:
    """Relative standard error of the model's Allan deviation at an averaging time."""
    if not fit.keys or fit.wv.dt > tau:
        return float("nan")
    with np.errstate(all="ignore"):
        value, _, upper = fit.deviation_interval(np.array([tau]), 0.6827)
    return float(upper[0] / value[0] - 1.0) if value[0] > 0.0 else float("nan")


def length_sentence(calibration: Calibration, horizon: float) -> str:
    """Whether the recording is long enough for a horizon, and how long for all parameters."""
    known = {name: known_at(fit, horizon) for name, fit in calibration.items()}
    known = {name: each for name, each in known.items() if np.isfinite(each)}
    parts = []
    if known:
        worst = max(known, key=lambda name: known[name])
        need = calibration.duration * (known[worst] / _AIM) ** 2
        # A curve that ends before the horizon is known there by the model alone.
        covered = min(float(fit.wv.tau[-1]) for fit in calibration.values()) >= horizon
        share = f"{per_cent(known[worst])} (1 sigma, {worst})"
        if need <= calibration.duration and covered:
            parts.append(
                f"long enough for {horizon:g} s outages: every curve is known there to {share}"
            )
        else:
            least = max(need, 4.0 * horizon)
            parts.append(
                f"too short for {horizon:g} s outages: the curve is known there to {share}; record "
                f"{duration_text(least)} for {100.0 * _AIM:g} %"
            )
    lengths = [
        (seconds, f"{key} of {name}")
        for name, fit in calibration.items()
        for key, seconds in fit.needed_length(_AIM).items()
    ]
    finite = [each for each in lengths if np.isfinite(each[0])]
    if finite:
        longest, what = max(finite)
        parts.append(
            f"every parameter is known to {100.0 * _AIM:g} %"
            if longest <= calibration.duration
            else f"every parameter to {100.0 * _AIM:g} % would take {duration_text(longest)} "
            f"({what})"
        )
    return "; ".join(parts) + "." if parts else ""
