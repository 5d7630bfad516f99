"""The folder of a fleet: one calibration per unit, each written whole or not at all."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import StringConstraints

from gmwm._core.documents import Document, Positive, Text, read_json
from gmwm._core.files import folder_to_fill, one_writer, written
from gmwm.calibration import Calibration
from gmwm.errors import InputError, printable
from gmwm.issues import Notice
from gmwm.population.structure import Structure
from gmwm.population.task import Item, digest_of
from gmwm.population.unit import Unit


@dataclass(frozen=True)
class _Origin(Document):
    """What a fleet adds to the calibration of a unit."""

    path: Text
    sha256: Annotated[str, StringConstraints(pattern="^[0-9a-f]{64}$")]
    options: Mapping[str, Any]


@dataclass(frozen=True)
class Listed:
    """A unit in the index: its calibration is in a file of this name, or why there is none."""

    path: Text
    name: Annotated[str, StringConstraints(pattern=r"^[^/\\]+$", max_length=1000)]
    failed: Notice | None


@dataclass(frozen=True)
class Index(Document):
    """Content of fleet.json: the units, and why some have no calibration."""

    SCHEMA: ClassVar[str] = "gmwm.fleet-index"

    options: Mapping[str, Any]
    limits: Mapping[Text, Mapping[Text, Positive]]
    structures: tuple[Structure, ...]
    units: tuple[Listed, ...]
    notices: tuple[Notice, ...]


@dataclass(frozen=True)
class Store:
    """Calibrations of a fleet on disk; for the options see `Task.options`."""

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
        origin, unit = self._load(item)
        earlier = origin.options
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
        if origin.path != printable(item.path):
            raise InputError(
                f"{path} is of {origin.path}, not of {item.path}: give another folder", "other-runs"
            )
        return None

    def load(self, listed: Listed) -> Unit:
        """A unit of the index; raises InputError if its file is damaged or missing."""
        if listed.failed is not None:
            return Unit(listed.path, listed.name, listed.failed)
        return self._load(Item(listed.path, listed.name))[1]

    def _load(self, item: Item) -> tuple[_Origin, Unit]:
        """The stored origin of a unit, and the unit."""
        path = self.path(item.name)
        content = read_json(path)
        try:
            if not isinstance(content, dict) or "fleet" not in content:
                raise InputError("was not written by a fleet")
            origin = _Origin.from_content(content["fleet"])
            calibration = Calibration.from_dict(content)
        except (InputError, TypeError) as error:
            hint = "move it away, or give another folder"
            raise InputError(f"{path}: {error}: {hint}") from None
        return origin, Unit(item.path, item.name, calibration, origin.sha256)

    def save(self, unit: Unit) -> None:
        """Write the calibration of a unit; if it has none, remove that of an earlier run."""
        if not isinstance(unit.result, Calibration):
            self.path(unit.name).unlink(missing_ok=True)
            return
        origin = _Origin(printable(unit.path), unit.digest, self.options).content()
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
