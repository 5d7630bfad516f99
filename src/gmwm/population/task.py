"""Which recordings a fleet has, how each is calibrated, here or elsewhere, and where it is kept."""

import glob
import hashlib
import json
import os
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from inspect import signature
from itertools import count
from pathlib import Path
from typing import Annotated, Any, ClassVar, NamedTuple, Self

from pydantic import StringConstraints

from gmwm._core import checks
from gmwm._core.documents import Document, Positive, Text, read_json
from gmwm._core.files import folder_to_fill, one_writer, opened, write_text
from gmwm._core.jobs import ENDED
from gmwm.calibration import SCREENING, Calibration, calibrate
from gmwm.errors import InputError, printable
from gmwm.issues import Notice, failure
from gmwm.population.unit import Structure, Unit, failed
from gmwm.process import Model, as_model
from gmwm.readers import read

OUTPUTS = ("calibrations", "fleet.parquet", "fleet.csv", "fleet.html", "fleet.json")
"""What a fleet writes into its folder."""

_LONGEST_NAME = 100  # characters: file systems take more, with an ending

Paths = str | os.PathLike[str] | Iterable[str | os.PathLike[str]]


class Item(NamedTuple):
    """A recording to calibrate, and the name of its unit."""

    path: str
    name: str


@dataclass(frozen=True)
class Task:
    """The calibration of a unit as a function of its recording, which can be sent to workers.

    models: Channel, sensor ("gyro", "accel") or "" for all -> fitted model; selected if empty.
    version: Version of gmwm that all numbers come from.
    """

    reading: Mapping[str, Any]
    start: float
    stop: float | None
    models: Mapping[str, Model]
    screening: tuple[str, ...]
    still: bool
    version: str

    @classmethod
    def of(cls, model: Any, options: Mapping[str, Any]) -> Self:
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
            version=__version__,
        )

    @property
    def options(self) -> dict[str, Any]:
        """Everything but the recording that the numbers depend on, in JSON types."""
        content = {
            "reading": dict(self.reading),
            "start": self.start,
            "stop": self.stop,
            "models": {k: [t.to_dict() for t in m.terms] for k, m in self.models.items()},
            "screening": sorted(self.screening),
            "still": self.still,
            "version": self.version,
        }
        return dict(json.loads(json.dumps(content)))

    def __call__(self, item: Item) -> Unit:
        """Calibrate a unit; a failure becomes its result and costs no other unit anything."""
        try:
            return self._calibrated(item)
        except Exception as error:
            return Unit(item.path, item.name, failed(item.name, error))

    def lost(self, item: Item) -> Unit:
        """The result for a recording whose worker processes end."""
        text = f"{ENDED} processes ended at it: it may need more memory than there is"
        return Unit(item.path, item.name, failure("worker-lost", item.name, text))

    def _calibrated(self, item: Item) -> Unit:
        from gmwm._core import __version__  # the worker's

        if __version__ != self.version:
            raise InputError(
                f"the worker has gmwm {__version__}, but {self.version} is needed: "
                "install the same version on all machines"
            )
        digest = digest_of(item.path)
        recording = read(item.path, **self.reading).part(self.start, self.stop)
        calibration = calibrate(
            recording, self.models or None, screening=self.screening, still=self.still, jobs=1
        )
        if digest_of(item.path) != digest:
            raise InputError(
                f"{item.path}: changed while it was calibrated: calibrate it again with resume",
                "recording-changed",
            )
        return Unit(item.path, item.name, calibration, digest)


def digest_of(path: str) -> str:
    """SHA-256 of a file, or of the files of a folder such as a bag of ROS 2."""
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


# -- recordings ------------------------------------------------------------------------------------


