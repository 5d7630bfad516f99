"""The fault that a log shows: looked for before the sensor models are blamed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gmwm.ins import tuning
from gmwm.ins.field.explanations import (
    LEVEL,
    Candidate,
    Explanation,
    constant_errors,
    cost,
    far_heading,
)
from gmwm.ins.field.noises import coloured, fix_noise, outliers, sensor_noise
from gmwm.ins.field.replay import Replay

_CONSTANT = frozenset({"time-offset", "lever-arm", "heading"})


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
        Constant error -> its standard error from this motion, s, m, rad.
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
        base = whole.within(tuning.LARGEST_OFFSET + tuning.OFFSET_MARGIN, tuning.DIAGNOSED)
        here, found = base, list[Explanation]()
        alternatives: tuple[str, ...] = ()
        resolution: dict[str, float] = {}
        while len(found) < tuning.MOST_FAULTS:
            first = list(constant_errors(here))
            alone = {name: e for each in first[:-1] for name, e in each.errors.items()}
            # Those of stamps and antenna together, for each could be taken for the other.
            resolution = alone | first[-1].errors
            known = _CONSTANT & {each.code for each in found}
            refined = _best(_candidates(here, first, known))
            if not refined or refined[0][0].excess <= 0.0:
                break
            best = refined[0]
            if not found:
                alternatives = tuple(
                    each[0].code for each in refined[1:]
                    if each[0].excess > max(best[0].excess - tuning.AMBIGUOUS, 0.0)
                    and each[0].code not in {one.code for one in best}
                )  # fmt: skip
                if len(best) == 1 and best[0].code in first[-1].codes and any(
                    resolution[name] > tuning.SEEN * alone[name] for name in best[0].values
                ):  # fmt: skip
                    other = first[-1].codes - {best[0].code}
                    alternatives = tuple(sorted({*alternatives, *other}))
            found += best
            here = found[-1].replay
        found, here = _cleaned_again(base, found, here)
        return cls(tuple(found), alternatives, not contradicted(here), here, resolution)


def contradicted(replay: Replay) -> bool:
    """Whether the innovations have another size than expected, or depend on those before."""
    if not np.isfinite(replay.log_likelihood):
        return True
    tests = [replay.test(kind) for kind in replay.kinds()]
    return any(each.nis.p_value <= LEVEL or each.whiteness <= LEVEL for each in tests)


def _candidates(here: Replay, constants: list[Candidate], known: frozenset[str]) -> list[Candidate]:
    """Those worth a look; the costly ones only where something is wrong."""
    found = constants
    cleaned = outliers(here)
    if cleaned is not None:
        found.append(cleaned)
    if contradicted(here) or any(each.gain > cost(1) for each in found):
        sizes = [here.test(kind).nis.value for kind in here.kinds()]
        if not np.isfinite(here.log_likelihood) or max(sizes) > tuning.LOST:
            found.append(far_heading(here))
        slow = coloured(here)
        if slow is not None:
            found.append(slow)
        found += [*fix_noise(here), *sensor_noise(here)]
    return [each for each in found if not each.codes & known]


def _best(candidates: list[Candidate]) -> list[tuple[Explanation, ...]]:
    """The most probable explanations, best first."""
    promising = [each for each in candidates if each.gain > cost(1)]
    promising = sorted(promising, key=lambda each: -each.gain)[: tuning.REFINED]
    refined = [each.refined() for each in promising]
    return sorted((each for each in refined if each), key=lambda each: -each[0].excess)


def _cleaned_again(
    base: Replay, found: list[Explanation], here: Replay
) -> tuple[list[Explanation], Replay]:
    """Outliers anew, where something else was found after them that made good fixes look bad."""
    codes = [each.code for each in found]
    if "outliers" not in codes or codes[-1] == "outliers":
        return found, here
    others = [each for each in found if each.code != "outliers"]
    replay = base
    for each in others:
        replay = each.change(replay)
    cleaned = outliers(replay)
    if cleaned is None:
        return (others, replay) if not contradicted(replay) else (found, here)
    (again,) = cleaned.refined()
    place = codes.index("outliers")
    return [*others[:place], again, *others[place:]], again.replay
