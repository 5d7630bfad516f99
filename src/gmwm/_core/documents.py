"""Results as JSON documents that name their kind."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import fields
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

import numpy as np
import numpy.typing as npt
from annotated_types import Ge, Gt, Le, Lt

from gmwm._core import checks, memory
from gmwm._core.files import content_of, opened, write_text
from gmwm._core.pages import provided
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError, printable

if TYPE_CHECKING:
    from pydantic import TypeAdapter, ValidationError

_TIMES = 30  # bytes of memory that a byte of a result needs while it is read
_MOST_NODES = 100_000  # of one: an alias of YAML counts as what it stands for

_being_adapted: ContextVar[type | None] = ContextVar("_being_adapted", default=None)
"""The class of documents whose adapter is made."""

_ASYMMETRY = 1e-6  # of correlations: what is left by rounding in a computed covariance
_NEGATIVE = -1e-4  # eigenvalue of correlations; all but redundant parameters leave rounding errors

_DAMAGE = (LookupError, TypeError, ValueError, AttributeError, ArithmeticError, RecursionError)
"""What content that does not belong together raises somewhere in a constructor."""


class NoneIs:
    """Mark of a field whose number is stored as null where it is not finite.

    missing: The number that null stands for.
    """

    def __init__(self, missing: float) -> None:
        self.missing = missing

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        from pydantic_core import core_schema

        return core_schema.no_info_wrap_validator_function(
            lambda value, inner: self.missing if value is None else inner(value),
            handler(source),
            serialization=core_schema.plain_serializer_function_ser_schema(
                lambda value: value if math.isfinite(value) else None
            ),
        )


class _IsArray:
    """Mark of a field that is an array of numbers, stored as nested lists with null for NaN."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        return plain_schema(_array_of, _lists_of)