def recordings(paths: Paths, folder: Path | None) -> list[Item]:
    """Every recording that paths and patterns name, once, in their order.

    paths: A path that exists is taken as it is, brackets and all; ``**`` in a pattern stands for
        any folders.
    """
    given: Iterable[Any] = [paths]
    if isinstance(paths, Iterable) and not isinstance(paths, str | os.PathLike):
        given = paths
    found: dict[str, str] = {}
    for each in given:
        text = os.fspath(each) if isinstance(each, str | os.PathLike) else None
        if not isinstance(text, str) or "\0" in text:
            raise InputError(f"{checks.shown(each)} is not a path: give recording paths as strings")
        for path in _matching(text, folder):
            found.setdefault(os.path.realpath(path), path)
    if not found:
        raise InputError("no recordings given: give at least one path")
    kept = list(found.values())
    return [Item(path, name) for path, name in zip(kept, _names(kept), strict=True)]


def _matching(text: str, folder: Path | None) -> list[str]:
    if not glob.has_magic(text) or os.path.lexists(text):
        return [text]
    outputs = () if folder is None else (folder / name for name in OUTPUTS)
    out = {Path(os.path.realpath(path)) for path in outputs}
    found = []
    for path in sorted(glob.glob(text, recursive=True)):
        place = Path(os.path.realpath(path))
        # A folder on the way is no recording, that of a bag is one.
        is_recording = os.path.isfile(path) or os.path.isfile(os.path.join(path, "metadata.yaml"))
        if is_recording and out.isdisjoint((place, *place.parents)):
            found.append(path)
    if not found:
        raise InputError(f"no file matches {printable(text)[:200]!r}: check the pattern")
    return found


def _names(paths: Sequence[str]) -> list[str]:
    """Short names that differ in more than case: file names, with folders, with numbers."""

    def repeated(names: Sequence[str]) -> list[bool]:
        counts = Counter(name.lower() for name in names)
        return [counts[name.lower()] > 1 for name in names]

    whole = [Path(os.path.abspath(path)).parts for path in paths]
    names = [Path(parts[-1].removesuffix(".gz")).stem for parts in whole]
    for depth in range(1, max(map(len, whole)) + 1):
        names = [
            "-".join(part.strip(os.sep) for part in parts[-depth:]) if is_repeated else name
            for name, parts, is_repeated in zip(names, whole, repeated(names), strict=True)
        ]
    # Every file system takes them, and they fit into a line.
    odd = re.compile(r'[/\\:*?"<>|]')
    plain = ("".join(c if c.isprintable() else "_" for c in odd.sub("_", name)) for name in names)
    names = [name.strip(" .")[-_LONGEST_NAME:] or "unit" for name in plain]
    taken = {name.lower() for name in names}
    for i, is_repeated in enumerate(repeated(names)):
        if is_repeated:
            numbered = (f"{names[i]}-{k}" for k in count(i + 1))
            names[i] = next(each for each in numbered if each.lower() not in taken)
            taken.add(names[i].lower())
    return names


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
                f"{path} belongs to {origin.path}, not {item.path}: give another folder",
                "other-runs",
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
            if not isinstance(content, dict) or not isinstance(content.get("fleet"), dict):
                raise InputError("was not written by a fleet")
            origin = _Origin.from_content(content["fleet"])
            calibration = Calibration.from_dict(content)
        except (TypeError, ValueError) as error:  # InputError is one
            hint = "move it away, or give another folder"
            raise InputError(f"{path}: {error}: {hint}") from None
        return origin, Unit(item.path, item.name, calibration, origin.sha256)

    def save(self, unit: Unit) -> Unit:
        """Write the calibration of a unit; if it has none, remove that of an earlier run.

        Returns the unit; it fails if its calibration is none of a document.
        """
        if isinstance(unit.result, Calibration):
            origin = _Origin(printable(unit.path), unit.digest, self.options).content()
            try:
                content = unit.result.to_dict() | {"fleet": origin}
                text = json.dumps(content, indent=1, allow_nan=False)
            except Exception as error:
                unit = replace(unit, result=failed(unit.name, error))
            else:
                write_text(self.path(unit.name), text)
                return unit
        self.path(unit.name).unlink(missing_ok=True)
        return unit


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
