"""Libraries that only some formats need."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

from gmwm.errors import InputError


def library(module: str, extra: str, source: str) -> ModuleType:
    """Import a library of an extra.

    module: What to import.
    extra: The extra of this package that installs it.
    source: The file that needs it.
    Raises InputError if it is not installed; with the command that installs it.
    """
    try:
        return import_module(module)
    except ImportError as error:
        needed = module.partition(".")[0]
        raise InputError(
            f"{source} needs {needed}, which is not installed: pip install 'gmwm[{extra}]'", "extra"
        ) from error
