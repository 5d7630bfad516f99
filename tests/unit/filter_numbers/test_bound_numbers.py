"""Bounds: never too optimistic, no looser than need be, and honest about what they leave out."""

from dataclasses import replace

import numpy as np
import pytest

import gmwm
from error_models import DT, TRUTHS
from gmwm import GaussMarkov, Model, QuantizationNoise, RandomWalk, Resonance, Sinusoid, WhiteNoise
from gmwm.filter_numbers import Chain
from gmwm.filter_numbers.spectra.dominance import Problem, standard_errors
from gmwm.filter_numbers.spectra.region import Estimated, ParameterRegion
from gmwm.filter_numbers.spectra.required import RequiredSpectrum
from gmwm.ins import Outage, Scenario, SensorModels, covariance_analysis, fixed_wing_loiter, gnss
from gmwm.study.navigation import TABLE_6

ONE = TRUTHS["one"]
WORST = 1.001
STATIONARY = [name for name in TRUTHS if name not in ("walk", "flicker")]
FREQUENCIES = np.geomspace(1e-10, 50.0, 3000)


def worst_direction(truth, numbers, settled, every_fix=False, dt=DT):
    """Largest eigenvalue of P_predicted^-1 P_true over chains of one to three integrals."""
    T = numbers.horizon
    found = [
        Chain(order, 1.0, settled).errors(
            truth, numbers.model, dt, (0.1 * T, T, 10.0 * T), believed_sd=numbers.initial_sd,
            every_fix=every_fix,
        ).worst()
        for order in (1, 2, 3)
    ]  # fmt: skip
    return max(each.max() for each in found)


@pytest.mark.parametrize("name", TRUTHS)
@pytest.mark.parametrize("horizon", [1.0, 10.0, 60.0, 600.0])
def test_no_direction_of_any_chain_is_too_optimistic_with_a_walk(name, horizon):
    numbers = gmwm.bound(TRUTHS[name], "N+K", horizon)
    assert worst_direction(TRUTHS[name], numbers, 0.0) < WORST
    assert worst_direction(TRUTHS[name], numbers, 60.0, every_fix=True) < WORST


@pytest.mark.parametrize(
    ("name", "form", "tau"),
    [(name, "N+GM", tau) for name in STATIONARY for tau in (None, 30.0)]
    + [(name, "N+K+GM", None) for name in TRUTHS],
)
def test_no_direction_is_too_optimistic_with_a_gauss_markov_process(name, form, tau):
    numbers = gmwm.bound(TRUTHS[name], form, 60.0, tau=tau)
    assert form != "N+GM" or numbers.initial_sd == 0.0
    assert worst_direction(TRUTHS[name], numbers, 60.0, every_fix=True) < WORST
    if tau is not None:
        assert numbers.tau == (tau,)


def test_a_horizon_within_the_low_pass_is_warned_of():
    sensor = gmwm.LowPassNoise(1e-3, 10.0, 2.0, 0.7071) + GaussMarkov(1e-4, 60.0)
    usual = gmwm.bound(sensor)
    for horizon, most, warned in ((0.05, 3000.0, True), (0.9, 1.7, True), (1.0, 1.4, False)):
        found = gmwm.bound(sensor, horizon=horizon)
        assert most / 1.2 < found.K / usual.K < most
        relative = gmwm.reduce(sensor, keyframe=horizon)
        for numbers in (found, relative):
            own = [each for each in numbers.notices if each.code == "short-horizon"]
            assert [(n.severity, n.values) for n in own] == [
                ("warning", {"horizon": horizon})
            ] * warned


def test_one_correlation_time_for_all_axes_is_the_one_that_costs_least():
    truths = {f"gyro_{i}": TRUTHS[name] for i, name in enumerate(("one", "two", "three"))}
    own = gmwm.bound(truths, "N+GM")
    shared = gmwm.bound(truths, "N+GM", tau="shared")
    (tau,) = {each.tau[0] for each in shared.values()}
    for name, each in shared.items():
        assert worst_direction(truths[name], each, 60.0, every_fix=True) < WORST
        # N and sigma are found anew: a wider sigma alone costs far more.
        other = own[name]
        wide = other.sigma[0] * np.sqrt(max(tau / other.tau[0], other.tau[0] / tau))
        wider = replace(other, model=WhiteNoise(other.N) + GaussMarkov(float(wide), tau))
        (check,) = gmwm.certify(truths[name], wider, outages=(60.0,)).of("free")
        assert check.nees < each.nees[60.0]

    def cost(tau):
        found = gmwm.bound(truths, "N+GM", tau=tau)
        problems = (
            Problem((RequiredSpectrum.of(truth, DT, 60.0),), 60.0) for truth in truths.values()
        )
        pairs = zip(problems, found.values(), strict=True)
        return sum(problem.cost(term) for problem, each in pairs for term in each.model.terms)

    assert cost(tau) < min(cost(0.8 * tau), cost(1.25 * tau))


