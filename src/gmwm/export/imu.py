"""What a file is written from: the numbers of an IMU, found by `bound` or `reduce`, or given."""

import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np

from gmwm._core import checks
from gmwm._core.text import brief
from gmwm._core.units import field_units
from gmwm.calibration import Calibration, fast_density
from gmwm.errors import InputError
from gmwm.estimate import Fit
from gmwm.filter_numbers import HORIZON, AxisFilterNumbers, FilterNumbers, Predicted, usable
from gmwm.issues import Notice, cause
from gmwm.motion import HORIZON as MOTION_HORIZON, INTERVAL, InMotion, between
from gmwm.process import Model, Process

SENSORS = {"gyro": "gyroscope", "accel": "accelerometer"}
"""Quantity -> how messages and most consumers call the sensor."""

LETTERS = "xyz"

NO_RATE = "the numbers hold no sampling rate, which this file needs: export the calibration"


@dataclass(frozen=True)
class Axis:
    """The numbers of one axis in a file.

    N, K: u/sqrt(Hz) and u/s/sqrt(Hz).
    sigma, tau: Of the Gauss-Markov process, u and s; not a number in forms without one.
    initial_sd: Of the bias at the start, u.
    nees: Predicted normalised error squared by time without aiding.
    upper: Which of the numbers are upper limits of a term that was not found.
    covers: The largest term that N or K covers beside the sensor's own; empty if there is none.
    turn_on_sd: Of the turn-on bias that ``initial_sd`` contains, u.
    """

    name: str
    N: float
    K: float
    sigma: float
    tau: float
    initial_sd: float
    nees: Mapping[float, float] = field(default_factory=dict)
    rate: float = float("nan")
    upper: frozenset[str] = frozenset()
    notices: tuple[Notice, ...] = ()
    covers: str = ""
    turn_on_sd: float = 0.0

    @property
    def start_sd(self) -> float:
        """Standard deviation of the start bias with the Gauss-Markov process, u."""
        return float(np.hypot(self.sigma, self.initial_sd))

    def moved(self, tau: float) -> Self:
        """With a Gauss-Markov process of another correlation time that bounds its own.

        The spectral density of (sigma, tau) is below that of (sigma', tau') at all frequencies if
        it is at zero, sigma^2 tau, and at infinity, sigma^2/tau.
        """
        ratio = max(tau / self.tau, self.tau / tau)
        return replace(self, sigma=self.sigma * float(np.sqrt(ratio)), tau=tau)


@dataclass(frozen=True)
class Triad:
    """The axes of the gyros or of the accelerometers.

    common: The bound of all, where a file has one value for them and one calibration has them all.
    shared_nees: Where a file has one value for all: predicted normalised error squared of each axis
        with that value, by time without aiding; empty for an axis whose model is not known.
    """

    quantity: str
    axes: tuple[Axis, ...]
    common: AxisFilterNumbers | None = None
    shared_nees: Mapping[str, Mapping[float, float]] | None = None

    @property
    def N(self) -> float:
        """For all axes, u/sqrt(Hz)."""
        return self._for_all("N")

    @property
    def K(self) -> float:
        """For all axes, u/s/sqrt(Hz)."""
        return self._for_all("K")

    @property
    def initial_sd(self) -> float:
        """For all axes, u."""
        return self._for_all("initial_sd")

    @property
    def slowest(self) -> Axis:
        """The axis with the largest K: its slow terms are the first to be named."""
        return max(self.axes, key=lambda axis: (axis.K, axis.N))

    def is_upper(self, letter: str) -> bool:
        """Whether the one for all axes is the upper limit of a term that was not found."""
        if self.common is not None:
            return letter in self.common.upper
        return letter in max(self.axes, key=lambda axis: float(getattr(axis, letter))).upper

    def _for_all(self, name: str) -> float:
        """The bound over the axes, or the largest of their numbers or upper limits."""
        return max(float(getattr(e, name)) for e in ([self.common] if self.common else self.axes))

    @property
    def rate(self) -> float:
        return self.axes[0].rate

    @property
    def known_rate(self) -> float:
        """Hz; raises InputError if it is not known."""
        if not self.rate > 0.0:
            raise InputError(NO_RATE)
        return self.rate

    def xyz(self) -> tuple[Axis, ...]:
        """Axes x, y, z; one that was not calibrated has the largest numbers of the others."""
        ends = [axis.name[-1:].lower() for axis in self.axes]
        is_named = set(ends) <= set(LETTERS) and len(set(ends)) == len(ends)
        letters = ends if is_named else LETTERS[: len(ends)]
        by_letter = dict(zip(letters, self.axes, strict=True))
        known = [axis.tau for axis in self.axes if axis.tau > 0.0]
        # To this correlation time all can be moved at the least cost to the one it costs most.
        tau = float(np.sqrt(min(known) * max(known))) if known else float("nan")
        sigma = max((a.moved(tau) if a.tau > 0.0 else a).sigma for a in self.axes)
        upper = frozenset().union(*(axis.upper for axis in self.axes))
        values = (self.N, self.K, sigma, tau, self.initial_sd)
        largest = Axis("", *values, rate=self.rate, upper=upper)
        return tuple(
            by_letter.get(letter, replace(largest, name=f"{self.quantity}_{letter}"))
            for letter in LETTERS
        )

    def listed(self, name: str, unit: float = 1.0, power: int = 1) -> str:
        """A number of each axis, or its square, in a unit: a list of Python, YAML or JSON."""
        values = (getattr(axis, name) ** power / unit for axis in self.xyz())
        return f"[{', '.join(f'{value:.6e}' for value in values)}]"


