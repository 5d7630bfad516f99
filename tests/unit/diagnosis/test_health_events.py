"""Spikes and shocks: found where they are, and not in noise."""

import numpy as np
import pytest
from scipy.stats import binom

import gmwm
from gmwm import GaussMarkov, InputError, RandomWalk, Resonance, WhiteNoise
from gmwm.diagnosis.events import _LISTED, find_events
from gmwm.diagnosis.innovations import innovations
from gmwm.diagnosis.tuning import FALSE_ALARM
from gmwm.process import as_model
from marks import every

DT = 0.01
NOISES = {
    "white": WhiteNoise(0.1),
    "walk": RandomWalk(1.0),
    "white on walk": WhiteNoise(0.1) + RandomWalk(0.1),
    "Gauss-Markov": GaussMarkov(1.0, 0.05),
    "resonance": WhiteNoise(0.05) + Resonance(1.0, 20.0, 0.05),
}


def noise(name, n, seed):
    return gmwm.simulate(as_model(NOISES[name]), n=n, dt=DT, seed=seed)


def events(x, step=0.0):
    return find_events(innovations(x, step))


@pytest.mark.parametrize("name", NOISES)
@pytest.mark.parametrize("place", [0, 1, 30, 2500, 4997, 4999])
def test_a_spike_is_found_anywhere(name, place):
    x = noise(name, 5000, 1)
    scale = innovations(x, 0.0).level
    x[place] += 15.0 * scale
    found = events(x)
    assert len(found) == 1
    assert found[0][0] <= place < found[0][1]


def test_a_shock_is_covered_from_beginning_to_end():
    x = noise("white", 20_000, 2)
    t = np.arange(60)
    x[7000:7060] += 30.0 * np.exp(-t / 15.0) * np.sin(0.9 * t + 0.5)
    ((start, stop),) = events(x)
    assert start <= 7000
    # Where it has sunk into the noise (sigma 1) its end is no longer to be seen.
    assert 7040 <= stop <= 7150


def test_spikes_far_apart_are_separate_and_near_ones_are_one():
    x = noise("white", 20_000, 3)
    x[[500, 510, 9000]] += 12.0
    found = events(x)
    assert len(found) == 2
    assert found[0][0] <= 500 < 510 < found[0][1]


@pytest.mark.parametrize("name", every(2, NOISES))
def test_clean_noise_has_no_events(name):
    runs = 120
    count = sum(bool(events(noise(name, 3000, 100 + seed))) for seed in range(runs))
    # Each run has an event with a chance of 1/1000; 1 in a million that the bound is passed.
    assert count <= binom.isf(1e-6, runs, 2.0 * FALSE_ALARM)


@pytest.mark.parametrize("ratio", [0.1, 1.0, 2.0, 4.0, 8.0])
def test_rounded_noise_has_no_events(ratio):
    # The level passes slowly over the steps: samples toggle between two of them now and then.
    rng = np.random.default_rng(4)
    slow = np.linspace(0.0, 3.0 * ratio, 40_000)
    x = np.rint((slow + rng.normal(size=40_000)) / ratio) * ratio
    assert events(x, ratio) == ()


def test_noise_that_grows_is_no_event():
    x = np.random.default_rng(6).normal(size=100_000) * np.linspace(1.0, 10.0, 100_000)
    assert events(x) == ()


def test_events_beside_a_gap():
    x = noise("white", 5000, 7)
    x[2000:2100] = np.nan
    x[2100] += 20.0
    x[1999] -= 20.0
    found = events(x)
    covered = np.zeros(5000, dtype=bool)
    for start, stop in found:
        covered[start:stop] = True
    assert covered[1999] and covered[2100]
    assert np.count_nonzero(covered) < 250


@pytest.mark.parametrize("n", [0, 1, 2, 10, 60])
def test_too_few_samples_have_no_innovations(n):
    assert innovations(np.arange(n, dtype=float), 0.0) is None


def test_innovations_are_white_and_have_the_scale_of_the_noise():
    for name, model in NOISES.items():
        found = innovations(noise(name, 50_000, 8), 0.0)
        e = found.values[found.known]
        r = np.array([e[k:] @ e[: e.size - k] for k in range(1, 6)]) / (e @ e)
        assert np.all(np.abs(r) < 0.12), (name, model)
        assert np.median(found.scale) == pytest.approx(np.std(e), rel=0.03)


def test_finding_tells_when_and_how_large(record):
    x = 0.01 * noise("white", 30_000, 9)
    x[12_345:12_348] -= np.radians(17.0)
    found = gmwm.health(record(gyro_x=x))
    (notice,) = found.of("gyro_x", "event")
    assert notice.severity == "warning"
    assert notice.values["height"] == pytest.approx(-np.radians(17.0), abs=0.05)
    assert notice.values["time"] == pytest.approx(123.45, abs=0.5)
    assert "deg/s at 123." in notice.text
    assert found.worst == "warning"


def test_masking_takes_the_events_and_nothing_else(record):
    x, y = noise("white", 6000, 10), noise("white", 6000, 11)
    x[3000] += 40.0
    y[100] = np.nan
    recording = record(gyro_x=x, gyro_y=y)
    found = gmwm.health(recording)
    masked = found.masked(recording)
    ((start, stop),) = found.events("gyro_x")
    np.testing.assert_array_equal(
        np.flatnonzero(np.isnan(masked["gyro_x"].values)), np.arange(start, stop)
    )
    assert masked["gyro_y"] is recording["gyro_y"]
    assert recording["gyro_x"].is_complete  # the recording given stays as it was
    assert masked.notices[:-1] == recording.notices
    assert (masked.notices[-1].code, masked.notices[-1].where) == ("events-left-out", "gyro_x")
    again = gmwm.health(masked)
    assert not again.of("gyro_x", "event")
    clean = gmwm.wavelet_variance(masked["gyro_x"]).variance[0]
    assert clean == pytest.approx(0.5, rel=0.1)  # half the variance of the noise


def test_masking_another_recording_is_refused(record):
    found = gmwm.health(record(gyro_x=noise("white", 600, 1)))
    for other in (record(gyro_y=np.zeros(600)), record(gyro_x=np.zeros(601))):
        with pytest.raises(InputError, match=r"is not the one that was examined"):
            found.masked(other)


@pytest.mark.parametrize("count", [1, 4, 5, 6])
def test_a_few_other_events_are_listed(record, count):
    x = noise("white", 20_000, 6)
    x[2000 * np.arange(1, count + 1)] += 20.0
    (notice,) = gmwm.health(record(gyro_x=x)).of("gyro_x", "event")
    assert notice.values["count"] == count
    assert ("others at" in notice.text) == (1 < count <= _LISTED + 1)


def test_most_of_a_record_is_no_shock(record):
    """Values that are held until what they show has moved by a deviation of the noise."""
    noise = np.random.default_rng(2).normal(size=60_000)
    values, shown = noise.copy(), noise[0]
    for i, each in enumerate(noise.tolist()):
        if abs(each - shown) > 1.0:
            shown = each
        values[i] = shown
    (event,) = gmwm.health(record(gyro_x=values)).of(code="event")
    assert event.severity == "bad"
    assert "not sensor noise" in event.text
