"""The answer in a page of text: sensor numbers, filter numbers, and what to do."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import PurePath

import numpy as np

from gmwm._core.text import WIDTH, brief, wrapped
from gmwm._core.units import si_parameter_unit
from gmwm.calibration import Calibration, SensorNumbers, curves_by_covariate
from gmwm.datasheet import UNITS
from gmwm.errors import InputError
from gmwm.estimate import Fit, JointFit
from gmwm.export import SENSORS, Triad, is_reserved
from gmwm.filter_numbers import bound
from gmwm.issues import Notice, worst_first
from gmwm.report.health import findings, is_short, length_sentence, trust
from gmwm.report.numbers import SHOWN, triad_of
from gmwm.report.page import duration_text

_LINES = 30  # of the page, with those about files
_ACTIONS = 3  # notices that matter most
_AXES, _FEWEST = 6, 4  # lines of them beside the numbers of more axes
_NAME, _SOURCE, _TEXT = 18, 40, 60  # characters; longer ones are shortened
_NOTABLE = 1.1  # times the table's N or K
_NORMAL = 1.96  # standard errors of a 95 % interval
_LEAST = 0.1  # smallest number without an exponent
_LEGEND = "95 % intervals; <=: 95 % upper limit. B at t: Allan minimum / 0.664, at time t"
_RESERVED = "*: bias steps or drifts enlarge B and K, or were subtracted and may recur"
_FILTER = "For your filter, outages up to {:g} s, one value for all axes (GTSAM: N^2, K^2)"
KEYS = {"N": "noise_density", "K": "random_walk"}
"""Ends of the keys of OpenVINS and Kalibr, which begin with the names of `SENSORS`."""
_SHORT = (
    "too short for {:g} s outages: use N alone, not K and the start bias; record an hour or more"
)
_DEPARTURES = {
    "step": "bias steps",
    "transient": "start transient",
    "drift-at-start": "drift at the start",
    "slow-period": "slow period",
}
_DONE = frozenset({"event", "outliers", "rounding", "crosstalk", "held"})
"""Codes of warnings that the calibration has allowed for: nothing is to be done."""
_STATES = {
    "usable": "Usable",
    "reserved": "Usable with reservation (*)",
    "not valid": "Not valid",
    "no model": "No model",
}


def summary_text(calibration: Calibration, files: Iterable[str] = ()) -> str:
    """Verdict, sensor numbers, filter numbers, the worst notices with what to do, and the files.

    At most 30 lines of 80 columns, unless six axes or what is said of files need more.

    files: Lines about the files that were written.
    """
    first, last, texts = wrapped(verdict_line(calibration)), list(files), actions(calibration)
    first += [line for text in curve_lines(calibration) for line in wrapped(text, indent=2)]
    values, covered = _filter(calibration)
    for many in range(len(covered), -1, -1):  # rather every axis than what explains the numbers
        numbers = [*values, *(line for part in covered[:many] for line in part)]
        left = _LINES - sum(len(part) + 1 for part in (first, numbers, last) if part)
        least = len(_to_do(texts[:1], left))
        more = min(len(_to_do(texts, left)), _FEWEST + 1) if len(calibration) > _AXES else 0
        table = _sensor(calibration, left - 1 - max(least, more))
        to_do = _to_do(texts, max(left - len(table) - 1, least))
        is_whole = all(any(line.startswith(name) for line in table) for name in calibration)
        if is_whole and len(table) + 1 + len(to_do) <= left:
            break
    parts = [part for part in (first, table, numbers, to_do, last) if part]
    return "\n\n".join("\n".join(part) for part in parts)


def state(fit: Fit) -> str:
    """Whether its numbers are "usable", "reserved" because of departures, or "not valid"."""
    if not fit.valid:
        return "not valid"
    return "reserved" if is_reserved(fit) else "usable"


def verdict_line(calibration: Calibration) -> str:
    """The recording, its length, and which axes are usable."""
    joint = max((len(f.parts) for f in calibration.values() if isinstance(f, JointFit)), default=1)
    names = calibration.source.split(", ") if joint > 1 else [calibration.source]
    files = list(dict.fromkeys(each.partition(" from ")[0] for each in names))
    more = f" and {len(files) - 1} more" if len(files) > 1 else ""
    name = _shortened(PurePath(files[0]).name or "recording", _SOURCE)
    intervals = [fit.wv.dt for fit in calibration.values()]
    most = "up to " if max(intervals) > 1.001 * min(intervals) else ""
    parts = [n.values for n in calibration.notices if n.code == "part" and joint == 1]
    span = "".join(f" ({part['start']:.5g} to {part['stop']:.5g} s)" for part in parts[:1])
    size = f"{duration_text(calibration.duration)}{span} at {most}{calibration.rate:.6g} Hz"
    word = "recordings" if len(files) > 1 else "parts at rest"
    size += (f" in {joint} {word}" if joint > 1 else "") + _subtracted(calibration)
    axes = {name: state(fit) for name, fit in calibration.items()}
    axes |= dict.fromkeys(calibration.skipped, "no model")
    found = {key: [n for n, own in axes.items() if own == key] for key in _STATES}
    texts = [
        f"{word}: {_places(found[key], calibration)}" for key, word in _STATES.items() if found[key]
    ]
    if len(found["usable"]) == len(axes):
        all_of_them = {1: "The axis is", 2: "Both axes are"}
        texts = [f"{all_of_them.get(len(axes), f'All {len(axes)} axes are')} usable"]
    elif not (found["usable"] or found["reserved"]):
        texts = ["No axis is usable"]
    if is_short(calibration.values(), SHOWN) and "No axis" not in texts[0]:
        texts.append(f"Too short for {SHOWN:g} s outages: use N alone")
    return ". ".join([f"{name}{more}: {size}", *texts, ""]).rstrip()


def curve_lines(calibration: Calibration) -> list[str]:
    """Curves that were subtracted: the change of each channel over its covariate."""
    return [
        f"Curves subtracted, change over {what} (+-: 95 %): "
        f"{', '.join(each.sentence() for each in curves)}"
        for what, curves in curves_by_covariate(calibration.curves).items()
    ]


def _subtracted(calibration: Calibration) -> str:
    """What was subtracted before the fits, and how much of the recording is left."""
    lost, kinds = 0.0, dict[str, None]()
    for fit in calibration.values():
        gone = [n for n in fit.notices if n.code in _DEPARTURES and n.values.get("removed")]
        kinds |= dict.fromkeys(_DEPARTURES[n.code] for n in gone)
        spans = [n.values["time_upper"] - n.values["time_lower"] for n in gone if n.code == "step"]
        lost = max(lost, sum(spans))  # samples at which a step may be are left out
    left = duration_text(calibration.duration - lost)
    return f", {left} of it used, {_listed([*kinds])} subtracted" if kinds else ""


def _whole(text: str, most: int) -> str:
    """A text without its last clauses, if it is long."""
    while len(text) > most and (", " in text or ": " in text):
        text = text.rpartition(", " if ", " in text else ": ")[0]
    return text


def _shortened(text: str, most: int) -> str:
    """A text without its middle, if it is long."""
    return text if len(text) <= most else f"{text[: most - most // 2 - 3]}...{text[-(most // 2) :]}"


def _listed(names: Sequence[str], most: int = 4) -> str:
    """Names in a sentence, some of many."""
    shown = [_shortened(name, _NAME) for name in names]
    if len(shown) > most:
        return f"{', '.join(shown[: most - 1])} and {len(shown) - most + 1} more"
    return " and ".join(filter(None, [", ".join(shown[:-1]), *shown[-1:]]))


def _places(said: Collection[str], calibration: Calibration) -> str:
    """Channels in a sentence."""
    names = [name for name in (*calibration, *calibration.skipped) if name in said]
    if len(names) == len(calibration) + len(calibration.skipped) > 2:
        return "all axes"
    sensors = []
    for quantity, sensor in SENSORS.items():
        own = [name for name, fit in calibration.items() if fit.wv.quantity == quantity]
        if len(own) > 2 and {*own} <= {*names}:
            names = [name for name in names if name not in own]
            sensors.append(f"all {sensor}s")
    return _listed([*names, *sensors])


def _sensor(calibration: Calibration, most: int) -> list[str]:
    """The table of sensor numbers; for an axis that is not valid, why."""
    reasons: dict[str, list[str]] = {}
    for name, notice in calibration.skipped.items():
        reasons.setdefault(notice.text, []).append(name)
    skipped = [
        _whole(f"{_listed(names):<7}  no model: {text}", WIDTH)[:WIDTH].rstrip()
        for text, names in reasons.items()
    ]
    if len(skipped) > 2:
        skipped = [skipped[0], f"{len(calibration.skipped)} channels have no model"]
    names = list(calibration)
    has_reserved = any(state(fit) == "reserved" for fit in calibration.values())
    legend = [_LEGEND, *([_RESERVED] if has_reserved else [])]
    while True:  # all axes of one IMU, the first of very many
        lines = _table(calibration, names)
        missing = len(calibration) - len(names)
        lines += [f"and {missing} more channels"] if missing else []
        if len(lines) + len(skipped) + len(legend) <= most or len(names) <= _AXES:
            return [*lines, *skipped, *legend]
        names.pop()


def _table(calibration: Calibration, names: Sequence[str]) -> list[str]:
    marked = {n: f"{n}{'*' * (state(calibration[n]) == 'reserved')}" for n in names}
    for short in ({marked[n]: n for n in names}, {_shortened(marked[n], _NAME): n for n in names}):
        numbers = SensorNumbers({each: calibration.numbers[name] for each, name in short.items()})
        units = {(axis.quantity, axis.B.usual.unit) for axis in numbers.values()}
        heads = len({quantity for quantity, _ in units})
        lines = (text := numbers.text()).splitlines()
        if len(units) == heads and len(lines) == 2 * heads + len(names) and "…" not in text:
            break
    else:  # too wide
        lines = []
        for name, axis in numbers.items():
            texts = (f"{n.key} {axis.text(n.key)} {n.usual.unit}" for n in axis)
            lines.append(f"{name}  {', '.join(texts) if axis.valid else 'not valid'}")
    for place, line in enumerate(lines):
        name = short.get(line.partition(" ")[0], "")
        if name and not calibration[name].valid:
            text = f"{line.partition('not valid')[0]}not valid: {reason(name, calibration)}"
            lines[place] = _whole(text, WIDTH)
    return [each for line in lines for each in wrapped(line, indent=2) or [""]]


def reason(name: str, calibration: Calibration) -> str:
    """Why a fit is not valid, and where its steps are."""
    fit = calibration[name]
    cause = next((n for n in fit.notices if n.severity == "bad" and n.issue.spoils), None)
    steps = [n for n in fit.notices if n.code == "step" and n.severity in ("bad", "warning")]
    times = [f"{time:.0f} s" for time in sorted(n.values.get("time", 0.0) for n in steps)]
    at = f"bias step{'s' if times[1:] else ''} at {_listed(times, 2)}" if times else ""
    if cause is None and any(n.severity == "bad" for n in steps):
        return at
    return ", ".join(
        filter(None, [cause.issue.reason if cause else trust(name, fit, calibration)[1], at])
    )


# -- filter numbers --------------------------------------------------------------------------------


def _filter(calibration: Calibration) -> tuple[list[str], list[list[str]]]:
    """Lines of N and K of each sensor and the start bias; by sensor, of what they cover."""
    lines, starts = [], []
    covered: list[list[str]] = []
    for quantity in (q for q in SENSORS if q in {f.wv.quantity for f in calibration.values()}):
        fits = {name: fit for name, fit in calibration.items() if fit.wv.quantity == quantity}
        try:
            triad = triad_of(quantity, replace(calibration, fits=fits))
        except InputError as error:
            lines += wrapped(f"no filter numbers: {error}", f"{quantity:<6} ", 7)[:2]
            continue
        values, errors = filter_values(triad), intervals(triad, calibration)
        for letter in KEYS:
            row = f"{filter_key(quantity, letter):<27}  filter {letter} {values[letter]}"
            about = use(fits, letter)
            if letter in errors and about != "do not use":
                about = f"{errors[letter]:<9} {about}"
            lines.append(f"{row:<62} {about}".rstrip())
        starts += [f"{quantity} {values['start']}"] if values["start"][0] != "0" else []
        if use(fits, "K") != "do not use":
            covered.append(wrapped(covers(triad, calibration.numbers), indent=2))
    if not lines:
        return [], []
    if starts:
        short = is_short(calibration.values(), SHOWN)
        what = "too short: do not use" if short else "add turn-on bias"
        lines += wrapped(f"start bias, 1 sigma ({what}): {', '.join(starts)}", indent=2)
    return [_FILTER.format(SHOWN), *lines], covered


def intervals(triad: Triad, calibration: Calibration) -> dict[str, str]:
    """95 % intervals of N and K for all axes in per cent, if the fits of all are valid.

    They reach to the numbers of models that fit equally well.
    """
    rivals = [
        bound(model, horizon=SHOWN, dt=calibration[axis.name].wv.dt)
        for axis in triad.axes
        for model in calibration.rivals.get(axis.name, ())
    ]
    texts = {}
    for letter, error in triad.common.stderr.items() if triad.common is not None else ():
        value = getattr(triad, letter)
        lower = upper = _NORMAL * error / value
        if triad.is_upper(letter):
            continue
        upper = max([upper, *(getattr(each, letter) / value - 1.0 for each in rivals)])
        ends = [brief(100.0 * end, 1 + (end >= 0.1)) for end in (min(lower, 0.99), upper)]
        texts[letter] = f"-{ends[0]} +{ends[1]} %" if ends[0] != ends[1] else f"+-{ends[0]} %"
    return texts


def filter_key(quantity: str, letter: str) -> str:
    """What OpenVINS and Kalibr call N or K of a sensor."""
    return f"{SENSORS[quantity]}_{KEYS[letter]}"


def filter_values(triad: Triad) -> dict[str, str]:
    """N, K and the start bias for all axes of a sensor, SI."""
    texts = {}
    for key, value in (("N", triad.N), ("K", triad.K), ("start", triad.initial_sd)):
        limit = "<= " if key in KEYS and triad.is_upper(key) else ""
        shown = f"{value:.2e}".replace("e-0", "e-") if 0.0 < value < _LEAST else f"{value:.3g}"
        texts[key] = f"{limit}{shown} {si_parameter_unit(UNITS.get(key, 'u'), triad.quantity)}"
    return texts


def use(fits: Mapping[str, Fit], letter: str = "N") -> str:
    """Whether N or K for all axes can be used, "*" with reservation; empty if nothing is wrong."""
    states, short = {state(fit) for fit in fits.values()}, is_short(fits.values(), SHOWN)
    if "not valid" in states or (short and letter != "N"):
        return "do not use"
    return "*" if "reserved" in states else "usable" * short


def unusable(fits: Mapping[str, Fit]) -> str:
    """For which axes the numbers of a sensor are not to be used yet; empty if for none."""
    invalid = [name for name, fit in fits.items() if not fit.valid]
    verb = "are" if len(invalid) > 1 else "is"
    short = f"use N alone: too short for {SHOWN:g} s" * is_short(fits.values(), SHOWN)
    return f"do not use yet: {_listed(invalid)} {verb} not valid" if invalid else short


def covers(triad: Triad, numbers: SensorNumbers) -> str:
    """The largest term that makes N or K exceed the table's, in a line; empty if none does."""
    larger, axis = [], triad.slowest
    for letter in KEYS:
        own = max(getattr(numbers[axis.name], letter).value for axis in triad.axes)
        ratio = getattr(triad, letter) / own if own else np.inf
        if ratio > _NOTABLE:
            larger.append(letter + (f" ({brief(ratio)} times {letter} above)" if own else ""))
    verb = "also covers" if len(larger) == 1 else "cover"
    text = f"{triad.quantity} {' and '.join(larger)} {verb} {axis.covers}"
    return f"{text} ({_shortened(axis.name, _NAME)})" if larger and axis.covers else ""


