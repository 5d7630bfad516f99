"""Studies of navigation as people write them, in YAML."""

from gmwm.ins.spec.experiment import ReadingSpec as ReadingSpec, experiment_from as experiment_from
from gmwm.ins.spec.fields import (
    FileName as FileName,
    Meters as Meters,
    Models as Models,
    PositiveMeters as PositiveMeters,
    PositiveRadians as PositiveRadians,
    PositiveSeconds as PositiveSeconds,
    PositiveSpeed as PositiveSpeed,
    Radians as Radians,
    Seconds as Seconds,
    Spec as Spec,
    Three as Three,
    number as number,
    read_document as read_document,
    read_models as read_models,
    sensor_models as sensor_models,
    written as written,
)
