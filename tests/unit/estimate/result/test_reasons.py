"""Why a fit is not valid: nothing of a valid one, a sentence for each condition that is not met."""

import warnings

import numpy as np
import pytest

import gmwm
from gmwm import GaussMarkov, RandomWalk, WhiteNoise
from gmwm.issues import CATALOGUE

X = gmwm.simulate(WhiteNoise(1.0) + RandomWalk(0.01), n=50_000, rate=1.0, seed=1)


def test_a_valid_fit_has_none():
    fit = gmwm.fit("N + K", X, rate=1.0)
    assert fit.valid and not fit.reasons


def test_each_condition_that_is_not_met_has_a_sentence():
    with pytest.warns(gmwm.FitWarning):
        fit = gmwm.fit("N + K + 2 GM", X, rate=1.0)
    assert fit.reasons.keys() <= {issue.lacks for issue in CATALOGUE.values()}
    bad = [notice for notice in fit.notices if notice.severity == "bad"]
    said = " ".join(fit.reasons.values()).casefold()
    assert bad and all(notice.text.casefold() in said for notice in bad)
    assert all(why.endswith(".") for why in fit.reasons.values())


@pytest.mark.parametrize("model", ["N", "N + GM", "N + 3 GM", "B"])
def test_valid_is_the_same_as_no_reason(model):
    with warnings.catch_warnings(action="ignore"):
        fit = gmwm.fit(model, X, rate=1.0)
    assert fit.valid is (not fit.reasons)


def test_units_of_a_printed_fit():
    values = np.radians(gmwm.simulate(WhiteNoise(0.2 / 60) + GaussMarkov(0.01, 20), 20_000, 0.1, 2))
    recording = gmwm.Recording.from_arrays({"gyro_x": values}, 10.0, {"gyro": "rad/s"})
    fit = gmwm.fit("N + GM", recording["gyro_x"])

    field, si = fit.text(), fit.text("si")
    assert str(fit) == field and "deg/sqrt(h)" in field and "deg/h" in field
    assert "rad/s/sqrt(Hz)" in si and "deg" not in si.partition("objective")[0]
    shown = float(next(line for line in field.splitlines() if line.startswith("N ")).split()[1])
    assert shown == pytest.approx(np.degrees(fit.params["N"]) * 60.0, rel=1e-4)
    with pytest.raises(gmwm.InputError, match="units = 'SI': choose from field, si"):
        fit.text("SI")
