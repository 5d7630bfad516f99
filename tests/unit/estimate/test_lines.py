"""The classical route: which regions are found, what is read from them, what is refused."""

import json

import matplotlib

matplotlib.use("Agg")

import numpy as np
import pytest
from scipy.stats import chi2

import gmwm
from gmwm import BiasInstability, GaussMarkov, QuantizationNoise, RandomWalk, RateRamp, WhiteNoise
from gmwm.errors import InputError
from gmwm.estimate import Fit
from gmwm.process import as_model
from marks import slow

ALL = QuantizationNoise() + WhiteNoise() + BiasInstability() + RandomWalk() + RateRamp()
SEEDS = range(50)
# Of fifty records, more than this many have a chance of 0.002 at a rate of one in a hundred.
RARE = 3


def fits(truth, model, n, seeds=SEEDS, dt=1.0):
    truth = as_model(truth)
    return [gmwm.fit(model, truth.simulate(n, dt, seed), dt, method="allan") for seed in seeds]


@pytest.fixture(scope="module")
def corner():
    """White noise and random walk, whose lines cross at 173 s."""
    return gmwm.wavelet_variance(
        (WhiteNoise(0.2) + RandomWalk(0.002)).simulate(100_000, 1.0, 1), dt=1.0
    )


@pytest.fixture(scope="module")
def drifting():
    """Fifty of the records of which the random walk cannot be read."""
    truth = WhiteNoise(0.2) + RandomWalk(0.02) + RateRamp(0.003)
    return fits(truth, ALL, 6000)


# -- detection ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "truth",
    [slow(QuantizationNoise(0.4)), WhiteNoise(0.2), BiasInstability(0.3), slow(RandomWalk(0.02))],
    ids=repr,
)
def test_one_process_alone_shows_one_region_and_its_parameter(truth):
    ((key, value),) = as_model(truth).params.items()
    found = fits(truth, ALL, 6000)
    assert all(key in fit.keys for fit in found)
    assert sum(fit.keys != (key,) for fit in found) <= RARE
    z = np.array([(fit.params[key] - value) / fit.stderr[key] for fit in found])
    assert np.sum(z**2) < chi2.isf(1e-4, z.size)


@pytest.mark.parametrize("slope", [0.003, -0.003])
def test_a_ramp_alone_is_exact_and_signed(slope):
    fit = gmwm.fit(ALL, as_model(RateRamp(slope)).simulate(6000, 1.0, 1), 1.0, method="allan")
    assert fit.keys == ("R",)
    assert fit.params["R"] == pytest.approx(slope, rel=1e-9)
    assert fit.regions[0].coefficient > 0.0


@pytest.mark.parametrize(
    "model", [WhiteNoise(), slow(RandomWalk()), slow(BiasInstability())], ids=repr
)
def test_the_right_model_is_seldom_said_to_miss_the_data(model):
    (key,) = as_model(model).params
    found = fits(as_model(model).with_params({key: 0.1}), model, 6000)
    assert sum(not fit.valid for fit in found) <= RARE


def test_a_well_separated_corner_gives_both_lines_and_no_plateau():
    truth = WhiteNoise(0.2) + RandomWalk(0.005)
    found = fits(truth, ALL, 100_000, range(20))
    assert all({"N", "K"} <= set(fit.keys) for fit in found)
    assert sum(len(fit.keys) > 2 for fit in found) <= RARE
    for fit in found:
        # Leakage of the one into the other is all but a few per cent; see the docstring.
        assert fit.params["N"] == pytest.approx(0.2, rel=0.05)
        assert abs(fit.params["K"] - 0.005) < 4.0 * fit.stderr["K"]


def test_a_region_does_not_go_across_a_process_that_bends_it_a_little():
    # White noise that is a fifth larger above the correlation time; straight by eye over 9 octaves.
    truth = WhiteNoise(1.0) + GaussMarkov(1.5, 0.1)
    for fit in fits(truth, WhiteNoise(), 200_000, range(3), dt=0.01):
        assert fit.regions[0].tau_max < 0.1
        assert abs(fit.params["N"] - 1.0) < 4.0 * fit.stderr["N"]


