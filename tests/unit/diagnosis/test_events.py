"""Where events begin and end, and what is said of them, from prediction errors made by hand."""

from itertools import pairwise

import numpy as np
import pytest
from examining import examined, only

from gmwm.diagnosis import tuning
from gmwm.diagnosis.events import _LISTED, event, find_events, with_single_outliers
from gmwm.diagnosis.innovations import Innovations, innovations

N, G = 1000, tuning.GUARD


def spans(*sizes, n=N, rounding=0.0, scale=1.0):
    """Events of prediction errors of zero but for (place, size)."""
    values = np.zeros(n)
    for place, size in sizes:
        values[place] = size
    known = np.ones(n, dtype=bool)
    return find_events(Innovations(values, known, np.full(n, scale), rounding))


@pytest.mark.parametrize(
    ("sizes", "expected"),
    [
        ([], []),
        ([(500, 9.0)], [(500 - G, 501 + G)]),
        ([(500, -9.0)], [(500 - G, 501 + G)]),
        ([(500, 4.5)], []),  # beyond the ringing of another, no event of its own
        ([(3, 9.0)], [(0, 4 + G)]),
        ([(N - 2, 9.0)], [(N - 2 - G, N)]),
        ([(500, 9.0), (524, 4.5)], [(500 - G, 525 + 24)]),  # as long again
        ([(500, 9.0), (525, 4.5)], [(500 - G, 501 + G)]),
        ([(500, 9.0), (520, 4.5), (540, 4.5)], [(500 - G, 541 + 40)]),
        ([(500, 9.0), (524, 3.9)], [(500 - G, 501 + G)]),
        ([(500, 9.0), (526 + G, -9.0)], [(500 - G, 501 + G), (526, 527 + 2 * G)]),
        ([(400, 9.0), (420, 9.0), (449, 9.0)], [(392, 450 + G)]),  # 441 begins where 440 rang
        ([(400, 9.0), (420, 9.0), (450, 9.0)], [(392, 441), (442, 451 + G)]),
    ],
)
def test_an_event_is_its_errors_a_guard_before_and_what_rings_after(sizes, expected):
    assert list(spans(*sizes)) == expected


def test_errors_are_compared_with_the_noise_around_them_less_rounding():
    assert spans((500, 9.0), scale=2.1) == ()
    assert spans((500, 9.0), scale=1.5) != ()
    assert spans((500, 9.0), rounding=5.0) == ()
    assert spans((500, 9.0), rounding=3.0) != ()


@pytest.mark.parametrize(("n", "size", "found"), [(1000, 4.95, True), (1000, 4.85, False)])
def test_one_of_a_thousand_records_of_noise_has_an_event(n, size, found):
    # Gaussian errors: of 1000 the largest is beyond 4.89 with a chance of 0.1 %.
    assert bool(spans((500, size), n=n)) is found
    assert bool(spans((500, size), n=100 * n)) is False


@pytest.mark.parametrize(("length", "both"), [(49, True), (50, False)])
def test_outliers_are_left_out_beside_events_unless_these_are_many(length, both):
    values = np.random.default_rng(1).uniform(-1.0, 1.0, N)
    values[100] = 50.0
    errors = Innovations(values, np.ones(N, dtype=bool), np.ones(N), 0.0)
    event = (N - length, N)
    expected = ((100, 101), event) if both else ((100, 101),)
    assert with_single_outliers((event,), errors, values, 0.0) == expected


def test_a_sample_is_predicted_from_as_many_beside_it_as_the_order_and_none_missing():
    values = np.random.default_rng(1).standard_normal(N)
    short, enough = tuning.ORDER + 1, tuning.ORDER + 2
    places = np.cumsum([100, short + 1, enough + 1])
    values[places] = np.nan
    known = innovations(values, 0.0).known
    counts = [np.count_nonzero(known[a:b]) for a, b in pairwise([0, *places])]
    assert counts == [100, 0, 2]  # forwards one, backwards one


def notice(values, events, scatter=0.1):
    return only(event(examined(values, scatter=scatter, events=events)))


def test_what_is_said_of_an_event():
    values = np.full(2000, 5.0)
    values[:700] = 1.0  # too far away to be beside it
    values[1000:1004] = [5.5, 3.0, np.nan, 5.0]
    values[[999, 1004]] = np.nan
    found = notice(values, [(1000, 1004)])
    assert found.values == pytest.approx({
        "count": 1.0, "time": 10.0, "height": -2.0, "duration": 0.04, "samples": 4.0,
        "variance_share": (4.25 / 0.01 - 4.0) / 1997.0,
    })  # fmt: skip
    assert found.severity == "warning"
    assert "a spike or shock" in found.text and "at 10 s, 0.04 s long" in found.text
    assert notice(values, []) is None


@pytest.mark.parametrize(("height", "severity"), [(0.5, "note"), (1.0, "warning")])
def test_an_event_is_harmful_beyond_what_the_variance_is_known_to(height, severity):
    values = np.zeros(5000)  # whose variance is known to 2 %: 100 samples' worth
    values[3000] = height
    assert notice(values, [(3000, 3001)], scatter=0.06).severity == severity
    share = notice(values, [(3000, 3001)], scatter=0.06).values["variance_share"]
    assert share == pytest.approx((height**2 / 0.0036 - 1.0) / 5000)
    assert notice(values, [(3000, 3001)], scatter=0.0).values["variance_share"] == np.inf


@pytest.mark.parametrize("many", [2, _LISTED + 1, _LISTED + 2])
def test_the_largest_of_many_is_named_and_the_others_are_listed(many):
    values = np.zeros(5000)
    places = 100 * np.arange(1, many + 1)
    values[places] = 1.0
    values[200] = -3.0
    found = notice(values, [(p, p + 1) for p in places])
    assert found.values["count"] == many
    assert (found.values["time"], found.values["height"]) == (2.0, -3.0)
    listed = many <= _LISTED + 1
    others = ", ".join(str(p // 100) for p in places if p != 200)
    assert (f"(others at {others} s)" in found.text) is listed
