"""`fleet`: many units of a sensor, which of them stand apart, and which meet limits."""

from __future__ import annotations

import csv
import os
from collections.abc import Collection, Mapping, Sequence
from contextlib import closing, nullcontext
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow as pa
import pyarrow.parquet as pq

from gmwm._core import checks
from gmwm._core.files import moved_together, replaceable
from gmwm._core.frozen import ByName, freeze
from gmwm._core.jobs import results
from gmwm._core.pages import Reported
from gmwm._core.text import Printed, brief, bullets, cell, frame, per_cent, plain_table, wrapped
from gmwm._core.typing import Progress
from gmwm.calibration import Calibration
from gmwm.errors import InputError, MissingNameError, printable
from gmwm.estimate import Fit
from gmwm.issues import Notice, notice
from gmwm.population import tuning
from gmwm.population.spread import Spread, needed_units, spreads_of
from gmwm.population.task import (
    OUTPUTS,
    Index,
    Listed,
    Paths,
    Store,
    Task,
    opened_store,
    recordings,
)
from gmwm.population.unit import LETTERS, SCHEMA, Choice, Number, Row, Structure, Unit, rows_of
from gmwm.process import Model, Process

if TYPE_CHECKING:
    import pandas

PASS, FAIL, OPEN, NONE = "pass", "FAIL", "?", "none"
"""The 95 % interval is below the limit, above it, or contains it; or no number can be used."""

Limits = Mapping[str, Mapping[str, float]]
Grid = Mapping[str, Mapping[str, Mapping[str, str]]]
"""Unit -> channel -> letter -> verdict."""


def checked(limits: Any) -> Limits:
    """Limits in SI by sensor or channel; raises InputError if they are something else."""
    hint = 'give them in SI as {"gyro": {"N": 6e-5}}'
    found: dict[str, dict[str, float]] = {}
    for name, own in limits.items() if isinstance(limits, Mapping) else [("", limits)]:
        if not (
            name and isinstance(name, str) and isinstance(own, Mapping) and {*own} <= {*LETTERS}
        ):
            raise InputError(f"limits of {checks.shown(name)} = {checks.shown(own)}: {hint}")
        found[name] = {k: checks.positive(f"limit {k} of {name}", v, hint) for k, v in own.items()}
    return found


def grid_of(limits: Limits, structures: Sequence[Structure], units: Sequence[Unit]) -> Grid:
    """The verdicts on every unit; a limit of an axis that no unit has is not met."""
    by_channel = {each.channel: each for each in structures}
    named = {*by_channel, *(each.quantity for each in structures)}
    wanted = {k: limits.get(k, limits.get(each.quantity, {})) for k, each in by_channel.items()}
    wanted |= {name: own for name, own in limits.items() if name not in named}
    grid: dict[str, dict[str, dict[str, str]]] = {unit.name: {} for unit in units}
    for name, row in grid.items():
        for channel, own in wanted.items():
            structure = by_channel.get(channel)
            known = structure.usable.get(name, {}) if structure is not None else {}
            if own:
                row[channel] = {key: _verdict(known.get(key), end) for key, end in own.items()}
    return grid


def _verdict(number: Number | None, limit: float) -> str:
    if number is None:
        return NONE
    if number.upper <= limit:
        return PASS
    return FAIL if number.lower > limit else OPEN


def in_words(verdicts: Mapping[str, str]) -> str:
    """The verdicts on an axis in a word: ``pass``, ``FAIL NK``, ``? B`` or ``none``."""
    for state in (NONE, FAIL, OPEN):
        letters = "".join(letter for letter, each in verdicts.items() if each == state)
        if letters:
            return state if state == NONE else f"{state} {letters}"
    return PASS


