"""Comments of exported files: what the numbers are, in lines that cannot break the file."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

from gmwm._core.tables import cell, plain_table
from gmwm._core.units import si_parameter_unit
from gmwm.export.imu import Axis, ImuNumbers, Triad

WIDTH = 72
"""Columns of a line of comment, 80 with the marks of the languages around it."""

_LONGEST = 500  # characters of one remark or name

_HOW = {
    "bound": "the smallest that are never overconfident for the error models",
    "reduce": "those whose filter has the right errors at the horizon, see gmwm.reduce",
    "given": "given, not from a recording",
}

_COLUMNS = {
    "N+K": (("N", "u/sqrt(Hz)"), ("K", "u/s/sqrt(Hz)")),
    "N+GM": (("N", "u/sqrt(Hz)"), ("sigma", "u"), ("tau", "s")),
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
        return ["<!--", *(f"  {line.replace('--', '- -')}" for line in lines), "-->"]
    return [f"{mark} {line}".rstrip() for line in lines]


def above(imu: ImuNumbers, name: str) -> list[str]:
    """Lines above the numbers: their source, the program, and what they are for."""
    texts = [plain(source) for source in imu.sources]
    texts += [name, f"{imu.form} for {imu.horizon:g} s without aiding, explained below"]
    if max(imu.gyro.rate, imu.accel.rate) > min(imu.gyro.rate, imu.accel.rate):
        texts.append(
            f"gyros at {imu.gyro.rate:.6g} Hz, accelerometers at {imu.accel.rate:.6g} Hz: a rate f "
            "below is the higher, of a message that holds both"
        )
    texts += [plain(caution) for caution in imu.cautions]
    return [line for text in texts for line in wrapped(text)]


def below(imu: ImuNumbers, convention: str) -> list[str]:
    """Lines below the numbers: convention, values by axis, consistency."""
    lines = wrapped(f"{convention}; {_HOW[imu.method]}")
    for triad in imu.triads:
        lines += _table(imu, triad)
    texts = []
    if any(triad.shared_nees is not None for triad in imu.triads):
        texts.append(
            "shared: for all axes of a sensor, which this file holds; the others: of each axis by "
            "itself, which it does not hold; use N and K as a pair"
        )
    known = [axis.nees for triad in imu.triads for axis in triad.axes]
    known += [nees for triad in imu.triads for nees in (triad.shared_nees or {}).values()]
    if any(known):
        texts.append(
            "NEES: expected error squared over the filter's covariance with these numbers, after "
            "that time without aiding; 1 is consistent, below 1 conservative, above 1 overconfident"
        )
    if imu.method != "given" and not all(known):
        texts.append(
            "NEES is not known where the file holds other numbers than were found for an axis, "
            "without its error model: export the calibration"
        )
    for triad in imu.triads:
        by_horizon = imu.outlook.get(triad.quantity, {})
        # Models without a random walk have the file's upper limit.
        limit = f"< {triad.K:.3e}" if triad.is_upper("K") else None
        values = [
            f"{t:g} s: {n:.3e}, {limit if limit and k <= 0.0 else f'{k:.3e}'}"
            for t, (n, k) in by_horizon.items()
        ]
        if values:
            texts.append(f"{triad.quantity} N, K for all axes by horizon: {'; '.join(values)}")
    texts += [plain(remark) for remark in imu.remarks]
    return [*lines, *(line for text in texts for line in wrapped(text))]


def _table(imu: ImuNumbers, triad: Triad) -> list[str]:
    """The numbers of each axis under those that a file holds for all, with their consistency."""
    columns = [*_COLUMNS[imu.form], ("start", "u")]
    keys = [key for key, _ in columns]
    times = sorted({time for axis in triad.axes for time in axis.nees})
    shared = triad.shared_nees
    heads, rows = ["", *keys], []
    for time in times:
        heads += [f"NEES\n{time:g} s"] if shared is None else [f"{time:g} s\nshared", "\nown"]
    if shared is not None:
        upper = frozenset(key for key in keys if triad.is_upper(key))
        rows.append(["shared", *_values(triad, upper, keys), *[""] * 2 * len(times)])
    for axis in triad.axes:
        row = [plain(axis.name), *_values(axis, axis.upper, keys)]
        together = (shared or {}).get(axis.name, {})
        for time in times:
            own = axis.nees.get(time)
            row += [cell(own, 3)] if shared is None else [cell(together.get(time), 3), cell(own, 3)]
        rows.append(row)
    units = ", ".join(f"{key} [{si_parameter_unit(u, triad.quantity)}]" for key, u in columns)
    title = f"{triad.quantity}: {units}"
    title += "; NEES" if shared is not None and times else ""
    return [*wrapped(title), *plain_table(heads, rows).splitlines()]


def _values(of: Axis | Triad, upper: frozenset[str], keys: Sequence[str]) -> list[str]:
    """Numbers as they are shown; upper limits have a sign before them."""
    values = {key: of.initial_sd if key == "start" else getattr(of, key) for key in keys}
    return [f"{'< ' if key in upper else ''}{value:.3e}" for key, value in values.items()]