@pytest.mark.parametrize("form", ["N+K", "N+K+GM"])
@pytest.mark.parametrize("name", TRUTHS)
def test_spectra_are_dominated_at_every_frequency(name, form):
    truth = TRUTHS[name]
    numbers = gmwm.bound(truth, form, 60.0)
    ratio = numbers.model.psd(FREQUENCIES, DT) / truth.psd(FREQUENCIES, DT)
    assert np.min(ratio) > 1.0 - 1e-6
    assert truth.white_density() <= numbers.N**2
    assert truth.params.get("K", 0.0) <= numbers.K


def test_a_smaller_bound_does_not_dominate():
    """Every number counts: a little less of one, and the spectrum sticks out."""
    for form in ("N+K", "N+GM", "N+K+GM"):
        numbers = gmwm.bound(TRUTHS["two"], form, 60.0)
        for key, value in numbers.model.params.items():
            less = numbers.model.with_params({key: 0.97 * value})
            ratio = less.psd(FREQUENCIES, DT) / TRUTHS["two"].psd(FREQUENCIES, DT)
            assert np.min(ratio) < 1.0 - 1e-3, (form, key)


def test_no_other_walk_that_dominates_is_smaller_over_the_horizon():
    """Against a search of another kind: K for each N on a grid."""
    truth, horizon = TRUTHS["three"], 60.0
    found = gmwm.bound(truth, "N+K", horizon)
    f = np.geomspace(1e-9, 50.0, 4000)
    tau = np.rint(np.geomspace(6.0, 60.0, 12) / DT) * DT

    def cost(model):
        return np.mean(model.haar_variance(tau, DT) / truth.haar_variance(tau, DT))

    need = truth.psd(f, DT)
    for N in np.geomspace(1e-4, 1e-2, 60):
        if need[-1] > N**2:
            continue
        K = np.sqrt(max(np.max((need - N**2) / RandomWalk(1.0).psd(f, DT)), 0.0))
        assert cost(WhiteNoise(N) + RandomWalk(K)) > 0.999 * cost(found.model)


@pytest.mark.parametrize("form", ["N+K", "N+K+GM"])
def test_a_model_that_has_the_form_comes_back(form):
    truth = WhiteNoise(1e-3) + RandomWalk(1e-5)
    found = gmwm.bound(truth, form, 30.0)
    assert pytest.approx(1e-3, rel=1e-5) == found.N
    assert pytest.approx(1e-5, rel=1e-5) == found.K
    assert found.tightness[30.0] == pytest.approx(1.0, abs=1e-3)
    gauss = gmwm.bound(ONE, "N+GM", 30.0)
    assert (gauss.N, gauss.sigma[0], gauss.tau[0]) == pytest.approx((8e-5, 4e-5, 60.0), rel=1e-4)


def test_a_term_that_hardly_matters_is_dominated_all_the_same():
    """Within the tolerance of a general solver, 1e-7, its walk was left out."""
    truth = TRUTHS["far"]
    numbers = gmwm.bound(truth, "N+K+GM", 60.0)
    assert numbers.K > 0.0
    ratio = numbers.model.psd(FREQUENCIES, DT) / truth.psd(FREQUENCIES, DT)
    assert np.min(ratio) > 1.0 - 1e-9


def test_white_noise_alone_needs_no_walk():
    found = gmwm.bound(WhiteNoise(1e-3), "N+K", 60.0)
    assert pytest.approx(1e-3) == found.N
    assert found.K < 1e-12
    assert found.nees[60.0] == pytest.approx(1.0)


