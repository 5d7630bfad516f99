"""Whole wavelet variances of small series, all fields, as they were recorded."""

import numpy as np
import pytest

import gmwm
from classes import assert_dataclasses_keep_the_rules, signatures_of
from gmwm.readers import Channel
from gmwm.variance import PooledVariance, imodwt, modwt, pilot_psd
from recorded import Pictures, assert_as_recorded, summed

DT = 0.01
MODEL = gmwm.WhiteNoise(0.1) + gmwm.GaussMarkov(1.0, 0.5) + gmwm.RandomWalk(0.3)


def series(n, seed=0):
    return MODEL.simulate(n, DT, seed)


def with_gaps(n, seed=0):
    """Single samples, some short gaps, one so long that it splits the record, and a drift."""
    x = series(n, seed) + 1e-3 * np.arange(n)
    rng = np.random.default_rng(seed + 1)
    x[rng.random(n) < 0.01] = np.nan
    for length in (2, 3, 7, 30, 150):
        start = rng.integers(100, n - 400)
        x[start : start + length] = np.nan
    x[n // 2 : n // 2 + n // 8] = np.nan
    return x


def all_of(wv):
    return {
        "variance": wv.variance, "dof": wv.dof, "lower": wv.lower, "upper": wv.upper,
        "counts": wv.counts, "covariance": wv.covariance, "allan": wv.allan_deviation,
        "width": wv.width, "drift": wv.drift_response, "all fields": summed(wv),
        "mean covariance": wv.mean_covariance_under(MODEL.psd),
        "under": wv.covariance_under(MODEL.psd, ((3.0, 0.2),)),
        "detrended": wv.detrended(1e-3), "notices": wv.notices, "text": str(wv),
        "n": [wv.n, wv.n_all],
    }  # fmt: skip


@pytest.mark.parametrize(
    ("name", "n", "options"),
    [("plain", 3000, {}), ("gaps", 3000, {}), ("gaps", 600, {}), ("plain", 30_000, {}),
     ("gaps", 3000, {"robust": True}),
     ("plain", 3000, {"robust": True, "efficiency": 0.9, "confidence": 0.68}),
     ("gaps", 3000, {"wavelet": "db4"}), ("plain", 3000, {"wavelet": "coif2", "robust": True}),
     ("gaps", 3000, {"data_covariance": "octave", "confidence": 0.5})],
)  # fmt: skip
def test_a_wavelet_variance(name, n, options):
    found = gmwm.wavelet_variance((with_gaps if name == "gaps" else series)(n), DT, **options)
    kind = "_".join([name, str(n), *map(str, options.values())])
    assert_as_recorded(f"variance/{kind}", all_of(found))


def test_robust_variances_of_a_longer_series():
    x = series(20_000, 6)
    x[::97] += 3.0
    wv = gmwm.wavelet_variance(x, DT, robust=True)
    assert_as_recorded("variance/variance_robust_of_20000", all_of(wv))


def test_variances_of_a_stream():
    """With many gaps of all lengths, in parts that are merged, then stored."""
    x = with_gaps(40_000, 7)
    x[np.random.default_rng(8).random(x.size) < 0.2] = np.nan
    stream = gmwm.StreamingVariance(DT)
    other = gmwm.StreamingVariance(DT, start=17_000)
    for block in np.split(x[:17_000], [3, 700, 9_000]):
        stream.update(block)
    other.update(x[17_000:])
    whole = stream.merge(other)
    found = {"arrays": whole._series[0].arrays(), "result": all_of(whole.result())}
    assert_as_recorded("variance/stream_gaps", found)
    complete = gmwm.StreamingVariance(DT)
    complete.update(series(30_000, 9))
    found = {"arrays": complete._series[0].arrays(), "result": all_of(complete.result())}
    assert_as_recorded("variance/stream_plain", found)


def test_the_allan_family():
    pytest.importorskip("allantools")
    x = series(1500, 10)
    steps = np.diff(x)
    found = {
        "octave": gmwm.deviations(x, DT).to_dict(),
        "decade": gmwm.deviations(x, DT, tau="decade", confidence=0.68).to_dict(),
        "steps": gmwm.deviations(steps, DT, kinds=("total", "hadamard"), tau=[0.02, 1.0]).to_dict(),
        "walk": gmwm.deviations(np.cumsum(x), DT).to_dict(),
        "flat": gmwm.deviations(np.cumsum(np.cumsum(x)), DT).to_dict(),
    }
    found["text"] = str(gmwm.deviations(x, DT))
    assert_as_recorded("variance/allan_family", found)


def test_a_transform_and_its_inverse():
    x = series(100, 11)
    found = {}
    for wavelet in ("haar", "db3"):
        result = modwt(x, wavelet, 4)
        found[wavelet] = {"all": result, "back": imodwt(result.detail, result.smooth, wavelet)}
        np.testing.assert_allclose(found[wavelet]["back"], x, rtol=1e-9)
    assert_as_recorded("variance/modwt", found)


def test_pooled_variances_and_pilot_spectra():
    parts = [
        gmwm.wavelet_variance(with_gaps(1000, 12), DT), gmwm.wavelet_variance(series(3000, 13), DT),
        gmwm.wavelet_variance(series(700, 14), DT),
    ]  # fmt: skip
    pooled = PooledVariance.of(parts)
    f = np.geomspace(1e-4, 50.0, 20)
    psds = [pilot_psd(p.variance, p.tau / DT, DT)(f, DT) for p in (*parts, pooled)]
    short = pilot_psd(parts[0].variance[:1], np.ones(1), DT)(f, DT)
    assert_as_recorded("variance/pooled", {"all": all_of(pooled), "psds": psds, "short": short})


def test_no_variance_dataclass_changes():
    assert_dataclasses_keep_the_rules("variance")


def test_arguments_of_the_variance_room_and_their_defaults():
    assert_as_recorded("variance/interface_variance", signatures_of("variance"))


@pytest.mark.parametrize("units", ["field", "si"])
def test_what_is_drawn_of_variances(units, monkeypatch):
    pictures = Pictures(monkeypatch)
    channel = Channel("gyro_x", 1e-4 * series(1500, 15), DT, "gyro", "rad/s")
    gmwm.wavelet_variance(channel, confidence=0.9).plot(units=units)
    if units == "si":
        pytest.importorskip("allantools")
        gmwm.deviations(channel, kinds=("total", "modified")).plot()
    assert_as_recorded(f"variance/drawn_variances_{units}", pictures.asked)
