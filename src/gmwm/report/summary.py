"""The answer in a page of text: sensor numbers, filter numbers, and what to do."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import PurePath

import numpy as np

from gmwm._core.text import WIDTH, brief, wrapped
from gmwm._core.units import si_parameter_unit
from gmwm.calibration import LONGEST_PART, Calibration
from gmwm.export import Triad
from gmwm.issues import Notice, worst_first
from gmwm.report.answer import quantity_text, trust
from gmwm.report.health import findings, length_sentence
from gmwm.report.numbers import SHOWN, certified
from gmwm.report.page import duration_text

_ACTIONS = 3  # notices that matter most
_LINES = 2  # of each


def summary(calibration: Calibration, files: Iterable[str] = ()) -> str:
    """Verdict, sensor numbers, filter numbers, the worst notices with what to do, and the files.

    At most 30 lines of 80 columns for three gyros and three accelerometers.

    Parameters
    ----------
    calibration : Calibration
    files : iterable of str, optional
        Lines about the files that were written.
    """
    parts = [_verdict(calibration), _sensor(calibration), _filter(calibration)]
    parts += [_actions(calibration), list(files)]
    return "\n\n".join("\n".join(part) for part in parts if part)


def _verdict(calibration: Calibration) -> list[str]:
    name = ", ".join(PurePath(each).name for each in calibration.source.split(", "))
    size = f"{duration_text(calibration.duration)} at {calibration.rate:g} Hz"
    usable = [name for name, fit in calibration.items() if fit.valid]
    others = [each for each in (*calibration, *calibration.skipped) if each not in usable]
    count = len(usable) + len(others)
    text = f"{len(usable)} of {count} axes usable"
    if not others:
        text = f"all {count} axes usable"
    elif not usable:
        text = "no axis usable"
    return wrapped(f"{name or 'recording'}: {size}, {text}.")


def _sensor(calibration: Calibration) -> list[str]:
    """The table of sensor numbers; for an axis that is not valid, why."""
    lines = calibration.numbers.text().splitlines()
    for place, line in enumerate(lines):
        name = line.partition(" ")[0]
        if name in calibration and not calibration[name].valid:
            why = trust(name, calibration[name], calibration)[1]
            lines[place] = f"{line.partition('not valid')[0]}not valid: {why}"[:WIDTH]
    for name, skipped in calibration.skipped.items():
        lines += wrapped(f"{name}  no model: {skipped.text}", indent=2)
    return lines


def _filter(calibration: Calibration) -> list[str]:
    """N, K and start bias of each sensor for outages, and what else they cover."""
    triads = certified(calibration, (SHOWN,))[SHOWN].triads
    if not triads:
        return []
    lines = [
        f"For your filter, outages up to {SHOWN:g} s (add your turn-on bias to the start bias)"
    ]
    for triad in triads:
        values = {"N": triad.N, "K": triad.K, "start": triad.initial_sd}
        units = {"N": "u/sqrt(Hz)", "K": "u/s/sqrt(Hz)", "start": "u"}
        row = f"{triad.quantity:<6}"
        for key, value in values.items():
            limit = "<= " if key != "start" and triad.is_upper(key) else ""
            unit = si_parameter_unit(units[key], triad.quantity)
            row += f" {key} {limit}{_short(value)} {unit} "
        lines.append(row.rstrip())
        lines += wrapped(_about(triad, calibration), first=" " * 7, indent=7)
    return lines


def _short(value: float) -> str:
    """Three digits: ``8.10e-4``."""
    return f"{value:.2e}".replace("e-0", "e-").replace("e+0", "e") if value else "0"


def _about(triad: Triad, calibration: Calibration) -> str:
    """What the numbers of a sensor cover beside white noise and random walk; their consistency."""
    worst = max(triad.axes, key=lambda axis: axis.N)
    shares: dict[str, float] = {}
    for notice in worst.notices:
        if notice.code in ("more-than-white-noise", "more-than-random-walk"):
            for label, share in notice.values.items():
                shares[label] = max(share, shares.get(label, 0.0))
    parts = []
    if shares:
        fit, label = calibration[worst.name], max(shares, key=lambda each: shares[each])
        term = fit.model.terms[fit.model.term_labels().index(label)]
        size, tau = term.linear_parameter, term.values.get("tau")
        text = label.rstrip(" 0123456789")
        if size is not None:
            text += f" {quantity_text(term.values[size.name] or 0.0, size.unit, fit)['field']}"
        text += f", {brief(tau)} s" if tau else ""
        parts.append(f"also covers {text} ({worst.name})")
    nees = [each.get(SHOWN, np.nan) for each in (triad.shared_nees or {}).values()]
    known = [value for value in nees if np.isfinite(value)]
    if known:
        parts.append(f"NEES {min(known):.2g} to {max(known):.2g}")
    invalid = [axis.name for axis in triad.axes if not calibration[axis.name].valid]
    if invalid:
        parts.append(f"do not use for {', '.join(invalid)}")
    return "; ".join(parts)


def _actions(calibration: Calibration) -> list[str]:
    """The notices that matter most, those of one kind together, each with what to do."""
    groups: dict[str, list[Notice]] = {}
    for notice in worst_first(findings(calibration)):
        if notice.severity in ("bad", "warning"):
            groups.setdefault(notice.code, []).append(notice)
    cut = next((each.hint for each in calibration.notices if each.code == LONGEST_PART), "")
    texts = [_action(group, cut) for group in groups.values()]
    length = length_sentence(calibration, SHOWN)
    if length.startswith("too short"):
        severe = sum(group[0].severity == "bad" for group in groups.values())
        texts.insert(min(severe, _ACTIONS - 1), length)
    if not texts:
        return []
    lines = ["What to do"]
    for place, text in enumerate(texts[:_ACTIONS], 1):
        shown = wrapped(text, first=f"{place}. ", indent=3)
        lines += shown[:_LINES]
    return lines


def _action(group: Sequence[Notice], cut: str) -> str:
    """What was found, where, and what to do.

    cut: What to do about departures.
    """
    first = group[0]
    places = ", ".join(dict.fromkeys(each.where for each in group if each.where))
    text = first.text.partition(";")[0].partition(": ")[0]
    if len(group) > 1:
        text = first.issue.reason or f"{text} and {len(group) - 1} more"
    hint = first.hint.partition(";")[0]
    if cut and first.issue.topic == "departure":
        hint = cut
    return "; ".join(filter(None, [f"{places}: {text}" if places else text, hint]))
