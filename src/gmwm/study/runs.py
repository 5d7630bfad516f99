"""Monte Carlo runs of a study, every method on the same series."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from gmwm._core.runs import do_runs
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate import GMWM, estimate
from gmwm.estimate.result import Fit
from gmwm.study.studies import STUDIES, Estimation, Quantity, Study
from gmwm.variance import wavelet_variance


def one_run(name: str, methods: Sequence[str], seed: int, run: int) -> dict[str, npt.NDArray[Any]]:
    """Simulate one series and estimate it by every method.

    name: Of the study.
    seed, run: Together the seed of the series.
    Returns: column -> its values by method.
    """
    study = STUDIES[name]
    series = study.truth.simulate(study.n, study.dt, np.random.default_rng([seed, run]))
    rows = [_row(study, method, series) for method in methods]
    return {column: np.array([row[column] for row in rows]) for column in rows[0]}


def _row(study: Study, method: str, series: FloatArray) -> dict[str, Any]:
    start = perf_counter()
    result: Fit | None = None
    try:
        result = _estimate(study, series, study.methods[method])
        message, valid = result.message, result.valid
    except InputError as error:
        message, valid = str(error), False
    row = {"method": method, "seconds": perf_counter() - start, "valid": valid, "message": message}
    for quantity in study.quantities:
        row |= _values(quantity, result)
    return row


def _estimate(study: Study, series: FloatArray, by: Estimation) -> Fit:
    model, dt = study.truth.opened(), study.dt
    if by.wavelet == "haar" and not by.robust:
        return estimate(model, series, dt, by.method)
    of_data = isinstance(by.method, GMWM) and by.method.weights == "data"
    kind = "octave" if of_data else None
    wv = wavelet_variance(series, dt, wavelet=by.wavelet, robust=by.robust, data_covariance=kind)
    return estimate(model, wv, method=by.method)


def _values(quantity: Quantity, result: Fit | None) -> dict[str, float]:
    """Estimate and 95 % interval of a quantity; not a number where the fit has none."""
    value, ends = float("nan"), (float("nan"), float("nan"))
    if result is not None and quantity.key in result.params:
        value, ends = result.params[quantity.key], result.interval().get(quantity.key, ends)
    with np.errstate(divide="ignore"):
        value, *powers = (float(each) for each in np.array([value, *ends]) ** quantity.power)
    lower, upper = powers if quantity.power > 0 else powers[::-1]
    return {quantity.name: value, f"{quantity.name}_lower": lower, f"{quantity.name}_upper": upper}


def run_study(
    study: Study,
    folder: Path,
    *,
    runs: int,
    seed: int = 0,
    methods: Sequence[str] | None = None,
    resume: bool = False,
    **work: Any,
) -> pa.Table:
    """Make (or complete) the runs of a study.

    Finished runs are kept in ``folder/NAME-runs`` every few seconds, also when the work is
    interrupted.

    methods: Some of ``study.methods``; all by default.
    resume: Go on where an earlier call stopped.
    work: ``jobs``, ``cluster`` and ``progress`` of `gmwm._core.runs.do_runs`.
    Returns: one row a run and method: estimates, intervals, validity, seconds.
    Raises InputError if a method is unknown, or the folder holds runs and ``resume`` is not set, or
        it is and they are not of the same study.
    """
    chosen = tuple(methods or study.methods)
    for method in chosen:
        if method not in study.methods:
            raise InputError(
                f"{study.name} has no method {method!r}: it has {', '.join(study.methods)}"
            )
    if runs < 1:
        raise InputError(f"runs = {runs!r}: give a positive integer")
    what = {"study": study.name, "seed": seed, "methods": list(chosen)}
    found = do_runs(
        partial(one_run, study.name, chosen, seed),
        runs,
        what,
        folder=folder / f"{study.name}-runs",
        earlier="resume" if resume else "refuse",
        **work,
    )
    columns = {"run": np.repeat(np.arange(runs), len(chosen))}
    columns |= {name: values.ravel() for name, values in found.items()}
    table = pa.table(columns, metadata={"gmwm": json.dumps(what)})
    return table.sort_by([("run", "ascending"), ("method", "ascending")])