@dataclass(frozen=True)
class ImuNumbers:
    """Gyros and accelerometers, and the purpose of the numbers.

    method: {"bound", "reduce", "given", "motion"}.
    """

    gyro: Triad
    accel: Triad
    form: str
    horizon: float
    method: str
    sources: tuple[str, ...] = ()
    invalid: Mapping[str, str] = field(default_factory=dict)
    topic: str = ""
    reserved: tuple[str, ...] = ()

    def by_axis(self) -> Self:
        """The same for a file that has the numbers of each axis."""
        gyro, accel = (replace(each, common=None, shared_nees=None) for each in self.triads)
        return replace(self, gyro=gyro, accel=accel)

    @property
    def triads(self) -> tuple[Triad, Triad]:
        return self.gyro, self.accel

    @property
    def rate(self) -> float:
        """The higher of the two sensors' rates, Hz; raises InputError if it is not known."""
        rate = max(self.gyro.rate, self.accel.rate)
        if not rate > 0.0:
            raise InputError(NO_RATE)
        return rate


_TOPIC = re.compile(r"/[A-Za-z0-9_/]+")  # a name of ROS, which no file can misread
_COVERED = ("more-than-white-noise", "more-than-random-walk")
_NOT_VALID = "fit-not-valid"


def numbers_of(
    given: Any, form: str, horizon: float | None, tau: str | None = None
) -> FilterNumbers:
    """Those found of a calibration, or given ones if they have the form and the horizon.

    tau: Of those found, as in `gmwm.bound`.
    """
    if isinstance(given, Calibration):
        return usable(given, form, HORIZON if horizon is None else horizon, tau=tau)
    if not isinstance(given, FilterNumbers):
        raise InputError(
            f"{checks.shown(given)} has no numbers to export: give a calibration, noise in motion, "
            "or a result of gmwm.bound or gmwm.reduce for axes by name ({'gyro_x': fit})"
        )
    if given.form != form:
        raise InputError(
            f"the numbers have the form {given.form}, but the file needs {form}: make numbers of "
            "that form, or export the calibration"
        )
    if horizon is not None and horizon != given.horizon:
        raise InputError(
            f"the numbers are for {given.horizon:g} s: leave the horizon out, or export the "
            "calibration"
        )
    return given


def in_motion(given: Iterable[Any], horizon: float | None, interval: float | None) -> list[Any]:
    """What is given, with the largest N and K of all IMUs in place of noise in motion.

    horizon, interval: s; by default 1 s, and updates every 0.1 s or the horizon if that is less.
    """
    found = list(given)
    if interval is not None and not any(isinstance(each, InMotion) for each in found):
        raise InputError("interval applies to noise in motion only: leave it out")
    end = MOTION_HORIZON if horizon is None else horizon
    start = min(INTERVAL, end) if interval is None else interval
    return [_bounding(each, start, end) if isinstance(each, InMotion) else each for each in found]


def _bounding(found: InMotion, interval: float, horizon: float) -> FilterNumbers:
    axes, dt = {}, float(found.curves[0].tau[0])
    for name, model in found.numbers(interval, horizon).items():
        tau, variance = found.envelope(name)
        true = float(between(tau, variance, np.array([horizon]))[0])
        nees = true / float(2.0 * model.haar_variance(np.array([horizon]), dt)[0])
        predicted = (Predicted(horizon, nees, float(1.0 / np.sqrt(nees))),)
        quantity = name.partition("_")[0]
        axes[name] = AxisFilterNumbers(
            "N+K", model, horizon, 0.0, "motion", predicted, quantity=quantity
        )
    source = f"{len(found.imus)} IMUs in motion, updates every {interval:g} s"
    return FilterNumbers(axes, source, 1.0 / dt, sum(found.durations))


