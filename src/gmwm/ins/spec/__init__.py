"""Studies of navigation as people write them, in YAML."""

from gmwm.ins.spec.document import mapping, positive, read_document, three
from gmwm.ins.spec.experiment import experiment_from, read_models, reading_options
from gmwm.ins.spec.model_text import sensor_models, value

__all__ = [
    "experiment_from",
    "mapping",
    "positive",
    "read_document",
    "read_models",
    "reading_options",
    "sensor_models",
    "three",
    "value",
]
