"""A suspected clock: lines, resonances and densities that scale together."""

import pytest

import gmwm
from gmwm import Calibration, Sinusoid, WhiteNoise
from gmwm.comparison.clock import Feature, clock_ratio, suspected_clocks
from gmwm.estimate import estimate

AXES = ("gyro_x", "gyro_y", "accel_x", "accel_y")


def features(*frequencies, kind="line"):
    return [Feature(name, kind, f) for name in AXES for f in frequencies]


def densities(ratio, wobble=0.0):
    return {name: ratio * (1.0 + wobble * (-1) ** i) for i, name in enumerate(AXES)}


def test_two_lines_and_the_densities_show_a_clock():
    found = clock_ratio(features(7.0, 31.0), features(7.14, 31.62), densities(1.02**-0.5))
    assert found.ratio == pytest.approx(1.02, rel=1e-6)
    assert found.frequencies == ((7.0, 7.14), (31.0, 31.62))
    assert found.densities == pytest.approx(found.expected_densities)


def test_a_line_that_moved_otherwise_is_counted():
    first, second = features(0.5, 7.0, 31.0), features(0.45, 7.14, 31.62)
    assert clock_ratio(first, second, densities(1.02**-0.5)).others == 1


def test_the_order_inverts_the_ratio():
    there = clock_ratio(features(7.0, 31.0), features(7.14, 31.62), densities(1.02**-0.5))
    back = clock_ratio(features(7.14, 31.62), features(7.0, 31.0), densities(1.02**0.5))
    assert there.ratio * back.ratio == pytest.approx(1.0)


def test_an_engine_is_no_clock():
    # Harmonics move together too, but the noise is as before.
    assert clock_ratio(features(7.0, 14.0), features(7.7, 15.4), densities(1.0)) is None
    assert clock_ratio(features(7.0, 31.0), features(7.7, 31.0), densities(1.1**-0.5)) is None
    assert clock_ratio(features(7.0), features(7.0), densities(1.0)) is None
    assert clock_ratio([], features(7.0), densities(1.0)) is None


def test_one_line_alone_needs_every_density():
    one, moved, expected = features(7.0), features(7.35), 1.05**-0.5
    assert clock_ratio(one, moved, densities(expected)).ratio == pytest.approx(1.05)
    assert clock_ratio(one, moved, densities(expected, wobble=0.02)) is None
    few = dict(list(densities(expected).items())[:2])
    assert clock_ratio(one, moved, few) is None


def test_a_wrong_rate_is_suspected():
    def recorded(seed, true, name):
        """Two gyros with a line of 7 Hz and one of 31 Hz, sampled at another rate than stated."""
        truth = WhiteNoise(1e-4) + Sinusoid(4e-3, 7.0) + Sinusoid(4e-3, 31.0)
        data = {key: truth.simulate(20_000, 1.0 / true, 100 * seed + i)
                for i, key in enumerate(("gyro_x", "gyro_y"))}  # fmt: skip
        recording = gmwm.Recording.from_arrays(data, 100.0, {"gyro": "rad/s"})
        lines = [Sinusoid(frequency=f * 100.0 / true) for f in (7.0, 31.0)]
        fits = {key: estimate(WhiteNoise() + lines[0] + lines[1], recording[key]) for key in data}
        return Calibration(fits, {}, name, 100.0, 20_000)

    right, wrong = recorded(1, 100.0, "right"), recorded(2, 104.0, "wrong")
    (notice,) = suspected_clocks({"right": right, "wrong": wrong})
    assert notice.code == "clock-ratio"
    assert notice.source == "wrong" and notice.values["reference"] == "right"
    assert notice.values["ratio"] == pytest.approx(100.0 / 104.0, rel=1e-6)
    assert notice.values["densities"] == pytest.approx(1.04**0.5, rel=5e-3)
    assert notice.values["lines"] == 2
    assert suspected_clocks({"right": right, "other": recorded(3, 100.0, "other")}) == []
