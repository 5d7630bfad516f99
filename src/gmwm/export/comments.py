"""Comments of exported files: what the numbers are, in lines that cannot break the file."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence

from gmwm._core.units import si_parameter_unit
from gmwm.export.imu import Axis, Imu, Triad

WIDTH = 92

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


def about(imu: Imu, title: str, convention: str) -> list[str]:
    """What stands above the numbers: source, convention, values by axis, consistency."""
    lines = [plain(source) for source in imu.sources]
    lines += _wrapped(f"{title}: {convention}")
    lines += _wrapped(f"{imu.form} for {imu.horizon:g} s without aiding, {_HOW[imu.method]}")
    if max(imu.gyro.rate, imu.accel.rate) > min(imu.gyro.rate, imu.accel.rate):
        lines += _wrapped(
            f"gyros at {imu.gyro.rate:.6g} Hz, accelerometers at {imu.accel.rate:.6g} Hz: a rate f "
            "below is the higher, of a message that holds both"
        )
    for triad in imu.triads:
        lines += _table(imu, triad)
    if any(axis.nees for triad in imu.triads for axis in triad.axes):
        lines += _wrapped(
            "NEES: predicted error squared over what a filter with these numbers believes, after "
            "that time without aiding; 1 is consistent, below 1 cautious, above 1 too optimistic"
        )
    for triad in imu.triads:
        by_horizon = imu.outlook.get(triad.quantity, {})
        values = [f"{t:g} s: {n:.3e}, {_walk(k, triad)}" for t, (n, k) in by_horizon.items()]
        if values:
            title = f"{triad.quantity} N, K for all axes by horizon"
            lines += _wrapped(f"{title}: {'; '.join(values)}")
    for remark in imu.remarks:
        lines += _wrapped(plain(remark))
    return lines


def by_axis(triad: Triad, values: Iterable[float], letter: str) -> str:
    """The values of the axes on one line; upper bounds have a sign before them."""
    shown = (
        f"{plain(axis.name)} {'< ' if letter in axis.upper else ''}{value:.3e}"
        for axis, value in zip(triad.axes, values, strict=True)
    )
    return f"  by axis: {', '.join(shown)}"


def _table(imu: Imu, triad: Triad) -> list[str]:
    columns = _COLUMNS[imu.form]
    times = sorted({time for axis in triad.axes for time in axis.nees})
    units = [f"{key} [{_unit(unit, triad.quantity)}]" for key, unit in columns]
    units.append(f"sd at the start [{_unit('u', triad.quantity)}]")
    heads = [*units, *(f"NEES {time:g} s" for time in times)]
    names = [plain(axis.name) for axis in triad.axes]
    width = max(map(len, names))
    rows = [_row(axis, [key for key, _ in columns], times) for axis in triad.axes]
    widths = [max(len(head), 11) for head in heads]

    def line(first: str, cells: Sequence[str]) -> str:
        return f"{first:<{width}}" + "".join(
            f"  {cell:>{w}}" for cell, w in zip(cells, widths, strict=True)
        )

    return [line("", heads), *(line(name, row) for name, row in zip(names, rows, strict=True))]


def _row(axis: Axis, keys: Sequence[str], times: Sequence[float]) -> list[str]:
    cells = [f"{'< ' if key in axis.upper else ''}{getattr(axis, key):.3e}" for key in (*keys,)]
    return [*cells, f"{axis.initial_sd:.3e}", *(f"{axis.nees[t]:.3g}" for t in times)]


def _walk(K: float, triad: Triad) -> str:
    """A random walk; where the models have none, its upper bound if the file has that."""
    return f"< {triad.K:.3e}" if K <= 0.0 and triad.is_upper("K") else f"{K:.3e}"


def _unit(unit: str, quantity: str) -> str:
    return (
        si_parameter_unit(unit, quantity)
        .replace("rad/s/s/", "rad/s^2/")
        .replace("m/s^2/s/", "m/s^3/")
    )


def _wrapped(text: str) -> list[str]:
    return textwrap.wrap(text, WIDTH, subsequent_indent="  ", break_long_words=False,
                         break_on_hyphens=False)  # fmt: skip
