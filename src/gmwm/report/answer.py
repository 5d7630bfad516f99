"""The first screen: health, filter numbers, length and the axes."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from gmwm._core.pages import page_of
from gmwm._core.text import brief, per_cent
from gmwm.calibration import AMBIGUITY, Calibration, axis_numbers
from gmwm.diagnosis import gathered
from gmwm.estimate import Fit
from gmwm.export import Axis, Triad
from gmwm.issues import Notice
from gmwm.report.health import counted, findings, length_sentence, parameters_sentence
from gmwm.report.numbers import SHOWN, Certified, certified
from gmwm.report.page import units_of

_COVERS = ("more-than-white-noise", "more-than-random-walk")


def answer(calibration: Calibration, numbers: Mapping[float, Certified]) -> dict[str, Any]:
    """Content of the first screen."""
    boxes = [_box(each, calibration) for each in numbers.values()]
    values = [row[letter] for box in boxes for row in box["axes"].values() for letter in "NK"]
    rows = [_row(name, fit, calibration) for name, fit in calibration.items()]
    return {
        "health": verdict(calibration),
        "horizon": f"{SHOWN:g} s",
        "trusted": [row["name"] for row in rows if row["valid"]],
        "causes": [(", ".join(names), why) for why, names in _causes(calibration).items()],
        "rows": rows,
        "bounds": {
            "B": any(map(_is_bound, (row["B"] for row in rows))),
            "N or K": any(map(_is_bound, values)),
        },
        "parameters": parameters_sentence(calibration),
        "boxes": boxes,
    }


def _causes(calibration: Calibration) -> dict[str, list[str]]:
    """Reason why a fit is not valid -> its channels."""
    causes: dict[str, list[str]] = {}
    for name, fit in calibration.items():
        if not fit.valid:
            causes.setdefault(trust(name, fit, calibration)[1], []).append(name)
    return causes


@page_of(Calibration, "verdict")
def verdict(calibration: Calibration) -> dict[str, str]:
    """The health of sensor and recording in one line, and what of it no channel's validity says."""
    found = findings(calibration)
    is_severe = any(n.severity == "bad" for n in gathered(calibration.notices))
    removed = dict.fromkeys(n.where for n in found if n.values.get("removed"))
    causes = _causes(calibration)
    parts = [f"{', '.join(names)} not valid: {cause}" for cause, names in causes.items()]
    parts += [f"{', '.join(calibration.skipped)} have no model"] if calibration.skipped else []
    others = [_counted(found, severity, calibration) for severity in ("bad", "warning")]
    if removed:
        others.append(f"departures from noise subtracted ({', '.join(removed)})")
    text, rest = ("; ".join(filter(None, each)) for each in ([*parts, *others], others))
    if is_severe or causes or calibration.skipped:
        all_out = not any(fit.valid for fit in calibration.values())
        state, word = ("bad", "Not healthy") if all_out or is_severe else ("care", "Usable in part")
        return {"state": state, "word": word, "text": text, "rest": rest}
    if not calibration.is_examined:
        text = "the fits are valid"
        return {"state": "care", "word": "Not examined", "text": text, "rest": text}
    if text:
        return {"state": "care", "word": "Healthy, with care", "text": text, "rest": text}
    text = "no defect found"
    return {"state": "good", "word": "Healthy", "text": text, "rest": text}


def _counted(notices: Sequence[Notice], severity: str, channels: Iterable[str]) -> str:
    """Number of notices of a severity, and their channels."""
    texts = ", ".join(each.where for each in notices if each.severity == severity).split(", ")
    places = (next((c for c in channels if f"{text} ".startswith(f"{c} ")), text) for text in texts)
    where = ", ".join(filter(None, dict.fromkeys(places)))
    count = counted(notices, severity)
    return f"{count} ({where})" if where else count


def trust(name: str, fit: Fit, calibration: Calibration) -> tuple[bool, str]:
    """Whether the numbers of a channel can be used, and why, in about five words."""
    bad = [notice.issue for notice in fit.notices if notice.severity == "bad"]
    if bad:
        # A departure from noise is why the model misses levels too.
        issue = next((each for each in bad if each.topic == "departure"), bad[0])
        return False, issue.reason or issue.code.replace("-", " ")
    at = fit.goodness
    fits = "fits the data"
    if at.worst is not None:
        share = per_cent(abs(at.worst[0]))
        fits = f"within {share} of the data up to {brief(at.known_to, 2)} s"
    tied = next((n for n in calibration.notices if n.code == AMBIGUITY and n.where == name), None)
    return (
        True,
        f"{fits}, {tied.values.get('models', 2):g} models fit equally well" if tied else fits,
    )


