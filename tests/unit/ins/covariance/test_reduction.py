"""Reduced models: consistent, not worse than what is read off, and the truth where they can be."""

import numpy as np
import pytest
from scipy.optimize import minimize

from gmwm import GaussMarkov, RandomWalk, WhiteNoise
from gmwm.errors import InputError
from gmwm.ins.covariance import reduction
from gmwm.ins.covariance.analysis import Course, covariance_analysis
from gmwm.ins.covariance.reduction import FORMS, loiter_with_outages, read_off, reduce
from gmwm.ins.filter.aiding import Outage, gnss
from gmwm.ins.imu.sensors import AXES, SensorModels
from gmwm.ins.simulation.trials import Scenario, Simulated, monte_carlo
from gmwm.ins.trajectory.missions import car_drive, fixed_wing_loiter

DT = 0.1
TRUTH = fixed_wing_loiter(duration=150.0, dt=DT)
SCENARIO = Scenario(
    TRUTH, gnss(TRUTH), (Outage(60.0, 10.0), Outage(120.0, 30.0)), interval=50.0, step=0.5
)
FULL = SensorModels.of(
    {
        "gyro": WhiteNoise(5e-5) + GaussMarkov(4e-4, 5.0) + GaussMarkov(1e-4, 300.0),
        "accel": WhiteNoise(1e-3) + GaussMarkov(3e-3, 3.0) + GaussMarkov(2e-3, 200.0),
    }
)
WALK = SensorModels.of(
    {"gyro": WhiteNoise(1e-5) + RandomWalk(2e-5), "accel": WhiteNoise(3e-4) + RandomWalk(3e-4)}
)


@pytest.fixture(scope="module", params=list(FORMS))
def found(request):
    return reduce(FULL, request.param, scenario=SCENARIO)


def score(course, believed):
    """What is to be least, from the public parts."""
    analysis = course.analyse(FULL, believed)
    each = analysis.score(slice(0, 6))
    return sum(each[analysis.index(outage.end)] for outage in SCENARIO.outages)


def scaled(models, form, factors):
    """Models with the parameters of each kind times their factors."""
    changed = {}
    for axis, model in models.models.items():
        each = (
            factors[: len(FORMS[form])] if axis.startswith("gyro") else factors[-len(FORMS[form]) :]
        )
        values = {
            name: model.params[name] * factor
            for name, factor in zip(FORMS[form], each, strict=True)
        }
        changed[axis] = model.with_params(values)
    return SensorModels(changed, models.bias_sd)


def test_errors_are_those_of_a_covariance_analysis(found):
    assert [row.duration for row in found.errors] == [10.0, 30.0]
    full = covariance_analysis(SCENARIO, FULL, FULL)
    reduced = covariance_analysis(SCENARIO, FULL, found.models)
    read = covariance_analysis(SCENARIO, FULL, read_off(FULL, found.form, 30.0, DT))
    for row, outage in zip(found.errors, SCENARIO.outages, strict=True):
        at = full.index(outage.end)
        for value, sd in (
            (row.full, full.sd),
            (row.reduced, reduced.sd),
            (row.reduced_predicted, reduced.predicted_sd),
            (row.read_off, read.sd),
            (row.read_off_predicted, read.predicted_sd),
        ):
            assert value == pytest.approx(np.hypot(*sd[at, :2]), rel=1e-9)
        assert row.nees == pytest.approx(reduced.nees()[at], rel=1e-9)


def test_the_reduced_model_is_consistent_and_not_worse_than_what_is_read_off(found):
    assert np.mean([row.nees for row in found.errors]) == pytest.approx(1.0, abs=0.1)
    for row in found.errors:
        # One walk cannot be right for both lengths at once.
        assert row.nees == pytest.approx(1.0, abs=0.15)
        assert row.full <= row.reduced <= 1.001 * row.read_off
        assert row.reduced_predicted == pytest.approx(row.reduced, rel=0.1)


def test_a_search_from_the_reduced_model_finds_little_more(found):
    """Another kind of search; an end before the minimum would show as a gain."""
    course, size = Course.of(SCENARIO), len(found.inflation)

    def cost(logs):
        return score(course, scaled(found.models, found.form, np.exp(logs)))

    simplex = np.vstack([np.zeros(size), -0.4 * np.eye(size)])
    options = {"initial_simplex": simplex, "maxfev": 25 * size, "fatol": 1e-4, "xatol": 1e-2}
    again = minimize(cost, np.zeros(size), method="Nelder-Mead", options=options)
    assert cost(np.zeros(size)) - again.fun < 0.01


def test_the_reduced_model_is_consistent_in_simulation(found):
    """Errors that the search has never seen; 100 runs."""
    study = monte_carlo(SCENARIO, Simulated(FULL), {"reduced": found.models}, 100, 77)["reduced"]
    for row, outage in zip(found.errors, SCENARIO.outages, strict=True):
        ratio = study.nees[:, study.index(outage.end), 0] / 3.0
        error = ratio.std(ddof=1) / np.sqrt(ratio.size)
        assert abs(ratio.mean() - 1.0) < 0.15 + 3.5 * error
        assert abs(ratio.mean() - row.nees) < 4.5 * error


