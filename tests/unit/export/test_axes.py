"""Axes put together, and the comments on them, from numbers made by hand."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import gmwm
from gmwm import GaussMarkov, InputError, RandomWalk, WhiteNoise
from gmwm.export.comments import above, below, comment, plain, wrapped
from gmwm.export.imu import Axis, ImuNumbers, Triad
from gmwm.filter_numbers import SensorNumbers
from gmwm.process import as_model
from imu_numbers import RATE, numbers

NAN = float("nan")


def axis(letter, N, K, sensor="gyro", **options):
    own = {"sigma": NAN, "tau": NAN, "initial_sd": 0.1 * N, "rate": 100.0} | options
    return Axis(f"{sensor}_{letter}", N, K, **own)


def imu(**options):
    gyro = Triad("gyro", (axis("x", 1e-3, 2e-5), axis("y", 3e-3, 1e-5), axis("z", 2e-3, 3e-5)))
    accel = Triad("accel", (axis("x", 1e-2, 2e-4, "accel"), axis("y", 2e-2, 1e-4, "accel")))
    return ImuNumbers(gyro, accel, "N+K", 60.0, "bound", ("a.csv, 60 s static",), **options)


def test_a_triad_has_the_largest_numbers_of_its_axes():
    triad = imu().gyro
    assert (triad.N, triad.K, triad.initial_sd, triad.rate) == (3e-3, 3e-5, 0.1 * 3e-3, 100.0)
    assert triad.xyz() == triad.axes
    common = SimpleNamespace(N=5e-3, K=6e-5, initial_sd=0.7)
    shared = Triad("gyro", triad.axes, common)
    assert (shared.N, shared.K, shared.initial_sd) == (5e-3, 6e-5, 0.7)


def test_upper_bounds_count_where_there_is_nothing_else():
    upper = frozenset({"K"})
    some = Triad("gyro", (axis("x", 1e-3, 9e-5, upper=upper), axis("y", 1e-3, 1e-5)))
    assert some.K == 1e-5 and not some.is_upper("K")
    none = Triad(
        "gyro", tuple(axis(c, 1e-3, k, upper=upper) for c, k in (("x", 9e-5), ("y", 1e-5)))
    )
    assert none.K == 9e-5 and none.is_upper("K") and not none.is_upper("N")
    common = Triad("gyro", none.axes, SimpleNamespace(N=1.0, K=2.0, initial_sd=3.0))
    assert common.K == 9e-5 and common.N == 1.0


def test_an_axis_that_is_not_there_has_the_largest_numbers():
    x, y, z = imu().accel.xyz()
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
    assert {"N": 1.0, "sigma": 2.0, "tau": 10.0}.items() <= pair[0].model.params.items()
    assert axis("x", 1.0, 3.0).model.params == {"N": 1.0, "K": 3.0}


def test_a_message_of_both_has_the_higher_rate():
    fast = Triad("accel", (axis("x", 1.0, 1.0, "accel", rate=250.0),))
    given = ImuNumbers(imu().gyro, fast, "N+K", 60.0, "bound")
    assert given.rate == 250.0
    lines = " ".join(above(given, "for x"))
    assert "gyros at 100 Hz, accelerometers at 250 Hz" in lines
    assert "gyros at" not in " ".join(above(imu(), "for x"))
    unknown = Triad("gyro", (axis("x", 1.0, 1.0, rate=NAN),))
    with pytest.raises(InputError, match="no sampling rate"):
        _ = ImuNumbers(unknown, unknown, "N+K", 60.0, "given").rate


def test_a_table_of_each_axis_and_its_consistency():
    gyro = Triad("gyro", (
        axis("x", 1e-3, 2e-5, nees={10.0: 0.5, 60.0: 1.0}), axis("y", 3e-3, 1e-5, nees={60.0: 2.0}),
    ))  # fmt: skip
    lines = below(ImuNumbers(gyro, imu().accel, "N+K", 60.0, "bound"), "spectral densities")
    start = lines.index("gyro: N [rad/s/sqrt(Hz)], K [rad/s^2/sqrt(Hz)], start [rad/s]")
    assert lines[start + 1].split() == ["N", "K", "start", "NEES", "10", "s", "NEES", "60", "s"]
    assert lines[start + 2].split() == ["gyro_x", "1.000e-03", "2.000e-05", "1.000e-04", "0.5", "1"]
    assert lines[start + 3].split() == ["gyro_y", "3.000e-03", "1.000e-05", "3.000e-04", "-", "2"]
    text = " ".join(lines)
    assert "NEES: expected error squared" in text and "shared:" not in text
    assert "NEES is not known" in text  # of the accelerometers


def test_a_table_with_shared_numbers():
    upper = frozenset({"K"})
    axes = tuple(
        axis(c, n, 1e-5, nees={60.0: 0.9}, upper=upper) for c, n in (("x", 1e-3), ("y", 3e-3))
    )
    shared = {"gyro_x": {60.0: 0.25}, "gyro_y": {60.0: 0.75}}
    given = ImuNumbers(Triad("gyro", axes, None, shared), imu().accel, "N+K", 60.0, "bound")
    lines = below(given, "spectral densities")
    start = next(k for k, line in enumerate(lines) if line.startswith("gyro: N"))
    assert lines[start + 1].split() == ["NEES", "60", "s"]
    assert lines[start + 2].split() == ["N", "K", "start", "shared", "own"]
    assert lines[start + 3].split()[:4] == ["shared", "3.000e-03", "<", "1.000e-05"]
    assert lines[start + 4].split()[-2:] == ["0.25", "0.9"]
    assert lines[start + 5].split()[-2:] == ["0.75", "0.9"]
    assert "shared: for all axes" in " ".join(lines)


@pytest.mark.parametrize(("more", "traded"), [(1.0004, False), (1.001, True)])
def test_an_axis_with_more_of_a_number_is_explained(more, traded):
    common = SimpleNamespace(N=1e-3, K=1e-5, initial_sd=1e-4)
    axes = (axis("x", 1e-3 * more, 0.5e-5), axis("y", 1e-3, 1e-5))
    given = ImuNumbers(Triad("gyro", axes, common, {}), imu().accel, "N+K", 60.0, "bound")
    assert ("use N and K as a pair" in " ".join(below(given, "x"))) is traded


def test_other_horizons_and_remarks():
    outlook = {"gyro": {10.0: (1e-3, 2e-5), 600.0: (2e-3, 0.0)}}
    lines = " ".join(map(str.strip, below(imu(outlook=outlook, remarks=("gyro_x: a\nline",)), "x")))
    assert (
        "gyro N, K for all axes by horizon: 10 s: 1.000e-03, 2.000e-05; 600 s: 2.000e-03," in lines
    )
    assert "0.000e+00" in lines and "gyro_x: a line" in lines
    assert "accel N, K for all" not in lines


def test_text_of_others_stays_on_its_line():
    assert plain("a\n b\t\\c\x1b[0m") == "a b ?c?[0m"
    assert len(plain("x" * 600)) == 500
    assert comment(["a", ""], "#") == ["# a", "#"]
    assert comment(["a--b"], "<!--") == ["<!--", "  a- -b", "-->"]
    lines = wrapped("word " * 40)
    assert all(len(line) <= 72 for line in lines) and lines[1].startswith("  word")


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
    with pytest.raises(InputError, match=f": {key} of gyro_y is zero, by which filters divide"):
        gmwm.export(SensorNumbers({**given, "gyro_y": lacking}, rate=RATE), target)
