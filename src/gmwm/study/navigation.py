"""The paper's experiment: does the better sensor model navigate better (its Figures 5 to 9)?

A static recording is calibrated three ways, by lines in the Allan plot (AV), by hand until the
filter works (KF-tuned, the paper's Table V) and by GMWM; filters that believe each of them navigate
on the same errors along a helicopter's mapping flight and a car's drive. Errors are drawn from the
paper's Table VI, or taken from real recordings: one is calibrated, the others are navigated with.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gmwm._core.files import moved_into_place, written
from gmwm._core.typing import Progress
from gmwm.calibration import Calibration, calibrate
from gmwm.errors import InputError
from gmwm.estimate import fit
from gmwm.estimate.result import Fit
from gmwm.ins import tuning
from gmwm.ins.filter import Outage, gnss
from gmwm.ins.imu import AXES, Recorded, SensorModels
from gmwm.ins.montecarlo import Experiment, Scenario, Simulated, Validation
from gmwm.ins.trajectory import car_drive, helicopter_mapping
from gmwm.process import BiasInstability, GaussMarkov, Model, Process, RandomWalk, WhiteNoise
from gmwm.readers import Recording
from gmwm.study.sensor_tables import TABLE_5, TABLE_6

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIGURES = ("fig5", "fig6", "fig7", "fig8", "fig9")

_OF_ONE_GYRO = ("fig5", "fig6")
_HOURS, _RATE = 4.5, 100.0
_SHOWN = "gyro_x"  # of the Allan plots
_RUNS = 100
_TEN = 10.0  # the folk rule
_HELICOPTER = (Outage(600.0, 60.0), Outage(1100.0, 60.0), Outage(1500.0, 60.0))
_CAR = (Outage(500.0, 60.0), Outage(900.0, 60.0))


@dataclass(frozen=True, eq=False)
class Calibrated:
    """A static recording, calibrated by lines and by GMWM.

    Attributes
    ----------
    lines : dict
        Axis -> fit by ``method="allan"``.
    gmwm : Calibration
    """

    lines: dict[str, Fit]
    gmwm: Calibration

    @classmethod
    def of(cls, recording: Recording, progress: Progress | None = None) -> Calibrated:
        """Calibrate a recording both ways."""
        calibration = calibrate(recording, progress=progress)
        kind = WhiteNoise() + BiasInstability() + RandomWalk()
        lines = {
            axis: fit(kind, calibration[axis].wv, method="allan")
            for axis in AXES
            if axis in calibration.fits
        }
        return cls(lines, calibration)

    def line_models(self) -> SensorModels:
        """What lines in the Allan plot give a filter: white noise, and what slow error they show.

        A random walk where there is a line of slope +1/2; otherwise a Gauss-Markov process as high
        as the floor and in its place, where there is one.
        """
        return SensorModels.of({axis: _from_lines(each) for axis, each in self.lines.items()})


def _from_lines(fitted: Fit) -> Model:
    regions = {region.key: region for region in fitted.regions}
    wv = fitted.wv
    at_one = float(np.exp(np.interp(0.0, np.log(wv.tau), np.log(wv.allan_deviation))))
    # Without a line of slope -1/2, N is what the plot shows at 1 s.
    terms: list[Process] = [WhiteNoise(fitted.params["N"] if "N" in regions else at_one)]
    if "K" in regions:
        terms.append(RandomWalk(fitted.params["K"]))
    elif "B" in regions:
        floor = regions["B"]
        centre = float(np.sqrt(floor.tau_min * floor.tau_max))
        terms.append(GaussMarkov.of_peak(floor.coefficient, centre))
    return Model(tuple(terms))


def static_recording(seed: int) -> Recording:
    """4.5 hours at 100 Hz of an IMU like that of Table VI."""
    n = round(_HOURS * 3600.0 * _RATE)
    errors = TABLE_6.simulate(n, 1.0 / _RATE, np.random.default_rng([seed, 6])).total
    channels = {axis: errors[:, i] for i, axis in enumerate(AXES)}
    return Recording.from_arrays(channels, _RATE, {"gyro": "rad/s", "accel": "m/s^2"})


def experiment(
    vehicle: str,
    calibrated: Calibrated,
    runs: int,
    seed: int,
    recordings: Sequence[Recording] = (),
) -> Experiment:
    """Filters that believe different calibrations, on a helicopter or in a car.

    Parameters
    ----------
    vehicle : {"helicopter", "car"}
    calibrated : Calibrated
    runs, seed : int
    recordings : sequence of Recording, optional
        Whose errors are navigated with; by default those of Table VI are drawn.
    """
    trajectory = helicopter_mapping() if vehicle == "helicopter" else car_drive()
    outages = _HELICOPTER if vehicle == "helicopter" else _CAR
    scenario = Scenario(trajectory, gnss(trajectory, velocity_sd=tuning.VELOCITY_SD), outages)
    lines = calibrated.line_models()
    filters = {"GMWM": SensorModels.of(calibrated.gmwm), "AV": lines}
    if recordings:
        source = Recorded.of(recordings, trajectory.duration)
        filters["AV x 10"] = _times(lines, _TEN)
        # A recording that is entered anywhere has a slow error from the first sample on.
        filters = {
            name: SensorModels(models.models, _bias(models, source))
            for name, models in filters.items()
        }
        title = f"{vehicle}, errors of {source.source}"
        return Experiment(scenario, source, filters, None, runs, seed, title)
    filters |= {"KF-tuned": TABLE_5, "truth": TABLE_6}
    title = f"{vehicle}, errors of Table VI"
    return Experiment(scenario, Simulated(TABLE_6), filters, TABLE_6, runs, seed, title)


def _bias(models: SensorModels, source: Recorded) -> dict[str, float]:
    """Standard deviation of a constant, where the model has no stationary slow term."""
    walks = {
        axis: any(term.is_walk for term in model.terms) for axis, model in models.models.items()
    }
    return {axis: source.bias_sd[axis] if walks[axis] else 0.0 for axis in AXES}


def _times(models: SensorModels, factor: float) -> SensorModels:
    """All amplitudes times a factor."""
    return SensorModels(
        {
            axis: model.with_params(
                {
                    item.key: float(item.value or 0.0) * factor
                    for item in model.parameters
                    if item.parameter.name in ("N", "K", "sigma")
                }
            )
            for axis, model in models.models.items()
        }
    )


def reproduce_figure(
    figure: str,
    folder: Path,
    *,
    runs: int | None,
    seed: int,
    jobs: int,
    recordings: Sequence[Recording] = (),
    progress: Progress | None = None,
) -> tuple[str, list[Path]]:
    """Draw one of the paper's Figures 5 to 9.

    Parameters
    ----------
    figure : str
        One of `FIGURES`.
    folder : Path
        Where figures and tables go.
    runs : int or None
    seed, jobs : int
    recordings : sequence of Recording, optional
        The first is calibrated, the others are navigated with.
    progress : callable, optional
        Called with the number of runs done.

    Returns
    -------
    text, paths
        What to print, and the files that were written.
    """
    if figure not in _OF_ONE_GYRO and len(recordings) == 1:
        raise InputError("give two recordings or more: one to calibrate, others to navigate with")
    first = recordings[0] if recordings else static_recording(seed)
    needed = (_SHOWN,) if figure in _OF_ONE_GYRO else AXES
    missing = [axis for axis in needed if axis not in first.names]
    if missing:
        raise InputError(
            f"{first.source}: there is no channel {missing[0]}: {figure} needs {', '.join(needed)}"
        )
    calibrated = Calibrated.of(first)
    if figure in _OF_ONE_GYRO:
        import matplotlib.pyplot as plt

        shown = calibrated.lines[_SHOWN] if figure == "fig5" else calibrated.gmwm[_SHOWN]
        drawn, axes = plt.subplots(figsize=(7.0, 4.6), layout="constrained")
        shown.plot(axes)
        return str(shown), _saved(drawn, folder / figure)
    vehicle = "car" if figure == "fig9" else "helicopter"
    validation = Validation.of(
        experiment(vehicle, calibrated, runs or _RUNS, seed, recordings[1:]),
        jobs=jobs,
        progress=progress,
    )
    draw: dict[str, Callable[[], Figure]] = {
        "fig7": validation.plot_track,
        "fig8": validation.plot_errors,
        "fig9": validation.plot_growth,
    }
    text = str(validation)
    target = folder / f"{figure}.txt"
    with written(target) as stream:
        stream.write(text + "\n")
    return text, [target, *_saved(draw[figure](), folder / figure)]


def _saved(figure: Figure, stem: Path) -> list[Path]:
    import matplotlib.pyplot as plt

    paths = [stem.with_suffix(suffix) for suffix in (".png", ".svg")]
    for path in paths:
        with moved_into_place(path) as temporary:
            figure.savefig(temporary, format=path.suffix[1:], dpi=150)
    plt.close(figure)
    return paths
