"""The folder of a fleet: one calibration per unit, each written whole or not at all."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from gmwm._core.documents import read_json
from gmwm._core.files import folder_to_fill, one_writer, written
from gmwm._core.forms import Form, NoticeForm, Notices, NotNegative, Positive, Text
from gmwm._core.notices import Notice
from gmwm.calibration import Calibration
from gmwm.errors import InputError, printable
from gmwm.population.paths import Item
from gmwm.population.task import digest_of
from gmwm.population.unit import Number, Unit


class _NumberForm(Form):
    value: NotNegative
    stderr: NotNegative | None
    found: bool


class _OriginForm(Form):
    """What a fleet adds to the calibration of a unit."""

    path: Text
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    options: dict[str, Any]
    numbers: dict[Text, dict[Text, _NumberForm]]


class _UnitForm(Form):
    path: Text
    name: Annotated[Text, Field(pattern=r"^[^/\\]+$")]
    failed: NoticeForm | None


class _IndexForm(Form):
    """What fleet.json holds: the units, and why some have no calibration."""

    horizon_s: Positive
    options: dict[str, Any]
    units: Annotated[list[_UnitForm], Field(min_length=1)]
    notices: Notices


@dataclass(frozen=True)
class Store:
    """Calibrations of a fleet on disk.

    options: See `gmwm.population.task.Task.options`.
    """

    folder: Path
    options: Mapping[str, Any]

    @property
    def calibrations(self) -> list[Path]:
        """Files that are there."""
        return sorted((self.folder / "calibrations").glob("*.json"))

    def path(self, name: str) -> Path:
        return self.folder / "calibrations" / f"{name}.json"

    def kept(self, item: Item) -> Unit | None:
        """The unit of an earlier run, unless the recording has changed since.

        Raises InputError if the file is damaged, or of another fleet (code "other-runs").
        """
        path = self.path(item.name)
        if not path.exists():
            return None
        origin, unit = self.load(item)
        earlier = origin["options"]
        names = sorted({*earlier, *self.options})
        other = [name for name in names if earlier.get(name) != self.options.get(name)]
        if other:
            raise InputError(
                f"{path} belongs to another fleet (other {', '.join(other)}): give another folder",
                "other-runs",
            )
        try:
            digest = digest_of(item.path)
        except InputError:
            return None  # reading it reports why
        if digest == unit.digest:
            return unit
        if origin["path"] != printable(item.path):
            raise InputError(
                f"{path} is of {origin['path']}, not of {item.path}: give another folder",
                "other-runs",
            )
        return None

    def load(self, item: Item) -> tuple[dict[str, Any], Unit]:
        """The stored origin of a unit, and the unit.

        Raises InputError if the file is damaged or missing.
        """
        path = self.path(item.name)
        content = read_json(path)
        try:
            if not isinstance(content, dict) or "fleet" not in content:
                raise InputError("was not written by a fleet")
            origin = _OriginForm.checked(content["fleet"])
            calibration = Calibration.from_dict(content)
        except (InputError, TypeError) as error:
            hint = "move it away, or give another folder"
            raise InputError(f"{path}: {error}: {hint}") from None
        numbers = {
            channel: {name: Number(**each) for name, each in own.items()}
            for channel, own in origin["numbers"].items()
        }
        return origin, Unit(item.path, item.name, calibration, numbers, origin["sha256"])

    def save(self, unit: Unit) -> None:
        """Write the calibration of a unit; if it has none, remove that of an earlier run."""
        if not isinstance(unit.result, Calibration):
            self.path(unit.name).unlink(missing_ok=True)
            return
        origin = {
            "path": printable(unit.path),
            "sha256": unit.digest,
            "options": self.options,
            "numbers": {
                channel: {name: each._asdict() for name, each in own.items()}
                for channel, own in unit.numbers.items()
            },
        }
        with written(self.path(unit.name)) as stream:
            json.dump(unit.result.to_dict() | {"fleet": origin}, stream, indent=1, allow_nan=False)
            stream.write("\n")


@contextmanager
def opened_store(folder: Path, options: Mapping[str, Any], resume: bool) -> Iterator[Store]:
    """The folder, for one fleet at a time.

    Raises InputError if it cannot be written, is in use (code "runs-in-use"), or holds calibrations
        that are not to be resumed (code "earlier-runs").
    """
    store = Store(folder, options)
    with folder_to_fill(folder), one_writer(folder), folder_to_fill(folder / "calibrations"):
        if not resume and store.calibrations:
            raise InputError(
                f"{folder} holds calibrations of an earlier fleet: resume it, or give another "
                "folder",
                "earlier-runs",
            )
        yield store


def write_index(
    path: Path, units: Iterable[Unit], horizon: float, options: Mapping[str, Any],
    notices: Sequence[Notice],
) -> None:  # fmt: skip
    """Write fleet.json."""
    content = {
        "schema": "gmwm.fleet-index",
        "schema_version": 1,
        "horizon_s": horizon,
        "options": dict(options),
        "units": [
            {
                "path": printable(each.path),
                "name": each.name,
                "failed": each.result.to_dict() if isinstance(each.result, Notice) else None,
            }
            for each in units
        ],
        "notices": [each.to_dict() for each in notices],
    }
    path.write_text(json.dumps(content, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def read_index(folder: Path) -> tuple[list[Unit], float, dict[str, Any], list[Notice]]:
    """Units, horizon, options and notices of a fleet's folder.

    Raises InputError if it holds no finished fleet, or one of its files is damaged.
    """
    path = folder / "fleet.json"
    if not path.exists():
        raise InputError(f"{folder} holds no {path.name}: give the folder of a fleet, or resume it")
    try:
        content = _IndexForm.checked(read_json(path))
    except (InputError, TypeError) as error:
        raise InputError(f"{path}: {error}: make the fleet again with resume") from None
    store = Store(folder, content["options"])
    units = [
        store.load(Item(each["path"], each["name"]))[1]
        if each["failed"] is None
        else Unit(each["path"], each["name"], Notice.from_dict(each["failed"]))
        for each in content["units"]
    ]
    notices = [Notice.from_dict(each) for each in content["notices"]]
    return units, content["horizon_s"], content["options"], notices