def test_time_constants_in_a_range_meet_in_the_geometric_mean():
    """For tau somewhere in [t1, t2] at one sigma: sqrt(t1 t2), and variance times sqrt(t2/t1)."""
    t1, t2 = 30.0, 120.0
    several = {
        f"gyro_{axis}": WhiteNoise(1e-9) + GaussMarkov(1e-4, tau)
        for axis, tau in zip("xyz", (t1, 60.0, t2), strict=True)
    }
    found = gmwm.bound(several, "N+GM", 60.0, shared=True)["gyro_x"]
    # White noise takes a little of it.
    assert found.tau[0] == pytest.approx(np.sqrt(t1 * t2), rel=0.05)
    assert found.sigma[0] ** 2 == pytest.approx(1e-8 * np.sqrt(t2 / t1), rel=0.05)


def test_the_full_navigation_filter_is_not_too_optimistic_either():
    truth = {"gyro": TRUTHS["two"], "accel": WhiteNoise(1e-3) + GaussMarkov(3e-3, 40.0)}
    by_axis = {f"{kind}_{axis}": model for kind, model in truth.items() for axis in "xyz"}
    numbers = gmwm.bound(by_axis, "N+K", 60.0, dt=0.1)
    flight = fixed_wing_loiter(duration=250.0, dt=0.1)
    outages = (Outage(120.0, 60.0), Outage(240.0, 10.0))
    scenario = Scenario(flight, gnss(flight), outages, interval=10.0, step=0.5, second_order=False)
    believed = SensorModels.of(numbers)
    analysis = covariance_analysis(scenario, SensorModels.of(truth), believed)
    ratio = np.linalg.solve(analysis.predicted, analysis.actual)
    assert np.max(np.linalg.eigvals(ratio).real) < WORST
    at = analysis.index(180.0)
    assert np.hypot(*analysis.predicted_sd[at, :2]) < 1.3 * np.hypot(*analysis.sd[at, :2])


@pytest.mark.parametrize("form", ["N+K", "N+GM", "N+K+GM"])
def test_a_process_far_slower_than_the_horizon_is_not_taken_for_a_walk(form):
    """Its variance is the start; above its corner it looks like a walk for many decades."""
    truth = WhiteNoise(1e-4) + GaussMarkov(1e-2, 1e9)
    numbers = gmwm.bound(truth, form, 60.0)
    start = np.hypot(numbers.initial_sd, sum(numbers.sigma))
    assert 1e-2 <= start < 1.5e-2
    assert worst_direction(truth, numbers, 60.0, every_fix=True) < WORST


def test_a_spectrum_alone_is_dominated_without_a_prediction():
    class Pink(gmwm.Process):
        level: float = gmwm.parameter("u", role="scale")

        def psd(self, f, dt):
            return self.level**2 * dt * (2.0 * f * dt) ** -0.5

    truth = WhiteNoise(1e-4) + Pink(1e-4)
    numbers = gmwm.bound(truth, "N+K", 60.0)
    ratio = numbers.model.psd(FREQUENCIES, DT) / truth.psd(FREQUENCIES, DT)
    assert np.min(ratio) > 1.0 - 1e-5
    assert np.isnan(numbers.nees[60.0])
    codes = [notice.code for notice in numbers.notices]
    assert codes == ["more-than-white-noise", "more-than-random-walk", "not-predicted"]


# ---- The length of the record does not matter ----


def test_numbers_do_not_shrink_as_the_record_grows():
    """A random walk that is bounded from data does: to a half for each four times of length."""
    found = []
    for hours, seed in ((1, 3), (16, 4)):
        series = ONE.simulate(hours * 3600, 1.0, seed)
        fit = gmwm.fit(WhiteNoise() + GaussMarkov(), series, 1.0)
        found.append(gmwm.bound(fit, "N+K", 60.0).K)
    right = gmwm.bound(ONE, "N+K", 60.0, dt=1.0).K
    # sigma^2/tau of one hour has a standard error of some 25 %, so K half of that.
    assert found[0] == pytest.approx(right, rel=0.4)
    assert found[1] == pytest.approx(right, rel=0.1)


# ---- A whole confidence region ----


