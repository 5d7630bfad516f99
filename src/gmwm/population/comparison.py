"""The result of `compare`, axis by axis."""

from __future__ import annotations

import json
import os
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic_core import to_json

from gmwm._core.frozen import ByName, freeze
from gmwm._core.pages import make
from gmwm._core.text import Printed, brief, bullets, frame, per_cent, wrapped
from gmwm._core.units import customary_unit
from gmwm.calibration import Calibration
from gmwm.estimate import Fit
from gmwm.filter_numbers import AxisFilterNumbers
from gmwm.issues import Notice, worst_first
from gmwm.population import tuning
from gmwm.population.curves import Difference, Equality
from gmwm.population.unit import LETTERS, Structure

if TYPE_CHECKING:
    import pandas

State = Literal["agree", "close", "differ", "untested"]

STATES: dict[State, str] = {
    "agree": "agree",
    "close": "differ by less than 10 %",
    "differ": "differ",
    "untested": "not compared",
}
"""Verdicts in words, the best first."""

_NAMES = {"short": "short times", "R": "drift"}


def _percent(share: float) -> str:
    """A relative difference; a factor from one on."""
    return per_cent(share) if share < 0.995 else f"a factor of {brief(1.0 + share)}"


@dataclass(frozen=True, eq=False)
class AxisComparison:
    """One channel in several recordings.

    fits: Recording that is compared -> its own fit.
    left_out: Recording that is not -> why.
    equality: Test of the curves; ``None`` where fewer than two recordings are compared.
    p_value: p-value of that test, adjusted for the number of channels (Holm); NaN without a test.
    structure: One model structure for all of them, and N, B and K of each from it.
    covering: Recording -> one pair of N and K for a filter that bounds the models of all, with the
        ``nees`` that a filter with it predicts there; 1 is right, below 1 conservative.
    """

    name: str
    fits: Mapping[str, Fit]
    left_out: Mapping[str, Notice]
    equality: Equality | None
    p_value: float
    structure: Structure
    covering: Mapping[str, AxisFilterNumbers]

    def __post_init__(self) -> None:
        freeze(self, "fits", "left_out", "covering")

    @property
    def quantity(self) -> str:
        """The kind of sensor: gyro, accel, or nothing."""
        return self.structure.quantity

    @property
    def differences(self) -> tuple[Difference, ...]:
        """Parts of the curves that differ, the most certain one first; none where they agree."""
        if self.equality is None or not self.p_value < tuning.LEVEL:
            return ()
        return self.equality.evident

    @property
    def state(self) -> State:
        """Whether the curves agree, or to within 10 % of the deviation, or differ."""
        if self.equality is None or np.isnan(self.p_value):
            return "untested"
        if not self.p_value < tuning.LEVEL:
            return "agree"
        is_notable = any(each.extent > tuning.NOTABLE for each in self.differences)
        return "differ" if is_notable else "close"

    @property
    def main(self) -> tuple[Difference, ...]:
        """The differences that a verdict names: at most three, those above 10 % first.

        White noise differs at short times too; N says more.
        """

        def place(each: Difference) -> tuple[bool, bool]:
            return each.extent <= tuning.NOTABLE, each.part == "short"

        return tuple(sorted(self.differences, key=place)[:3])

    @property
    def sentence(self) -> str:
        """The verdict in one line."""
        reasons = {k: str(n.values.get("reason", n.code)) for k, n in self.left_out.items()}
        out = ", ".join(f"{k} ({reason.replace('-', ' ')})" for k, reason in reasons.items())
        if self.equality is None or self.state == "untested":
            return f"not compared: without {out}" if out else "not compared"
        if self.state == "agree":
            known = [d for d in self.equality.differences if d.part in "NK"]
            shown = [f"{_percent(d.resolution)} in {d.part}" for d in known]
            tail = f"; {', '.join(shown)} would show" if shown else ""
            text = f"agree (p = {self.p_value:.2g}{tail})"
        else:
            parts = [
                f"{_NAMES.get(d.part, d.part)} by {_percent(d.extent)} ({brief(d.sigma)} sigma)"
                for d in self.main
            ] or [f"shape (p = {self.p_value:.2g})"]
            words = "differ in" if self.state == "differ" else "differ by less than 10 %:"
            text = f"{words} {', '.join(parts)}"
        return f"{text}; without {out}" if out else text

    def for_filter(self, letter: str) -> tuple[float, bool]:
        """N or K that covers all recordings, NaN without one, and whether it is an upper limit."""
        found = next((getattr(each, letter) for each in self.covering.values()), float("nan"))
        ends = [own[letter].upper for own in self.structure.usable.values()]
        limit = max(filter(np.isfinite, ends), default=float("nan"))
        return (float(found), False) if found != 0.0 else (limit, True)

    def number_text(self, letter: str, *values: float) -> tuple[str, str]:
        """N, B or K in the data-sheet unit, or their range, and that unit."""
        unit, scale = customary_unit(LETTERS[letter], self.quantity, "u")
        texts = [f"{value * scale:.3g}" for value in values]
        texts = [f"{float(text):,.0f}" if "e+" in text else text for text in texts]
        return " to ".join(dict.fromkeys(texts)), unit

    def range_of(self, letter: str) -> tuple[str, str]:
        """Smallest to largest N, B or K of the recordings, and the unit; else the largest limit."""
        own = [each[letter] for each in self.structure.usable.values()]
        if known := [value for each in own if (value := each.value) is not None]:
            return self.number_text(letter, min(known), max(known))
        largest = max((each.upper for each in own), default=np.inf)
        text, unit = self.number_text(letter, largest)
        return (f"<= {text}", unit) if np.isfinite(largest) else ("not limited", "")

    def to_dict(self) -> dict[str, Any]:
        """In JSON types, SI."""
        equality = self.equality
        content = {
            "state": self.state,
            "p_value": self.p_value,
            "recordings": list(self.fits),
            "left_out": {label: notice.to_dict() for label, notice in self.left_out.items()},
            "differences": [
                {"part": d.part, "shortest_s": d.shortest, "longest_s": d.longest}
                | {name: getattr(d, name) for name in ("extent", "sigma", "resolution")}
                | {name: getattr(d, name).tolist() for name in ("ratios", "errors")}
                for d in (equality.differences if equality else ())
            ],
            "structure": asdict(self.structure),
            "filter_numbers": {label: each.row("si") for label, each in self.covering.items()},
        }
        return dict(json.loads(to_json(content, inf_nan_mode="null")))


