"""Numbers for filters in the files that other programs read.

A consumer is an entry of export.toml, with a template of its file, and described in
docs/export.md. Its keys stand once: they write the file and read it back.
"""

import sys
from importlib import import_module
from types import ModuleType
from typing import Any

from gmwm.export.export import (
    CURVES as CURVES,
    TARGETS as TARGETS,
    curve_files as curve_files,
    export as export,
    read_numbers as read_numbers,
)
from gmwm.export.imu import (
    SENSORS as SENSORS,
    Axis as Axis,
    ImuNumbers as ImuNumbers,
    Triad as Triad,
    axis_of as axis_of,
    imu_of as imu_of,
    in_motion as in_motion,
    is_reserved as is_reserved,
    not_valid as not_valid,
    reason as reason,
    refusal as refusal,
)
from gmwm.export.target import ImuFile as ImuFile, Target as Target


class _Room(ModuleType):
    """``gmwm.export`` is this room as well as its function, whichever was loaded first."""

    def __call__(self, *args: Any, **kwargs: Any) -> str:
        return export(*args, **kwargs)

    def __reduce__(self) -> tuple[Any, ...]:
        return import_module, (self.__name__,)


sys.modules[__name__].__class__ = _Room
