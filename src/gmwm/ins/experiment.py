"""A validation by navigating, as it is written in a YAML file or in flags."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from gmwm import checks
from gmwm.calibration import load
from gmwm.errors import InputError
from gmwm.ins import missions
from gmwm.ins.aiding import Aiding, Outage, gnss
from gmwm.ins.emulation import emulate
from gmwm.ins.filter import InitialSd
from gmwm.ins.model_text import sensor_models, value
from gmwm.ins.monte_carlo import ErrorSource, Scenario, Simulated
from gmwm.ins.recorded import Recorded
from gmwm.ins.reduction import FORMS, reduce
from gmwm.ins.sensors import SensorModels
from gmwm.ins.trajectory import Trajectory
from gmwm.process import RandomWalk
from gmwm.readers import read

MISSIONS: dict[str, Callable[..., Trajectory]] = {
    "helicopter": missions.helicopter_mapping,
    "car": missions.car_drive,
    "loiter": missions.fixed_wing_loiter,
}
"""Ready-made trajectories by name."""

_KNOWN = ("trajectory", "duration", "rate", "truth", "filters", "outages", "gnss", "initial_sd",
          "runs", "seed")  # fmt: skip
_OF_GNSS = ("interval", "position_sd", "velocity_sd", "lever_arm", "coloured_sd", "coloured_tau")
_OF_RECORDINGS = ("recordings", "rate", "units", "channels", "time")


@dataclass(frozen=True, eq=False)
class Experiment:
    """All that a validation needs.

    Attributes
    ----------
    scenario : Scenario
    source : ErrorSource
    filters : dict
        Name -> `SensorModels`.
    truth : SensorModels or None
        The models that errors are drawn from; ``None`` for real ones.
    runs, seed : int
    title : str
    """

    scenario: Scenario
    source: ErrorSource
    filters: dict[str, SensorModels]
    truth: SensorModels | None
    runs: int = 100
    seed: int = 0
    title: str = ""

    @classmethod
    def of(cls, content: Mapping[str, Any], folder: Path = Path()) -> Experiment:
        """From the content of a file.

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
        if not isinstance(content, Mapping):
            raise InputError("the experiment is no mapping: write trajectory:, truth:, filters:")
        _known("the experiment", content, _KNOWN)
        for name in ("trajectory", "truth", "filters"):
            if not content.get(name):
                raise InputError(f"the experiment has no {name}: add one")
        trajectory = _trajectory(content, folder)
        outages = tuple(_outage(each) for each in content.get("outages") or ())
        scenario = Scenario(
            trajectory,
            _aiding(content.get("gnss") or {}, trajectory),
            outages,
            _initial_sd(content.get("initial_sd") or {}),
        )
        source, truth = _source(content["truth"], trajectory, folder)
        filters = content["filters"]
        if not isinstance(filters, Mapping):
            raise InputError("filters: write NAME: calibration.json, or NAME: with models")
        lengths = [outage.duration for outage in outages]
        return cls(
            scenario=scenario,
            source=source,
            filters={
                str(name): _filter(str(name), each, truth, source, lengths, folder)
                for name, each in filters.items()
            },
            truth=truth,
            runs=checks.whole("runs", content.get("runs", 100), 1),
            seed=checks.whole("seed", content.get("seed", 0), 0),
            title=str(content["trajectory"]),
        )


def read_experiment(path: Path) -> Mapping[str, Any]:
    """Content of a YAML file.

    Raises
    ------
    InputError
        If it cannot be read or is no YAML.
    """
    import yaml

    try:
        return yaml.safe_load(path.read_text(encoding="utf-8")) or {}
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}): check the path") from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        first = " ".join(str(error).split())
        raise InputError(f"{path}: is no YAML ({first}): mend it") from None


def _known(where: str, content: Mapping[str, Any], names: Sequence[str]) -> None:
    for name in content:
        if name not in names:
            raise InputError(f"{where}: {checks.shown(name)} is unknown: there are "
                             f"{', '.join(names)}")  # fmt: skip


