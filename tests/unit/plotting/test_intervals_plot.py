"""Ratios with their intervals: what is drawn where."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

from gmwm.plotting import intervals


def test_every_row_has_its_interval_and_its_single_values():
    rows = {"first": ([0.9, 1.2], (1.0, 0.8, 1.3)), "second": ([3.0, 5.0], (4.0, 2.0, 7.0))}
    figure = intervals({"ratio": rows, "other": {"first": rows["first"]}})
    left, right = figure.axes
    assert (left.get_xlabel(), right.get_xlabel()) == ("ratio", "other")
    assert left.get_xscale() == "log"
    assert [each.get_text() for each in left.get_yticklabels()] == list(rows)
    drawn = [np.column_stack(line.get_data()) for line in left.lines]
    for place, (values, (value, lower, upper)) in enumerate(rows.values()):
        bar, middle, single = drawn[3 * place : 3 * place + 3]
        assert bar.tolist() == [[lower, place], [upper, place]]
        assert middle.tolist() == [[value, place]]
        assert single[:, 0] == pytest.approx(values)
    plt.close(figure)
