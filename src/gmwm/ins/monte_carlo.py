"""Monte Carlo: the same errors for every filter, run after run, in parallel."""

from __future__ import annotations

import hashlib
import json
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Protocol

import numpy as np

from gmwm import checks
from gmwm._typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins.aiding import Aiding, Outage
from gmwm.ins.earth import offset
from gmwm.ins.emulation import Imu, emulate
from gmwm.ins.filter import Filter, InitialSd, Outputs
from gmwm.ins.rotation import matrix_from_rotation_vector, matrix_from_rpy, rpy_from_matrix
from gmwm.ins.sensors import SensorErrors, SensorModels
from gmwm.ins.solution import Solution
from gmwm.ins.trajectory import NavState, Trajectory

GROUPS = {
    "position": slice(0, 3),
    "velocity": slice(3, 6),
    "attitude": slice(6, 9),
    "navigation": slice(0, 9),
}
"""Navigation errors that are judged together."""

_CHUNK = 10  # runs that a worker does, and a file holds, at a time
_MOST_EPOCHS = 300
_SAME_TIME = 1e-6  # s
_IN_OUTAGE = 1.0  # s


class ErrorSource(Protocol):
    """Where sensor errors come from: models, or a real recording."""

    @property
    def available(self) -> int | None:
        """Independent runs that there are; ``None`` for any number."""

    def draw(self, run: int, n: int, dt: float, rng: np.random.Generator) -> SensorErrors:
        """Errors of one run."""


@dataclass(frozen=True)
class Simulated:
    """Sensor errors drawn from models.

    Attributes
    ----------
    models : SensorModels
    """

    models: SensorModels

    @property
    def available(self) -> int | None:
        """Any number of runs."""
        return None

    def draw(self, run: int, n: int, dt: float, rng: np.random.Generator) -> SensorErrors:
        """Errors of one run; see `SensorModels.simulate`."""
        return self.models.simulate(n, dt, rng)


@dataclass(frozen=True, eq=False)
class Scenario:
    """What is flown or driven, and what aids it.

    Attributes
    ----------
    trajectory : Trajectory
    aiding : Aiding
        Error-free fixes of the whole trajectory; their noise is drawn run by run.
    outages : tuple of Outage
    initial_sd : InitialSd
        The error of the initial state is drawn from it.
    step : float
        Of the covariance, s.
    interval : float
        At which errors are kept, s; zero for some 300 epochs.
    """

    trajectory: Trajectory
    aiding: Aiding
    outages: tuple[Outage, ...] = ()
    initial_sd: InitialSd = field(default_factory=InitialSd)
    step: float = 0.1
    interval: float = 0.0

    def __post_init__(self) -> None:
        dt = self.trajectory.dt
        for outage in self.outages:
            epoch = outage.end / dt
            if abs(epoch - round(epoch)) * dt > _SAME_TIME:
                raise InputError(
                    f"the outage from {outage.start:g} s ends at {outage.end:.9g} s, between two "
                    f"epochs of the trajectory: give multiples of its {dt:g} s"
                )
            if round(epoch) > self.trajectory.n:
                raise InputError(
                    f"the outage from {outage.start:g} s to {outage.end:g} s goes beyond the end "
                    f"of the trajectory at {self.trajectory.duration:g} s: begin it earlier"
                )

    @property
    def kept_interval(self) -> float:
        """Interval at which errors are kept, s."""
        least = self.trajectory.duration / _MOST_EPOCHS
        return self.interval or float(max(np.ceil(least), self.trajectory.dt))

    def outputs(self) -> Outputs:
        """Epochs that are kept.

        Evenly spaced, every second of an outage, and its end before the first fix.
        """
        dt, n = self.trajectory.dt, self.trajectory.n
        within = [np.arange(o.start, o.end, max(_IN_OUTAGE, dt)) for o in self.outages]
        ends = [outage.end for outage in self.outages]
        return Outputs.every(self.kept_interval, dt, n, ends, also=np.concatenate([[], *within]))


