"""Which samples of a series exist: runs between gaps."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gmwm._core.typing import FloatArray


@dataclass(frozen=True)
class Runs:
    """Runs of samples without a missing one.

    Attributes
    ----------
    starts, stops : tuple of int
        First sample of each run, and the one after its last, ascending.
    n : int
        Length of the series, missing samples included.
    """

    starts: tuple[int, ...]
    stops: tuple[int, ...]
    n: int

    @classmethod
    def of(cls, values: FloatArray) -> Runs:
        """Those of a series (n,) in which NaN stands for missing samples."""
        present = np.concatenate([[False], ~np.isnan(values), [False]])
        edges = np.flatnonzero(present[1:] != present[:-1])
        return cls(tuple(edges[::2].tolist()), tuple(edges[1::2].tolist()), int(values.size))

    @property
    def is_complete(self) -> bool:
        """Whether no sample is missing."""
        return self.starts == (0,) and self.stops == (self.n,)

    @cached_property
    def edges(self) -> NDArray[np.int64]:
        """Starts and stops, (runs, 2)."""
        return np.stack([self.starts, self.stops], axis=1).astype(np.int64)

    @property
    def present(self) -> int:
        """Number of samples that exist."""
        return int(np.sum(self.edges[:, 1] - self.edges[:, 0]))

    @property
    def longest(self) -> int:
        """Length of the longest run."""
        return int(np.max(self.edges[:, 1] - self.edges[:, 0], initial=0))
