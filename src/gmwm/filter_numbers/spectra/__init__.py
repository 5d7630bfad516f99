"""Spectra that lie above others at every frequency."""

from gmwm.filter_numbers.spectra.dominance import (
    KINDS as KINDS,
    TIGHTEST as TIGHTEST,
    Problem as Problem,
    correlation_time as correlation_time,
    dominating as dominating,
    with_correlation_times as with_correlation_times,
)
from gmwm.filter_numbers.spectra.propagation import (
    Estimated as Estimated,
    standard_errors as standard_errors,
)
from gmwm.filter_numbers.spectra.region import (
    ParameterRegion as ParameterRegion,
    region_targets as region_targets,
)
from gmwm.filter_numbers.spectra.target import Target as Target
