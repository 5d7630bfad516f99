"""Mean and mean square of the Haar coefficients of all levels, in as many threads as there are."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from gmwm._core.typing import FloatArray, IntArray
from gmwm.variance import tuning
from gmwm.variance.kernels import FINE, coarse_moments, fine_moments

_ROW = 1 << FINE


def haar_moments(
    values: FloatArray, integral: FloatArray, runs: IntArray, averaging: FloatArray
) -> FloatArray:
    """Mean and mean square of the Haar MODWT coefficients that lie within a run, (L, 2).

    values: (n,), about their mean.
    integral: (n + 1,), their cumulative sum, starting with 0.
    runs: (P, 2), first sample of each run, and the one after its last.
    averaging: (L,), averaging times in samples: powers of two in a row, of each of which a window
        fits a run.
    """
    m = averaging.astype(np.int64)
    first = int(m[0]).bit_length() - 1
    fine = m[m < _ROW]
    coarse = m[m >= _ROW]
    long = runs[runs[:, 1] - runs[:, 0] >= 2 * m[0]]
    levels = first + fine.size

    def of_part(part: int, parts: int) -> FloatArray:
        found = np.zeros((first + m.size, 3))
        for start, stop in long.tolist():
            edges = [start + (stop - start) * i // parts for i in (part, part + 1)]
            if fine.size:
                fine_moments(values, edges[0], edges[1], stop, levels, found[:levels])
            if coarse.size and stop - start >= 2 * coarse[0]:
                columns = (_ROW * part // parts, _ROW * (part + 1) // parts)
                coarse_moments(integral, start, stop, columns, coarse, found[first + fine.size :])
        return found[first:]

    number, total, square = np.sum(_in_threads(of_part, values.size), axis=0).T
    return np.stack([total, square], axis=1) / number[:, None]


def _in_threads(work: Callable[[int, int], FloatArray], n: int) -> list[FloatArray]:
    """What each part gives; a short series is one part."""
    parts = min(_processors(), n // tuning.SAMPLES_PER_THREAD)
    if parts < 2:
        return [work(0, 1)]
    with ThreadPoolExecutor(parts) as pool:
        return list(pool.map(work, range(parts), [parts] * parts))


def _processors() -> int:
    """Those that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
