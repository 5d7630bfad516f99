"""What people write, checked field by field: values with units, models of sensors, YAML files.

A value such as ``"140 deg/h"`` becomes a number in SI units; pydantic says where a fault stood.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self, TypeVar

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    StringConstraints,
    Tag,
    TypeAdapter,
    ValidationError,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    WrapValidator,
    field_validator,
    model_validator,
)

from gmwm._core import checks
from gmwm._core.documents import read_yaml
from gmwm._core.units import SI_UNIT, factor, si_parameter_unit
from gmwm.calibration import load
from gmwm.errors import InputError
from gmwm.ins.sensors import SensorModels
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

FILE, RECORDINGS, MODELS = TAGS = ("<file>", "<recordings>", "<models>")
"""Forms that one key may have; pydantic puts them into the place of an error."""

_LEAST, _LARGEST = 1e-60, 1e60  # SI: beyond, powers overflow or vanish
_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*)")


class Spec(BaseModel):
    """A mapping of known keys; those without a value count as left out."""

    model_config = ConfigDict(frozen=True, arbitrary_types_allowed=True)

    NEEDS: ClassVar[str] = "write it"
    """What to do where a key is missing."""

    @model_validator(mode="before")
    @classmethod
    def _known(cls, given: Any) -> Any:
        names = ", ".join(cls.model_fields)
        if not isinstance(given, Mapping):
            raise ValueError(f"{checks.shown(given)}: write KEY: VALUE; keys are {names}")
        for name in given:
            if name not in cls.model_fields:
                raise ValueError(f"{checks.shown(name)} is unknown: there are {names}")
        return {name: each for name, each in given.items() if each is not None}

    @classmethod
    def parse(cls, given: Any, where: str = "") -> Self:
        """Check what was written."""
        try:
            return cls.model_validate(given)
        except ValidationError as error:
            raise InputError(*_sentence(error, where, cls.NEEDS)) from None

    @property
    def given(self) -> dict[str, Any]:
        """The values that were written, by key."""
        return {name: getattr(self, name) for name in self.model_fields_set}


def _sentence(error: ValidationError, where: str, needs: str) -> tuple[str, str]:
    """Text and code."""
    errors = error.errors(include_url=False)
    first, path, place = errors[0], errors[0]["loc"], where
    missing = [str(each["loc"][-1]) for each in errors if each["type"] == "missing"]
    code = "missing-key" if first["type"] == "missing" else ""
    for part in path[:-1] if code else path:
        if isinstance(part, int):
            place += f"[{part}]"
        elif part not in TAGS:
            place += f", {part}" if place else part
    if code:
        text = f"there is no {', no '.join(missing)}: {needs}"
    elif first["type"] == "value_error":
        text = str(first["ctx"]["error"])
    else:
        text = f"{checks.shown(first['input'])}: {first['msg'][0].lower()}{first['msg'][1:]}"
    return (f"{place}: {text}" if place else text), code


def value(given: Any, si_unit: str) -> float:
    """A finite number in SI units, from a number or from text such as ``"140 deg/h"``."""
    if checks.is_number(given):
        found = float(given)
    else:
        match = _NUMBER.fullmatch(given) if isinstance(given, str) else None
        if match is None:
            raise InputError(
                f"{checks.shown(given)} is not a number: write one, with a unit like {si_unit} or "
                "without for SI"
            )
        number, unit = match.groups()
        found = float(number) * (factor(unit, si_unit) if unit else 1.0)
    if found != 0.0 and not _LEAST < abs(found) < _LARGEST:
        raise InputError(f"{checks.shown(given)} is outside the plausible range: check it")
    return found


def number(si_unit: str) -> BeforeValidator:
    """A value in SI units."""
    return BeforeValidator(lambda given: value(given, si_unit))


def written(form: str) -> WrapValidator:
    """Something of a form, which the message shows where another was written."""

    def check(given: Any, handler: ValidatorFunctionWrapHandler) -> Any:
        try:
            return handler(given)
        except ValidationError as error:
            # A part that has the form and another fault, or lacks a key, says it better.
            for each in error.errors():
                lacks = each["type"] == "missing" and isinstance(each["loc"][-1], str)
                if lacks or each["type"] in ("value_error", "greater_than"):
                    raise
            raise ValueError(f"{checks.shown(given)}: write {form}") from None

    return WrapValidator(check)


T = TypeVar("T")
Three = Annotated[
    tuple[T, T, T],
    written("three values, or one for all"),
    BeforeValidator(lambda given: given if isinstance(given, list | tuple) else (given,) * 3),
]
Seconds = Annotated[float, number("s")]
Meters = Annotated[float, number("m")]
Radians = Annotated[float, number("rad")]
PositiveHertz = Annotated[float, number("Hz"), Field(gt=0.0)]
PositiveMeters = Annotated[Meters, Field(gt=0.0)]
PositiveRadians = Annotated[Radians, Field(gt=0.0)]
PositiveSeconds = Annotated[Seconds, Field(gt=0.0)]
PositiveSpeed = Annotated[float, number("m/s"), Field(gt=0.0)]
FileName = Annotated[str, StringConstraints(pattern=r"^[^\x00]+$"), written("the name of a file")]


def read_document(path: Path) -> dict[str, Any]:
    """Content of a YAML file, a mapping; keys without a value are left out."""
    content = read_yaml(path)
    if content is None:
        raise InputError(f"{path} is empty: write trajectory:, truth:, filters: into it")
    if not isinstance(content, Mapping):
        raise InputError(
            f"{path}: {checks.shown(content)} is not a mapping: write KEY: VALUE lines"
        )
    return {name: each for name, each in content.items() if each is not None}


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

    @field_validator("*", mode="before")
    @classmethod
    def _in_si(cls, given: Any, info: ValidationInfo) -> Any:
        name, unit = info.field_name or "", SI_UNIT[cls.QUANTITY]
        if name == "bias":
            return value(given, unit)
        if name == "GM":
            pairs = _PAIRS.validate_python(given)
            return tuple(GaussMarkov(value(sigma, unit), value(tau, "s")) for sigma, tau in pairs)
        kind = _KINDS[name]
        unit = si_parameter_unit(kind.parameters[0].unit, cls.QUANTITY)
        return kind(value(given, unit.replace(" s", "*s")))

    @model_validator(mode="after")
    def _has_noise(self) -> Self:
        if not self.terms:
            raise ValueError("there is no noise: give at least N")
        Model(self.terms)
        return self

    @property
    def terms(self) -> tuple[Process, ...]:
        """In the order of the keys above."""
        single = (getattr(self, name) for name in _KINDS)
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
    return RECORDINGS if "recordings" in given else MODELS


OfFile = Annotated[FileName, Tag(FILE)]
OfTerms = Annotated[ModelsSpec, Tag(MODELS)]
Models = Annotated[
    OfFile | OfTerms,
    Discriminator(form_of),
    written("a calibration.json, models, or a file of gmwm bound or reduce"),
]
"""Sensor models, or the name of a calibration.json or of filter numbers that have them."""


def sensor_models(given: Mapping[str, Any], where: str) -> SensorModels:
    """Models of six sensors from a mapping as of `ModelsSpec`, written at ``where``."""
    return ModelsSpec.parse(given, where).models()


def read_models(where: str, given: str | ModelsSpec, folder: Path) -> SensorModels:
    """Sensor models from what was written, or from a file relative to a folder."""
    if isinstance(given, ModelsSpec):
        return given.models()
    place = f"{where}: "
    try:
        found = load(folder / given)
        place = f"{where}, {given}: "
        return SensorModels.of(found)
    except InputError as error:
        raise InputError(f"{place}{error}") from None
