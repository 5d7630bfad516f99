"""Comments of exported files: what the numbers are, in lines that cannot break the file."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence

from gmwm._core.units import si_parameter_unit
from gmwm.export.imu import Axis, Imu, Triad

WIDTH = 72
"""Columns of a line of comment, 80 with the marks of the languages around it."""

_LONGEST = 500  # characters of one remark or name

_HOW = {
    "bound": "the smallest that are never too optimistic for the error models",
    "reduce": "those whose filter has the right errors at the horizon, see gmwm.reduce",
    "given": "given, not from a recording",
}

_COLUMNS = {
    "N+K": (("N", "u/sqrt(Hz)"), ("K", "u/s/sqrt(Hz)")),
    "N+GM": (("N", "u/sqrt(Hz)"), ("sigma", "u"), ("tau", "s")),
}


def plain(text: str) -> str:
    """A text that is not ours on one line, without characters that a parser might stop at.

    Line ends of every kind become blanks; other control characters, and a backslash, which
    continues a C++ comment on the next line, become question marks.
    """
    line = " ".join(text.split())[:_LONGEST]
    return "".join(c if c.isprintable() and c != "\\" else "?" for c in line)


def comment(lines: Sequence[str], mark: str) -> list[str]:
    """Lines as comments of a language: those that begin with ``mark``, or XML for ``<!--``."""
    if mark == "<!--":
        # XML forbids two hyphens inside.
        return ["<!--", *(f"  {line.replace('--', '- -')}" for line in lines), "-->"]
    return [f"{mark} {line}".rstrip() for line in lines]


def above(imu: Imu, name: str) -> list[str]:
    """What stands above the numbers: their source, the program, and what they are for."""
    lines = [line for source in imu.sources for line in wrapped(plain(source))]
    lines += wrapped(name)
    lines += wrapped(f"{imu.form} for {imu.horizon:g} s without aiding, explained below")
    if max(imu.gyro.rate, imu.accel.rate) > min(imu.gyro.rate, imu.accel.rate):
        lines += wrapped(
            f"gyros at {imu.gyro.rate:.6g} Hz, accelerometers at {imu.accel.rate:.6g} Hz: a rate f "
            "below is the higher, of a message that holds both"
        )
    return [*lines, *(line for caution in imu.cautions for line in wrapped(plain(caution)))]


def below(imu: Imu, convention: str) -> list[str]:
    """What stands below the numbers: convention, values by axis, consistency."""
    lines = wrapped(f"{convention}; {_HOW[imu.method]}")
    for triad in imu.triads:
        lines += _table(imu, triad)
    if any(triad.shared_nees is not None for triad in imu.triads):
        lines += wrapped(
            "shared: for all axes of a sensor, which this file holds; the others: of each axis by "
            "itself, which it does not hold"
        )
        if any(_is_traded(triad) for triad in imu.triads):
            lines += wrapped(
                "where an axis has more of N or K than all share it has less of the other: a "
                "larger K pays for a smaller N, and neither pair is too optimistic"
            )
    shown = [axis.nees for triad in imu.triads for axis in triad.axes]
    shown += [nees for triad in imu.triads for nees in (triad.shared_nees or {}).values()]
    if any(shown):
        lines += wrapped(
            "NEES: predicted error squared over what a filter with these numbers believes, after "
            "that time without aiding; 1 is consistent, below 1 cautious, above 1 too optimistic"
        )
    if imu.method != "given" and not all(shown):
        lines += wrapped(
            "NEES is not known where the file holds other numbers than were found for an axis, "
            "without its error model: export the calibration"
        )
    for triad in imu.triads:
        by_horizon = imu.outlook.get(triad.quantity, {})
        values = [f"{t:g} s: {n:.3e}, {_walk(k, triad)}" for t, (n, k) in by_horizon.items()]
        if values:
            title = f"{triad.quantity} N, K for all axes by horizon"
            lines += wrapped(f"{title}: {'; '.join(values)}")
    for remark in imu.remarks:
        lines += wrapped(plain(remark))
    return lines


def _table(imu: Imu, triad: Triad) -> list[str]:
    """The numbers of each axis under those that a file holds for all, with their consistency."""
    columns = [*_COLUMNS[imu.form], ("start", "u")]
    units = [f"{key} [{_unit(unit, triad.quantity)}]" for key, unit in columns]
    times = sorted({time for axis in triad.axes for time in axis.nees})
    shared = triad.shared_nees
    kinds = ["own"] if shared is None else ["shared", "own"]
    names = [f"{plain(axis.name)}" for axis in triad.axes]
    rows = [_values(axis, axis.upper, columns) for axis in triad.axes]
    for row, axis in zip(rows, triad.axes, strict=True):
        for time in times:
            row += [] if shared is None else [_nees(shared.get(axis.name, {}), time)]
            row.append(_nees(axis.nees, time))
    if shared is not None:
        names.insert(0, "shared")
        upper = frozenset(key for key, _ in columns if triad.is_upper(key))
        rows.insert(0, [*_values(triad, upper, columns), *[""] * len(kinds) * len(times)])
    widths = [11] * len(columns) + [6] * len(kinds) * len(times)
    first = max(map(len, names))

    def line(name: str, cells: Sequence[str]) -> str:
        return f"{name:<{first}}" + "".join(
            f" {cell:>{width}}" for cell, width in zip(cells, widths, strict=True)
        )

    lines = [f"{triad.quantity}: {', '.join(units)}"]
    heads = [key for key, _ in columns]
    if shared is None:
        heads += [f"NEES {time:g} s" for time in times]
        widths[len(columns) :] = [max(6, len(head)) for head in heads[len(columns) :]]
    else:
        over = f" {'':<{first + sum(widths[: len(columns)]) + len(columns) - 1}}"
        span = 7 * len(kinds)
        lines.append((over + "".join(f"{f'NEES {time:g} s':>{span}}" for time in times)).rstrip())
        heads += kinds * len(times)
    return [
        *lines,
        *(line(name, row).rstrip() for name, row in zip(["", *names], [heads, *rows], strict=True)),
    ]


def _values(
    of: Axis | Triad, upper: frozenset[str], columns: Sequence[tuple[str, str]]
) -> list[str]:
    """Numbers as they are shown; upper bounds have a sign before them."""
    values = {key: of.initial_sd if key == "start" else getattr(of, key) for key, _ in columns}
    return [f"{'< ' if key in upper else ''}{value:.3e}" for key, value in values.items()]


def _nees(found: Mapping[float, float], time: float) -> str:
    return f"{found[time]:.3g}" if time in found else "-"


def _is_traded(triad: Triad) -> bool:
    """Whether an axis has more of one number than all share, and less of the other."""
    return triad.shared_nees is not None and any(
        getattr(axis, letter) > 1.0005 * getattr(triad, letter)
        for axis in triad.axes
        for letter in "NK"
        if letter not in axis.upper
    )


def _walk(K: float, triad: Triad) -> str:
    """A random walk; where the models have none, its upper bound if the file has that."""
    return f"< {triad.K:.3e}" if K <= 0.0 and triad.is_upper("K") else f"{K:.3e}"


def _unit(unit: str, quantity: str) -> str:
    return (
        si_parameter_unit(unit, quantity)
        .replace("rad/s/s/", "rad/s^2/")
        .replace("m/s^2/s/", "m/s^3/")
    )


def wrapped(text: str) -> list[str]:
    """A text in lines that are at most 80 columns wide in every file."""
    return textwrap.wrap(text, WIDTH, subsequent_indent="  ", break_long_words=False,
                         break_on_hyphens=False)  # fmt: skip
