"""Pages of results: which function writes the page of which class.

Results stand below the room of pages, which knows them all. So they ask here for the function of
their class; the room registers its functions with `page_of`, and the package's own ``__init__``,
which stands above all rooms, adds to `providers` what imports them.
"""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

_Writer = TypeVar("_Writer", bound=Callable[..., Any])

_writers: dict[tuple[str, type], Callable[..., Any]] = {}
providers: list[Callable[[], object]] = []
"""What imports the functions, for `provided`."""


def provided() -> None:
    """Import what stands above, when the first page or an unknown kind of file is asked for."""
    while providers:
        providers.pop()()


def page_of(kind: type, form: str = "page") -> Callable[[_Writer], _Writer]:
    """Register a function as the writer of a class of results.

    form: {"page", "fragment", ...}, what it makes of ``(result, *args, **options)``.
    """

    def register(function: _Writer) -> _Writer:
        _writers[form, kind] = function
        return function

    return register


def make(form: str, result: Any, *args: Any, **options: Any) -> Any:
    """What the registered function makes of a result."""
    provided()
    kind = next(kind for kind in type(result).__mro__ if (form, kind) in _writers)
    return _writers[form, kind](result, *args, **options)


class Reported:
    """A result that has a page."""

    def report(self, path: str | os.PathLike[str]) -> Path:
        """Write the page, one HTML file that needs no network, or raise InputError."""
        return Path(make("page", self, path))
