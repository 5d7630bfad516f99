"""Studies of navigation as people write them, in YAML."""

from gmwm.ins.spec.document import read_document
from gmwm.ins.spec.experiment import ReadingSpec, experiment_from
from gmwm.ins.spec.fields import (
    FileName,
    Meters,
    PositiveMeters,
    PositiveRadians,
    PositiveSeconds,
    PositiveSpeed,
    Radians,
    Seconds,
    Spec,
    Three,
    number,
    written,
)
from gmwm.ins.spec.sensor_terms import Models, read_models, sensor_models

__all__ = [
    "FileName",
    "Meters",
    "Models",
    "PositiveMeters",
    "PositiveRadians",
    "PositiveSeconds",
    "PositiveSpeed",
    "Radians",
    "ReadingSpec",
    "Seconds",
    "Spec",
    "Three",
    "experiment_from",
    "number",
    "read_document",
    "read_models",
    "sensor_models",
    "written",
]
