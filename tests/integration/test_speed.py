"""Ratios of times measured in turns in one process, with wide margins: never a time alone."""

import time
from dataclasses import replace

import allantools
import numpy as np
import pytest

import gmwm

N, DT = 200_000, 0.01


def processor_times(*works):
    """The least time of each of several turns."""
    found = [[] for _ in works]
    for _ in range(4):
        for times, work in zip(found, works, strict=True):
            begin = time.process_time()
            work()
            times.append(time.process_time() - begin)
    return [min(times) for times in found]


@pytest.fixture(scope="module")
def series():
    return (gmwm.WhiteNoise(0.2) + gmwm.GaussMarkov(0.05, 20.0)).simulate(N, DT, seed=1)


def test_variances_against_allantools_and_one_read(series):
    taus = DT * 2.0 ** np.arange(N.bit_length() - 2)
    ours, theirs, read = processor_times(
        lambda: gmwm.wavelet_variance(series, DT),
        lambda: allantools.oadev(series, rate=1.0 / DT, data_type="freq", taus=taus),
        lambda: [np.sum(np.cumsum(series)) for _ in range(10)],
    )
    assert ours < 2.0 * theirs
    assert ours < 20.0 * read


def test_a_fit_against_its_variances_and_allantools(series):
    wv = gmwm.wavelet_variance(series, DT)
    model = gmwm.WhiteNoise() + gmwm.GaussMarkov()
    taus = DT * 2.0 ** np.arange(N.bit_length() - 2)
    fit, theirs = processor_times(
        lambda: gmwm.fit(model, replace(wv)),  # a copy knows nothing of earlier fits
        lambda: allantools.oadev(series, rate=1.0 / DT, data_type="freq", taus=taus),
    )
    assert fit < 20.0 * theirs
