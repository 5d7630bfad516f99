"""Distributions of our own, against those of scipy.stats."""

import numpy as np
import pytest
from scipy import stats

from gmwm._core import distributions

CHANCES = np.array([1e-12, 1e-3, 0.3, 0.5, 0.9, 1.0 - 1e-6])
VALUES = np.array([-1.0, 0.0, 1e-8, 0.3, 1.0, 5.0, 40.0, 300.0, np.nan])
DOFS = (0.5, 1.0, 2.3, 37.0, 1e5)


@pytest.mark.parametrize(
    ("name", "method", "arguments"),
    [
        *(("norm", method, (VALUES,)) for method in ("cdf", "sf")),
        *(("norm", method, (CHANCES,)) for method in ("ppf", "isf")),
        *(("chi2", method, (VALUES, dof)) for method in ("cdf", "sf") for dof in DOFS),
        *(("chi2", method, (CHANCES, dof)) for method in ("ppf", "isf") for dof in DOFS),
        *(("t", "sf", (VALUES, dof)) for dof in DOFS),
        *(("t", method, (CHANCES, dof)) for method in ("ppf", "isf") for dof in DOFS),
        *(("binom", "sf", (k, 10_000, 0.003)) for k in (-1, 0, 3, 60, 10_000)),
        *(("gennorm", "sf", (VALUES[1:], shape)) for shape in (0.4, 1.0, 3.0)),
    ],
)
def test_as_scipy(name, method, arguments):
    ours = {"t": "student"}.get(name, name)
    found = getattr(getattr(distributions, ours), method)(*arguments)
    np.testing.assert_allclose(found, getattr(getattr(stats, name), method)(*arguments), rtol=1e-8)


@pytest.mark.parametrize("dof", DOFS)
def test_limits_of_fisher_are_passed_as_often_as_asked(dof):
    # Its own isf of small chances, from 1 - p, loses digits that this one has.
    for both in ((dof, 12.5), (12.5, dof)):
        limit = distributions.fisher.isf(CHANCES, *both)
        few = CHANCES < 0.9
        np.testing.assert_allclose(stats.f.sf(limit[few], *both), CHANCES[few], rtol=1e-8)
        np.testing.assert_allclose(stats.f.cdf(limit[~few], *both), 1.0 - CHANCES[~few], rtol=1e-8)
