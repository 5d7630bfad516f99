"""Regressors of a curve beside the noise, and what the levels of a wavelet variance see of them.

The series is ``X beta + noise``. Of the regressors X, such as powers of a temperature, only block
means are kept: they are slow, and so is what they take of the noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from gmwm._core.documents import Array, Interval, Samples
from gmwm._core.typing import FloatArray
from gmwm.variance import tuning

if TYPE_CHECKING:
    from gmwm.variance.wavelet import WaveletVariance


@dataclass(frozen=True, eq=False)
class RegressorPart:
    """Block means of one recording.

    blocks: (B,), of the series less ``X removed``, NaN where samples are missing, u.
    columns: (p, B), of the regressors.
    block: Samples in a block.
    weight: (J,), of the recording at each level; they sum to one.
    """

    blocks: Array
    columns: Array
    block: Samples
    weight: Array

    def seen(self, steps: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Mean products of Haar coefficients of averaging times ``steps``, in blocks, (J,).

        Returns: those of regressors, (J, p, p); of regressors with the series, (J, p); and with
            the differences of its neighbouring blocks, (J, p, B - 1), zero below one block.
        """
        (p, size), levels = self.columns.shape, steps.size
        there = ~np.isnan(self.blocks)
        place = np.arange(size)
        rows = np.vstack([self.columns, np.interp(place, place[there], self.blocks[there])])
        integral = np.pad(np.cumsum(rows, axis=1), ((0, 0), (1, 0)))
        products, response = np.zeros((levels, p, p + 1)), np.zeros((levels, p, size - 1))
        coarse = np.flatnonzero((steps >= 1.0) & (2.0 * steps <= size))
        for j in coarse:
            begin = np.linspace(0.0, size - 2.0 * steps[j], int(size - 2.0 * steps[j]) + 1)
            operator = np.zeros((begin.size, size + 1))
            for k, sign in enumerate((0.5, -1.0, 0.5)):  # linear between the edges of blocks
                at = begin + k * steps[j]
                low = np.minimum(at.astype(int), size - 1)
                for node, share in ((low, 1.0 + low - at), (low + 1, at - low)):
                    operator[np.arange(at.size), node] += sign / steps[j] * share
            x = operator @ integral.T
            products[j] = x[:, :p].T @ x / begin.size
            edges = x[:, :p].T @ operator / begin.size
            # Sums over the blocks after an edge, then over the differences before a block.
            sums = np.cumsum(edges[:, :0:-1], axis=1)[:, ::-1]
            response[j] = -np.cumsum(sums, axis=1)[:, :-1]
        first = int(coarse[0]) if coarse.size else 0
        fine = (steps[:first] / steps[first]) ** 2  # a smooth curve is straight there
        products[:first] = products[first] * fine[:, None, None]
        return products[..., :p], products[..., p], response


@dataclass(frozen=True, eq=False)
class Regressors:
    """Regressors of one or several recordings, with common coefficients.

    parts: Each recording, with a level of its own.
    removed: (p,), coefficients whose curve has been subtracted from the series.
    tau: (J,), averaging times of the levels, s.
    dt: Sampling interval, s.
    """

    parts: tuple[RegressorPart, ...]
    removed: Array
    tau: Array
    dt: Interval

    @classmethod
    def of(
        cls, wv: WaveletVariance, columns: Sequence[FloatArray], removed: FloatArray
    ) -> Regressors:
        """Those of a wavelet variance.

        columns: Each regressor at the middles of ``wv.blocks``.
        removed: (p,), coefficients whose curve has been subtracted from the series.
        """
        merged = -(-wv.blocks.size // tuning.BLOCKS_OF_REGRESSORS)
        whole = wv.blocks.size // merged * merged
        rows = np.vstack([wv.blocks, *columns])[:, :whole]
        means = rows.reshape(len(rows), -1, merged).mean(axis=2)
        part = RegressorPart(means[0], means[1:], wv.block * merged, np.ones(wv.tau.size))
        return cls((part,), removed, wv.tau, wv.dt)

    @classmethod
    def pooled(cls, each: Sequence[Regressors], shares: FloatArray, tau: FloatArray) -> Regressors:
        """Regressors of several recordings, weighted by their shares, (recordings, J)."""
        parts = (
            replace(own, weight=share)
            for one, share in zip(each, shares, strict=True)
            for own in one.parts
        )
        return cls(tuple(parts), each[0].removed, tau, each[0].dt)

    @cached_property
    def _seen(self) -> list[tuple[FloatArray, FloatArray, FloatArray]]:
        steps = self.tau / self.dt
        return [part.seen(steps / part.block) for part in self.parts]

    @cached_property
    def gram(self) -> FloatArray:
        """Mean products of the regressors' wavelet coefficients, (J, p, p)."""
        pairs = zip(self.parts, self._seen, strict=True)
        total = sum(part.weight[:, None, None] * seen[0] for part, seen in pairs)
        return np.asarray(total)

    @cached_property
    def cross(self) -> FloatArray:
        """Mean products of these with the coefficients of the series, (J, p), u."""
        pairs = zip(self.parts, self._seen, strict=True)
        return np.asarray(sum(part.weight[:, None] * seen[1] for part, seen in pairs))

    @cached_property
    def responses(self) -> list[FloatArray]:
        """Responses of each recording to differences of neighbouring blocks, (J, p, B - 1)."""
        pairs = zip(self.parts, self._seen, strict=True)
        return [part.weight[:, None, None] * seen[2] for part, seen in pairs]
