"""Numbers for small filters: tightness, consistency, and dependence on the record.

Prints the tables of docs/filter-numbers.md and docs/filter-numbers-study.md. Run with ``python
benchmarks/filter_numbers.py PART``, one of length, errors, balance, coarse, tightness, random,
rates, rules, flight and whole, or with ``real FOLDER``, the folder of the four ADIS16405
recordings. length and errors simulate and fit records; real uses recordings; all others are exact
covariance analyses.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Mapping

import numpy as np

import gmwm
from gmwm import (
    BiasInstability,
    GaussMarkov,
    InputError,
    Model,
    Process,
    QuantizationNoise,
    RandomWalk,
    Resonance,
    WhiteNoise,
)
from gmwm.calibration import axis_numbers
from gmwm.filter_numbers import Chain, tuning
from gmwm.filter_numbers.axes import SensorAxes
from gmwm.filter_numbers.spectra.dominance import Problem, standard_errors
from gmwm.filter_numbers.spectra.region import Estimated
from gmwm.filter_numbers.spectra.required import RequiredSpectrum
from gmwm.ins import (
    Recorded,
    SensorModels,
    covariance_analysis,
    loiter_with_outages,
    monte_carlo,
)
from gmwm.study.navigation import TABLE_6

DT = 0.01
ONE = WhiteNoise(8e-5) + GaussMarkov(4e-5, 60.0)
TRUTHS = {
    "1 GM": ONE,
    "2 GM": WhiteNoise(5e-5) + GaussMarkov(4e-4, 5.0) + GaussMarkov(1e-4, 300.0),
    "3 GM": WhiteNoise(1e-4)
    + GaussMarkov(2e-4, 0.5)
    + GaussMarkov(6e-5, 25.0)
    + GaussMarkov(9e-5, 2000.0),
    "3 GM, other": WhiteNoise(3e-4)
    + GaussMarkov(5e-4, 1.0)
    + GaussMarkov(2e-4, 40.0)
    + GaussMarkov(2e-4, 700.0),
    "walk + GM": WhiteNoise(1e-4) + RandomWalk(2e-6) + GaussMarkov(1e-4, 30.0),
    "flicker": WhiteNoise(1e-4) + BiasInstability(5e-5),
    "slow GMs only": Model((GaussMarkov(4e-5, 60.0), GaussMarkov(3e-4, 6e5))),
    "fast GMs only": Model((GaussMarkov(1e-2, 0.02), GaussMarkov(3e-3, 0.3))),
    "paper gyro": TABLE_6.models["gyro_x"],
}
QUIET = SensorModels.of(
    {
        "gyro": WhiteNoise(1e-4) + GaussMarkov(5e-5, 60.0),
        "accel": WhiteNoise(1e-3) + GaussMarkov(2e-3, 30.0),
    }
)
HORIZONS = (1.0, 10.0, 60.0, 600.0)
OUTAGES = (10.0, 30.0, 60.0)


SENSORS = ("1 GM", "paper gyro", "3 GM", "3 GM, other")


def _least_error(truth: Model, hours: int) -> float:
    """Relative standard error of K that any estimate from a record has (Cramer-Rao bound)."""
    found = gmwm.cramer_rao(truth, hours * 36_000, 0.1)
    problem = Problem((RequiredSpectrum.of(truth, 0.1, 60.0),), 60.0)
    safe = gmwm.bound(truth, dt=0.1)
    known = Estimated(truth, found.keys, found.covariance)
    return standard_errors(problem, safe.model, [known])["K"] / safe.K


def length() -> None:
    """K from records of several lengths, by the old rule, bound and reduce."""
    print("K [u/s/sqrt(Hz)] for 60 s by length of record. random walk: fitted, or its 95 % limit;")
    print("/ true: over K from the true model; relative standard errors of K by bound: the least")
    print("(Cramer-Rao) and the stated one")
    heads = ("random walk", "bound", "/ true", "least se", "stated se", "reduce", "/ true")
    print(f"{'truth':<12}{'hours':>6}" + "".join(f"{head:>12}" for head in heads)
          + f"   NEES of reduce after {', '.join(f'{t:g}' for t in OUTAGES)} s")  # fmt: skip
    chain = Chain.usual("gyro")
    for name in SENSORS:
        truth = TRUTHS[name]
        right = gmwm.bound(truth, dt=0.1).K
        small_right = gmwm.reduce({"gyro_x": truth}, dt=0.1)["gyro_x"].K
        for hours in (1, 4, 16, 64):
            series = truth.simulate(hours * 36_000, 0.1, hours)
            fit = gmwm.fit(truth.opened(), series, 0.1)
            safe = gmwm.bound(fit)
            small = gmwm.reduce({"gyro_x": fit.model}, dt=0.1)["gyro_x"]
            errors = chain.errors(truth, small.model, 0.1, OUTAGES, believed_sd=small.initial_sd)
            nees = " ".join(f"{value:6.3f}" for value in errors.nees())
            own = axis_numbers(fit).K
            walk = own.upper if own.kind == "bound" else own.value
            cells = (
                f"{walk:.2e}", f"{safe.K:.2e}", f"{safe.K / right:.3f}",
                f"{_least_error(truth, hours):.3f}", f"{safe.stderr.get('K', np.nan) / safe.K:.3f}",
                f"{small.K:.2e}", f"{small.K / small_right:.3f}",
            )  # fmt: skip
            print(f"{name:<12}{hours:>6}" + "".join(f"{cell:>12}" for cell in cells)
                  + "   " + nees, flush=True)  # fmt: skip


def errors() -> None:
    """Whether the standard errors of N and K are right, from many records of each sensor."""
    print("runs: records; with: those with standard errors. Relative to N and K from the true")
    print("model: median standard error, mean and spread (half the 68 % range) of the estimates.")
    print("held: share of the 95 % intervals that hold the true value")
    print(f"{'truth':<14}{'hours':>6}{'runs':>6}{'with':>6}" + "".join(
        f"{f'{key}: {head}':>11}" for key in "NK" for head in ("error", "mean", "spread", "held")
    ))  # fmt: skip
    for name, hours, runs in (("1 GM", 1, 100), ("walk + GM", 4, 100), ("paper gyro", 16, 50)):
        truth = TRUTHS[name]
        right = gmwm.bound(truth, dt=0.1)
        found = []
        for seed in range(runs):
            series = truth.simulate(hours * 36_000, 0.1, 1000 + seed)
            each = gmwm.bound(gmwm.fit(truth.opened(), series, 0.1))
            if each.stderr:
                found.append([[getattr(each, key), each.stderr[key]] for key in "NK"])
        cells = []
        for key, (value, error) in zip("NK", np.array(found).transpose(1, 2, 0), strict=True):
            true = getattr(right, key)
            low, high = np.quantile(value, [0.16, 0.84])
            held = np.abs(value - true) < 1.96 * error
            cells += [np.median(error) / true, np.mean(value) / true, 0.5 * (high - low) / true,
                      np.mean(held)]  # fmt: skip
        print(f"{name:<14}{hours:>6}{runs:>6}{len(found):>6}"
              + "".join(f"{cell:>11.3g}" for cell in cells), flush=True)  # fmt: skip


def balance() -> None:
    """Cost of a reduced filter whose NEES is the same after all outages."""
    print("N+K by gmwm.reduce for 10, 30 and 60 s, all truths as gyro_x, accel_x and gyro_z: NEES")
    print("by weight of the squared log NEES; true error at 60 s over that of a filter with the")
    print("full model")
    print(f"{'weight':>6}{'10 s':>16}{'30 s':>16}{'60 s':>16}{'error: mean':>14}{'most':>8}")
    for weight in (0.0, 5.0, 10.0, 20.0, 40.0):
        tuning.EVENNESS = weight
        nees, losses = [], []
        for name in ("gyro_x", "accel_x", "gyro_z"):
            for truth in TRUTHS.values():
                axis = SensorAxes.of({name: truth}, DT, 0.0).axes[0]
                found = gmwm.reduce({name: truth})[name]
                models = ((found.model, found.initial_sd), (truth, 0.0))
                each, full = (axis.chain.errors(truth, model, DT, OUTAGES, believed_sd=sd)
                              for model, sd in models)  # fmt: skip
                nees.append(each.nees())
                losses.append(np.sqrt(each.actual[-1, -1, -1] / full.actual[-1, -1, -1]))
        ends = zip(np.min(nees, axis=0), np.max(nees, axis=0), strict=True)
        cells = "".join(f"{f'{low:.3f} to {high:.3f}':>16}" for low, high in ends)
        print(f"{weight:>6g}{cells}{np.mean(losses):>14.3f}{np.max(losses):>8.3f}", flush=True)


def coarse() -> None:
    """Consistency of reduced numbers for a heading in steps."""
    print("N+K by gmwm.reduce, white noise of 1e-6 rad/sqrt(s) and quantization Q of a heading: N")
    print("over sqrt(2 Q^2/T), T the longest outage; NEES of the heading and of its gain since the")
    print("last fix")
    print(f"{'Q [rad]':<9}{'outages [s]':<14}{'N':>6}{'heading':>22}{'gain':>22}")
    for Q in (5e-5, 2e-4, 1e-3):
        for outages in ((60.0,), OUTAGES):
            truth = Model((WhiteNoise(1e-6), QuantizationNoise(Q), GaussMarkov(1e-7, 100.0)))
            found = gmwm.reduce({"gyro_z": truth}, outages=outages)["gyro_z"]
            cells = [
                "".join(f"{nees:>7.3f}" for nees in chain.errors(
                    truth, found.model, DT, outages, believed_sd=found.initial_sd
                ).nees())
                for chain in Chain.usual("").judged
            ]  # fmt: skip
            print(f"{Q:<9g}{', '.join(f'{t:g}' for t in outages):<14}"
                  f"{found.N / np.sqrt(2.0 * Q**2 / outages[-1]):>6.2f}"
                  + "".join(f"{cell:>22}" for cell in cells), flush=True)  # fmt: skip


def tightness() -> None:
    """Predicted over true standard deviation of bounds at their horizons; the worst direction."""
    print("predicted/true standard deviation of position at the horizon (tilt-velocity-position")
    print("chain, two minutes with a fix of 1 m every second before). worst: largest NEES in any")
    print("direction of chains of 1 to 3 integrals, after 0 to 1,200 s of fixes, at 0.1 to 10")
    print("horizons")
    heads = "".join(f"{f'{t:g} s':>7}" for t in HORIZONS)
    print(f"{'truth':<15}{'form':<8}{heads}   worst")
    total: dict[str, list[float]] = {}
    for name, truth in TRUTHS.items():
        for form in ("N+K", "N+GM", "N+K+GM"):
            cells, worst = [], 0.0
            for T in HORIZONS:
                try:
                    found = gmwm.bound(truth, form, T)
                except InputError:
                    break
                for order in (1, 2, 3):
                    for settled in (0.0, 30.0, 120.0, 1200.0):
                        sd = 1.0 / 9.8 if order == 3 else 1.0
                        errors = Chain(order, sd, settled).errors(
                            truth, found.model, DT, (0.1 * T, T, 3.0 * T, 10.0 * T),
                            believed_sd=found.initial_sd, every_fix=settled < 1200.0,
                        )  # fmt: skip
                        worst = max(worst, float(errors.worst().max()))
                        if order == 3 and settled == 120.0:
                            cells.append(float(errors.tightness()[-3]))
            if cells:
                total.setdefault(form, []).extend(cells)
                shown = "".join(f"{cell:7.2f}" for cell in cells)
                print(f"{name:<15}{form:<8}{shown}   {worst:.5f}", flush=True)
    for form, values in total.items():
        print(f"{form}: mean {np.mean(values):.2f}, {np.min(values):.2f} to {np.max(values):.2f}")


def _drawn(rng: np.random.Generator) -> Model:
    """White noise, half with a walk, one to three Gauss-Markov processes or a slow resonance."""
    terms: list[Process] = [WhiteNoise(1e-4)]
    if rng.random() < 0.5:
        terms.append(RandomWalk(float(10.0 ** rng.uniform(-7.0, -5.0))))
    for tau in 10.0 ** rng.uniform(-1.0, 3.5, rng.integers(1, 4)):
        # Its largest Allan deviation, near 2 tau, is 0.1 to 10 times that of the white noise there.
        size = float(10.0 ** rng.uniform(-1.0, 1.0))
        terms.append(GaussMarkov(size * 1e-4 / np.sqrt(2.0 * tau) / 0.6, float(tau)))
    if rng.random() < 0.25:
        frequency, damping = 10.0 ** rng.uniform([-2.0, -1.5], [0.0, -0.3])
        terms.append(Resonance(float(10.0 ** rng.uniform(-5.0, -3.5)), frequency, damping))
    return Model(tuple(terms))


def random() -> None:
    """Predicted over true standard deviation at 60 s of bounds for random models, seed 4320."""
    rng, found = np.random.default_rng(4320), []
    for _ in range(100):
        truth = _drawn(rng)
        slow = any(isinstance(each, Resonance) for each in truth.terms)
        found += [
            (form, slow, gmwm.bound(truth, form, 60.0, dt=DT).tightness[60.0])
            for form in ("N+K", "N+K+GM")
        ]
    print("predicted/true at 60 s, 100 random models: median, mean, 90 %, largest")
    for form in ("N+K", "N+K+GM"):
        for slow, name in ((False, "no resonance"), (True, "slow resonance")):
            own = np.array([value for f, s, value in found if (f, s) == (form, slow)])
            ends = (np.median(own), np.mean(own), np.quantile(own, 0.9), np.max(own))
            cells = "".join(f"{each:7.2f}" for each in ends)
            print(f"{form:<8}{name:<16}{own.size:>4}{cells}")


def rates() -> None:
    """How far bounds move with the sampling rate, which slow models do not know of."""
    rates = (50.0, 100.0, 200.0, 500.0, 1000.0)
    print(f"bounds for 60 s at {', '.join(f'{rate:g}' for rate in rates)} Hz: ratio of the largest")
    print("to the smallest N, K, and predicted standard deviation at the horizon")
    for name in ("1 GM", "2 GM", "3 GM, other", "walk + GM", "flicker"):
        for form in ("N+K", "N+K+GM"):
            found = [gmwm.bound(TRUTHS[name], form, dt=1.0 / rate) for rate in rates]
            cells = [[each.N, max(each.K, 1e-12), each.tightness[60.0]] for each in found]
            ratio = np.max(cells, axis=0) / np.min(cells, axis=0)
            print(f"{name:<15}{form:<8}" + "".join(f"{value:>8.3f}" for value in ratio), flush=True)


def _rules(truth: Model, T: float) -> dict[str, tuple[Model, float]]:
    """Numbers by common rules, and by this package."""
    safe = gmwm.bound(truth, horizon=T)
    small = gmwm.reduce({"gyro_x": truth}, outages=(T,))["gyro_x"]
    tau = DT * 2.0 ** np.arange(24)
    deviation = np.sqrt(2.0 * truth.haar_variance(tau, DT))
    N = float(np.interp(0.0, np.log(tau), deviation))
    # The line of slope +1/2 that touches the Allan deviation from below its end, at 1,000 s.
    K = float(np.sqrt(3.0 / 1000.0) * np.interp(np.log(1000.0), np.log(tau), deviation))
    line = WhiteNoise(N) + RandomWalk(K)
    white = WhiteNoise(max(np.sqrt(truth.white_density()), 1e-12)) + RandomWalk(1e-9)
    ten = WhiteNoise(10.0 * N) + RandomWalk(10.0 * K)
    sd = safe.initial_sd
    return {
        "white noise only": (white, sd),
        "Allan lines": (line, sd),
        "times ten": (ten, sd),
        "bound": (safe.model, sd),
        "reduce": (small.model, small.initial_sd),
    }


def rules() -> None:
    """NEES and loss of accuracy with numbers by several rules."""
    print("position by tilt after 60 s: NEES per degree of freedom; true error over that of a")
    print("filter with the full model; predicted over true error")
    T, chain = 60.0, Chain.usual("gyro")
    names = list(_rules(ONE, T))
    print(f"{'truth':<15}" + "".join(f"{name:>22}" for name in names))
    for name, truth in TRUTHS.items():
        best = chain.errors(truth, truth, DT, (T,)).actual[0, -1, -1]
        cells = []
        for model, sd in _rules(truth, T).values():
            errors = chain.errors(truth, model, DT, (T,), believed_sd=sd)
            loss = np.sqrt(errors.actual[0, -1, -1] / best)
            cells.append(f"{errors.nees()[0]:8.3g} {loss:6.2f} {errors.tightness()[0]:6.2f}")
        print(f"{name:<15}" + "".join(f"{cell:>22}" for cell in cells), flush=True)


def flight() -> None:
    """The whole navigation filter on a loiter: worst direction and horizontal error."""
    for name, truth in (("paper sensor", TABLE_6), ("slow terms of 30 and 60 s alone", QUIET)):
        print(f"INS/GNSS on a loiter, {name}, at the end of outages")
        _flown(truth)
    print("the same sensor after 30 s, N+K for some axes and the full model for the others")
    numbers, scenario = gmwm.bound(QUIET.models), loiter_with_outages(OUTAGES, DT)
    for some in ({"gyro_x", "gyro_y"}, {"gyro_z"}, {"accel_x", "accel_y", "accel_z"}):
        believed = SensorModels.of(
            {axis: numbers[axis].model if axis in some else model
             for axis, model in QUIET.models.items()},
            {axis: numbers[axis].initial_sd for axis in some},
        )  # fmt: skip
        analysis = covariance_analysis(scenario, QUIET, believed)
        at = analysis.index(scenario.outages[1].end)
        true, own = (np.hypot(*sd[at, :2]) for sd in (analysis.sd, analysis.predicted_sd))
        print(f"{', '.join(sorted(some)):<32}{true:>10.4g}{own:>10.4g}", flush=True)


def _flown(truth: SensorModels) -> None:
    scenario, models = loiter_with_outages(OUTAGES, DT), truth.models
    found = {
        "bound N+K": gmwm.bound(models),
        "bound N+GM": gmwm.bound(models, "N+GM"),
        "bound N+K+GM": gmwm.bound(models, "N+K+GM"),
        "reduce N+K": gmwm.reduce(models),
        "reduce N+GM": gmwm.reduce(models, "N+GM"),
        "reduce N+2GM": gmwm.reduce(models, "N+2GM"),
    }
    full = covariance_analysis(scenario, truth, truth)
    print(f"{'':<14}{'outage':>8}{'full [m]':>10}{'true [m]':>10}{'predicted':>10}{'NEES':>8}"
          f"{'worst':>9}")  # fmt: skip
    for name, numbers in found.items():
        analysis = covariance_analysis(scenario, truth, _filter(numbers))
        ratio = np.linalg.eigvals(np.linalg.solve(analysis.predicted, analysis.actual)).real
        for outage in scenario.outages:
            at = analysis.index(outage.end)
            sizes = (np.hypot(*s[at, :2]) for s in (full.sd, analysis.sd, analysis.predicted_sd))
            print(f"{name:<14}{outage.duration:>6g} s" + "".join(f"{s:>10.4g}" for s in sizes)
                  + f"{analysis.nees()[at]:>8.3f}{ratio.max():>9.4f}", flush=True)  # fmt: skip


def whole() -> None:
    """The whole navigation filter with the bounds of all truths for all horizons."""
    print("INS/GNSS on a loiter with outages of 1, 10 and 60 s, the truth on six axes (u: rad/s,")
    print("m/s^2): largest eigenvalue of P_predicted^-1 P_true at any time, by horizon of bounds")
    print(f"{'truth':<15}{'form':<8}" + "".join(f"{f'{T:g} s':>10}" for T in HORIZONS))
    scenario = loiter_with_outages((1.0, 10.0, 60.0), DT)
    for name, truth in TRUTHS.items():
        models = {"gyro": truth, "accel": truth}
        for form in ("N+K", "N+GM", "N+K+GM"):
            cells = []
            for T in HORIZONS:
                try:
                    believed = _filter(gmwm.bound(models, form, T))
                    analysis = covariance_analysis(scenario, SensorModels.of(models), believed)
                except InputError:  # a walk beside N+GM; a flicker has many states
                    break
                ratio = np.linalg.solve(analysis.predicted, analysis.actual)
                cells.append(f"{np.linalg.eigvals(ratio).real.max():>10.5f}")
            if cells:
                print(f"{name:<15}{form:<8}" + "".join(cells), flush=True)


def _filter(numbers: Mapping[str, gmwm.AxisFilterNumbers]) -> SensorModels:
    return SensorModels.of(
        {axis: each.model for axis, each in numbers.items()},
        {axis: each.initial_sd for axis, each in numbers.items()},
    )


# ADIS16405, in u/sqrt(Hz) and u: 2 deg/sqrt(h), 0.007 deg/s; 0.2 m/s/sqrt(h), 0.2 mg.
_SHEET = {"gyro": (5.8e-4, 1.2e-4), "accel": (3.3e-3, 2.0e-3)}


def real(folder: str) -> None:
    """Certified and measured NEES: one recording is calibrated, the others are navigated with."""
    recordings = [
        gmwm.read(f"{folder}/adis16405_{k}.csv.gz", rate=100.0,
                  units={"gyro": "deg/s", "accel": "g"})
        for k in (1, 2, 3, 4)
    ]  # fmt: skip
    scenario = loiter_with_outages((10.0, 60.0), DT)
    print("position at the end of outages of 10 and 60 s: NEES as certified, and as measured in 24")
    print("runs with the errors of the other three recordings")
    print(f"{'calibrated':<12}{'numbers':<14}{'certified':>20}{'measured':>20}")
    for k, recording in enumerate(recordings):
        calibration = gmwm.calibrate(recording)
        models = {name: fit.model for name, fit in calibration.items()}
        lines = {}
        for name, fit in calibration.items():
            tau, deviation = fit.wv.tau, fit.wv.allan_deviation
            at = lambda t, x=tau, y=deviation: float(np.interp(np.log(t), np.log(x), y))  # noqa: E731
            lines[name] = (at(1.0), at(1000.0) * np.sqrt(3.0 / 1000.0))
        sheet = {kind: (N, B / np.sqrt(1000.0)) for kind, (N, B) in _SHEET.items()}
        given = {
            "data sheet": sheet,
            "Allan lines": lines,
            "lines x 10": {name: (10.0 * N, 10.0 * K) for name, (N, K) in lines.items()},
            "bound": gmwm.bound(calibration),
            "reduce": gmwm.reduce(models, outages=(10.0, 60.0)),
        }
        certificates = {name: gmwm.certify(models, numbers) for name, numbers in given.items()}
        filters = {name: _filter(found.numbers) for name, found in certificates.items()}
        others = [each for i, each in enumerate(recordings) if i != k]
        source = Recorded.of(others, scenario.trajectory.duration)
        runs = monte_carlo(scenario, source, filters, min(24, source.available or 24))
        for name, found in certificates.items():
            certified = [check.nees for check in found.of("outage")]
            measured = [
                float(np.mean(runs[name].nees[:, runs[name].index(outage.end), 0])) / 3.0
                for outage in scenario.outages
            ]
            print(f"{k + 1:<12}{name:<14}" + "".join(f"{v:>10.3g}" for v in certified + measured),
                  flush=True)  # fmt: skip
        for notice in next(iter(certificates.values())).notices:
            print(f"  {notice}")


if __name__ == "__main__":
    warnings.simplefilter("ignore", gmwm.FitWarning)
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="*", default=["length", "tightness", "rules", "flight"],
                        help="tables by name; or 'real FOLDER'")  # fmt: skip
    parts = parser.parse_args().parts
    if parts[0] == "real":
        real(parts[1])
    else:
        for part in parts:
            globals()[part]()