class _IsText:
    """Mark of a text from a file: at most so long, and printed on one line."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        from pydantic_core import core_schema

        text = core_schema.str_schema(strict=True, max_length=10_000)
        return core_schema.no_info_after_validator_function(printable, text)


Text = Annotated[str, _IsText()]
Positive = Annotated[float, Gt(0.0)]
NotNegative = Annotated[float, Ge(0.0)]
Fraction = Annotated[float, Gt(0.0), Lt(1.0)]
Samples = Annotated[int, Ge(1), Le(checks.MOST_SAMPLES)]
Rate = Annotated[float, Ge(1.0 / checks.LONGEST_INTERVAL), Le(1.0 / checks.SHORTEST_INTERVAL)]
Interval = Annotated[float, Ge(checks.SHORTEST_INTERVAL), Le(checks.LONGEST_INTERVAL)]
OrNaN = Annotated[float, NoneIs(math.nan)]
"""A number that may be unknown."""
Probability = Annotated[float, Ge(0.0), Le(1.0), NoneIs(math.nan)]
"""One that may be unknown."""
OrInfinity = Annotated[float, NoneIs(math.inf)]
"""A number that may be infinite."""
Array = Annotated[FloatArray, _IsArray()]


def _array_of(value: Any) -> FloatArray:
    """An array from nested lists; raises ValueError unless they are numbers in equal rows."""
    if isinstance(value, np.ndarray):
        return value
    rows = value if isinstance(value, list) and value and isinstance(value[0], list) else [value]
    if not all(
        isinstance(row, list) and all(each is None or checks.is_number(each) for each in row)
        for row in rows
    ):
        raise ValueError("not a list of numbers")
    return np.array(value, dtype=float)  # None becomes NaN


def _lists_of(array: FloatArray) -> list[Any]:
    if np.all(np.isfinite(array)):
        return array.tolist()
    plain = array.astype(object)
    plain[~np.isfinite(array)] = None
    return plain.tolist()


def plain_schema(read: Callable[[Any], Any], write: Callable[[Any], Any]) -> Any:
    """What pydantic asks a class for: how it is read from JSON types and written to them.

    A class that is a field of documents gives it in ``__get_pydantic_core_schema__``.
    """
    from pydantic_core import core_schema

    return core_schema.no_info_plain_validator_function(
        read, serialization=core_schema.plain_serializer_function_ser_schema(write)
    )


class Document:
    """A result that can be saved, and comes back from its file by `load`.

    A subclass is a frozen dataclass that names its ``SCHEMA``; one without is a part of others.
    Pydantic reads and writes its fields by their annotations, with `OrNaN`, `OrInfinity` and
    `Array` where JSON has no such value.
    """

    SCHEMA: ClassVar[str] = ""
    SCHEMA_VERSION: ClassVar[int] = 1
    KEYS: ClassVar[Mapping[str, str]] = {}
    """Field -> key of the document, where it is another."""
    LATER: ClassVar[frozenset[str]] = frozenset()
    """Fields that documents written before they existed lack."""

    _kinds: ClassVar[dict[str, type[Document]]] = {}

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        if "SCHEMA" in vars(cls):
            Document._kinds[cls.SCHEMA] = cls

    def content(self) -> dict[str, Any]:
        """The fields in JSON types, with what is `derived` from them."""
        kind: Any = type(self)
        found = _adapter(kind).dump_python(self, mode="json")
        return {self.KEYS.get(name, name): each for name, each in found.items()} | self.derived()

    def derived(self) -> dict[str, Any]:
        """Keys of the document that are no fields, for readers of the file."""
        return {}

    def check_content(self) -> None:
        """Raise ValueError if fields of a document do not belong together."""

    @classmethod
    def from_content(cls, content: Mapping[str, Any]) -> Self:
        """Inverse of `content`.

        Raises InputError or ValueError with the place of the first value that cannot be used.
        """
        from pydantic import ValidationError

        own = dict(content)
        for each in fields(cls):  # type: ignore[arg-type]  # subclasses are dataclasses
            key = cls.KEYS.get(each.name, each.name)
            if key in content:
                own[each.name] = content[key]
            elif each.init and each.name not in cls.LATER:
                raise InputError(f"there is no {key}")
        kind: Any = cls
        try:
            # Strict: lists become tuples, and mappings dataclasses, only if they come from JSON.
            found: Self = _adapter(kind).validate_json(json.dumps(own), strict=True)
        except ValidationError as error:
            raise InputError(validation_sentence(error, cls.KEYS)) from None
        found.check_content()
        return found

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: Any) -> Any:
        """Schema of a field that is a document; that of the class itself has its fields."""
        if cls is _being_adapted.get():
            return handler(source)
        return plain_schema(
            lambda value: value if isinstance(value, cls) else cls._rebuilt(value),
            lambda document: document.to_dict(),
        )

    def to_dict(self) -> dict[str, Any]:
        """Everything, in JSON types; see `from_dict`."""
        head = {"schema": self.SCHEMA, "schema_version": self.SCHEMA_VERSION}
        return {**(head if self.SCHEMA else {}), **self.content()}

    @classmethod
    def from_dict(cls, content: Any) -> Self:
        """Inverse of `to_dict`; gives an object of a subclass where the content is of one.

        Raises InputError if the content is of another schema or version, or damaged.
        """
        try:
            return cls._rebuilt(content)
        except InputError as error:
            if error.code:
                raise
            what = cls._title()
            raise InputError(f"the {what} cannot be rebuilt ({error}): make it again") from None

    @classmethod
    def _rebuilt(cls, content: Any) -> Self:
        kind = cls._kind_of(content)
        if kind is not None and kind is not cls and issubclass(kind, cls):
            return kind._rebuilt(content)
        what = cls._title()
        if not isinstance(content, Mapping) or content.get("schema", "") != cls.SCHEMA:
            raise InputError(f"this is not a {what}: give a file that was saved from one", "schema")
        version = content.get("schema_version")
        if cls.SCHEMA and version != cls.SCHEMA_VERSION:
            raise InputError(
                f"schema version {checks.shown(version)} is unknown (this version reads "
                f"{cls.SCHEMA_VERSION}): make the {what} again or update gmwm",
                "schema",
            )
        try:
            return cls.from_content(content)
        except InputError:
            raise
        except _DAMAGE as error:
            raise InputError(checks.line(str(error)) or type(error).__name__) from None

    @classmethod
    def _title(cls) -> str:
        return cls.SCHEMA.rpartition(".")[2] or re.sub(r"\B([A-Z])", r" \1", cls.__name__).lower()

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
            return cls.from_dict(content).beside(Path(path))

    def beside(self, _: Path) -> Self:
        """As it is from its file, with a notice where other files there contradict it."""
        return self

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write everything as JSON; the file appears whole or not at all."""
        return write_text(path, json.dumps(self.to_dict(), indent=1, allow_nan=False))


@cache
def _adapter(kind: Any) -> TypeAdapter[Any]:
    """What pydantic makes of the fields of a class of documents."""
    from pydantic import TypeAdapter

    token = _being_adapted.set(kind)
    try:
        return TypeAdapter(kind)
    finally:
        _being_adapted.reset(token)


def validation_sentence(
    error: ValidationError, keys: Mapping[str, str] = MappingProxyType({})
) -> str:
    """The place of the first wrong value, and what is wrong with it.

    keys: Field -> key, where a document has another.
    """
    first = error.errors(include_url=False)[0]
    top, *below = first["loc"] or ("content",)
    place = ".".join(map(str, (keys.get(str(top), top), *below)))
    if first["type"] == "missing":
        return f"there is no {place}"
    if first["type"] == "value_error":
        inner = first["ctx"]["error"]
        return f"{place}{'.' if isinstance(inner, InputError) else ': '}{inner}"
    return f"{place} = {checks.shown(first['input'])}: {first['msg'][0].lower()}{first['msg'][1:]}"


