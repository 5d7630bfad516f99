"""Finished runs in a folder, so that an interrupted study goes on."""

from __future__ import annotations

import json
import zipfile
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from gmwm._core.files import moved_into_place
from gmwm.errors import InputError
from gmwm.ins.montecarlo.runs import Runs

CHUNK = 10
"""Runs that a worker does, and a file holds, at a time."""

Chunk = dict[str, Runs]
"""Filter -> its runs."""


@dataclass(frozen=True)
class RunStore:
    """Finished chunks in a folder, or none.

    Attributes
    ----------
    folder : Path or None
    runs : int
        Of the whole study.
    """

    folder: Path | None
    runs: int

    @classmethod
    def of(cls, folder: Path | None, fingerprint: str, runs: int) -> RunStore:
        """A folder for the runs of one study; ``None`` keeps nothing.

        Raises
        ------
        InputError
            If it cannot be used, or holds the runs of a study of another fingerprint.
        """
        if folder is None:
            return cls(None, runs)
        mark = folder / "study.json"
        wanted = {"fingerprint": fingerprint, "chunk": CHUNK}
        try:
            folder.mkdir(parents=True, exist_ok=True)
            if mark.exists():
                if json.loads(mark.read_text(encoding="utf-8")) != wanted:
                    raise InputError(f"{folder} holds the runs of another study: give a new folder")
            else:
                mark.write_text(json.dumps(wanted), encoding="utf-8")
        except (OSError, json.JSONDecodeError, UnicodeDecodeError) as error:
            raise InputError(f"{folder}: cannot be used ({error}): give another folder") from None
        return cls(folder, runs)

    def path(self, start: int) -> Path | None:
        """File of the chunk that begins with a run."""
        if self.folder is None:
            return None
        return self.folder / f"runs-{start}-{min(start + CHUNK, self.runs)}.npz"

    def put(self, start: int, chunk: Chunk) -> None:
        """Keep a finished chunk; its file appears whole or not at all.

        Raises
        ------
        InputError
            If it cannot be written.
        """
        path = self.path(start)
        if path is None:
            return
        arrays = {
            f"{name}/{each.name}": getattr(runs, each.name)
            for name, runs in chunk.items()
            for each in fields(Runs)
        }
        # numpy adds the suffix to names without it, so the stream is opened here.
        with moved_into_place(path) as partial, partial.open("wb") as stream:
            np.savez(stream, **arrays)

    def get(self, start: int) -> Chunk | None:
        """A finished chunk; ``None`` if there is none, or its file is damaged."""
        path = self.path(start)
        if path is None or not path.exists():
            return None
        try:
            with path.open("rb") as file, np.load(file) as content:
                names = dict.fromkeys(key.rpartition("/")[0] for key in content.files)
                return {
                    name: Runs(
                        **{each.name: content[f"{name}/{each.name}"] for each in fields(Runs)}
                    )
                    for name in names
                }
        except (OSError, EOFError, ValueError, KeyError, zipfile.BadZipFile):
            return None
