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
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gmwm._core import __version__
from gmwm._core.files import written
from gmwm.errors import printable

if TYPE_CHECKING:
    from jinja2 import Environment

    from gmwm.report.datasheet import Datasheet


def resource(name: str) -> str:
    """The text of a file in this folder."""
    return files("gmwm.report").joinpath(name).read_text(encoding="utf-8")


def write_page(path: str | os.PathLike[str], template: str, **values: Any) -> Path:
    """Write a page from its template; see `rendered`.

    Raises InputError if the file cannot be written.
    """
    text = rendered(template, **values)
    with written(path) as stream:
        stream.write(text)
    return Path(path)


def rendered(template: str, scripts: Sequence[str] = (), **values: Any) -> str:
    """A page from its template.

    template: Name of the file in this folder.
    scripts: The only ones that a browser will run, by a Content-Security-Policy; nothing is loaded
        from any network.
    **values: Of the template, where ``tojson`` writes figures and ``scripts`` are those above; it
        has the ``style`` of reports and the ``version`` of this package too.
    """
    return (
        _environment()
        .get_template(template)
        .render(policy=_policy(scripts), scripts=scripts, **values)
    )


@cache
def _environment() -> Environment:
    """That compiles each template once."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("gmwm", "report"), autoescape=True, undefined=StrictUndefined
    )
    environment.policies["json.dumps_kwargs"] = {"allow_nan": False, "separators": (",", ":")}
    environment.globals |= {"style": resource("report.css"), "version": __version__}
    return environment


def origin(known: Mapping[str, str], what: str, sheet: Datasheet | None) -> dict[str, str]:
    """Sources of the numbers, versions, and the date as ``what``."""
    known = dict(known) if sheet is None else {**known, "data sheet": sheet.name}
    return {printable(key): printable(value) for key, value in known.items()} | {
        "versions": f"gmwm {__version__}, numpy {np.__version__}, "
        f"Python {platform.python_version()}",
        what: datetime.now(UTC).strftime("%Y-%m-%d (UTC)"),
    }


def _policy(scripts: Sequence[str]) -> str:
    hashes = (b64encode(sha256(script.encode()).digest()).decode() for script in scripts)
    allowed = " ".join(f"'sha256-{each}'" for each in hashes) or "'none'"
    return (
        f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; "
        "img-src data: blob:; base-uri 'none'; form-action 'none'"
    )
