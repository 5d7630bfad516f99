"""Runs of a Monte Carlo study: in parallel, kept on disk, resumable.

A run is a function of its number: whoever does it, and in whatever order, it gives the same.
"""

import json
import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from time import monotonic
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from gmwm._core import checks
from gmwm._core.documents import read_arrays
from gmwm._core.files import folder_to_fill, moved_into_place, one_writer
from gmwm._core.jobs import results
from gmwm._core.typing import Progress
from gmwm.errors import InputError

Work = Callable[[int], Mapping[str, Any]]
"""Does a run of a number: name -> a number, text or array, of the same shape in every run."""

Values = dict[str, npt.NDArray[Any]]
"""Name -> values; of several runs, the run is the first axis."""

Earlier = Literal["resume", "replace", "refuse"]
"""What to do with runs that are kept already."""

_SECONDS_PER_PART = 10.0  # lost at most where the machine fails
_VALUES = "values/"

_log = logging.getLogger(__name__)


def do_runs(
    work: Work,
    runs: int,
    study: Mapping[str, Any],
    *,
    folder: Path | None = None,
    earlier: Earlier = "resume",
    jobs: int = 1,
    cluster: str | None = None,
    progress: Progress | None = None,
) -> Values:
    """Do the runs 0 to ``runs - 1``, or those that are missing.

    work: Can be pickled.
    study: What runs depend on, in JSON types. Those of another study are never mixed in.
    folder: Where finished runs are kept every few seconds, also when the work is interrupted.
    earlier: {"resume", "replace", "refuse"}, what to do with runs that the folder holds already.
    Returns: name -> values of all runs in order, the run on the first axis.
    Raises InputError if the folder cannot be used, is in use, or holds runs of another study (code
        "other-runs") or runs that are not to be resumed (code "earlier-runs"); or if no scheduler
        answers.
    """
    with _store(folder, study, earlier) as store:
        todo = [run for run in range(runs) if run not in store.runs]
        progress = progress or (lambda *_: None)
        progress(runs - len(todo), runs, "")
        with closing(results(work, todo, jobs=jobs, cluster=cluster)) as found:
            for done, (run, values) in enumerate(found, runs - len(todo) + 1):
                store.add(run, values)
                progress(done, runs, "")
    try:
        return _stacked([store.runs[run] for run in range(runs)])
    except (LookupError, ValueError):  # of a file that others wrote
        raise InputError(
            f"{folder} holds runs with other values: give another folder", "other-runs"
        ) from None


class _Store:
    """Finished runs of a study, and the files that hold them, whole; None keeps nothing on disk."""

    def __init__(self, folder: Path | None, study: dict[str, Any]) -> None:
        self.runs: dict[int, Mapping[str, Any]] = {}
        self._folder, self._study = folder, study
        self._unsaved: list[int] = []
        self._since = monotonic()
        self._next = 0

    def add(self, run: int, values: Mapping[str, Any]) -> None:
        """Keep a run; runs are written every few seconds."""
        self.runs[run] = values
        self._unsaved.append(run)
        if monotonic() - self._since > _SECONDS_PER_PART:
            self.save()

    def save(self) -> None:
        """Write what is not written yet."""
        if self._folder is not None and self._unsaved:
            arrays: dict[str, Any] = _stacked([self.runs[run] for run in self._unsaved])
            path = self._folder / f"part-{self._next:05d}.npz"
            # numpy adds the suffix to names without it, so the stream is opened here.
            with moved_into_place(path) as temporary, temporary.open("wb") as stream:
                np.savez(
                    stream,
                    study=np.array(json.dumps(self._study)),
                    run=np.array(self._unsaved),
                    **{_VALUES + name: each for name, each in arrays.items()},
                )
            self._next += 1
        self._unsaved = []
        self._since = monotonic()

    def read(self, part: Path) -> None:
        """Take the runs of a file, and write after it."""
        try:
            self._next = max(self._next, int(part.stem.rpartition("-")[2]) + 1)
            values = read_arrays(part)
            study, runs = dict(json.loads(str(values.pop("study")))), values.pop("run")
            if any(each.shape[:1] != runs.shape for each in (runs.ravel(), *values.values())):
                raise ValueError("arrays of other shapes than those of runs")
        except Exception as error:  # numpy, zipfile and zlib raise a dozen types
            which = checks.line(str(error))
            _log.warning("%s is damaged (%s): its runs are done again", part, which)
            return
        if study != self._study:
            names = sorted(k for k in {*study, *self._study} if study.get(k) != self._study.get(k))
            raise InputError(
                f"{part} belongs to another study (other {', '.join(names)}): give another folder",
                "other-runs",
            )
        for i, run in enumerate(runs.tolist()):
            self.runs[run] = {k.removeprefix(_VALUES): each[i] for k, each in values.items()}


def _stacked(rows: Sequence[Mapping[str, Any]]) -> Values:
    return {name: np.stack([row[name] for row in rows]) for name in rows[0]}


@contextmanager
def _store(folder: Path | None, study: Mapping[str, Any], earlier: Earlier) -> Iterator[_Store]:
    """What is kept of a study, for one writer at a time; saved in any case at the end."""
    from gmwm._core import __version__

    # Another version of the program may give other numbers.
    store = _Store(folder, json.loads(json.dumps({**study, "version": __version__})))
    if folder is None:
        yield store
        return
    with folder_to_fill(folder), one_writer(folder):
        try:
            parts = sorted(folder.glob("part-*.npz"))
            if parts and earlier == "refuse":
                raise InputError(
                    f"{folder} holds runs of an earlier study: resume it, or give another folder",
                    "earlier-runs",
                )
            for part in parts:
                if earlier == "replace":
                    part.unlink()
                else:
                    store.read(part)
            yield store
        finally:
            store.save()