def test_a_model_that_has_the_form_already_comes_back():
    found = reduce(WALK, "N+K", scenario=SCENARIO)
    for axis in AXES:
        params, true = found.models.models[axis].params, WALK.models[axis].params
        assert params["K"] == pytest.approx(true["K"], rel=0.1)
    # At 30 s the walk is all that an Allan plot shows.
    assert found.inflation["gyro K"] == pytest.approx(1.0, abs=0.1)
    assert found.inflation["accel K"] == pytest.approx(1.0, abs=0.1)
    # White noise hardly matters beside this walk: its factor stays where it began.
    assert found.inflation["gyro N"] == pytest.approx(1.0, abs=0.1)
    assert found.inflation["accel N"] == pytest.approx(1.0, abs=0.1)
    for row in found.errors:
        assert row.nees == pytest.approx(1.0, abs=0.02)
        assert row.reduced == pytest.approx(row.full, rel=1e-3)


def test_the_motion_that_it_is_judged_on_is_reported_or_given(monkeypatch):
    monkeypatch.setattr(reduction, "_STEPS", 0)  # where it searches, not what it finds
    assumed = reduce(WALK, "N+K", (5.0,), dt=DT)
    assert [each.code for each in assumed.notices] == ["judged-on-loiter"]
    assert str(assumed.notices[0]) in " ".join(str(assumed).split())
    drive = car_drive(duration=130.0, dt=DT)
    given = reduce(WALK, "N+K", (5.0,), trajectory=drive)
    own = loiter_with_outages((5.0,), trajectory=drive)
    assert own.trajectory is drive
    assert given.notices == ()
    full = covariance_analysis(own, WALK, WALK)
    at = full.index(own.outages[0].end)
    assert given.errors[0].full == pytest.approx(np.hypot(*full.sd[at, :2]))
    with pytest.raises(InputError, match=r"it has 130 s, and outages .* need 260 s"):
        reduce(WALK, "N+K", (5.0, 15.0), trajectory=drive)


# ---- What is read off an Allan plot ----


def test_white_noise_and_walk_are_read_where_they_rule():
    found = read_off(WALK, "N+K", 100.0, DT)
    for axis in AXES:
        N, K = WALK.models[axis].params["N"], WALK.models[axis].params["K"]
        # The Allan variance is N^2 / tau + K^2 tau / 3; a straight line between octaves is at most
        # 3 % above it.
        read = found.models[axis].params
        assert read["N"] == pytest.approx(np.sqrt(N**2 + K**2 / 3.0), rel=0.03)
        assert read["K"] == pytest.approx(np.sqrt(K**2 + 3.0 * N**2 / 100.0**2), rel=0.03)


def test_a_gauss_markov_process_is_read_off_its_maximum():
    """Within an octave: the deviation is known at powers of two."""
    models = SensorModels.of(
        {
            "gyro": WhiteNoise(1e-6) + GaussMarkov(1e-4, 50.0),
            "accel": WhiteNoise(1e-5) + GaussMarkov(1e-2, 20.0),
        }
    )
    found = read_off(models, "N+GM", 60.0, DT)
    for axis in AXES:
        true, read = models.models[axis].params, found.models[axis].params
        assert read["sigma"] == pytest.approx(true["sigma"], rel=0.05)
        assert true["tau"] / 1.5 < read["tau"] < 1.5 * true["tau"]
    assert set(found.bias_sd.values()) == {0.0}


def test_the_bias_at_the_start_is_that_of_the_slow_terms():
    models = SensorModels(FULL.models, dict.fromkeys(AXES, 3e-3))
    found = read_off(models, "N+K", 30.0, DT).bias_sd
    expected = np.sqrt(3e-3**2 + 3e-3**2 + 2e-3**2)
    assert found["accel_y"] == pytest.approx(expected)
    assert found["gyro_y"] == pytest.approx(np.sqrt(3e-3**2 + 4e-4**2 + 1e-4**2))


def test_white_noise_alone_can_be_reduced():
    white = SensorModels.of({"gyro": WhiteNoise(1e-4), "accel": WhiteNoise(1e-3)})
    for form in FORMS:
        found = read_off(white, form, 30.0, DT)
        for axis in AXES:
            params = found.models[axis].params
            assert params["N"] == pytest.approx(white.models[axis].params["N"], rel=0.03)
            assert all(value > 0.0 for value in params.values())


# ---- Words ----


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"form": "N"}, r"form = 'N': choose from N\+K, N\+GM"),
        ({"outages": ()}, "outages is empty: give at least one"),
        ({"outages": (10.0, 0.0)}, r"outage length = 0\.0"),
        ({"outages": (-5.0,)}, r"outage length = -5\.0"),
        ({"outages": (10.03,)}, "between two epochs"),
        ({"scenario": Scenario(TRUTH, gnss(TRUTH))}, "outages is empty: give at least one"),
    ],
)
def test_what_cannot_be_used(options, message):
    with pytest.raises(InputError, match=message):
        reduce(FULL, dt=DT, **options)
