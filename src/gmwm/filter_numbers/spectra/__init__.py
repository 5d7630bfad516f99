"""Spectra that lie above others at every frequency."""

from gmwm.filter_numbers.spectra.dominance import (
    Problem as Problem,
    standard_errors as standard_errors,
)
from gmwm.filter_numbers.spectra.region import (
    Estimated as Estimated,
    ParameterRegion as ParameterRegion,
)
from gmwm.filter_numbers.spectra.required import RequiredSpectrum as RequiredSpectrum