def _trajectory(content: Mapping[str, Any], folder: Path) -> Trajectory:
    name = str(content["trajectory"])
    duration = content.get("duration")
    if name in MISSIONS:
        arguments = {}
        if duration is not None:
            arguments["duration"] = checks.positive("duration", duration)
        if "rate" in content:
            arguments["dt"] = 1.0 / checks.positive("rate", content["rate"])
        return MISSIONS[name](**arguments)
    if not (folder / name).exists():
        raise InputError(
            f"trajectory {name!r} is no file, and none of {', '.join(MISSIONS)}: check the name"
        )
    if "rate" in content:
        raise InputError("rate: a trajectory from a file has its own: leave it out")
    trajectory = Trajectory.read(folder / name)
    return trajectory if duration is None else trajectory.segment(0.0, duration)


def _outage(given: Any) -> Outage:
    if not isinstance(given, Sequence) or isinstance(given, str) or len(given) != 2:
        raise InputError(f"outages: {checks.shown(given)}: write [start, length] in seconds")
    start, duration = (value(each, "s", "outages") for each in given)
    return Outage(start, duration)


def _aiding(content: Mapping[str, Any], trajectory: Trajectory) -> Aiding:
    _known("gnss", content, _OF_GNSS)
    given: dict[str, Any] = {
        name: None if each == "none" else each for name, each in content.items()
    }
    if np.any(given.get("lever_arm") or 0.0):
        given["imu"] = emulate(trajectory)
    return gnss(trajectory, **given)


def _initial_sd(content: Mapping[str, Any]) -> InitialSd:
    units = {"position": "m", "velocity": "m/s", "tilt": "rad", "heading": "rad"}
    _known("initial_sd", content, list(units))
    found = {
        name: value(each, units[name], f"initial_sd, {name}") for name, each in content.items()
    }
    return InitialSd(**found)


def _source(
    given: Any, trajectory: Trajectory, folder: Path
) -> tuple[ErrorSource, SensorModels | None]:
    """Where errors come from, and their models if they are simulated."""
    if isinstance(given, Mapping) and "recordings" in given:
        _known("truth", given, _OF_RECORDINGS)
        names = given["recordings"]
        names = [names] if isinstance(names, str) else names
        options = {name: given[name] for name in _OF_RECORDINGS[1:] if name in given}
        recordings = [read(folder / name, **options) for name in names]
        return Recorded.of(recordings, trajectory.duration), None
    models = _models("truth", given, folder)
    return Simulated(models), models


def _models(where: str, given: Any, folder: Path) -> SensorModels:
    if isinstance(given, str):
        return SensorModels.of(load(folder / given))
    if isinstance(given, Mapping):
        return sensor_models(given, where)
    raise InputError(f"{where}: {checks.shown(given)}: give a calibration.json, or models")


def _filter(
    name: str,
    given: Any,
    truth: SensorModels | None,
    source: ErrorSource,
    lengths: Sequence[float],
    folder: Path,
) -> SensorModels:
    where = f"filter {name}"
    if given == "truth":
        if truth is None:
            raise InputError(f"{where}: real errors have no true model: give a calibration")
        return truth
    if isinstance(given, Mapping) and "reduce" in given:
        _known(where, given, ("reduce", "of"))
        full = _models(where, given["of"], folder) if "of" in given else truth
        if full is None:
            raise InputError(f"{where}: say what is reduced, as in of: calibration.json")
        checks.choice(f"{where}, reduce", given["reduce"], list(FORMS))
        return reduce(full, given["reduce"], sorted(set(lengths)) or (10.0, 30.0, 60.0)).models
    models = _models(where, given, folder)
    return _with_bias(models, source) if isinstance(source, Recorded) else models


def _with_bias(models: SensorModels, source: Recorded) -> SensorModels:
    """Models for real errors: a random walk does not start at zero in the middle of a recording."""
    walks = {
        axis: source.bias_sd[axis]
        for axis, model in models.models.items()
        if models.bias_sd[axis] == 0.0 and any(isinstance(t, RandomWalk) for t in model.terms)
    }
    return replace(models, bias_sd={**models.bias_sd, **walks})
