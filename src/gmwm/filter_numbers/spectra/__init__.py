"""Spectra that lie above others at every frequency."""

from gmwm.filter_numbers.spectra.dominance import (
    KINDS as KINDS,
    TIGHTEST as TIGHTEST,
    Problem as Problem,
    correlation_time as correlation_time,
    dominating as dominating,
    standard_errors as standard_errors,
    with_correlation_times as with_correlation_times,
)
from gmwm.filter_numbers.spectra.region import (
    Estimated as Estimated,
    ParameterRegion as ParameterRegion,
    region_spectra as region_spectra,
)
from gmwm.filter_numbers.spectra.required import RequiredSpectrum as RequiredSpectrum
