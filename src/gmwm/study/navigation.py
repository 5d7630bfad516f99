"""The paper's experiment: does the better sensor model navigate better (its Figures 7 to 9)?

A static recording is calibrated three ways, by lines in the Allan plot (AV), by hand until the
filter works (KF-tuned, the paper's Table V) and by GMWM; filters with each of them navigate
on the same errors along a helicopter's mapping flight and a car's drive. Errors are drawn from the
paper's Table VI, or taken from real recordings: one is calibrated, the others are navigated with.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gmwm._core.files import write_text
from gmwm._core.typing import Progress
from gmwm.calibration import Calibration, calibrate
from gmwm.errors import InputError
from gmwm.estimate import AllanLines, estimate
from gmwm.estimate.result import Fit
from gmwm.ins import tuning
from gmwm.ins.fields import sensor_models
from gmwm.ins.filter import Outage, gnss
from gmwm.ins.sensors import AXES, Recorded, SensorModels
from gmwm.ins.simulation import Experiment, Scenario, Simulated, Validation
from gmwm.ins.trajectory import car_drive, helicopter_mapping
from gmwm.process import BiasInstability, GaussMarkov, Model, Process, RandomWalk, WhiteNoise
from gmwm.readers import Recording
from gmwm.study.summary import saved
from gmwm.variance import WaveletVariance

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TABLE_5 = sensor_models(
    {
        "gyro": {"N": "720 deg/h/sqrt(Hz)", "GM": [["180 deg/h", 1000.0]]},
        "accel": {"N": "100000 ug/sqrt(Hz)", "GM": [["40000 ug", 100.0]]},
    },
    "Table V",
)
"""What the paper's filter was tuned to by hand."""

TABLE_6 = sensor_models(
    {
        "gyro": {
            "N": "140 deg/h/sqrt(Hz)",
            "GM": [["113 deg/h", 2000.0], ["65 deg/h", 20.0], ["206 deg/h", 0.1]],
        },
        "accel": {"N": "140 ug/sqrt(Hz)", "GM": [["5 ug", 25.0], ["13 ug", 500.0]]},
    },
    "Table VI",
)
"""What the paper's GMWM found in an XSens MTi-G, read as plain standard deviations."""


FIGURES = ("fig7", "fig8", "fig9")

_HOURS, _RATE = 4.5, 100.0
_RUNS = 100
TEN = 10.0  # the folk rule
_HELICOPTER: tuple[Outage, ...] = (Outage(600.0, 60.0), Outage(1100.0, 60.0), Outage(1500.0, 60.0))
_CAR = (Outage(500.0, 60.0), Outage(900.0, 60.0))
_PAPER_CAR = (Outage(360.0, 50.0), Outage(1080.0, 40.0))
# s of a drive: the first outage is then straight on, the second one a corner
_FROM, _TO = 115.0, 1335.0


@dataclass(frozen=True, eq=False)
class Calibrated:
    """A static recording, calibrated by lines and by GMWM."""

    lines: dict[str, Fit]
    gmwm: Calibration

    @classmethod
    def of(cls, given: Recording | Calibration) -> Calibrated:
        """A recording calibrated both ways, or lines in the Allan plots of a calibration."""
        calibration = given if isinstance(given, Calibration) else calibrate(given)
        fits = calibration.fits
        return cls({axis: _read(fits[axis].wv) for axis in AXES if axis in fits}, calibration)

    def line_models(self) -> SensorModels:
        """What lines in the Allan plot give a filter: white noise, and what slow error they show.

        A random walk where there is a line of slope +1/2; otherwise a Gauss-Markov process as high
        as the floor and in its place; and where there is neither, as high as the lowest point of
        the plot, which is what is commonly read as bias instability. Every axis has a slow state.
        """
        return SensorModels.of({axis: _from_lines(each) for axis, each in self.lines.items()})

    def lineless(self) -> tuple[str, ...]:
        """Axes whose slow error lines do not show; see `line_models`."""
        return tuple(
            axis
            for axis, each in self.lines.items()
            if not {region.key for region in each.regions} & {"K", "B"}
        )

    def curve_models(self, horizon: float) -> SensorModels:
        """Two numbers off each Allan curve: N at 1 s, and K from its height at a horizon (s).

        K is read from the line of slope +1/2 through the deviation there.
        """
        models: dict[str, Model] = {}
        for axis, each in self.lines.items():
            walk = _at(each.wv, horizon) * np.sqrt(3.0 / horizon)
            models[axis] = WhiteNoise(_at(each.wv, tuning.WHITE_AT)) + RandomWalk(walk)
        return SensorModels.of(models)


