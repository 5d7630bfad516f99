"""Reductions: consistent where they are asked to be, whatever the length of the record."""

import numpy as np
import pytest
from scipy.optimize import minimize

import gmwm
from error_models import DT, TRUTHS
from gmwm import GaussMarkov, InputError, Model, QuantizationNoise, RandomWalk, WhiteNoise
from gmwm.filter_numbers import Chain, tuning
from gmwm.filter_numbers.axes import SensorAxes
from gmwm.ins import Outage, Scenario, SensorModels, covariance_analysis, fixed_wing_loiter, gnss
from gmwm.study.navigation import TABLE_6
from marks import slow

ONE = TRUTHS["one"]
OUTAGES = (10.0, 30.0, 60.0)
SENSORS = {
    "one": ONE,
    "three": TRUTHS["three"],
    "walk and one": WhiteNoise(7e-4) + RandomWalk(1.4e-5) + GaussMarkov(1.6e-4, 40.0),
    "other three": WhiteNoise(3e-4)
    + GaussMarkov(5e-4, 1.0)
    + GaussMarkov(2e-4, 40.0)
    + GaussMarkov(2e-4, 700.0),
}


FORMS = ("N+K", "N+GM", "N+2GM", "N+K+GM")
ALL = [
    *(("gyro_x", name, form) for name in SENSORS for form in FORMS),
    *(("accel_x", name, form) for name in SENSORS for form in FORMS[:3]),
]
CASES = [
    # Each form of one sensor or two, and each sensor in one: the diagonals of a board.
    *(case if (FORMS.index(case[2]) + [*SENSORS].index(case[1])) % 4 == 0 else slow(*case)
      for case in ALL),
    # The hardest: an even NEES is not what the score alone gives.
    *((("gyro_x", "two", "N+K")), ("gyro_z", "walk", "N+K")),
]  # fmt: skip


@pytest.mark.parametrize(("channel", "name", "form"), CASES)
def test_it_is_consistent_at_the_outages(channel, name, form):
    truth = SENSORS.get(name) or TRUTHS[name]
    found = gmwm.reduce({channel: truth}, form)[channel]
    assert list(found.nees) == [*OUTAGES, 600.0]
    for time in OUTAGES:
        assert 0.9 < found.nees[time] < 1.1
        assert 0.9 < found.tightness[time] < 1.15


COARSE = QuantizationNoise(1e-4) + WhiteNoise(1e-5) + GaussMarkov(2e-5, 50.0)


@pytest.mark.parametrize(
    ("truth", "form", "time"),
    [
        *(slow(COARSE, form, time) for form in ("N+K", "N+GM") for time in (10.0, 60.0)),
        (COARSE, "N+K", 1.0),
        slow(COARSE, "N+GM", 1.0),
        slow(TRUTHS["autoregressive"], "N+K", 1.0),
        (TRUTHS["flicker"], "N+GM", 10.0),
    ],
)
def test_an_absolute_fix_of_a_heading_hides_nothing(truth, form, time):
    """By fixes of half a degree alone, the angle gained since had a NEES of up to 76."""
    found = gmwm.reduce({"gyro_z": truth}, form, (time,))
    (check,) = gmwm.certify({"gyro_z": truth}, found, outages=(time,)).of("free")
    assert found["gyro_z"].nees[time] == pytest.approx(check.nees, rel=1e-6)
    assert 0.9 < check.nees < 1.1
    # Quantization is part of the truth here.
    assert not any(each.code == "fast-peak-left-out" for each in found.notices)


def test_where_no_numbers_of_the_form_are_consistent_they_say_so():
    """An angle whose error does not grow with the time is no white noise of a rate."""
    truth = {"gyro_z": QuantizationNoise(1e-2) + WhiteNoise(1e-5) + RandomWalk(1e-6)}
    found = gmwm.reduce(truth)["gyro_z"]
    notice = next(each for each in found.notices if each.code == "optimistic")
    assert (notice.severity, notice.values["time"]) == ("warning", 10.0)
    assert notice.values["nees"] == found.nees[10.0] > tuning.INCONSISTENT
    beyond = gmwm.reduce({"gyro_x": SENSORS["walk and one"]}, "N+GM")["gyro_x"]
    notice = next(each for each in beyond.notices if each.code == "optimistic")
    assert (notice.severity, notice.values["time"]) == ("note", 600.0)
    assert notice.values["nees"] == beyond.nees[600.0] > tuning.INCONSISTENT


