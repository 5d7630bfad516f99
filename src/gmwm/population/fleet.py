"""`fleet`: many units of a sensor, each calibrated by itself, and what they have in common."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import closing, nullcontext
from dataclasses import dataclass
from functools import cached_property
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow as pa
import pyarrow.parquet as pq

from gmwm._core import checks
from gmwm._core.files import moved_together, replaceable
from gmwm._core.frames import frame
from gmwm._core.frozen import freeze
from gmwm._core.jobs import results
from gmwm._core.notices import Notice
from gmwm._core.pages import make
from gmwm._core.text import bullets, per_cent, wrapped
from gmwm._core.typing import Progress
from gmwm.calibration import SCREENING, Calibration
from gmwm.errors import InputError, MissingNameError
from gmwm.population import tuning
from gmwm.population.paths import OUTPUTS, Paths, recordings
from gmwm.population.spread import Spread, Structures, spreads_of, structures_of
from gmwm.population.store import Store, opened_store, read_index, write_index
from gmwm.population.task import Task
from gmwm.population.tolerance import needed_units
from gmwm.population.unit import DERIVED, SCHEMA, Row, Unit, rows_of
from gmwm.process import Model, Process, as_model
from gmwm.readers import read

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True, repr=False)
class Fleet(Mapping[str, Calibration | Notice]):
    """Units of a sensor: a mapping of paths to a `Calibration`, or to a `Notice` of why not.

    Attributes
    ----------
    units : dict
        Path -> `Unit`.
    horizon : float
        Longest outage that N and K of a filter are for, s.
    options : dict
        How every unit was calibrated.
    notices : tuple of Notice
        Which units have no calibration, and what makes units unlike each other.
    """

    units: Mapping[str, Unit]
    horizon: float
    options: Mapping[str, Any]
    notices: tuple[Notice, ...] = ()

    def __post_init__(self) -> None:
        freeze(self, "units", "options")

    def __getitem__(self, path: str) -> Calibration | Notice:
        if path not in self.units:
            raise MissingNameError(f"the fleet has no recording {checks.shown(path)}")
        return self.units[path].result

    def __iter__(self) -> Iterator[str]:
        return iter(self.units)

    def __len__(self) -> int:
        return len(self.units)

    @property
    def done(self) -> dict[str, Calibration]:
        """Units that are calibrated."""
        return {path: each for path, each in self.items() if isinstance(each, Calibration)}

    @property
    def failed(self) -> dict[str, Notice]:
        """Why the other units are not."""
        return {path: each for path, each in self.items() if isinstance(each, Notice)}

    @property
    def valid(self) -> bool:
        """Whether a unit has a valid model of a channel."""
        return any(unit.valid for unit in self.units.values())

    @cached_property
    def rows(self) -> tuple[Row, ...]:
        """Rows of the table: one per unit, channel and parameter."""
        return tuple(rows_of(self.units.values()))

    @cached_property
    def spreads(self) -> tuple[Spread, ...]:
        """How each parameter of each axis differs over the units."""
        return spreads_of(self.rows)

    @cached_property
    def structures(self) -> tuple[Structures, ...]:
        """Which models were selected, axis by axis."""
        return structures_of(self.rows)

    def __repr__(self) -> str:
        failed = f", {len(self.failed)} not" if self.failed else ""
        return f"<Fleet of {len(self)} units: {len(self.done)} calibrated{failed}>"

    def _repr_html_(self) -> str:
        html: str = make("fragment", self)
        return html

    def __str__(self) -> str:
        valid = sum(unit.valid for unit in self.units.values())
        lines = [
            f"{len(self)} units: {len(self.done)} calibrated, {valid} of them with a valid model"
        ]
        shown = [each for each in self.spreads if each.parameter in DERIVED]
        if shown:
            head = f"{'channel':<10} {'number':<9} {'units':>5} {'median':>9} {'spread':>7}"
            lines += ["", f"{head} {'limit':>9}  unit", *map(_line, shown), ""]
            lines += wrapped(
                f"filter: for outages up to {self.horizon:g} s; floor: bias instability. Limit: "
                "95 % of units are below this (95 % confidence, log-normal)."
            )
        for axis in self.structures:
            if axis.different:
                usual = next(iter(axis.counts))
                lines += bullets([
                    f"{axis.channel}: {axis.counts[usual]} of {sum(axis.counts.values())} units "
                    f"are {usual}, {axis.different} have another structure"
                ])  # fmt: skip
            if axis.invalid:
                lines += bullets([f"{axis.channel}: not valid in {_some(axis.invalid)}"])
        lines += bullets(
            f"{outlier.device} stands apart in {each.parameter} of {each.channel}: "
            f"{outlier.value / each.median:.3g} times the median"
            for each in self.spreads
            for outlier in each.outliers
        )
        return "\n".join(lines + bullets(self.notices))

    def to_frame(self) -> pandas.DataFrame:
        """A row per unit, channel and parameter, in SI units; needs pandas."""
        return frame(self.rows, SCHEMA.names)

    def to_dict(self) -> dict[str, Any]:
        """The table and the notices, in JSON types."""
        return {
            "schema": "gmwm.fleet",
            "schema_version": 1,
            "horizon_s": self.horizon,
            "options": dict(self.options),
            "rows": [dict(row) for row in self.rows],
            "notices": [notice.to_dict() for notice in self.notices],
        }

    def report(self, path: str | os.PathLike[str]) -> Path:
        """Write the self-contained HTML report; see `gmwm.report.write_fleet_report`."""
        written: Path = make("page", self, path)
        return written

    def save(self, folder: str | os.PathLike[str]) -> Path:
        """Write what `fleet` writes: calibrations, the table (Parquet) and the report.

        Raises
        ------
        InputError
            If the folder cannot be written, is in use, or holds calibrations.
        """
        with opened_store(Path(folder), self.options, resume=False) as store:
            for unit in self.units.values():
                store.save(unit)
            self._conclude(store)
        return Path(folder)

    @classmethod
    def load(cls, folder: str | os.PathLike[str]) -> Fleet:
        """The fleet that `gmwm.fleet` or `save` wrote into a folder.

        Raises
        ------
        InputError
            If the folder holds no finished fleet, or one of its files is damaged.
        """
        units, horizon, options, notices = read_index(Path(folder))
        return cls({unit.path: unit for unit in units}, horizon, options, tuple(notices))

    def _conclude(self, store: Store) -> None:
        """Write the table, the report and the list of units, all or none."""
        _, table, page, index = OUTPUTS
        with moved_together(store.folder) as new:
            pq.write_table(pa.Table.from_pylist(list(self.rows), schema=SCHEMA), new / table)
            self.report(new / page)
            units = self.units.values()
            write_index(new / index, units, self.horizon, self.options, self.notices)


def _line(spread: Spread) -> str:
    """A line of the printed table."""
    unit, scale = spread.field_unit
    known = spread.sd >= 0.0
    sd = per_cent(spread.sd, 3) if known else "-"
    limit = f"{spread.normal_limit * scale:.4g}" if known else "-"
    return (
        f"{spread.channel:<10} {spread.parameter:<9} {spread.n:>5} {spread.median * scale:>9.4g} "
        f"{sd:>7} {limit:>9}  {unit}"
    )


def _some(names: Sequence[str]) -> str:
    """The first names of a list."""
    return ", ".join(names[:5]) + (", ..." if len(names) > 5 else "")


def fleet(
    paths: Paths,
    model: Process | Model | Mapping[str, Process | Model] | None = None,
    *,
    screening: Collection[str] = SCREENING,
    still: bool = True,
    horizon: float = 60.0,
    start: float = 0.0,
    stop: float | None = None,
    folder: str | os.PathLike[str] | None = None,
    resume: bool = False,
    jobs: int = 1,
    cluster: str | None = None,
    progress: Progress | None = None,
    **reading: Any,
) -> Fleet:
    """Calibrate many units of a sensor, one recording of each.

    A recording that cannot be used is reported and costs the others nothing. For several recordings
    of one unit use `gmwm.calibrate`.

    Parameters
    ----------
    paths : path, pattern or iterable of them
        The recordings; a pattern is as in ``"lot-7/**/*.csv"``.
    model : Process, Model or mapping, optional
        Fitted to every channel, or by channel or sensor ("gyro", "accel"); selected by default.
    screening, still
        See `gmwm.calibrate`.
    horizon : float, optional
        Longest outage that N and K of a filter are for, s; see `gmwm.bound`.
    start, stop : float, optional
        Part of each recording, s.
    folder : path, optional
        Where each calibration is kept as soon as it is done, and the table (``fleet.parquet``) and
        the report (``fleet.html``) at the end; see `Fleet.load`.
    resume : bool, optional
        Go on with what the folder holds: recordings that have not changed are not calibrated again.
    jobs : int, optional
        Processes on this machine; -1 for one a core.
    cluster : str, optional
        Address of a Dask scheduler that does the work instead. Its workers read the recordings.
    progress : callable, optional
        Called as ``progress(done, total, "")``.
    **reading
        Arguments of `gmwm.read`: ``rate``, ``units``, ``channels``, ...

    Raises
    ------
    InputError
        If no recording can be calibrated, an option cannot be used, or the folder is in use, holds
        calibrations that are not to be resumed (code "earlier-runs") or those of other options
        (code "other-runs").
    """
    place = None if folder is None else Path(folder)
    items = recordings(paths, place)
    task = _task(model, screening, still, horizon, (start, stop), reading)
    jobs = jobs if jobs == -1 else checks.whole("jobs", jobs, 1)
    for name in OUTPUTS[1:] if place is not None else ():
        replaceable(place / name)
    units: dict[str, Unit] = {}
    with nullcontext() if place is None else opened_store(place, task.options, resume) as store:
        if store is not None:
            kept = {item.path: store.kept(item) for item in items}
            units = {path: unit for path, unit in kept.items() if unit is not None}
        if progress is not None:
            progress(len(units), len(items), "")
        todo = [item for item in items if item.path not in units]
        with closing(results(task, todo, jobs=jobs, cluster=cluster, lost=task.lost)) as found:
            for item, unit in found:
                if store is not None:
                    store.save(unit)
                units[item.path] = unit
                if progress is not None:
                    progress(len(units), len(items), "")
        units = {item.path: units[item.path] for item in items}
        notices = _notices(units.values())
        if store is not None:
            names = {item.name for item in items}
            notices += _left_over([e.stem for e in store.calibrations if e.stem not in names])
        made = Fleet(units, task.horizon, task.options, tuple(notices))
        if not made.done:
            first, *others = made.failed.values()
            text = f"none of {len(others) + 1} recordings can be calibrated; the first: "
            raise InputError((text if others else "") + first.text, first.code)
        if store is not None:
            made._conclude(store)
    return made


def _task(
    model: Any, screening: Collection[str], still: bool, horizon: float,
    part: tuple[float, float | None], reading: Mapping[str, Any],
) -> Task:  # fmt: skip
    """The options, checked before any work."""
    from gmwm._core import __version__

    _, *parameters = signature(read).parameters.values()
    usual = {each.name: each.default for each in parameters}
    for name in reading:
        checks.choice("argument", name, tuple(usual))
    models = model if isinstance(model, Mapping) else {} if model is None else {"": model}
    for name in screening:
        checks.choice("screening", name, SCREENING)
    start, stop = part
    for name, given in (("start", start), ("stop", 0.0 if stop is None else stop)):
        if not checks.is_number(given):
            raise InputError(f"{name} = {checks.shown(given)}: give seconds")
    return Task(
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


# -- notices --------------------------------------------------------------------------------------


def _left_over(names: Sequence[str]) -> list[Notice]:
    """Calibrations in the folder that are of no recording given."""
    text = f"the folder also holds {len(names)} calibrations of other recordings: {_some(names)}"
    return [Notice("left-over", "note", "", text, {"units": len(names)})] if names else []


def _notices(units: Collection[Unit]) -> list[Notice]:
    """Which units failed, and what makes the others unlike each other."""
    notices = [unit.result for unit in units if isinstance(unit.result, Notice)]
    same: dict[str, list[str]] = {}
    for unit in units:
        same.setdefault(unit.digest or unit.path, []).append(unit.name)
    for names in (names for names in same.values() if len(names) > 1):
        text = f"the same recording: {_some(names)}"
        notices.append(Notice("same-recording", "warning", "", text, {"units": len(names)},
                              "each is counted; leave copies out"))  # fmt: skip
    done = {unit.name: unit.result for unit in units if isinstance(unit.result, Calibration)}
    return notices + (_differences(done) if done else [])


def _differences(done: Mapping[str, Calibration]) -> list[Notice]:
    """Rates, channels and lengths that are not the same in all units, and too few units."""

    def have(names: Sequence[str]) -> str:
        return "1 unit has" if len(names) == 1 else f"{len(names)} units have"

    notices = []
    median = sorted(each.rate for each in done.values())[len(done) // 2]
    other = [n for n, each in done.items() if abs(each.rate / median - 1.0) > tuning.SAME_RATE]
    if other:
        text = f"{have(other)} another sampling rate than {median:g} Hz: {_some(other)}"
        values = {"units": len(other), "rate": median}
        hint = "make sure that they are of one kind"
        notices.append(Notice("rates-differ", "warning", "", text, values, hint))
    channels = {name: (*each, *each.skipped) for name, each in done.items()}
    lacking: dict[tuple[str, ...], list[str]] = {}
    for channel in dict.fromkeys(channel for own in channels.values() for channel in own):
        names = tuple(name for name, own in channels.items() if channel not in own)
        lacking.setdefault(names, []).append(channel)
    for names, missing in lacking.items():
        if names:
            text = f"{have(names)} no such channel: {_some(names)}"
            notices.append(Notice("channels-differ", "warning", ", ".join(missing), text,
                                  {"units": len(names)}))  # fmt: skip
    lengths = {name: each.duration for name, each in done.items()}
    name = min(lengths, key=lengths.__getitem__)
    shortest, longest = lengths[name], max(lengths.values())
    if longest > tuning.LENGTHS * shortest:
        text = (
            f"recordings are from {shortest:.6g} s ({name}) to {longest:.6g} s long: short ones "
            "scatter more"
        )
        values = {"shortest": shortest, "longest": longest}
        notices.append(Notice("lengths-differ", "note", "", text, values))
    needed = needed_units()
    if len(done) < needed:
        text = f"{len(done)} units: a distribution-free limit needs {needed}"
        values = {"units": len(done), "needed": needed}
        notices.append(Notice("few-units", "note", "", text, values))
    return notices
