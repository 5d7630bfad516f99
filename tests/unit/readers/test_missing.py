"""Missing samples, counted and reported."""

import numpy as np
from hypothesis import given, strategies as st

from gmwm.readers.recording import Channel, Missing, notices_of_gaps


@given(st.lists(st.booleans(), min_size=1, max_size=60))
def test_samples_and_gaps_are_counted(gone):
    found = Missing.of(np.where(gone, np.nan, 1.0))
    runs = [len(run) for run in "".join(".#"[each] for each in gone).split(".") if run]
    expected = (len(gone), sum(gone), len(runs), max(runs, default=0))
    assert (found.n, found.samples, found.gaps, found.longest) == expected


def test_channels_that_miss_the_same_have_one_notice():
    gone = np.nan
    series = {"a": [1, gone, gone, 1, gone], "b": [1, gone, gone], "d": [1, 1, 1, 1, 1]}
    series["c"] = series["a"]
    found = notices_of_gaps(Channel(name, np.array(series[name]), 1.0) for name in "abcd")
    assert [(each.where, each.text) for each in found] == [
        ("a, c", "each 3 of 5 samples missing, in 2 gaps, the longest 2 samples"),
        ("b", "2 of 3 samples missing, in one gap"),
    ]
    (all_gone,) = notices_of_gaps([Channel("a", np.full(3, gone), 1.0)])
    assert all_gone.text == "all 3 samples missing"
