"""Memory that the examination of a channel takes beside its samples."""

import tracemalloc

import numpy as np

import gmwm


def _recording(n):
    noise = np.random.default_rng(4).normal(size=n)
    return gmwm.Recording.from_arrays({"gyro_x": np.round(noise, 2)}, 100.0, {"gyro": "deg/s"})


def test_a_channel_takes_no_more_than_eight_times_its_samples():
    gmwm.health(_recording(20_000))  # what is imported then stays
    recording = _recording(150_000)
    tracemalloc.start()
    try:
        gmwm.health(recording)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 8 * recording["gyro_x"].values.nbytes
