"""AR, MA, ARMA and ARIMA processes, in samples."""

from collections.abc import Sequence
from functools import lru_cache
from itertools import product
from numbers import Integral, Real
from typing import Any, ClassVar, Self

import numpy as np
import scipy
from numpy.polynomial.polynomial import polyfromroots
from scipy.linalg import solve_discrete_lyapunov

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.process import spectral
from gmwm.process.base import Process, Shape
from gmwm.process.kinds.gauss_markov import GaussMarkov
from gmwm.process.parameter import Parameter, parameter
from gmwm.process.spectral import squared_sine
from gmwm.process.state_space import StateSpace, from_state_space

Coefficients = int | float | Sequence[float | None] | None

_MAX_LAGS = 1 << 18
_INWARDS = (0.0, 1e-9, 1e-7, 1e-5, 1e-3, 0.01, 0.03, 0.1)
_NEGLIGIBLE = 1e-17


class ARIMA(Process):
    """Autoregressive integrated moving average.

    ``phi(L) (1 - L)^d x[k] = theta(L) e[k]`` with ``phi(L) = 1 - ar_1 L - ...``,
    ``theta(L) = 1 + ma_1 L + ...`` and ``var e = sigma2``. Its parameters are per sample: they
    belong to one sampling interval.

    Parameters
    ----------
    ar : int or sequence of float
        The order, with open coefficients, or the coefficients.
    d : {0, 1, 2}
        Number of integrations; the Haar wavelet variance exists for d <= 1.
    ma : int or sequence of float
    sigma2 : float, optional
        Innovation variance, u^2.

    Raises
    ------
    InputError
        For coefficients outside the stationary (AR) or invertible (MA) region.
    """

    sigma2: float = parameter("u^2", "variance", meaning="innovation variance")
    label: ClassVar[str] = "ARIMA"
    repeatable = True
    separable_shape = False
    d: int
    orders: tuple[int, int]
    _examples: ClassVar[tuple[tuple[Any, ...], ...]] = (
        ([0.5], 1, [0.3], 0.7),
        ([0.9, -0.5], 0, [0.4, 0.1], 2.0),
    )

    def __init__(
        self, ar: Coefficients = 0, d: int = 0, ma: Coefficients = 0, sigma2: float | None = None
    ) -> None:
        ar_values, ma_values = _coefficients(ar, "ar"), _coefficients(ma, "ma")
        if d not in (0, 1, 2):
            raise InputError(f"{type(self).__name__}: d = {d!r}: give 0, 1 or 2")
        names = [f"ar_{i + 1}" for i in range(len(ar_values))]
        names += [f"ma_{i + 1}" for i in range(len(ma_values))]
        shapes = tuple(Parameter(name, "-", lower=-np.inf, meaning="coefficient") for name in names)
        self.__dict__.update(d=d, orders=(len(ar_values), len(ma_values)))
        self.__dict__.update(parameters=(*shapes, *type(self).parameters), shape_parameters=shapes)
        super().__init__(*ar_values, *ma_values, sigma2)
        for values, sign, what in ((self.ar, 1, "stationary"), (self.ma, -1, "invertible")):
            if None not in values and not _stable([sign * value for value in values]):
                raise InputError(
                    f"{self!r} is not {what}: its polynomial has a root inside the unit circle"
                )

    @property
    def ar(self) -> tuple[Any, ...]:
        """Autoregressive coefficients, ``None`` where open."""
        return tuple(self.values[f"ar_{i + 1}"] for i in range(self.orders[0]))

    @property
    def ma(self) -> tuple[Any, ...]:
        """Moving-average coefficients, ``None`` where open."""
        return tuple(self.values[f"ma_{i + 1}"] for i in range(self.orders[1]))

    def _arguments(self, values: dict[str, float | None]) -> dict[str, Any]:
        """What the constructor of this very class takes."""
        p, q = self.orders
        known = {
            "ar": [values[f"ar_{i + 1}"] for i in range(p)],
            "d": self.d,
            "ma": [values[f"ma_{i + 1}"] for i in range(q)],
            "sigma2": values["sigma2"],
        }
        return {name: known[name] for name in self._accepted}

    def with_values(self, **values: float | None) -> Self:
        unknown = set(values) - set(self.values)
        if unknown:
            raise InputError(f"{type(self).__name__} has no parameter {sorted(unknown)[0]!r}")
        return type(self)(**self._arguments({**self.values, **values}))

    def to_dict(self) -> dict[str, Any]:
        return {"process": type(self).__name__, **self._arguments(self.values)}

    def __repr__(self) -> str:
        parts = []
        for name, value in self._arguments(self.values).items():
            if isinstance(value, list) and any(c is not None for c in value):
                listed = ", ".join("None" if c is None else f"{c:.4g}" for c in value)
                parts.append(f"{name}=[{listed}]")
            elif isinstance(value, list) and value:
                parts.append(f"{name}={len(value)}")
            elif not isinstance(value, list) and value is not None:
                parts.append(f"{name}={value:.4g}")
        return f"{type(self).__name__}({', '.join(parts)})"

    def __eq__(self, other: object) -> bool:
        return super().__eq__(other) and isinstance(other, ARIMA) and self.d == other.d

    __hash__ = Process.__hash__

    def psd(self, f: FloatArray, dt: float) -> FloatArray:
        delay = np.exp(-2j * np.pi * np.asarray(f) * dt)
        numerator = np.polynomial.polynomial.polyval(delay, [1.0, *self.ma])
        denominator = np.polynomial.polynomial.polyval(delay, [1.0, *(-c for c in self.ar)])
        density = self.sigma2 * dt * np.abs(numerator) ** 2 / np.abs(denominator) ** 2
        return np.asarray(density / (4.0 * squared_sine(f, dt)) ** self.d)

    def autocovariance(self, lag: FloatArray, dt: float) -> FloatArray:
        if self.d:
            raise InputError(f"{self!r} is not stationary and has no autocovariance: give d = 0")
        lag = np.asarray(lag, dtype=int)
        return self.sigma2 * _unit_autocovariance(self.ar, self.ma, int(lag.max()) + 1)[lag]

    def haar_variance(self, tau: FloatArray, dt: float) -> FloatArray:
        if self.d > 1:
            raise InputError(f"{self!r} has no Haar wavelet variance: give d = 0 or 1")
        tau = np.asarray(tau, dtype=float)
        m = np.rint(tau / dt)
        radius = float(np.max(np.abs(np.roots([1.0, *(-c for c in self.ar)])), initial=0.0))
        lags = np.log(_NEGLIGIBLE) / np.log(radius) if 0.0 < radius < 1.0 else 0.0
        # A root of multiplicity p decays like k^(p-1) radius^k.
        lags = int(min((1.0 + 0.5 * len(self.ar)) * lags, 2.0 * _MAX_LAGS))
        decay = lags + sum(self.orders) + 2
        if decay > _MAX_LAGS or np.any(np.abs(m - tau / dt) > 1e-6 * m) or np.any(m < 1.0):
            return spectral.haar_variance(self.psd, tau, dt)
        covariance = _unit_autocovariance(self.ar, self.ma, decay)
        flat = [haar_sum(covariance, value, self.d) for value in m.ravel()]
        return self.sigma2 * np.reshape(flat, tau.shape)

    def state_space(self, dt: float) -> StateSpace:
        """Harvey's form (1989, *Forecasting, Structural Time Series Models*, sec. 3.3)."""
        self._alone().require_given()
        size = max(self.orders[0], self.orders[1] + 1)
        transition = np.eye(size, k=1)
        transition[: self.orders[0], 0] = self.ar
        drive = np.zeros(size)
        drive[: self.orders[1] + 1] = [1.0, *self.ma]
        noise = self.sigma2 * np.outer(drive, drive)
        output = np.eye(size)[0]
        stationary = solve_discrete_lyapunov(transition, noise)
        names = [f"{self.title()} {i + 1}" for i in range(size)]
        for order in range(self.d):
            # The integrated output z[k] = z[k-1] + y[k] joins as a state that holds z[k-1].
            total = transition.shape[0]
            grown = np.zeros((total + 1, total + 1))
            grown[:total, :total] = transition
            grown[total, :total], grown[total, total] = output, 1.0
            transition, output = grown, np.append(output, 1.0)
            noise = np.pad(noise, (0, 1))
            stationary = np.pad(stationary, (0, 1))
            names.append(f"{self.title()} integral {order + 1}")
        return StateSpace.of(names, transition, noise, stationary, output=output)

    def draw(self, n: int, dt: float, rng: np.random.Generator) -> FloatArray:
        if not self.ar:
            noise = np.sqrt(self.sigma2) * rng.standard_normal(n + len(self.ma))
            series = np.convolve(noise, [1.0, *self.ma], "valid")
            for _ in range(self.d):
                series = np.cumsum(series)
            return np.asarray(series)
        return from_state_space(self.state_space(dt), n, rng)

    def shape_to_free(self, shape: Shape) -> FloatArray:
        p = self.orders[0]
        parts = (shape[:p], [-c for c in shape[p:]])
        return np.concatenate([np.arctanh(_partial_from_ar(part)) for part in parts])

    def shape_from_free(self, free: FloatArray) -> Shape:
        p = self.orders[0]
        reflection = np.clip(np.tanh(free), -1.0 + 1e-12, 1.0 - 1e-12)
        ar, ma = (_inside(_ar_from_partial(part)) for part in (reflection[:p], reflection[p:]))
        return tuple(float(c) for c in (*ar, *-ma))

    def shape_grid(self, dt: float, n: int) -> list[Shape]:
        size = sum(self.orders)
        levels = (-1.5, -0.3, 0.5, 1.5, 3.0)
        points = np.array(
            list(product(levels, repeat=size))
            if len(levels) ** size <= 700
            else np.random.default_rng(0).normal(0.3, 1.2, (700, size))
        )
        return [self.shape_from_free(point) for point in points]

    @property
    def nested(self) -> tuple[Process, ...]:
        """As many Gauss-Markov processes as the order, where the moving average holds their sum.

        AR(1) processes sum to an ARMA(p, p - 1) (Granger & Morris 1976, *JRSS A* 139, 246-257).
        """
        p, q = self.orders
        return (GaussMarkov(),) * p if self.d == 0 and 2 <= p <= q + 1 else ()

    def shape_of_sum(self, processes: Sequence[Process], dt: float) -> Shape:
        values = [(each.values["sigma"] or 0.0, each.values["tau"] or 0.0) for each in processes]
        power, phi = np.array([(s * s, np.exp(-dt / t)) for s, t in values if s]).reshape(-1, 2).T
        # The moving average has the roots within 1 of the spectrum times the autoregression's.
        spectrum = np.zeros(max(2 * phi.size - 1, 1))
        for k, variance in enumerate(power * (1.0 - phi**2)):
            others = polyfromroots(np.delete(phi, k))
            spectrum += variance * np.convolve(others, others[::-1])
        roots = np.roots(spectrum)
        inner = roots[np.argsort(np.abs(roots))][: roots.size // 2]
        ar, ma = np.zeros(self.orders[0]), np.zeros(self.orders[1])
        ar[: phi.size] = -polyfromroots(phi)[-2::-1]
        ma[: inner.size] = np.real(polyfromroots(inner)[-2::-1])
        return (*map(float, _inside(ar)), *map(float, -_inside(-ma)))


class ARMA(ARIMA):
    """Autoregressive moving average; see `ARIMA` for the parameters."""

    label: ClassVar[str] = "ARMA"
    _examples = (
        ([0.6, 0.2], [0.5], 0.3),
        ([-0.8], [-0.4, 0.2], 1.0),
        ([1.98, -0.9801], [0.2], 1.0),
    )

    def __init__(
        self, ar: Coefficients = 0, ma: Coefficients = 0, sigma2: float | None = None
    ) -> None:
        super().__init__(ar, 0, ma, sigma2)


class AR(ARIMA):
    """Autoregressive; see `ARIMA` for the parameters."""

    label: ClassVar[str] = "AR"
    _examples = (([-0.7], 1.0), ([0.9], 0.1), ([1.2, -0.6], 2.0), ([0.9999], 1e-4))

    def __init__(self, ar: Coefficients = 1, sigma2: float | None = None) -> None:
        super().__init__(ar, 0, 0, sigma2)


class MA(ARIMA):
    """Moving average; see `ARIMA` for the parameters."""

    label: ClassVar[str] = "MA"
    _examples = (([0.5], 1.0), ([-0.9, 0.3], 0.2))

    def __init__(self, ma: Coefficients = 1, sigma2: float | None = None) -> None:
        super().__init__(0, 0, ma, sigma2)


def _coefficients(given: Any, name: str) -> tuple[float | None, ...]:
    if given is None:
        return ()
    if isinstance(given, Integral) and not isinstance(given, bool) and int(given) >= 0:
        return (None,) * int(given)
    if isinstance(given, Real) and not isinstance(given, Integral):
        return (float(given),)
    if isinstance(given, Sequence | np.ndarray) and not isinstance(given, str):
        return tuple(given)
    raise InputError(f"{name} = {given!r}: give an order (0, 1, ...) or a list of coefficients")


def _stable(coefficients: Sequence[float]) -> bool:
    """Whether 1 - c1 z - c2 z^2 ... is stable, by partial autocorrelations: roots are inexact."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return bool(np.all(np.abs(_partial_from_ar(coefficients)) < 1.0))


def _inside(coefficients: FloatArray) -> FloatArray:
    """The same, or next to it where rounding took several roots onto the unit circle."""
    powers = np.arange(1, coefficients.size + 1)
    for inwards in _INWARDS:
        moved = coefficients * (1.0 - inwards) ** powers
        if _stable(moved.tolist()):
            break
    return moved


@lru_cache(maxsize=16)
def _unit_autocovariance(ar: tuple[float, ...], ma: tuple[float, ...], lags: int) -> FloatArray:
    """Autocovariance at lags 0 .. lags-1, unit innovations (Brockwell & Davis 1991, sec. 3.3)."""
    p, q = len(ar), len(ma)
    theta = np.array([1.0, *ma])
    phi = np.array([1.0, *(-c for c in ar)])
    psi = scipy.signal.lfilter(theta, phi, np.eye(q + 1)[0])
    right = np.array([theta[k:] @ psi[: q + 1 - k] for k in range(q + 1)])
    size = max(p, q) + 1
    system, constant = np.zeros((size, size)), np.zeros(size)
    constant[: q + 1] = right
    for k in range(size):
        for i in range(p + 1):
            system[k, abs(k - i)] += phi[i]
    start = np.linalg.solve(system, constant)
    if lags <= size:
        return np.asarray(start[:lags])
    if p == 0:
        return np.pad(start, (0, lags - size))
    # Beyond lag max(p, q) the autocovariance obeys the autoregression alone.
    state = scipy.signal.lfiltic([1.0], phi, start[::-1][:p])
    rest, _ = scipy.signal.lfilter([1.0], phi, np.zeros(lags - size), zi=state)
    return np.concatenate([start, rest])


def haar_sum(covariance: FloatArray, m: float, d: int = 0) -> float:
    """Haar variance at m samples as the sum of the autocovariance against the filter's own.

    The autocorrelation of the Haar filter (d = 0) and of its cumulative sum (d = 1) is the fourth
    difference with step m of -|k|/2 and of |k| (k^2 - 1)/12, divided by (2 m)^2.
    """
    count = int(min(covariance.size, 2 * m))
    k = np.arange(count, dtype=float)
    correlation = np.zeros(count)
    for shift, factor in zip((-2, -1, 0, 1, 2), (1.0, -4.0, 6.0, -4.0, 1.0), strict=True):
        lag = np.abs(k + shift * m)
        correlation += factor * (-0.5 * lag if d == 0 else lag * (lag * lag - 1.0) / 12.0)
    if d == 0 and covariance.size >= 2 * m:
        # The correlation sums to zero: subtracting the variance avoids cancellation.
        covariance = covariance - covariance[0]
    terms = covariance[:count] * correlation
    return float((2.0 * np.sum(terms[1:]) + terms[0]) / (4.0 * m * m))


def _ar_from_partial(reflection: FloatArray) -> FloatArray:
    """Durbin-Levinson: partial autocorrelations to AR coefficients."""
    coefficients = np.zeros(0)
    for value in reflection:
        coefficients = np.append(coefficients - value * coefficients[::-1], value)
    return coefficients


def _partial_from_ar(coefficients: Sequence[float]) -> FloatArray:
    """Inverse of `_ar_from_partial`."""
    current = np.array(coefficients, dtype=float)
    partial = np.empty(current.size)
    for i in range(current.size - 1, -1, -1):
        value = current[i]
        partial[i] = value
        current = (current[:i] + value * current[:i][::-1]) / (1.0 - value * value)
    return partial