def not_valid(given: Iterable[Any]) -> dict[str, Notice]:
    """Axes that are not valid, each with the notice that says why."""
    found = {}
    for source in given:
        for name, one in source.items() if isinstance(source, Calibration | FilterNumbers) else ():
            notices = [n for n in one.notices if n.severity == "bad" or n.code == _NOT_VALID]
            is_sensor = isinstance(one, AxisFilterNumbers) or one.wv.quantity in SENSORS
            if notices and is_sensor:
                found[name] = cause(notices) or notices[0]
    return found


def is_reserved(fit: Fit) -> bool:
    """Whether departures were found that may recur, so that it is used with reservation."""
    return any(n.issue.topic == "departure" and n.severity != "note" for n in fit.notices)


def reason(notice: Notice) -> str:
    """Why an axis is not valid, in about five words."""
    return notice.issue.reason or notice.code.replace("-", " ")


def refusal(found: Mapping[str, Notice]) -> str:
    """Which axes are not valid, why, and what to do, by the notices of `not_valid`."""
    places = ", ".join(f"{name} ({reason(each)})" for name, each in found.items())
    hints: dict[str, list[str]] = {}
    for name, each in found.items():
        hints.setdefault(each.hint or "read the notices of the calibration", []).append(name)
    alone = len(hints) == 1
    texts = [hint if alone else f"{', '.join(own)}: {hint}" for hint, own in hints.items()]
    return "; ".join([f"not valid: {places}", *texts])


def numbers_for(
    given: Sequence[Any], form: str, horizon: float | None, one_tau: bool = False
) -> list[FilterNumbers]:
    """The numbers of each of several calibrations, or given ones, that make one IMU.

    horizon: s; by default that of the numbers or, of calibrations, `HORIZON`.
    one_tau: Whether they have one correlation time; given numbers lose their predictions with it.
    Raises InputError if a sensor is given twice, or numbers are of another form or horizon.
    """
    if horizon is not None:
        horizon = checks.positive("horizon", horizon, "give a positive time in seconds")
    found = [numbers_of(each, form, horizon, "shared" if one_tau else None) for each in given]
    names = Counter(name for each in found for name in each)
    if not names:
        raise InputError("no numbers to export: give a calibration")
    twice = [name for name, count in names.items() if count > 1]
    if twice:
        raise InputError(f"{twice[0]} is given twice: give each sensor once")
    horizons = sorted({one.horizon for each in found for one in each.values()})
    if len(horizons) > 1:
        times = ", ".join(f"{each:g} s" for each in horizons)
        raise InputError(f"the numbers are for {times}: give numbers for one horizon")
    if not one_tau or len({one.tau for each in found for one in each.values()}) == 1:
        return found
    models = {n: one if isinstance(one, Fit) else one.model for s in given for n, one in s.items()}
    joined = _joined([each for each in given if isinstance(each, Calibration)], names)
    moved = usable(joined or models, form, horizons[0], tau="shared")
    for place, (source, each) in enumerate(zip(given, found, strict=True)):
        own: dict[str, AxisFilterNumbers] = {name: moved[name] for name in each}
        if not isinstance(source, Calibration):
            own = {n: replace(o, model=moved[n].model, predicted=()) for n, o in each.items()}
        found[place] = replace(each, axes=own)
    return found


def imu_of(
    given: Sequence[Any],
    form: str,
    horizon: float | None = None,
    *,
    shared: bool = False,
    one_tau: bool = False,
) -> ImuNumbers:
    """The numbers of an IMU in a form, of calibrations or of numbers that were found before.

    shared: Whether the axes of a sensor have one value in the file.
    Raises InputError if a sensor is missing or given twice, or numbers are of another form or
        horizon.
    """
    sources = numbers_for(given, form, horizon, one_tau)
    numbers = {name: one for each in sources for name, one in each.items()}
    first = next(iter(numbers.values()))
    calibrations = [each for each in given if isinstance(each, Calibration)]
    fits = {name: fit for each in calibrations for name, fit in each.items()}
    rates = {name: each.rate for each in sources for name in each}
    axes = [axis_of(name, one, rates[name], fits.get(name)) for name, one in numbers.items()]
    gyro, accel = (
        _triad(quantity, [a for a in axes if numbers[a.name].quantity == quantity], form)
        for quantity in SENSORS
    )
    if shared:
        gyro, accel = (
            _with_shared(each, calibrations, form, first.horizon) for each in (gyro, accel)
        )
    lengths = [f", {each.duration:.0f} s recorded" * (each.duration > 0.0) for each in sources]
    return ImuNumbers(
        gyro,
        accel,
        form,
        first.horizon,
        first.method,
        tuple(f"{s.source or 'recording'}{n}" for s, n in zip(sources, lengths, strict=True)),
        {name: reason(each) for name, each in not_valid(given).items()},
        _topic(calibrations),
        tuple(name for name, fit in fits.items() if fit.valid and is_reserved(fit)),
    )


