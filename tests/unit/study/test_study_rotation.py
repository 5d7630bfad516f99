"""Every recording calibrated in turn: tables, intervals over recordings, what is kept."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from gmwm import Calibration, GaussMarkov, RandomWalk, Recording, WhiteNoise, fit, wavelet_variance
from gmwm.errors import InputError
from gmwm.ins import car_drive, gnss
from gmwm.ins.filter.aiding import Outage
from gmwm.ins.sensors import AXES
from gmwm.ins.simulation import Scenario
from gmwm.study import rotation
from gmwm.study.rotation import Rotation, crossed_weights, reproduce_rotation, rotate

FACTORS = {"GMWM": 1.0, "lines": 2.0}
STRETCHES = (6, 8, 7)
RATE, UNITS = 20.0, {"gyro": "rad/s", "accel": "m/s^2"}


def turned(made_up, dead=()):
    """Three turns; the second filter's errors are twice as large as it predicts."""
    total = sum(STRETCHES)
    turns = [
        made_up(FACTORS, runs=total - size, seed=i, dead=dead) for i, size in enumerate(STRETCHES)
    ]
    return Rotation(("a.csv", "b.csv", "c.csv"), STRETCHES, tuple(turns))


@pytest.fixture(scope="module")
def found(made_up):
    return turned(made_up)


def test_the_numbers_are_those_of_all_turns(found):
    ratio = found.ratio("lines", "horizontal")
    assert ratio.value == pytest.approx(2.0, rel=1e-9)  # the same draws for both
    assert (ratio.lower, ratio.upper) == pytest.approx((2.0, 2.0))
    squares = [
        np.sum(turn.study["lines"].error[:, turn.study["lines"].index(end), :2] ** 2)
        for turn in found.turns
        for end in (30.0, 55.0)
    ]
    own = found._table("lines", lambda runs, end: np.sum(runs.error[:, end, :2] ** 2, axis=1))
    assert 2.0 * np.nansum(own) == pytest.approx(sum(squares))
    for name, factor in FACTORS.items():
        for group in ("horizontal", "vertical", "position"):
            nees = found.nees(name, group)
            assert nees.lower < factor**2 < nees.upper
        covered = found.coverage(name, "horizontal")
        assert covered.lower < (0.95 if factor == 1.0 else 0.67) < covered.upper + 0.02
    one = found.nees("GMWM", "position", 1)
    runs = found.turns[1].study["GMWM"]
    expected = np.mean([runs.nees[:, runs.index(end), 0] / 3.0 for end in (30.0, 55.0)])
    assert one.value == pytest.approx(expected)
    assert one.lower < one.value < one.upper


def test_a_draw_takes_each_recording_and_stretch_once_for_all_its_runs():
    weights = crossed_weights((3, 5, 4), None, 4000, 1)
    assert not np.any(weights[:, np.arange(3), np.arange(3)])
    assert not np.any(weights[:, :, 0, 3:])
    mean = weights.mean(axis=0)
    assert mean[0, 1, :5] == pytest.approx(np.ones(5), abs=0.1)
    # What is calibrated multiplies all runs of a stretch alike.
    both = (weights[:, 0, 2] > 0.0) & (weights[:, 1, 2] > 0.0)
    shares = weights[:, 0, 2][both] / weights[:, 1, 2][both]
    rows = np.nonzero(both)[0]
    for row in rows[:50]:
        assert np.ptp(shares[rows == row]) == pytest.approx(0.0)
    alone = crossed_weights((3, 5, 4), 2, 100, 1)
    assert not np.any(alone[:, :2])
    assert np.all(np.sum(alone[:, 2], axis=(1, 2)) > 0.0)


