"""What every dataclass of a room keeps to."""

import importlib
import inspect
import pkgutil
import re
from collections.abc import Iterator
from dataclasses import fields


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
