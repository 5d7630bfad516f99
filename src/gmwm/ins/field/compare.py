"""Sensor models compared on a user's own log, by outages that are cut into it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gmwm._core import checks
from gmwm._core.distributions import norm, student
from gmwm._core.notices import Notice
from gmwm._core.pages import make
from gmwm._core.text import bullets, wrapped
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.field.measured import Measured, MeasuredSpec
from gmwm.ins.field.outcome import PARTS, Outcome, Paired, by_part, paired, true_squares
from gmwm.ins.field.replay import Replay, alignment_of
from gmwm.ins.field.smoother import Smoothed, smooth
from gmwm.ins.filter import Outage
from gmwm.ins.geometry import ned_difference
from gmwm.ins.imu import SensorModels
from gmwm.ins.simulation import mean_ratio
from gmwm.ins.spec import read_models

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class Comparison:
    """Sensor models side by side on one log.

    Attributes
    ----------
    title : str
    outages : tuple of Outage
        s since the start of the filter.
    outcomes : dict
        Name of a model -> `Outcome`.
    pairs : dict
        (name, name) -> `Paired`, the first over the second.
    duration : float
        Of the log from the start of the filter, s.
    notices : tuple of Notice
    """

    title: str
    outages: tuple[Outage, ...]
    outcomes: dict[str, Outcome]
    pairs: dict[tuple[str, str], Paired]
    duration: float
    notices: tuple[Notice, ...] = ()

    @classmethod
    def of(cls, content: Mapping[str, Any], folder: Path = Path()) -> Comparison:
        """From the content of a file.

        Parameters
        ----------
        content : mapping
            As for `Measured.of`, but with ``compare``, a mapping of names to sensor models, in
            place of ``sensors``; and ``outages``, see `compare`.
        folder : Path, optional
            That paths are relative to.

        Raises
        ------
        InputError
            If something is missing, unknown or cannot be used.
        """
        rest = dict(content)
        named, outages = rest.pop("compare"), rest.pop("outages", "auto")
        if not isinstance(named, Mapping) or len(named) < 2 or "sensors" in rest:
            raise InputError(
                "compare: write two names or more, each with its sensor models, and no sensors "
                "beside it"
            )
        specs = {str(name): MeasuredSpec.parse({**rest, "sensors": each})
                 for name, each in named.items()}  # fmt: skip
        models = {
            name: read_models(f"compare, {name}", spec.sensors, folder)
            for name, spec in specs.items()
        }
        measured = Measured.of({**rest, "sensors": next(iter(named.values()))}, folder)
        return compare(measured, models, outages)

    @property
    def verdict(self) -> Notice:
        """Which model to take: ``better`` by errors, ``more-honest`` by scores, or ``tie``.

        Of those that it names, the ones whose own predictions the errors contradict.
        """
        names = list(self.outcomes)
        share = len(names) * (len(names) - 1) / 2.0

        def beats(a: str, b: str) -> str:
            pair = self.pairs[a, b]
            if pair.p_value < tuning.ACCURACY_LEVEL / share:
                return "better" if pair.ratio < 1.0 else ""
            honest = pair.score_p_value < tuning.SCORE_LEVEL / share
            return "more-honest" if honest and pair.score < 0.0 else ""

        unbeaten = [a for a in names if not any(beats(b, a) for b in names if b != a)]
        wrong = {name: nees for name in unbeaten or names
                 if not (nees := self.outcomes[name].nees).within}  # fmt: skip
        values: dict[str, Any] = {"models": ", ".join(unbeaten), "resolved": self.resolved,
                                  "length needed": self.length_needed,
                                  "contradicted": ", ".join(wrong)}  # fmt: skip
        but = "; ".join(
            f"{name} believes its errors to be {'smaller' if nees.value > 1.0 else 'larger'} than "
            f"they are, NEES {nees.value:.3g}"
            for name, nees in wrong.items()
        )
        but = f", but {but}" if wrong else ""
        if len(unbeaten) == 1:
            best = unbeaten[0]
            codes = {beats(best, b) for b in names if b != best}
            if "" not in codes:
                code = "better" if "better" in codes else "more-honest"
                why = (
                    "its errors after the outages are smaller" if code == "better" else
                    "errors are as large, but it predicts them better"
                )  # fmt: skip
                return Notice(code, "good", best, f"Take {best}: {why}{but}.", values)
        shown = " and ".join(unbeaten or names)
        text = f"A tie: errors of {shown} are equally large as far as this log shows{but}. "
        if self.resolved > tuning.WORTH:
            text += "Errors that differ by 10 % would have been found."
        else:
            text += (
                f"It tells errors apart that differ by {100.0 * (1.0 - self.resolved):.0f} % or "
                f"more; for 10 % it would have to be {self.length_needed / 60.0:.0f} min long."
            )
        return Notice("tie", "note", "", text, values)

    @property
    def resolved(self) -> float:
        """Ratio of errors that is found with a probability of 95 %; the best of all pairs."""
        return float(np.exp(-tuning.TIE_RATIO - self._beyond))

    @property
    def length_needed(self) -> float:
        """Length of such a log in which a ratio of 0.9 is found with 95 %, s."""
        return self.duration * (self._beyond / (-np.log(tuning.WORTH) - tuning.TIE_RATIO)) ** 2

    @property
    def _beyond(self) -> float:
        """How much more than what matters the logarithm of a ratio must be to be found."""
        error = max(pair.error for pair in self.pairs.values())
        least = student.isf(tuning.ACCURACY_LEVEL, len(self.outages) - 1)
        return error * float(least + norm.ppf(tuning.POWER))

    def to_dict(self) -> dict[str, Any]:
        """In JSON types."""
        return {
            "title": self.title,
            "duration": self.duration,
            "outages": [[each.start, each.duration] for each in self.outages],
            "models": {
                name: {
                    "rms": each.rms, "predicted": each.predicted, "nees": each.nees.value,
                    "nees_p_value": each.nees.p_value, "score": float(np.mean(each.score)),
                    "nis": each.nis.nis.value, "whiteness": each.nis.whiteness,
                }
                for name, each in self.outcomes.items()
            },
            "pairs": [
                {"first": a, "second": b, "ratio": p.ratio, "lower": p.lower, "upper": p.upper,
                 "p_value": p.p_value, "score": p.score, "score_p_value": p.score_p_value}
                for (a, b), p in self.pairs.items()
            ],
            "verdict": self.verdict.to_dict(),
            "notices": [each.to_dict() for each in self.notices],
        }  # fmt: skip

    def report(self, path: str | os.PathLike[str]) -> Path:
        """Write the page; see `gmwm.report.write_comparison_report`."""
        written: Path = make("page", self, path)
        return written

    def plot(self) -> Figure:
        """Errors at the end of each outage, and their ratios with intervals."""
        from gmwm import plotting

        first, *others = self.outcomes
        panels = {
            f"{part} [m]": {
                name: (np.linalg.norm(each.error[:, axes], axis=1), each.predicted[part])
                for name, each in self.outcomes.items()
            }
            for part, axes in PARTS.items()
        }
        pairs = {f"{name} / {first}": self.pairs[name, first] for name in others}
        ratios = {what: (pair.ratio, pair.lower, pair.upper) for what, pair in pairs.items()}
        return plotting.outages_compared(
            np.array([each.end for each in self.outages]), panels, ratios
        )

    def __str__(self) -> str:
        first, *others = self.outcomes
        width = max(map(len, (*self.outcomes, "against")))
        length = self.outages[0].duration
        lines = [
            f"{self.title}: {self.duration:.6g} s, {len(self.outages)} outages of {length:g} s"
        ]
        lines += bullets(self.notices)
        lines += [
            "", "Errors at the end of the outages, RMS [m]; in brackets as predicted",
            f"{'':{width}}  {'horizontal':>18}  {'vertical':>18}  {'NEES/dof':>9}  {'NIS/dof':>8}",
        ]  # fmt: skip
        for name, each in self.outcomes.items():
            parts = "  ".join(
                f"{each.rms[part]:>8.4g} ({each.predicted[part]:>7.4g})" for part in PARTS
            )
            mark = " " if each.nees.within else "*"
            nis = each.nis.nis.value
            lines.append(f"{name:{width}}  {parts}  {each.nees.value:>8.3g}{mark}  {nis:>8.4g}")
        lines += [
            "", f"Errors over those of {first}, paired",
            f"{'':{width}}  {'ratio':>6}  {'95 %':>15}   {'score':>7}  {'p':>7}",
        ]  # fmt: skip
        for name in others:
            pair = self.pairs[name, first]
            lines.append(
                f"{name:{width}}  {pair.ratio:>6.3f}  ({pair.lower:.3f} .. {pair.upper:.3f})"
                f"   {pair.score:>+7.2f}  {pair.score_p_value:>7.2g}"
            )
        return "\n".join([*lines, "", *wrapped(self.verdict.text)])


def compare(
    measured: Measured, sensors: Mapping[str, Any], outages: str | float = "auto"
) -> Comparison:
    """Compare sensor models on a log without a known truth.

    Fixes are removed, so that the filter goes without them for a while; what it estimates at the
    end of that time is compared with a smoother's position from all fixes. Outages fill the log:
    those of a first run leave gaps in which the outages of a second one lie.

    The smoothed position is the projection of the true one on all data, so that its own error is
    uncorrelated with the difference of the filter from it: covariances subtract, and the mean
    square of the true error is that of the difference and of the reference's own error together.

    Parameters
    ----------
    measured : Measured
        The log; of its ``sensors`` only the biases are used.
    sensors : mapping of str to SensorModels, Calibration or mapping
        Two or more by name; see `SensorModels.of`. Axes without a constant bias are given that of
        ``measured``.
    outages : "auto" or float, optional
        Length of each outage, s.

    Returns
    -------
    Comparison

    Raises
    ------
    InputError
        If there are fewer than two models, the log is too short, or a filter diverges.
    """
    if len(sensors) < 2:
        raise InputError("a comparison needs two sensor models or more: give each a name")
    models = {name: SensorModels.of(each) for name, each in sensors.items()}
    replays = {name: _replay(measured, each) for name, each in models.items()}
    epochs = min(replay.imu.n for replay in replays.values())
    duration = epochs * measured.imu.dt
    length = _length(outages)
    passes = _passes(duration, length, measured.imu.dt)
    every = tuple(sorted((each for part in passes for each in part), key=lambda each: each.start))
    ends = np.array([each.end for each in every])
    smoothed = {name: smooth(replay, ends) for name, replay in replays.items()}
    for name, each in smoothed.items():
        if not np.all(np.isfinite(each.lla)):
            raise InputError(f"{name}: the filter diverges with all fixes: compare without it")
    # One reference for all, that none is measured by itself alone.
    lla = np.mean([each.lla for each in smoothed.values()], axis=0)
    outcomes = {
        name: _outcome(name, replay, smoothed[name], lla, passes, every)
        for name, replay in replays.items()
    }
    scale = np.mean([true_squares(each) for each in outcomes.values()], axis=(0, 1))
    pairs = {
        (a, b): paired(outcomes[a], outcomes[b], scale)
        for a in outcomes for b in outcomes if a != b
    }  # fmt: skip
    notices = [replace(each, source=name) for name, own in models.items() for each in own.notices]
    return Comparison(measured.title, every, outcomes, pairs, duration,
                      (*notices, *measured.notices))  # fmt: skip


def _replay(measured: Measured, models: SensorModels) -> Replay:
    usual = measured.sensors.bias_sd
    bias = {axis: each or usual[axis] for axis, each in models.bias_sd.items()}
    own = replace(measured, sensors=replace(models, bias_sd=bias))
    return Replay.of(own, alignment_of(own))


def _length(outages: str | float) -> float:
    if outages == "auto":
        return tuning.OUTAGE
    length = checks.positive("outages", outages, 'give "auto", or seconds above zero')
    if length > tuning.LONGEST_OUTAGE:
        raise InputError(f"outages of {length:g} s: give {tuning.LONGEST_OUTAGE:g} s or less")
    return length


def _passes(duration: float, length: float, dt: float) -> tuple[tuple[Outage, ...], ...]:
    """Outages of two runs, each in the gaps of the other."""
    step = max(round(length / dt), 1) * dt
    count = int((duration - tuning.OUTAGES_FROM) / step)
    if count < tuning.FEWEST_OUTAGES:
        raise InputError(
            f"the log is {duration:.4g} s long, enough for {max(count, 0)} outages of "
            f"{length:g} s: {tuning.FEWEST_OUTAGES} are needed; give a log of "
            f"{tuning.OUTAGES_FROM + tuning.FEWEST_OUTAGES * step:g} s or shorter outages"
        )
    every = [Outage(tuning.OUTAGES_FROM + i * step, step) for i in range(count)]
    return tuple(every[::2]), tuple(every[1::2])


def _outcome(
    name: str,
    replay: Replay,
    smoothed: Smoothed,
    lla: FloatArray,
    passes: tuple[tuple[Outage, ...], ...],
    every: tuple[Outage, ...],
) -> Outcome:
    found: dict[float, tuple[FloatArray, FloatArray]] = {}
    for part in passes:
        ends = tuple(each.end for each in part)
        solution = replace(replay, aiding=replay.aiding.without(part)).solution(
            replay.imu.n * replay.imu.dt, ends
        )
        if solution.diverged_at is not None:
            raise InputError(f"{name}: the filter diverges in an outage: compare without it")
        kept = np.flatnonzero(solution.before)
        for end, i in zip(ends, kept, strict=True):
            found[end] = solution.lla[i], solution.covariance[i, :3, :3]
    estimate = np.array([found[each.end][0] for each in every])
    covariance = np.array([found[each.end][1] for each in every])
    error = ned_difference(estimate, lla)
    variance = covariance - smoothed.covariance
    predicted = np.einsum("kii->ki", covariance)
    # Rounding, and a filter that is no better with all fixes than without, must not make it zero.
    floor = tuning.LEAST_SHARE * predicted
    variance = variance + np.einsum(
        "ki,ij->kij", np.maximum(floor - np.einsum("kii->ki", variance), 0.0), np.eye(3)
    )
    squares = np.einsum("ki,ki->k", error, np.linalg.solve(variance, error[..., None])[..., 0])
    reference = np.mean(np.einsum("kii->ki", smoothed.covariance), axis=0)
    return Outcome(
        error=error,
        variance=variance,
        reference_variance=reference,
        rms=by_part(error**2 + reference),
        predicted=by_part(predicted),
        nees=mean_ratio(squares / 3.0),
        score=0.5 * (squares + np.linalg.slogdet(variance)[1]),
        nis=replay.test(),
    )