def quantity_text(value: float, unit: str, fit: Fit) -> dict[str, str]:
    """A value in the field's first unit and in SI."""
    field, scale, si = units_of(unit, fit.wv)
    return {"field": f"{brief(value * scale, 3)} {field}", "si": f"{value:.3g} {si}"}


def bias_instability(fit: Fit) -> dict[str, str]:
    """B from the lowest point of the curve; an upper bound where it falls to the end."""
    b = axis_numbers(fit).B
    sign = "≤ " if b.kind == "bound" else ""
    text = quantity_text(b.upper if sign else b.value, "u", fit)
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


def _row(name: str, fit: Fit, calibration: Calibration) -> dict[str, Any]:
    is_valid, why = trust(name, fit, calibration)
    return {
        "name": name,
        "B": bias_instability(fit),
        "slow": slow_terms(fit),
        "valid": is_valid,
        "why": why,
    }


def _is_bound(text: Mapping[str, str]) -> bool:
    return text["si"].startswith("≤")


def _numbers(found: Axis | Triad, upper: Collection[str], fit: Fit) -> dict[str, dict[str, str]]:
    """N, K and the bias at the start, each in two units."""
    texts = {"start": quantity_text(found.initial_sd, "u", fit)}
    for letter, unit in {"N": "u/sqrt(Hz)", "K": "u/s/sqrt(Hz)"}.items():
        sign = "≤ " if letter in upper else ""
        text = quantity_text(getattr(found, letter), unit, fit)
        texts[letter] = {key: sign + each for key, each in text.items()}
    return texts


def _box(numbers: Certified, calibration: Calibration) -> dict[str, Any]:
    """Filter numbers for one length of outages."""
    horizon, axes = numbers.horizon, numbers.axes
    covered = {
        name: [n.text for n in axis.notices if n.code in _COVERS] for name, axis in axes.items()
    }
    nees = {t.quantity: list((t.shared_nees or {}).values()) for t in numbers.triads}
    shared = [(name, _consistency(each, horizon)) for name, each in nees.items()]
    single = [
        (name, "; ".join([_consistency([axis.nees], horizon), *covered[name]]))
        for name, axis in axes.items()
    ]
    return {
        "horizon": f"{horizon:g}",
        "shown": horizon == SHOWN,
        "sensors": [_of_all_axes(triad, calibration) for triad in numbers.triads],
        "axes": {
            name: _numbers(axis, axis.upper, calibration[name]) for name, axis in axes.items()
        },
        "length": length_sentence(calibration, horizon),
        "texts": numbers.texts,
        "problem": numbers.problem,
        "notes": numbers.notes,
        "about": [*shared, *single],
    }


def _of_all_axes(triad: Triad, calibration: Calibration) -> dict[str, Any]:
    """What files hold that have one value for the axes of a sensor, and whether to use it."""
    names = [axis.name for axis in triad.axes]
    valid = [name for name in names if calibration[name].valid]
    invalid = [name for name in names if name not in valid]
    use = f"do not use {', '.join(invalid)} yet" if invalid else ""
    if use and valid:
        use = f"use for {', '.join(valid)}; {use}"
    upper = [letter for letter in "NK" if triad.is_upper(letter)]
    return {
        "name": triad.quantity,
        "use": use,
        **_numbers(triad, upper, calibration[names[0]]),
    }


def filter_sentence(calibration: Calibration) -> str:
    """Filter numbers of both sensors; empty without gyros and accelerometers."""
    parts = []
    for triad in certified(calibration, (SHOWN,))[SHOWN].triads:
        found = _of_all_axes(triad, calibration)
        use = f" ({found['use']})" if found["use"] else ""
        parts.append(f"{found['name']} N {found['N']['si']}, K {found['K']['si']}{use}")
    text = "; ".join(parts)
    return text and f"N and K for outages up to {SHOWN:g} s: {text}."


def _consistency(found: Sequence[Mapping[float, float]], time: float) -> str:
    """NEES of axes at a time: their range."""
    values = [nees for each in found if np.isfinite(nees := each.get(time, float("nan")))]
    ends = dict.fromkeys(f"{each:.2g}" for each in (min(values), max(values))) if values else ()
    return f"consistency {' to '.join(ends)}" if ends else "consistency not predicted"
