"""The main job: a recording in, an error model for every channel out."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
from joblib import Parallel, delayed

from gmwm._core import checks
from gmwm._core.documents import Document, load_document
from gmwm._core.frames import frame
from gmwm._core.frozen import freeze
from gmwm._core.notices import Notice
from gmwm._core.text import wrapped
from gmwm._core.typing import Progress
from gmwm.calibration import tuning
from gmwm.calibration.departure_notices import with_departures
from gmwm.calibration.departures import Departure, departures
from gmwm.calibration.removal import variance_without
from gmwm.calibration.rest import stretches_at_rest
from gmwm.calibration.screening import SCREENING, Screened, screened, with_outcomes
from gmwm.calibration.stages import current, stage
from gmwm.calibration.summary import sentence
from gmwm.diagnosis import thinned
from gmwm.errors import InputError, MissingNameError
from gmwm.estimate import Estimate, Fit, estimate as estimated
from gmwm.process import Model, Process, model_from_list
from gmwm.readers import Channel, Recording, is_frame, read
from gmwm.selection import Selection, select, wider_ranges
from gmwm.variance import MIN_SAMPLES

if TYPE_CHECKING:
    import pandas

    from gmwm._core.forms import Form

_SPOILING = {
    "not-static": ("gyro", "accel"),
    "tilt": ("accel",),
    "rate-changes": ("gyro", "accel"),
}
"""Codes of issues of a whole recording that make the fits of some sensors invalid."""

_SPOILING_CHANNEL = frozenset({"rounding", "saturation", "stuck", "value-repeated", "variance"})
"""Codes of issues of a channel that make its fit invalid where they are bad."""

AMBIGUITY = "ambiguity"
"""Code of the notice that several models describe a channel equally well."""


@dataclass(frozen=True, repr=False)
class Calibration(Mapping[str, Fit], Document):
    """Error models of the channels of a recording: a mapping of their names to `Fit`.

    Attributes
    ----------
    fits : dict
        Channel name -> `Fit`.
    skipped : dict
        Channel name -> `Notice` of why it has none.
    source : str
        What was calibrated.
    rate : float
        Sampling rate, Hz; the highest, where channels have their own, which is that of ``fit.wv``.
    n : int
        Samples per channel of that rate, of all recordings.
    notices : tuple of Notice
        Those of the reader; what was found in the recording, worst first in each channel, with
        what was done about it, if it was examined; with the code "ambiguity", which models
        describe a channel equally well.
    rivals : dict
        Channel name -> the models, with their values, that describe it as well as the chosen one.
    left_out : dict
        Channel name -> samples of shocks and spikes that were left out, as pairs of the first and
        the one after the last; of a single recording.
    """

    SCHEMA: ClassVar[str] = "gmwm.calibration"
    SCHEMA_VERSION: ClassVar[int] = 2

    fits: Mapping[str, Fit]
    skipped: Mapping[str, Notice]
    source: str
    rate: float
    n: int
    notices: tuple[Notice, ...] = ()
    rivals: Mapping[str, tuple[Model, ...]] = field(default_factory=dict)
    left_out: Mapping[str, tuple[tuple[int, int], ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        freeze(self, "fits", "skipped", "rivals", "left_out")

    def __getitem__(self, name: str) -> Fit:
        if name in self.fits:
            return self.fits[name]
        why = f"it has {', '.join(self.fits)}"
        if name in self.skipped:
            why = self.skipped[name].text
        raise MissingNameError(f"the calibration has no model of channel {name!r}: {why}")

    def __iter__(self) -> Iterator[str]:
        return iter(self.fits)

    def __len__(self) -> int:
        return len(self.fits)

    @property
    def duration(self) -> float:
        """Length of the recording, s."""
        return self.n / self.rate

    @property
    def has_one_rate(self) -> bool:
        """Whether all channels have the sampling rate `rate`."""
        return not any(
            notice.code == "topics-joined" and notice.values["rates"] > 1 for notice in self.notices
        )

    @property
    def valid(self) -> bool:
        """Whether every channel has a valid fit."""
        return not self.skipped and all(fit.valid for fit in self.fits.values())

    @property
    def is_examined(self) -> bool:
        """Whether the recording was examined before the fits."""
        return any(notice.code == "length" for notice in self.notices)

    def __repr__(self) -> str:
        channels = [name if fit.valid else f"{name} (not valid)" for name, fit in self.items()]
        channels += [f"{name} (skipped)" for name in self.skipped]
        return f"<Calibration of {self.source or 'a recording'}: {', '.join(channels)}>"

    def _repr_html_(self) -> str:
        html: str = import_module("gmwm.report").fragment(self)
        return html

    def __str__(self) -> str:
        """One line a channel; ``print(cal["gyro_x"])`` shows its parameters."""
        width = max(map(len, (*self.fits, *self.skipped)), default=0)
        size = f"{self.duration:.6g} s at {self.rate:g} Hz, {self.n:,} samples a channel"
        lines = wrapped(f"{self.source or 'a recording'}: {size}", indent=2)
        for name, fit in self.items():
            verdict = "valid" if fit.valid else "NOT VALID"
            text = f"{fit.model.title()}. {sentence(fit)}"
            lines += wrapped(text, first=f"{name:<{width}}  {verdict:<9}  ", indent=2)
        for name, notice in self.skipped.items():
            lines += wrapped(f"{name}: skipped, {notice.text}", indent=2)
        counts = Counter(notice.severity for notice in self.notices)
        found = [f"{counts[key]} {key}" for key in ("bad", "warning") if counts[key]]
        if found:
            lines.append(f"notices: {', '.join(found)}")
        return "\n".join(lines)

    def to_frame(self) -> pandas.DataFrame:
        """A table of the parameters of all channels, one a row, in SI units; needs pandas."""
        rows = [
            {"channel": name, **estimate.to_dict(), "valid": fit.valid}
            for name, fit in self.fits.items()
            for estimate in fit.estimates
        ]
        return frame(rows, ("channel", *Estimate.COLUMNS, "valid"))

    # -- files ------------------------------------------------------------------------------------

    def content(self) -> dict[str, Any]:
        return {
            "source": self.source,
            "rate_hz": self.rate,
            "n": self.n,
            "notices": [notice.to_dict() for notice in self.notices],
            "skipped": {name: notice.to_dict() for name, notice in self.skipped.items()},
            "channels": {name: fit.to_dict() for name, fit in self.fits.items()},
            "rivals": {
                name: [[term.to_dict() for term in model.terms] for model in models]
                for name, models in self.rivals.items()
            },
            "left_out": {name: list(map(list, spans)) for name, spans in self.left_out.items()},
        }

    @classmethod
    def document_form(cls) -> type[Form]:
        from gmwm.calibration.form import CalibrationForm

        return CalibrationForm

    @classmethod
    def from_content(cls, content: Mapping[str, Any]) -> Self:
        return cls(
            fits={name: Fit.from_dict(item) for name, item in content["channels"].items()},
            skipped={name: Notice.from_dict(item) for name, item in content["skipped"].items()},
            source=content["source"],
            rate=content["rate_hz"],
            n=content["n"],
            notices=tuple(map(Notice.from_dict, content["notices"])),
            rivals={
                name: tuple(map(model_from_list, models))
                for name, models in content.get("rivals", {}).items()
            },
            left_out={
                name: tuple((int(start), int(stop)) for start, stop in spans)
                for name, spans in content.get("left_out", {}).items()
            },
        )

    def report(
        self,
        path: str | os.PathLike[str],
        recording: Recording | None = None,
        *,
        datasheet: str | os.PathLike[str] | None = None,
        provenance: Mapping[str, str] | None = None,
    ) -> Path:
        """Write the self-contained HTML report; see `gmwm.report.write_report`."""
        # By name: this room knows none above it, but a result shows itself.
        written: Path = import_module("gmwm.report").write_report(
            self, path, recording, datasheet=datasheet, provenance=provenance
        )
        return written


def load(path: str | os.PathLike[str]) -> Any:
    """A result from its file: `Calibration`, `Fit`, `Selection`, `Health`, whatever was saved.

    ``Calibration.load`` and its like take files of their own kind only.

    Raises
    ------
    InputError
        If the file is missing, is not JSON, or holds no result of a kind known here.
    """
    return load_document(path)


def calibrate(
    recording: Recording | Sequence[Recording] | Any,
    model: Process | Model | Mapping[str, Process | Model] | None = None,
    *,
    screening: Collection[str] = SCREENING,
    still: bool = True,
    remove_departures: bool = False,
    jobs: int = 1,
    progress: Progress | None = None,
) -> Calibration:
    """Error model of every channel of a static recording, or of several of one sensor.

    The recording is examined first: samples of shocks and spikes are left out, periodic lines and
    resonances are terms that a selected model may have, and the wavelet variances of a channel
    with outliers all over the record are robust; a channel of which each sample is written several
    times is taken at its own rate. Fits of a recording that was not static, or whose rate changed,
    are not valid, nor those of an accelerometer that was tilted. Notices report what was found and
    done. A channel that is constant, or of which more than half of the samples are missing, is
    skipped; auxiliary channels (temperature, voltage, clock) have no model. After the fit, steps,
    transients at the start and slow periods are looked for beside its noise
    (`gmwm.calibration.departures`); a fit of which they make more than a tenth of the deviation at
    some averaging time is not valid.

    Parameters
    ----------
    recording : Recording or sequence of Recording
        At rest, or with stretches at rest. Several of one sensor have one model, fitted jointly;
        see `gmwm.JointFit`. A DataFrame or an Arrow table is read with `gmwm.read`, which needs a
        column of time stamps and units in the names of the others.
    model : Process, Model or mapping, optional
        Fitted to every channel, or by channel name; by default the model of each channel is
        selected.
    screening : collection of str, optional
        Some of "events", "lines", "resonances" and "outliers"; none leaves the recording as it is,
        unexamined.
    still : bool, optional
        Whether only the stretches at rest of a log that is not static are used, as several
        recordings of one sensor (`gmwm.find_still`); else everything is taken as static.
    remove_departures : bool, optional
        Whether evident steps, transients at the start and slow periods are subtracted, the samples
        at which a step may be left out, and what is left is fitted again, three times at most; what
        their estimated sizes take of the noise is given back to the wavelet variances.
    jobs : int, optional
        Threads. One is fastest for recordings of usual length, whose fits are small steps that
        threads of one interpreter do in turns; -1 is one per core.
    progress : callable, optional
        Called as ``progress(done, total, channel)`` when work on a channel begins, and at the end.

    Returns
    -------
    Calibration

    Raises
    ------
    InputError
        If no channel can be calibrated, a mapping has no model for one, or a log that is not static
        has no stretch of ten seconds at rest.
    """
    given = _recordings(recording)
    _check_together(given)
    with stage("health"):
        if still and screening:
            given = [part for each in given for part in stretches_at_rest(each)]
        treated = [screened(part, screening) for each in given for part in each.by_rate()]
    recordings = [each.recording for each in treated]
    alive, dead, sources = _usable(treated)
    if isinstance(model, Mapping):
        for name in alive:
            model_of(name, model)
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

    def report(name: str) -> None:
        if progress is not None:
            progress(len(finished), len(alive), name)

    watch = current()

    def one(name: str) -> tuple[Fit, Selection | None] | InputError:
        report(name)
        with watch.running() if watch is not None else nullcontext():
            return estimate(name)

    def estimate(name: str) -> tuple[Fit, Selection | None] | InputError:
        try:
            channels, given_model = alive[name], model_of(name, model)
            removed: list[tuple[Departure, ...]] = [()] * len(channels)
            for rounds in range(tuning.REMOVALS + 1):
                with stage("variance"):
                    parts = [
                        variance_without(channel, gone, robust=name in robust)
                        for channel, gone in zip(channels, removed, strict=True)
                    ]
                data = parts[0] if len(parts) == 1 else parts
                selection: Selection | None = None
                with stage("model"):
                    if given_model is not None:
                        fit = estimated(given_model, data)
                    else:
                        selection = select(data, extra=offered[name])
                        fit = selection.fit
                        _ = selection.rivals  # found here, where channels are done side by side
                with stage("departures"):
                    there = [departures(fit, part) for part in parts]
                evident = [tuple(each for each in some if each.is_evident) for some in there]
                if not (remove_departures and any(evident)) or rounds == tuning.REMOVALS:
                    break
                removed = [gone + more for gone, more in zip(removed, evident, strict=True)]
            return with_departures(fit, sources[name], there, removed), selection
        except InputError as error:
            return error  # of this channel; the others go on
        finally:
            finished.append(name)

    workers = Parallel(n_jobs=jobs, prefer="threads")
    found = dict(zip(alive, workers(delayed(one)(name) for name in alive), strict=True))
    report("")
    skipped = dead | {
        name: Notice(error.code or "not-estimable", "bad", name, str(error))
        for name, error in found.items()
        if isinstance(error, InputError)
    }
    source = ", ".join(each.source for each in given)
    done = {name: item for name, item in found.items() if not isinstance(item, InputError)}
    issues = [issue for each in treated for issue in each.notices]
    spoiling = {issue.code: issue for issue in issues if issue.code in _SPOILING}
    if not still:
        spoiling.pop("not-static", None)  # as the caller says
    spoilt = {
        (issue.where, issue.code): issue
        for issue in issues
        if issue.code in _SPOILING_CHANNEL and issue.severity == "bad"
    }
    fits = {
        name: _judged(
            fitted,
            (
                *_of_sensor(fitted.wv.quantity, spoiling.values()),
                *(issue for (where, _), issue in spoilt.items() if where == name),
            ),
        )
        for name, (fitted, _) in done.items()
    }
    if not fits:
        raise InputError(f"{source or 'the recording'}: {next(iter(skipped.values())).text}")
    several = len(given) > 1
    tied = {name: each for name, (_, each) in done.items() if each is not None and each.rivals}
    notices = with_outcomes(
        _each_once(
            replace(notice, source=each.recording.source) if several else notice
            for each in treated
            for notice in each.notices
        ),
        {name: fitted.model for name, fitted in fits.items()},
        offered if model is None else {},
    )
    return Calibration(
        fits=fits,
        skipped=skipped,
        source=source,
        rate=given[0].rate,
        n=sum(each.n for each in given),
        notices=(*notices, *(ambiguity(name, each) for name, each in tied.items())),
        rivals={name: tuple(rival.model for rival in each.rivals) for name, each in tied.items()},
        left_out=_left_out(given[0], recordings[0]) if len(recordings) == 1 else {},
    )


def _recordings(given: Any) -> list[Any]:
    """What was given, as a list; frames are read."""
    alone = isinstance(given, Recording) or is_frame(given)
    return [read(each) if is_frame(each) else each for each in ([given] if alone else given)]


def _each_once(notices: Iterable[Notice]) -> list[Notice]:
    """Sensors with rates of their own share those of the reader."""
    found: list[Notice] = []
    for notice in notices:
        if notice not in found:
            found.append(notice)
    return found


def _left_out(given: Recording, screened_one: Recording) -> dict[str, tuple[tuple[int, int], ...]]:
    """The samples that screening took from a recording, by channel."""
    spans = {}
    for before, after in zip(given.channels, screened_one.channels, strict=True):
        gone = np.isnan(after.values) & ~np.isnan(before.values)
        edges = np.flatnonzero(np.diff(gone, prepend=False, append=False)).tolist()
        if edges:
            spans[before.name] = tuple(zip(edges[::2], edges[1::2], strict=True))
    return spans


def _check_together(recordings: Sequence[Recording]) -> None:
    if not recordings:
        raise InputError("there is no recording: give one at least")
    for each in recordings:
        if not isinstance(each, Recording):
            raise InputError(
                f"{checks.shown(each)} is not a recording: give what gmwm.read returns, or "
                "make one with Recording.from_arrays"
            )
    first = recordings[0]
    for other in recordings[1:]:
        for channel in other.inertial:
            known = first.get(channel.name, channel)
            if abs(known.dt / channel.dt - 1.0) > tuning.SAME_RATE:
                raise InputError(
                    f"{other.source} has {1.0 / channel.dt:g} Hz and {first.source} "
                    f"{1.0 / known.dt:g} Hz: calibrate recordings of different rates one by one"
                )


def _usable(
    treated: Sequence[Screened],
) -> tuple[dict[str, list[Channel]], dict[str, Notice], dict[str, list[str]]]:
    """Each channel in the recordings where it can be used, why others are skipped, and which."""
    interval: dict[str, float] = {}
    alive: dict[str, list[Channel]] = {}
    sources: dict[str, list[str]] = {}
    dead: dict[str, Notice] = {}
    for each in treated:
        for channel in each.recording.inertial:
            straight = (n for n in each.notices if n.code == "interpolated")
            why = next((n for n in straight if n.where == channel.name), None)
            why = why or _reason_to_skip(channel)
            if why is not None:
                dead.setdefault(channel.name, why)
            else:
                channel = replace(channel, dt=interval.setdefault(channel.name, channel.dt))
                repeated = each.repeated.get(channel.name)
                own = thinned(channel, repeated) if repeated else channel
                alive.setdefault(channel.name, []).append(own)
                sources.setdefault(channel.name, []).append(each.recording.source)
    return alive, {name: why for name, why in dead.items() if name not in alive}, sources


def _nothing_alive(recordings: Sequence[Recording], dead: Mapping[str, Notice]) -> str:
    which = "; ".join(f"{name}: {why.text}" for name, why in dead.items())
    which = which or "only auxiliary channels"
    if dead and all(why.code == "constant" for why in dead.values()):
        which = "every channel is constant"
    return (
        f"{recordings[0].source or 'the recording'}: {which}, nothing to calibrate: check the "
        "sensor and the columns"
    )


def _reason_to_skip(channel: Channel) -> Notice | None:
    """Why a channel is skipped, if it is."""
    missing = channel.missing
    if missing == channel.n:
        code, text = "all-missing", "all samples missing"
    elif missing > channel.n / 2:
        code = "mostly-missing"
        text = f"{missing:,} of {channel.n:,} samples missing, more than half"
    elif channel.is_constant:
        code, text = "constant", f"constant at {channel.mean:.6g} {channel.unit}"
    else:
        return None
    return Notice(code, "bad", channel.name, text, {"missing": missing})


def _of_sensor(quantity: str | None, spoiling: Iterable[Notice]) -> list[Notice]:
    """Those issues of the whole recording that concern a sensor."""
    return [issue for issue in spoiling if (quantity or "gyro") in _SPOILING[issue.code]]


def _judged(fitted: Fit, spoiling: Collection[Notice]) -> Fit:
    """A fit, not valid where an issue of its data makes its numbers wrong."""
    found = [Notice(each.code, "bad", "", each.text, each.values, each.action) for each in spoiling]
    return replace(fitted, notices=(*found, *fitted.notices)) if found else fitted


def model_of(
    name: str, model: Process | Model | Mapping[str, Process | Model] | None
) -> Process | Model | None:
    if not isinstance(model, Mapping):
        return model
    if name not in model:
        raise InputError(f"no model is given for channel {name!r}: add one to the mapping")
    return model[name]


def ambiguity(name: str, selection: Selection) -> Notice:
    """Which models tie, and the parameters of which that leaves less known."""
    models = [fitted.model.title() for fitted in (selection.fit, *selection.rivals)]
    text = f"{len(models)} models describe the data equally well: {'; '.join(models)}"
    wider = wider_ranges(selection.fit, selection.ranges())
    if wider:
        text += f". If none of them is ruled out: {', '.join(wider)}"
    values = {"models": len(models)}
    return Notice(AMBIGUITY, "note", name, text, values, "the first is used")
