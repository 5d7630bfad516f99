"""One unit of a fleet: what it takes to calibrate it, and what came of it."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from gmwm import filter_numbers
from gmwm._core import checks
from gmwm._core.files import opened
from gmwm._core.frozen import freeze
from gmwm._core.memory import OUT_OF_MEMORY
from gmwm._core.notices import Notice
from gmwm._core.runs import ENDED
from gmwm.calibration import Calibration, calibrate, floor, noise_density, random_walk
from gmwm.errors import InputError
from gmwm.estimate import Fit
from gmwm.process import Model
from gmwm.readers import Recording, read

DERIVED = {"filter_N": "u/sqrt(Hz)", "filter_K": "u/s/sqrt(Hz)", "floor_B": "u"}
"""Numbers that units of every structure have, and their units: the N and K that bound a unit for
the horizon (`gmwm.bound`), and the bias instability at the lowest point of its curve."""


class Number(NamedTuple):
    """A number that was derived from a fit.

    value: SI.
    found: Else it is an upper bound: of 95 %, or the end of a curve that still falls.
    """

    value: float
    stderr: float | None
    found: bool


class Item(NamedTuple):
    """A recording that is to be calibrated, and what its unit is called."""

    path: str
    name: str


@dataclass(frozen=True)
class Unit:
    """A unit of a fleet.

    path: Of its recording.
    name: Short, and its own in the fleet.
    result: Or why there is none.
    numbers: Channel -> one of `DERIVED` -> `Number`.
    digest: SHA-256 of the recording; empty where it cannot be read.
    """

    path: str
    name: str
    result: Calibration | Notice
    numbers: Mapping[str, Mapping[str, Number]] = field(default_factory=dict)
    digest: str = ""

    def __post_init__(self) -> None:
        freeze(self, "numbers")

    @property
    def valid(self) -> bool:
        """Whether a channel has a valid model."""
        return isinstance(self.result, Calibration) and any(
            fit.valid for fit in self.result.values()
        )


@dataclass(frozen=True)
class Task:
    """How every unit is calibrated; as a function it does so, on whatever machine.

    reading: Arguments of `gmwm.read`.
    start, stop: Part of the recordings, s.
    models: Channel, sensor ("gyro", "accel") or "" for all -> what is fitted; selected if empty.
    still: See `gmwm.calibrate`.
    horizon: Of the N and K of a filter, s.
    version: Of the program that numbers are to be from.
    """

    reading: Mapping[str, Any]
    start: float
    stop: float | None
    models: Mapping[str, Model]
    screening: tuple[str, ...]
    still: bool
    horizon: float
    version: str

    @property
    def options(self) -> dict[str, Any]:
        """All that numbers depend on beside the recording, in JSON types."""
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
        try:
            return self._done(item)
        except InputError as error:
            return _failed(item, error.code or "not-calibrated", str(error))
        except MemoryError:
            return _failed(item, "memory", OUT_OF_MEMORY)
        except Exception as error:  # one recording may cost itself, never the others
            text = f"{type(error).__name__}: {checks.line(str(error))}"
            return _failed(item, "unexpected", text)

    def lost(self, item: Item) -> Unit:
        """What is reported of a recording at which processes end."""
        text = f"{ENDED} processes ended at it: it may need more memory than there is"
        return _failed(item, "worker-lost", text)

    def _done(self, item: Item) -> Unit:
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
        return Unit(
            path=item.path,
            name=item.name,
            result=calibration,
            numbers={name: _numbers(fit, self.horizon) for name, fit in calibration.items()},
            digest=digest,
        )

    def _models(self, recording: Recording) -> dict[str, Model] | None:
        if not self.models:
            return None
        found = {}
        for channel in recording.inertial:
            name = channel.name
            keys = [key for key in (name, name.partition("_")[0], "") if key in self.models]
            if keys:
                found[name] = self.models[keys[0]]
        return found


def _failed(item: Item, code: str, text: str) -> Unit:
    return Unit(item.path, item.name, Notice(code, "bad", item.name, text))


def _state(path: str) -> list[tuple[int, int]]:
    """Size and time of change of a file, or of those of a folder."""
    try:
        parts = sorted(Path(path).iterdir()) if os.path.isdir(path) else [Path(path)]
        return [(each.stat().st_size, each.stat().st_mtime_ns) for each in parts]
    except (OSError, ValueError):  # hashing it says why
        return []


def digest_of(path: str) -> str:
    """SHA-256 of a file, or of the files of a folder, which a bag of ROS 2 is.

    Raises InputError if it cannot be read.
    """
    try:
        if not os.path.isdir(path):
            with opened(path) as stream:
                return hashlib.file_digest(stream, "sha256").hexdigest()
        parts = [f"{each.name} {digest_of(str(each))}\n"
                 for each in sorted(Path(path).iterdir()) if each.is_file()]  # fmt: skip
    except (OSError, ValueError) as error:  # ValueError: a null character in the name
        why = error.strerror if isinstance(error, OSError) else str(error)
        raise InputError(f"{path}: cannot be read ({why}): check the path") from None
    return hashlib.sha256("".join(parts).encode(errors="surrogateescape")).hexdigest()


def _numbers(fit: Fit, horizon: float) -> dict[str, Number]:
    """Those of `DERIVED` that a fit gives."""
    low = floor(fit)
    found = {"floor_B": Number(low.bias_instability, None, not low.falls)}
    try:
        numbers = filter_numbers.bound(fit, horizon=horizon)
        for letter, value, level in (
            ("N", numbers.N, noise_density), ("K", numbers.K, random_walk),
        ):  # fmt: skip
            if value > 0.0:
                number = Number(value, numbers.stderr.get(letter), True)
            else:
                number = Number(level(fit).value, None, False)
            found[f"filter_{letter}"] = number
    except InputError:
        pass  # no filter of white noise and a random walk bounds it
    return {name: found[name] for name in DERIVED if name in found}
