"""Samples that are missing, counted also over the blocks of a long series."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gmwm._core.notices import Notice
from gmwm._core.typing import FloatArray


@dataclass(frozen=True)
class Missing:
    """How many samples are missing of a series that may go on.

    n: Samples, those that are missing included.
    samples: Those that are missing.
    gaps, longest: Runs of them, and samples of the longest.
    at_end: Samples of the run at the end; 0 if the last one is there.
    """

    n: int = 0
    samples: int = 0
    gaps: int = 0
    longest: int = 0
    at_end: int = 0

    def and_then(self, values: FloatArray) -> Missing:
        """With the samples (n,) that follow, NaN where one is missing."""
        gone = np.isnan(values)
        edges = np.flatnonzero(np.diff(gone, prepend=False, append=False))
        lengths = edges[1::2] - edges[::2]
        if not lengths.size:
            return Missing(self.n + gone.size, self.samples, self.gaps, self.longest)
        goes_on = self.at_end > 0 and bool(gone[0])
        lengths[0] += self.at_end if goes_on else 0
        return Missing(
            self.n + gone.size,
            self.samples + int(np.count_nonzero(gone)),
            self.gaps + lengths.size - goes_on,
            max(self.longest, int(np.max(lengths))),
            int(lengths[-1]) if gone[-1] else 0,
        )


def missing_notices(found: Mapping[str, Missing]) -> list[Notice]:
    """One for all channels that miss equally many samples in equally many gaps."""
    alike: dict[tuple[int, int, int], list[str]] = {}
    for name, each in found.items():
        if each.samples:
            alike.setdefault((each.samples, each.gaps, each.longest), []).append(name)
    return [_notice(names, found[names[0]]) for names in alike.values()]


def _notice(names: list[str], found: Missing) -> Notice:
    if found.samples == found.n:
        text = f"all {found.n:,} samples missing"
    else:
        text = f"{found.samples:,} of {found.n:,} samples missing"
    if found.gaps > 1:
        plural = "s" if found.longest > 1 else ""
        text += f", in {found.gaps:,} gaps, the longest {found.longest:,} sample{plural}"
    elif found.samples < found.n:
        text += ", in one gap"
    values = {"missing": found.samples, "gaps": found.gaps, "longest": found.longest}
    each = "each " if len(names) > 1 else ""
    return Notice("missing-samples", "note", ", ".join(names), f"{each}{text}", values)
