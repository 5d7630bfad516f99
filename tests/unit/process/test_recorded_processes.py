"""All that the processes give, as recorded: curves, spectra, state spaces, grids, words."""

from contextlib import suppress

import numpy as np
import pytest

import gmwm
from classes import assert_dataclasses_keep_the_rules, signatures_of
from gmwm.process import CATALOGUE
from gmwm.process.catalogue import compiled_levels, shaped_curve, shaped_slope
from gmwm.process.kinds import arma
from gmwm.process.kinds.arma import _decay_lags
from gmwm.process.spectral import quadrature
from gmwm.process.wavelet_gain import gain_weights, pair_weights
from gmwm.process.wavelets import wavelet
from recorded import assert_as_recorded, summed

DT = 0.02
M = np.array([1.0, 2.0, 3.0, 8.0, 100.0, 4096.0])
F = np.array([1e-4, 0.03, 1.0, 7.0, 24.0])
FLAGS = (
    "separable_shape", "is_white", "is_band_limited", "is_walk", "is_drift", "is_line",
    "has_finite_state_space", "is_repeatable", "is_open",
)  # fmt: skip


def curves_of(process):
    shape = tuple(process.values[each.name] for each in process.shape_parameters)
    found = {
        "psd": process.psd(F, DT), "haar": process.haar_variance(M * DT, DT),
        "slopes": process.unit_haar_slopes(shape, M * DT, DT),
        "space": summed(process.state_space(DT)),
    }  # fmt: skip
    free = process.shape_to_free(shape)
    found["free"] = [free, process.shape_from_free(free)]
    with suppress(gmwm.InputError):
        found["covariance"] = process.autocovariance(np.arange(12), DT)
    with suppress(gmwm.InputError):
        found["db3"] = process.wavelet_variance(M[[0, 1, 3]] * DT, DT, "db3")
    if shape:
        found["unit"] = process.unit_haar_curves(M * DT, DT)(shape)
    if not isinstance(process, gmwm.Resonance | gmwm.AR | gmwm.ARMA | gmwm.ARIMA):
        found["drawn"] = process.simulate(50, DT, 1)  # roots of covariances have any sign
    return found


@pytest.mark.parametrize("kind", CATALOGUE, ids=lambda kind: kind.__name__)
def test_a_process(kind):
    examples = kind.examples()
    one = examples[0]
    found = {
        "flags": [flag for flag in FLAGS if getattr(one, flag)], "texts": [one.label, one.named()],
        "order": [one.prefix, one.repeatable, one.ordered_by, one.compiled_kind],
        "parameters": [f"{p.name} {p.unit} {p.role} {p.lower} {p.upper}" for p in one.parameters],
        "lines": list(one.lines()), "drift": one.drift_rate(), "dict": one.to_dict(),
    }  # fmt: skip
    if one.shape_parameters:
        found["grids"] = [np.array(one.shape_grid(DT, n)) for n in (3, 40, 5000)]
    found |= {repr(process): curves_of(process) for process in examples}
    assert_as_recorded(f"process/process_{kind.__name__}", found)


def test_grids_of_coefficients():
    found = {
        repr(each): np.array(each.shape_grid(1.0, 1000))
        for each in (gmwm.AR(1), gmwm.AR(2), gmwm.ARMA(1, 1), gmwm.AR(4), gmwm.ARMA(3, 2))
    }
    assert [len(each) for each in found.values()] == [5, 25, 25, 625, 700]  # fmt: skip
    np.testing.assert_allclose(found["AR(ar=1)"][:, 0], np.tanh([-1.5, -0.3, 0.5, 1.5, 3.0]))
    orders = (((), (0.3, 0.2)), ((0.5,), ()), ((0.9, -0.5), (0.1,)))
    found["lags"] = [_decay_lags(*each) for each in orders]
    assert_as_recorded("process/grids", found)


def test_compiled_curves():
    levels = compiled_levels(M * DT, DT, (1, 2, 3))
    cases = [
        (1, (0.5,)),
        (1, (1e-4,)),
        (1, (1e6,)),
        (2, (3.0, 0.1)),
        (2, (1e-5, 0.3)),
        (3, (5.0, 2.0, 0.7)),
        (3, (30.0, 2.0, 0.7)),
        (3, (5.0, 12.0, 0.3)),
    ]
    found = [
        [curve(kind, np.array(shape), levels) for curve in (shaped_curve, shaped_slope)]
        for kind, shape in cases
    ]
    assert_as_recorded("process/compiled_curves", found)


def test_weights_of_gains():
    found = {
        "haar": quadrature((1.0, 2.0, 16.0, 300.0, 5000.0)),
        "db2": gain_weights("db2", 12),
        "pairs": pair_weights("db3", 4),
    }
    for name in ("haar", "db4", "coif2"):
        filters, f = wavelet(name), np.linspace(0.0, 0.5, 9)
        found[name + " filter"] = [
            filters,
            filters.gains(4, f),
            filters.width(3),
            [filters.levels(n) for n in (1, 7, 8, 9, 100)],
            np.abs(filters.transfer(3, f)),
        ]
    assert_as_recorded("process/weights_of_gains", found)


def test_no_process_dataclass_changes():
    assert_dataclasses_keep_the_rules("process")


def test_arguments_of_the_process_room_and_their_defaults():
    assert_as_recorded("process/interface_process", signatures_of("process"))


def test_curves_of_coefficients_need_no_integral(monkeypatch):
    """But between whole samples, and where the memory is longer than is summed."""
    asked = []
    real = arma.spectral.haar_variance

    def counted(psd, tau, dt):
        asked.append(tau)
        return real(psd, tau, dt)

    monkeypatch.setattr(arma.spectral, "haar_variance", counted)
    gmwm.AR([0.9], 1.0).haar_variance(M * DT, DT)
    gmwm.MA([0.5], 1.0).haar_variance(M * DT, DT)
    assert not asked
    for process, m in ((gmwm.AR([0.9], 1.0), 1.5), (gmwm.AR([0.9], 1.0), 0.5),
                       (gmwm.AR([0.99999], 1.0), 4.0)):  # fmt: skip
        process.haar_variance(np.array([1.0, m]) * DT, DT)
    assert len(asked) == 3
