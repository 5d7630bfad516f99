"""Which recordings a fleet has, and the names of their units."""

from __future__ import annotations

import glob
import os
from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple

from gmwm._core import checks
from gmwm.errors import InputError, printable

OUTPUTS = ("calibrations", "fleet.parquet", "fleet.html", "fleet.json")
"""What a fleet writes into its folder."""

_LONGEST_NAME = 100  # characters: file systems take more, with an ending

Paths = str | os.PathLike[str] | Iterable[str | os.PathLike[str]]


class Item(NamedTuple):
    """A recording to calibrate, and the name of its unit."""

    path: str
    name: str


def recordings(paths: Paths, folder: Path | None) -> list[Item]:
    """Every recording that paths and patterns name, once, in their order.

    paths: A path that exists is taken as it is, brackets and all; ``**`` in a pattern stands for
        any folders.
    folder: Folder of the outputs, which are no recordings.
    Raises InputError if there are none, or a pattern matches nothing.
    """
    try:
        given: list[Any] = [paths] if isinstance(paths, str | os.PathLike) else list(paths)
    except TypeError:
        raise InputError(f"{checks.shown(paths)} is no path: give paths of recordings") from None
    found: dict[str, str] = {}
    for each in given:
        text = os.fspath(each) if isinstance(each, str | os.PathLike) else None
        if not isinstance(text, str) or "\0" in text:
            raise InputError(f"{checks.shown(each)} is no path: give paths of recordings as text")
        for path in _matching(text, folder):
            found.setdefault(os.path.realpath(path), path)
    if not found:
        raise InputError("there is no recording: give one path at least")
    kept = list(found.values())
    return [Item(path, name) for path, name in zip(kept, _names(kept), strict=True)]


def _matching(text: str, folder: Path | None) -> list[str]:
    if not glob.has_magic(text) or os.path.lexists(text):
        return [text]
    found = [path for path in sorted(glob.glob(text, recursive=True)) if not _is_own(path, folder)]
    # ``**`` names the folders on the way too; the folder of a bag is a recording.
    on_the_way = {str(above) for path in found for above in Path(path).parents}
    found = [
        path
        for path in found
        if path.rstrip(os.sep) not in on_the_way
        or os.path.isfile(os.path.join(path, "metadata.yaml"))
    ]
    if not found:
        raise InputError(f"no file matches {printable(text)[:200]!r}: check the pattern")
    return found


def _is_own(path: str, folder: Path | None) -> bool:
    """Whether a path is the folder of the outputs or one of the outputs."""
    if folder is None:
        return False
    place, own = Path(os.path.realpath(path)), Path(os.path.realpath(folder))
    inside = place.relative_to(own).parts if place.is_relative_to(own) else ("",)
    return not inside or inside[0] in OUTPUTS


def _names(paths: Sequence[str]) -> list[str]:
    """Short names that differ in more than the case of letters.

    The name of the file without its ending; where that is not enough, with its ending and folders;
    where that is not enough, with a number.
    """

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
    names = [_file_name(name) for name in names]
    taken = {name.lower() for name in names}
    for i, is_repeated in enumerate(repeated(names)):
        if is_repeated:
            numbered = (f"{names[i]}-{k}" for k in count(i + 1))
            names[i] = next(each for each in numbered if each.lower() not in taken)
            taken.add(names[i].lower())
    return names


def _file_name(name: str) -> str:
    """A name that every file system takes and that fits into a line."""
    plain = [c if c.isprintable() and c not in '/\\:*?"<>|' else "_" for c in name]
    return "".join(plain).strip(" .")[-_LONGEST_NAME:] or "unit"
