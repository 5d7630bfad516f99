"""Monte Carlo: the same errors for every filter, run after run, in parallel."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gmwm._core import checks
from gmwm._core.typing import FloatArray, Progress
from gmwm.errors import InputError
from gmwm.ins.filter import Filter, InitialSd, Outage, Outputs, Solution
from gmwm.ins.geometry import matrix_from_rotation_vector, matrix_from_rpy, offset, rpy_from_matrix
from gmwm.ins.imu import Imu, SensorErrors, SensorModels, emulate
from gmwm.ins.montecarlo.run_store import CHUNK, Chunk, RunStore
from gmwm.ins.montecarlo.runs import PER_RUN, Runs, joined, judged
from gmwm.ins.montecarlo.scenario import ErrorSource, Scenario, Simulated
from gmwm.ins.trajectory import NavState, Trajectory


@dataclass(frozen=True, eq=False)
class MonteCarlo:
    """Errors of some filters over the same runs.

    Attributes
    ----------
    filters : dict
        Name -> `Runs`.
    outages : tuple of Outage
    example : dict
        Name -> `Solution` of the first run, once a second.
    truth : Trajectory
    notes : tuple of str
    """

    filters: dict[str, Runs]
    outages: tuple[Outage, ...]
    example: dict[str, Solution]
    truth: Trajectory
    notes: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> Runs:
        if name not in self.filters:
            raise InputError(f"no filter {name!r}: there are {', '.join(self.filters)}")
        return self.filters[name]


def monte_carlo(
    scenario: Scenario,
    source: ErrorSource,
    filters: Mapping[str, SensorModels],
    runs: int = 100,
    seed: int = 0,
    *,
    jobs: int = 1,
    folder: Path | None = None,
    progress: Progress | None = None,
) -> MonteCarlo:
    """Run filters with different sensor models on the same simulated flights.

    Every run draws sensor errors, noise of the fixes and an initial error; all filters get the
    same, so that their differences are those of the models.

    Parameters
    ----------
    scenario : Scenario
    source : ErrorSource
        `Simulated`, or `gmwm.ins.imu.recorded.Recorded`, whose independent stretches are limited.
    filters : mapping of str to SensorModels
        Name -> what a filter believes.
    runs, seed : int, optional
    jobs : int, optional
        Processes; -1 for one a core.
    folder : Path, optional
        Where finished runs are kept, and taken from: an interrupted study goes on.
    progress : callable, optional
        Called as ``progress(done, runs, "")``.

    Returns
    -------
    MonteCarlo

    Raises
    ------
    InputError
        If there is no filter, no run, the seed is negative, or the folder holds another study.
    """
    from joblib import Parallel, delayed

    if not filters:
        raise InputError("there is no filter: give one at least")
    runs, seed = checks.whole("runs", runs, 1), checks.whole("seed", seed, 0)
    imu = emulate(scenario.trajectory)
    notes: tuple[str, ...] = ()
    if source.available is not None and source.available < runs:
        notes = (
            f"{source.available} runs in place of {runs}: the recording has no more stretches "
            "of this length that do not overlap",
        )
        runs = source.available
    task = _Task(scenario, source, dict(filters), imu, seed)
    store = RunStore.of(folder, _fingerprint(task), runs)
    starts = range(0, runs, CHUNK)
    found = {start: store.get(start) for start in starts}
    chunks = {start: chunk for start, chunk in found.items() if chunk is not None}
    missing = [start for start in starts if start not in chunks]
    done = runs - sum(min(CHUNK, runs - start) for start in missing)
    work = (delayed(_chunk)(task, start, min(start + CHUNK, runs)) for start in missing)
    for start, chunk in Parallel(n_jobs=jobs, return_as="generator_unordered")(work):
        chunks[start] = chunk
        store.put(start, chunk)
        done += len(next(iter(chunk.values())).error)
        if progress is not None:
            progress(done, runs, "")
    parts = [chunks[start] for start in starts]
    return MonteCarlo(
        filters={name: joined([part[name] for part in parts]) for name in filters},
        outages=scenario.outages,
        example=task.example(),
        truth=scenario.trajectory,
        notes=notes,
    )


@dataclass(frozen=True, eq=False)
class _Task:
    """All that a worker needs."""

    scenario: Scenario
    source: ErrorSource
    filters: dict[str, SensorModels]
    imu: Imu
    seed: int

    def solutions(self, run: int, outputs: Outputs) -> tuple[dict[str, Solution], SensorErrors]:
        """All filters on the errors of one run, and the sensor errors."""
        scenario, imu = self.scenario, self.imu
        rng = np.random.default_rng([self.seed, run])
        errors = self.source.draw(run, imu.n, imu.dt, rng)
        noisy = imu.with_errors(errors.total[:, :3], errors.total[:, 3:])
        aiding = scenario.aiding.without(scenario.outages).noisy(rng)
        initial = disturbed(scenario.trajectory.state(0), scenario.initial_sd, rng)
        events = aiding.events(imu.dt, imu.n)
        found = {}
        for name, models in self.filters.items():
            ready = Filter.of(models, aiding, imu.dt, scenario.step, scenario.second_order)
            found[name] = ready.run(noisy, initial, scenario.initial_sd, events, outputs)
        return found, errors

    def example(self) -> dict[str, Solution]:
        """The first run, once a second and before the first fix after an outage."""
        ends = [outage.end for outage in self.scenario.outages]
        dt = self.imu.dt
        return self.solutions(0, Outputs.every(max(1.0, dt), dt, self.imu.n, ends))[0]


def disturbed(state: NavState, sd: InitialSd, rng: np.random.Generator) -> NavState:
    """An estimate of a state: the truth with errors drawn from their standard deviations."""
    error = sd.deviations * rng.standard_normal(9)
    turn = matrix_from_rotation_vector(-error[6:])
    return NavState(
        offset(state.lla, error[:3]),
        state.velocity + error[3:6],
        rpy_from_matrix(turn @ matrix_from_rpy(state.rpy)),
    )


def _chunk(task: _Task, start: int, stop: int) -> tuple[int, Chunk]:
    outputs = task.scenario.outputs()
    rows: dict[str, list[dict[str, FloatArray]]] = {name: [] for name in task.filters}
    for run in range(start, stop):
        found, errors = task.solutions(run, outputs)
        for name, solution in found.items():
            rows[name].append(judged(solution, task.scenario.trajectory, errors, outputs))
    time = outputs.time(task.imu.dt)
    return start, {
        name: Runs(
            time=time,
            before=outputs.before == 1,
            **{key: np.stack([row[key] for row in each]) for key in PER_RUN},
        )
        for name, each in rows.items()
    }


def _fingerprint(task: _Task) -> str:
    """Of everything that the runs depend on."""
    scenario = task.scenario
    digest = hashlib.sha256()
    truth, aiding = scenario.trajectory, scenario.aiding
    filters = [(name, _exactly(models)) for name, models in task.filters.items()]
    source = task.source
    drawn = _exactly(source.models) if isinstance(source, Simulated) else repr(source)
    for part in (filters, drawn, task.seed, scenario.outages, scenario.initial_sd,
                 scenario.step, scenario.second_order,
                 scenario.interval, aiding.coloured_tau, truth.dt):  # fmt: skip
        digest.update(repr(part).encode())
    arrays = [truth.lla, truth.velocity, truth.rpy, aiding.lever_arm, aiding.coloured_sd]
    for fixes in aiding.fixes:
        digest.update(fixes.kind.encode())
        arrays += [fixes.time, fixes.value, fixes.sd]
    for array in arrays:
        digest.update(repr(np.shape(array)).encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def _exactly(models: SensorModels) -> str:
    """Models with all digits, which their own text has not."""
    values = [list(model.params.values()) for model in models.models.values()]
    return repr((models, values))
