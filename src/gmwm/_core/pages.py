"""Pages of results: which function writes the page of which class.

Results stand below the room of pages, which knows them all. So they ask here for the function of
their class; the room registers its functions with `page_of`, and the package's own ``__init__``,
which stands above all rooms, says with `provide` where they are.
"""

from collections.abc import Callable
from typing import Any, TypeVar

_Writer = TypeVar("_Writer", bound=Callable[..., Any])

_writers: dict[tuple[str, type], Callable[..., Any]] = {}
_providers: list[Callable[[], object]] = []


def provide(load: Callable[[], object]) -> None:
    """Name what imports the functions, for `provided`."""
    _providers.append(load)


def provided() -> None:
    """Import what stands above, when the first page or an unknown kind of file is asked for."""
    while _providers:
        _providers.pop()()


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
