"""The inconsistency of lines in the Allan plot: computed, and seen."""

import numpy as np
import pytest

from gmwm.study import summary as appendix
from gmwm.study.summary import (
    allan_least_squares,
    converge,
    convergence_table,
    expectation,
    raw_estimates,
)


def test_lines_are_exact_where_each_process_is_alone():
    tau = np.exp2(np.arange(10))
    np.testing.assert_allclose(allan_least_squares(tau, 0.04 / tau)[0], 0.04)
    np.testing.assert_allclose(allan_least_squares(tau, 4e-4 * tau / 3.0)[1], 4e-4)


def test_expectation_by_hand():
    white = np.array([1.0, 2.0, 4.0, 8.0])
    walk = 4e-4 * (2.0 * white**2 + 1.0) / (6.0 * white)
    leaked = np.sum(walk / white) / np.sum(white**-2)
    assert expectation()[0] == pytest.approx(0.04 + leaked, rel=1e-12)
    last = np.array([16.0, 32.0, 64.0, 128.0])
    line = last / 3.0
    seen = 0.04 / last + 4e-4 * (2.0 * last**2 + 1.0) / (6.0 * last)
    assert expectation()[1] == pytest.approx(line @ seen / (line @ line), rel=1e-12)


@pytest.mark.slow
def test_means_fall_on_the_expectation_and_not_on_the_truth(monkeypatch):
    monkeypatch.setattr(appendix, "LENGTHS", (2_000, 30_000))
    rows = converge(runs=40, seed=3)
    truth = np.array([0.04, 4e-4])
    for row in rows:
        # Four standard errors of the means.
        assert np.all(np.abs(row.means[0] - expectation()) < 4.0 * row.errors[0])
    last = rows[-1]
    assert np.all(np.abs(last.means[2] - truth) < 4.0 * last.errors[2])
    assert np.all(last.means[0] - truth > 4.0 * last.errors[0])
    raw = raw_estimates(rows)
    assert raw.num_rows == 2 * 40 * 3
    assert raw["sigma2_RW"][-1].as_py() == last.estimates[-1, 2, 1]
    report = convergence_table(rows)
    assert max(map(len, report.splitlines())) <= 80
    assert "sigma2_RW, truth 0.0004" in report
