"""The main job: every channel of a recording, screening, a summary."""

from gmwm._core.documents import load as load
from gmwm.calibration.calibrate import AMBIGUITY as AMBIGUITY, calibrate as calibrate
from gmwm.calibration.calibration import Calibration as Calibration
from gmwm.calibration.channel import LONGEST_PART as LONGEST_PART
from gmwm.calibration.covariates import compensated as compensated
from gmwm.calibration.curve import (
    BiasCurve as BiasCurve,
    Covariate as Covariate,
    curves_by_covariate as curves_by_covariate,
)
from gmwm.calibration.departures import (
    DEPARTURES as DEPARTURES,
    Departure as Departure,
    departure_notices as departure_notices,
    departures as departures,
    without_departures as without_departures,
)
from gmwm.calibration.numbers import (
    PLATEAU as PLATEAU,
    AxisNumbers as AxisNumbers,
    SensorNumbers as SensorNumbers,
    axis_numbers as axis_numbers,
    fast_density as fast_density,
    upper_limit as upper_limit,
)
from gmwm.calibration.scaling import with_noise as with_noise
from gmwm.calibration.screening import SCREENING as SCREENING, screened as screened
