"""Calibrate every recording in turn and navigate with the others, by filters of equal standing.

Every filter has a slow state on every axis; its sensor model comes from the one recording that is
calibrated.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from gmwm import filter_numbers
from gmwm._core.documents import Document
from gmwm._core.files import folder_to_fill, written
from gmwm._core.runs import Earlier
from gmwm._core.typing import Progress
from gmwm.calibration import Calibration, calibrate
from gmwm.errors import InputError
from gmwm.filter_numbers import SensorNumbers
from gmwm.ins.imu import AXES, Recorded, SensorModels
from gmwm.ins.simulation import Experiment, Validation
from gmwm.issues import Notice, notice
from gmwm.readers import Recording
from gmwm.study.figures import saved
from gmwm.study.navigation import TEN, Calibrated, aligned, scenario_of, times
from gmwm.study.rotation import FIRST, Rotation

_D = TypeVar("_D", bound=Document)


def rotate(
    vehicle: str,
    recordings: Sequence[Recording],
    folder: Path,
    *,
    runs: int | None = None,
    seed: int = 0,
    jobs: int = 1,
    earlier: Earlier = "refuse",
    progress: Progress | None = None,
) -> Rotation:
    """Calibrate every recording in turn, and navigate with the others.

    vehicle: {"helicopter", "car"}.
    recordings: Two at least.
    folder: Where calibrations and finished runs are kept, so that work that was interrupted goes
        on.
    runs: Most stretches of each recording; by default all that do not overlap.
    earlier: {"resume", "replace", "refuse"}, what to do with what the folder holds.
    progress: Called as ``progress(done, total, what)``.
    Raises InputError if there are fewer than two recordings, an axis is missing, one is too short,
        or the folder holds runs that are not to be resumed.
    """
    if len(recordings) < 2:
        raise InputError("give two recordings or more: each is calibrated in turn")
    scenario = scenario_of(vehicle)
    horizon = max(outage.duration for outage in scenario.outages)
    parts = [
        _shortened(Recorded.of(recording, scenario.trajectory.duration), runs)
        for recording in recordings
    ]
    kept = folder / "calibrations"
    if earlier == "refuse" and kept.exists():
        raise InputError(
            f"{folder} holds calibrations of an earlier study: resume it, or give another folder",
            "earlier-runs",
        )
    turns: list[Validation] = []
    notices: list[Notice] = []
    with folder_to_fill(kept):
        for i, recording in enumerate(recordings):
            if progress is not None:
                progress(i, len(recordings), recording.source)
            filters, found = _filters(recording, parts[i].bias_sd, horizon, kept)
            notices += found
            source = _joined([part for j, part in enumerate(parts) if j != i])
            total = len(source.stretches)
            title = f"{vehicle}, real errors"
            turns.append(
                Validation.of(
                    Experiment(scenario, source, filters, None, total, seed, title),
                    jobs=jobs,
                    folder=folder / f"{vehicle}-{i + 1}",
                    earlier="resume",
                )
            )
            notices += [replace(each, source=recording.source) for each in turns[-1].notices]
    if progress is not None:
        progress(len(recordings), len(recordings), "")
    return Rotation(
        sources=tuple(recording.source for recording in recordings),
        stretches=tuple(len(part.stretches) for part in parts),
        turns=tuple(turns),
        notices=tuple(notices),
    )


def reproduce_rotation(
    figure: str,
    folder: Path,
    *,
    runs: int | None,
    seed: int,
    jobs: int,
    recordings: Sequence[Recording],
    resume: bool,
    progress: Progress | None = None,
) -> tuple[str, list[Path]]:
    """Figure 8 (helicopter) or 9 (car) with every recording calibrated in turn.

    Returns: what to print, and the files that were written.
    """
    for recording in recordings:
        missing = [axis for axis in AXES if axis not in recording.names]
        if missing:
            raise InputError(
                f"{recording.source}: channel {missing[0]} is missing: {figure} needs "
                f"{', '.join(AXES)}"
            )
    rotation = rotate(
        "car" if figure == "fig9" else "helicopter",
        recordings,
        folder,
        runs=runs,
        seed=seed,
        jobs=jobs,
        earlier="resume" if resume else "refuse",
        progress=progress,
    )
    text, paths = str(rotation), []
    for suffix, content in (("txt", text), ("md", rotation.markdown())):
        paths.append(folder / f"{figure}-rotated.{suffix}")
        with written(paths[-1]) as stream:
            stream.write(content + "\n")
    return text, [*paths, *saved(rotation.plot(), folder / f"{figure}-rotated")]


def _filters(
    recording: Recording, start: dict[str, float], horizon: float, folder: Path
) -> tuple[dict[str, SensorModels], list[Notice]]:
    """Sensor models of the filters, from the one recording that is calibrated."""
    stem = _digest(recording)

    def kept(kind: type[_D], what: str, make: Callable[[], _D]) -> _D:
        path = folder / f"{stem}-{what}.json"
        if path.exists():
            return kind.load(path)
        made = make()
        made.save(path)
        return made

    calibration = kept(Calibration, "calibration", lambda: calibrate(recording))
    found = Calibrated.by_lines_too(calibration)
    lines = found.line_models()
    filters = {
        FIRST: aligned(SensorModels.of(calibration), start),
        "lines": aligned(lines, start),
        "lines x 10": aligned(times(lines, TEN), start),
        "N+K read off": aligned(found.curve_models(horizon), start),
    }
    bound, reduce = filter_numbers.bound, filter_numbers.reduce
    for name, numbers in {
        "N+K bound": kept(
            SensorNumbers, f"bound-N+K-{horizon:g}", lambda: bound(calibration, "N+K", horizon)
        ),
        "N+K+GM bound": kept(
            SensorNumbers,
            f"bound-N+K+GM-{horizon:g}",
            lambda: bound(calibration, "N+K+GM", horizon),
        ),
        "N+K reduced": kept(
            SensorNumbers, f"reduce-N+K-{horizon:g}", lambda: reduce(calibration, "N+K", [horizon])
        ),
    }.items():
        models = {axis: numbers[axis].model for axis in AXES}
        filters[name] = SensorModels(models, {axis: numbers[axis].initial_sd for axis in AXES})
    axes = found.lineless()
    notices = []
    if axes:
        found_none = notice("no-line", "", {"axes": ", ".join(axes)})
        notices.append(replace(found_none, source=recording.source))
    return filters, notices


def _digest(recording: Recording) -> str:
    """Of what a calibration depends on: the samples, and the version of the program."""
    from gmwm._core import __version__

    digest = hashlib.sha256(f"{__version__} {recording.source} {recording.dt!r}".encode())
    for axis in AXES:
        digest.update(np.ascontiguousarray(recording[axis].values).tobytes())
    return digest.hexdigest()[:16]


def _shortened(part: Recorded, most: int | None) -> Recorded:
    return part if most is None else replace(part, stretches=part.stretches[:most])


def _joined(parts: Sequence[Recorded]) -> Recorded:
    return replace(
        parts[0],
        stretches=tuple(each for part in parts for each in part.stretches),
        source=", ".join(part.source for part in parts),
    )
