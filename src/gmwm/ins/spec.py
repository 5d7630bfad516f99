"""A validation by navigating, as it is written in a YAML file or in flags."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Discriminator, Field, StrictInt, Tag

from gmwm._core import checks
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.fields import (
    RECORDINGS,
    FileName,
    Meters,
    OfFile,
    OfTerms,
    PositiveHertz,
    PositiveMeters,
    PositiveRadians,
    PositiveSeconds,
    PositiveSpeed,
    Seconds,
    Spec,
    Three,
    form_of,
    read_models,
    written,
)
from gmwm.ins.filter.aiding import Outage, gnss
from gmwm.ins.filter.filter import InitialSd
from gmwm.ins.filter.states import SensorStates
from gmwm.ins.increments import emulate
from gmwm.ins.sensors import Recorded, SensorModels
from gmwm.ins.simulation.trials import ErrorSource, Experiment, Scenario, Simulated
from gmwm.ins.trajectory.missions import car_drive, fixed_wing_loiter, helicopter_mapping
from gmwm.ins.trajectory.trajectory import Trajectory
from gmwm.readers import read

MISSIONS: dict[str, Callable[..., Trajectory]] = {
    "helicopter": helicopter_mapping,
    "car": car_drive,
    "loiter": fixed_wing_loiter,
}
"""Ready-made trajectories by name."""

_LONGEST_NAME = 40
_SAME_RATE = 1e-3

_NONE = BeforeValidator(lambda given: None if given == "none" else given)


class ReadingSpec(Spec):
    """How a recording is read; see `gmwm.read`."""

    rate: PositiveHertz | None = None
    units: Annotated[dict[str, str] | None, written("{gyro: deg/s, accel: g}")] = None
    channels: Annotated[dict[str, str | StrictInt] | None, written("{gyro_x: column}")] = None
    time: Annotated[str | StrictInt | Literal[False] | None, written("a column, or none")] = None
    format: str | None = None
    layout: str | None = None
    damaged: bool = False

    def options(self) -> dict[str, Any]:
        """Arguments of `gmwm.read`."""
        options = {name: getattr(self, name) for name in ReadingSpec.model_fields}
        return options | ({"time": False} if self.time == "none" else {})


class RecordingsSpec(ReadingSpec):
    """Static recordings that sensor errors are taken from."""

    recordings: Annotated[
        list[FileName],
        written("[file, ...]"),
        BeforeValidator(lambda given: [given] if isinstance(given, str) else given),
    ]


class GnssSpec(Spec):
    """Fixes; what is left out is as usual in `gmwm.ins.gnss`."""

    interval: PositiveSeconds | None = None
    position_sd: Annotated[Three[PositiveMeters] | None, _NONE] = None
    velocity_sd: Annotated[Three[PositiveSpeed] | None, _NONE] = None
    lever_arm: Three[Meters] = (0.0, 0.0, 0.0)
    coloured_sd: Three[Meters] | None = None
    coloured_tau: PositiveSeconds | None = None


class InitialSpec(Spec):
    """What is left out is as usual in `InitialSd`."""

    position: PositiveMeters | None = None
    velocity: PositiveSpeed | None = None
    tilt: PositiveRadians | None = None
    heading: PositiveRadians | None = None


def _named(given: Any) -> dict[str, Any]:
    """Filters by names that tables and figures can show."""
    if not isinstance(given, Mapping):
        raise ValueError(
            f"{checks.shown(given)}: write NAME: calibration.json, or NAME: with models"
        )
    found: dict[str, Any] = {}
    for key, each in given.items():
        name = str(key)
        if not name.strip() or not name.isprintable() or len(name) > _LONGEST_NAME:
            raise ValueError(
                f"{name[:_LONGEST_NAME]!r} cannot be a name: write 1 to {_LONGEST_NAME} "
                "printable characters"
            )
        if name in found:
            raise ValueError(f"{name!r} appears twice: give different names")
        found[name] = each
    return found


_Truth = Annotated[
    OfFile | Annotated[RecordingsSpec, Tag(RECORDINGS)] | OfTerms,
    Discriminator(form_of),
    written("a calibration.json, models or recordings"),
]
_Filter = Annotated[
    OfFile | OfTerms,
    Discriminator(form_of),
    written("a calibration.json, models, truth, or a file of gmwm bound or reduce"),
]
_Span = Annotated[tuple[Seconds, Seconds], written("[start, length] in seconds")]


class ExperimentSpec(Spec):
    """What a file may say."""

    NEEDS: ClassVar[str] = (
        "say what is flown or driven (trajectory), where sensor errors come from (truth), what "
        "each filter assumes (filters)"
    )

    trajectory: Annotated[str, written(f"{', '.join(MISSIONS)} or a file")]
    duration: PositiveSeconds | None = None
    rate: PositiveHertz | None = None
    truth: _Truth
    filters: Annotated[dict[str, _Filter], BeforeValidator(_named)]
    outages: Annotated[tuple[_Span, ...], written("[[start, length], ...] in seconds")] = ()
    gnss: GnssSpec = GnssSpec()
    initial_sd: InitialSpec = InitialSpec()
    runs: Annotated[StrictInt, Field(ge=1)] = 100
    seed: Annotated[StrictInt, Field(ge=0)] = 0


def experiment_from(content: Mapping[str, Any], folder: Path = Path()) -> Experiment:
    """An experiment from the content of a file.

    The content has trajectory, truth and filters, and what else is not as usual; see the
    documentation. Paths are relative to a folder.

    Raises InputError if something is missing, unknown or cannot be used.
    """
    spec = ExperimentSpec.parse(content)
    trajectory = _trajectory(spec, folder)
    scenario = _scenario(spec, trajectory)
    source = _source(spec.truth, trajectory, folder)
    filters = {
        name: _models(f"filters, {name}", each, source, trajectory.dt, folder)
        for name, each in spec.filters.items()
    }
    truth = source.models if isinstance(source, Simulated) else None
    title = Path(spec.trajectory).name
    return Experiment(scenario, source, filters, truth, spec.runs, spec.seed, title)


def _trajectory(spec: ExperimentSpec, folder: Path) -> Trajectory:
    name, duration = spec.trajectory, spec.duration
    if name in MISSIONS:
        arguments = {} if duration is None else {"duration": duration}
        if spec.rate is not None:
            arguments["dt"] = 1.0 / spec.rate
        return MISSIONS[name](**arguments)
    if not os.path.exists(folder / name):
        raise InputError(
            f"trajectory {checks.shown(name)} is not a file, and none of {', '.join(MISSIONS)}: "
            "check the name"
        )
    if spec.rate is not None:
        raise InputError("rate: the trajectory file has its own rate: leave it out")
    trajectory = Trajectory.read(folder / name)
    if duration is None:
        return trajectory
    if duration > trajectory.duration + tuning.SAME_TIME:
        raise InputError(
            f"duration = {duration:g} s: {name} has {trajectory.duration:g} s; give at most that"
        )
    return trajectory.segment(0.0, duration)


def _scenario(spec: ExperimentSpec, trajectory: Trajectory) -> Scenario:
    """Reject outages that overlap or take no fix away, and a study without fixes."""
    outages = sorted((Outage(*each) for each in spec.outages), key=lambda outage: outage.start)
    for first, second in pairwise(outages):
        if second.start < first.end - tuning.SAME_TIME:
            raise InputError(
                f"outages: the one from {second.start:g} s begins before the one from "
                f"{first.start:g} s ends at {first.end:g} s: join or separate them"
            )
    imu = emulate(trajectory) if any(spec.gnss.lever_arm) else None
    aiding = gnss(trajectory, **spec.gnss.given, imu=imu)
    scenario = Scenario(trajectory, aiding, tuple(outages), InitialSd(**spec.initial_sd.given))
    total = sum(each.time.size for each in aiding.fixes)
    if not total:
        raise InputError(
            "gnss: there is no fix: give position_sd or velocity_sd, and an interval below the "
            "duration"
        )
    for outage in outages:
        if sum(each.time.size for each in aiding.without([outage]).fixes) == total:
            raise InputError(
                f"outages: no fix falls between {outage.start:g} s and {outage.end:g} s: "
                "make the outage longer than the interval of the fixes"
            )
    return scenario


def _source(given: _Truth, trajectory: Trajectory, folder: Path) -> Recorded | Simulated:
    """Models or recordings that errors come from."""
    if not isinstance(given, RecordingsSpec):
        return Simulated(read_models("truth", given, folder))
    recordings = [read(folder / name, **given.options()) for name in given.recordings]
    source = Recorded.of(recordings, trajectory.duration)
    if abs(trajectory.dt / source.dt - 1.0) > _SAME_RATE:
        raise InputError(
            f"truth: {source.source} has {1.0 / source.dt:g} Hz and the trajectory "
            f"{1.0 / trajectory.dt:g} Hz: give a trajectory of the recordings' rate"
        )
    return source


def _models(
    where: str, given: _Filter, source: ErrorSource, dt: float, folder: Path
) -> SensorModels:
    """Models of a filter, written at ``where``."""
    if given != "truth":
        models = read_models(where, given, folder)
    elif isinstance(source, Simulated):
        models = source.models
    else:
        raise InputError(f"{where}: real errors have no true model: give a calibration")
    if isinstance(source, Recorded):
        # A random walk does not start at zero in the middle of a recording.
        walks = {
            axis: source.bias_sd[axis]
            for axis, model in models.models.items()
            if models.bias_sd[axis] == 0.0 and any(term.is_walk for term in model.terms)
        }
        models = replace(models, bias_sd={**models.bias_sd, **walks})
    try:
        SensorStates.of(models, dt, 1)
    except InputError as error:
        raise InputError(f"{where}, {error}") from None
    return models
