"""Pages of HTML: text that is not ours is escaped, and nothing runs or loads but what is ours."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from functools import cache
from hashlib import sha256
from importlib.resources import files
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Environment


def resource(name: str) -> str:
    """The text of a file in this folder."""
    return files("gmwm.report").joinpath(name).read_text(encoding="utf-8")


def rendered(template: str, scripts: Sequence[str] = (), **values: Any) -> str:
    """A page from its template.

    Parameters
    ----------
    template : str
        Name of the file in this folder.
    scripts : sequence of str, optional
        The only ones that a browser will run, by a Content-Security-Policy; nothing is loaded from
        any network.
    **values
        Of the template, where ``tojson`` writes figures and ``scripts`` are those above.
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
    return environment


def _policy(scripts: Sequence[str]) -> str:
    hashes = (b64encode(sha256(script.encode()).digest()).decode() for script in scripts)
    allowed = " ".join(f"'sha256-{each}'" for each in hashes) or "'none'"
    return (
        f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; "
        "img-src data: blob:; base-uri 'none'; form-action 'none'"
    )
