"""What every error process offers, and what it inherits from the few things it gives."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from itertools import product
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from gmwm._core import checks
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.process import spectral
from gmwm.process.parameter import Parameter
from gmwm.process.state_space import StateSpace

if TYPE_CHECKING:
    from gmwm.process.model import Model

Shape = tuple[float, ...]
"""Values of a process's shape parameters, in the order of ``parameters``."""


class Process:
    """A zero-mean Gaussian error process with stationary Haar wavelet coefficients.

    A subclass declares its parameters and gives ``psd``; wavelet variance, simulation and
    everything else follow. Where a closed form is known, it overrides ``haar_variance`` (or
    ``unit_haar_variance``, if it has a shape), ``autocovariance``, ``state_space`` or ``draw``. A
    process without a spectrum in closed form gives ``draw`` alone and is fitted by simulated
    moments.

    What other rooms need to know of a kind is one of the attributes below. A built-in kind is
    registered in ``gmwm.process.kinds`` and needs no entry elsewhere.

    A parameter is *given* (a number) or *open* (``None``, to be estimated). Instances do not
    change.

    Examples
    --------
    >>> from gmwm import Process, parameter
    >>> class PinkishNoise(Process):
    ...     level: float = parameter("u", role="scale")
    ...     slope: float = parameter("-", lower=0.0, upper=2.0)
    ...     def psd(self, f, dt):
    ...         return self.level**2 * dt * (2 * f * dt) ** -self.slope
    >>> PinkishNoise(level=2.0, slope=0.5)
    PinkishNoise(level=2, slope=0.5)
    """

    parameters: tuple[Parameter, ...] = ()
    """The declared parameters, in order; at most one of them linear, see `Parameter.role`."""

    shape_parameters: tuple[Parameter, ...] = ()
    """Those that enter the wavelet variance non-linearly."""

    label: ClassVar[str] = ""
    """Name in tables and legends; the class name where empty."""

    short_name: ClassVar[str] = ""
    """Name on the command line and in study files, e.g. ``"N"``; by default the class name."""

    prefix: ClassVar[str] = ""
    """Put before parameter names in ``params`` of a model, e.g. ``"resonance_"``."""

    is_candidate: ClassVar[bool] = False
    """Whether `gmwm.select` tries it unasked, and mixtures that follow any curve are made of it."""

    is_white: ClassVar[bool] = False
    """Whether it is white at any rate: measurement noise, which needs no state."""

    is_band_limited: ClassVar[bool] = False
    """Whether it is white noise that the sensor filtered: white beyond the memory of the filter,
    it needs no state. Its ``state_space`` is that white noise."""

    is_walk: ClassVar[bool] = False
    """Whether it wanders off from where it starts, so that its start is a parameter of its own."""

    is_flicker: ClassVar[bool] = False
    """Whether it is 1/f noise, a plateau of the Allan deviation that no few states describe."""

    is_exponential: ClassVar[bool] = False
    """Whether ``sigma`` and ``tau`` are those of an autocovariance ``sigma^2 exp(-lag / tau)``."""

    is_drift: ClassVar[bool] = False
    """Whether it is a deterministic slope: a regressor, no noise."""

    is_line: ClassVar[bool] = False
    """Whether all of its variance is in spectral lines."""

    repeatable: ClassVar[bool | None] = None
    """Whether a model can hold two of them; by default if there is a shape parameter."""

    ordered_by: ClassVar[str] = ""
    """Shape parameter by which several terms of this kind are ordered and distinguished."""

    separable_shape: ClassVar[bool] = True
    """Whether each shape parameter maps to the real line by itself (see `shape_to_free`)."""

    has_finite_state_space: ClassVar[bool] = True
    """Whether `state_space`, where there is one, is exact."""

    _examples: ClassVar[tuple[tuple[Any, ...], ...]] = ()  # arguments of those of `examples`
    _constructor: ClassVar[inspect.Signature] = inspect.Signature()
    _accepted: ClassVar[tuple[str, ...]] = ()  # names of its arguments

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        declared = {
            name: value
            for kind in reversed(cls.__mro__)
            for name, value in vars(kind).items()
            if isinstance(value, Parameter)
        }
        cls.parameters = tuple(declared.values())
        cls.shape_parameters = tuple(p for p in cls.parameters if p.role == "shape")
        cls._constructor = inspect.signature(cls.__init__)
        if cls.__init__ is Process.__init__:
            kind = inspect.Parameter.POSITIONAL_OR_KEYWORD
            names = [inspect.Parameter(name, kind) for name in ("self", *declared)]
            cls._constructor = inspect.Signature(names)
        cls._accepted = tuple(cls._constructor.parameters)[1:]
        cls.short_name = vars(cls).get("short_name", cls.__name__)

    def __new__(cls, *args: Any, **kwargs: Any) -> Self:
        # A constructor that names its parameters would answer with a TypeError.
        names = cls._accepted
        if len(args) > len(names) or not kwargs.keys() <= set(names[len(args) :]):
            try:
                cls._constructor.bind_partial(None, *args, **kwargs)
            except TypeError as error:
                listed = ", ".join(names) or "none"
                raise InputError(f"{cls.__name__}: {error}, its parameters are {listed}") from None
        return super().__new__(cls)

    def __init__(self, *args: float | None, **kwargs: float | None) -> None:
        names = [parameter.name for parameter in self.parameters]
        values = dict(zip(names, args, strict=False)) | kwargs
        for parameter in self.parameters:
            value = values.get(parameter.name)
            if value is not None:
                self.__dict__[parameter.name] = parameter.checked(value, type(self).__name__)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"{type(self).__name__} does not change: make a new one")

    # -- values ---------------------------------------------------------------------------------

    @property
    def values(self) -> dict[str, float | None]:
        """Parameter name -> value, ``None`` where open."""
        return {parameter.name: self.__dict__.get(parameter.name) for parameter in self.parameters}

    @property
    def is_open(self) -> bool:
        """Whether any parameter is left open."""
        return any(parameter.name not in self.__dict__ for parameter in self.parameters)

    @property
    def is_plain(self) -> bool:
        """Whether it holds nothing but parameters, so that equal ones are the same."""
        return vars(self).keys() <= {parameter.name for parameter in self.parameters}

    @property
    def is_repeatable(self) -> bool:
        """Whether two of this kind in one model can be distinguished."""
        return bool(self.shape_parameters) if self.repeatable is None else self.repeatable

    @property
    def linear_parameter(self) -> Parameter | None:
        """The parameter whose power is a factor of the wavelet variance, if there is one."""
        return next((parameter for parameter in self.parameters if parameter.linear), None)

    @property
    def shape_values(self) -> Shape:
        """Values of the shape parameters, zero where open."""
        return tuple([float(self.__dict__.get(p.name) or 0.0) for p in self.shape_parameters])

    def at_unit(self, shape: Shape) -> Self:
        """A copy at another shape and unit amplitude."""
        linear = self.linear_parameter
        return self.with_shape(shape, **({} if linear is None else {linear.name: 1.0}))

    def with_shape(self, shape: Shape, **values: float | None) -> Self:
        """A copy at another shape, and with other parameter values."""
        names = [parameter.name for parameter in self.shape_parameters]
        return self.with_values(**dict(zip(names, shape, strict=True)), **values)

    def with_values(self, **values: float | None) -> Self:
        """A copy with other parameter values.

        Raises
        ------
        InputError
            For an unknown parameter or a value out of range.
        """
        return type(self)(**{**self.values, **values})

    def opened(self) -> Self:
        """A copy with every parameter open."""
        return self.with_values(**dict.fromkeys(self.values))

    def with_amplitude(self, amplitude: float) -> Self:
        """A copy whose wavelet variance is ``amplitude`` times that at unit amplitude.

        A process without a linear parameter is returned as it is.
        """
        linear = self.linear_parameter
        if linear is None:
            return self
        return self.with_values(**{linear.name: amplitude ** (1.0 / linear.power)})

    # -- primitives -----------------------------------------------------------------------------

    @classmethod
    def has_spectrum(cls) -> bool:
        """Whether the spectrum is known; if not, everything is found by simulation."""
        return cls.psd is not Process.psd

    def psd(self, f: FloatArray, dt: float) -> FloatArray:
        """Two-sided power spectral density of the sampled process, without spectral lines.

        Parameters
        ----------
        f : ndarray
            Frequencies in Hz, 0 < f <= 1/(2 dt).
        dt : float
            Sampling interval in seconds.

        Returns
        -------
        ndarray
            In u^2/Hz; its integral over (-1/(2 dt), 1/(2 dt)) is the variance, where that exists.

        Raises
        ------
        InputError
            If the process is known by simulation only.
        """
        name = type(self).__name__
        if type(self).draw is Process.draw:
            raise InputError(f"{name} gives neither psd nor draw: define one of them")
        raise InputError(f'{name} can only be simulated: fit it with method="simulated"')

    def lines(self) -> tuple[tuple[float, float], ...]:
        """Spectral lines as (frequency in Hz, amplitude in u)."""
        return ()

    def drift_rate(self) -> float:
        """Deterministic slope in u/s."""
        return 0.0

    # -- what follows from them -------------------------------------------------------------------

    def haar_variance(self, tau: FloatArray, dt: float) -> FloatArray:
        """Haar MODWT wavelet variance, half the Allan variance.

        Parameters
        ----------
        tau : array_like
            Averaging times in seconds, multiples of ``dt``.
        dt : float
            Sampling interval in seconds.

        Returns
        -------
        ndarray
            Same shape as ``tau``, in u^2.
        """
        tau, linear = np.asarray(tau, dtype=float), self.linear_parameter
        if type(self).unit_haar_variance is Process.unit_haar_variance or linear is None:
            return spectral.haar_variance(self.psd, tau, dt)
        shape = tuple(getattr(self, parameter.name) for parameter in self.shape_parameters)
        amplitude: float = getattr(self, linear.name) ** linear.power
        unit = self.unit_haar_variance(shape, np.ascontiguousarray(tau.ravel()), dt)
        return amplitude * unit.reshape(tau.shape)

    def wavelet_variance(self, tau: FloatArray, dt: float, wavelet: str = "haar") -> FloatArray:
        """Wavelet variance by any Daubechies filter.

        Parameters
        ----------
        tau : array_like
            Averaging times in seconds, multiples of ``dt``; dyadic ones but for "haar".
        dt : float
            Sampling interval in seconds.
        wavelet : str, optional
            Name as in PyWavelets, e.g. "db2".

        Returns
        -------
        ndarray
            Same shape as ``tau``, in u^2.
        """
        if wavelet == "haar":
            return self.haar_variance(tau, dt)
        return spectral.wavelet_variance(self.psd, self.lines(), tau, dt, wavelet)

    def unit_haar_variance(self, shape: Shape, tau: FloatArray, dt: float) -> FloatArray:
        """`haar_variance` at another shape and unit amplitude, (J,): the estimator's inner loop."""
        return np.asarray(self.at_unit(shape).haar_variance(tau, dt), dtype=float)

    def unit_haar_slopes(self, shape: Shape, tau: FloatArray, dt: float) -> FloatArray | None:
        """Derivatives of `unit_haar_variance` by the coordinates of `shape_to_free`, (J, s).

        ``None``: the estimator takes differences.
        """
        return None

    def autocovariance(self, lag: FloatArray, dt: float) -> FloatArray:
        """Autocovariance in u^2 at lags in samples (non-negative integers).

        Raises
        ------
        InputError
            If none is known for this process.
        """
        raise InputError(f"{type(self).__name__} has no autocovariance: define it in its class")

    def state_space(self, dt: float) -> StateSpace:
        """State-space form at sampling interval ``dt`` (s), with stationary initial covariance.

        Raises
        ------
        InputError
            If the process has none.
        """
        raise InputError(
            f"{type(self).__name__} has no state-space form: approximate it by Gauss-Markov "
            "processes for use in a Kalman filter"
        )

    def simulate(
        self, n: int, dt: float, seed: int | np.random.Generator | None = None
    ) -> FloatArray:
        """Draw ``n`` samples, in u; stationary processes start in their stationary state.

        Parameters
        ----------
        n : int
        dt : float
            Sampling interval in seconds.
        seed : int or numpy.random.Generator, optional

        Returns
        -------
        (n,) ndarray

        Raises
        ------
        InputError
            If a parameter is open, ``n`` or ``dt`` is not positive or too large, or ``draw`` of a
            subclass gives no series.
        """
        self._alone().require_given()
        n = checks.samples(n)
        dt = checks.positive("dt", dt, "give a positive sampling interval in seconds")
        where = f"draw of {type(self).__name__}"
        try:
            drawn: Any = self.draw(n, dt, checks.generator(seed))
        except MemoryError:
            raise InputError(f"n = {n:,}: too many samples for the memory, give fewer") from None
        if drawn is None:
            raise InputError(f"{where} returns nothing: let it return {n:,} samples")
        series = checks.real_numbers(drawn, f"what {where} returns")
        if series.shape != (n,):
            raise InputError(
                f"{where} returns an array of shape {series.shape}: let it return {n:,} samples"
            )
        if not np.all(np.isfinite(series)):
            raise InputError(f"{where} returns samples that are not finite: correct it")
        return series

    def draw(self, n: int, dt: float, rng: np.random.Generator) -> FloatArray:
        """``n`` samples of a process with given parameters, in u; see `simulate`.

        A process that is known by simulation only gives this. To be estimated, it must use the
        generator in the same way whatever its parameters are: the same random numbers then give
        series that change smoothly with the parameters.
        """
        return spectral.from_psd(self.psd, n, dt, rng)

    # -- for the estimator ------------------------------------------------------------------------

    def shape_grid(self, dt: float, n: int) -> list[Shape]:
        """Shapes among which the estimator looks for starting values.

        The default is a logarithmic grid over each parameter's range where that is finite, with
        times taken between ``dt`` and the length of the record and frequencies up to 1/(2 dt).
        """
        axes = [parameter.grid(dt, n).tolist() for parameter in self.shape_parameters]
        return list(product(*axes))

    @property
    def nested(self) -> tuple[Process, ...]:
        """Open processes whose sum is a case of this kind: the search starts from their fit."""
        return ()

    def shape_of_sum(self, processes: Sequence[Process], dt: float) -> Shape:
        """The shape at which this process is a sum of `nested` ones with values."""
        raise NotImplementedError

    def shape_to_free(self, shape: Shape) -> FloatArray:
        """Map shape parameters to the whole real line."""
        return np.array([p.to_free(v) for p, v in zip(self.shape_parameters, shape, strict=True)])

    def shape_from_free(self, free: FloatArray) -> Shape:
        """Inverse of `shape_to_free`."""
        pairs = zip(self.shape_parameters, free.tolist(), strict=True)
        return tuple([parameter.from_free(z) for parameter, z in pairs])

    @classmethod
    def examples(cls) -> tuple[Process, ...]:
        """Instances with given parameters, held to the laws of the test suite."""
        return tuple(cls(*arguments) for arguments in cls._examples)

    def to_dict(self) -> dict[str, Any]:
        """Kind and constructor arguments in JSON types."""
        return {"process": type(self).__name__, **self.values}

    # -- sums, looks, equality --------------------------------------------------------------------

    def _alone(self) -> Model:
        from gmwm.process.model import Model  # a sum of processes, which make sums

        return Model((self,))

    def __add__(self, other: Any) -> Model:
        return self._alone() + other

    def __radd__(self, other: Any) -> Model:
        return self._alone().__radd__(other)

    def __rmul__(self, times: int) -> Model:
        return times * self._alone()

    __mul__ = __rmul__

    def __repr__(self) -> str:
        given = ", ".join(f"{k}={v:.4g}" for k, v in self.values.items() if v is not None)
        return f"{type(self).__name__}({given})"

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and self.values == other.values

    def __hash__(self) -> int:
        return hash((type(self), *self.values.items()))

    def named(self) -> str:
        """The term as a reader finds it in a model: ``Gauss-Markov term of tau = 0.52 s``."""
        shape = ", ".join(
            f"{p.name} = {self.values[p.name]:.3g} {p.unit}".removesuffix(" -")
            for p in self.shape_parameters
            if self.values[p.name] is not None
        )
        return f"{self.title()} term" + (f" of {shape}" if shape else "")

    @classmethod
    def title(cls) -> str:
        """Name for tables and legends."""
        return cls.label or cls.__name__