@dataclass(frozen=True, repr=False)
class Fleet(ByName[Calibration | Notice], Printed, Reported):
    """Units of a sensor: a mapping of paths to a `Calibration`, or to a `Notice` of why not.

    Attributes
    ----------
    units : dict
        Path -> `Unit`.
    structures : tuple of Structure
        Of every axis: the model that was chosen for all units, and N, B and K of each from it.
    options : dict
        How every unit was calibrated.
    limits : dict
        Sensor or channel -> letter -> largest allowed N, B or K, SI.
    notices : tuple of Notice
        Which units have no calibration, and what makes units unlike each other.
    """

    _held = "units"

    units: Mapping[str, Unit]
    structures: tuple[Structure, ...]
    options: Mapping[str, Any]
    limits: Limits
    notices: tuple[Notice, ...] = ()

    def __post_init__(self) -> None:
        freeze(self, "units", "options", "limits")

    def __getitem__(self, path: str) -> Calibration | Notice:
        if path not in self.units:
            raise MissingNameError(f"the fleet has no recording {checks.shown(path)}")
        return self.units[path].result

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
        """Rows of the table: one per unit, channel and number."""
        return tuple(rows_of(self.units.values(), self.structures))

    @cached_property
    def spreads(self) -> tuple[Spread, ...]:
        """How N, B and K of each axis differ over the units."""
        return spreads_of(self.structures)

    @cached_property
    def findings(self) -> dict[str, str]:
        """Units that stand apart -> in what; at 5 % for all units, axes and numbers together."""
        found: dict[str, list[str]] = {unit.name: [] for unit in self.units.values()}
        for each in self.spreads:
            for unit in each.outliers:
                times = f"{'' if unit.found else 'at most '}{brief(unit.value / each.median, 3)}"
                found[unit.device].append(
                    f"{each.parameter} of {each.channel} is {times} times the median"
                )
        for structure in self.structures:
            for name in structure.own:
                found[name].append(f"{structure.channel} rejects the model of the other units")
        return {name: "; ".join(texts) for name, texts in found.items() if texts}

    @cached_property
    def grid(self) -> Grid:
        """Unit -> channel -> letter -> "pass", "FAIL", "?" (undecided) or "none" (no number)."""
        return grid_of(self.limits, self.structures, tuple(self.units.values()))

    @property
    def meets_limits(self) -> bool:
        """Whether no limit is missed; one within an interval is not missed."""
        axes = (own for row in self.grid.values() for own in row.values())
        return not any({FAIL, NONE} & {*own.values()} for own in axes)

    def __repr__(self) -> str:
        failed = f", {len(self.failed)} not" if self.failed else ""
        return f"<Fleet of {len(self)} units: {len(self.done)} calibrated{failed}>"

    def __str__(self) -> str:
        valid = sum(unit.valid for unit in self.units.values())
        lines = [
            f"{len(self)} units: {len(self.done)} calibrated, {valid} of them with a valid model"
        ]
        if self.spreads:
            heads = ("channel", "number", "units", "median", "spread", "limit", "unit")
            rows = []
            for each in self.spreads:
                unit, scale = each.field_unit
                median, limit = (cell(x, scale=scale) for x in (each.median, each.normal_limit))
                sd = per_cent(each.sd, 3) if each.sd >= 0.0 else "-"
                if each.is_limit:
                    sd, median = "-", f"<= {median}"
                rows.append((each.channel, each.parameter, str(each.n), median, sd, limit, unit))
            lines += ["", *plain_table(heads, rows).splitlines(), ""]
            lines += wrapped(
                "Limit: 95 % of units are below this (95 % confidence, log-normal). Spread: "
                "1 sigma with estimation errors. 5 % of lots of equal units have a false finding."
            )
        for model in dict.fromkeys(each.model for each in self.structures if each.model):
            axes = ", ".join(each.channel for each in self.structures if each.model == model)
            lines += wrapped(f"Model of all units: {model} ({axes})")
        apart = [f"{name}: {text}" for name, text in self.findings.items()]
        apart += [
            f"{axis.channel}: not valid in {_some(axis.invalid)}"
            for axis in self.structures
            if axis.invalid
        ]
        return "\n".join(lines + self._verdicts() + bullets([*apart, *self.notices]))

    def _verdicts(self) -> list[str]:
        """Which units miss limits, as lines of a table; all of them stand on the page."""
        if not self.limits:
            return []
        missed: dict[str, dict[str, str]] = {}
        for name, row in self.grid.items():
            words = {axis: in_words(own) for axis, own in row.items()}
            if {*words.values()} != {PASS}:
                missed[name] = words
        lines = ["", f"Limits: {len(self) - len(missed)} of {len(self)} units pass"]
        if missed:
            axes = list(next(iter(missed.values())))
            rows = [(name[:20], *words.values()) for name, words in missed.items()]
            lines += ["", *plain_table(("unit", *axes), rows).splitlines(), ""]
            lines += wrapped("?: the 95 % interval contains the limit. none: no valid number.")
        return lines

    def to_frame(self) -> pandas.DataFrame:
        """The table in SI units, see `gmwm.population.SCHEMA`; needs pandas."""
        return frame(self.rows, SCHEMA.names)

    def to_dict(self) -> dict[str, Any]:
        """The table and the notices, in JSON types."""
        return {
            "schema": "gmwm.fleet",
            "schema_version": 1,
            "options": dict(self.options),
            "limits": {name: dict(own) for name, own in self.limits.items()},
            "rows": [dict(row) for row in self.rows],
            "findings": self.findings,
            "verdicts": self.grid,
            "notices": [notice.to_dict() for notice in self.notices],
        }

    def save(self, folder: str | os.PathLike[str]) -> Path:
        """Write what `fleet` writes: calibrations, the table (Parquet) and the report.

        Raises
        ------
        InputError
            If the folder cannot be written, is in use, or holds calibrations.
        """
        with opened_store(Path(folder), self.options, resume=False) as store:
            units = {path: store.save(unit) for path, unit in self.units.items()}
            replace(self, units=units)._conclude(store)
        return Path(folder)

    @classmethod
    def load(cls, folder: str | os.PathLike[str]) -> Fleet:
        """The fleet that `gmwm.fleet` or `save` wrote into a folder.

        Raises
        ------
        InputError
            If the folder holds no finished fleet, or one of its files is damaged.
        """
        path = Path(folder, OUTPUTS[-1])
        if not path.exists():
            raise InputError(
                f"{path.parent} holds no {path.name}: give the folder of a fleet, or resume it"
            )
        index = Index.load(path)
        store = Store(path.parent, index.options)
        units = {each.path: store.load(each) for each in index.units}
        stored = {each.channel: each.numbers for each in index.structures}
        for unit in units.values():
            for channel in unit.result if isinstance(unit.result, Calibration) else ():
                if {*stored.get(channel, {}).get(unit.name, {})} != {*LETTERS}:
                    raise InputError(f"{path}: lacks {channel} of {unit.name}: resume the fleet")
        return cls(units, index.structures, index.options, index.limits, index.notices)

    def _conclude(self, store: Store) -> None:
        """Write the table, the report and the list of units, all or none."""
        _, table, plain, page, index = OUTPUTS
        with moved_together(store.folder) as new:
            pq.write_table(pa.Table.from_pylist(list(self.rows), schema=SCHEMA), new / table)
            with open(new / plain, "w", encoding="utf-8", newline="") as stream:
                lines = csv.DictWriter(stream, SCHEMA.names, lineterminator="\n")
                lines.writeheader()
                for row in self.rows:
                    codes = {key: ";".join(row[key] or ()) for key in ("reasons", "notices")}
                    lines.writerow(row | codes)
            self.report(new / page)
            listed = tuple(
                Listed(printable(path), unit.name, self.failed.get(path))
                for path, unit in self.units.items()
            )
            found = Index(self.options, self.limits, self.structures, listed, self.notices)
            found.save(new / index)


