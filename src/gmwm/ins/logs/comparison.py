"""Sensor models compared on a user's own log, by outages that are cut into it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from itertools import permutations
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gmwm._core import checks
from gmwm._core.distributions import norm, student
from gmwm._core.pages import Reported
from gmwm._core.text import bullets, plain_table, wrapped
from gmwm._core.typing import FloatArray
from gmwm.errors import InputError
from gmwm.ins import tuning
from gmwm.ins.fields import read_models
from gmwm.ins.filter.aiding import Outage
from gmwm.ins.geometry import ned_difference
from gmwm.ins.logs.measured import LogSpec, Measured
from gmwm.ins.logs.replay import Replay, Smoothed, smooth
from gmwm.ins.sensors import SensorModels
from gmwm.ins.simulation.consistency import InnovationTest, Ratio, mean_ratio
from gmwm.issues import Notice, notice

if TYPE_CHECKING:
    from matplotlib.figure import Figure


PARTS = {"horizontal": (0, 1), "vertical": (2,)}


@dataclass(frozen=True, eq=False)
class Outcome:
    """Errors of the filter with one sensor model in the outages.

    Attributes
    ----------
    error : (K, 3) ndarray
        Estimate at the end of each outage less the smoothed position: north, east, down, m.
    variance : (K, 3, 3) ndarray
        Predicted covariance of these, m^2: the filter's less that of the smoothed position, whose
        error is uncorrelated with the difference.
    reference_variance : (3,) ndarray
        Mean variance of the smoothed positions, m^2.
    rms, predicted : dict
        Root mean square of the true errors by part, m, the uncertainty of the reference included;
        and as the filter predicts it.
    nees : Ratio
        NEES per degree of freedom.
    score : (K,) ndarray
        Negative logarithm of the predicted density at the reference; less is better.
    nis : InnovationTest
        Innovations of the whole log.
    """

    error: FloatArray
    variance: FloatArray
    reference_variance: FloatArray
    rms: dict[str, float]
    predicted: dict[str, float]
    nees: Ratio
    score: FloatArray
    nis: InnovationTest

    @property
    def squares(self) -> FloatArray:
        """Mean squares of the true errors, (K, 3), m^2."""
        return np.asarray(self.error**2 + self.reference_variance)


@dataclass(frozen=True)
class Paired:
    """Errors of one model over those of another, outage by outage.

    Attributes
    ----------
    ratio, lower, upper : float
        Ratio of the root mean squares and its 95 % interval.
    p_value : float
        p-value of errors that differ by no more than `gmwm.ins.tuning.TIE_RATIO`.
    score, score_p_value : float
        Mean difference, and the p-value of no more than `gmwm.ins.tuning.TIE_SCORE`.
    error : float
        Standard error of the logarithm of the ratio.
    """

    ratio: float
    lower: float
    upper: float
    p_value: float
    score: float
    score_p_value: float
    error: float


def by_part(squares: FloatArray) -> dict[str, float]:
    """Root mean squares of the horizontal and the vertical part, of squares (K, 3)."""
    return {p: float(np.sqrt(np.mean(np.sum(squares[:, i], axis=1)))) for p, i in PARTS.items()}


def paired(first: Outcome, second: Outcome, scale: FloatArray) -> Paired:
    """Ratio of the errors, each component in units of its usual size.

    Its standard error is by the jackknife (Miller 1974, *Biometrika* 61, 1-15): for eight outages,
    some twice as hard as others, intervals then cover 93 to 94 %; by the delta method 91 to 93 %.
    """
    a = np.sum(first.squares / scale, axis=1)
    b = np.sum(second.squares / scale, axis=1)
    log = 0.5 * float(np.log(np.sum(a) / np.sum(b)))
    count = a.size
    without = 0.5 * np.log((np.sum(a) - a) / (np.sum(b) - b))
    error = float(np.sqrt((count - 1.0) * np.var(without)))
    width = float(student.ppf(0.5 + 0.5 * tuning.CONFIDENCE, count - 1)) * error
    difference = first.score - second.score
    score_error = float(np.std(difference, ddof=1) / np.sqrt(count))
    mean = float(np.mean(difference))
    return Paired(
        ratio=float(np.exp(log)),
        lower=float(np.exp(log - width)),
        upper=float(np.exp(log + width)),
        p_value=_p_value(tuning.TIE_RATIO, log, error, count),
        score=mean,
        score_p_value=_p_value(tuning.TIE_SCORE, mean, score_error, count),
        error=error,
    )


def _p_value(within: float, value: float, error: float, count: int) -> float:
    """p-value of a mean ``within`` of zero (Hodges & Lehmann 1954, *J. R. Stat. Soc. B* 16)."""
    if error == 0.0:
        return float(abs(value) <= within)
    return float(np.sum(student.sf((abs(value) + np.array([-within, within])) / error, count - 1)))


@dataclass(frozen=True, eq=False)
class Comparison(Reported):
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
        """Read what a file or options describe, and compare.

        The content is that of `Measured.of`, but with ``compare``, a mapping of names to sensor
        models, in place of ``sensors``; and with ``outages``, see `compare`.

        Raises InputError if something is missing, unknown or cannot be used.
        """
        rest = dict(content)
        named, outages = rest.pop("compare"), rest.pop("outages", "auto")
        if not isinstance(named, Mapping) or len(named) < 2 or "sensors" in rest:
            raise InputError(
                "compare: write two names or more, each with its sensor models, in place of sensors"
            )
        models = {
            str(name): read_models(
                f"compare, {name}", LogSpec.parse({**rest, "sensors": each}).sensors, folder
            )
            for name, each in named.items()
        }
        measured = Measured.of({**rest, "sensors": next(iter(named.values()))}, folder)
        models = {name: each.with_noise(measured.noise) for name, each in models.items()}
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
        shown = unbeaten or names
        wrong = {n: nees.value for n in shown if not (nees := self.outcomes[n].nees).within}
        values = {
            "models": ", ".join(unbeaten),
            "resolved": self.resolved,
            "length needed": self.length_needed,
            "contradicted": ", ".join(wrong),
        }
        but = "; ".join(
            f"{name} is {'overconfident' if nees > 1.0 else 'conservative'}, NEES {nees:.3g}"
            for name, nees in wrong.items()
        )
        but = f", but {but}" if wrong else ""
        codes = {beats(unbeaten[0], b) for b in names if b != unbeaten[0]} if unbeaten else {""}
        if "" not in codes:
            code = "better" if "better" in codes else "more-honest"
            return notice(code, unbeaten[0], values, but=but)
        # Equal errors do not excuse a model that predicts them badly.
        far = [n for n, nees in wrong.items() if abs(np.log(nees)) > 2.0 * np.log(tuning.MILD)]
        honest = [name for name in shown if name not in far]
        if not honest:
            return notice("tie", values=values, variant="wrong", names=" and ".join(shown), but=but)
        if len(honest) < len(shown):
            values["models"] = ", ".join(honest)
            return notice("more-honest", " or ".join(honest), values, but=but)
        resolution = "Errors that differ by 10 % would have been found."
        if self.resolved <= tuning.WORTH:
            resolution = (
                f"It shows differences of {100.0 * (1.0 - self.resolved):.0f} % or more; for 10 % "
                f"record {self.length_needed / 60.0:.0f} min."
            )
        tied = " and ".join(shown)
        return notice(
            "tie", values=values, variant="log", names=tied, but=but, resolution=resolution
        )

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
                    "rms": each.rms,
                    "predicted": each.predicted,
                    "nees": each.nees.value,
                    "nees_p_value": each.nees.p_value,
                    "score": float(np.mean(each.score)),
                    "nis": each.nis.nis.value,
                    "whiteness": each.nis.whiteness,
                }
                for name, each in self.outcomes.items()
            },
            "pairs": [
                {"first": a, "second": b}
                | {key: value for key, value in asdict(pair).items() if key != "error"}
                for (a, b), pair in self.pairs.items()
            ],
            "verdict": self.verdict.to_dict(),
            "notices": [each.to_dict() for each in self.notices],
        }

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
        length = self.outages[0].duration
        lines = [
            f"{self.title}: {self.duration:.6g} s, {len(self.outages)} outages of {length:g} s"
        ]
        lines += bullets(self.notices)
        lines += ["", "Errors at the end of the outages, RMS [m]; in brackets as predicted"]
        rows = [
            (
                name,
                *(f"{each.rms[part]:.4g} ({each.predicted[part]:.4g})" for part in PARTS),
                f"{each.nees.value:.3g}{'' if each.nees.within else '*'}",
                f"{each.nis.nis.value:.4g}",
            )
            for name, each in self.outcomes.items()
        ]
        lines += plain_table(("", *PARTS, "NEES/dof", "NIS/dof"), rows).splitlines()
        lines += ["", f"Errors over those of {first}, paired"]
        cells = [
            (
                name,
                f"{p.ratio:.3f}",
                f"({p.lower:.3f} .. {p.upper:.3f})",
                f"{p.score:+.2f}",
                f"{p.score_p_value:.2g}",
            )
            for name, p in ((name, self.pairs[name, first]) for name in others)
        ]
        lines += plain_table(("", "ratio", "95 %", "score", "p"), cells).splitlines()
        return "\n".join([*lines, "", *wrapped(self.verdict.text)])


def compare(
    measured: Measured, sensors: Mapping[str, Any], outages: str | float = "auto"
) -> Comparison:
    """Compare sensor models on a log without a known truth.

    Fixes are removed for a while, and the filter's position at the end of that outage is compared
    with a smoother's from all fixes. Outages fill the log: the outages of a second run lie in the
    gaps between those of a first.

    The smoothed position is the projection of the true one on all data, so that its error is
    uncorrelated with the difference of the filter from it: covariances subtract, and the mean
    square of the true error is the sum of the two.

    Raises InputError if there are fewer than two models, the log is too short, or a filter
    diverges.

    Parameters
    ----------
    measured : Measured
        The log; only the biases of its ``sensors`` are used.
    sensors : mapping of str to SensorModels, Calibration or mapping
        Two or more by name; see `SensorModels.of`. Axes without a constant bias are given that of
        ``measured``.
    outages : "auto" or float, optional
        Length of each outage, s.
    """
    if len(sensors) < 2:
        raise InputError("a comparison needs two sensor models or more: give each a name")
    models = {name: SensorModels.of(each) for name, each in sensors.items()}
    replays = {}
    for name, each in models.items():
        bias = {axis: sd or measured.sensors.bias_sd[axis] for axis, sd in each.bias_sd.items()}
        own = replace(measured, sensors=replace(each, bias_sd=bias))
        replays[name] = Replay.of(own)
    epochs = min(replay.imu.n for replay in replays.values())
    duration = epochs * measured.imu.dt
    length = tuning.OUTAGE
    if outages != "auto":
        hint = 'give "auto", or seconds above zero'
        length = checks.positive("outages", outages, hint)
        if length > tuning.LONGEST_OUTAGE:
            longest = f"{tuning.LONGEST_OUTAGE:g}"
            raise InputError(f"outages of {length:g} s: give {longest} s or less")
    step = max(round(length / measured.imu.dt), 1) * measured.imu.dt
    count, first = int((duration - tuning.OUTAGES_FROM) / step), tuning.OUTAGES_FROM
    if count < tuning.FEWEST_OUTAGES:
        raise InputError(
            f"the log is {duration:.4g} s long, enough for {max(count, 0)} outages of "
            f"{length:g} s: {tuning.FEWEST_OUTAGES} are needed; give a log of "
            f"{first + tuning.FEWEST_OUTAGES * step:g} s or shorter outages"
        )
    every = tuple(Outage(first + i * step, step) for i in range(count))
    ends = np.array([each.end for each in every])
    smoothed = {name: smooth(replay, ends) for name, replay in replays.items()}
    for name, track in smoothed.items():
        if not np.all(np.isfinite(track.lla)):
            raise InputError(f"{name}: the filter diverges with all fixes: leave this model out")
    # One reference for all models, so that none is its own.
    lla = np.mean([track.lla for track in smoothed.values()], axis=0)
    outcomes = {
        name: _outcome(name, replay, smoothed[name], lla, every) for name, replay in replays.items()
    }
    scale = np.mean([each.squares for each in outcomes.values()], axis=(0, 1))
    names = permutations(outcomes, 2)
    pairs = {(a, b): paired(outcomes[a], outcomes[b], scale) for a, b in names}
    notices = [replace(each, source=name) for name, own in models.items() for each in own.notices]
    return Comparison(
        measured.title, every, outcomes, pairs, duration, (*notices, *measured.notices)
    )


def _outcome(
    name: str, replay: Replay, smoothed: Smoothed, lla: FloatArray, every: tuple[Outage, ...]
) -> Outcome:
    estimate, covariance = np.empty((len(every), 3)), np.empty((len(every), 3, 3))
    for part in (slice(0, None, 2), slice(1, None, 2)):  # each has outages in the other's gaps
        cut = replace(replay, aiding=replay.aiding.without(every[part]))
        ends = tuple(each.end for each in every[part])
        solution = cut.solution(cut.imu.n * cut.imu.dt, ends)
        if solution.diverged_at is not None:
            raise InputError(f"{name}: the filter diverges in an outage: leave this model out")
        estimate[part] = solution.lla[solution.before]
        covariance[part] = solution.covariance[solution.before, :3, :3]
    error = ned_difference(estimate, lla)
    variance = covariance - smoothed.covariance
    predicted = np.einsum("kii->ki", covariance)
    # Rounding, and a filter that is no better with all fixes than without, must not make it zero.
    lacking = np.maximum(tuning.LEAST_SHARE * predicted - np.einsum("kii->ki", variance), 0.0)
    variance = variance + np.einsum("ki,ij->kij", lacking, np.eye(3))
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