@pytest.mark.parametrize("channel", ["gyro_x", "accel_x"])
@pytest.mark.parametrize("name", ["one", "three", "walk"])
def test_for_relative_poses_it_is_consistent_between_keyframes(name, channel):
    # Numbers for an outage of a second, after fixes of a metre, are none for keyframes.
    truth, nees = {channel: TRUTHS[name]}, []
    for options in ({"keyframe": 1.0}, {"outages": (1.0,)}):
        numbers = gmwm.reduce(truth, **options)
        checks = gmwm.certify(truth, numbers, outages=(1.0,), keyframe=1.0).of("keyframes")
        nees.append(checks[0].nees)
        assert numbers[channel].horizon == 1.0
    assert nees[0] == pytest.approx(1.0, abs=0.02)
    assert abs(nees[1] - 1.0) > abs(nees[0] - 1.0)


def test_a_search_of_another_kind_finds_little_more():
    truth = TRUTHS["two"]
    found = gmwm.reduce({"gyro_x": truth}, "N+GM")["gyro_x"]
    keys = list(found.model.params)
    values = np.array(list(found.model.params.values()))
    chain = Chain.usual("gyro")

    def cost(logs):
        model = found.model.with_params(dict(zip(keys, values * np.exp(logs), strict=True)))
        errors = chain.errors(truth, model, DT, OUTAGES, believed_sd=found.initial_sd)
        return float(np.sum(errors.score() + tuning.EVENNESS * np.log(errors.nees()) ** 2))

    simplex = np.vstack([np.zeros(3), 0.3 * np.eye(3)])
    options = {"initial_simplex": simplex, "maxfev": 100, "fatol": 1e-4, "xatol": 1e-2}
    again = minimize(cost, np.zeros(3), method="Nelder-Mead", options=options)
    assert cost(np.zeros(3)) - again.fun < 0.02


def test_axes_may_share_a_correlation_time():
    truths = {"gyro_z": SENSORS["walk and one"], "accel_x": ONE}
    outages = (5.0, 20.0)
    shared = gmwm.reduce(truths, "N+GM", tau="shared", outages=outages)
    assert len({each.tau for each in shared.values()}) == 1
    for each in shared.values():
        assert all(0.9 < each.nees[time] < 1.1 for time in outages)
    assert gmwm.reduce({"gyro_z": ONE}, "N+GM", tau=50.0)["gyro_z"].tau == (50.0,)


def test_a_model_that_has_the_form_comes_back():
    walk = WhiteNoise(1e-4) + RandomWalk(2e-5)
    found = gmwm.reduce({"gyro_x": walk}, "N+K")["gyro_x"]
    assert pytest.approx((1e-4, 2e-5), rel=0.05) == (found.N, found.K)
    assert found.nees[600.0] == pytest.approx(1.0, abs=0.05)


def test_numbers_do_not_depend_on_the_length_of_the_record():
    found = []
    for hours, seed in ((1, 3), (16, 4)):
        fit = gmwm.fit(WhiteNoise() + GaussMarkov(), ONE.simulate(hours * 3600, 1.0, seed), 1.0)
        found.append(gmwm.reduce({"gyro_x": fit.model}, dt=1.0)["gyro_x"].K)
    right = gmwm.reduce({"gyro_x": ONE}, dt=1.0)["gyro_x"].K
    assert right == pytest.approx(5.2e-6, rel=0.05)
    # The standard error of sigma^2/tau from one hour is some 25 %, of K half of that.
    assert found[0] == pytest.approx(right, rel=0.4)
    assert found[1] == pytest.approx(right, rel=0.1)


def test_the_navigation_filter_is_consistent_with_them():
    """On a flight, with all six axes at once."""
    models = SensorModels.of(TABLE_6).models
    numbers = gmwm.reduce(models, "N+K", shared=True, dt=0.1)
    flight = fixed_wing_loiter(duration=590.0, dt=0.1)
    outages = (Outage(120.0, 10.0), Outage(250.0, 30.0), Outage(400.0, 60.0))
    scenario = Scenario(flight, gnss(flight), outages, interval=100.0, step=0.5)
    believed = SensorModels.of(numbers)
    analysis = covariance_analysis(scenario, SensorModels.of(TABLE_6), believed)
    for outage in outages:
        assert 0.9 < analysis.nees()[analysis.index(outage.end)] < 1.1


