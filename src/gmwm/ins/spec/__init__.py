"""Studies of navigation as people write them, in YAML."""

from gmwm.ins.spec.experiment import experiment_from as experiment_from
from gmwm.ins.spec.fields import read_document as read_document, sensor_models as sensor_models
