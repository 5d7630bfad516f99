"""What is simulated, how it is estimated or chosen, what was published about it, and the runs.

Titles, sizes, notes and published numbers stand in studies.toml.
"""

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from gmwm._core.files import toml_beside
from gmwm._core.runs import do_runs
from gmwm._core.text import plain_table
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.estimate import (
    EM,
    GMWM,
    MLE,
    AllanLines,
    GaussMarkovForm,
    Method,
    SimulatedMoments,
    Whittle,
    estimate,
    to_gauss_markov,
)
from gmwm.estimate.result import Fit
from gmwm.process import (
    ARMA,
    GaussMarkov,
    Model,
    QuantizationNoise,
    RandomWalk,
    RateRamp,
    Sinusoid,
    WhiteNoise,
    as_model,
)
from gmwm.selection import select
from gmwm.variance import wavelet_variance


@dataclass(frozen=True)
class Quantity:
    """A parameter as the paper writes it.

    key: The package's parameter that it is a power of, at dt = 1 s.
    published: Method -> relative root mean square error in the paper.
    """

    name: str
    key: str
    power: int = 1
    published: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Estimation:
    """A method with its options, and what it is given.

    arma: Orders of an ARMA that is estimated in place of the model and turned into it.
    """

    method: Method = field(default_factory=GMWM)
    wavelet: str = "haar"
    robust: bool = False
    arma: tuple[int, int] | None = None


@dataclass(frozen=True)
class Study:
    """A true model, the quantities to estimate, and the ways to do so."""

    name: str
    title: str
    truth: Model
    n: int
    dt: float
    runs: int
    quantities: tuple[Quantity, ...]
    methods: Mapping[str, Estimation]
    notes: tuple[str, ...] = ()

    def true_value(self, quantity: Quantity) -> float:
        """The quantity in the true model."""
        return float(self.truth.params[quantity.key] or 0.0) ** quantity.power


_TEXTS = toml_beside(__file__)


def _about(name: str) -> dict[str, Any]:
    """What studies.toml says of a study, by fields of `Study`."""
    found = {key: tuple(v) if isinstance(v, list) else v for key, v in _TEXTS[name].items()}
    if "quantities" in found:
        found["quantities"] = tuple(_quantity(**each) for each in found["quantities"])
    return {"name": name, **found}


def _quantity(published: Mapping[str, float] | None = None, **named: Any) -> Quantity:
    """Published errors stand beside both ways to have the ramp, of GMWM and of EM."""
    errors = dict(published or {})
    if "EM" in errors:
        errors |= {"EM LS": errors["EM"], "eq. (9)": errors["GMWM"]}
    return Quantity(**named, published=errors)


_LINES = {"N": (1, 4), "K": (16, 32), "R": (128, 2048)}
_EQUATION_9 = Estimation(GMWM(weights="data", drift="moments"))

TABLE_2 = Study(
    **_about("table2"),
    truth=WhiteNoise(0.2) + RandomWalk(0.02) + RateRamp(0.003),
    methods={
        "EM": Estimation(EM(start=WhiteNoise(0.5) + RandomWalk(1e-4))),
        "EM*": Estimation(
            EM(start=WhiteNoise(5.0) + RandomWalk(10.0), accelerate=False, tolerance=1e-3)
        ),
        "AV": Estimation(AllanLines(_LINES)),
        "AV IRLS": Estimation(AllanLines(_LINES, "irls")),
        "MLE": Estimation(MLE()),
        "eq. (9)": _EQUATION_9,
        "GMWM": Estimation(),
    },
)

TABLE_3 = Study(
    **_about("table3"),
    truth=WhiteNoise(0.8) + GaussMarkov(0.5, 125.0) + RateRamp(0.001),
    methods={
        "EM": Estimation(EM()),
        "EM*": Estimation(EM(drift="state", tolerance=1e-6)),
        "EM LS": Estimation(EM(drift="removed")),
        "MLE": Estimation(MLE()),
        "eq. (9)": _EQUATION_9,
        "GMWM": Estimation(),
    },
)

TABLE_4 = Study(
    **_about("table4"),
    truth=(
        GaussMarkov(29.5e-6**0.5, 0.5)
        + GaussMarkov(4.5e-6**0.5, 20.0)
        + GaussMarkov(2.5e-6**0.5, 125.0)
    ),
    methods={"GMWM": Estimation(), "Whittle": Estimation(Whittle())},
)

