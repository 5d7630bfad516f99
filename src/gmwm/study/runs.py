"""Monte Carlo runs of a scenario: in parallel, resumable, every method on the same series."""

from __future__ import annotations

import json
from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from functools import partial
from pathlib import Path
from time import monotonic, perf_counter
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from gmwm._core.files import folder_to_fill, moved_into_place
from gmwm._core.typing import FloatArray, Progress
from gmwm.errors import InputError
from gmwm.estimate import fit
from gmwm.estimate.result import Fit
from gmwm.study.scenario import SCENARIOS, Estimation, Quantity, Scenario
from gmwm.variance import wavelet_variance

Row = dict[str, Any]
Rows = Generator[list[Row], None, None]
"""Called with the number of finished runs and of all."""

_SECONDS_PER_PART = 10.0
_KEY = b"gmwm"


def one_run(name: str, methods: Sequence[str], seed: int, run: int) -> list[Row]:
    """Simulate one series and estimate it by every method; one row a method.

    Parameters
    ----------
    name : str
        Of the scenario.
    methods : sequence of str
    seed, run : int
        Together the seed of the series.
    """
    scenario = SCENARIOS[name]
    series = scenario.truth.simulate(scenario.n, scenario.dt, np.random.default_rng([seed, run]))
    return [_row(scenario, method, series, run) for method in methods]


def _row(scenario: Scenario, method: str, series: Any, run: int) -> Row:
    start = perf_counter()
    result: Fit | None = None
    message, valid = "", False
    try:
        result = _estimate(scenario, series, scenario.methods[method])
        message, valid = result.message, result.valid
    except InputError as error:
        message = str(error)
    row: Row = {
        "run": run,
        "method": method,
        "seconds": perf_counter() - start,
        "valid": valid,
        "message": message,
    }
    for quantity in scenario.quantities:
        row |= _values(quantity, result)
    return row


def _estimate(scenario: Scenario, series: FloatArray, way: Estimation) -> Fit:
    model = scenario.truth.opened()
    if not way.variance:
        return fit(model, series, scenario.dt, method=way.method)
    return fit(model, wavelet_variance(series, scenario.dt, **way.variance), method=way.method)


def _values(quantity: Quantity, result: Fit | None) -> Row:
    """Estimate and 95 % interval of a quantity; not a number where the fit has none."""
    names = (quantity.name, f"{quantity.name}_lower", f"{quantity.name}_upper")
    if result is None or quantity.key not in result.params:
        return dict.fromkeys(names, float("nan"))
    value = result.params[quantity.key]
    low, high = result.interval().get(quantity.key, (float("nan"), float("nan")))
    with np.errstate(divide="ignore"):
        powers = [float(np.float64(v) ** quantity.power) for v in (value, low, high)]
    if quantity.power < 0:
        powers[1:] = powers[:0:-1]
    return dict(zip(names, powers, strict=True))


def run_scenario(
    scenario: Scenario,
    folder: Path,
    *,
    runs: int,
    seed: int = 0,
    methods: Sequence[str] | None = None,
    jobs: int = 1,
    resume: bool = False,
    cluster: str | None = None,
    progress: Progress | None = None,
) -> pa.Table:
    """Make (or complete) the runs of a scenario.

    Finished runs are kept in Parquet files in ``folder/NAME-runs`` every few seconds, also when
    the work is interrupted.

    Parameters
    ----------
    scenario : Scenario
    folder : Path
    runs : int
    seed : int, optional
    methods : sequence of str, optional
        Some of ``scenario.methods``; all by default.
    jobs : int, optional
        Processes on this machine.
    resume : bool, optional
        Go on where an earlier call stopped.
    cluster : str, optional
        Address of a Dask scheduler that does the work instead.
    progress : callable, optional

    Returns
    -------
    pyarrow.Table
        One row a run and method: estimates, intervals, validity, seconds.

    Raises
    ------
    InputError
        If a method is unknown, or the folder holds runs and ``resume`` is not set, or it is and
        they are not of the same study.
    """
    chosen = tuple(methods or scenario.methods)
    for method in chosen:
        if method not in scenario.methods:
            raise InputError(
                f"{scenario.name} has no method {method!r}: it has {', '.join(scenario.methods)}"
            )
    if runs < 1:
        raise InputError(f"runs = {runs!r}: give a positive whole number")
    study = {"scenario": scenario.name, "seed": seed, "methods": list(chosen)}
    with folder_to_fill(folder / f"{scenario.name}-runs") as parts:
        store = _Store(parts, study)
        done = store.open(resume)
        todo = [run for run in range(runs) if run not in done]
        finished = runs - len(todo)
        if progress is not None:
            progress(finished, runs, "")
        work = partial(one_run, scenario.name, chosen, seed)
        results = _on_cluster(work, todo, cluster) if cluster else _here(work, todo, jobs)
        with closing(results), store:
            for rows in results:
                store.add(rows)
                finished += 1
                if progress is not None:
                    progress(finished, runs, "")
        table = store.read()
    return table.filter(pc.less(table["run"], runs)).sort_by(
        [("run", "ascending"), ("method", "ascending")]
    )


