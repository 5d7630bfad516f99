"""Pages of HTML: text that is not ours is escaped, and nothing runs or loads but what is ours."""

from __future__ import annotations

import os
import platform
from base64 import b64encode
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from functools import cache
from hashlib import sha256
from importlib.resources import files
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gmwm._core import __version__
from gmwm._core.files import write_text
from gmwm._core.text import brief, per_cent
from gmwm._core.units import field_units, si_parameter_unit
from gmwm.errors import printable
from gmwm.estimate import Fit
from gmwm.variance import WaveletVariance

_DAY, _YEAR = 86400.0, 365.25 * 86400.0
_DAYS, _YEARS = 5.0, 2.0  # from which on durations are given so
_MANY_YEARS = 100.0

if TYPE_CHECKING:
    from jinja2 import Environment
    from matplotlib.figure import Figure

    from gmwm.datasheet import Datasheet


def resource(name: str) -> str:
    """The text of a file in this folder."""
    return files("gmwm.report").joinpath(name).read_text(encoding="utf-8")


def duration_text(seconds: float) -> str:
    """A duration as people say it: ``40 s``, ``35 min``, ``2 h 46 min``, ``12 days``."""
    if seconds > _MANY_YEARS * _YEAR:
        return "centuries"
    if seconds >= _YEARS * _YEAR:
        return f"{seconds / _YEAR:.2g} years"
    if seconds >= _DAYS * _DAY:
        return f"{seconds / _DAY:.3g} days"
    if seconds < 120.0:
        return f"{seconds:.3g} s"
    parts = zip(divmod(round(seconds / 60.0), 60), ("h", "min"), strict=True)
    return " ".join(f"{count} {unit}" for count, unit in parts if count)


def begun(text: str) -> str:
    """With a capital at the beginning; units and names keep theirs."""
    return text[:1].upper() + text[1:]


def units_of(unit: str, wv: WaveletVariance) -> tuple[str, float, str]:
    """The field's unit for a parameter of a channel, its number per SI unit, and the SI unit."""
    known = field_units(unit, wv.quantity)
    si = si_parameter_unit(unit, wv.quantity)
    if wv.quantity is None:
        si = unit.replace("u", wv.unit or "u", 1)
    return (known[0].unit, known[0].per_si, si) if known else (si, 1.0, si)


def quantity_text(value: float, unit: str, fit: Fit) -> dict[str, str]:
    """A value in the field's first unit and in SI."""
    field, scale, si = units_of(unit, fit.wv)
    return {"field": f"{brief(value * scale, 3)} {field}", "si": f"{value:.3g} {si}"}


def write_page(path: str | os.PathLike[str], template: str, **values: Any) -> Path:
    """Write a page from its template; see `rendered`."""
    return write_text(path, rendered(template, **values))


def rendered(template: str, scripts: Sequence[str] = (), **values: Any) -> str:
    """A page from its template.

    scripts: The only ones that a browser will run, by a Content-Security-Policy; nothing is loaded
        from any network.
    **values: Of the template, where ``tojson`` writes figures and ``scripts`` are those above; it
        has the ``style`` of reports, the ``version`` of this package and filters for numbers
        and durations too.
    """
    hashes = (b64encode(sha256(script.encode()).digest()).decode() for script in scripts)
    allowed = " ".join(f"'sha256-{each}'" for each in hashes) or "'none'"
    policy = (
        f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; "
        "img-src data: blob:; base-uri 'none'; form-action 'none'"
    )
    return _environment().get_template(template).render(policy=policy, scripts=scripts, **values)


@cache
def _environment() -> Environment:
    """That compiles each template once."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("gmwm", "report"), autoescape=True, undefined=StrictUndefined
    )
    environment.policies["json.dumps_kwargs"] = {"allow_nan": False, "separators": (",", ":")}
    environment.globals |= {"style": resource("report.css"), "version": __version__}
    environment.filters |= {
        "begun": begun,
        "brief": brief,
        "duration": duration_text,
        "per_cent": per_cent,
    }
    return environment


def origin(known: Mapping[str, str], what: str, sheet: Datasheet | None) -> dict[str, str]:
    """Sources of the numbers, versions, and the date as ``what``."""
    known = dict(known) if sheet is None else {**known, "data sheet": sheet.name}
    return {printable(key): printable(value) for key, value in known.items()} | {
        "versions": f"gmwm {__version__}, numpy {np.__version__}, "
        f"Python {platform.python_version()}",
        what: datetime.now(UTC).strftime("%Y-%m-%d (UTC)"),
    }


def svg(figure: Figure) -> str:
    """A figure as SVG text for a page; the figure is closed."""
    import matplotlib.pyplot as plt

    stream = StringIO()
    # Without a date and with a salt of its own, the same study gives the same file.
    with plt.rc_context({"svg.hashsalt": "gmwm", "svg.fonttype": "none"}):
        figure.savefig(stream, format="svg", metadata={"Date": None}, transparent=True)
    plt.close(figure)
    text = stream.getvalue()
    return text[text.index("<svg") :]
