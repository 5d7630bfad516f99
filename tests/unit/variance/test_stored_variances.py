"""What is read back of a stored wavelet variance, and what is refused."""

import copy
import json

import numpy as np
import pytest

import gmwm
from gmwm.variance import tuning

RNG = np.random.default_rng(1)
SERIES = RNG.standard_normal(1000)
GAPPY = np.where(RNG.random(1000) < 0.02, np.nan, SERIES)


def stored(gappy=True, **options):
    wv = gmwm.wavelet_variance(GAPPY if gappy else SERIES, 0.01, **options)
    return json.loads(json.dumps(wv.to_dict()))


def read(content):
    return gmwm.WaveletVariance.from_dict(content)


def test_all_of_it_comes_back():
    for options in ({}, {"robust": True}, {"data_covariance": "none"}, {"wavelet": "db4"}):
        for gappy in (True, False):
            content = stored(gappy, **options)
            assert json.loads(json.dumps(read(content).to_dict())) == content


def changed(content, path, change):
    """A copy with another value at a path; what is removed is the last element."""
    content = copy.deepcopy(content)
    *way, last = path
    place = content
    for step in way:
        place = place[step]
    place[last] = change(place[last])
    return content


def shorter(values):
    return values[:-1]


def longer(values):
    return [*values, values[-1]]


def at(index, value):
    return lambda values: [*values[:index], value, *values[index + 1 :]]


@pytest.mark.parametrize(
    ("path", "change"),
    [
        (("n",), lambda n: 500), (("n",), lambda n: 0), (("dt",), lambda dt: 0.0),
        (("dt",), lambda dt: 1.1 * dt), (("confidence",), lambda c: 1.0),
        (("fourth_cumulant",), str), (("fourth_cumulant",), lambda c: -1.0),
        (("confidence",), lambda c: 0.0), (("efficiency",), lambda e: 0.0),
        (("efficiency",), lambda e: 1.01), (("variance",), shorter), (("variance",), longer),
        (("mean",), shorter), (("tau",), shorter), (("variance",), at(0, -1e-9)),
        (("variance",), at(0, 2.0 * tuning.LARGEST_VARIANCE)), (("variance",), lambda v: []),
        (("tau",), at(2, 0.04 * (1.0 + 2e-6))), (("blocks",), lambda b: b + b[:10]),
        (("blocks",), lambda b: []), (("block",), lambda b: 2 * b), (("block",), lambda b: 0),
        (("gaps", "missing"), lambda m: 1000), (("gaps", "missing"), lambda m: -1),
        (("gaps", "counts"), shorter), (("gaps", "counts"), longer),
        (("gaps", "counts"), at(0, 0.0)), (("gaps", "change"), shorter),
        (("gaps", "change"), longer), (("gaps", "change"), at(0, -1.0)),
        (("gaps", "inflation"), shorter), (("gaps", "inflation", 0), shorter),
        (("gaps", "inflation", 0), at(1, 0.0)), (("data_covariance",), shorter),
        (("data_covariance", 0), at(1, 1e9)), (("driftless",), lambda d: [1.0]),
        (("wavelet",), lambda w: "none"), (("spectrum", "mean"), shorter),
        (("spectrum", "mean"), at(0, 0.0)), (("spectrum", "block"), at(0, 1.5)),
        (("spectrum", "centre"), at(0, 0.6)), (("spectrum", "count"), at(0, None)),
    ],
)  # fmt: skip
def test_what_does_not_go_together_is_refused(path, change):
    content = stored(path[0] != "spectrum", data_covariance="none")
    read(content)
    with pytest.raises(gmwm.InputError):
        read(changed(content, path, change))


@pytest.mark.parametrize(
    ("path", "change"),
    [
        (("tau",), at(2, 0.04 * (1.0 + 5e-7))), (("gaps", "missing"), lambda m: 999),
        (("gaps", "missing"), lambda m: 0), (("gaps", "change"), at(0, -0.99)),
        (("efficiency",), lambda e: 1.0), (("variance",), at(0, 0.0)),
        (("variance",), at(0, tuning.LARGEST_VARIANCE)), (("blocks",), shorter),
    ],
)  # fmt: skip
def test_what_is_just_right_is_read(path, change):
    read(changed(stored(), path, change))


def test_a_complete_series_has_all_its_levels():
    content = stored(gappy=False)
    for name in ("tau", "variance", "mean"):
        content = changed(content, (name,), shorter)
    with pytest.raises(gmwm.InputError, match="8 levels where 1,000 samples have 9"):
        read(content)
    gappy = stored()
    for name in ("tau", "variance", "mean"):
        gappy = changed(gappy, (name,), shorter)
    gaps = gappy["gaps"]
    gaps |= {name: gaps[name][:-1] for name in ("counts", "change")}
    gaps["inflation"] = [row[:-1] for row in gaps["inflation"][:-1]]
    read(gappy)