EM_4 = replace(
    TABLE_4,
    **_about("em4"),
    quantities=tuple(replace(quantity, published={}) for quantity in TABLE_4.quantities),
    methods={
        "EM": Estimation(EM()),
        "EM*": Estimation(
            EM(start=GaussMarkov(1.0, 1.0) + GaussMarkov(1.0, 3.0) + GaussMarkov(1.0, 10.0))
        ),
        "GMWM": Estimation(),
    },
)

STARTS = replace(
    TABLE_4,
    **_about("starts4"),
    methods={
        "none": Estimation(),
        **{f"all {value:g}": Estimation(GMWM(start=value)) for value in (0.1, 1.0, 10.0, 100.0)},
        "1.0 data": Estimation(GMWM(weights="data", start=1.0)),
    },
)

ARMA_4 = replace(
    TABLE_4,
    **_about("arma4"),
    methods={"ARMA": Estimation(Whittle(), arma=(3, 2)), "GMWM": Estimation()},
)

INDIRECT = replace(
    TABLE_2,
    **_about("indirect2"),
    methods={
        "GMWM": Estimation(),
        "R series": Estimation(SimulatedMoments()),
        "R T": Estimation(SimulatedMoments(single=True)),
    },
)

FIVE = Study(
    **_about("five-gm"),
    truth=(
        WhiteNoise(0.1)
        + GaussMarkov(1.0, 0.02)
        + GaussMarkov(1.0, 0.2)
        + GaussMarkov(1.0, 2.0)
        + GaussMarkov(1.0, 20.0)
        + GaussMarkov(1.0, 200.0)
    ),
    methods={"GMWM": Estimation(), "Whittle": Estimation(Whittle())},
)

FIGURES = {"fig2": TABLE_2, "fig3": TABLE_3, "fig4": TABLE_4}


_WEIGHTS = {
    "model": Estimation(),
    "diagonal": Estimation(GMWM(weights="diagonal")),
    "identity": Estimation(GMWM(weights="identity")),
    "data": Estimation(GMWM(weights="data")),
    "db2": Estimation(wavelet="db2"),
    "db2 data": Estimation(GMWM(weights="data"), wavelet="db2"),
    "robust": Estimation(robust=True),
}


def _compared(study: Study, number: int, runs: int) -> Study:
    title = study.title.split(": ", 1)[1]
    return replace(
        study,
        name=f"weights{number}",
        title=f"Weights and wavelets, Table {'I' * number if number < 4 else 'IV'}: {title}",
        runs=runs,
        methods=_WEIGHTS,
        notes=tuple(_TEXTS["weights"]["notes"]),
    )


WEIGHTS = (_compared(TABLE_2, 2, 200), _compared(TABLE_3, 3, 200), _compared(TABLE_4, 4, 50))

_FURTHER = (EM_4, STARTS, ARMA_4, INDIRECT, FIVE)
STUDIES = {s.name: s for s in (TABLE_2, TABLE_3, TABLE_4, *_FURTHER, *WEIGHTS)}


def one_run(name: str, methods: Sequence[str], seed: int, run: int) -> dict[str, npt.NDArray[Any]]:
    """Simulate one series and estimate it by every method.

    seed, run: Together the seed of the series.
    Returns: column -> its values by method.
    """
    study = STUDIES[name]
    series = study.truth.simulate(study.n, study.dt, np.random.default_rng([seed, run]))
    rows = [_row(study, method, series) for method in methods]
    return {column: np.array([row[column] for row in rows]) for column in rows[0]}


def _row(study: Study, method: str, series: FloatArray) -> dict[str, Any]:
    start = perf_counter()
    by, missed = study.methods[method], False
    result: Fit | GaussMarkovForm | None = None
    try:
        fitted = _estimate(study, series, by)
        message, valid, result = fitted.message, fitted.valid, fitted
        missed = any(notice.code == "start-missed" for notice in fitted.notices)
        if by.arma:
            form = result = to_gauss_markov(fitted)
            message, valid = form.reason, bool(form.stderr)
    except InputError as error:
        message, valid = str(error), False
    row = {"method": method, "seconds": perf_counter() - start, "valid": valid, "message": message}
    row["from_grid"] = missed
    for quantity in study.quantities:
        row |= _values(quantity, result)
    return row


