"""The result of `motion`: curves of each IMU in motion, clocks and mountings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from itertools import cycle
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from gmwm import plotting
from gmwm._core.documents import Array, Document, Positive, Text
from gmwm._core.frozen import freeze
from gmwm._core.pages import Reported
from gmwm._core.text import Printed, brief, bullets, per_cent, plain_table
from gmwm._core.typing import FloatArray
from gmwm._core.units import SI_UNIT, factor
from gmwm.errors import InputError, MissingNameError
from gmwm.issues import Notice, worst_first
from gmwm.motion import tuning
from gmwm.motion.clocks import Clock
from gmwm.motion.curves import BOUNDED, FILTER, between, dominating
from gmwm.motion.mapping import Mounting
from gmwm.process import Model

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_UNITS = {"gyro": "deg/s", "accel": "mg"}


def _shown(sensor: str) -> tuple[str, float]:
    """Unit in which deviations in motion are shown, and how many of it one SI unit is."""
    return _UNITS[sensor], 1.0 / factor(_UNITS[sensor], SI_UNIT[sensor])


@dataclass(frozen=True)
class MotionCurve(Document):
    """The Allan variance of one axis of one IMU in motion.

    Attributes
    ----------
    imu, channel, quantity : str
    tau : (J,) ndarray
        Averaging times, s.
    variance, lower, upper : (J,) ndarray
        u^2, with the ends of 95 % intervals. By chance, or if errors are shared, a variance can be
        negative. Of two IMUs this and ``static`` are the sums of both.
    pairs : (P, J) ndarray
        Of each pair of the other IMUs in their order, u^2: ``variance`` is their mean. Pairs
        differ where IMUs share errors, as aliased vibration of one instant.
    differences : (K - 1, J) ndarray
        Of the difference to each of the other IMUs in their order, u^2.
    agree : (J,) ndarray
        p-value of the equality of what pairs of others give; NaN with fewer than four IMUs.
    static : (J,) ndarray
        Allan variance at rest, u^2, NaN where it is not known.
    exponent, exponent_error : (J,) ndarray
        Power of the vibration to which deviations are proportional, of the three axes together,
        and half of its 95 % interval; NaN where it is not known.
    """

    imu: Text
    channel: Text
    quantity: Text
    tau: Array
    variance: Array
    lower: Array
    upper: Array
    pairs: Array
    differences: Array
    agree: Array
    static: Array
    exponent: Array
    exponent_error: Array

    def __post_init__(self) -> None:
        freeze(self, *(each.name for each in fields(self) if each.type == "Array"))

    @property
    def deviation(self) -> FloatArray:
        """(J,) Allan deviation, u; NaN where the variance is not positive."""
        return np.asarray(np.sqrt(np.where(self.variance > 0.0, self.variance, np.nan)))

    @property
    def coherence(self) -> FloatArray:
        """(J,) Mean coherence of two differences to other IMUs: the share of its own error.

        One half for equal IMUs that share nothing. With a reference the share of the gyro, whose
        square is the Fisher information on its variance against that of a perfect reference.
        """
        first, second = np.triu_indices(len(self.differences), min(1, len(self.differences) - 1))
        power = np.sqrt(self.differences[first] * self.differences[second])
        return np.asarray(np.mean(self.pairs / power, axis=0))

    @property
    def factor(self) -> FloatArray:
        """(J,) Allan deviation in motion over that at rest."""
        return np.asarray(self.deviation / np.sqrt(self.static))


@dataclass(frozen=True)
class VibrationClass(Document):
    """Curves of the time in which the vibration is within limits.

    Attributes
    ----------
    name : {"low", "middle", "high"}
    low, high : float
        Limits of the vibration: accelerometer from 20 to 60 Hz, rms over a second, m/s^2.
    share : float
        Of the time, mean over the IMUs.
    curves : tuple of MotionCurve
    """

    name: Text
    low: float
    high: float
    share: float
    curves: tuple[MotionCurve, ...]


@dataclass(frozen=True, eq=False, repr=False)
class InMotion(Document, Printed, Reported):
    """Noise of IMUs in motion.

    Attributes
    ----------
    imus : tuple of str
    durations : tuple of float
        Of the flights, s.
    curves : tuple of MotionCurve
        Of each channel of each IMU; see `curve`.
    clocks : tuple of Clock
        Of each flight and each IMU but the first; none where a flight is at rest.
    mountings : tuple of Mounting
        Of each flight, target, other IMU and sensor.
    notices : tuple of Notice
    classes : tuple of VibrationClass
        Of low, middle and high vibration, where it is seen; see `at`.
    vibration : (n, 3) ndarray
        Number of the flight, time (s) and vibration (m/s^2 rms) of the first IMU, every second.
    """

    SCHEMA: ClassVar[str] = "gmwm.motion"

    imus: tuple[Text, ...]
    durations: tuple[Positive, ...]
    curves: tuple[MotionCurve, ...]
    clocks: tuple[Clock, ...]
    mountings: tuple[Mounting, ...]
    notices: tuple[Notice, ...] = ()
    classes: tuple[VibrationClass, ...] = ()
    vibration: Array = field(default_factory=lambda: np.zeros((0, 3)))

    def __post_init__(self) -> None:
        freeze(self, "vibration")

    def at(self, name: str) -> InMotion:
        """The result at low, middle or high vibration, or at rest.

        Parameters
        ----------
        name : {"low", "middle", "high", "rest"}

        Raises MissingNameError if there is no such class, or nothing is known at rest.
        """
        by_name = {each.name: each.curves for each in self.classes}
        if self.is_known_at_rest:
            by_name["rest"] = tuple(
                replace(each, variance=each.static, lower=each.static, upper=each.static)
                for each in self.curves
            )
        if name not in by_name:
            raise MissingNameError(f"no class {name!r}: there are {', '.join(by_name) or 'none'}")
        return replace(self, curves=by_name[name], classes=())

    @property
    def is_known_at_rest(self) -> bool:
        """Whether `at` has the noise at rest."""
        return all(np.all(np.isfinite(each.static)) for each in self.curves)

    def curve(self, imu: str, channel: str) -> MotionCurve:
        """The curve of a channel of an IMU.

        Raises MissingNameError if there is none.
        """
        for each in self.curves:
            if (each.imu, each.channel) == (imu, channel):
                return each
        known = ", ".join(dict.fromkeys(c.channel for c in self.curves))
        raise MissingNameError(
            f"no curve of {imu!r}, {channel!r}: name one of {', '.join(self.imus)}, and of {known}"
        )

    def envelope(
        self, channel: str, imu: str | None = None, *, upper: bool = False
    ) -> tuple[FloatArray, FloatArray]:
        """Averaging times that were measured (s), and the largest Allan variance (u^2).

        It is nowhere below the one at rest.

        Parameters
        ----------
        channel : str
        imu : str, optional
            By default the largest of all IMUs.
        upper : bool, optional
            Whether the upper ends of the 95 % intervals count.

        Raises MissingNameError if there is no such curve, InputError if it has no time.
        """
        own = [self.curve(each, channel) for each in ([imu] if imu else self.imus)]
        seen = [c.upper if upper else np.where(c.variance > 0.0, c.variance, c.upper) for c in own]
        at_rest = [np.nan_to_num(c.static) for c in own]
        known = np.all(np.isfinite([c.variance for c in own]), axis=0)
        if not np.any(known):
            raise InputError(f"{channel} is not measured at any time: use a better reference")
        return own[0].tau[known], np.max([*seen, *at_rest], axis=0)[known]

    def models(self, imu: str | None = None) -> dict[str, Model]:
        """The smallest bounded angle, white noise and walk that are nowhere below the curves.

        By channel. A sum of these fits no curve within its intervals. This one is never below, and
        simulates, or is the truth for `gmwm.certify` and `gmwm.reduce`.

        Parameters
        ----------
        imu : str, optional
            By default the largest of all IMUs.

        Raises MissingNameError if there is no such IMU.
        """
        found = {}
        for channel in dict.fromkeys(each.channel for each in self.curves):
            tau, variance = self.envelope(channel, imu)
            found[channel] = dominating(tau, variance, BOUNDED, self.curves[0].tau[0])
        return found

    def numbers(
        self,
        interval: float = tuning.INTERVAL,
        horizon: float = tuning.HORIZON,
        *,
        imu: str | None = None,
        upper: bool = False,
    ) -> dict[str, Model]:
        """N and K for a filter in motion, by channel.

        The smallest with which the error that a filter expects after any time t between the two
        limits is at least the measured one: N^2/t + K^2 t/3 is nowhere below the Allan variance at
        t, which is that of the mean rate over t less the one over the t before. Bounded angles
        need an N that falls with the interval.

        Parameters
        ----------
        interval : float, optional
            Shortest time between updates of the filter, s.
        horizon : float, optional
            Longest time without updates, s.
        imu, upper : optional
            As of `envelope`.

        Raises
        ------
        InputError
            If the times are not within those of the curves.
        MissingNameError
            If there is no such IMU.
        """
        found = {}
        for channel in dict.fromkeys(each.channel for each in self.curves):
            tau, variance = self.envelope(channel, imu, upper=upper)
            if not tau[0] <= interval <= horizon <= tau[-1]:
                raise InputError(
                    f"{channel}, from {interval:g} s to {horizon:g} s: these flights show "
                    f"{tau[0]:.2g} s to {tau[-1]:.2g} s in motion; give times between, or longer "
                    "flights"
                )
            inside = tau[(tau > interval) & (tau < horizon)]
            times = np.array(sorted({interval, *inside, horizon}))
            found[channel] = dominating(
                times, between(tau, variance, times), FILTER, self.curves[0].tau[0]
            )
        return found

    def shows(self, interval: float, horizon: float) -> bool:
        """Whether `numbers` can be given for such times, s."""
        seen = [c.tau[np.isfinite(c.variance)] for c in self.curves]
        return all(t.size and t[0] <= interval <= horizon <= t[-1] for t in seen)

    @property
    def sensors(self) -> tuple[str, ...]:
        """Gyro, and accel where all IMUs have one."""
        return tuple(dict.fromkeys(each.quantity for each in self.curves))

    def plot(self, channel: str = "gyro_x", *, ax: Axes | None = None) -> Axes:
        """Allan deviations of a channel of each IMU, in motion and at rest.

        Parameters
        ----------
        channel : str, optional
        ax : matplotlib Axes, optional
        """
        own = [self.curve(imu, channel) for imu in self.imus]
        unit, scale = _shown(own[0].quantity)
        ax = plotting.allan_axes(unit, channel, ax)
        for each, colour in zip(own, cycle(plotting.COMPONENT_COLOURS), strict=False):
            seen = (each.variance > 0.0) & (each.lower > 0.0)
            low, mid, high = (
                scale * np.sqrt(part[seen]) for part in (each.lower, each.variance, each.upper)
            )
            ax.fill_between(each.tau[seen], low, high, color=colour, alpha=0.25, linewidth=0.0)
            ax.plot(each.tau[seen], mid, "o-", color=colour, markersize=3.0, label=each.imu)
            if np.any(np.isfinite(each.static)):
                rest, label = scale * np.sqrt(each.static), "at rest" if each is own[0] else None
                ax.plot(each.tau, rest, "--", color=plotting.DATA_COLOUR, label=label)
        ax.legend(fontsize="small", framealpha=0.9)
        return ax

    @property
    def _size(self) -> str:
        count = len(self.durations)
        return f"{count} flight{'s' * (count > 1)}, {sum(self.durations):.4g} s"

    def __repr__(self) -> str:
        return f"<InMotion: {', '.join(self.imus)}; {self._size}>"

    def __str__(self) -> str:
        what = "both IMUs together" if len(self.imus) == 2 else "each IMU"
        lines = [f"Allan deviation of {what} in motion: {self._size}"]
        lines += self._stand().splitlines() if self.clocks else []
        for sensor in self.sensors:
            lines += self._table(sensor).splitlines()
        lines += [*self._vibration(), *self._for_filters().splitlines()]
        return "\n".join([*lines, "", *bullets(worst_first(self.notices))])

    def _stand(self) -> str:
        """Clock, rotation, scale and lever arm of each IMU against the first."""
        rows = []
        for imu in dict.fromkeys(each.imu for each in self.clocks):
            clocks = [each for each in self.clocks if each.imu == imu]
            own = [m for m in self.mountings if (m.imu, m.target) == (imu, self.imus[0])]
            gyros = [m for m in own if m.sensor == "gyro"]
            arms = [m for m in own if m.sensor == "accel"]
            angle = np.rad2deg(np.linalg.norm(np.mean([m.rotation for m in gyros], axis=0)))
            beside = [m.correction_error.reshape(3, 3)[~np.eye(3, dtype=bool)] for m in gyros]
            tilt = np.rad2deg(np.max(beside))
            scale = max(np.abs(m.correction[::4]).max() for m in gyros)
            offsets = 1e3 * np.array([each.offset for each in clocks])
            drifts = 1e6 * np.array([each.drift for each in clocks])
            arm = "-"
            if arms:
                mean = 100.0 * np.mean([m.lever_arm for m in arms], axis=0)
                error = 100.0 * max(m.lever_arm_error.max() for m in arms)
                arm = f"{' '.join(f'{v:.1f}' for v in mean)} +-{error:.1g}"
            clock = _ends(offsets, 1), _ends(drifts, 0)
            rows.append((imu, *clock, f"{angle:.1f} +-{tilt:.1g}", per_cent(scale), arm))
        heads = ("clock, ms", "drift, ppm", "turned, deg", "scale", "lever arm, cm")
        return plain_table((f"to {self.imus[0]}", *heads), rows)

    def _table(self, sensor: str) -> str:
        """Root mean square deviations over the axes at some averaging times.

        Below them the typical 95 % interval of one axis, and the factor to those at rest.
        """
        own = [each for each in self.curves if each.quantity == sensor]
        tau, (unit, scale) = own[0].tau, _shown(sensor)
        chosen = sorted({int(np.argmin(np.abs(np.log(tau / t)))) for t in tuning.SHOWN_AT})
        rows = []
        for imu in ("both",) if len(self.imus) == 2 else self.imus:
            axes = np.array([c.variance for c in own if imu in (c.imu, "both")])
            seen, mean = np.all(axes > 0.0, axis=0), np.mean(axes, axis=0)
            own_texts = (brief(scale * np.sqrt(mean[k])) if seen[k] else "-" for k in chosen)
            rows.append((imu, *own_texts))
        reach = _median([np.sqrt(np.maximum(c.upper, 0.0)) / c.deviation for c in own])
        rows.append(
            ("95 %, median", *(f"x/{reach[k]:.2f}" if reach[k] > 0.0 else "-" for k in chosen))
        )
        if len(self.imus) != 2:
            # Of one IMU, the Fisher information against that of a perfect reference.
            name, power = ("information", 2) if len(self.imus) == 1 else ("coherence", 1)
            shares = _median([np.maximum(c.coherence, 0.0) ** power for c in own])
            rows.append((name, *(f"{shares[k]:.2f}".replace("nan", "-") for k in chosen)))
        if np.any(np.isfinite([c.static for c in own])):
            times = self.factor(sensor)
            over = (brief(times[k]) if times[k] > 0.0 else "-" for k in chosen)
            rows.append(("over rest, median", *over))
        return plain_table((f"{sensor}, {unit}", *(f"{tau[k]:.2g} s" for k in chosen)), rows)

    def _vibration(self) -> list[str]:
        """How deviations depend on vibration, and its range, on one line."""
        if not self.classes:
            return []
        k = int(np.argmin(np.abs(np.log(self.curves[0].tau / tuning.INTERVAL))))
        parts = []
        for sensor in self.sensors:
            own = [each for each in self.curves if each.quantity == sensor]
            power, error = (float(np.median([getattr(each, name)[k] for each in own]))
                            for name in ("exponent", "exponent_error"))  # fmt: skip
            parts.append(f"{sensor} {power:.2f} +-{error:.2f}")
        ends = (f"{end:.2g}" for end in (self.classes[0].low, *(c.high for c in self.classes)))
        named = ", ".join(each.name for each in self.classes)
        return [
            f"noise ~ vibration^p: {', '.join(parts)}",
            f"vibration, {named}: {' - '.join(ends)} m/s^2",
        ]

    def _for_filters(self) -> str:
        """N and K, SI, the largest of all axes and IMUs, for some intervals of updates."""
        rows = []
        known = [(self, "", use) for use in tuning.USES if self.shows(*use)]
        if known and self.is_known_at_rest:
            known.append((self.at("rest"), " at rest", tuning.USES[0]))
        for result, where, (interval, horizon) in known:
            found = result.numbers(interval, horizon)
            own = [[m.params for name, m in found.items() if name.startswith(sensor)]
                   for sensor in self.sensors]  # fmt: skip
            largest = (f"{max(p[key] or 0.0 for p in each):.2g}" for each in own for key in "NK")
            rows.append((f"updates {interval:g} s, outages {horizon:g} s{where}", *largest))
        heads = [f"{sensor} {key}" for sensor in self.sensors for key in "NK"]
        least = f"{per_cent(tuning.LEAST_WALK)} of the variance at the outage"
        table = plain_table(("largest axis and IMU, SI", *heads), rows)
        if not rows:
            return "no numbers for filters: the flights are too short"
        return f"{table}\nK, if no walk is seen: {least}"

    def factor(self, sensor: str) -> FloatArray:
        """(J,) Median over IMUs and axes of the deviation in motion over that at rest."""
        return _median([each.factor for each in self.curves if each.quantity == sensor])


def _median(rows: Sequence[FloatArray]) -> FloatArray:
    """Median of each column; NaN where nothing is known."""
    table = np.array(rows)
    known = np.any(np.isfinite(table), axis=0)
    found = np.full(known.shape, np.nan)
    found[known] = np.nanmedian(table[:, known], axis=0)
    return found


def _ends(values: FloatArray, digits: int) -> str:
    ends = (f"{end:.{digits}f}" for end in (values.min(), values.max()))
    return " to ".join(dict.fromkeys(ends))


def static_variance(curve: Mapping[str, Any] | None, channel: str, tau: FloatArray) -> FloatArray:
    """(J,) Allan variance at rest of a channel of a calibration, NaN beyond its curve."""
    if curve is None or channel not in curve:
        return np.full(tau.shape, np.nan)
    wv = curve[channel].wv
    inside = (tau >= 0.99 * wv.tau[0]) & (tau <= wv.tau[-1])
    found = 2.0 * np.exp(np.interp(np.log(tau), np.log(wv.tau), np.log(wv.variance)))
    return np.where(inside, found, np.nan)
