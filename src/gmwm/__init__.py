"""Stochastic error models of inertial sensors, by the Generalized Method of Wavelet Moments.

A static recording goes in (`read`, `Recording`), its wavelet variance says what the noise does at
each averaging time (`wavelet_variance`), an error model is fitted to it (`fit`) or chosen
(`select`), and `calibrate` does so for every channel. Inside, everything is in SI units and
seconds; averaging times are 2^(j-1) dt; the Haar wavelet variance is half the Allan variance.

Names are loaded when they are first used, so that importing the package costs next to nothing.
"""

import ast
import copyreg
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType

import lazy_loader

from gmwm._core import __version__ as __version__
from gmwm._core.pages import providers as _providers


def _public() -> dict[str, list[str]]:
    """The names that the stub beside this file takes from each room, read without importing any.

    ``from .room import *`` takes what is in the room's ``__all__``.
    """
    names: dict[str, list[str]] = {}
    folder = Path(__file__).parent
    for line in ast.parse((folder / "__init__.pyi").read_text(encoding="utf-8")).body:
        if isinstance(line, ast.ImportFrom) and line.module:
            listed = [alias.name for alias in line.names]
            if listed == ["*"]:
                room = folder.joinpath(*line.module.split("."), "__init__.py")
                table = room.read_text(encoding="utf-8").partition("\n__all__ = ")[2]
                listed = list(ast.literal_eval(table[: table.index("\n)") + 2]))
            names.setdefault(line.module, []).extend(listed)
    return names


__getattr__, __dir__, __all__ = lazy_loader.attach(__name__, ["ins"], _public())


def _load_rooms() -> None:
    """Import what writes pages of results, and each room, which may have documents of its own."""
    from gmwm.report import calibration, fleet, navigation, numbers  # noqa: F401

    for room in _public():
        import_module(f"gmwm.{room}")


_providers.append(_load_rooms)

# Functions that use the package go to other processes with it, by name. Only plain modules do so by
# themselves, and this one guards functions from modules of their name.
if type(sys.modules[__name__]) is not ModuleType:
    copyreg.pickle(type(sys.modules[__name__]), lambda module: (import_module, (module.__name__,)))
