"""Numbers for filters in the files that other programs read, one file per consumer or format."""

import sys
from importlib import import_module
from types import ModuleType
from typing import Any

from gmwm.export.export import TARGETS as TARGETS, export as export
from gmwm.export.found import axis_of as axis_of, imu_of as imu_of
from gmwm.export.imu import SENSORS as SENSORS, Axis as Axis, Imu as Imu, Triad as Triad
from gmwm.export.target import ImuFile as ImuFile, Target as Target


class _Room(ModuleType):
    """``gmwm.export`` is this room as well as its function, whichever was loaded first."""

    def __call__(self, *args: Any, **kwargs: Any) -> str:
        return export(*args, **kwargs)

    def __reduce__(self) -> tuple[Any, ...]:
        return import_module, (self.__name__,)


sys.modules[__name__].__class__ = _Room