def test_what_is_left_out_and_is_not_small_is_a_warning():
    # A ramp that outgrows its constant, and quantization of an angle without white noise above it.
    ramp = WhiteNoise(1e-4) + gmwm.RateRamp(1e-5)
    coarse = Model((QuantizationNoise(1e-2), RandomWalk(1e-6)))
    # The angle by this line is back where it was after the horizon, and after ten.
    line = ONE + Sinusoid(3e-4, 1.0 / 60.0)
    large = [("gyro_x", ramp), ("gyro_x", coarse), ("gyro_z", line)]
    for name, truth in [*large, ("gyro_x", ONE), ("gyro_x", QuantizationNoise(1e-6) + ONE)]:
        found = gmwm.bound({name: truth})[name]
        warned = [n for n in found.notices if n.code == "optimistic"]
        times = (6.0, 18.0, 60.0, 180.0, 600.0)
        chain = Chain.usual("gyro" if name == "gyro_x" else "")
        # Of a heading, what it gains counts: half a degree at the start would hide it.
        chain = replace(chain, is_gained=name == "gyro_z")
        errors = chain.errors(truth, found.model, DT, times, believed_sd=found.initial_sd)
        worst = int(np.argmax(errors.nees()))
        assert len(warned) == (errors.nees()[worst] > 1.05) == ((name, truth) in large)
        for notice in warned:
            assert notice.values["time"] == pytest.approx(times[worst])
            assert notice.values["nees"] == pytest.approx(errors.nees()[worst])
    assert max(gmwm.bound({"gyro_z": line})["gyro_z"].nees.values()) < 1.0


SLOW = GaussMarkov(1e-4, 120.0)


@pytest.mark.parametrize(
    ("name", "peak", "form", "horizon", "time"),
    [
        ("gyro_z", Resonance(5e-3, 12.0, 0.02), "N+K", 10.0, 0.1),
        ("gyro_z", Resonance(1e-3, 0.5, 0.05), "N+GM", 600.0, 6.0),
        ("gyro_x", Resonance(1e-3, 0.5, 0.05), "N+GM", 600.0, 0.0),  # with fixes
    ],
)
def test_a_peak_that_is_gone_at_the_horizon_is_there_before(name, peak, form, horizon, time):
    truth = WhiteNoise(1e-4) + peak + SLOW
    found = gmwm.bound({name: truth}, form, horizon)[name]
    (notice,) = (n for n in found.notices if n.code == "optimistic")
    assert notice.values["time"] == pytest.approx(time)
    chain = replace(Chain.usual("gyro" if name == "gyro_x" else ""), is_gained=name == "gyro_z")
    errors = chain.errors(truth, found.model, DT, [time or horizon], every_fix=time == 0.0,
                          believed_sd=found.initial_sd)  # fmt: skip
    nees = errors.nees()[:-1] if time == 0.0 else errors.nees()
    assert 1.05 < notice.values["nees"] == pytest.approx(np.max(nees))
    without = gmwm.bound({name: WhiteNoise(1e-4) + SLOW}, form, horizon)[name]
    assert not any(n.code == "optimistic" for n in without.notices)


@pytest.mark.parametrize("name", ["gyro_x", "accel_x"])
def test_steps_that_a_tilt_hides_show_between_keyframes(name):
    """A file for a second is for relative poses, in which two errors of quantization are."""
    truth = QuantizationNoise(3e-5) + WhiteNoise(1e-5) + GaussMarkov(2e-5, 100.0)
    found = gmwm.bound({name: truth}, horizon=1.0)
    (notice,) = (n for n in found.notices if n.code == "optimistic")
    certified = gmwm.certify({name: truth}, found, keyframe=1.0).of("keyframes")[0]
    assert 1.3 < certified.nees == pytest.approx(notice.values["nees"], rel=1e-6)
    assert "between keyframes every 1 s" in str(notice)
    fine = QuantizationNoise(1e-6) + WhiteNoise(1e-5) + GaussMarkov(2e-5, 100.0)
    assert not any(n.code == "optimistic" for n in gmwm.bound({name: fine}, horizon=1.0).notices)


@pytest.mark.parametrize("frequency", [6.0, 12.0])
def test_a_peak_counts_alike_at_every_rate(frequency):
    """At 50 Hz a quarter of the band ends at 6.25 Hz, below ten over the horizon."""
    truth = WhiteNoise(1e-4) + Resonance(5e-3, frequency, 0.02) + SLOW
    found = [gmwm.bound(truth, horizon=1.0, dt=dt).N for dt in (0.002, 0.01, 0.02, 0.03)]
    assert found == pytest.approx([found[0]] * 4, rel=0.05)
    line = WhiteNoise(1e-4) + Sinusoid(1e-4, 8.0)
    for dt in (0.002, 0.02):
        (notice,) = (n for n in gmwm.bound(line, horizon=1.0, dt=dt).notices
                     if n.code == "line-left-out")  # fmt: skip
        assert notice.severity == "warning"