def _read(wv: WaveletVariance) -> Fit:
    """Lines in an Allan plot; where none is straight, that of N at 1 s (IEEE Std 952)."""
    kind = WhiteNoise() + BiasInstability() + RandomWalk()
    try:
        return estimate(kind, wv, method=AllanLines())
    except InputError:
        octave = tuning.WHITE_AT * 2.0**-0.5, tuning.WHITE_AT * 2.0**0.5
        return estimate(kind, wv, method=AllanLines(regions={"N": octave}))


def _at(wv: WaveletVariance, time: float) -> float:
    """Allan deviation at an averaging time, s."""
    return float(np.exp(np.interp(np.log(time), np.log(wv.tau), np.log(wv.allan_deviation))))


def _from_lines(fitted: Fit) -> Model:
    regions = {region.key: region for region in fitted.regions}
    wv = fitted.wv
    # Without a line of slope -1/2, N is what the plot shows at 1 s.
    white = fitted.params["N"] if "N" in regions else _at(wv, tuning.WHITE_AT)
    slow: Process
    if "K" in regions:
        slow = RandomWalk(fitted.params["K"])
    elif "B" in regions:
        floor = regions["B"]
        slow = GaussMarkov.of_peak(floor.coefficient, float(np.sqrt(floor.tau_min * floor.tau_max)))
    else:
        lowest = int(np.argmin(wv.allan_deviation))
        slow = GaussMarkov.of_peak(float(wv.allan_deviation[lowest]), float(wv.tau[lowest]))
    return Model((WhiteNoise(white), slow))


def static_recording(seed: int) -> Recording:
    """4.5 hours at 100 Hz of an IMU like that of Table VI."""
    n = round(_HOURS * 3600.0 * _RATE)
    errors = TABLE_6.simulate(n, 1.0 / _RATE, np.random.default_rng([seed, 6])).total
    channels = {axis: errors[:, i] for i, axis in enumerate(AXES)}
    return Recording.from_arrays(channels, _RATE, {"gyro": "rad/s", "accel": "m/s^2"})


def experiment(
    vehicle: str, calibrated: Calibrated, runs: int, seed: int, recordings: Sequence[Recording] = ()
) -> Experiment:
    """Filters with different calibrations, on a helicopter or in a car.

    recordings: The one that was calibrated, and those whose errors are navigated with; by default
        errors of Table VI are drawn.
    """
    scenario = scenario_of(vehicle)
    lines = calibrated.line_models()
    filters = {"GMWM": SensorModels.of(calibrated.gmwm), "AV": lines}
    if recordings:
        source = Recorded.of(recordings[1:], scenario.trajectory.duration)
        filters["AV x 10"] = times(lines, TEN)
        start = Recorded.of(recordings[0], tuning.BIAS_WINDOW).bias_sd
        filters = {name: aligned(models, start) for name, models in filters.items()}
        title = f"{vehicle}, errors of {source.source}"
        return Experiment(scenario, source, filters, None, runs, seed, title)
    filters |= {"KF-tuned": TABLE_5, "truth": TABLE_6}
    title = f"{vehicle}, errors of Table VI"
    return Experiment(scenario, Simulated(TABLE_6), filters, TABLE_6, runs, seed, title)