def test_intervals_allow_for_few_recordings():
    """Four recordings whose effects are as large as those of stretches: crossed, 300 studies."""
    rng = np.random.default_rng(5)
    n, size = 4, 8
    weights = crossed_weights((size,) * n, None, 1000, 5)
    weights = weights / np.sum(weights, axis=(1, 2, 3), keepdims=True)
    studies = 300
    off = 1.0 - np.eye(n)[..., None]
    values = (
        1.0 + 0.5 * rng.standard_normal((studies, n, 1, 1)) * off
        + 0.5 * rng.standard_normal((studies, 1, n, 1))
        + 0.5 * rng.standard_normal((studies, 1, n, size))
    )  # fmt: skip
    drawn = np.nan_to_num(np.einsum("dcts,kcts->kd", weights, values, optimize=True), nan=1.0)
    lower, upper = np.quantile(drawn, [0.025, 0.975], axis=1)
    inside = np.mean((lower < 1.0) & (upper > 1.0))
    naive = np.std(values, axis=(1, 2, 3)) / np.sqrt(n * (n - 1) * size)
    centre = np.sum(values * off, axis=(1, 2, 3)) / (n * (n - 1) * size)
    assert inside > 0.83  # 0.90 in a thousand studies: four recordings are few
    assert np.mean(np.abs(centre - 1.0) < 1.96 * naive) < 0.4


def recording(seed, axes=AXES, n=3000):
    rng = np.random.default_rng(seed)
    model = WhiteNoise(1e-3) + RandomWalk(3e-5)
    columns = {axis: sum(t.simulate(n, 1 / RATE, rng) for t in model.terms) for axis in axes}
    return Recording.from_arrays(columns, RATE, UNITS, source=f"{seed}.csv")


@pytest.fixture
def short(monkeypatch):
    """A drive of 40 s, and a calibration that counts how often it is done."""
    truth = car_drive(duration=40.0, dt=1 / RATE)
    scenario = Scenario(truth, gnss(truth), (Outage(20.0, 10.0),), interval=10.0)
    monkeypatch.setattr(rotation, "scenario_of", lambda vehicle: scenario)
    done = []

    def calibrate(given):
        done.append(given.source)
        model = WhiteNoise() + GaussMarkov()
        fits = {axis: fit(model, wavelet_variance(given[axis])) for axis in AXES}
        return Calibration(fits, {}, given.source, RATE, 3000)

    bound = rotation.filter_numbers.bound
    quick = SimpleNamespace(  # the others take seconds
        bound=lambda given, form, horizon: bound(given, "N+K", horizon),
        reduce=lambda given, form, outages: bound(given, form, outages[0]),
    )
    monkeypatch.setattr(rotation, "calibrate", calibrate)
    monkeypatch.setattr(rotation, "filter_numbers", quick)
    return done


@pytest.mark.slow
def test_a_rotation_goes_on_where_it_stopped(short, tmp_path):
    given = [recording(1), recording(2)]
    first = rotate("car", given, tmp_path, runs=2)
    assert short == ["1.csv", "2.csv"]
    assert first.stretches == (2, 2)
    assert [turn.study["GMWM"].runs for turn in first.turns] == [2, 2]
    for turn in first.turns:
        for name, models in turn.experiment.filters.items():
            for axis in AXES:
                slow = [term for term in models.models[axis].terms if not term.is_white]
                assert slow or models.bias_sd[axis] > 0.0, (name, axis)
    # What a filter believes does not depend on what is navigated with.
    other = rotate("car", [given[0], recording(3)], tmp_path / "other", runs=2)
    believed = [each.turns[0].experiment.filters for each in (first, other)]
    for name, models in believed[0].items():
        assert models.bias_sd == believed[1][name].bias_sd
        assert models.models == believed[1][name].models
    with pytest.raises(InputError, match="earlier study") as error:
        rotate("car", given, tmp_path, runs=2)
    assert error.value.code == "earlier-runs"
    (tmp_path / "car-2" / "part-00000.npz").unlink()
    short.clear()
    text, paths = reproduce_rotation(
        "fig9", tmp_path, runs=2, seed=0, jobs=1, recordings=given, resume=True
    )
    assert short == []
    assert text == str(replace(first))
    assert {path.suffix for path in paths} == {".txt", ".png", ".svg"}


def test_what_cannot_be_rotated_is_refused(tmp_path):
    with pytest.raises(InputError, match="two recordings or more"):
        rotate("car", [recording(1)], tmp_path)
    given = [recording(1), recording(2, axes=AXES[:5], n=100)]
    with pytest.raises(InputError, match="channel accel_z is missing"):
        reproduce_rotation("fig9", tmp_path, runs=2, seed=0, jobs=1, recordings=given, resume=False)
    assert list(tmp_path.iterdir()) == []
