"""Sensor models as people write them: ``{N: 140 deg/h/sqrt(Hz), GM: [[113 deg/h, 2000 s]]}``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

from pydantic import (
    Discriminator,
    Tag,
    TypeAdapter,
    ValidationInfo,
    field_validator,
    model_validator,
)

from gmwm._core.units import SI_UNIT, si_parameter_unit
from gmwm.calibration import load
from gmwm.errors import InputError
from gmwm.ins.imu import SensorModels
from gmwm.ins.spec.fields import FILE, MODELS, RECORDINGS, REDUCED, FileName, Spec, value, written
from gmwm.process import (
    BiasInstability,
    GaussMarkov,
    Model,
    Process,
    QuantizationNoise,
    RandomWalk,
    RateRamp,
    WhiteNoise,
)

_KINDS: dict[str, type[Process]] = {
    "N": WhiteNoise,
    "K": RandomWalk,
    "Q": QuantizationNoise,
    "B": BiasInstability,
    "R": RateRamp,
}

_PAIRS = TypeAdapter(Annotated[tuple[tuple[Any, Any], ...], written("[[sigma, tau], ...]")])


class Terms(Spec):
    """The error model of a sensor; ``bias`` is the standard deviation of a constant."""

    QUANTITY: ClassVar[str]

    N: WhiteNoise | None = None
    K: RandomWalk | None = None
    Q: QuantizationNoise | None = None
    B: BiasInstability | None = None
    R: RateRamp | None = None
    GM: tuple[GaussMarkov, ...] = ()
    bias: float = 0.0

    @field_validator(*_KINDS, mode="before")
    @classmethod
    def _term(cls, given: Any, info: ValidationInfo) -> Process:
        kind = _KINDS[info.field_name or ""]
        unit = si_parameter_unit(kind.parameters[0].unit, cls.QUANTITY).replace(" s", "*s")
        return kind(value(given, unit))

    @field_validator("GM", mode="before")
    @classmethod
    def _markov(cls, given: Any) -> tuple[GaussMarkov, ...]:
        unit, pairs = SI_UNIT[cls.QUANTITY], _PAIRS.validate_python(given)
        return tuple(GaussMarkov(value(sigma, unit), value(tau, "s")) for sigma, tau in pairs)

    @field_validator("bias", mode="before")
    @classmethod
    def _bias(cls, given: Any) -> float:
        return value(given, SI_UNIT[cls.QUANTITY])

    @model_validator(mode="after")
    def _has_noise(self) -> Self:
        if not self.terms:
            raise ValueError("there is no noise: give N at least")
        Model(self.terms)
        return self

    @property
    def terms(self) -> tuple[Process, ...]:
        """In the order of the keys above."""
        single = (self.N, self.K, self.Q, self.B, self.R)
        return (*(term for term in single if term is not None), *self.GM)


class GyroTerms(Terms):
    """The error model of a gyro."""

    QUANTITY = "gyro"


class AccelTerms(Terms):
    """The error model of an accelerometer."""

    QUANTITY = "accel"


class ModelsSpec(Spec):
    """Models by kind of sensor or by axis; an axis goes before its kind."""

    gyro: GyroTerms | None = None
    accel: AccelTerms | None = None
    gyro_x: GyroTerms | None = None
    gyro_y: GyroTerms | None = None
    gyro_z: GyroTerms | None = None
    accel_x: AccelTerms | None = None
    accel_y: AccelTerms | None = None
    accel_z: AccelTerms | None = None

    @model_validator(mode="after")
    def _complete(self) -> Self:
        self.models()
        return self

    def models(self) -> SensorModels:
        """Models of all six axes."""
        given: dict[str, Terms] = self.given
        return SensorModels.of(
            {name: Model(each.terms) for name, each in given.items()},
            {name: each.bias for name, each in given.items()},
        )


def form_of(given: Any) -> str | None:
    """The form of what may be a file, models or a mapping that says where to take them from."""
    if isinstance(given, str):
        return FILE
    if not isinstance(given, Mapping):
        return None
    return RECORDINGS if "recordings" in given else REDUCED if "reduce" in given else MODELS


OfFile = Annotated[FileName, Tag(FILE)]
OfTerms = Annotated[ModelsSpec, Tag(MODELS)]
Models = Annotated[
    OfFile | OfTerms, Discriminator(form_of), written("a calibration.json, or models")
]
"""Sensor models, or the name of a calibration.json that has them."""


def sensor_models(given: Mapping[str, Any], where: str) -> SensorModels:
    """Models of six sensors from a mapping by axis or kind.

    given: ``gyro``, ``accel`` or an axis such as ``gyro_x`` -> mapping of N, K, Q, B, R to a value,
        GM to a list of [sigma, tau], ``bias`` to the standard deviation of a constant.
    where: For messages.
    Raises InputError if something is missing, unknown or not a number.
    """
    return ModelsSpec.parse(given, where).models()


def read_models(where: str, given: str | ModelsSpec, folder: Path) -> SensorModels:
    """Sensor models from what was written, or from a calibration.json relative to a folder.

    Raises InputError if the file cannot be used, or lacks an axis.
    """
    if isinstance(given, ModelsSpec):
        return given.models()
    try:
        calibration = load(folder / given)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    try:
        return SensorModels.of(calibration)
    except InputError as error:
        raise InputError(f"{where}, {given}: {error}") from None
