"""What stored bootstraps and Cramer-Rao bounds hold."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Self

from pydantic import Field, model_validator

from gmwm._core.forms import Form, Interval, Keys, Model, Samples, covariance


class BootstrapForm(Form):
    """Of `Bootstrap`."""

    keys: Annotated[Keys, Field(min_length=1)]
    draws: Annotated[Sequence[Sequence[float | None]], Field(min_length=2)]

    @model_validator(mode="after")
    def _together(self) -> Self:
        if any(len(row) != len(self.keys) for row in self.draws):
            raise ValueError("draws are not one value a key")
        return self


class CramerRaoForm(Form):
    """Of `CramerRao`."""

    model: Model
    n: Samples
    dt_s: Interval
    keys: Keys
    covariance: Sequence[Sequence[float]]
    wavelet_covariance: Sequence[Sequence[float]]
    exact: bool

    @model_validator(mode="after")
    def _together(self) -> Self:
        covariance(self.covariance, len(self.keys))
        covariance(self.wavelet_covariance, len(self.keys), "wavelet_covariance")
        return self
