"""Many runs of one kind: by processes or on a cluster, kept and resumed."""

from gmwm._core.runs.runs import Earlier, do_runs
from gmwm._core.runs.workers import ENDED, results

__all__ = ["ENDED", "Earlier", "do_runs", "results"]