def test_where_a_ramp_hides_the_random_walk_none_is_invented(drifting):
    assert all({"N", "R"} <= set(fit.keys) for fit in drifting)
    assert sum(len(fit.keys) > 2 for fit in drifting) <= RARE
    text = "K: the Allan plot has no region of slope +1/2: that term is not estimated"
    assert sum(text in map(str, fit.notices) for fit in drifting) >= len(drifting) - RARE
    assert not any(fit.valid for fit in drifting)


def test_the_ramp_has_the_bias_of_the_random_walk_below_it(drifting):
    truth = as_model(WhiteNoise(0.2) + RandomWalk(0.02) + RateRamp(0.003))
    read, expected = [], []
    for fit in drifting:
        region = fit.regions[-1]
        tau = fit.wv.tau[(fit.wv.tau >= region.tau_min) & (fit.wv.tau <= region.tau_max)]
        deviation = np.sqrt(2.0 * truth.haar_variance(tau, 1.0))
        expected.append(np.sqrt(2.0) * np.exp(np.mean(np.log(deviation / tau))))
        read.append(fit.params["R"])
    error = np.std(read) / np.sqrt(len(read))
    assert np.mean(expected) > 1.03 * 0.003
    assert np.mean(read) > 0.003 + 2.0 * error
    assert abs(np.mean(read) - np.mean(expected)) < 4.0 * error


def test_regions_are_known_well_straight_and_in_order():
    truth = QuantizationNoise(2.0) + WhiteNoise(0.2) + RandomWalk(1e-5)
    fit = gmwm.fit(ALL, truth.simulate(400_000, 1.0, 2), 1.0, method="allan")
    assert [region.key for region in fit.regions] == list(fit.keys)
    assert {"Q", "N"} <= set(fit.keys)
    for a, b in zip(fit.regions, fit.regions[1:], strict=False):
        assert a.slope < b.slope
        assert a.tau_max <= b.tau_min
    for region in fit.regions:
        assert region.tau_max >= 4.0 * region.tau_min
        inside = (fit.wv.tau >= region.tau_min) & (fit.wv.tau <= region.tau_max)
        assert np.all(fit.wv.dof[inside] >= 30.0)
        slopes = np.diff(np.log2(fit.wv.allan_deviation[inside]))
        assert np.all(np.abs(slopes - region.slope) <= 0.2)


def test_the_sampling_interval_only_changes_the_units():
    x = (WhiteNoise(0.2) + RandomWalk(0.002)).simulate(100_000, 1.0, 1)
    slow = gmwm.fit(WhiteNoise() + RandomWalk(), x, 1.0, method="allan")
    fast = gmwm.fit(WhiteNoise() + RandomWalk(), x, 0.01, method="allan")
    assert fast.params["N"] == pytest.approx(0.1 * slow.params["N"], rel=1e-9)
    assert fast.params["K"] == pytest.approx(10.0 * slow.params["K"], rel=1e-9)
    assert fast.regions[0].tau_max == pytest.approx(0.01 * slow.regions[0].tau_max)


def test_nothing_is_read_from_too_short_a_record():
    x = as_model(WhiteNoise(1.0)).simulate(60, 1.0, 1)
    with pytest.raises(InputError, match=r"no region of slope -1/2: .*regions="):
        gmwm.fit(WhiteNoise(), x, 1.0, method="allan")


# -- lines ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("model", "key", "slope", "factor"),
    [
        (QuantizationNoise(), "Q", -1.0, 3.0**0.5),
        (WhiteNoise(), "N", -0.5, 1.0),
        (BiasInstability(), "B", 0.0, (2.0 * np.log(2.0) / np.pi) ** 0.5),
        (RandomWalk(), "K", 0.5, 3.0**-0.5),
        (RateRamp(), "R", 1.0, 2.0**-0.5),
    ],
    ids=["Q", "N", "B", "K", "R"],
)
def test_a_line_is_least_squares_of_its_slope_over_its_region(corner, model, key, slope, factor):
    fit = gmwm.fit(model, corner, method=gmwm.AllanLines(regions={key: (4, 32)}))
    tau, deviation = corner.tau[2:6], corner.allan_deviation[2:6]
    expected = np.exp(np.mean(np.log(deviation) - slope * np.log(tau)))
    (region,) = fit.regions
    assert (region.key, region.slope, region.tau_min, region.tau_max) == (key, slope, 4.0, 32.0)
    assert region.coefficient == pytest.approx(expected)
    assert abs(fit.params[key]) == pytest.approx(expected / factor)