@dataclass(frozen=True, eq=False, repr=False)
class SensorComparison(ByName[AxisComparison], Printed):
    """Several recordings or units of a sensor compared: a mapping of channels to `AxisComparison`.

    Attributes
    ----------
    calibrations : dict of str to Calibration
        By recording.
    axes : dict of str to AxisComparison
    horizon : float
        Longest outage that the filter numbers are for, s.
    notices : tuple of Notice
        What was found: channels that are missing or left out, other rates, too few recordings.
    """

    _held = "axes"
    _unknown = "channel {name!r} was not compared: there are {known}"

    calibrations: Mapping[str, Calibration]
    axes: Mapping[str, AxisComparison]
    horizon: float
    notices: tuple[Notice, ...] = field(default_factory=tuple)

    def __post_init__(self) -> None:
        freeze(self, "calibrations", "axes")

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the recordings, in their order."""
        return tuple(self.calibrations)

    @property
    def summary(self) -> str:
        """How many axes agree."""
        counts = Counter(axis.state for axis in self.values())
        parts = []
        for state, word in STATES.items():
            if counts[state] == 1 and state != "untested":
                word = re.sub(r"^\w+", r"\g<0>s", word)
            if counts[state]:
                parts.append(f"{counts[state]} {word}")
        return f"{len(self.labels)} recordings, {len(self)} axes: {', '.join(parts)}"

    def __repr__(self) -> str:
        return f"<SensorComparison of {self.summary}>"

    def __str__(self) -> str:
        """Verdicts, N, B and K, the numbers for a filter and what was found; 80 columns."""
        lines = [self.summary]
        for place, (label, each) in enumerate(self.calibrations.items(), 1):
            size = f"{each.duration:,.6g} s at {each.rate:.6g} Hz"
            lines += wrapped(f"{label}: {size}", first=f"{place:>3}  ", indent=5)
        width = max(map(len, self), default=0)
        lines.append("")
        for name, axis in self.items():
            lines += wrapped(axis.sentence, first=f"{name:<{width}}  ", indent=width + 2)
        lines += ["", "Sensor numbers, smallest to largest:"]
        for name, axis in self.items():
            known = [f"{key} {' '.join(axis.range_of(key))}" for key in LETTERS]
            text = ", ".join(known) if axis.structure.usable else "none: no valid model"
            lines += wrapped(text, first=f"{name:<{width}}  ", indent=width + 2)
        lines += ["", f"Filter numbers for outages up to {self.horizon:g} s that cover all:"]
        for name, axis in self.items():
            found = []
            for key in "NK":
                value, is_limit = axis.for_filter(key)
                if np.isfinite(value):
                    shown = " ".join(axis.number_text(key, value))
                    found.append(f"{key} {'<= ' * is_limit}{shown}")
            own = len(axis.covering)
            few = f" (of {own} only)" if own < len(self.labels) else ""
            text = ", ".join(found) + few if found else "none: no recording can be used"
            lines += wrapped(text, first=f"{name:<{width}}  ", indent=width + 2)
        lines += wrapped(self.promise)
        # The verdicts stand above.
        others = [each for each in self.notices if not each.code.startswith("curves-")]
        lines += bullets(worst_first(others))
        return "\n".join(lines)

    @property
    def promise(self) -> str:
        """What the covering numbers hold for, and what they do not."""
        return (
            "They are not overconfident for any of these recordings, each with its fitted model; "
            "parameter uncertainty is not included. "
            f"1-in-{len(self.labels) + 1} chance that another recording has a larger N, and the "
            "same for K."
        )

    def to_dict(self) -> dict[str, Any]:
        """Everything but the curves, in JSON types and SI units."""
        return {
            "schema": "gmwm.sensor-comparison",
            "schema_version": 1,
            "horizon_s": self.horizon,
            "level": tuning.LEVEL,
            "recordings": [
                {"label": label, "source": each.source, "rate_hz": each.rate, "n": each.n}
                for label, each in self.calibrations.items()
            ],
            "channels": {name: axis.to_dict() for name, axis in self.items()},
            "notices": [notice.to_dict() for notice in self.notices],
        }

    def to_frame(self) -> pandas.DataFrame:
        """A table with one row a channel, in SI units; needs pandas."""
        rows = []
        for name, axis in self.items():
            row: dict[str, Any] = {"channel": name, "state": axis.state, "p_value": axis.p_value}
            row |= {"part": "", "extent": np.nan, "sigma": np.nan}
            for worst in axis.main[:1]:
                row |= {key: getattr(worst, key) for key in ("part", "extent", "sigma")}
            row["recordings"] = len(axis.fits)
            row["model"], usable = axis.structure.model, axis.structure.usable.values()
            for letter in LETTERS:
                known = [value for own in usable if (value := own[letter].value) is not None]
                row[f"{letter}_lowest"] = min(known, default=np.nan)
                row[f"{letter}_highest"] = max(known, default=np.nan)
            row |= {f"filter_{letter}": axis.for_filter(letter)[0] for letter in "NK"}
            rows.append(row)
        return frame(rows, tuple(rows[0]))

    def report(
        self,
        path: str | os.PathLike[str],
        *,
        datasheet: str | os.PathLike[str] | None = None,
        provenance: Mapping[str, str] | None = None,
    ) -> Path:
        """Write two pages of HTML; see `gmwm.report.write_sensor_comparison_report`."""
        return Path(make("page", self, path, datasheet=datasheet, provenance=provenance))
