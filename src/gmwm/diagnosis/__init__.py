"""Faults of a recording, found before a model is fitted to it."""

from gmwm.diagnosis.check import health as health
from gmwm.diagnosis.health import Health as Health, Repetition as Repetition, gathered as gathered
from gmwm.diagnosis.lines import spectrum as spectrum
from gmwm.diagnosis.repeats import first_in_common as first_in_common, thinned as thinned
from gmwm.diagnosis.samples import thermometer_fails as thermometer_fails
from gmwm.diagnosis.still import Still as Still, find_still as find_still, rest_of as rest_of