def test_standard_errors_follow_from_the_covariance_by_differences(corner):
    model = WhiteNoise() + RandomWalk()
    regions = {"N": (1, 8), "K": (512, 2048)}
    fit = gmwm.fit(model, corner, method=gmwm.AllanLines(regions=regions))

    def read(variance):
        n = np.exp(np.mean(np.log(np.sqrt(2.0 * variance[:4] * corner.tau[:4]))))
        k = np.exp(np.mean(np.log(np.sqrt(6.0 * variance[9:12] / corner.tau[9:12]))))
        return np.array([n, k])

    steps = 1e-5 * np.diag(corner.variance)
    gradient = np.array(
        [
            (read(corner.variance + step) - read(corner.variance - step)) / 2e-5 / value
            for step, value in zip(steps, corner.variance, strict=True)
        ]
    )
    expected = gradient.T @ corner.covariance @ gradient
    expected += np.diag([(0.005 * fit.params[key]) ** 2 for key in "NK"])  # of the reading
    np.testing.assert_allclose(fit.covariance, expected, rtol=1e-6)
    assert fit.keys == ("N", "K")
    assert fit.dof == corner.tau.size - 2
    assert np.isnan(fit.p_value)


def test_regions_take_times_as_people_write_them():
    x = as_model(WhiteNoise(0.2)).simulate(5000, 0.1, 1)
    fit = gmwm.fit(
        WhiteNoise(), x, 0.1, method=gmwm.AllanLines(regions={"N": np.array([0.4, 3.2])})
    )
    assert fit.regions[0].tau_min == pytest.approx(0.4)
    assert fit.regions[0].tau_max == pytest.approx(3.2)


def test_given_regions_leave_the_others_to_be_found_beside_them(corner):
    model = WhiteNoise() + RandomWalk()
    free = gmwm.fit(model, corner, method="allan")
    fit = gmwm.fit(model, corner, method=gmwm.AllanLines(regions={"K": (1024, 4096)}))
    assert fit.params["N"] == free.params["N"]
    assert fit.regions[1].tau_min == 1024.0
    early = gmwm.fit(model, corner, method=gmwm.AllanLines(regions={"K": (8, 16)}))
    assert early.regions[0].tau_max == 8.0
    taken = gmwm.fit(model, corner, method=gmwm.AllanLines(regions={"K": (1, 16)}))
    assert taken.keys == ("K",)


def test_fixed_values_stay_and_are_named_as_fixed(corner):
    fit = gmwm.fit(WhiteNoise(N=0.25) + RandomWalk(), corner, method="allan")
    assert fit.params["N"] == 0.25
    assert fit.keys == ("K",)
    assert [estimate.kind for estimate in fit.estimates] == ["fixed", "estimated"]
    assert not fit.valid
    assert "misses the Allan deviation by" in fit.message


# -- refusals -------------------------------------------------------------------------------------


def test_other_processes_are_refused(corner):
    with pytest.raises(InputError, match=r"GaussMarkov\(\) has no straight line .* leave it out"):
        gmwm.fit(WhiteNoise() + GaussMarkov(), corner, method="allan")


@pytest.mark.parametrize(
    ("regions", "words"),
    [
        ({"X": (1, 8)}, r"no parameter 'X' to estimate, only N"),
        ({"K": (1, 8)}, r"no parameter 'K' to estimate, only N"),
        ({"Q": (1, 8)}, r"no parameter 'Q' to estimate, only N"),
        ({"N": (5, 7)}, r"no averaging time lies between 5 and 7 s"),
        ({"N": (1e6, 1e7)}, r"no averaging time lies between"),
        ([("N", (1, 8))], r"by key"),
        ("N", r"by key"),
    ],
)
def test_bad_regions_are_refused(corner, regions, words):
    model = WhiteNoise() + QuantizationNoise(Q=0.1)
    with pytest.raises(InputError, match=words) as caught:
        gmwm.fit(model, corner, method=gmwm.AllanLines(regions=regions))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("option", ["omega", "weights"])
