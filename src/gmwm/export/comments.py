"""What files say of their numbers: six lines in the file, all by ``gmwm export --explain``."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence

import numpy as np

from gmwm._core.units import SI_UNIT
from gmwm.export.imu import ImuNumbers

WIDTH = 72
"""Columns of a line of comment, 80 with the marks of the languages around it."""

MOST = 6
"""Lines of comment in a file."""

_LONGEST = 500  # characters of one remark or name

_HOW = {
    "bound": "the smallest that are never overconfident for the error models",
    "reduce": "by gmwm.reduce, consistent on average, since no N+GM bounds a random walk",
    "given": "given, not from a recording",
}


def plain(text: str) -> str:
    """A foreign text on one line, without characters that a parser might stop at.

    Line ends of every kind become blanks; other control characters, and a backslash, which
    continues a C++ comment on the next line, become question marks.
    """
    line = " ".join(text.split())[:_LONGEST]
    return "".join(c if c.isprintable() and c != "\\" else "?" for c in line)


def wrapped(text: str) -> list[str]:
    """A text in lines that are at most 80 columns wide in every file."""
    return textwrap.wrap(
        text, WIDTH, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False
    )


def comment(lines: Sequence[str], mark: str) -> list[str]:
    """Lines as comments of a language: those that begin with ``mark``, or XML for ``<!--``."""
    if mark == "<!--":
        # XML forbids two hyphens inside.
        inside = "\n     ".join(lines).replace(" --", " ").replace("--", "- -")
        return f"<!-- {inside} -->".splitlines()
    return [f"{mark} {line}".rstrip() for line in lines]


def notes(imu: ImuNumbers, title: str, caution: str) -> list[str]:
    """The lines of comment in a file: what the numbers are, for what, and what to mind.

    title: Of the program.
    caution: A line about it; may be empty.
    """
    how = " (reduce)" if imu.method == "reduce" else ""
    purpose = f"{imu.form} for outages up to {imu.horizon:g} s{how}"
    upper = [f"{t.quantity} {k}" for t in imu.triads for k in ("N", "K", "sigma") if t.is_upper(k)]
    worst = [max(triad.axes, key=lambda axis: axis.N) for triad in imu.triads]
    covers = "; ".join(f"{axis.name} {axis.covers}" for axis in worst if axis.covers)
    loose = [
        n for t in imu.triads for axis in t.axes for n in axis.notices if n.code == "loose-form"
    ]
    lines = [
        f"{title}: {' and '.join(imu.sources)}",
        f"{purpose}; for details: gmwm export --explain",
        not_valid_line(imu.invalid) if imu.invalid else "",
        caution,
        _consistency(imu),
        _start(imu),
        f"95 % upper limit, no such term was found: {', '.join(upper)}" if upper else "",
        f"N, K also cover {covers}" if covers else "",
        "for a filter with a Gauss-Markov state: gmwm bound --form N+K+GM"
        if any(n.hint for n in loose)
        else "",
    ]
    return [_fitting(line) for line in lines if line][:MOST]


def not_valid_line(invalid: Mapping[str, str]) -> str:
    """One line about axes that are not valid, with the reasons if they fit."""
    reasons = ", ".join(f"{name} ({why})" for name, why in invalid.items())
    text = "not valid, do not use: "
    return text + (reasons if len(text + reasons) <= WIDTH else ", ".join(invalid))


def _fitting(text: str) -> str:
    """A text on one line."""
    line = plain(text)
    if len(line) > WIDTH:
        line = line.replace("Gauss-Markov", "GM")
    return line if len(line) <= WIDTH else f"{line[: WIDTH - 3].rstrip()}..."


def _start(imu: ImuNumbers) -> str:
    if not any(triad.initial_sd for triad in imu.triads):
        return "add your turn-on bias to the bias at the start"
    values = [
        f"{triad.quantity} {triad.initial_sd:.2e} {SI_UNIT[triad.quantity]}"
        for triad in imu.triads
        if triad.initial_sd
    ]
    return f"start bias {', '.join(values)}, plus turn-on bias"


def _consistency(imu: ImuNumbers) -> str:
    """Range of the NEES of each sensor at the horizon; empty if unknown."""
    parts = []
    for triad in imu.triads:
        by_axis = (triad.shared_nees or {}).values()
        found = by_axis if triad.shared_nees is not None else [axis.nees for axis in triad.axes]
        values = [each.get(imu.horizon, np.nan) for each in found]
        if np.all(np.isfinite(values)):
            ends = dict.fromkeys(f"{end(values):.3g}" for end in (min, max))
            parts.append(f"{triad.quantity} {' to '.join(ends)}")
    if not parts:
        return "NEES unknown: the file holds other numbers; export the calibration"
    return f"NEES at {imu.horizon:g} s: {', '.join(parts)}; 1: consistent"


def purpose(imu: ImuNumbers) -> list[str]:
    """What the numbers are for, how they were found, and what to mind, as texts."""
    texts = [f"{imu.form} for outages up to {imu.horizon:g} s; {_HOW[imu.method]}"]
    if imu.invalid:
        why = ", ".join(f"{name} ({reason})" for name, reason in imu.invalid.items())
        texts.append(plain(f"not valid, do not use: {why}"))
    if max(imu.gyro.rate, imu.accel.rate) > min(imu.gyro.rate, imu.accel.rate):
        texts.append(
            f"gyros at {imu.gyro.rate:.6g} Hz, accelerometers at {imu.accel.rate:.6g} Hz: the rate "
            "of the file is the higher, of a message that holds both"
        )
    return texts
