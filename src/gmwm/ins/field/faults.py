"""The fault that a log shows: looked for before the sensor models are blamed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gmwm.ins import tuning
from gmwm.ins.field.explanations import (
    CONSTANTS,
    LEVEL,
    Candidate,
    Explanation,
    coloured,
    constant_errors,
    cost,
    far_heading,
    fix_noise,
    outliers,
    sensor_noise,
)
from gmwm.ins.field.replay import Replay


@dataclass(frozen=True, eq=False)
class Faults:
    """What explains the innovations of a log better than that all is right.

    Attributes
    ----------
    found : tuple of Explanation
        Each given those before it; empty if there is none.
    alternatives : tuple of str
        Codes that explain the log nearly as well as the first.
    explained : bool
        Whether the innovations agree with the filter, with these allowed for.
    replay : Replay
        The log with these allowed for.
    resolution : dict
        Constant error -> its standard error from this motion, s, m, rad; it is seen if it is five
        times as large.
    """

    found: tuple[Explanation, ...]
    alternatives: tuple[str, ...]
    explained: bool
    replay: Replay
    resolution: dict[str, float]

    @classmethod
    def of(cls, whole: Replay) -> Faults:
        """Look for faults.

        One after the other, the explanation is taken that makes the fixes most probable, as long as
        it is more than chance would give.

        Parameters
        ----------
        whole : Replay
        """
        here = whole.within(tuning.LARGEST_OFFSET + tuning.OFFSET_MARGIN, tuning.DIAGNOSED)
        found: list[Explanation] = []
        alternatives: tuple[str, ...] = ()
        resolution: dict[str, float] = {}
        while len(found) < tuning.MOST_FAULTS:
            first = list(constant_errors(here))
            resolution = {name: e for each in first for name, e in each.errors.items()}
            refined = _best(_candidates(here, first, {_key(each) for each in found}))
            if not refined or refined[0].excess <= 0.0:
                break
            best = refined[0]
            if not found:
                alternatives = tuple(
                    each.code for each in refined[1:]
                    if each.excess > 0.0 and best.excess - each.excess < tuning.AMBIGUOUS
                    and each.code != best.code
                )  # fmt: skip
            found.append(best)
            here = best.replay
        return cls(tuple(found), alternatives, not contradicted(here), here, resolution)


def contradicted(replay: Replay) -> bool:
    """Whether the innovations have another size than expected, or depend on those before."""
    if not np.isfinite(replay.log_likelihood):
        return True
    tests = [replay.test(kind) for kind in replay.kinds()]
    return any(each.nis.p_value <= LEVEL or each.whiteness <= LEVEL for each in tests)


def _candidates(
    here: Replay, constants: list[Candidate], known: set[str]
) -> list[Candidate]:
    """Those worth a look; the costly ones only where something is wrong."""
    found = [each for each in constants if each.key not in known]
    cleaned = outliers(here)
    if cleaned is not None:
        found.append(cleaned)
    if contradicted(here) or any(each.gain > cost(1) for each in found):
        lost = max((here.test(kind).nis.value for kind in here.kinds()), default=1.0)
        if not np.isfinite(here.log_likelihood) or lost > tuning.LOST:
            found.append(far_heading(here))
        white = coloured(here)
        if white is not None:
            found.append(white)
        found += [*fix_noise(here), *sensor_noise(here)]
    return [each for each in found if each.key not in known]


def _key(explanation: Explanation) -> str:
    return explanation.code if explanation.code in {each.code for each in CONSTANTS} else ""


def _best(candidates: list[Candidate]) -> list[Explanation]:
    """The most probable explanations, best first."""
    promising = [each for each in candidates if each.gain > cost(1)]
    promising = sorted(promising, key=lambda each: -each.gain)[: tuning.REFINED]
    refined = [each.refined() for each in promising]
    return sorted((each for each in refined if each is not None), key=lambda each: -each.excess)
