"""The folder of a fleet: a calibration of each unit, whole or not there at all."""

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
from gmwm.fleet.unit import Item, Number, Unit, digest_of

FOLDER = "calibrations"
"""Of the files of the units."""

INDEX = "fleet.json"
"""Which units there are, and why some have no calibration."""

_MEND = "move it away, or give another folder"


class _NumberForm(Form):
    value: NotNegative
    stderr: NotNegative | None
    found: bool


class _OriginForm(Form):
    """What a calibration of a fleet has beside it."""

    path: Text
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    options: dict[str, Any]
    numbers: dict[Text, dict[Text, _NumberForm]]


class _UnitForm(Form):
    path: Text
    name: Annotated[Text, Field(pattern=r"^[^/\\]+$")]
    failed: NoticeForm | None


class _IndexForm(Form):
    """What is stored of a fleet beside its calibrations."""

    horizon_s: Positive
    options: dict[str, Any]
    units: Annotated[list[_UnitForm], Field(min_length=1)]
    notices: Notices


@dataclass(frozen=True)
class Store:
    """Calibrations of a fleet on disk.

    options: What numbers depend on beside the recordings; see `gmwm.fleet.unit.Task`.
    """

    folder: Path
    options: Mapping[str, Any]

    def path(self, name: str) -> Path:
        return self.folder / FOLDER / f"{name}.json"

    def left_over(self, items: Sequence[Item]) -> list[str]:
        """Names of calibrations that are of none of these recordings."""
        own = {item.name for item in items}
        return sorted(each.stem for each in _calibrations(self.folder) if each.stem not in own)

    def kept(self, item: Item) -> Unit | None:
        """What an earlier run made of a recording, unless it has changed.

        Raises InputError if the file is damaged, or of another fleet (code "other-runs").
        """
        path = self.path(item.name)
        if not path.exists():
            return None
        origin, unit = self.unit(item)
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
            return None  # reading it says why
        if digest != origin["sha256"]:
            if origin["path"] != printable(item.path):
                raise InputError(
                    f"{path} is of {origin['path']}, not of {item.path}: give another folder",
                    "other-runs",
                )
            return None
        return unit

    def unit(self, item: Item) -> tuple[dict[str, Any], Unit]:
        """What is stored of a unit: where it is from, and the unit.

        Raises InputError if the file is damaged or not there.
        """
        path = self.path(item.name)
        content = read_json(path)
        try:
            if not isinstance(content, dict) or "fleet" not in content:
                raise InputError("was not written by a fleet")
            origin = _OriginForm.checked(content["fleet"])
            calibration = Calibration.from_dict(content)
        except (InputError, TypeError) as error:
            raise InputError(f"{path}: {error}: {_MEND}") from None
        numbers = {
            channel: {name: Number(**each) for name, each in of_channel.items()}
            for channel, of_channel in origin["numbers"].items()
        }
        return origin, Unit(item.path, item.name, calibration, numbers, origin["sha256"])

    def save(self, unit: Unit) -> None:
        """Write a unit that has a calibration; of another, nothing of an earlier run is left."""
        if not isinstance(unit.result, Calibration):
            self.path(unit.name).unlink(missing_ok=True)
            return
        numbers = {
            channel: {name: each._asdict() for name, each in of_channel.items()}
            for channel, of_channel in unit.numbers.items()
        }
        origin = {"path": printable(unit.path), "sha256": unit.digest, "options": self.options}
        content = {**unit.result.to_dict(), "fleet": {**origin, "numbers": numbers}}
        with written(self.path(unit.name)) as stream:
            json.dump(content, stream, indent=1, allow_nan=False)
            stream.write("\n")


def write_index(
    path: Path, units: Iterable[Unit], horizon: float, options: Mapping[str, Any],
    notices: Sequence[Notice],
) -> None:  # fmt: skip
    """Write which units there are."""
    listed = [
        {"path": printable(each.path), "name": each.name,
         "failed": each.result.to_dict() if isinstance(each.result, Notice) else None}
        for each in units
    ]  # fmt: skip
    content = {
        "schema": "gmwm.fleet-index", "schema_version": 1, "horizon_s": horizon,
        "options": dict(options), "units": listed, "notices": [each.to_dict() for each in notices],
    }  # fmt: skip
    path.write_text(json.dumps(content, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def read_index(folder: Path) -> tuple[list[Unit], float, dict[str, Any], list[Notice]]:
    """Units, horizon, options and notices of a fleet's folder.

    Raises InputError if it holds no fleet that was finished, or one of its files is damaged.
    """
    path = folder / INDEX
    if not path.exists():
        raise InputError(f"{folder} holds no {INDEX}: give the folder of a fleet, or resume it")
    try:
        content = _IndexForm.checked(read_json(path))
    except (InputError, TypeError) as error:
        raise InputError(f"{path}: {error}: make the fleet again with resume") from None
    store = Store(folder, content["options"])
    units = [
        store.unit(Item(each["path"], each["name"]))[1]
        if each["failed"] is None
        else Unit(each["path"], each["name"], Notice.from_dict(each["failed"]))
        for each in content["units"]
    ]
    notices = [Notice.from_dict(each) for each in content["notices"]]
    return units, content["horizon_s"], content["options"], notices


def _calibrations(folder: Path) -> list[Path]:
    return sorted((folder / FOLDER).glob("*.json"))


@contextmanager
def opened_store(folder: Path, options: Mapping[str, Any], resume: bool) -> Iterator[Store]:
    """The folder, for one fleet at a time.

    Raises InputError if it cannot be written, is in use (code "runs-in-use"), or holds calibrations
        and ``resume`` is not set (code "earlier-runs").
    """
    with folder_to_fill(folder), one_writer(folder), folder_to_fill(folder / FOLDER):
        if not resume and _calibrations(folder):
            raise InputError(
                f"{folder} holds calibrations of an earlier fleet: resume it, or give another "
                "folder",
                "earlier-runs",
            )
        yield Store(folder, options)
