"""What results hold does not change: arrays and dictionaries that can be read only, by name."""

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, NoReturn, TypeVar

import numpy as np

from gmwm.errors import MissingNameError

K = TypeVar("K")
V = TypeVar("V")


class FrozenDict(dict[K, V]):
    """A dictionary that does not change; `types.MappingProxyType` cannot be pickled."""

    def _refuse(self, *_: Any, **__: Any) -> NoReturn:
        raise TypeError("results are read-only: copy it into a dict first")

    __setitem__ = __delitem__ = __ior__ = _refuse
    clear = pop = popitem = setdefault = update = _refuse

    def __reduce__(self) -> tuple[Any, ...]:
        return FrozenDict, (dict(self),)


def frozen(value: Any) -> Any:
    """An array as a view, or a mapping as a copy, that cannot be written to; others as they are."""
    if isinstance(value, np.ndarray):
        view = value.view()
        view.flags.writeable = False
        return view
    if isinstance(value, Mapping) and not isinstance(value, FrozenDict):
        return FrozenDict(value)
    return value


class ByName(Mapping[str, V]):
    """A result that is a mapping, that of its field ``_held``.

    _unknown: Says that it lacks a ``{name}``, and which are ``{known}``.
    """

    _held: ClassVar[str]
    _unknown: ClassVar[str]

    def __getitem__(self, name: str) -> V:
        held: Mapping[str, V] = getattr(self, self._held)
        if name not in held:
            raise MissingNameError(self._unknown.format(name=name, known=", ".join(held)))
        return held[name]

    def __iter__(self) -> Iterator[str]:
        return iter(getattr(self, self._held))

    def __len__(self) -> int:
        return len(getattr(self, self._held))


def freeze(instance: Any, *names: str) -> None:
    """Make fields of a frozen dataclass read-only, from its ``__post_init__``."""
    for name in names:
        object.__setattr__(instance, name, frozen(getattr(instance, name)))