# -- what to do ------------------------------------------------------------------------------------


def actions(calibration: Calibration) -> list[str]:
    """The notices that matter most, those of one kind together, each with what to do.

    A longer recording comes last.
    """
    groups: dict[str, list[Notice]] = {}
    found = [each for each in findings(calibration) if each.severity in ("bad", "warning")]
    units = [each for each in found if each.issue.lacks == "units_agree"]
    found.sort(key=lambda n: (n not in units, not n.issue.spoils, n.code not in _DEPARTURES))
    departed = any(each.issue.topic == "departure" for each in found)
    late = any(each.code == "curve-lags" for each in found)
    consequences = ("unsteady",) * departed + (*_DEPARTURES, "misfit", "level-missed") * late
    for notice in worst_first(found):
        key = "departure" if notice.code in _DEPARTURES else notice.code
        done = notice.code in _DONE and notice.severity != "bad"
        if not done and notice.code not in consequences:
            groups.setdefault(key, []).append(notice)
    texts = [_action(group, calibration) for group in groups.values()]
    length = length_sentence(calibration, SHOWN)
    if not any(fit.valid for fit in calibration.values()):
        return texts[:_ACTIONS]
    if is_short(calibration.values(), SHOWN):
        texts.insert(bool(units), _SHORT.format(SHOWN))
    elif length and not length.startswith("long enough"):
        texts[_ACTIONS - 1 :] = [f"optional: {length}"]
    return texts[:_ACTIONS]


