"""Many runs of one kind: by processes or on a cluster, kept and resumed."""

from gmwm._core.runs.runs import Earlier as Earlier, do_runs as do_runs
from gmwm._core.runs.threads import one_blas_thread as one_blas_thread
from gmwm._core.runs.workers import (
    ENDED as ENDED,
    PROCESSES as PROCESSES,
    beside as beside,
    results as results,
    shared as shared,
    spare as spare,
    while_beginning as while_beginning,
)