def test_weights_of_a_method_that_has_none_are_refused(corner, option):
    for method in ("allan", gmwm.AllanLines(), "em", gmwm.MLE()):
        with pytest.raises(InputError, match="has no weights: leave them out"):
            gmwm.fit(WhiteNoise(), corner, method=method, **{option: "model"})


def test_a_level_without_variance_is_left_out():
    x = np.tile([1.0, -1.0], 500)  # no Allan variance from two samples on
    fit = gmwm.fit(WhiteNoise(), x, 1.0, method=gmwm.AllanLines(regions={"N": (1, 8)}))
    assert np.isfinite(fit.params["N"])
    with pytest.raises(InputError, match="no region"):
        gmwm.fit(WhiteNoise(), x, 1.0, method="allan")


# -- the result -----------------------------------------------------------------------------------


def test_the_result_comes_back_from_a_file(drifting):
    fit = drifting[0]
    again = Fit.from_dict(json.loads(json.dumps(fit.to_dict())))
    assert str(again) == str(fit)
    assert again.regions == fit.regions
    np.testing.assert_array_equal(again.covariance, fit.covariance)


@pytest.mark.parametrize("wavelet", ["db2", "sym4"])
def test_other_wavelets_are_refused(wavelet):
    wv = gmwm.wavelet_variance(WhiteNoise(1.0).simulate(2000, 1.0, seed=1), 1.0, wavelet=wavelet)
    with pytest.raises(InputError, match='wavelet="haar"'):
        gmwm.fit(WhiteNoise(), wv, method="allan")


def test_robust_variances_are_read_too():
    wv = gmwm.wavelet_variance(WhiteNoise(1.0).simulate(5000, 1.0, seed=1), 1.0, robust=True)
    fit = gmwm.fit(WhiteNoise(), wv, method="allan")
    assert fit.params["N"] == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize(
    ("model", "region"),
    [
        (RandomWalk(), {"K": (1, 100)}),
        (BiasInstability(), {"B": (1, 64)}),
        (RateRamp(), {"R": (1, 8)}),
    ],
)
def test_a_given_region_of_another_slope_is_not_valid(model, region):
    wv = gmwm.wavelet_variance(WhiteNoise(1.0).simulate(6000, 1.0, seed=1), 1.0)
    fit = gmwm.fit(WhiteNoise(1.0) + model, wv, method=gmwm.AllanLines(regions=region))
    assert not fit.valid
    assert "has the slope -0.5" in fit.message


def test_a_given_region_of_the_right_slope_is_seldom_blamed():
    """A slope is off by three standard errors in three of a thousand records."""
    blamed = dict.fromkeys([(1, 8), (4, 64), (8, 128)], 0)
    for seed in range(100):
        wv = gmwm.wavelet_variance(WhiteNoise(1.0).simulate(600, 1.0, seed=seed), 1.0)
        for region in blamed:
            fit = gmwm.fit(WhiteNoise(), wv, method=gmwm.AllanLines(regions={"N": region}))
            blamed[region] += "has the slope" in fit.message
    assert max(blamed.values()) <= RARE


def test_reweighted_lines_vary_less():
    """The coarse levels of white noise are worse known, and equal weights let them spoil the line.

    The ratio of standard deviations of 24 records has an error of some 20 %; expected is 0.3.
    """
    spread = {}
    for regression in ("ols", "irls"):
        method = gmwm.AllanLines({"N": (1, 256)}, regression)
        found = [
            gmwm.fit(WhiteNoise(), WhiteNoise(1.0).simulate(2000, 1.0, seed), 1.0, method=method)
            for seed in range(24)
        ]
        values = np.array([fit.params["N"] for fit in found])
        spread[regression] = np.std(values)
        assert np.mean(values) == pytest.approx(
            1.0, abs=4.0 * spread[regression] / np.sqrt(24) + 0.02
        )
        assert np.median([f.stderr["N"] for f in found]) == pytest.approx(np.std(values), rel=0.4)
    assert spread["irls"] < 0.6 * spread["ols"]


def test_an_unknown_regression_is_rejected():
    with pytest.raises(InputError, match="regression"):
        gmwm.AllanLines(regression="gls")
