"""What a stored wavelet variance holds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from gmwm._core.forms import (
    Form,
    Fraction,
    Interval,
    Positive,
    Samples,
    Text,
    covariance,
)
from gmwm.process import wavelet
from gmwm.variance import tuning

_DYADIC = 1e-6  # relative; averaging times are exact but for rounding

Levels = Annotated[Sequence[float], Field(min_length=1, max_length=64)]


_Variance = Annotated[float, Field(ge=0.0, le=tuning.LARGEST_VARIANCE)]


class GapsForm(Form):
    """Of `GapEffects`."""

    missing: Annotated[int, Field(ge=0)]
    counts: Annotated[Sequence[Positive], Field(max_length=64)]
    change: Annotated[Sequence[Annotated[float, Field(gt=-1.0)]], Field(max_length=64)]
    inflation: Annotated[Sequence[Sequence[float]], Field(max_length=64)]


class WaveletVarianceForm(Form):
    """Of `WaveletVariance`."""

    n: Samples
    dt: Interval
    name: Text
    quantity: Text | None
    unit: Text
    confidence: Fraction
    tau: Levels
    variance: Annotated[Sequence[_Variance], Field(min_length=1, max_length=64)]
    mean: Levels
    block: Samples
    blocks: Annotated[Sequence[float | None], Field(min_length=1, max_length=tuning.MOST_BLOCKS)]
    wavelet: Text
    efficiency: Annotated[float, Field(gt=0.0, le=1.0)]
    driftless: Levels | None
    gaps: GapsForm | None
    fourth_cumulant: Annotated[float, Field(ge=0.0, le=tuning.LARGEST_VARIANCE**2)] = 0.0
    data_covariance: Sequence[Sequence[float]] | None

    @model_validator(mode="after")
    def _together(self) -> Self:
        size = len(self.tau)
        complete = (
            self.n.bit_length() - 1
            if self.wavelet == "haar"
            else wavelet(self.wavelet).levels(self.n)
        )
        if size > complete or (self.gaps is None and size < complete):
            raise ValueError(f"{size} levels where {self.n:,} samples have {complete}")
        for name in ("variance", "mean", "driftless"):
            values = getattr(self, name)
            if values is not None and len(values) != size:
                raise ValueError(f"{name} has {len(values)} levels, tau has {size}")
        if not np.allclose(self.tau, self.dt * 2.0 ** np.arange(size), rtol=_DYADIC, atol=0.0):
            raise ValueError("averaging times are not octaves of the sampling interval")
        if self.block * len(self.blocks) > self.n:
            raise ValueError("blocks hold more samples than there are")
        if self.gaps is not None:
            if self.gaps.missing >= self.n or not size == len(self.gaps.counts) == len(
                self.gaps.change
            ):
                raise ValueError("gaps are those of another series")
            covariance(self.gaps.inflation, size, "inflation")
        if self.data_covariance is not None:
            covariance(self.data_covariance, size, "data_covariance")
        return self