class _Store:
    """Rows on disk, in parts that appear whole.

    Parameters
    ----------
    folder : Path
    study : dict
        What the rows belong to; kept in every part.
    """

    def __init__(self, folder: Path, study: dict[str, Any]) -> None:
        self._folder, self._study = folder, study
        self._rows: list[Row] = []
        self._since = monotonic()
        self._next = 0

    def open(self, resume: bool) -> set[int]:
        """The runs that are there already."""
        parts = self._parts()
        if parts and not resume:
            raise InputError(
                f"{self._folder} holds runs of an earlier study: add --resume to go on with them, "
                "or choose another folder with -o"
            )
        done: set[int] = set()
        for part in parts:
            try:
                table = pq.read_table(part)
            except (OSError, pa.ArrowException):
                raise InputError(f"{part}: is no Parquet file of a study, remove it") from None
            found = json.loads((table.schema.metadata or {}).get(_KEY, b"{}"))
            if found != self._study:
                other = ", ".join(k for k, v in self._study.items() if found.get(k) != v)
                raise InputError(
                    f"{part}: belongs to another study, of other {other}: choose another folder "
                    "with -o"
                )
            done |= set(table["run"].to_pylist())
        self._next = len(parts)
        return done

    def add(self, rows: list[Row]) -> None:
        """Keep rows; they are written every few seconds."""
        self._rows += rows
        if monotonic() - self._since > _SECONDS_PER_PART:
            self._flush()

    def read(self) -> pa.Table:
        """All rows."""
        return pa.concat_tables([pq.read_table(part) for part in self._parts()])

    def __enter__(self) -> _Store:
        return self

    def __exit__(self, *exception: object) -> None:
        self._flush()

    def _parts(self) -> list[Path]:
        return sorted(self._folder.glob("part-*.parquet"))

    def _flush(self) -> None:
        self._since = monotonic()
        if not self._rows:
            return
        table = pa.Table.from_pylist(self._rows)
        table = table.replace_schema_metadata({_KEY: json.dumps(self._study)})
        target = self._folder / f"part-{self._next:05d}.parquet"
        with moved_into_place(target) as temporary:
            pq.write_table(table, temporary)
        self._next += 1
        self._rows = []


def _here(work: Callable[[int], list[Row]], todo: Sequence[int], jobs: int) -> Rows:
    if jobs == 1 or len(todo) < 2:
        for run in todo:
            yield work(run)
        return
    from joblib import Parallel, delayed, parallel_config

    with parallel_config("loky", inner_max_num_threads=1):
        pool = Parallel(n_jobs=jobs, return_as="generator_unordered")
        yield from pool(delayed(work)(run) for run in todo)


def _on_cluster(work: Callable[[int], list[Row]], todo: Sequence[int], address: str) -> Rows:
    try:
        from distributed import Client, as_completed
        from distributed.comm.addressing import parse_address
        from distributed.comm.registry import get_backend
    except ImportError:
        raise InputError(
            "a cluster needs Dask: install it with pip install 'gmwm[cluster]'"
        ) from None
    try:
        # A scheme that nobody speaks is refused before any thread is started.
        get_backend(parse_address(address)[0])
        client = Client(address, timeout="10s")
    except (OSError, TimeoutError, ValueError) as error:
        raise InputError(f"no Dask scheduler answers at {address!r} ({error})") from None
    with client:
        futures = client.map(work, todo, pure=False)
        for future in as_completed(futures):
            yield future.result()
