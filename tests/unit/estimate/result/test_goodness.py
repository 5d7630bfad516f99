"""Agreement of model and data, octave by octave, and how long a record would have to be."""

from dataclasses import replace

import numpy as np
import pytest

import gmwm
from gmwm import GaussMarkov, Process, RandomWalk, RateRamp, Resonance, WhiteNoise, parameter

TRUTH = WhiteNoise(0.2) + GaussMarkov(0.5, 20.0)


def fitted(truth=TRUTH, n=6000, seed=1, **options):
    truth = gmwm.process.as_model(truth)
    return gmwm.fit(truth.opened(), truth.simulate(n, 1.0, seed), dt=1.0, **options)


class Noise(Process):
    """White noise that is known by its samples only."""

    A: float = parameter("u", role="scale")

    def draw(self, n, dt, rng):
        return self.A * rng.standard_normal(n)


class TestResiduals:
    def test_they_are_standard_normal_at_every_level_if_the_model_is_right(self):
        runs = 30
        truth = gmwm.process.as_model(TRUTH)
        residuals = []
        for seed in range(runs):
            # The true values in place of the estimated ones, which would take some of the spread.
            fit = gmwm.fit(
                WhiteNoise(),
                truth.simulate(1000, 1.0, seed),
                dt=1.0,
                method=gmwm.GMWM(discrepancy=0.0),
            )
            residuals.append(replace(fit, model=truth).goodness.residual)
        table = np.array(residuals)
        assert np.all(np.abs(table.mean(axis=0)) < 4.5 / runs**0.5)
        # The standard deviation of a standard deviation is (2 runs)^(-1/2); the normal law of
        # Wilson & Hilferty is an approximation at the two coarsest levels.
        scatter = np.abs(table.std(axis=0) - 1.0) * (2 * runs) ** 0.5
        assert np.all(scatter[:-2] < 4.0), scatter
        assert np.all(scatter[-2:] < 6.0), scatter

    def test_degrees_of_freedom_are_those_of_independent_samples_at_the_finest_level(self):
        """var(nu_hat) of first differences of white noise: 3 nu^4/n for large n, by hand."""
        at = fitted(WhiteNoise(1.0), n=4097).goodness
        assert at.dof[0] == pytest.approx(2.0 * 4096 / 3.0, rel=0.01)

    def test_against_deviations_by_hand(self):
        x = TRUTH.simulate(777, 1.0, 3)
        at = gmwm.fit(TRUTH.opened(), x, dt=1.0).goodness
        for tau, data in zip(at.tau, at.data, strict=True):
            m = int(tau)
            mean = np.convolve(x, np.ones(m) / m, "valid")
            assert data == pytest.approx(np.sqrt(0.5 * np.mean((mean[m:] - mean[:-m]) ** 2)))

    def test_a_missing_resonance_shows_at_its_octave(self):
        truth = WhiteNoise(1.0) + Resonance(0.4, 0.02, 0.05)
        fit = gmwm.fit(WhiteNoise(), truth.simulate(100_000, 1.0, 1), dt=1.0)
        misfit, tau = fit.goodness.worst
        assert 8.0 <= tau <= 64.0  # half a period is 25 s
        assert misfit > 0.1
        at = fit.goodness
        k = int(np.flatnonzero(at.tau == tau)[0])
        assert at.residual[k] > 10.0
        # What was allowed for brings the residuals down to their usual size.
        assert abs(at.allowed[k]) < 0.5 * abs(at.residual[k])
        assert np.sqrt(np.mean(at.allowed**2)) < 2.0

    def test_a_model_that_misses_a_level_by_far_is_excluded(self):
        truth = WhiteNoise(1.0) + GaussMarkov(0.3, 300.0)
        x = truth.simulate(50_000, 1.0, 1)
        rigid = gmwm.fit(WhiteNoise(), x, dt=1.0, method=gmwm.GMWM(discrepancy=0.0))
        assert rigid.goodness.is_excluded
        # A large misfit alone is no proof: at few degrees of freedom it is chance.
        chance = [gmwm.fit(truth.opened(), truth.simulate(3000, 1.0, s), dt=1.0) for s in range(8)]
        assert any(np.max(np.abs(fit.goodness.misfit)) > 0.3 for fit in chance)
        assert not any(fit.goodness.is_excluded for fit in chance)

    def test_one_right_model_in_a_thousand_misses_a_level(self):
        truth = WhiteNoise(1.0) + RandomWalk(0.01)
        p = [fitted(truth, n=3000, seed=seed).goodness.largest_p for seed in range(12)]
        # Binomial tails of one in a million.
        assert sum(each < 0.001 for each in p) <= 2
        assert sum(each < 0.05 for each in p) <= 7
        assert max(p) > 0.5

    def test_a_level_that_is_missed_makes_a_fit_invalid_whatever_its_degrees_of_freedom(self):
        # A slow process that the model lacks shows at coarse levels only, which the discrepancy
        # of the fine ones passed over.
        truth = WhiteNoise(1.0) + Resonance(0.4, 0.2, 0.05) + RandomWalk(0.02)
        x = truth.simulate(100_000, 1.0, 1)
        fit = gmwm.fit(WhiteNoise() + GaussMarkov(tau=300.0), x, dt=1.0)
        assert fit.goodness.is_excluded
        assert "describes_every_level" in fit.reasons
        (missed,) = [notice for notice in fit.notices if notice.code == "level-missed"]
        assert missed.values["residual"] == fit.goodness.largest[0]
        assert "the data lie" in fit.message

    def test_nothing_allowed_for_changes_nothing(self):
        fit = fitted()
        assert fit.discrepancy == 0.0
        np.testing.assert_array_equal(fit.goodness.residual, fit.goodness.allowed)