@dataclass(frozen=True, eq=False)
class Runs:
    """Errors of one filter over R runs at K epochs.

    Attributes
    ----------
    time : (K,) ndarray
        s.
    before : (K,) ndarray of bool
        Whether the measurements of the epoch were not in yet.
    error, sd : (R, K, 9) ndarray
        Estimate less truth of position (m), velocity (m/s) and attitude (rad), and the standard
        deviation that the filter predicted; NaN from where a filter diverged.
    nees : (R, K, 4) ndarray
        Normalised error squared of the `GROUPS`.
    log_det : (R, K, 4) ndarray
        Logarithm of the determinant of the predicted covariance of the `GROUPS`.
    sensor_error, sensor_sd : (R, K, 6) ndarray
        Estimate less truth of the sensors' errors, without their white noise; NaN where the truth
        is not known, as at the very last epoch, which no sample follows.
    sensor_nees : (R, K) ndarray
        Of all sensors that have states; NaN as long as one of them is known without error.
    nis : (R, 2) ndarray
        Sum of the normalised innovations squared of a run, and how many components it sums.
    whiteness : (R,) ndarray
        Autocorrelation of the standardised innovations from one fix to the next in its standard
        error: standard normal if they are white, whatever their size.
    """

    time: FloatArray
    before: np.typing.NDArray[np.bool_]
    error: FloatArray
    sd: FloatArray
    nees: FloatArray
    log_det: FloatArray
    sensor_error: FloatArray
    sensor_sd: FloatArray
    sensor_nees: FloatArray
    nis: FloatArray
    whiteness: FloatArray

    @property
    def runs(self) -> int:
        """Number of runs R."""
        return len(self.error)

    @property
    def diverged(self) -> int:
        """Runs in which the filter diverged."""
        return int(np.count_nonzero(np.isnan(self.error[:, -1, 0])))

    def index(self, time: float, *, before: bool = True) -> int:
        """Place of an epoch.

        Raises
        ------
        InputError
            If it was not kept.
        """
        found = np.flatnonzero((np.abs(self.time - time) < _SAME_TIME) & (self.before == before))
        if found.size == 0:
            raise InputError(f"no errors were kept at {time:g} s: give the end of an outage")
        return int(found[0])


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
    progress: Callable[[int], None] | None = None,
) -> MonteCarlo:
    """Run filters with different sensor models on the same simulated flights.

    Every run draws sensor errors, noise of the fixes and an initial error; all filters get the
    same, so that their differences are those of the models.

    Parameters
    ----------
    scenario : Scenario
    source : ErrorSource
        `Simulated`, or `gmwm.ins.recorded.Recorded`, whose independent stretches are limited.
    filters : mapping of str to SensorModels
        Name -> what a filter believes.
    runs, seed : int, optional
    jobs : int, optional
        Processes; -1 for one a core.
    folder : Path, optional
        Where finished runs are kept, and taken from: an interrupted study goes on.
    progress : callable, optional
        Called with the number of runs done.

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
    store = _Store.of(folder, task, runs)
    starts = range(0, runs, _CHUNK)
    found = {start: store.get(start) for start in starts}
    chunks = {start: chunk for start, chunk in found.items() if chunk is not None}
    missing = [start for start in starts if start not in chunks]
    done = runs - sum(min(_CHUNK, runs - start) for start in missing)
    work = (delayed(_chunk)(task, start, min(start + _CHUNK, runs)) for start in missing)
    for start, chunk in Parallel(n_jobs=jobs, return_as="generator_unordered")(work):
        chunks[start] = chunk
        store.put(start, chunk)
        done += len(next(iter(chunk.values())).error)
        if progress is not None:
            progress(done)
    parts = [chunks[start] for start in starts]
    return MonteCarlo(
        filters={name: _joined([part[name] for part in parts]) for name in filters},
        outages=scenario.outages,
        example=task.example(),
        truth=scenario.trajectory,
        notes=notes,
    )


_Chunk = dict[str, Runs]
_PER_RUN = ("error", "sd", "nees", "log_det", "sensor_error", "sensor_sd", "sensor_nees", "nis",
            "whiteness")  # fmt: skip


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
            ready = Filter.of(models, aiding, imu.dt, scenario.step)
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


def _chunk(task: _Task, start: int, stop: int) -> tuple[int, _Chunk]:
    outputs = task.scenario.outputs()
    rows: dict[str, list[dict[str, FloatArray]]] = {name: [] for name in task.filters}
    for run in range(start, stop):
        found, errors = task.solutions(run, outputs)
        for name, solution in found.items():
            rows[name].append(_judged(solution, task.scenario.trajectory, errors, outputs))
    time = outputs.time(task.imu.dt)
    return start, {
        name: Runs(
            time=time,
            before=outputs.before == 1,
            **{key: np.stack([row[key] for row in each]) for key in _PER_RUN},
        )
        for name, each in rows.items()
    }


def _judged(
    solution: Solution, truth: Trajectory, errors: SensorErrors, outputs: Outputs
) -> dict[str, FloatArray]:
    """What is kept of a run; NaN where the solution does not reach."""
    done, total = solution.time.size, outputs.epoch.size
    error = solution.errors(truth)
    nees, log_det = np.empty((2, done, len(GROUPS)))
    for i, part in enumerate(GROUPS.values()):
        nees[:, i], log_det[:, i] = _normalised(error[:, part], solution.covariance[:, part, part])
    sensor_error = np.full((done, 6), np.nan)
    sensor_nees = np.full(done, np.nan)
    if errors.slow is not None:
        # The states of an epoch are those of the sample that follows it; the last one has none.
        at = outputs.epoch[:done]
        known = at < len(errors.slow)
        sensor_error[known] = solution.sensor_errors[known] - errors.slow[at[known]]
        sensor_nees = _normalised(sensor_error, solution.sensor_covariance)[0]
    standard = solution.innovations.standard
    seen = standard[np.isfinite(standard)]
    result = {
        "error": error,
        "sd": solution.sd,
        "nees": nees,
        "log_det": log_det,
        "sensor_error": sensor_error,
        "sensor_sd": np.sqrt(np.diagonal(solution.sensor_covariance, axis1=1, axis2=2)),
        "sensor_nees": sensor_nees,
    }
    for key, values in result.items():
        full = np.full((total, *values.shape[1:]), np.nan)
        full[:done] = values
        result[key] = full
    result["nis"] = np.array([np.sum(seen**2), float(seen.size)])
    result["whiteness"] = np.array(_lag_one(solution))
    return result


def _normalised(error: FloatArray, covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Squares of errors (K, d) in units of their covariance (K, d, d), and its log determinant.

    Only what has a variance at some epoch counts: a sensor without states has no error that is
    estimated. NaN where one that counts has none yet, as a random walk that starts at zero.
    """
    variance = np.diagonal(covariance, axis1=1, axis2=2)
    alive = np.any(variance > 0.0, axis=0)
    squares, log_det = np.full((2, len(error)), np.nan)
    settled = np.all(variance[:, alive] > 0.0, axis=1)
    if np.any(alive) and np.any(settled):
        error, covariance = error[settled][:, alive], covariance[settled][:, alive][:, :, alive]
        solved = np.linalg.solve(covariance, error[..., None])[..., 0]
        squares[settled] = np.sum(error * solved, axis=1)
        log_det[settled] = np.linalg.slogdet(covariance)[1]
    return squares, log_det


