"""What a stored fit holds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from gmwm._core.forms import (
    Discrepancy,
    Form,
    Freedom,
    Keys,
    Model,
    Notices,
    NotNegative,
    Positive,
    Text,
    covariance,
)


class RegionForm(Form):
    """Of `Region`."""

    key: Text
    slope: Annotated[float, Field(ge=-1.0, le=1.0)]
    tau_min: Positive
    tau_max: Positive
    coefficient: float


class FitForm(Form):
    """Of `Fit`; the wavelet variance has a form of its own."""

    model: Model
    params: dict[Text, float]
    keys: Keys
    covariance: Sequence[Sequence[float]]
    upper_bounds: dict[Text, NotNegative | None]
    objective: float | None
    chi_square: float | None
    chi_square_allowed: float | None
    dof: Freedom
    discrepancy: Discrepancy
    method: Text
    weights: Text
    notices: Notices
    log_likelihood: float | None
    trace: Annotated[Sequence[float], Field(max_length=1_000_000)]
    slope_dof: Positive | None
    regions: Sequence[RegionForm]
    wavelet_variance: dict[str, Any]

    @model_validator(mode="after")
    def _together(self) -> Self:
        if len({*self.keys}) != len(self.keys) or not {*self.keys} <= {*self.params}:
            raise ValueError("keys are not those of parameters, each once")
        covariance(self.covariance, len(self.keys))
        return self


class JointFitForm(FitForm):
    """Of `JointFit`."""

    parts: Annotated[Sequence[dict[str, Any]], Field(min_length=1, max_length=10_000)]
    equality_p: Annotated[float, Field(ge=0.0, le=1.0)] | None
    curves_p: Annotated[float, Field(ge=0.0, le=1.0)] | None
    spread: dict[Text, NotNegative]
