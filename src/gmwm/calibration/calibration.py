"""The main job: a recording in, an error model for every channel out."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from annotated_types import Ge, MinLen

from gmwm._core import checks
from gmwm._core.documents import Document, Rate, Samples, Text
from gmwm._core.files import of_other_runs
from gmwm._core.frozen import ByName, freeze
from gmwm._core.pages import make
from gmwm._core.text import frame, wrapped
from gmwm.calibration.covariates import compensated
from gmwm.calibration.curve import BiasCurve
from gmwm.calibration.numbers import SensorNumbers, axis_numbers
from gmwm.calibration.scaling import with_noise
from gmwm.errors import InputError, MissingNameError
from gmwm.estimate import Estimate, Fit
from gmwm.issues import Notice, notice
from gmwm.plotting import straight_lines
from gmwm.process import Model
from gmwm.readers import Recording

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure


Index = Annotated[int, Ge(0)]

COMPANIONS = ("report.html", "imu.yaml")
"""Files that are written with a calibration's own, and carry its mark."""


@dataclass(frozen=True, repr=False)
class Calibration(ByName[Fit], Document):
    """Error models of the channels of a recording: a mapping of their names to `Fit`.

    Attributes
    ----------
    fits : dict
        Channel name -> `Fit`.
    skipped : dict
        Channel name -> `Notice` of why it has none.
    source : str
        What was calibrated.
    rate : float
        Sampling rate, Hz; the highest, where channels have their own, which is that of ``fit.wv``.
    n : int
        Samples per channel of that rate, of all recordings.
    notices : tuple of Notice
        Those of the reader; what was found in the recording, worst first in each channel, with
        what was done about it, if it was examined; with the code "ambiguity", which models
        describe a channel equally well, and with "unresolved-walk", which walk may be there.
    rivals : dict
        Channel name -> the models, with their values, that describe it as well as the chosen one;
        the last is that with the largest random walk that the record leaves open, if the chosen
        one has none and the deviation at 600 s grows by a tenth with it.
    left_out : dict
        Channel name -> samples of shocks and spikes that were left out, as pairs of the first and
        the one after the last; of a single recording.
    curves : dict
        Channel name -> `BiasCurve` against the covariates, which the fits do not contain.
    """

    SCHEMA: ClassVar[str] = "gmwm.calibration"
    KEYS: ClassVar[Mapping[str, str]] = {"rate": "rate_hz", "fits": "channels"}
    LATER: ClassVar[frozenset[str]] = frozenset({"rivals", "left_out", "curves"})
    SCHEMA_VERSION: ClassVar[int] = 2

    _held = "fits"
    _unknown = "the calibration has no model of channel {name!r}: it has {known}"

    fits: Annotated[Mapping[Text, Fit], MinLen(1)]
    skipped: Mapping[Text, Notice]
    source: Text
    rate: Rate
    n: Samples
    notices: tuple[Notice, ...] = ()
    rivals: Mapping[str, tuple[Model, ...]] = field(default_factory=dict)
    left_out: Mapping[str, tuple[tuple[Index, Index], ...]] = field(default_factory=dict)
    curves: Mapping[str, BiasCurve] = field(default_factory=dict)

    def __post_init__(self) -> None:
        freeze(self, "fits", "skipped", "rivals", "left_out", "curves")

    def __getitem__(self, name: str) -> Fit:
        if name in self.skipped and name not in self.fits:
            text = f"the calibration has no model of channel {name!r}: {self.skipped[name].text}"
            raise MissingNameError(text)
        return super().__getitem__(name)

    @property
    def duration(self) -> float:
        """Length of the recording, s."""
        return self.n / self.rate

    @property
    def has_one_rate(self) -> bool:
        """Whether all channels have the sampling rate `rate`."""
        return not any(
            notice.code == "topics-joined" and notice.values["rates"] > 1 for notice in self.notices
        )

    @property
    def valid(self) -> bool:
        """Whether every channel has a valid fit."""
        return not self.skipped and all(fit.valid for fit in self.fits.values())

    @property
    def is_examined(self) -> bool:
        """Whether the recording was examined before the fits."""
        return any(notice.code == "length" for notice in self.notices)

    @cached_property
    def numbers(self) -> SensorNumbers:
        """N, B and K of every axis: what a data sheet states."""
        return SensorNumbers(
            {name: axis_numbers(fit, self.rivals.get(name, ())) for name, fit in self.items()}
        )

    def at(self, x: float) -> Calibration:
        """The same with the fast noise that it has at a value of the covariate.

        White noise, N, its error and the variances are those at this temperature in place of the
        average over the recording, so that filter numbers, budgets and files of it are.

        Parameters
        ----------
        x : float
            Of the first covariate, such as a temperature in degC.

        Raises
        ------
        InputError
            If the recording does not cover it, or it has no covariate.
        """
        fits, rivals, curves = dict(self.fits), dict(self.rivals), dict(self.curves)
        if not curves:
            raise InputError(
                f"the noise at {x:g} is not known: calibrate with "
                'covariates={"temperature": "auto"}'
            )
        for name, curve in self.curves.items():
            factor, own = float(curve.noise_factor(x)), curve.scaling
            assert own is not None
            fits[name] = own.at(self.fits[name], x)
            rivals[name] = tuple(with_noise(each, factor) for each in self.rivals.get(name, ()))
            curves[name] = replace(curve, scaling=replace(own, reference=x))
        unit = next(iter(self.curves.values())).covariates[0].unit
        source = f"{self.source or 'a recording'} at {x:g} {unit}"
        return replace(self, fits=fits, rivals=rivals, curves=curves, source=source)

    def compensated(self, recording: Recording) -> Recording:
        """A recording of the sensor less what its curves say that the covariates add.

        The level, a turn-on bias or gravity, stays. Beyond its range a curve is held at its end,
        and a notice of the recording says for how long.

        Raises InputError if the recording has no channel of a covariate.
        """
        return compensated(recording, self.curves)[0]

    def __repr__(self) -> str:
        channels = [name if fit.valid else f"{name} (not valid)" for name, fit in self.items()]
        channels += [f"{name} (skipped)" for name in self.skipped]
        return f"<Calibration of {self.source or 'a recording'}: {', '.join(channels)}>"

    def _repr_html_(self) -> str:
        html: str = make("fragment", self)
        return html

    def __str__(self) -> str:
        """The sensor numbers; ``print(cal["gyro_x"])`` shows the terms of a model."""
        size = f"{self.duration:.6g} s at {self.rate:g} Hz, {self.n:,} samples a channel"
        lines = wrapped(f"{self.source or 'a recording'}: {size}", indent=2)
        health = make("verdict", self)
        lines += [*wrapped(f"{health['word']}: {health['text']}.", indent=2), ""]
        lines += str(self.numbers).splitlines()
        for name, why in self.skipped.items():
            lines += wrapped(f"{name}: skipped, {why.text}", indent=2)
        return "\n".join(lines)

    def plot(self, channels: Iterable[str] | None = None, *, units: str = "field") -> Figure:
        """Allan deviations with models, N, B and K, three channels a row; see `Fit.plot`.

        Parameters
        ----------
        channels : iterable of str, optional
            Names; all by default.
        units : {"field", "si"}

        Raises
        ------
        InputError
            If there is no such channel, or none at all.
        """
        import matplotlib.pyplot as plt

        names = list(self if channels is None else channels)
        if not names:
            raise InputError(f"no channel was selected: choose from {', '.join(self)}")
        rows, columns = -(-len(names) // 3), min(len(names), 3)
        figure, axes = plt.subplots(rows, columns, squeeze=False, layout="constrained")
        figure.set_size_inches(max(7.0, 5.0 * columns), 5.5 * rows)
        for name, ax in zip(names, axes.flat, strict=False):
            straight_lines(self[name].plot(ax, units=units), self.numbers[name].lines(units))
            ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=2, fontsize="small")
        for ax in axes.flat[len(names) :]:
            ax.remove()
        return figure

    def to_frame(self, content: str = "numbers", *, units: str = "field") -> pandas.DataFrame:
        """A table of the sensor numbers, or of the terms of all models; needs pandas.

        Parameters
        ----------
        content : {"numbers", "terms"}, optional
            A row per channel and number (N, B, K), or per channel and parameter of its model.
        units : {"field", "si"}, optional
            Data-sheet units, or SI.
        """
        if checks.choice("content", content, ("numbers", "terms")) == "numbers":
            return self.numbers.to_frame(units=units)
        rows = [
            {"channel": name, **estimate.to_dict(units), "valid": fit.valid}
            for name, fit in self.fits.items()
            for estimate in fit.estimates
        ]
        return frame(rows, ("channel", *Estimate.COLUMNS, "valid"))

    def derived(self) -> dict[str, Any]:
        return {"numbers": self.numbers.to_dict()}

    def check_content(self) -> None:
        for name, fit in self.fits.items():
            if fit.wv.name != name:
                raise ValueError(f"the fit of {name} is of channel {fit.wv.name!r}")
        fastest = max((1.0 / fit.wv.dt for fit in self.fits.values()), default=self.rate)
        if not self.skipped and abs(fastest / self.rate - 1.0) > 1e-3:
            raise ValueError(f"rate_hz is {self.rate:g}, but its channels have {fastest:g} Hz")

    def beside(self, path: Path) -> Calibration:
        files = ", ".join(of_other_runs(path, COMPANIONS))
        if not files:
            return self
        return replace(self, notices=(*self.notices, notice("other-run", values={"files": files})))

    # -- files ------------------------------------------------------------------------------------

    def report(
        self,
        path: str | os.PathLike[str],
        recording: Recording | None = None,
        *,
        datasheet: str | os.PathLike[str] | None = None,
        provenance: Mapping[str, str] | None = None,
    ) -> Path:
        """Write the self-contained HTML report; see `gmwm.report.write_report`."""
        written: Path = make(
            "page", self, path, recording, datasheet=datasheet, provenance=provenance
        )
        return written