def _lag_one(solution: Solution) -> float:
    """Autocorrelation of innovations from fix to fix, in its standard error if they are white."""
    products = []
    innovations = solution.innovations
    for kind in np.unique(innovations.kind):
        of_kind = innovations.standard[innovations.kind == kind]
        products.append((of_kind[1:] * of_kind[:-1]).ravel())
    together = np.concatenate(products) if products else np.zeros(0)
    together = together[np.isfinite(together)]
    scale = np.sqrt(np.sum(together**2))
    return float(np.sum(together) / scale) if scale > 0.0 else float("nan")


def _joined(parts: Sequence[Runs]) -> Runs:
    first = parts[0]
    joined = {key: np.concatenate([getattr(part, key) for part in parts]) for key in _PER_RUN}
    return Runs(time=first.time, before=first.before, **joined)


@dataclass(frozen=True)
class _Store:
    """Finished chunks in a folder, or none."""

    folder: Path | None
    runs: int

    @classmethod
    def of(cls, folder: Path | None, task: _Task, runs: int) -> _Store:
        if folder is None:
            return cls(None, runs)
        mark = folder / "study.json"
        wanted = {"fingerprint": _fingerprint(task), "chunk": _CHUNK}
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if mark.exists():
                if json.loads(mark.read_text(encoding="utf-8")) != wanted:
                    raise InputError(f"{folder} holds the runs of another study: give a new folder")
            else:
                mark.write_text(json.dumps(wanted), encoding="utf-8")
        except (OSError, json.JSONDecodeError, UnicodeDecodeError) as error:
            raise InputError(f"{folder}: cannot be used ({error}): give another folder") from None
        return cls(folder, runs)

    def path(self, start: int) -> Path | None:
        if self.folder is None:
            return None
        return self.folder / f"runs-{start}-{min(start + _CHUNK, self.runs)}.npz"

    def put(self, start: int, chunk: _Chunk) -> None:
        path = self.path(start)
        if path is None:
            return
        arrays = {
            f"{name}/{each.name}": getattr(runs, each.name)
            for name, runs in chunk.items()
            for each in fields(Runs)
        }
        partial = path.with_suffix(".partial.npz")
        np.savez(partial, **arrays)
        partial.replace(path)

    def get(self, start: int) -> _Chunk | None:
        """A finished chunk; ``None`` if there is none, or its file is damaged."""
        path = self.path(start)
        if path is None or not path.exists():
            return None
        try:
            with path.open("rb") as file, np.load(file) as content:
                names = dict.fromkeys(key.rpartition("/")[0] for key in content.files)
                return {
                    name: Runs(
                        **{each.name: content[f"{name}/{each.name}"] for each in fields(Runs)}
                    )
                    for name in names
                }
        except (OSError, EOFError, ValueError, KeyError, zipfile.BadZipFile):
            return None


def _fingerprint(task: _Task) -> str:
    """Of everything that the runs depend on."""
    scenario = task.scenario
    digest = hashlib.sha256()
    truth, aiding = scenario.trajectory, scenario.aiding
    filters = [(name, _exactly(models)) for name, models in task.filters.items()]
    source = task.source
    drawn = _exactly(source.models) if isinstance(source, Simulated) else repr(source)
    for part in (filters, drawn, task.seed, scenario.outages, scenario.initial_sd, scenario.step,
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
