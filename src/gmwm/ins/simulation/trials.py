"""Monte Carlo: the same errors for every filter, run after run, in parallel."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypedDict, Unpack

import numpy as np

from gmwm._core import checks
from gmwm._core.runs import Earlier, do_runs
from gmwm._core.typing import FloatArray, Progress
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.filter.aiding import Aiding, Outage
from gmwm.ins.filter.filter import Filter, InitialSd, Outputs, Solution
from gmwm.ins.geometry import matrix_from_rotation_vector, matrix_from_rpy, offset, rpy_from_matrix
from gmwm.ins.increments import Imu, emulate
from gmwm.ins.sensors import Recorded, SensorErrors, SensorModels
from gmwm.ins.simulation.consistency import PER_RUN, QUANTITIES, FilterErrors, errors_of_run, sizes
from gmwm.ins.trajectory.trajectory import NavState, Trajectory
from gmwm.issues import Notice, notice

_KEPT_EPOCHS = 300  # whose errors are kept, besides outages: a figure shows no more
_OUTAGE_EPOCHS = 1.0  # s between epochs that are kept in an outage


@dataclass(frozen=True)
class Simulated:
    """Sensor errors drawn from models."""

    models: SensorModels

    @property
    def available(self) -> int | None:
        """Any number of runs."""
        return None

    def draw(self, run: int, n: int, dt: float, rng: np.random.Generator) -> SensorErrors:
        """Errors of one run; see `SensorModels.simulate`."""
        return self.models.simulate(n, dt, rng)


ErrorSource = Simulated | Recorded
"""Where sensor errors come from."""


@dataclass(frozen=True, eq=False)
class Scenario:
    """A trajectory with its aiding and outages.

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
    second_order : bool
        Whether filters allow for the square of the tilt error; see `gmwm.ins.filter.Filter`.
    """

    trajectory: Trajectory
    aiding: Aiding
    outages: tuple[Outage, ...] = ()
    initial_sd: InitialSd = field(default_factory=InitialSd)
    step: float = tuning.COVARIANCE_STEP
    interval: float = 0.0
    second_order: bool = True

    def __post_init__(self) -> None:
        dt = self.trajectory.dt
        for outage in self.outages:
            epoch = outage.end / dt
            if abs(epoch - round(epoch)) * dt > tuning.SAME_TIME:
                raise InputError(
                    f"the outage from {outage.start:g} s ends at {outage.end:.9g} s, between two "
                    f"epochs of the trajectory: give multiples of its {dt:g} s"
                )
            if round(epoch) > self.trajectory.n:
                raise InputError(
                    f"the outage from {outage.start:g} s to {outage.end:g} s goes beyond the end "
                    f"of the trajectory at {self.trajectory.duration:g} s: begin it earlier"
                )

    def outputs(self) -> Outputs:
        """Epochs kept: evenly spaced, every second of an outage, its end before the first fix."""
        dt, n = self.trajectory.dt, self.trajectory.n
        interval = self.interval or float(max(np.ceil(n * dt / _KEPT_EPOCHS), dt))
        within = [np.arange(o.start, o.end, max(_OUTAGE_EPOCHS, dt)) for o in self.outages]
        ends = [outage.end for outage in self.outages]
        return Outputs.every(interval, dt, n, ends, also=np.concatenate([[], *within]))


@dataclass(frozen=True, eq=False)
class Experiment:
    """Filters, by name, that navigate on the same errors.

    ``truth`` has the models that errors are drawn from; it is ``None`` for real ones.
    """

    scenario: Scenario
    source: ErrorSource
    filters: dict[str, SensorModels]
    truth: SensorModels | None
    runs: int = 100
    seed: int = 0
    title: str = ""


@dataclass(frozen=True, eq=False)
class MonteCarlo:
    """Errors of some filters, by name, over the same runs.

    ``example`` has the solutions of the first run, once a second.
    """

    filters: dict[str, FilterErrors]
    outages: tuple[Outage, ...]
    example: dict[str, Solution]
    truth: Trajectory
    notices: tuple[Notice, ...] = ()

    def __getitem__(self, name: str) -> FilterErrors:
        if name not in self.filters:
            raise InputError(f"no filter {name!r}: choose from {', '.join(self.filters)}")
        return self.filters[name]


def pooled_sizes(study: MonteCarlo, name: str) -> dict[str, FloatArray]:
    """Root mean square over the outages of a run, of each error of `QUANTITIES`, (R,)."""
    if not study.outages:
        raise InputError("the study has no outage: give at least one")
    each = [sizes(study[name], outage.end) for outage in study.outages]
    return {
        quantity: np.sqrt(np.mean([part[quantity] ** 2 for part in each], axis=0))
        for quantity in QUANTITIES
    }


class RunOptions(TypedDict, total=False):
    """How runs are done, and where they are kept; see `gmwm.ins.monte_carlo`."""

    jobs: int
    cluster: str | None
    folder: Path | None
    earlier: Earlier
    progress: Progress | None


def monte_carlo(
    scenario: Scenario,
    source: ErrorSource,
    filters: Mapping[str, SensorModels],
    runs: int = 100,
    seed: int = 0,
    **options: Unpack[RunOptions],
) -> MonteCarlo:
    """Run filters with different sensor models on the same simulated flights.

    Every run draws sensor errors, noise of the fixes and an initial error; all filters get the
    same, so that their differences are those of the models.

    Raises InputError if there is no filter, no run, the seed is negative, or the folder holds
    another study.

    Parameters
    ----------
    scenario : Scenario
    source : ErrorSource
        `Simulated`, or `gmwm.ins.Recorded`, whose independent stretches are limited.
    filters : mapping of str to SensorModels
        Name -> models of a filter.
    runs, seed : int, optional
    **options
        jobs (processes; -1 for one a core) or cluster (address of a Dask scheduler that does the
        work instead); folder (Path, where finished runs are kept every few seconds); earlier
        ("resume", "replace" or "refuse", for runs that it holds already); progress (called as
        ``progress(done, runs, "")``).
    """
    if not filters:
        raise InputError("no filters given: give at least one")
    runs, seed = checks.whole("runs", runs, 1), checks.whole("seed", seed, 0)
    notices: tuple[Notice, ...] = ()
    if source.available is not None and source.available < runs:
        notices = (notice("fewer-runs", "", {"runs": source.available, "asked": runs}),)
        runs = source.available
    task = _Task(scenario, source, dict(filters), emulate(scenario.trajectory), seed)
    found = do_runs(task, runs, task.study(), **options)
    outputs = scenario.outputs()
    time, before = outputs.time(scenario.trajectory.dt), outputs.before == 1
    errors = {
        name: FilterErrors(time, before, **{key: found[f"{name}/{key}"] for key in PER_RUN})
        for name in filters
    }
    return MonteCarlo(errors, scenario.outages, task.example(), scenario.trajectory, notices)


@dataclass(frozen=True, eq=False)
class _Task:
    """All that a worker needs; called with the number of a run, it does that."""

    scenario: Scenario
    source: ErrorSource
    filters: dict[str, SensorModels]
    imu: Imu
    seed: int

    def __call__(self, run: int) -> dict[str, FloatArray]:
        """Figures of a run, by filter and name."""
        outputs, truth = self.scenario.outputs(), self.scenario.trajectory
        found, errors = self.solutions(run, outputs)
        return {
            f"{name}/{key}": values
            for name, solution in found.items()
            for key, values in errors_of_run(solution, truth, errors, outputs).items()
        }

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

    def study(self) -> dict[str, Any]:
        """Everything that the runs depend on."""
        scenario, source, aiding = self.scenario, self.source, self.scenario.aiding
        truth = scenario.trajectory
        fixes = [part for f in aiding.fixes for part in (f.kind, f.time, f.value, f.sd)]
        slow = (aiding.coloured_sd, aiding.coloured_tau, aiding.barometer_sd, aiding.barometer_tau)
        stretches = source.stretches if isinstance(source, Recorded) else ()
        drawn = _exactly(source.models) if isinstance(source, Simulated) else source
        start = (scenario.initial_sd, scenario.step, scenario.second_order, scenario.interval)
        return {
            "seed": self.seed,
            "filters": {name: _digest(_exactly(each)) for name, each in self.filters.items()},
            "sensor errors": _digest(drawn, *stretches),
            "trajectory": _digest(truth.dt, truth.lla, truth.velocity, truth.rpy),
            "fixes": _digest(aiding.lever_arm, *slow, aiding.gate, *fixes),
            "outages": _digest(scenario.outages),
            "settings": _digest(*start),
        }


def disturbed(state: NavState, sd: InitialSd, rng: np.random.Generator) -> NavState:
    """An estimate of a state: the truth with errors drawn from their standard deviations."""
    error = sd.deviations * rng.standard_normal(9)
    turn = matrix_from_rotation_vector(-error[6:])
    return NavState(
        offset(state.lla, error[:3]),
        state.velocity + error[3:6],
        rpy_from_matrix(turn @ matrix_from_rpy(state.rpy)),
    )


def _digest(*parts: Any) -> str:
    """Digest of arrays and of objects whose text has all digits."""
    digest = hashlib.sha256()
    for part in parts:
        array = isinstance(part, np.ndarray)
        digest.update(repr(part.shape if array else part).encode())
        digest.update(np.ascontiguousarray(part).tobytes() if array else b"")
    return digest.hexdigest()


def _exactly(models: SensorModels) -> str:
    """Models with all digits, which their own text has not."""
    values = [list(model.params.values()) for model in models.models.values()]
    return repr((models, values))