def _to_do(texts: Sequence[str], most: int) -> list[str]:
    """The title and as many of them as there are lines."""
    again = sum("rerun with" in text for text in texts) > 1
    order = ": 1. first, then see what remains" if again else ""
    lines, place = [f"What to do{order} (error models and all notices: -v)"], 1
    for text in texts or ["nothing: no defect was found, and the recording is long enough"]:
        whole = text.replace(" h ", "\xa0h\xa0").replace(" min", "\xa0min")
        item = wrapped(whole, first=f"{place}. " if texts else "", indent=3)
        if len(lines) + len(item) <= most:
            lines, place = [*lines, *(line.replace("\xa0", " ") for line in item)], place + 1
    return lines if lines[1:] else []


def _action(group: Sequence[Notice], calibration: Calibration) -> str:
    """What was found, where, and what to do."""
    first = max(group, key=lambda n: n.values.get("ratio", 0.0))
    parameters = dict.fromkeys(n.where.partition(" ")[2] for n in group)
    said = {place.partition(" ")[0] for each in group for place in each.where.split(", ")}
    said |= {name for name, fit in calibration.items() if fit.wv.quantity in said}
    where = _places(said, calibration) or _shortened(first.where, _SOURCE)
    if first.issue.topic == "fit" and any(parameters):
        where = f"{', '.join(filter(None, parameters))} of {where}"
    text, hint = _whole(first.text.partition("; ")[0], _TEXT), first.hint
    hint = hint if len(hint) < WIDTH else hint.partition("; ")[0]
    if first.code in _DEPARTURES:
        kinds: dict[str, set[str]] = {}
        for each in group:
            kinds.setdefault(_DEPARTURES[each.code], set()).add(each.where.partition(" ")[0])
        where = "; ".join(f"{kind}: {_places(on, calibration)}" for kind, on in kinds.items())
        return "; ".join(filter(None, [where, hint]))
    if len({notice.text for notice in group}) > 1:
        own = _places({*first.where.split(", ")}, calibration) or _shortened(first.source, _SOURCE)
        text = first.issue.reason or " in ".join(filter(None, [text, own]))
    if not hint and first.severity == "bad":
        hint = "look at the plot in the report"
    return "; ".join(filter(None, [f"{where}: {text}" if where else text, hint]))
