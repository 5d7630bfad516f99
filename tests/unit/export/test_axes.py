"""Axes put together, from numbers made by hand."""

from dataclasses import replace

import numpy as np
import pytest

import gmwm
from gmwm import GaussMarkov, InputError, RandomWalk, WhiteNoise
from gmwm.export import Axis, Triad
from gmwm.filter_numbers import FilterNumbers
from gmwm.process import as_model
from imu_numbers import RATE, numbers

NAN = float("nan")


def axis(letter, N, K, sensor="gyro", **options):
    own = {"sigma": NAN, "tau": NAN, "initial_sd": 0.1 * N, "rate": 100.0} | options
    return Axis(f"{sensor}_{letter}", N, K, **own)


def test_an_axis_that_is_not_there_has_the_largest_numbers():
    two = (axis("x", 1e-2, 2e-4, "accel"), axis("y", 2e-2, 1e-4, "accel"))
    x, y, z = Triad("accel", two).xyz()
    assert (x.name, y.name, z.name) == ("accel_x", "accel_y", "accel_z")
    assert (z.N, z.K, z.initial_sd, z.rate) == (2e-2, 2e-4, 2e-3, 100.0)
    one = Triad("gyro", (axis("y", 1.0, 2.0),)).xyz()
    assert [each.name for each in one] == ["gyro_x", "gyro_y", "gyro_z"]
    named = Triad(
        "gyro", (Axis("left", 1.0, 2.0, NAN, NAN, 0.1), Axis("right", 3.0, 4.0, NAN, NAN, 0.1))
    )
    assert [each.name for each in named.xyz()] == ["left", "right", "gyro_z"]


def test_slow_processes_of_several_times_are_bounded_at_the_middle_one():
    pair = (axis("x", 1.0, NAN, sigma=2.0, tau=10.0), axis("y", 1.0, NAN, sigma=1.0, tau=40.0))
    z = Triad("gyro", pair).xyz()[2]
    assert z.tau == pytest.approx(20.0)
    assert z.sigma == pytest.approx(2.0 * np.sqrt(2.0))
    for tau in (5.0, 20.0):
        moved = pair[0].moved(tau)
        assert moved.sigma**2 * tau >= 40.0 * (1 - 1e-12)
        assert moved.sigma**2 / tau >= 0.4 * (1 - 1e-12)
        assert moved.sigma == pytest.approx(2.0 * np.sqrt(2.0))
    assert pair[0].moved(10.0).sigma == 2.0


@pytest.mark.parametrize(
    ("target", "form", "model", "key"),
    [
        ("kalibr", "N+K", WhiteNoise(1e-4), "K"),
        ("kalibr", "N+K", RandomWalk(1e-6), "N"),
        ("gazebo", "N+GM", WhiteNoise(1e-4), "sigma"),
        ("gazebo", "N+GM", GaussMarkov(1e-5, 60.0), "N"),
    ],
)
def test_numbers_by_which_a_filter_divides_are_there(target, form, model, key):
    given = numbers(form)
    lacking = replace(given["gyro_y"], model=as_model(model))
    with pytest.raises(InputError, match=f": {key} of gyro_y is zero, and filters divide by it"):
        gmwm.export(FilterNumbers({**given, "gyro_y": lacking}, rate=RATE), target)