def _some(names: Sequence[str]) -> str:
    """The first names of a list."""
    return ", ".join(names[:5]) + (", ..." if len(names) > 5 else "")


def fleet(
    paths: Paths,
    model: Process | Model | Mapping[str, Process | Model] | None = None,
    *,
    limits: Limits | None = None,
    folder: str | os.PathLike[str] | None = None,
    resume: bool = False,
    jobs: int = 1,
    cluster: str | None = None,
    progress: Progress | None = None,
    **options: Any,
) -> Fleet:
    """Calibrate many units of a sensor, one recording of each.

    A recording that cannot be used is reported and costs the others nothing. N, B and K of an axis
    come from one model structure for all units, chosen jointly. For several recordings of one unit
    use `gmwm.calibrate`.

    Parameters
    ----------
    paths : path, pattern or iterable of them
        The recordings; a pattern is as in ``"lot-7/**/*.csv"``.
    model : Process, Model or mapping, optional
        Fitted to every channel, or by channel or sensor ("gyro", "accel"); selected by default.
    limits : mapping, optional
        Sensor or channel -> letter -> largest allowed N, B or K, SI, as ``{"gyro": {"N": 6e-5}}``;
        see `Fleet.grid`.
    folder : path, optional
        Where each calibration is kept as soon as it is done, and the table (``fleet.parquet``,
        ``fleet.csv``) and the report (``fleet.html``) at the end; see `Fleet.load`.
    resume : bool, optional
        Go on with what the folder holds: recordings that have not changed are not calibrated again.
    jobs : int, optional
        Processes on this machine; -1 for one a core.
    cluster : str, optional
        Address of a Dask scheduler that does the work instead. Its workers read the recordings.
    progress : callable, optional
        Called as ``progress(done, total, "")``.
    **options
        ``screening`` and ``still`` of `gmwm.calibrate`; ``start`` and ``stop``, the part of each
        recording, s; and arguments of `gmwm.read`: ``rate``, ``units``, ``channels``, ...

    Raises
    ------
    InputError
        If no recording can be calibrated, an option cannot be used, or the folder is in use, holds
        calibrations that are not to be resumed (code "earlier-runs") or those of other options
        (code "other-runs").
    """
    place = None if folder is None else Path(folder)
    items = recordings(paths, place)
    task, allowed = Task.of(model, options), checked({} if limits is None else limits)
    jobs = jobs if jobs == -1 else checks.whole("jobs", jobs, 1)
    if place is not None:
        for name in OUTPUTS[1:]:
            replaceable(place / name)
    units: dict[str, Unit] = {}
    with nullcontext() if place is None else opened_store(place, task.options, resume) as store:
        if store is not None:
            kept = {item.path: store.kept(item) for item in items}
            units = {path: unit for path, unit in kept.items() if unit is not None}
        tell = progress or (lambda *_: None)
        tell(len(units), len(items), "")
        todo = [item for item in items if item.path not in units]
        with closing(results(task, todo, jobs=jobs, cluster=cluster, lost=task.lost)) as found:
            for item, unit in found:
                units[item.path] = unit if store is None else store.save(unit)
                tell(len(units), len(items), "")
        units = {item.path: units[item.path] for item in items}
        structures = _structures(units, store, bool(task.models), jobs=jobs, cluster=cluster)
        notices = _notices(units.values())
        if store is not None:
            names = {item.name for item in items}
            if others := [each.stem for each in store.calibrations if each.stem not in names]:
                notices.append(_of_some("left-over", others))
        made = Fleet(units, structures, task.options, allowed, tuple(notices))
        if not made.done:
            first, *rest = made.failed.values()
            text = f"none of {len(rest) + 1} recordings can be calibrated; the first: "
            raise InputError((text if rest else "") + first.text, first.code)
        if store is not None:
            made._conclude(store)
    return made