@pytest.mark.parametrize("solve", [gmwm.bound, gmwm.reduce])
def test_white_noise_says_what_else_it_stands_for(solve):
    """A process that is over within the horizon is white to it, low-pass noise always."""
    given = {} if solve is gmwm.reduce else {"horizon": 60.0}
    fast = GaussMarkov(1e-3, 0.1)
    truth = Model((WhiteNoise(2e-4), fast, GaussMarkov(1e-4, 3000.0)))
    found = solve({"accel_x": truth}, "N+K", **given)["accel_x"]
    (notice,) = (n for n in found.notices if n.code == "more-than-white-noise")
    white, other = (each.psd(np.array([0.1]), DT)[0] for each in (WhiteNoise(2e-4), fast))
    assert pytest.approx(white + other, rel=0.05) == found.N**2
    assert notice.values == pytest.approx({"Gauss-Markov 1": other / (white + other)}, rel=0.05)
    assert f"{found.N / 2e-4:.3g} times that of the model's white noise" in str(notice)
    plain = solve({"accel_x": WhiteNoise(2e-4) + GaussMarkov(1e-4, 3000.0)}, "N+K", **given)
    assert not any(n.code == "more-than-white-noise" for n in plain.notices)
    alone = solve({"accel_x": Model((fast, GaussMarkov(1e-4, 3000.0)))}, "N+K", **given)
    (notice,) = (n for n in alone.notices if n.code == "more-than-white-noise")
    assert "the model has no white noise: N covers Gauss-Markov 1" in str(notice)


@pytest.mark.parametrize("solve", [gmwm.bound, gmwm.reduce])
def test_a_random_walk_says_what_else_it_stands_for(solve):
    given = {} if solve is gmwm.reduce else {"horizon": 60.0}

    def why(truth):
        found = solve({"accel_x": truth}, "N+K", **given)["accel_x"]
        return found, [n for n in found.notices if n.code == "more-than-random-walk"]

    drift = GaussMarkov(1e-3, 50.0)
    found, (notice,) = why(WhiteNoise(2e-4) + RandomWalk(1e-5) + drift)
    assert f"K is {found.K / 1e-5:.3g} times that of the model's random walk" in str(notice)
    assert notice.values.keys() == {"Gauss-Markov"}
    assert 0.5 < notice.values["Gauss-Markov"] < 1.0
    _, (notice,) = why(WhiteNoise(2e-4) + drift)
    assert "the model has no random walk: K covers Gauss-Markov (" in str(notice)
    assert not why(WhiteNoise(2e-4) + RandomWalk(1e-5))[1]


def test_an_axis_does_not_explain_what_another_needs():
    models = {"accel_x": WhiteNoise(1e-3) + SLOW, "accel_y": WhiteNoise(5e-3) + SLOW}
    numbers = gmwm.bound(models, shared=True)
    assert pytest.approx(5e-3, rel=0.05) == numbers["accel_x"].N
    assert not any(n.code == "more-than-white-noise" for n in numbers.notices)
    models = {name: WhiteNoise(1e-4) + GaussMarkov(sigma, 20.0)
              for name, sigma in (("accel_x", 3e-4), ("accel_y", 3.1e-4))}  # fmt: skip
    numbers = gmwm.bound(models, shared=True)
    assert {n.where for n in numbers.notices if n.code == "more-than-random-walk"} == {"accel_y"}


@pytest.mark.parametrize("horizon", [1.0, 10.0, 60.0])
@pytest.mark.parametrize("name", ["gyro_z", "heading"])
def test_a_start_of_half_a_degree_hides_no_quantization_of_a_heading(name, horizon):
    """The angle gained has N^2 T and two quantization errors, Q^2 each."""
    N, Q, dt = 5.8e-7, 4.85e-6, 0.005
    truth = WhiteNoise(N) + QuantizationNoise(Q)
    found = gmwm.bound({name: truth}, "N+K", horizon, dt=dt)[name]
    (notice,) = (n for n in found.notices if n.code == "optimistic")
    for time, nees in found.nees.items():
        assert nees == pytest.approx(1.0 + 2.0 * Q**2 / (N**2 * time), rel=1e-3)
    assert notice.values["time"] == 0.1 * horizon
    assert notice.values["nees"] == pytest.approx(1.0 + 2.0 * Q**2 / (N**2 * 0.1 * horizon), 1e-3)
    shown = gmwm.certify({name: truth}, {name: found}, outages=(horizon,), dt=dt).of("free")[0]
    assert shown.nees == pytest.approx(found.nees[horizon], rel=1e-6)
    steps = np.random.default_rng(5).uniform(-0.5, 0.5, (2, 4000)) * np.sqrt(12.0) * Q
    gained = np.mean((steps[1] - steps[0]) ** 2) + N**2 * horizon
    assert found.nees[horizon] == pytest.approx(gained / (N**2 * horizon), rel=0.08)


