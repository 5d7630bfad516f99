"""Maximum likelihood, exact, by the spectrum or by expectation-maximization."""

from gmwm.estimate.likelihood.conclusion import regular_inverse as regular_inverse
from gmwm.estimate.likelihood.em import EM as EM
from gmwm.estimate.likelihood.kalman import (
    Recursion as Recursion,
    accumulated as accumulated,
    filtered as filtered,
)
from gmwm.estimate.likelihood.likelihood import (
    Columns as Columns,
    KalmanLikelihood as KalmanLikelihood,
    arrays_of as arrays_of,
    stacked as stacked,
)
from gmwm.estimate.likelihood.mle import MLE as MLE, Whittle as Whittle