def test_axes_may_share_their_numbers():
    models = {"gyro_x": ONE, "gyro_y": TRUTHS["two"], "accel_x": TRUTHS["three"]}
    steps = []
    shared = gmwm.reduce(models, shared=True, progress=lambda *each: steps.append(each))
    assert isinstance(shared, gmwm.FilterNumbers)
    assert list(shared) == list(models)
    assert shared["gyro_x"].model == shared["gyro_y"].model
    # Right for both together: too timid for the one, too bold for the other.
    assert shared["gyro_x"].nees[60.0] < 1.0 < shared["gyro_y"].nees[60.0]
    assert steps == [(0, 3, "gyro_x"), (2, 3, "accel_x"), (3, 3, "")]


def test_a_turn_on_bias_is_part_of_the_start():
    found = gmwm.reduce(ONE, bias_sd=1e-3)
    assert found.initial_sd == pytest.approx(np.hypot(1e-3, 4e-5), rel=0.02)
    assert gmwm.reduce(ONE, "N+GM", bias_sd=1e-3).initial_sd == 1e-3


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"form": "N"}, r"form = 'N': choose from N\+K, N\+GM, N\+K\+GM, N\+2GM"),
        ({"outages": ()}, "outages is empty: give at least one"),
        ({"outages": (10.0, -1.0)}, r"outages = -1\.0"),
        ({"outages": (10.0, 0.001)}, "outages = 0.001 s: give at least two sampling intervals"),
        ({"tau": 60.0}, r"tau needs a form with one Gauss-Markov process, not N\+K"),
        ({"form": "N+GM", "tau": "one"}, "tau = 'one'.*give a time in seconds, or 'shared'"),
        ({"form": "N+GM", "tau": -1.0}, r"tau = -1\.0: give a time in seconds, or 'shared'"),
        ({"keyframe": 0.001}, "keyframe = 0.001 s: give at least two sampling intervals"),
        ({"bias_sd": float("nan")}, "bias_sd = nan"),
    ],
)
def test_what_cannot_be_used(options, message):
    with pytest.raises(InputError, match=message):
        gmwm.reduce(ONE, **options)


def test_less_white_noise_than_the_model_has_is_reported():
    sensor = WhiteNoise(8e-5) + GaussMarkov(4e-5, 60.0)
    found = gmwm.reduce(sensor, "N+GM", outages=(10.0,))
    notice = next(each for each in found.notices if each.code == "less-white-noise")
    assert notice.values["share"] == pytest.approx(found.N / 8e-5)
    assert found.nees[10.0] == pytest.approx(1.0, abs=0.05)
    walk = gmwm.reduce(sensor, "N+K", outages=(10.0,))
    assert walk.N > 8e-5
    assert not any(each.code == "less-white-noise" for each in walk.notices)


@pytest.mark.parametrize("coarse", [slow(50.0), 200.0, slow(1000.0)])
def test_coarse_steps_of_a_heading_are_white_noise_to_one_outage(coarse):
    """An angle gained has two quantization errors: N^2 T of the filter has to be these 2 Q^2."""
    N = 1e-6
    truth = Model((WhiteNoise(N), QuantizationNoise(coarse * N), GaussMarkov(1e-7, 100.0)))
    found = gmwm.reduce({"gyro_z": truth}, outages=(60.0,))["gyro_z"]
    assert pytest.approx(np.sqrt(2.0 / 60.0) * coarse * N, rel=0.2) == found.N
    heading, gained = (
        chain.errors(truth, found.model, 0.01, [60.0], believed_sd=found.initial_sd).nees()[0]
        for chain in SensorAxes.of({"gyro_z": truth}, None, 0.0).axes[0].chain.judged
    )
    # Half a degree of a fix is no more than a coarse step: both cannot be right.
    assert abs(np.log(heading)) + abs(np.log(gained)) < (0.15 if coarse < 1000.0 else 0.8)
