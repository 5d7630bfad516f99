"""How every unit of a fleet is calibrated, on this machine or another."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from inspect import signature
from pathlib import Path
from typing import Any

from gmwm import filter_numbers
from gmwm._core import checks
from gmwm._core.files import opened
from gmwm._core.jobs import ENDED
from gmwm._core.memory import OUT_OF_MEMORY
from gmwm.calibration import SCREENING, calibrate, floor, noise_density, random_walk
from gmwm.errors import InputError
from gmwm.estimate import Fit
from gmwm.issues import Notice
from gmwm.population.paths import Item
from gmwm.population.unit import DERIVED, Number, Unit
from gmwm.process import Model, as_model
from gmwm.readers import Recording, read


@dataclass(frozen=True)
class Task:
    """The calibration of a unit as a function of its recording, which can be sent to workers.

    reading: Arguments of `gmwm.read`.
    start, stop: Part of the recordings, s.
    models: Channel, sensor ("gyro", "accel") or "" for all -> fitted model; selected if empty.
    still: See `gmwm.calibrate`.
    horizon: Longest outage that N and K of a filter are for, s.
    version: Version of gmwm that all numbers come from.
    """

    reading: Mapping[str, Any]
    start: float
    stop: float | None
    models: Mapping[str, Model]
    screening: tuple[str, ...]
    still: bool
    horizon: float
    version: str

    @classmethod
    def of(cls, model: Any, horizon: float, options: Mapping[str, Any]) -> Task:
        """The task of `fleet`, with its options checked before any work."""
        from gmwm._core import __version__

        reading = dict(options)
        start, stop = reading.pop("start", 0.0), reading.pop("stop", None)
        screening, still = reading.pop("screening", SCREENING), reading.pop("still", True)
        _, *parameters = signature(read).parameters.values()
        usual = {each.name: each.default for each in parameters}
        for name in reading:
            checks.choice("argument", name, tuple(usual))
        models = model if isinstance(model, Mapping) else {} if model is None else {"": model}
        for name in screening:
            checks.choice("screening", name, SCREENING)
        for name, given in (("start", start), ("stop", 0.0 if stop is None else stop)):
            if not checks.is_number(given):
                raise InputError(f"{name} = {checks.shown(given)}: give seconds")
        return cls(
            # Options that are at their defaults do not tell one fleet from another.
            reading={k: v for k, v in reading.items() if v != usual[k] and v not in (None, (), {})},
            start=float(start),
            stop=None if stop is None else float(stop),
            models={str(name): as_model(each) for name, each in models.items()},
            screening=tuple(screening),
            still=checks.truth("still", still),
            horizon=checks.positive("horizon", horizon, "give the longest outage in seconds"),
            version=__version__,
        )

    @property
    def options(self) -> dict[str, Any]:
        """Everything but the recording that the numbers depend on, in JSON types."""
        content = {
            "reading": dict(self.reading),
            "start": self.start,
            "stop": self.stop,
            "models": {
                name: [term.to_dict() for term in model.terms]
                for name, model in self.models.items()
            },
            "screening": sorted(self.screening),
            "still": self.still,
            "horizon": self.horizon,
            "version": self.version,
        }
        return dict(json.loads(json.dumps(content)))

    def __call__(self, item: Item) -> Unit:
        """Calibrate a unit; a failure becomes its result and costs no other unit anything."""
        try:
            return self._calibrated(item)
        except InputError as error:
            return _failed(item, error.code or "not-calibrated", str(error))
        except MemoryError:
            return _failed(item, "memory", OUT_OF_MEMORY)
        except Exception as error:
            text = f"{type(error).__name__}: {checks.line(str(error))}"
            return _failed(item, "unexpected", text)

    def lost(self, item: Item) -> Unit:
        """The result for a recording whose worker processes end."""
        text = f"{ENDED} processes ended at it: it may need more memory than there is"
        return _failed(item, "worker-lost", text)

    def _calibrated(self, item: Item) -> Unit:
        from gmwm._core import __version__

        if __version__ != self.version:
            raise InputError(
                f"the worker has gmwm {__version__}, and numbers of {self.version} are asked for: "
                "install the same version on all machines"
            )
        before, digest = _state(item.path), digest_of(item.path)
        recording = read(item.path, **self.reading).part(self.start, self.stop)
        calibration = calibrate(
            recording, self._models(recording), screening=self.screening, still=self.still, jobs=1
        )
        if _state(item.path) != before:
            raise InputError(
                f"{item.path}: changed while it was calibrated: calibrate it again with resume",
                "recording-changed",
            )
        numbers = {name: _numbers(fit, self.horizon) for name, fit in calibration.items()}
        return Unit(item.path, item.name, calibration, numbers, digest)

    def _models(self, recording: Recording) -> dict[str, Model] | None:
        if not self.models:
            return None
        found = {}
        for name in (channel.name for channel in recording.inertial):
            keys = [key for key in (name, name.partition("_")[0], "") if key in self.models]
            if keys:
                found[name] = self.models[keys[0]]
        return found


def _failed(item: Item, code: str, text: str) -> Unit:
    return Unit(item.path, item.name, Notice(code, "bad", item.name, text))


def _state(path: str) -> list[tuple[int, int]]:
    """Size and time of change of a file, or of the files of a folder."""
    try:
        parts = sorted(Path(path).iterdir()) if os.path.isdir(path) else [Path(path)]
        return [(each.stat().st_size, each.stat().st_mtime_ns) for each in parts]
    except (OSError, ValueError):  # the digest reports why
        return []


def digest_of(path: str) -> str:
    """SHA-256 of a file, or of the files of a folder such as a bag of ROS 2.

    Raises InputError if it cannot be read.
    """
    try:
        if not os.path.isdir(path):
            with opened(path) as stream:
                return hashlib.file_digest(stream, "sha256").hexdigest()
        files = [each for each in sorted(Path(path).iterdir()) if each.is_file()]
        parts = [f"{each.name} {digest_of(str(each))}\n" for each in files]
    except (OSError, ValueError) as error:  # ValueError: a null character in the name
        why = error.strerror if isinstance(error, OSError) else str(error)
        raise InputError(f"{path}: cannot be read ({why}): check the path") from None
    return hashlib.sha256("".join(parts).encode(errors="surrogateescape")).hexdigest()


def _numbers(fit: Fit, horizon: float) -> dict[str, Number]:
    """The numbers of `DERIVED` that a fit gives."""
    found: dict[str, Number] = {}
    try:
        bound = filter_numbers.bound(fit, horizon=horizon)
        for letter, value, level in (("N", bound.N, noise_density), ("K", bound.K, random_walk)):
            found[f"filter_{letter}"] = (
                Number(value, bound.stderr.get(letter), True)
                if value > 0.0
                else Number(level(fit).value, None, False)
            )
    except InputError:
        pass  # no white noise and random walk bound this model
    low = floor(fit)
    found["floor_B"] = Number(low.bias_instability, None, not low.falls)
    return {name: found[name] for name in DERIVED if name in found}