class TestEveryMethod:
    @pytest.mark.parametrize("method", ["gmwm", "mle", "whittle", "em", "simulated"])
    def test_all_methods_agree_on_a_good_model(self, method):
        truth = WhiteNoise(0.3) + RandomWalk(0.01)
        fit = fitted(truth, n=1500, method=method)
        other = fitted(truth, n=1500)
        np.testing.assert_allclose(fit.goodness.data, other.goodness.data)
        # Estimates differ by less than their standard errors; the finest levels have most of them.
        assert np.all(np.abs(fit.goodness.residual[:4]) < 4.0)
        assert fit.goodness.worst is not None

    def test_a_process_that_can_only_be_simulated(self):
        x = np.random.default_rng(1).standard_normal(3000)
        at = gmwm.fit(Noise(), x, dt=1.0, method="simulated").goodness
        assert abs(at.worst[0]) < 0.5
        assert np.all(np.isfinite(at.residual))

    def test_a_ramp_is_taken_out(self):
        fit = fitted(TRUTH + RateRamp(0.01), n=6000)
        plain = fitted(TRUTH, n=6000)
        assert fit.goodness.model[-1] < 0.1 * np.sqrt(2.0 * fit.implied[-1])
        # The series is the same but for its drift, and what the drift's estimate takes is given
        # back: within a fraction of the standard error of the coarse levels.
        np.testing.assert_allclose(fit.goodness.data[:8], plain.goodness.data[:8], rtol=0.05)
        given = gmwm.fit(TRUTH.opened() + RateRamp(0.01), (TRUTH + RateRamp(0.01)).simulate(
            6000, 1.0, 1), dt=1.0)  # fmt: skip
        np.testing.assert_allclose(given.goodness.data, plain.goodness.data, rtol=1e-6)

    def test_robust_and_gaps_and_other_wavelets(self):
        x = TRUTH.simulate(5000, 1.0, 4)
        x[1000:1300] = np.nan
        plain = gmwm.fit(TRUTH.opened(), gmwm.wavelet_variance(x, 1.0)).goodness
        robust = gmwm.fit(TRUTH.opened(), gmwm.wavelet_variance(x, 1.0, robust=True)).goodness
        assert np.all(np.abs(robust.residual) < 4.5)
        assert robust.dof[0] == pytest.approx(0.6 * plain.dof[0], rel=0.2)
        db = gmwm.fit(TRUTH.opened(), gmwm.wavelet_variance(x, 1.0, wavelet="db2")).goodness
        assert np.all(np.abs(db.residual) < 4.5)

    def test_a_misfit_counts_where_it_is_more_than_chance(self):
        # A fine level 2 % off fails the chi-square test; a coarse one 15 % off may be chance.
        truth = Resonance(0.02, 0.2, 0.05) + WhiteNoise(0.1) + RandomWalk(1e-3)
        fit = gmwm.fit(WhiteNoise() + RandomWalk(), truth.simulate(200_000, 1.0, 4), dt=1.0)
        (notice,) = (each for each in fit.notices if each.code == "misfit")
        assert notice.severity == "note"
        assert abs(notice.values["residual"]) > 2.5
        assert abs(notice.values["misfit"]) < 0.1
        assert not fit.goodness.is_poor
        lacking = gmwm.fit(WhiteNoise(), truth.simulate(200_000, 1.0, 4), dt=1.0)
        (notice,) = (each for each in lacking.notices if each.code == "misfit")
        assert notice.severity == "bad" and lacking.goodness.is_poor
        assert "predictions over" in notice.text

    def test_a_level_that_predictions_feel_makes_a_fit_not_valid(self):
        # The chi-square test passes, and as large a residual has one in fifty right models.
        x = (WhiteNoise(1.0) + GaussMarkov(0.5, 100.0)).simulate(8192, 1.0, 13)
        wv = gmwm.wavelet_variance(x, dt=1.0)
        walk = gmwm.fit(WhiteNoise() + RandomWalk(), wv)
        assert walk.discrepancy == 0.0 and walk.goodness.largest_p > 0.01
        assert list(walk.reasons) == ["describes_data"]
        right = gmwm.fit(WhiteNoise() + GaussMarkov(), wv)
        assert right.valid and walk.goodness.loses_to(right.goodness)

    def test_such_a_level_that_chance_makes_is_a_note(self):
        fit = gmwm.fit(WhiteNoise(), WhiteNoise(1e-4).simulate(4000, 0.1, 14), dt=0.1)
        (notice,) = (each for each in fit.notices if each.code == "misfit")
        assert notice.severity == "note" and fit.goodness.is_poor and fit.valid
        assert "chance" in notice.text
        assert 0.05 < fit.goodness.largest_p < 0.2

    def test_levels_are_judged_without_the_discrepancy_beyond_the_finest(self):
        fit = fitted(truth=WhiteNoise(1.0) + RandomWalk(0.1), n=4000)
        at = replace(fit.goodness, allowed=0.0 * fit.goodness.residual)
        assert np.all(at.judged[:4] == 0.0)  # 1, 2, 4 and 8 samples
        assert np.array_equal(at.judged[4:], at.residual[4:])
        fine = replace(at, tau=at.tau / 1000.0)
        assert np.array_equal(fine.judged[fine.tau < 0.1], 0.0 * fine.tau[fine.tau < 0.1])
        assert np.array_equal(fine.judged[fine.tau >= 0.1], fine.residual[fine.tau >= 0.1])

    def test_gaps_that_leave_no_variance_are_not_judged(self):
        x = TRUTH.simulate(600, 1.0, 1)
        x[::3] = np.nan
        fit = gmwm.fit(TRUTH.opened(), x, dt=1.0, method="mle")
        assert "no-test" in [notice.code for notice in fit.notices]
        assert fit.goodness.worst is None
        assert "misfit" not in str(fit)


