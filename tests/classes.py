"""What every dataclass of a room keeps to."""

import importlib
import inspect
import pkgutil
import re
from collections.abc import Iterator
from dataclasses import fields
from typing import Any


def dataclasses_of(room: str) -> Iterator[type]:
    """Those that the modules of a room define."""
    package = importlib.import_module(f"gmwm.{room}")
    for info in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        for name, each in vars(importlib.import_module(info.name)).items():
            own = inspect.isclass(each) and (each.__module__, each.__name__) == (info.name, name)
            if own and "__dataclass_params__" in vars(each):
                yield each


def assert_dataclasses_keep_the_rules(room: str, by_identity: str = "") -> None:
    """None changes; those that hold arrays, of which == is no truth, are equal to themselves only.

    by_identity: Names of others that are, for what they hold is.
    """
    for each in dataclasses_of(room):
        held = " ".join(re.sub(r"Callable\[.*\]", "", str(field.type)) for field in fields(each))
        parameters = each.__dataclass_params__
        assert parameters.frozen, each
        is_compared = not re.search("[aA]rray", held) and each.__name__ not in by_identity.split()
        assert parameters.eq == is_compared, each


def signatures_of(room: str) -> dict[str, str]:
    """Arguments and their defaults, of all that a room shows and of its methods."""
    face = importlib.import_module(f"gmwm.{room}")
    names = getattr(face, "__all__", None) or [name for name in vars(face) if name[0] != "_"]
    found = {}
    for name in sorted(names):
        shown = getattr(face, name)
        if not callable(shown) or not getattr(shown, "__module__", "").startswith("gmwm"):
            continue
        methods = vars(shown) if inspect.isclass(shown) else {}
        members = {f"{name}.{own}": each for own, each in methods.items() if own[0] != "_"}
        for path, each in {name: shown, **members}.items():
            function = getattr(each, "__func__", each)
            if function is shown or (callable(function) and not inspect.isclass(function)):
                found[path] = _arguments(function)
    return found


def _arguments(function: Any) -> str:
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):
        return ""
    empty = inspect.Parameter.empty
    plain = [each.replace(annotation=empty) for each in signature.parameters.values()]
    return str(inspect.Signature(plain))
