"""A larger model describes a curve that no model fits as well as one that it nests."""

import json
from itertools import pairwise

import numpy as np
import pytest

import gmwm
from gmwm import GaussMarkov, RandomWalk, WhiteNoise
from marks import slow
from places import SHARED

CURVES = SHARED / "reference" / "smac_curves.json"


def octaves(variance, rate):
    return gmwm.curve(2.0 ** np.arange(len(variance)) / rate, variance, kind="wavelet", rate=rate)


def made(seed):
    """Coloured noise at the finest levels that no term of the models has."""
    rng = np.random.default_rng(seed)
    truth = WhiteNoise(7e-5) + GaussMarkov(8e-5, 4.0) + GaussMarkov(1.7e-4, 2000.0)
    variance = truth.wavelet_variance(0.004 * 2.0 ** np.arange(20), 0.004)
    bend = np.concatenate([2.0 * np.sort(rng.uniform(size=5))[::-1], rng.normal(0.0, 0.15, 15)])
    return octaves(variance * np.exp(bend), 250.0)


def stored(axis):
    if not CURVES.exists():
        pytest.skip("needs the stored curves")
    record = json.loads(CURVES.read_text())["navchip"]
    return octaves(record["axes"][axis]["wavelet_variance"], record["rate"])


@pytest.mark.parametrize("source", ["Gyro. X", slow("Gyro. Y"), 0, *map(slow, (1, 2, 3))])
@pytest.mark.filterwarnings("ignore::gmwm.errors.FitWarning")
def test_a_further_term_does_not_spoil_the_fit(source):
    wv = stored(source) if isinstance(source, str) else made(source)
    fits = [gmwm.fit(WhiteNoise() + k * GaussMarkov(), wv) for k in (1, 2, 3, 4)]
    misfits = [float(np.std(np.log(fit.implied / wv.variance))) for fit in fits]
    assert all(b < 1.1 * a for a, b in pairwise(misfits)), misfits
    assert max(fit.discrepancy for fit in fits) < 0.6


@pytest.mark.filterwarnings("ignore::gmwm.errors.FitWarning")
def test_a_term_of_zero_amplitude_does_not_change_the_discrepancy():
    """Each took two degrees of freedom, so that the allowed discrepancy grew with it."""
    bent = np.concatenate([[0.0, -1.7, -3.4], -4.4 - np.arange(4), -7.4 + 1.4 * np.arange(4)])
    wv = octaves(np.exp2(bent), 100.0)
    one, *larger = (gmwm.fit(WhiteNoise() + k * GaussMarkov(), wv) for k in (1, 2, 3))
    for fit in larger:
        assert fit.params["sigma_1"] == 0.0
        assert fit.discrepancy == pytest.approx(one.discrepancy, rel=1e-6)


def bent(seed):
    """A curve of a few straight pieces, which no sum of processes need follow."""
    rng = np.random.default_rng(seed)
    levels = int(rng.integers(10, 20))
    ends = [0, *np.sort(rng.choice(np.arange(1, levels), 3, replace=False)), levels]
    slopes = np.repeat(rng.uniform(-2.0, 1.5, 4), np.diff(ends))
    return octaves(np.exp2(np.cumsum(slopes)), 100.0)


@pytest.mark.parametrize("seed", [6005, slow(6023), slow(7059)])
@pytest.mark.filterwarnings("ignore::gmwm.errors.FitWarning")
def test_a_further_term_needs_no_larger_discrepancy(seed):
    nested, larger = (
        gmwm.fit(WhiteNoise() + RandomWalk() + k * GaussMarkov(), bent(seed)) for k in (1, 2)
    )
    smallest = gmwm.fit(WhiteNoise() + RandomWalk(), bent(seed))
    assert larger.discrepancy <= 1.3 * nested.discrepancy <= 1.7 * smallest.discrepancy
