from . import ins as ins
from .calibration import (
    Calibration as Calibration,
    SensorNumbers as SensorNumbers,
    calibrate as calibrate,
    load as load,
    without_departures as without_departures,
)
from .datasheet import Datasheet as Datasheet, datasheet as datasheet
from .diagnosis import (
    Health as Health,
    Still as Still,
    find_still as find_still,
    health as health,
)
from .errors import (
    FitWarning as FitWarning,
    InputError as InputError,
    MissingNameError as MissingNameError,
)
from .estimate import (
    EM as EM,
    GMWM as GMWM,
    MLE as MLE,
    AllanLines as AllanLines,
    Bootstrap as Bootstrap,
    CramerRao as CramerRao,
    Estimate as Estimate,
    Fit as Fit,
    GaussMarkovForm as GaussMarkovForm,
    JointFit as JointFit,
    SimulatedMoments as SimulatedMoments,
    Whittle as Whittle,
    bootstrap as bootstrap,
    bootstrap_test as bootstrap_test,
    cramer_rao as cramer_rao,
    fit as fit,
    to_gauss_markov as to_gauss_markov,
)
from .export import export as export
from .filter_numbers import (
    AxisFilterNumbers as AxisFilterNumbers,
    Certificate as Certificate,
    ErrorBudget as ErrorBudget,
    ErrorRow as ErrorRow,
    FilterNumbers as FilterNumbers,
    Imperfections as Imperfections,
    Motion as Motion,
    bound as bound,
    certify as certify,
    error_budget as error_budget,
    reduce as reduce,
)
from .motion import InMotion as InMotion, motion as motion
from .population import (
    Fleet as Fleet,
    SensorArray as SensorArray,
    SensorComparison as SensorComparison,
    array as array,
    compare as compare,
    fleet as fleet,
)
from .process import (
    Model as Model,
    Parameter as Parameter,
    Process as Process,
    StateSpace as StateSpace,
    parameter as parameter,
    simulate as simulate,
)
from .process.kinds import *  # noqa: F403
from .readers import Channel as Channel, Recording as Recording, read as read
from .selection import Selection as Selection, select as select
from .variance import (
    Curve as Curve,
    Deviations as Deviations,
    StreamingVariance as StreamingVariance,
    WaveletCovariance as WaveletCovariance,
    WaveletVariance as WaveletVariance,
    curve as curve,
    deviations as deviations,
    haar_covariance as haar_covariance,
    read_curves as read_curves,
    wavelet_covariance as wavelet_covariance,
    wavelet_variance as wavelet_variance,
)

__version__: str
