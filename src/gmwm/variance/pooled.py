"""Wavelet variances of several recordings of the same noise, taken together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np

from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.process import PSD
from gmwm.variance.wavelet import WaveletVariance


@dataclass(frozen=True, eq=False, repr=False)
class PooledVariance(WaveletVariance):
    """Mean wavelet variance of several recordings, level by level.

    parts: Those of the recordings. All other attributes are as in `WaveletVariance`; there are as
        many levels as the longest recording has, and ``n`` is its length.
    """

    parts: tuple[WaveletVariance, ...] = ()

    @classmethod
    def of(cls, parts: Sequence[WaveletVariance]) -> PooledVariance:
        """Weighted by the equivalent degrees of freedom of each recording at each level.

        Raises InputError if there are none, or they do not belong together.
        """
        if not parts:
            raise InputError("there is no recording: give one wavelet variance at least")
        longest = max(parts, key=lambda part: part.tau.size)
        for part in parts:
            for name in ("dt", "unit", "wavelet", "efficiency"):
                if getattr(part, name) != getattr(longest, name):
                    raise InputError(
                        f"recordings do not belong together: {name} is {getattr(part, name)!r} "
                        f"and {getattr(longest, name)!r}"
                    )
        shares = _shares(parts, longest.tau.size)

        def mean_of(values: Sequence[FloatArray | None]) -> FloatArray | None:
            """Weighted mean of what all recordings have."""
            total = np.zeros(shares.shape[1])
            for value, share in zip(values, shares, strict=True):
                if value is None:
                    return None
                total[: value.size] += share[: value.size] * value
            return total

        covariances = [part.data_covariance for part in parts if part.data_covariance is not None]
        own = {each.name: getattr(longest, each.name) for each in fields(WaveletVariance)}
        pooled = {
            name: mean_of([getattr(part, name) for part in parts])
            for name in ("variance", "mean", "driftless")
        }
        pooled["data_covariance"] = (
            _combined(covariances, shares) if len(covariances) == len(parts) else None
        )
        return cls(**{**own, **pooled, "fourth_cumulant": 0.0}, parts=tuple(parts))

    @cached_property
    def shares(self) -> FloatArray:
        """Weight of each recording at each level, (parts, J); they sum to one."""
        return _shares(self.parts, self.tau.size)

    @property
    def n_all(self) -> int:
        """Number of samples of all recordings."""
        return sum(part.n for part in self.parts)

    @property
    def counts(self) -> FloatArray:
        """Number of coefficients of each level in all recordings, (J,)."""
        total = np.zeros(self.tau.size)
        for part in self.parts:
            total[: part.tau.size] += part.counts
        return total

    def covariance_under(self, psd: PSD, lines: Sequence[tuple[float, float]] = ()) -> FloatArray:
        """Covariance of the mean for Gaussian noise of a given spectrum, u^4, (J, J)."""
        return _combined([part.covariance_under(psd, lines) for part in self.parts], self.shares)

    def mean_covariance_under(self, psd: PSD) -> FloatArray:
        """Covariance of ``mean``, u^2, (J, J)."""
        return _combined([part.mean_covariance_under(psd) for part in self.parts], self.shares)

    def content(self) -> dict[str, Any]:
        """As that of one recording."""
        found = super().content()
        del found["parts"]
        return found


def _shares(parts: Sequence[WaveletVariance], levels: int) -> FloatArray:
    shares = np.zeros((len(parts), levels))
    for row, part in zip(shares, parts, strict=True):
        row[: part.tau.size] = part.dof
    return np.asarray(shares / np.sum(shares, axis=0))


def _combined(matrices: Sequence[FloatArray], shares: FloatArray) -> FloatArray:
    """Covariance of the weighted sum of independent vectors."""
    total = np.zeros((shares.shape[1], shares.shape[1]))
    for matrix, share in zip(matrices, shares, strict=True):
        levels = slice(0, matrix.shape[0])
        total[levels, levels] += np.outer(share[levels], share[levels]) * matrix
    return total
