"""Whole studies: a filter that believes the truth knows how good it is, one that does not is found.

Bands of one epoch are chi-square and binomial; those over a time come from the scatter between the
runs. A figure of each group is judged at 1e-3 over all of them, as `Consistency.consistent` does,
and 95 % bands are counted where there are many.
"""

import numpy as np
import pytest
from scipy.stats import binom

import gmwm
from error_models import triads
from gmwm import GaussMarkov, WhiteNoise
from gmwm.ins import Outage, innovation_test, monte_carlo, over_time, spread
from gmwm.ins.simulation import GROUPS
from gmwm.ins.simulation.consistency import sizes

TRUE = triads(
    WhiteNoise(5e-5) + GaussMarkov(2e-4, 30.0) + GaussMarkov(1e-4, 500.0),
    WhiteNoise(1e-3) + GaussMarkov(2e-3, 10.0) + GaussMarkov(2e-3, 300.0),
)
SLOW_ONLY = triads(
    WhiteNoise(5e-5) + GaussMarkov(1e-4, 500.0), WhiteNoise(1e-3) + GaussMarkov(2e-3, 300.0)
)
NAMES = {*GROUPS, "sensors"}


class Study:
    """Two filters over the same runs, with one outage before the end."""

    def __init__(self, duration, dt, outage, runs, seed, jobs=1):
        truth = gmwm.ins.helicopter_mapping(duration=duration, dt=dt)
        self.scenario = gmwm.ins.Scenario(truth, gmwm.ins.gnss(truth), (outage,))
        self.outage, self.runs = outage, runs
        self.found = monte_carlo(
            self.scenario,
            gmwm.ins.Simulated(TRUE),
            {"true": TRUE, "slow": SLOW_ONLY},
            runs,
            seed,
            jobs=jobs,
        )

    def judged(self, name):
        """At the end of the outage, and while GNSS is on and the filter has settled."""
        runs = self.found[name]
        return (
            gmwm.ins.at_epoch(runs, runs.index(self.outage.end)),
            over_time(runs, 0.15 * self.outage.start, self.outage.start),
        )

    def horizontal(self):
        return {name: sizes(self.found[name], self.outage.end) for name in self.found.filters}


@pytest.fixture(scope="module")
def short():
    return Study(300.0, 0.02, Outage(220.0, 30.0), 40, 1)


@pytest.fixture(scope="module")
def long():
    return Study(900.0, 0.01, Outage(700.0, 60.0), 200, 2024, jobs=2)


def assert_consistent(study):
    runs = study.found["true"]
    assert runs.diverged == 0
    within = []
    for found in study.judged("true"):
        assert set(found.nees) == set(found.coverage) == NAMES
        assert found.consistent
        for name in NAMES:
            ratio, coverage = found.nees[name], found.coverage[name][2]
            assert coverage.level == 0.95
            within += [ratio.within, coverage.within]
            assert found.rms[name] == pytest.approx(1.0, abs=0.15)
    # Bands of 95 %, correlated within an epoch: of twenty some three may be missed.
    assert sum(within) >= binom.ppf(1e-3, len(within), 0.95)
    test = innovation_test(runs)
    assert test.nis.p_value > 1e-3
    assert test.whiteness > 1e-3


def assert_found_out(study):
    for found in study.judged("slow"):
        assert not found.consistent
        assert found.nees["position"].value > 2.0
        assert found.nees["position"].value > found.nees["position"].upper
        assert found.coverage["position"][2].upper < 0.95
    test = innovation_test(study.found["slow"])
    assert not test.nis.within
    assert test.whiteness < 1e-6


def assert_analysis_agrees(study):
    """Expected and observed figures at the end of the outage."""
    for name, believed in (("true", TRUE), ("slow", SLOW_ONLY)):
        analysis = gmwm.ins.covariance_analysis(study.scenario, TRUE, believed)
        at, runs = analysis.index(study.outage.end), study.found[name]
        found = spread(runs, study.outage.end)["horizontal"]
        north, east = analysis.sd[at, :2]
        # Relative error of a mean square of two components: at most sqrt(2 / R).
        assert found.rms**2 == pytest.approx(
            north**2 + east**2, rel=4.0 * np.sqrt(2.0 / study.runs)
        )
        assert found.predicted == pytest.approx(np.hypot(*analysis.predicted_sd[at, :2]), rel=1e-2)
        ratio = runs.nees[:, runs.index(study.outage.end), 0] / 3.0
        error = ratio.std(ddof=1) / np.sqrt(study.runs)
        assert abs(ratio.mean() - analysis.nees()[at]) < 4.5 * error


def assert_better_model_navigates_better(study):
    each = study.horizontal()
    found = gmwm.ins.difference(each["slow"], each["true"], "horizontal")
    assert found.significant
    assert found.value > 0.0
    assert found.ratio_lower > 1.0


def test_the_true_model_is_consistent(short):
    assert_consistent(short)


def test_a_filter_of_one_slow_process_is_found_out(short):
    assert_found_out(short)


def test_covariance_analysis_agrees(short):
    assert_analysis_agrees(short)


@pytest.mark.slow
def test_the_true_model_is_consistent_over_many_long_runs(long):
    assert_consistent(long)


@pytest.mark.slow
def test_a_filter_of_one_slow_process_is_found_out_over_many_long_runs(long):
    assert_found_out(long)
    assert long.judged("slow")[0].nees["position"].value > 5.0


@pytest.mark.slow
def test_covariance_analysis_agrees_over_many_long_runs(long):
    assert_analysis_agrees(long)


@pytest.mark.slow
def test_the_true_model_navigates_better_over_many_long_runs(long):
    assert_better_model_navigates_better(long)
