"""Results as JSON documents that name their kind."""

from __future__ import annotations

import json
import math
import os
from abc import abstractmethod
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

from gmwm._core import checks
from gmwm._core.files import opened, written
from gmwm.errors import InputError

if TYPE_CHECKING:
    from gmwm._core.forms import Form

_LARGEST = 1 << 25
"""Bytes of a document: forty times those of six channels; read, it needs thirty times as many."""

_DEEPEST = 32
"""Levels of lists and mappings in a document; what is saved has 12 at most."""


class Document:
    """A result that can be saved, and comes back from its file by `load_document`.

    A subclass names its ``SCHEMA`` and gives ``content``, ``document_form`` and ``from_content``.
    """

    SCHEMA: ClassVar[str] = ""
    SCHEMA_VERSION: ClassVar[int] = 1

    _kinds: ClassVar[dict[str, type[Document]]] = {}

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        if "SCHEMA" in vars(cls):
            Document._kinds[cls.SCHEMA] = cls

    @abstractmethod
    def content(self) -> dict[str, Any]:
        """What it cannot be rebuilt without, in JSON types."""

    @classmethod
    @abstractmethod
    def from_content(cls, content: Mapping[str, Any]) -> Self:
        """Inverse of `content`, checked by `document_form`; other errors are those of Python."""

    @classmethod
    def document_form(cls) -> type[Form]:
        """What each key of the content must hold."""
        from gmwm._core.forms import Form

        return Form

    def to_dict(self) -> dict[str, Any]:
        """Everything, in JSON types; see `from_dict`."""
        return {"schema": self.SCHEMA, "schema_version": self.SCHEMA_VERSION, **self.content()}

    @classmethod
    def from_dict(cls, content: Any) -> Self:
        """Inverse of `to_dict`; gives an object of a subclass where the content is of one.

        Raises InputError if the content is of another schema or version, or damaged.
        """
        kind = cls._kind_of(content)
        if kind is not None and kind is not cls and issubclass(kind, cls):
            return kind.from_dict(content)
        what = cls.SCHEMA.rpartition(".")[2]
        if not isinstance(content, Mapping) or content.get("schema") != cls.SCHEMA:
            raise InputError(f"this is not a {what}: give a file that was saved from one")
        version = content.get("schema_version")
        if version != cls.SCHEMA_VERSION:
            raise InputError(
                f"schema version {checks.shown(version)} is not known here (known is "
                f"{cls.SCHEMA_VERSION}): make the {what} again or update gmwm"
            )
        try:
            return cls.from_content(cls.document_form().checked(content))
        except InputError as error:
            raise InputError(f"the {what} cannot be rebuilt ({error}): make it again") from None
        except (
            LookupError, TypeError, ValueError, AttributeError, ArithmeticError, RecursionError
        ) as error:  # fmt: skip
            which = f"{type(error).__name__}: {checks.line(str(error))}"
            raise InputError(f"the {what} is damaged ({which}): make it again") from None

    @staticmethod
    def _kind_of(content: Any) -> type[Document] | None:
        schema = content.get("schema") if isinstance(content, Mapping) else None
        return Document._kinds.get(schema) if isinstance(schema, str) else None

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Inverse of `save`.

        Raises InputError if the file is missing, is not JSON, or holds something else or a damaged
            result.
        """
        content = read_json(path)
        with _named(path):
            return cls.from_dict(content)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write everything as JSON; the file appears whole or not at all.

        Raises InputError if it cannot be written.
        """
        with written(path) as stream:
            json.dump(self.to_dict(), stream, indent=1, allow_nan=False)
            stream.write("\n")
        return Path(path)


def read_json(path: str | os.PathLike[str]) -> Any:
    """Content of a JSON file; its numbers are finite.

    Raises InputError if the file is missing or too large, is not JSON, or is nested too deeply.
    """
    try:
        with opened(path) as stream:
            text = stream.read(_LARGEST + 1)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}): check the path") from None
    if len(text) > _LARGEST:
        raise InputError(
            f"{path}: has more than {_LARGEST >> 20} MB, which no result has: check the path"
        )
    try:
        content = json.loads(text, parse_constant=_finite, parse_float=_finite)
        _check_depth(content)
    except (ValueError, RecursionError) as error:
        which = checks.line(str(error))
        raise InputError(f"{path}: is not JSON ({which}): give a file that was saved") from None
    return content


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"{text[:20]} is no finite number")
    return value


def _check_depth(content: Any) -> None:
    """Refuse what would be followed deeper than a program can."""
    layer, depth = [content], 0
    while layer:
        depth += 1
        if depth > _DEEPEST:
            raise ValueError(f"nested deeper than {_DEEPEST} levels")
        layer = [
            child
            for each in layer
            if isinstance(each, dict | list)
            for child in (each.values() if isinstance(each, dict) else each)
            if isinstance(child, dict | list)
        ]


def load_document(path: str | os.PathLike[str]) -> Any:
    """A result from the file that its ``save`` wrote.

    Raises InputError if the file is missing, is not JSON, or holds no result of a kind known here.
    """
    content = read_json(path)
    kind = Document._kind_of(content)
    if kind is None:
        known = ", ".join(sorted(Document._kinds))
        raise InputError(f"{path}: holds no result of gmwm (known are {known}): check the path")
    with _named(path):
        return kind.from_dict(content)


@contextmanager
def _named(path: str | os.PathLike[str]) -> Iterator[None]:
    """Put the file's name before messages."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{path}: {error}", error.code) from None
