"""What is wrong with a recording, before a model is fitted to it."""

from gmwm.diagnosis.check import health as health
from gmwm.diagnosis.gathered import gathered as gathered
from gmwm.diagnosis.result import (
    ChannelHealth as ChannelHealth,
    Health as Health,
    Repetition as Repetition,
)
from gmwm.diagnosis.spectral import Spectrum as Spectrum, spectrum as spectrum
from gmwm.diagnosis.still import Still as Still, find_still as find_still, rest_of as rest_of
from gmwm.diagnosis.unmeasured import first_in_common as first_in_common, thinned as thinned