@pytest.fixture(scope="module")
def fitted():
    return gmwm.fit(WhiteNoise() + GaussMarkov(), ONE.simulate(7200, 1.0, 11), 1.0)


@pytest.mark.parametrize("form", ["N+K", "N+GM"])
def test_models_of_the_region_are_dominated(fitted, form):
    numbers = gmwm.bound(fitted, form, 60.0, level=0.95)
    plain = gmwm.bound(fitted, form, 60.0)
    region = ParameterRegion.of(fitted, 0.95)
    f = np.geomspace(1e-8, 0.5, 500)
    outside = 0
    for point in region.draws(200, np.random.default_rng(99)):
        model = region.model_at(point)
        assert np.all(numbers.model.psd(f, 1.0) > model.psd(f, 1.0))
        outside += np.any(plain.model.psd(f, 1.0) < model.psd(f, 1.0))
    assert outside > 50
    assert 1.0 < numbers.tightness[60.0] / plain.tightness[60.0] < 2.0


def test_standard_errors_are_those_of_the_fit_by_the_chain_rule(fitted):
    """Against bounds of models that differ by a step along each independent error."""
    found = gmwm.bound(fitted, "N+K", 60.0)
    values, vectors = np.linalg.eigh(fitted.covariance)
    total = {"N": 0.0, "K": 0.0}
    for column in (vectors * np.sqrt(values)).T:
        ends = []
        for side in (-0.01, 0.01):
            steps = zip(fitted.keys, side * column, strict=True)
            model = fitted.model.with_params({k: fitted.params[k] + step for k, step in steps})
            ends.append(gmwm.bound(model, "N+K", 60.0, dt=1.0).model.params)
        for key in total:
            total[key] += ((ends[1][key] - ends[0][key]) / 0.02) ** 2
    assert set(found.stderr) == set(total)
    for key, square in total.items():
        assert found.stderr[key] == pytest.approx(np.sqrt(square), rel=0.03), key


def test_standard_errors_of_parameters_that_are_decades_apart():
    # Variances from 1e-11 (N) to 1e5 (tau): rounding of the largest is no error of the least.
    truth = TABLE_6.models["gyro_x"]
    values, step = np.array(list(truth.params.values())), 1e-3
    sizes = values * np.array([0.005, 0.02, 0.04, 0.02, 0.08, 0.2, 0.4])
    root = np.linalg.cholesky(np.full((7, 7), 0.5) + 0.5 * np.eye(7)) * sizes[:, None]
    problem = Problem((RequiredSpectrum.of(truth, 0.1, 60.0),), 60.0)
    known = Estimated(truth, tuple(truth.params), root @ root.T)
    found = standard_errors(problem, gmwm.bound(truth, dt=0.1).model, known)
    total = {"N": 0.0, "K": 0.0}
    for column in root.T:
        ends = [
            gmwm.bound(truth.with_params(dict(zip(truth.params, moved, strict=True))), dt=0.1)
            for moved in (values + step * column, values - step * column)
        ]
        for key in total:
            total[key] += ((getattr(ends[0], key) - getattr(ends[1], key)) / (2.0 * step)) ** 2
    for key, square in total.items():
        assert found[key] == pytest.approx(np.sqrt(square), rel=0.03), key


def test_standard_errors_of_shared_axes_and_of_none(fitted):
    one = gmwm.bound(fitted)
    both = gmwm.bound({"gyro_x": fitted, "gyro_y": fitted}, shared=True)["gyro_x"]
    assert pytest.approx(one.K, rel=1e-12) == both.K
    assert both.stderr["K"] == pytest.approx(one.stderr["K"], rel=1e-6)
    assert not gmwm.bound(ONE).stderr
    assert not gmwm.bound(fitted, level=0.95).stderr
    assert not gmwm.bound(fitted, "N+GM").stderr
    assert gmwm.AxisFilterNumbers.from_dict(one.to_dict()) == one
    assert f", +-{1.96 * one.stderr['K']:.2g} (95 %)" in one.text("si")