def _structures(
    units: dict[str, Unit], store: Store | None, is_given: bool, **work: Any
) -> tuple[Structure, ...]:
    """The structure of every axis; units that prevent one fail, in place."""
    while True:
        fits: dict[str, dict[str, Fit]] = {}
        for unit in units.values():
            for name, fit in unit.result.items() if isinstance(unit.result, Calibration) else ():
                fits.setdefault(name, {})[unit.name] = fit
        if not fits:
            return ()
        chosen = dict(results(Choice(fits, is_given).attempt, list(fits), **work))
        odd = {each.where: each for each in chosen.values() if isinstance(each, Notice)}
        if not odd:
            return tuple(each for name in fits if isinstance(each := chosen[name], Structure))
        for path, unit in units.items():
            if unit.name in odd:
                unit = replace(unit, result=odd[unit.name])
                units[path] = unit if store is None else store.save(unit)


def _notices(units: Collection[Unit]) -> list[Notice]:
    """Which units failed, and what makes the others unlike each other."""
    notices = [unit.result for unit in units if isinstance(unit.result, Notice)]
    same: dict[str, list[str]] = {}
    for unit in units:
        same.setdefault(unit.digest or unit.path, []).append(unit.name)
    for names in (names for names in same.values() if len(names) > 1):
        notices.append(_of_some("same-recording", names, "each is counted; leave copies out"))
    done = {unit.name: unit.result for unit in units if isinstance(unit.result, Calibration)}
    return notices + (_differences(done) if done else [])


def _of_some(
    code: str, names: Sequence[str], hint: str | None = None, where: str = "", **values: float
) -> Notice:
    """A notice of some units."""
    have = "1 unit has" if len(names) == 1 else f"{len(names)} units have"
    more: dict[str, Any] = {} if hint is None else {"hint": hint, "variant": "fleet"}
    more |= {"have": have, "names": _some(names)}
    return notice(code, where, {"units": len(names), **values}, **more)


def _differences(done: Mapping[str, Calibration]) -> list[Notice]:
    """Rates, channels and lengths that are not the same in all units, and too few units."""
    notices = []
    rate = sorted(each.rate for each in done.values())[len(done) // 2]
    other = [n for n, each in done.items() if abs(each.rate / rate - 1.0) > tuning.SAME_RATE]
    if other:
        hint = "make sure that they are of one kind"
        notices.append(_of_some("rates-differ", other, hint, rate=rate))
    channels = {name: (*each, *each.skipped) for name, each in done.items()}
    lacking: dict[tuple[str, ...], list[str]] = {}
    for channel in dict.fromkeys(channel for own in channels.values() for channel in own):
        names = tuple(name for name, own in channels.items() if channel not in own)
        lacking.setdefault(names, []).append(channel)
    notices += [
        _of_some("channels-differ", names, where=", ".join(missing))
        for names, missing in lacking.items()
        if names
    ]
    if len(done) < needed_units():
        values = {"units": len(done), "needed": needed_units()}
        notices.append(notice("few-units", values=values))
    return notices
