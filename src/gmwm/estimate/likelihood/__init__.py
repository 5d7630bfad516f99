"""Maximum likelihood, exact, by the spectrum or by expectation-maximization."""

from gmwm.estimate.likelihood.em import EM
from gmwm.estimate.likelihood.kalman import filtered
from gmwm.estimate.likelihood.likelihood import Columns, Regression, stacked, whitened
from gmwm.estimate.likelihood.mle import MLE, Whittle
from gmwm.estimate.likelihood.scoring import regular_inverse

__all__ = [
    "EM",
    "MLE",
    "Columns",
    "Regression",
    "Whittle",
    "filtered",
    "regular_inverse",
    "stacked",
    "whitened",
]