def test_the_bias_at_switch_on_is_missed_where_none_is_given(fitted):
    def missed(numbers):
        return any(notice.code == "turn-on-left-out" for notice in numbers.notices)

    assert missed(gmwm.bound(fitted))
    assert missed(gmwm.bound({"gyro_x": fitted}))
    assert not missed(gmwm.bound(fitted, bias_sd=1e-3))
    # A model is the truth as it is given.
    assert not missed(gmwm.bound(ONE))
    assert "turn-on bias" in str(gmwm.bound(fitted, "N+GM"))


def test_the_region_reaches_to_the_joint_interval(fitted):
    region = ParameterRegion.of(fitted, 0.95)
    points = region.draws(4000, np.random.default_rng(1))
    values = np.array([list(region.model_at(p).params.values()) for p in points])
    wide, narrow = fitted.interval(0.99), fitted.interval(0.95)
    for i, key in enumerate(region.keys):
        assert values[:, i].min() < narrow[key][0]
        assert values[:, i].max() > narrow[key][1]
        assert values[:, i].max() < 1.1 * wide[key][1]


# ---- What no walk stands for ----


def notices_of(*terms, horizon=60.0):
    found = gmwm.bound(ONE + Model(terms), "N+K", horizon)
    return found, {notice.code: notice for notice in found.notices}


def test_quantization_lines_and_fast_peaks_are_left_out_with_a_notice():
    plain = gmwm.bound(ONE, "N+K", 60.0)
    for term, code in (
        (QuantizationNoise(1e-3), "fast-peak-left-out"),
        (Sinusoid(0.01, 7.0), "line-left-out"),
        (gmwm.MA([-0.999], 1e-4), "fast-peak-left-out"),
    ):
        found, notices = notices_of(term)
        assert pytest.approx(plain.N, rel=0.01) == found.N
        assert pytest.approx(plain.K, rel=0.01) == found.K
        assert notices[code].severity == "note"


def test_a_resonance_counts_by_its_low_frequency_density():
    resonance = Resonance(0.02, 15.0, 0.2)
    found, notices = notices_of(resonance)
    foot = float(resonance.psd(np.array([1e-3]), DT)[0])
    assert notices["fast-peak-left-out"].values["density"] == pytest.approx(foot, rel=1e-3)
    assert notices["fast-peak-left-out"].values["variance"] == pytest.approx(4e-4, rel=0.02)
    assert pytest.approx(8e-5**2 + foot, rel=0.05) == found.N**2


def test_a_slow_resonance_and_a_slow_line_are_not_passed_over():
    slow = Resonance(1e-3, 0.01, 0.003)
    found = gmwm.bound(ONE + slow, "N+K", 60.0)
    # No form is better; what this one costs is there to read all the same.
    notice, why = found.notices
    assert (notice.code, notice.hint) == ("loose-form", "")
    assert (why.code, list(why.values)) == ("more-than-random-walk", ["resonance"])
    assert notice.values["tightness"] == found.tightness[60.0] > 1.2
    assert notice.values["with_state"] > 1.2
    tightest = gmwm.bound(ONE + slow, "N+K+GM", 60.0)
    (notice,) = (n for n in tightest.notices if n.code == "loose-form")
    assert notice.values["tightness"] == tightest.tightness[60.0] > 1.2
    assert "N+K+GM" not in str(notice)  # the form itself is no advice
    f = np.geomspace(1e-8, 50.0, 3000)
    assert np.min(found.model.psd(f, DT) / (ONE + slow).psd(f, DT)) > 1.0 - 1e-4
    _, notices = notices_of(Sinusoid(1e-4, 1e-3))
    assert notices["line-left-out"].severity == "warning"


def test_a_ramp_is_a_constant_of_what_it_does_over_the_horizon():
    plain = gmwm.bound(ONE, "N+K", 60.0)
    found, notices = notices_of(gmwm.RateRamp(-1e-5))
    assert notices["ramp-as-constant"].values == {"R": -1e-5, "sd": pytest.approx(6e-4)}
    assert found.initial_sd == pytest.approx(np.hypot(plain.initial_sd, 6e-4))


