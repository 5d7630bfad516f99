"""Maximum likelihood, exact, by the spectrum or by expectation-maximization."""

from gmwm.estimate.likelihood.em import EM as EM
from gmwm.estimate.likelihood.mle import MLE as MLE, Whittle as Whittle
