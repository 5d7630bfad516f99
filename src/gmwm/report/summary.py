"""The answer in a page of text: sensor numbers, filter numbers, and what to do."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import PurePath

from gmwm._core.text import WIDTH, brief, wrapped
from gmwm._core.units import si_parameter_unit
from gmwm.calibration import LONGEST_PART, Calibration, SensorNumbers
from gmwm.errors import InputError
from gmwm.estimate import Fit, JointFit
from gmwm.export import SENSORS
from gmwm.filter_numbers import bound
from gmwm.issues import Notice, worst_first
from gmwm.report.answer import quantity_text, trust
from gmwm.report.health import findings, length_sentence
from gmwm.report.numbers import SHOWN, triad_of
from gmwm.report.page import duration_text

_LINES = 30  # of the page, with those about files
_ACTIONS = 3  # notices that matter most
_FEWEST = 4  # lines of them
_NAME, _SOURCE, _TEXT = 16, 40, 60  # characters; longer ones are shortened
_LEAST = 0.1  # smallest number without an exponent
_LEGEND = "+-, (a to b): 95 % interval. <=: 95 % upper limit. B: lowest deviation / 0.664"
_DEPARTURES = {
    "step": "a bias step",
    "transient": "a transient at the start",
    "drift-at-start": "a drift at the start",
    "slow-period": "a slow period",
}
_DONE = frozenset({"event", "outliers", "rounding", "crosstalk", "held"})
"""Codes of warnings that the calibration has allowed for: nothing is to be done."""


def summary_text(calibration: Calibration, files: Iterable[str] = ()) -> str:
    """Verdict, sensor numbers, filter numbers, the worst notices with what to do, and the files.

    At most 30 lines of 80 columns, unless what is said of files is longer.

    Parameters
    ----------
    calibration : Calibration
    files : iterable of str, optional
        Lines about the files that were written.
    """
    parts = [wrapped(verdict_line(calibration)), [], _filter(calibration), [], list(files)]
    left = _LINES - sum(len(part) + 1 for part in (parts[0], parts[2], parts[4]) if part)
    texts = enumerate(actions(calibration), 1)
    to_do = [wrapped(text, first=f"{place}. ", indent=3) for place, text in texts]
    parts[1] = _sensor(calibration, left - 1 - min(len(_fitting(to_do, left)), _FEWEST + 1))
    parts[3] = _fitting(to_do, left - len(parts[1]) - 2)
    return "\n\n".join("\n".join(part) for part in parts if part)


def verdict_line(calibration: Calibration) -> str:
    """The recording, its length, and how many axes are usable."""
    joint = max((len(f.parts) for f in calibration.values() if isinstance(f, JointFit)), default=1)
    names = calibration.source.split(", ") if joint > 1 else [calibration.source]
    files = list(dict.fromkeys(each.partition(" from ")[0] for each in names))
    more = f" and {len(files) - 1} more" if len(files) > 1 else ""
    name = _shortened(PurePath(files[0]).name or "recording", _SOURCE)
    intervals = [fit.wv.dt for fit in calibration.values()]
    most = "up to " if max(intervals) > 1.001 * min(intervals) else ""
    size = f"{duration_text(calibration.duration)} at {most}{calibration.rate:.6g} Hz"
    word = "recordings" if len(files) > 1 else "parts at rest"
    size += f" in {joint} {word}" if joint > 1 else ""
    axes = {name: fit.valid for name, fit in calibration.items()}
    axes |= dict.fromkeys(calibration.skipped, False)
    others = [name for name, valid in axes.items() if not valid]
    text, where = f"{len(axes) - len(others)} of {len(axes)} axes usable", ""
    if not others:
        text = {1: "The axis is", 2: "Both axes are"}.get(len(axes), f"All {len(axes)} axes are")
        text += " usable"
    elif len(others) == len(axes):
        text = "No axis is usable"
    else:
        where = f"; {_listed(others)} {'are' if len(others) > 1 else 'is'} not"
    start = f"{name}{more}: {size}. {text}"
    return f"{start}{where if len(start + where) < WIDTH else ''}."


def _shortened(text: str, most: int) -> str:
    """A text without its middle, if it is long."""
    return text if len(text) <= most else f"{text[: most - most // 2 - 3]}...{text[-(most // 2) :]}"


def _listed(names: Sequence[str], most: int = 4) -> str:
    """Names in a sentence, some of many."""
    shown = [_shortened(name, _NAME) for name in names]
    if len(shown) > most:
        return f"{', '.join(shown[: most - 1])} and {len(shown) - most + 1} more"
    return " and ".join(filter(None, [", ".join(shown[:-1]), *shown[-1:]]))


def _sensor(calibration: Calibration, most: int) -> list[str]:
    """The table of sensor numbers; for an axis that is not valid, why."""
    reasons: dict[str, list[str]] = {}
    for name, notice in calibration.skipped.items():
        reasons.setdefault(notice.text, []).append(name)
    skipped = [
        f"{_listed(names):<7}  no model: {text}"[:WIDTH].rstrip() for text, names in reasons.items()
    ]
    if len(skipped) > 2:
        skipped = [skipped[0], f"{len(calibration.skipped)} channels have no model"]
    names = list(calibration)
    while True:  # the first axes of very many
        lines = _table(calibration, names)
        missing = len(calibration) - len(names)
        lines += [f"and {missing} more channels"] if missing else []
        if len(lines) + len(skipped) < most or len(names) == 1:
            return [*lines, *skipped, _LEGEND]
        names.pop()


def _table(calibration: Calibration, names: Sequence[str]) -> list[str]:
    for short in ({n: n for n in names}, {_shortened(n, _NAME): n for n in names}):
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
            lines[place] = text[:WIDTH].rstrip()
    return [each for line in lines for each in wrapped(line, indent=2) or [""]]


def reason(name: str, calibration: Calibration) -> str:
    """Why a fit is not valid, and where its steps are."""
    fit = calibration[name]
    cause = next((n for n in fit.notices if n.severity == "bad" and n.issue.spoils), None)
    steps = [n for n in fit.notices if n.code == "step" and n.severity in ("bad", "warning")]
    if cause is not None or all(n.severity != "bad" for n in steps):
        return cause.issue.reason if cause else trust(name, fit, calibration)[1]
    times = [f"{time:.0f} s" for time in sorted(n.values.get("time", 0.0) for n in steps)]
    return f"bias step{'s' if times[1:] else ''} at {_listed(times)}"


# -- filter numbers --------------------------------------------------------------------------------


def _filter(calibration: Calibration) -> list[str]:
    """N, K and start bias of each sensor for outages, and what else they cover."""
    lines = []
    for quantity in SENSORS:
        fits = {name: fit for name, fit in calibration.items() if fit.wv.quantity == quantity}
        if not fits:
            continue
        try:
            lines += _of_sensor(quantity, fits)
        except InputError as error:
            lines += wrapped(f"no filter numbers: {error}", f"{quantity:<6} ", 7)[:2]
    title = f"For your filter, outages up to {SHOWN:g} s (bias0: initial bias sd; add turn-on bias)"
    return [title, *lines] if lines else []


def _of_sensor(quantity: str, fits: Mapping[str, Fit]) -> list[str]:
    triad = triad_of(quantity, fits)
    row = f"{quantity:<6}"
    values = {"N": ("u/sqrt(Hz)", triad.N), "K": ("u/s/sqrt(Hz)", triad.K)}
    for key, (unit, value) in (values | {"bias0": ("u", triad.initial_sd)}).items():
        limit = "<= " if key in values and triad.is_upper(key) else ""
        row += f" {key} {limit}{short(value)} {si_parameter_unit(unit, quantity)} " if value else ""
    about = (each for text in (covers(fits), unusable(fits)) for each in wrapped(text, " " * 7, 7))
    return [*wrapped(row.rstrip(), indent=7), *about]


def short(value: float) -> str:
    """Three digits: ``8.10e-4``."""
    return f"{value:.2e}".replace("e-0", "e-") if 0.0 < value < _LEAST else f"{value:.3g}"


def unusable(fits: Mapping[str, Fit]) -> str:
    """For which axes the numbers of a sensor are not to be used yet; empty if for none."""
    invalid = [name for name, fit in fits.items() if not fit.valid]
    verb = "are" if len(invalid) > 1 else "is"
    return f"do not use yet: {_listed(invalid)} {verb} not valid" if invalid else ""


def covers(fits: Mapping[str, Fit]) -> str:
    """The largest slow term that the numbers of a sensor cover; empty if there is none."""
    covered = sorted(_covered(fits))[-1:]
    return "".join(f"{letters} {term} ({name})" for _, term, name, letters in covered)


def _covered(fits: Mapping[str, Fit]) -> Iterator[tuple[float, str, str, str]]:
    """Slow terms that N or K cover: the share, the term, its axis and what covers it."""
    for name, fit in fits.items():
        shares: dict[str, dict[str, float]] = {}
        for notice in bound(fits, horizon=SHOWN, shared=True)[name].notices:
            letter = {"more-than-white-noise": "N", "more-than-random-walk": "K"}.get(notice.code)
            for label, share in notice.values.items() if letter else ():
                shares.setdefault(label, {})[letter or ""] = share
        for label, by_letter in shares.items():
            term = fit.model.terms[fit.model.term_labels().index(label)]
            size, tau = term.linear_parameter, term.values.get("tau")
            if term.is_band_limited or term.is_white or size is None:
                continue
            text = quantity_text(term.values[size.name] or 0.0, size.unit, fit)["field"]
            text = f"{label.rstrip(' 0123456789')}, {text}"
            text += f", tau {brief(tau)} s" if tau else ""
            letters = f"{', '.join(sorted(by_letter, key='NK'.index))} raised to cover"
            yield max(by_letter.values()), text, name, letters


# -- what to do ------------------------------------------------------------------------------------


def actions(calibration: Calibration) -> list[str]:
    """The notices that matter most, those of one kind together, each with what to do."""
    groups: dict[str, list[Notice]] = {}
    found = [each for each in findings(calibration) if each.severity in ("bad", "warning")]
    found.sort(key=lambda n: (not n.issue.spoils, n.issue.topic != "departure"))
    departed = any(each.issue.topic == "departure" for each in found)
    for notice in worst_first(found):
        topic = notice.issue.topic
        done = notice.code in _DONE and notice.severity != "bad"
        if not done and not (departed and notice.code == "unsteady"):  # that is the cause
            groups.setdefault(topic if topic == "departure" else notice.code, []).append(notice)
    cut = next((each.hint for each in calibration.notices if each.code == LONGEST_PART), "")
    texts = [_action(group, cut, calibration) for group in groups.values()]
    length = length_sentence(calibration, SHOWN)
    if length.startswith("too short") and any(fit.valid for fit in calibration.values()):
        severe = sum(group[0].severity == "bad" for group in groups.values())
        texts.insert(min(severe, _ACTIONS - 1), length)
    return texts[:_ACTIONS]


def _fitting(actions: Sequence[Sequence[str]], most: int) -> list[str]:
    """The title and as many of them as there are lines."""
    lines = ["What to do"] if actions else []
    for each in actions:
        if len(lines) + len(each) <= most:
            lines += each
    return lines if lines[1:] else []


def _places(said: Collection[str], calibration: Calibration) -> str:
    """Channels in a sentence."""
    names = [name for name in (*calibration, *calibration.skipped) if name in said]
    for quantity, sensor in SENSORS.items():
        own = [name for name, fit in calibration.items() if fit.wv.quantity == quantity]
        if len(own) > 2 and names == own:
            return f"all {sensor}s"
    return "all axes" if len(names) == len(calibration) > 2 else _listed(names)


def _action(group: Sequence[Notice], cut: str, calibration: Calibration) -> str:
    """What was found, where, and what to do.

    cut: What to do about several departures.
    """
    first, parameters = group[0], dict.fromkeys(n.where.partition(" ")[2] for n in group)
    said = {place.partition(" ")[0] for each in group for place in each.where.split(", ")}
    where = _places(said, calibration) or _shortened(first.where, _SOURCE)
    if first.issue.topic == "fit" and any(parameters):
        where = f"{', '.join(filter(None, parameters))} of {where}"
    text, hint = first.text.partition("; ")[0], first.hint
    hint = hint if len(hint) < WIDTH else hint.partition("; ")[0]
    while len(text) > _TEXT and (", " in text or ": " in text):
        text = text.rpartition(", " if ", " in text else ": ")[0]
    if first.issue.topic == "departure":
        kinds = dict.fromkeys(_DEPARTURES[each.code] for each in group)
        if sum(each.code == "step" for each in group) > 1:
            kinds = {kind.replace("a bias step", "bias steps"): None for kind in kinds}
        verb = "inflates" if len(group) == 1 else "inflate"
        text, hint = f"{' and '.join(kinds)} {verb} B and K", cut or hint
    elif len({notice.text for notice in group}) > 1:
        text = first.issue.reason or f"{text}, and more"
    if not hint and first.severity == "bad":
        hint = "look at the plot in the report"
    return "; ".join(filter(None, [f"{where}: {text}" if where else text, hint]))