def scenario_of(vehicle: str) -> Scenario:
    """The mission of a vehicle, with its outages.

    vehicle: {"helicopter", "car", "paper-car"}; the last has the paper's outages, 50 s after 6 min
        of simple motion and 40 s after 18 min with a corner between two stops.
    """
    if vehicle == "helicopter":
        trajectory, outages = helicopter_mapping(), _HELICOPTER
    elif vehicle == "car":
        trajectory, outages = car_drive(), _CAR
    else:
        trajectory, outages = car_drive(duration=_TO).segment(_FROM, _TO), _PAPER_CAR
    return Scenario(trajectory, gnss(trajectory, velocity_sd=tuning.VELOCITY_SD), outages)


def aligned(models: SensorModels, start: Mapping[str, float]) -> SensorModels:
    """Models for filters that start at any time, when the slow error is not zero.

    start: Axis -> scatter of the means over a minute of the recording that was calibrated. What a
        model's stationary terms do not explain of it is the standard deviation of a constant, or of
        the start of a random walk.
    """
    bias = {}
    for axis, model in models.models.items():
        own = model.white_density() / tuning.BIAS_WINDOW
        for term in model.terms:
            if isinstance(term, GaussMarkov):  # its variance, and that of its means over a minute
                share = float(term.tau or 0.0) / tuning.BIAS_WINDOW
                within = 2.0 * share * (1.0 - share * -np.expm1(-1.0 / share))
                own += float(term.sigma or 0.0) ** 2 * float(within)
        bias[axis] = float(np.sqrt(max(start[axis] ** 2 - own, 0.0)))
    return SensorModels(models.models, bias)


def times(models: SensorModels, factor: float) -> SensorModels:
    """All amplitudes times a factor."""
    larger = {}
    for axis, model in models.models.items():
        amplitudes = (p for p in model.parameters if p.parameter.name in ("N", "K", "sigma"))
        larger[axis] = model.with_params(
            {p.key: float(p.value or 0.0) * factor for p in amplitudes}
        )
    return SensorModels(larger)


def check_channels(figure: str, recordings: Sequence[Recording], needed: Sequence[str]) -> None:
    """Raise `InputError` if a recording lacks a channel that a figure needs."""
    for recording in recordings:
        missing = [axis for axis in needed if axis not in recording.names]
        if missing:
            raise InputError(
                f"{recording.source}: channel {missing[0]} is missing: {figure} needs "
                f"{', '.join(needed)}"
            )


def reproduce_figure(
    figure: str,
    folder: Path,
    *,
    runs: int | None,
    seed: int,
    jobs: int,
    recordings: Sequence[Recording] = (),
    resume: bool = False,
    progress: Progress | None = None,
) -> tuple[str, list[Path]]:
    """Draw one of the paper's Figures 7 to 9.

    figure: One of `FIGURES`. 7 and 8 are of the same runs.
    folder: Where figures and tables go, and finished runs, every few seconds.
    recordings: The first is calibrated, the others are navigated with.
    Returns: what to print, and the files that were written.
    """
    if len(recordings) == 1:
        raise InputError("give two recordings or more: one to calibrate, others to navigate with")
    first = recordings[0] if recordings else static_recording(seed)
    check_channels(figure, [first], AXES)
    vehicle = "paper-car" if figure == "fig9" else "helicopter"
    planned = experiment(vehicle, Calibrated.of(first), runs or _RUNS, seed, recordings)
    validation = Validation.of(
        planned,
        jobs=jobs,
        folder=folder / f"{vehicle}-runs",
        earlier="resume" if resume else "refuse",
        progress=progress,
    )
    draw: dict[str, Callable[[], Figure]] = {
        "fig7": validation.plot_track,
        "fig8": validation.plot_errors,
        "fig9": validation.plot_growth,
    }
    text, stem = str(validation), folder / figure
    return text, [write_text(stem.with_suffix(".txt"), text), *saved(draw[figure](), stem)]
