"""A validation by navigating, as it is written in a YAML file or in flags."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

from gmwm._core import checks
from gmwm.calibration import load
from gmwm.errors import InputError
from gmwm.ins.covariance import FORMS, reduce
from gmwm.ins.filter import Aiding, InitialSd, Outage, SensorStates, gnss
from gmwm.ins.imu import Recorded, SensorModels, emulate
from gmwm.ins.montecarlo import ErrorSource, Experiment, Scenario, Simulated
from gmwm.ins.spec.document import mapping, positive, read_document, three
from gmwm.ins.spec.model_text import sensor_models, value
from gmwm.ins.trajectory import Trajectory, car_drive, fixed_wing_loiter, helicopter_mapping
from gmwm.readers import read

MISSIONS: dict[str, Callable[..., Trajectory]] = {
    "helicopter": helicopter_mapping,
    "car": car_drive,
    "loiter": fixed_wing_loiter,
}
"""Ready-made trajectories by name."""

KEYS = ("trajectory", "duration", "rate", "truth", "filters", "outages", "gnss", "initial_sd",
        "runs", "seed")  # fmt: skip
"""What a description may say."""

_OF_RECORDINGS = ("recordings", "rate", "units", "channels", "time")
_LONGEST_NAME = 40
_SAME_TIME = 1e-6  # s
_SAME_RATE = 1e-3


def experiment_from(content: Mapping[str, Any], folder: Path = Path()) -> Experiment:
    """An experiment from the content of a file.

    Parameters
    ----------
    content : mapping
        trajectory, truth and filters, and what else is not as usual; see the documentation.
    folder : Path, optional
        That paths are relative to.

    Raises
    ------
    InputError
        If something is missing, unknown or cannot be used.
    """
    content = mapping("the experiment", content, KEYS)
    missing = [name for name in ("trajectory", "truth", "filters") if not content.get(name)]
    if missing:
        raise InputError(
            f"the experiment has no {', no '.join(missing)}: say what is flown or driven "
            "(trajectory), where sensor errors come from (truth), what each filter believes "
            "(filters)"
        )
    trajectory = _trajectory(content, folder)
    outages = _outages(content.get("outages", ()))
    aiding = _aiding(content.get("gnss", {}), trajectory)
    scenario = Scenario(trajectory, aiding, outages, _initial_sd(content.get("initial_sd", {})))
    _check_fixes(aiding, outages)
    source, truth = _source(content["truth"], trajectory, folder)
    believed = _Believed(truth, source, [o.duration for o in outages], trajectory.dt, folder)
    return Experiment(
        scenario=scenario,
        source=source,
        filters=believed.filters(content["filters"]),
        truth=truth,
        runs=checks.whole("runs", content.get("runs", 100), 1),
        seed=checks.whole("seed", content.get("seed", 0), 0),
        title=Path(content["trajectory"]).name,
    )


def read_experiment(path: Path) -> Mapping[str, Any]:
    """Content of a YAML file.

    Raises
    ------
    InputError
        If it cannot be read or is no YAML.
    """
    return read_document(path)


def _trajectory(content: Mapping[str, Any], folder: Path) -> Trajectory:
    name = content["trajectory"]
    if not isinstance(name, str):
        raise InputError(f"trajectory: {checks.shown(name)}: write {', '.join(MISSIONS)} or a file")
    duration = content.get("duration")
    if duration is not None:
        duration = positive(duration, "s", "duration")
    if name in MISSIONS:
        arguments = {} if duration is None else {"duration": duration}
        if "rate" in content:
            arguments["dt"] = 1.0 / positive(content["rate"], "Hz", "rate")
        return MISSIONS[name](**arguments)
    if not os.path.exists(folder / name):
        raise InputError(
            f"trajectory {checks.shown(name)} is no file, and none of {', '.join(MISSIONS)}: "
            "check the name"
        )
    if "rate" in content:
        raise InputError("rate: a trajectory from a file has its own: leave it out")
    trajectory = Trajectory.read(folder / name)
    if duration is None:
        return trajectory
    if duration > trajectory.duration + _SAME_TIME:
        raise InputError(
            f"duration = {duration:g} s: {name} has {trajectory.duration:g} s, give at most that"
        )
    return trajectory.segment(0.0, duration)


def _outages(content: Any) -> tuple[Outage, ...]:
    if not isinstance(content, Sequence) or isinstance(content, str):
        raise InputError(
            f"outages: {checks.shown(content)}: write [[start, length], ...] in seconds"
        )
    outages = sorted((_outage(each) for each in content), key=lambda outage: outage.start)
    for first, second in pairwise(outages):
        if second.start < first.end - _SAME_TIME:
            raise InputError(
                f"outages: that from {second.start:g} s begins before that from {first.start:g} s "
                f"ends at {first.end:g} s: write them as one, or apart"
            )
    return tuple(outages)


def _outage(given: Any) -> Outage:
    if not isinstance(given, Sequence) or isinstance(given, str) or len(given) != 2:
        raise InputError(f"outages: {checks.shown(given)}: write [start, length] in seconds")
    start, duration = (value(each, "s", "outages") for each in given)
    return Outage(start, duration)


def _aiding(content: Any, trajectory: Trajectory) -> Aiding:
    units = {"position_sd": "m", "velocity_sd": "m/s", "lever_arm": "m", "coloured_sd": "m"}
    content = mapping("gnss", content, ("interval", *units, "coloured_tau"))
    arguments: dict[str, Any] = {
        name: positive(content[name], "s", f"gnss, {name}")
        for name in ("interval", "coloured_tau")
        if name in content
    }
    for name, unit in units.items():
        if name in content:
            off = name in ("position_sd", "velocity_sd") and content[name] == "none"
            arguments[name] = None if off else three(content[name], unit, f"gnss, {name}")
        if name.endswith(("position_sd", "velocity_sd")) and arguments.get(name):
            arguments[name] = [checks.positive(f"gnss, {name}", each) for each in arguments[name]]
    if any(arguments.get("lever_arm", ())):
        arguments["imu"] = emulate(trajectory)
    return gnss(trajectory, **arguments)


def _check_fixes(aiding: Aiding, outages: Sequence[Outage]) -> None:
    """Refuse a study of integrated navigation without fixes, or an outage that takes none away."""
    total = sum(each.time.size for each in aiding.fixes)
    if not total:
        raise InputError(
            "gnss: there is no fix: give position_sd or velocity_sd, and an interval below the "
            "duration"
        )
    for outage in outages:
        if sum(each.time.size for each in aiding.without([outage]).fixes) == total:
            raise InputError(
                f"outages: no fix falls into that from {outage.start:g} s to {outage.end:g} s: "
                "make it longer than the interval of the fixes"
            )


def _initial_sd(content: Any) -> InitialSd:
    units = {"position": "m", "velocity": "m/s", "tilt": "rad", "heading": "rad"}
    content = mapping("initial_sd", content, list(units))
    found = {
        name: positive(each, units[name], f"initial_sd, {name}") for name, each in content.items()
    }
    return InitialSd(**found)


def _source(
    given: Any, trajectory: Trajectory, folder: Path
) -> tuple[ErrorSource, SensorModels | None]:
    """Where errors come from, and their models if they are simulated."""
    if isinstance(given, Mapping) and "recordings" in given:
        return _recorded(mapping("truth", given, _OF_RECORDINGS), trajectory, folder), None
    models = read_models("truth", given, folder)
    return Simulated(models), models


def _recorded(given: Mapping[str, Any], trajectory: Trajectory, folder: Path) -> Recorded:
    names = given.get("recordings", ())
    names = [names] if isinstance(names, str) else names
    if not isinstance(names, Sequence) or not all(isinstance(name, str) for name in names):
        raise InputError(f"truth, recordings: {checks.shown(names)}: write [file, ...]")
    options = reading_options("truth", given)
    source = Recorded.of([read(folder / name, **options) for name in names], trajectory.duration)
    if abs(trajectory.dt / source.dt - 1.0) > _SAME_RATE:
        raise InputError(
            f"truth: {source.source} has {1.0 / source.dt:g} Hz and the trajectory "
            f"{1.0 / trajectory.dt:g} Hz: give a trajectory of the recordings' rate"
        )
    return source


def reading_options(where: str, content: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of `gmwm.read` from the keys rate, units, channels and time.

    Raises
    ------
    InputError
        If one is of a wrong type.
    """
    options: dict[str, Any] = {}
    if "rate" in content:
        options["rate"] = positive(content["rate"], "Hz", f"{where}, rate")
    for name, example in (("units", "{gyro: deg/s, accel: g}"), ("channels", "{gyro_x: wx}")):
        if name in content:
            if not isinstance(content[name], Mapping):
                raise InputError(f"{where}, {name}: {checks.shown(content[name])}: write {example}")
            options[name] = dict(content[name])
    if "time" in content:
        column = content["time"]
        off = column == "none" or column is False
        if not off and (isinstance(column, bool) or not isinstance(column, str | int)):
            raise InputError(f"{where}, time: {checks.shown(column)}: write a column, or none")
        options["time"] = False if off else column
    for name, each in options.get("units", {}).items():
        if not isinstance(each, str):
            raise InputError(f"{where}, units, {name}: {checks.shown(each)}: write deg/s, g, ...")
    for name, each in options.get("channels", {}).items():
        if isinstance(each, bool) or not isinstance(each, str | int):
            raise InputError(f"{where}, channels, {name}: {checks.shown(each)}: write a column")
    return options


