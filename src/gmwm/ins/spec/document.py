"""YAML documents that people write: a key given twice is rejected, not replaced."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gmwm._core import checks
from gmwm._core.files import opened
from gmwm.errors import InputError

_LARGEST = 1 << 20
"""Bytes of a document that a person writes."""


def read_document(path: Path) -> dict[str, Any]:
    """Content of a YAML file; keys without a value are left out.

    Raises InputError if it cannot be read, is not YAML or not a mapping, or has a key twice.
    """
    try:
        with opened(path) as stream:
            text = stream.read(_LARGEST + 1)
        if len(text) > _LARGEST:
            raise InputError(f"{path}: has more than {_LARGEST:,} bytes: check the path")
        content = _load(text.decode("utf-8-sig"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}): check the path") from None
    except InputError:
        raise
    except Exception as error:  # PyYAML raises KeyError, AttributeError, ... for odd tags
        raise InputError(f"{path}: is not YAML ({_reason(error)}): correct it") from None
    if content is None:
        raise InputError(f"{path} is empty: write trajectory:, truth:, filters: into it")
    if not isinstance(content, Mapping):
        raise InputError(
            f"{path}: {checks.shown(content)} is not a mapping: write KEY: VALUE lines"
        )
    return {name: each for name, each in content.items() if each is not None}


def _load(text: str) -> Any:
    import yaml

    loader = yaml.SafeLoader(text)
    try:
        node = loader.get_single_node()
        _check_keys(node, set())
        return None if node is None else loader.construct_document(node)
    finally:
        loader.dispose()


def _check_keys(node: Any, checked: set[int]) -> None:
    """YAML lets a later key replace an earlier one; two filters of one name are a slip.

    checked: Nodes that were; an alias is the node that it stands for.
    """
    if node is None or isinstance(node.value, str) or id(node) in checked:
        return
    checked.add(id(node))
    seen: set[str] = set()
    for item in node.value:
        if not isinstance(item, tuple):
            _check_keys(item, checked)
            continue
        key, value = item
        name = str(key.value)
        if key.tag != "tag:yaml.org,2002:merge" and name in seen:
            raise ValueError(f"line {key.start_mark.line + 1}: {name!r} is there twice")
        seen.add(name)
        _check_keys(key, checked)
        _check_keys(value, checked)


def _reason(error: Exception) -> str:
    """The error and its line, without the parser's own picture of it."""
    import yaml

    mark = getattr(error, "problem_mark", None)
    problem = getattr(error, "problem", None)
    if mark is None or problem is None:
        text = checks.shown(" ".join(str(error).split())).strip("'\"")
        fits = isinstance(error, ValueError | RecursionError | yaml.YAMLError)
        return text if fits else f"a value does not fit its tag, {text}"
    return f"line {mark.line + 1}, column {mark.column + 1}: {problem}"
