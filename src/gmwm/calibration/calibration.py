"""The main job: a recording in, an error model for every channel out."""

from __future__ import annotations

import json
import os
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any

from joblib import Parallel, delayed

from gmwm._core import checks
from gmwm._core.files import written
from gmwm._core.typing import Progress
from gmwm.calibration.screening import REMEDIES, remedied, told_of_terms
from gmwm.diagnosis import Finding
from gmwm.errors import InputError, MissingNameError
from gmwm.estimate import Fit, estimate
from gmwm.process import Model, Process
from gmwm.readers import Channel, Recording
from gmwm.selection import Selection, select, wider_ranges
from gmwm.variance import MIN_SAMPLES, wavelet_variance

SCHEMA = "gmwm.calibration"
SCHEMA_VERSION = 1

_SAME_RATE = 1e-3
_TOLD = ("warning", "bad")
_TOLD_OTHERWISE = ("reader", "gap", "dead", "infinite", "length")


@dataclass(frozen=True)
class Calibration(Mapping[str, Fit]):
    """Error models of the channels of a recording.

    Attributes
    ----------
    fits : dict
        Channel name -> `Fit`.
    skipped : dict
        Channel name -> why it has none, one sentence.
    source : str
        What was calibrated.
    rate : float
        Sampling rate, Hz.
    n : int
        Samples per channel, of all recordings.
    notes : tuple of str
        What the reader noticed, and how many samples were left out.
    findings : tuple of Finding
        What was found in the recording, worst first in each channel, with what was done about it;
        of kind "choice", which models describe a channel equally well. Empty if it was not
        examined.
    """

    fits: dict[str, Fit]
    skipped: dict[str, str]
    source: str
    rate: float
    n: int
    notes: tuple[str, ...] = ()
    findings: tuple[Finding, ...] = ()

    def __getitem__(self, name: str) -> Fit:
        if name not in self.fits:
            why = self.skipped.get(name, f"it has {', '.join(self.fits)}")
            raise MissingNameError(f"the calibration has no model of channel {name!r}: {why}")
        return self.fits[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.fits)

    def __len__(self) -> int:
        return len(self.fits)

    @property
    def duration(self) -> float:
        """Length of the recording, s."""
        return self.n / self.rate

    @property
    def valid(self) -> bool:
        """Whether every channel has a valid fit."""
        return not self.skipped and all(fit.valid for fit in self.fits.values())

    @property
    def warnings(self) -> tuple[str, ...]:
        """Findings that spoil the estimates or may, and that neither notes nor skips tell."""
        return tuple(
            str(found if found.channel else replace(found, channel="recording"))
            for found in self.findings
            if found.severity in _TOLD and found.kind not in _TOLD_OTHERWISE
        )

    def __str__(self) -> str:
        blocks = [str(fit) for fit in self.fits.values()]
        blocks += [f"{name}: skipped, {why}" for name, why in self.skipped.items()]
        return "\n\n".join(blocks)

    # -- files ------------------------------------------------------------------------------------

    def to_dict(self) -> dict[str, Any]:
        """Everything, in JSON types; see `from_dict`."""
        return {
            "schema": SCHEMA,
            "schema_version": SCHEMA_VERSION,
            "source": self.source,
            "rate_hz": self.rate,
            "n": self.n,
            "notes": list(self.notes),
            "findings": [finding.to_dict() for finding in self.findings],
            "skipped": self.skipped,
            "channels": {name: fit.to_dict() for name, fit in self.fits.items()},
        }

    @classmethod
    def from_dict(cls, content: dict[str, Any]) -> Calibration:
        """Inverse of `to_dict`.

        Raises
        ------
        InputError
            If the content is no calibration of a schema version known here.
        """
        if not isinstance(content, dict) or content.get("schema") != SCHEMA:
            raise InputError("this is no calibration: expected a file made by gmwm calibrate")
        version = content.get("schema_version")
        if version != SCHEMA_VERSION:
            raise InputError(
                f"schema version {version!r} is not known here (known is {SCHEMA_VERSION}): "
                "calibrate again or update gmwm"
            )
        try:
            return cls(
                fits={name: Fit.from_dict(item) for name, item in content["channels"].items()},
                skipped=dict(content["skipped"]),
                source=content["source"],
                rate=float(content["rate_hz"]),
                n=int(content["n"]),
                notes=tuple(content["notes"]),
                findings=tuple(map(Finding.from_dict, content.get("findings", ()))),
            )
        except InputError as error:
            raise InputError(
                f"the calibration cannot be rebuilt ({error}): calibrate again"
            ) from None
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise InputError(f"the calibration is damaged ({error!r}): calibrate again") from None

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write everything as JSON; the file appears whole or not at all.

        Raises
        ------
        InputError
            If it cannot be written.
        """
        with written(path) as stream:
            json.dump(self.to_dict(), stream, indent=1, allow_nan=False)
            stream.write("\n")
        return Path(path)

    def report(self, path: str | os.PathLike[str]) -> Path:
        """Write the self-contained HTML report; see `gmwm.report`."""
        # By name: this room knows none above it, but a result shows itself.
        written: Path = import_module("gmwm.report").write_report(self, path)
        return written


def load(path: str | os.PathLike[str]) -> Calibration:
    """Read a calibration written by `Calibration.save`.

    Raises
    ------
    InputError
        If the file is missing, no JSON, or no calibration.
    """
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}): check the path") from None
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: is no JSON ({error}): give a calibration.json") from None
    try:
        return Calibration.from_dict(content)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def calibrate(
    recording: Recording | Sequence[Recording],
    model: Process | Model | Mapping[str, Process | Model] | None = None,
    *,
    remedies: Collection[str] = REMEDIES,
    jobs: int = 1,
    progress: Progress | None = None,
) -> Calibration:
    """Error model of every channel of a static recording, or of several of one sensor.

    The recording is examined first: samples of knocks and spikes are left out, periodic lines and
    resonances are terms that a selected model may have, and the wavelet variances of a channel
    with outliers all over the record are robust; the findings tell what was found and done. A
    channel that is constant, or of which more than half of the samples are missing, is skipped.

    Parameters
    ----------
    recording : Recording or sequence of Recording
        Several of one sensor have one model, fitted jointly; see `gmwm.JointFit`.
    model : Process, Model or mapping, optional
        Fitted to every channel, or by channel name; by default the model of each channel is
        selected.
    remedies : collection of str, optional
        Some of "events", "lines", "resonances" and "outliers"; none leaves the recording as it is,
        unexamined.
    jobs : int, optional
        Threads. One is fastest for recordings of usual length, whose fits are small steps that
        threads of one interpreter take in turns; -1 is one per core.
    progress : callable, optional
        Called as ``progress(done, total, channel)`` when work on a channel begins, and at the end.

    Returns
    -------
    Calibration

    Raises
    ------
    InputError
        If no channel can be calibrated, or a mapping has no model for one.
    """
    given = [recording] if isinstance(recording, Recording) else list(recording)
    _check_together(given)
    treated = [remedied(each, remedies) for each in given]
    recordings = [each.recording for each in treated]
    alive, dead = _usable(recordings)
    if isinstance(model, Mapping):
        for name in alive:
            _model_of(name, model)
    if not alive:
        raise InputError(_nothing_alive(recordings, dead))
    for each in recordings:
        if each.n < MIN_SAMPLES:
            raise InputError(f"{each.n} samples are too few: record at least {MIN_SAMPLES}")

    offered = {
        name: next((e.extra[name] for e in treated if e.extra.get(name)), ()) for name in alive
    }
    robust = frozenset[str]().union(*(each.robust for each in treated))

    finished: list[str] = []

    def tell(name: str) -> None:
        if progress is not None:
            progress(len(finished), len(alive), name)

    def one(name: str) -> tuple[Fit, tuple[Finding, ...]] | InputError:
        tell(name)
        try:
            parts = [wavelet_variance(part, robust=name in robust) for part in alive[name]]
            data = parts[0] if len(parts) == 1 else parts
            given_model = _model_of(name, model)
            if given_model is not None:
                return estimate(given_model, data), ()
            selection = select(data, extra=offered[name])
            return selection.fit, _doubt(name, selection)
        except InputError as error:
            return error  # of this channel; the others go on
        finally:
            finished.append(name)

    workers = Parallel(n_jobs=jobs, prefer="threads")
    found = dict(zip(alive, workers(delayed(one)(name) for name in alive), strict=True))
    tell("")
    skipped = dead | {
        name: str(error) for name, error in found.items() if isinstance(error, InputError)
    }
    source = ", ".join(each.source for each in recordings)
    done = {name: item for name, item in found.items() if not isinstance(item, InputError)}
    fits = {name: fitted for name, (fitted, _) in done.items()}
    if not fits:
        raise InputError(f"{source or 'the recording'}: {next(iter(skipped.values()))}")
    several = len(recordings) > 1
    findings = told_of_terms(
        [
            replace(finding, recording=each.recording.source) if several else finding
            for each in treated
            for finding in each.findings
        ],
        {name: fitted.model for name, fitted in fits.items()},
        offered if model is None else {},
    )
    return Calibration(
        fits=fits,
        skipped=skipped,
        source=source,
        rate=recordings[0].rate,
        n=sum(each.n for each in recordings),
        notes=tuple(
            f"{each.source}: {note}" if several else note
            for each in recordings
            for note in each.notes
        ),
        findings=(*findings, *(finding for _, doubts in done.values() for finding in doubts)),
    )


def _check_together(recordings: Sequence[Recording]) -> None:
    if not recordings:
        raise InputError("there is no recording: give one at least")
    for each in recordings:
        if not isinstance(each, Recording):
            raise InputError(
                f"{checks.shown(each)} is no recording: give what gmwm.read returns, or make one "
                "with Recording.from_arrays"
            )
    first = recordings[0]
    for other in recordings[1:]:
        if abs(other.rate / first.rate - 1.0) > _SAME_RATE:
            raise InputError(
                f"{other.source} has {other.rate:g} Hz and {first.source} {first.rate:g} Hz: "
                "calibrate recordings of different rates one by one"
            )


def _usable(recordings: Sequence[Recording]) -> tuple[dict[str, list[Channel]], dict[str, str]]:
    """Each channel in the recordings where it can be used, and why others are skipped."""
    rate = recordings[0].rate
    alive: dict[str, list[Channel]] = {}
    dead: dict[str, str] = {}
    for recording in recordings:
        for channel in recording:
            why = _reason_to_skip(channel)
            if why:
                dead.setdefault(channel.name, why)
            else:
                alive.setdefault(channel.name, []).append(replace(channel, dt=1.0 / rate))
    return alive, {name: why for name, why in dead.items() if name not in alive}


def _nothing_alive(recordings: Sequence[Recording], dead: Mapping[str, str]) -> str:
    which = "; ".join(f"{name}: {why}" for name, why in dead.items())
    if all(c.is_constant and c.is_complete for recording in recordings for c in recording):
        which = "every channel is constant"
    return (
        f"{recordings[0].source or 'the recording'}: {which}, nothing to calibrate: check the "
        "sensor and the columns"
    )


def _reason_to_skip(channel: Channel) -> str:
    """Why a channel is skipped; empty if it is not."""
    missing = channel.missing
    if missing == channel.n:
        return "all samples missing"
    if missing > channel.n / 2:
        return f"{missing:,} of {channel.n:,} samples missing, more than half"
    return f"constant at {channel.mean:.6g} {channel.unit}" if channel.is_constant else ""


def _model_of(
    name: str, model: Process | Model | Mapping[str, Process | Model] | None
) -> Process | Model | None:
    if not isinstance(model, Mapping):
        return model
    if name not in model:
        raise InputError(f"no model is given for channel {name!r}: add one to the mapping")
    return model[name]


def _doubt(name: str, selection: Selection) -> tuple[Finding, ...]:
    """Which models tie, and the parameters of which that leaves less known."""
    if not selection.rivals:
        return ()
    models = [fitted.model.title() for fitted in (selection.fit, *selection.rivals)]
    text = f"{len(models)} models describe the data equally well: {'; '.join(models)}"
    wider = wider_ranges(selection.fit, selection.ranges())
    if wider:
        text += f". If none of them is ruled out: {', '.join(wider)}"
    return (Finding(name, "choice", "note", text, "the first is used"),)
