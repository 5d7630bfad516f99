"""Many runs of one kind: by processes or on a cluster, kept and resumed."""

from gmwm._core.runs.runs import Earlier, do_runs
from gmwm._core.runs.workers import ENDED, PROCESSES, beside, results, shared, spare

__all__ = ["ENDED", "PROCESSES", "Earlier", "beside", "do_runs", "results", "shared", "spare"]