def _estimate(study: Study, series: FloatArray, by: Estimation) -> Fit:
    model, dt = ARMA(*by.arma) if by.arma else study.truth.opened(), study.dt
    if by.wavelet == "haar" and not by.robust:
        return estimate(model, series, dt, by.method)
    of_data = isinstance(by.method, GMWM) and by.method.weights == "data"
    kind = "octave" if of_data else None
    wv = wavelet_variance(series, dt, wavelet=by.wavelet, robust=by.robust, data_covariance=kind)
    return estimate(model, wv, method=by.method)


def _values(quantity: Quantity, result: Fit | GaussMarkovForm | None) -> dict[str, float]:
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

    Returns: one row a run and method: estimates, intervals, validity, seconds.
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


LENGTHS = (100_000, 1_000_000)

TRUTHS: tuple[Model, ...] = (
    as_model(WhiteNoise(1.0)),
    WhiteNoise(1.0) + RandomWalk(0.003),
    QuantizationNoise(3.0) + WhiteNoise(1.0),
    QuantizationNoise(3.0) + WhiteNoise(1.0) + RandomWalk(0.003),
    as_model(GaussMarkov(1.0, 30.0)),
    WhiteNoise(1.0) + GaussMarkov(0.5, 50.0),
    WhiteNoise(1.0) + GaussMarkov(0.5, 50.0) + RandomWalk(0.003),
    WhiteNoise(1.0) + GaussMarkov(1.0, 8.0) + GaussMarkov(1.0, 800.0),
    WhiteNoise(1.0) + GaussMarkov(1.0, 3.0) + GaussMarkov(1.0, 60.0) + GaussMarkov(1.0, 1500.0),
    WhiteNoise(1.0)
    + RandomWalk(0.02)
    + GaussMarkov(2.0, 3.0)
    + GaussMarkov(1.5, 40.0)
    + GaussMarkov(1.5, 700.0),
    WhiteNoise(1.0) + RateRamp(1e-4),
    WhiteNoise(1.0) + GaussMarkov(0.5, 50.0) + Sinusoid(0.3, 0.0565),
)
"""One-sample noise of 1, dt = 1 s; each term has 5 % of the variance at some level at least."""


@dataclass(frozen=True)
class Choice:
    """What was chosen for one true model at one length.

    surplus: Terms more than the truth has -> runs.
    """

    truth: Model
    n: int
    runs: int
    right: int
    surplus: Counter[int]


def choice_study(runs: int, seed: int, jobs: int, lengths: Sequence[int] = LENGTHS) -> list[Choice]:
    """Choose models for ``runs`` series of every truth and length, in parallel processes."""
    cases = [(index, n) for n in lengths for index in range(len(TRUTHS))]
    found = do_runs(partial(_choose, cases, runs, seed), len(cases) * runs, {}, jobs=jobs)
    right, surplus = (found[name].reshape(-1, runs) for name in ("right", "surplus"))
    return [
        Choice(TRUTHS[index], n, runs, int(np.sum(right[i])), Counter(surplus[i].tolist()))
        for i, (index, n) in enumerate(cases)
    ]


def _choose(
    cases: Sequence[tuple[int, int]], runs: int, seed: int, number: int
) -> dict[str, bool | int]:
    """Whether the true model is chosen for one series of all cases, and its surplus terms."""
    case, run = divmod(number, runs)
    index, n = cases[case]
    truth = TRUTHS[index]
    series = truth.simulate(n, 1.0, np.random.default_rng([seed + run, index, n]))
    lines = tuple(Sinusoid(frequency=t.frequency) for t in truth.terms if isinstance(t, Sinusoid))
    chosen = select(series, dt=1.0, extra=lines).model
    kinds = [Counter(type(term).__name__ for term in m.terms) for m in (truth, chosen)]
    return {"right": kinds[0] == kinds[1], "surplus": len(chosen.terms) - len(truth.terms)}


def choice_table(choices: Sequence[Choice]) -> str:
    """The study as a table."""
    runs, rows = choices[0].runs, []
    for choice in choices:
        fewer = sum(count for more, count in choice.surplus.items() if more < 0)
        many = sum(count for more, count in choice.surplus.items() if more > 1)
        counts = (choice.right, fewer, choice.surplus[1], many)
        shares = [f"{count / runs:.0%}" for count in counts]
        rows.append([f"{choice.n:,}", *shares, choice.truth.title()])
    table = plain_table(("n", "right", "fewer", "+1", "+2..", "true model"), rows)
    note = "right: the true terms; fewer, +1, +2..: terms too few or too many"
    return f"Models chosen by gmwm.select, {runs} series each\n\n{table}\n\n{note}"