@pytest.mark.parametrize("n", [8, 9, 33])
def test_short_records(n):
    x = np.random.default_rng(n).standard_normal(n)
    at = gmwm.fit(WhiteNoise(), x, dt=1.0).goodness
    assert at.worst is None or at.dof.max() > 30.0
    assert str(at).count("\n") >= at.tau.size + 1


def test_the_fit_tells_the_largest_misfit():
    fit = fitted(n=20_000)
    misfit, tau = fit.goodness.worst
    assert f"largest misfit {100 * abs(misfit):.2g} % of the deviation at tau = {tau:.3g} s" in (
        " ".join(str(fit).split())
    )


class TestNeededLength:
    def test_it_is_what_makes_the_error_so(self):
        """The standard error of N from white noise: that of a Gaussian sample, 1/(2 n)^(1/2)."""
        fit = fitted(WhiteNoise(1.0), n=2000)
        relative = fit.stderr["N"] / fit.params["N"]
        assert fit.needed_length(0.01)["N"] == pytest.approx(2000 * (relative / 0.01) ** 2)
        # 1/(2 n)^(1/2) = 0.01 at n = 5000; the Haar variances lose little of it.
        assert fit.needed_length(0.01)["N"] == pytest.approx(5000, rel=0.2)

    def test_a_record_of_that_length_has_that_error(self):
        truth = WhiteNoise(0.2) + GaussMarkov(0.5, 20.0)
        first = fitted(truth, n=10_000, seed=2)
        wanted = first.needed_length(0.06)
        longer = fitted(truth, n=int(wanted["sigma"]), seed=3)
        # The first error is that of an estimate: 10 % of it, and of the law's next order.
        assert longer.stderr["sigma"] / longer.params["sigma"] == pytest.approx(0.06, rel=0.25)

    def test_what_it_says_of_bounds_ramps_and_given_values(self):
        x = TRUTH.simulate(4000, 1.0, 5)
        fit = gmwm.fit(WhiteNoise() + GaussMarkov(tau=20.0) + RateRamp(), x, dt=1.0)
        assert set(fit.needed_length()) == {"N", "sigma"}
        white = WhiteNoise(1.0).simulate(4000, 1.0, 5)
        bounded = gmwm.fit(WhiteNoise() + RandomWalk(), white, dt=1.0)
        assert "K" in bounded.upper_bounds
        assert bounded.needed_length()["K"] == np.inf

    def test_several_recordings_count_together(self):
        series = [TRUTH.simulate(4000, 1.0, seed) for seed in (1, 2)]
        fit = gmwm.fit(TRUTH.opened(), series, dt=1.0)
        relative = fit.stderr["tau"] / fit.params["tau"]
        assert fit.needed_length()["tau"] == pytest.approx(8000 * (relative / 0.1) ** 2)

    @pytest.mark.parametrize("value", [0.0, -1.0, "much", np.nan, None])
    def test_an_error_that_is_none(self, value):
        with pytest.raises(gmwm.InputError, match="relative_error"):
            fitted(WhiteNoise(1.0), n=100).needed_length(value)
