from functools import cache

import numpy as np
import pytest

from gmwm import Calibration, GaussMarkov, RandomWalk, Recording, WhiteNoise, fit, wavelet_variance
from gmwm.errors import InputError
from gmwm.ins.sensors import AXES, SensorModels
from gmwm.process import BiasInstability, Model
from gmwm.study import navigation
from gmwm.study.navigation import TABLE_6, Calibrated, aligned, experiment, reproduce_figure
from marks import slow

RATE, N = 20.0, 60_000
UNITS = {"gyro": "rad/s", "accel": "m/s^2"}


def recording(model, seed=0, axes=AXES, n=N):
    rng = np.random.default_rng(seed)
    columns = {axis: sum(t.simulate(n, 1 / RATE, rng) for t in model.terms) for axis in axes}
    return Recording.from_arrays(columns, RATE, UNITS, source="test.csv")


@cache
def calibrated(model):
    given = recording(model)
    kind = WhiteNoise() + BiasInstability() + RandomWalk()
    lines = {axis: fit(kind, wavelet_variance(given[axis]), method="allan") for axis in AXES}
    fits = {axis: fit(WhiteNoise(), wavelet_variance(given[axis])) for axis in AXES}
    return Calibrated(lines, Calibration(fits, {}, "test.csv", RATE, N))


def test_lines_give_white_noise_and_a_walk_where_there_are_both():
    walking = calibrated(WhiteNoise(1e-3) + RandomWalk(3e-4)).line_models()
    for axis in AXES:
        params = walking.models[axis].params
        assert set(params) == {"N", "K"}
        # Lines read at the ends of the plot are biased by what is between them: within a third.
        assert params["N"] == pytest.approx(1e-3, rel=0.33)
        assert params["K"] == pytest.approx(3e-4, rel=0.7)


def test_an_axis_without_floor_or_walk_has_a_slow_state_all_the_same():
    found = calibrated(Model((WhiteNoise(1e-3),)))
    assert found.lineless()
    for axis in found.lineless():
        wv = found.lines[axis].wv
        slow = found.line_models().models[axis].terms[1]
        # As high as the lowest point of the plot, and in its place.
        peak = np.sqrt(2.0 * slow.haar_variance(wv.tau, wv.dt))
        assert peak.max() == pytest.approx(wv.allan_deviation.min(), rel=0.05)
    assert calibrated(WhiteNoise(1e-3) + RandomWalk(3e-4)).lineless() == ()


def test_two_numbers_are_read_off_the_curve():
    found = calibrated(WhiteNoise(1e-3) + RandomWalk(3e-4))
    for axis in AXES:
        params = found.curve_models(60.0).models[axis].params
        assert params["N"] == pytest.approx(1e-3, rel=0.1)
        assert params["K"] == pytest.approx(3e-4, rel=0.15)


def test_a_filter_starts_with_what_its_stationary_terms_do_not_explain():
    slow, wide, walk = GaussMarkov(3e-3, 1e5), GaussMarkov(1e-2, 1e5), RandomWalk(1e-4)
    start = dict.fromkeys(AXES, 5e-3)
    for model, expected in ((slow, 4e-3), (wide, 0.0), (walk, 5e-3)):
        models = SensorModels.of(dict.fromkeys(AXES, WhiteNoise(1e-5) + model))
        found = aligned(models, start)
        assert found.models == models.models
        assert found.bias_sd["gyro_x"] == pytest.approx(expected, rel=1e-3)
    # Means over a minute, as they are: of a term of ten seconds, a few are averaged.
    draws = GaussMarkov(1.0, 10.0).simulate(600_000, 0.1, np.random.default_rng(2))
    term = SensorModels.of(dict.fromkeys(AXES, GaussMarkov(1.0, 10.0)))
    scatter = np.std(draws.reshape(-1, 600).mean(axis=1))
    left = aligned(term, dict.fromkeys(AXES, 1.0)).bias_sd["gyro_x"]
    assert 1.0 - left**2 == pytest.approx(scatter**2, rel=0.15)


def test_an_experiment_has_a_filter_for_each_calibration():
    found = calibrated(WhiteNoise(1e-3) + RandomWalk(3e-4))
    simulated = experiment("car", found, 3, 5)
    assert list(simulated.filters) == ["GMWM", "AV", "KF-tuned", "truth"]
    assert simulated.truth is TABLE_6
    assert (simulated.runs, simulated.seed) == (3, 5)
    real = experiment("car", found, 3, 5, [recording(WhiteNoise(1e-3) + RandomWalk(3e-4), 1)] * 3)
    assert list(real.filters) == ["GMWM", "AV", "AV x 10"]
    assert real.truth is None
    ten, one = (real.filters[name].models["gyro_x"].params for name in ("AV x 10", "AV"))
    assert ten == {name: pytest.approx(10.0 * each) for name, each in one.items()}
    assert real.filters["AV"].bias_sd["gyro_x"] > 0.0
    # Fitted with white noise alone: what wanders is a constant that the filter does not know.
    assert real.filters["GMWM"].bias_sd["gyro_x"] > 0.0


@pytest.mark.parametrize("figure", [slow("fig7"), slow("fig8"), "fig9"])
def test_a_study_is_drawn_and_its_table_kept(tmp_path, monkeypatch, made_up, figure):
    monkeypatch.setattr(Calibrated, "of", lambda given: None)
    short = recording(WhiteNoise(1e-3) + RandomWalk(3e-4), n=100)
    monkeypatch.setattr(navigation, "static_recording", lambda seed: short)
    asked = {}

    def remembered(vehicle, calibrated, runs, seed, recordings):
        asked.update(vehicle=vehicle, runs=runs, seed=seed)

    monkeypatch.setattr(navigation, "experiment", remembered)
    validation = made_up(runs=5)
    monkeypatch.setattr(navigation.Validation, "of", lambda *args, **options: validation)
    text, paths = reproduce_figure(figure, tmp_path, runs=7, seed=3, jobs=1)
    vehicle = "paper-car" if figure == "fig9" else "helicopter"
    assert asked == {"vehicle": vehicle, "runs": 7, "seed": 3}
    assert (tmp_path / f"{figure}.txt").read_text() == text + "\n" == str(validation) + "\n"
    assert {path.suffix for path in paths} == {".txt", ".png", ".svg"}


def test_recordings_that_cannot_be_used_are_refused_before_they_are_calibrated(tmp_path):
    model = WhiteNoise(1e-3) + RandomWalk(3e-4)
    for figure, given, message in (
        ("fig7", [recording(model, n=100)], "two recordings or more"),
        ("fig9", [recording(model, axes=AXES[:5], n=100)] * 2, "channel accel_z is missing"),
    ):
        with pytest.raises(InputError, match=message):
            reproduce_figure(figure, tmp_path, runs=2, seed=0, jobs=1, recordings=given)
    assert list(tmp_path.iterdir()) == []
