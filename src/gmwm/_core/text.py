"""What people read of results: lines of 80 columns, sizes in usual units, pages."""

import textwrap
from collections.abc import Iterable
from html import escape
from math import floor, log10

from gmwm._core.units import factor

WIDTH = 80

_UNITS = {"rad/s": ("deg/s",), "m/s^2": ("mg", "g")}
_LARGE, _HUGE, _SMALL = 1000.0, 1e6, 1e-2
_WIDE = 0.3  # of the value: wider intervals are not symmetric


class Printed:
    """A result that a notebook shows as `print` does."""

    def _repr_html_(self) -> str:
        return f"<pre>{escape(str(self))}</pre>"


def readable(value: float, unit: str, *, sign: bool = False, digits: int = 3) -> str:
    """A number in deg/s, mg or g; in its own unit where that is another.

    value: In ``unit``.
    unit: Of the channel, SI.
    sign: Whether a plus is written.
    """
    for name in _UNITS.get(unit, (unit,)):
        shown = value if name == unit else value / factor(name, unit)
        if abs(shown) < _LARGE:
            break
    plus = "+" if sign else ""
    return f"{shown:{plus}.{digits}g} {name}".rstrip()


def brief(value: float, digits: int = 2) -> str:
    """Some significant digits, without an exponent where a person writes none: ``1,230``."""
    text = f"{value:.{digits}g}"
    is_whole = "e+" in text or abs(value) >= _LARGE
    return f"{float(text):,.0f}" if is_whole and abs(value) < _HUGE else text


def per_cent(share: float, digits: int = 2) -> str:
    """A share with its sign: ``118 %``."""
    return f"{brief(100.0 * share, digits)} %"


def with_error(value: float, lower: float, upper: float) -> str:
    """A value with its interval: ``2.66 +-0.01``; ``150 (40 to 290)`` where it is wide.

    The error has one digit, or two if the first is a 1.
    """
    error = 0.5 * (upper - lower)
    if not (0.0 < error < float("inf")):
        return brief(value, 4)
    if error > _WIDE * abs(value):
        return f"{brief(value)} ({brief(lower)} to {brief(upper)})"
    first = floor(log10(error))
    place = first - 1 if error < 2.0 * 10.0**first else first
    if abs(value) < _SMALL:
        power = floor(log10(abs(value)))
        digits = max(0, power - place)
        return f"{value:.{digits}e} +-{error:.{max(0, first - place)}e}"
    digits = max(0, -place)
    return f"{round(value, -place):,.{digits}f} +-{round(error, -place):,.{digits}f}"


def bullets(items: Iterable[object]) -> list[str]:
    """Lines of texts or notices, each after a hyphen."""
    return [line for each in items for line in wrapped(str(each), first="- ", indent=2)]


def wrapped(text: str, first: str = "", indent: int = 0) -> list[str]:
    """Lines of a text after ``first``, the second and later ones indented."""
    return textwrap.wrap(
        text, WIDTH, initial_indent=first, subsequent_indent=" " * indent,
        break_long_words=False, break_on_hyphens=False,
    )  # fmt: skip
