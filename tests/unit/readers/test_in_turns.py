"""Rows that share a stamp: batches of one sensor, or several sensors in turns."""

import numpy as np
import pandas as pd
import pytest

from gmwm import GaussMarkov, InputError, RandomWalk, Recording, Resonance, WhiteNoise, health, read
from gmwm.cli.hints import with_hint
from gmwm.readers.at_rest import turn_notices

WHITE = WhiteNoise(1e-4)
N, RATE = 60_000, 100.0


def series(model, bias=0.0, sensors=1, seed=1):
    """As many sensors in turns, of biases that differ by one."""
    found = [
        model.simulate(N // sensors, sensors / RATE, seed=seed + 100 * i) + (i + 1) * bias
        for i in range(sensors)
    ]
    return np.stack(found, axis=1).ravel()


def logged(values, rows, **more):
    stamps = np.arange(values.size) // rows * (rows / RATE)
    return read(pd.DataFrame({"time [s]": stamps, "gyro_x [rad/s]": values, **more}))


def of_turns(recording):
    return [each for each in recording.notices if each.code == "sensors-in-turns"]


@pytest.mark.parametrize("rows", [2, 4])
def test_sensors_of_other_biases_are_refused(rows):
    with pytest.raises(InputError, match=f"{rows} sensors in turns: keep the rows") as caught:
        logged(series(WHITE, 1e-3, rows), rows)
    assert "or, if there is but one, --rate 100 --time none" in with_hint(caught.value)


def test_a_column_that_alternates_is_named():
    values = series(WHITE, 1e-4, 2)  # 0.1 standard deviations apart
    (notice,) = of_turns(logged(values, 2))
    assert notice.severity == "warning" and "gyro_x are 0.1" in notice.text
    with pytest.raises(InputError, match="which column 'port' tells apart"):
        logged(values, 2, port=np.resize([5, 3], N), other=np.resize([1, 2, 3, 4], N))


@pytest.mark.parametrize("rows", [2, 3])
def test_sensors_that_wander_apart(rows):
    (notice,) = of_turns(logged(series(WHITE + GaussMarkov(2e-4, 5.0), 0.0, rows), rows))
    assert "wander apart" in notice.text


@pytest.mark.parametrize("rows", [2, 3, 4])
@pytest.mark.parametrize(
    ("model", "bias"),
    [
        (WHITE, 1e-3),
        (WHITE + RandomWalk(1e-5), 0.0),
        (WHITE + GaussMarkov(1e-4, 5.0), 0.0),
        (WHITE + Resonance(1e-3, 49.0, 0.01), 1e-3),
    ],
)
def test_batches_of_one_sensor(rows, model, bias):
    assert not of_turns(logged(series(model, bias), rows))


def test_what_the_samples_do_not_tell():
    for values in (series(WHITE), series(WHITE, 0.0, 2)):
        (notice,) = of_turns(logged(values, 2))
        assert "do not tell" in notice.text and notice.severity == "warning"
    # Batches that vary, and longer ones, are of one sensor.
    stamps = np.arange(N) // 2 / 50.0
    for first in range(0, N - 40, 40):
        stamps[first + 2] = stamps[first + 1]
    found = read(pd.DataFrame({"time [s]": stamps, "gyro_x [rad/s]": series(WHITE)}))
    assert not of_turns(found) and not of_turns(logged(series(WHITE), 8))


def test_gravity_of_all_accelerometers_is_no_bias():
    def noticed(quantity, unit):
        recording = Recording.from_arrays({"a": series(WHITE) + 9.8}, RATE, {"a": unit})
        assert recording["a"].quantity == quantity
        return turn_notices(recording, 2, (), is_even=True)

    assert noticed("accel", "m/s^2") and not noticed("gyro", "rad/s")


def test_a_log_that_was_written_twice():
    recording = logged(np.repeat(series(WHITE)[: N // 2], 2), 2)
    assert not of_turns(recording)
    assert health(recording).repetition("gyro_x").times == 2


def test_few_samples_and_gaps():
    values = series(WHITE, 1e-3, 2)
    values[: N // 3] = np.nan
    recording = Recording.from_arrays({"gyro_x": values}, RATE, {"gyro": "rad/s"})
    with pytest.raises(InputError, match="in turns"):
        turn_notices(recording, 2, (), is_even=True)
    for few in (values[:2000], np.full(N, np.nan)):
        recording = Recording.from_arrays({"gyro_x": few}, RATE, {"gyro": "rad/s"})
        assert turn_notices(recording, 2, (), is_even=True) == ()