def _triad(quantity: str, own: Sequence[Axis], form: str) -> Triad:
    """The axes of a quantity; raises InputError if a file could not hold them."""
    if not own:
        raise InputError(
            f"the {SENSORS[quantity]} is missing, and the file needs both sensors: calibrate both, "
            "or give a second file that has it"
        )
    if len(own) > len(LETTERS):
        raise InputError(
            f"{', '.join(axis.name for axis in own)} are more than three axes: export one IMU at "
            "a time"
        )
    for axis in own:
        for key in ("N", "K" if "K" in form else "sigma"):
            if not getattr(axis, key) > 0.0:
                raise InputError(
                    f"{key} of {axis.name} is zero, and filters divide by it: give a number, "
                    "or export the calibration, which has an upper limit"
                )
    return Triad(quantity, tuple(own))


def _joined(calibrations: Sequence[Calibration], names: Collection[str]) -> Calibration | None:
    """One calibration with the channels of these names; None if any is in none of several."""
    fits = {name: fit for each in calibrations for name, fit in each.items() if name in names}
    rivals = {name: models for each in calibrations for name, models in each.rivals.items()}
    if len(fits) < len(names):
        return None
    return replace(calibrations[0], fits=fits, rivals=rivals)


def _with_shared(
    triad: Triad, calibrations: Sequence[Calibration], form: str, horizon: float
) -> Triad:
    """With one value for all axes, and how consistent each axis is with it."""
    own = _joined(calibrations, [axis.name for axis in triad.axes])
    if own is not None:
        together = usable(own, form, horizon, shared=True)
        shared = {name: one.nees for name, one in together.items()}
        return replace(triad, common=next(iter(together.values())), shared_nees=shared)
    alike = (triad.N, triad.K, triad.initial_sd)
    known = [axis.name for axis in triad.axes if (axis.N, axis.K, axis.initial_sd) == alike]
    nees = {axis.name: axis.nees if axis.name in known else {} for axis in triad.axes}
    return replace(triad, shared_nees=nees)


def axis_of(name: str, numbers: AxisFilterNumbers, rate: float, fitted: Fit | None = None) -> Axis:
    """An axis by its numbers; ``rate`` in Hz, NaN for that of the fit."""
    sigma, tau = (values[0] if values else float("nan") for values in (numbers.sigma, numbers.tau))
    if fitted is not None and not rate > 0.0:  # channels of several rates
        rate = 1.0 / fitted.wv.dt
    values = (numbers.N, numbers.K, sigma, tau, numbers.initial_sd, dict(numbers.nees), rate)
    about = (numbers.upper, numbers.notices, _covered(numbers, fitted), numbers.turn_on_sd)
    return Axis(name, *values, *about)


def _covered(numbers: AxisFilterNumbers, fitted: Fit | None) -> str:
    """The largest term beside white noise and walk that N or K covers, e.g. "resonance 2 mg"."""
    shares: dict[str, float] = {}
    for notice in numbers.notices:
        if notice.code in _COVERED:
            for label, share in notice.values.items():
                shares[label] = max(share, shares.get(label, 0.0))
    terms: dict[str, Process] = {}
    if fitted is not None:
        terms = dict(zip(fitted.model.term_labels(), fitted.model.terms, strict=True))
        for label, one in terms.items():
            is_fast = one.is_band_limited or fast_density(Model((one,)), fitted.wv.dt) > 0.0
            if one.is_white or is_fast:
                shares.pop(label, None)  # N of the sensor has it, too
    if not shares:
        return ""
    label = max(shares, key=lambda each: shares[each])
    if label not in terms:
        return label
    term = terms[label]
    size, tau = term.linear_parameter, term.values.get("tau")
    text = label.rstrip(" 0123456789")
    if size is not None:
        units = field_units(size.unit, numbers.quantity)
        scale, unit = (units[0].per_si, units[0].unit) if units else (1.0, numbers.unit)
        text += f" {brief((term.values[size.name] or 0.0) * scale)} {unit}"
    return f"{text}, {brief(tau)} s" if tau else text


def _topic(calibrations: Sequence[Calibration]) -> str:
    """The topic of ROS that all calibrations come from; empty if there is none, or several."""
    notices = [notice for each in calibrations for notice in each.notices]
    names = {str(each.values.get("topic")) for each in notices if each.code == "topic"}
    name = names.pop() if len(names) == 1 else ""
    return name if _TOPIC.fullmatch(name) else ""