def read_models(where: str, given: Any, folder: Path) -> SensorModels:
    """Sensor models from the name of a calibration.json or from what the document says.

    Parameters
    ----------
    where : str
        For messages.
    given : str or mapping
    folder : Path
        That a name is relative to.

    Raises
    ------
    InputError
        If it is neither, or lacks an axis.
    """
    if isinstance(given, str):
        try:
            calibration = load(folder / given)
        except InputError as error:
            raise InputError(f"{where}: {error}") from None
        except ValueError:  # a null character in the name
            raise InputError(f"{where}: {checks.shown(given)} is no path: check it") from None
        try:
            return SensorModels.of(calibration)
        except InputError as error:
            raise InputError(f"{where}, {given}: {error}") from None
    if isinstance(given, Mapping):
        return sensor_models(given, where)
    raise InputError(f"{where}: {checks.shown(given)}: give a calibration.json, or models")


@dataclass(frozen=True, eq=False)
class _Believed:
    """What the filters' models may refer to."""

    truth: SensorModels | None
    source: ErrorSource
    lengths: Sequence[float]
    dt: float
    folder: Path

    def filters(self, given: Any) -> dict[str, SensorModels]:
        if not isinstance(given, Mapping):
            raise InputError(
                f"filters: {checks.shown(given)}: write NAME: calibration.json, or NAME: with "
                "models"
            )
        found: dict[str, SensorModels] = {}
        for key, each in given.items():
            name = _name(key)
            if name in found:
                raise InputError(f"filters: {name!r} is there twice: give each a name of its own")
            found[name] = self._models(f"filter {name}", each)
        return found

    def _models(self, where: str, given: Any) -> SensorModels:
        models = self._given(where, given)
        try:
            SensorStates.of(models, self.dt, 1)
        except InputError as error:
            raise InputError(f"{where}, {error}") from None
        return models

    def _given(self, where: str, given: Any) -> SensorModels:
        if given == "truth":
            if self.truth is None:
                raise InputError(f"{where}: real errors have no true model: give a calibration")
            return self.truth
        if isinstance(given, Mapping) and "reduce" in given:
            return self._reduced(where, mapping(where, given, ("reduce", "of")))
        models = read_models(where, given, self.folder)
        return _with_bias(models, self.source) if isinstance(self.source, Recorded) else models

    def _reduced(self, where: str, given: Mapping[str, Any]) -> SensorModels:
        of = given.get("of", "truth")
        full = self.truth if of == "truth" else read_models(where, of, self.folder)
        if full is None:
            raise InputError(f"{where}: say what is reduced, as in of: calibration.json")
        checks.choice(f"{where}, reduce", given.get("reduce"), list(FORMS))
        lengths = {round(length / self.dt) * self.dt for length in self.lengths}
        try:
            return reduce(
                full, given["reduce"], sorted(lengths) or (10.0, 30.0, 60.0), dt=self.dt
            ).models
        except InputError as error:
            raise InputError(f"{where}, {error}") from None


def _name(key: Any) -> str:
    """The name of a filter, as tables and figures can show it."""
    name = str(key)
    if not name.strip() or not name.isprintable() or len(name) > _LONGEST_NAME:
        raise InputError(
            f"filters: {name[:_LONGEST_NAME]!r} is no name: write 1 to "
            f"{_LONGEST_NAME} characters that can be printed"
        )
    return name


def _with_bias(models: SensorModels, source: Recorded) -> SensorModels:
    """Models for real errors: a random walk does not start at zero in the middle of a recording."""
    walks = {
        axis: source.bias_sd[axis]
        for axis, model in models.models.items()
        if models.bias_sd[axis] == 0.0 and any(t.is_walk for t in model.terms)
    }
    return replace(models, bias_sd={**models.bias_sd, **walks})
