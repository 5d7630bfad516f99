"""What results look like when printed: 80 columns, whatever they say."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from gmwm.process import Model
from gmwm.units import field_units, si_parameter_unit

if TYPE_CHECKING:
    from gmwm.estimate.fit import Fit

WIDTH = 80

HEAD = f"{'parameter':<16} {'estimate':>11} {'std. error':>10}  {'95 % interval':<22} unit"


def describe(model: Model) -> str:
    """A model's terms in a few words: ``white noise + 2 Gauss-Markov``."""
    titles = [term.title() for term in model.terms]
    counts = {title: titles.count(title) for title in titles}
    return " + ".join(f"{n} {title}" if n > 1 else title for title, n in counts.items())


def wrapped(text: str, first: str = "", indent: int = 0) -> list[str]:
    """Lines of a text after ``first``, the second and later ones indented."""
    return textwrap.wrap(
        text, WIDTH, initial_indent=first, subsequent_indent=" " * indent,
        break_long_words=False, break_on_hyphens=False,
    )  # fmt: skip


def parameter_row(row: Mapping[str, Any]) -> str:
    """A line under `HEAD` from a dict of `gmwm.Fit.rows`."""
    kind, error = row["kind"], ""
    value = "-" if kind == "undefined" else f"{row['value']:.5g}"
    if kind == "undefined":
        said = "term has no amplitude"
    elif kind == "given":
        said = "given"
    elif kind == "bound":
        said = f"< {row['upper']:.4g}"
    else:
        said = f"{row['lower']:.4g} .. {row['upper']:.4g}"
        error = f"{row['stderr']:.2g}"
    # A long name takes the blanks before its value.
    name = f"{row['key']} "
    return f"{name}{value:>{max(28 - len(name), 0)}} {error:>10}  {said:<22} {row['unit']}"


def parameter_rows(fit: Fit) -> list[dict[str, Any]]:
    """One dict a parameter; see `gmwm.Fit.rows`."""
    params, errors, intervals = fit.params, fit.stderr, fit.interval()
    result = []
    for item in fit.model.parameters:
        key, unit = item.key, item.parameter.unit
        low, high = intervals.get(key, (params[key], params[key]))
        kind = "bound" if key in fit.upper_bounds else "estimated" if key in errors else "given"
        if kind == "given" and fit.model.terms[item.term].values.get("sigma") == 0.0:
            kind = "undefined"
        result.append(
            {
                "key": key,
                "meaning": item.parameter.meaning,
                "kind": kind,
                "value": params[key],
                "stderr": errors.get(key),
                "lower": low,
                "upper": high,
                "unit": si_parameter_unit(unit, fit.wv.quantity),
                "field": [
                    (params[key] * f.per_si, low * f.per_si, high * f.per_si, f.unit)
                    for f in field_units(unit, fit.wv.quantity)
                ],
            }
        )
    return result