def test_a_turn_on_bias_is_part_of_the_start():
    plain = gmwm.bound(ONE, "N+K", 60.0)
    found = gmwm.bound(ONE, "N+K", 60.0, bias_sd=1e-3)
    assert found.initial_sd == pytest.approx(np.hypot(plain.initial_sd, 1e-3))
    assert plain.initial_sd == pytest.approx(np.sqrt(2.0) * 4e-5, rel=0.05)
    assert gmwm.bound(ONE, "N+GM", 60.0, bias_sd=1e-3).initial_sd == 1e-3
    each = gmwm.bound({"gyro_x": ONE, "accel_x": ONE}, bias_sd={"gyro": 1e-3})
    assert each["gyro_x"].initial_sd > each["accel_x"].initial_sd


# ---- Sensors ----


def test_axes_may_share_their_numbers():
    models = {"gyro_x": ONE, "gyro_y": TRUTHS["two"], "accel_x": TRUTHS["three"]}
    own, shared = gmwm.bound(models), gmwm.bound(models, shared=True)
    assert isinstance(own, gmwm.FilterNumbers)
    assert list(shared) == list(models)
    assert shared["gyro_x"].model == shared["gyro_y"].model
    assert shared["accel_x"].model == own["accel_x"].model
    assert own["gyro_x"].K < own["gyro_y"].K
    f = FREQUENCIES
    for name in ("gyro_x", "gyro_y"):
        ratio = shared[name].model.psd(f, DT) / models[name].psd(f, DT)
        assert np.min(ratio) > 1.0 - 1e-6
    assert shared["gyro_x"].nees[60.0] < own["gyro_x"].nees[60.0]


def test_a_calibration_gives_numbers_by_channel():
    n = 5000
    recording = gmwm.Recording.from_arrays(
        {"gyro_x": ONE.simulate(n, DT, 1), "accel_x": TRUTHS["far"].simulate(n, DT, 2)},
        100.0,
        {"gyro": "rad/s", "accel": "m/s^2"},
    )
    calibration = gmwm.calibrate(recording, WhiteNoise(), screening=())
    found = gmwm.bound(calibration)
    assert (found.rate, found.duration) == (100.0, 50.0)
    assert [each.quantity for each in found.values()] == ["gyro", "accel"]
    single = gmwm.bound(calibration["gyro_x"])
    assert isinstance(single, gmwm.AxisFilterNumbers)
    assert single == found["gyro_x"]


class Drawn(gmwm.Process):
    def draw(self, n, dt, rng):
        return rng.standard_normal(n)


@pytest.mark.parametrize(
    ("source", "options", "message"),
    [
        (ONE, {"form": "N"}, r"form = 'N': choose from N\+K, N\+GM, N\+K\+GM"),
        (ONE, {"form": "N+2GM"}, "choose from"),
        (ONE, {"horizon": 0.0}, "horizon = 0.0"),
        (ONE, {"horizon": 0.015}, "two sampling intervals"),
        (ONE, {"horizon": "60"}, "horizon = '60'"),
        (ONE, {"level": 0.9}, "a model has no confidence region"),
        (ONE, {"bias_sd": -1.0}, "bias_sd = -1.0"),
        (ONE, {"dt": -1.0}, "dt = -1.0"),
        (WhiteNoise(), {}, r"free parameters \(N\)"),
        (Model((QuantizationNoise(1e-3),)), {}, "no term that white noise"),
        (Drawn(), {}, "only be simulated"),
        (gmwm.ARIMA(d=2, sigma2=1.0), {}, "no form covers it"),
        (TRUTHS["walk"], {"form": "N+GM"}, "cannot cover a random walk"),
        (TRUTHS["flicker"], {"form": "N+GM"}, "cannot cover a random walk"),
        ({}, {}, "has no error model"),
        ("calibration.json", {}, "has no error model"),
        ({"gyro_x": 3.0}, {}, "gyro_x: 3.0 is not an error model"),
    ],
)
def test_what_cannot_be_used(source, options, message):
    with pytest.raises(gmwm.InputError, match=message):
        gmwm.bound(source, **options)


def test_what_is_left_out_is_reported_with_its_unit():
    model = WhiteNoise(1e-3) + Sinusoid(2e-2, 0.02)
    for name, shown in (("accel_x", "amplitude 2.04 mg"), ("gyro_x", "amplitude 1.15 deg/s")):
        found = gmwm.bound({name: model}).notices
        (notice,) = [each for each in found if each.code == "line-left-out"]
        assert shown in notice.text
        assert notice.values["amplitude"] == 2e-2