def check_covariance(matrix: Any, size: int, name: str = "covariance") -> None:
    """Check a covariance: square, symmetric, without a negative variance.

    Raises ValueError if it is none.
    """
    if any(len(row) != size for row in (matrix, *matrix)):
        raise ValueError(f"{name} is not {size} x {size}")
    array = np.array(matrix, dtype=float).reshape(size, size)
    scale = np.sqrt(np.maximum(np.diag(array), 0.0))
    bound = np.outer(scale, scale)
    if np.any(np.diag(array) < 0.0) or np.any((bound == 0.0) & (array != 0.0)):
        raise ValueError(f"{name} has a variance that is not positive")
    with np.errstate(over="ignore", invalid="ignore"):
        correlation = array / np.where(bound > 0.0, bound, 1.0)
        asymmetry = np.abs(correlation - correlation.T)
    if np.any(asymmetry > _ASYMMETRY):
        raise ValueError(f"{name} is not symmetric")
    too_large = not np.all(np.isfinite(correlation))
    if too_large or (size and np.min(np.linalg.eigvalsh(correlation)) < _NEGATIVE):
        raise ValueError(f"{name} is not positive semi-definite")


def read_json(path: str | os.PathLike[str]) -> Any:
    """Content of a JSON file.

    Raises InputError if the file is missing, needs more memory than may be used, is not JSON, or is
        nested too deeply.
    """
    from pydantic_core import from_json

    size = 0
    with suppress(OSError, ValueError):  # `content_of` says it
        size = os.path.getsize(path)
    memory.require(_TIMES * size, f"{path}:")
    text = content_of(path, memory.budget())
    try:
        return from_json(text, allow_inf_nan=False)
    except ValueError as error:
        which = checks.line(str(error))
        raise InputError(f"{path}: is not JSON ({which}): give a file that gmwm saved") from None


def read_yaml(path: str | os.PathLike[str]) -> Any:
    """Content of a YAML file.

    Raises InputError if it cannot be read, is too large, is not YAML, or has a key twice.
    """
    import yaml

    content = content_of(path)
    try:
        loader = yaml.SafeLoader(content.decode("utf-8-sig"))
        root = loader.get_single_node()
        _check_nodes(root)
        return None if root is None else loader.construct_document(root)
    except Exception as error:  # PyYAML raises KeyError, AttributeError, ... for odd tags
        mark, text = getattr(error, "problem_mark", None), getattr(error, "problem", None)
        if mark is not None and text is not None:  # without the parser's own picture of it
            text = f"line {mark.line + 1}, column {mark.column + 1}: {text}"
        else:
            text = checks.shown(" ".join(str(error).split())).strip("'\"")
            fits = isinstance(error, ValueError | RecursionError | yaml.YAMLError)
            text = text if fits else f"a value does not fit its tag, {text}"
        raise InputError(f"{path}: invalid YAML ({text}): correct the file") from None


def _check_nodes(root: Any) -> None:
    """Raise ValueError if YAML has too many nodes, or a key twice, whose value would be lost."""
    left = [] if root is None else [root]
    for node in left:  # grows
        parts = node.value if isinstance(node.value, list) else []
        if node.id == "mapping":
            seen: set[str] = set()
            for key, _ in parts:
                name = str(key.value)
                if key.tag != "tag:yaml.org,2002:merge" and name in seen:
                    raise ValueError(f"line {key.start_mark.line + 1}: {name!r} appears twice")
                seen.add(name)
            parts = [each for pair in parts for each in pair]
        left += parts
        if len(left) > _MOST_NODES:
            raise ValueError(f"has more than {_MOST_NODES:,} values")


def read_arrays(path: str | os.PathLike[str]) -> dict[str, npt.NDArray[Any]]:
    """Arrays of a file as `numpy.savez` writes it, which compresses nothing.

    Raises whatever numpy and zipfile do for another file.
    """
    with opened(path) as stream, np.load(stream, allow_pickle=False) as stored:
        size = sum(each.file_size for each in stored.zip.infolist())
        if size > os.fstat(stream.fileno()).st_size:
            raise ValueError("holds less than it promises")
        memory.require(size, os.fspath(path))
        return dict(stored)


def load(path: str | os.PathLike[str]) -> Any:
    """A result from its file: `Calibration`, `Fit`, `Selection`, `Health`, whatever was saved.

    ``Calibration.load`` and its like take files of their own kind only.

    Raises InputError if the file is missing, is not JSON, or holds no result of a kind known here.
    """
    content = read_json(path)
    if Document._kind_of(content) is None:
        provided()
    kind = Document._kind_of(content)
    if kind is None:
        known = ", ".join(sorted(Document._kinds))
        raise InputError(f"{path}: is not a result of gmwm ({known}): check the path")
    with _named(path):
        return kind.from_dict(content).beside(Path(path))


@contextmanager
def _named(path: str | os.PathLike[str]) -> Iterator[None]:
    """Put the file's name before messages."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{path}: {error}", error.code) from None
