import math

import numpy as np
import pytest

from gmwm.errors import InputError
from gmwm.ins import NavState, Trajectory
from gmwm.ins.geometry import offset

PLACE = np.array([-0.6, math.pi - 1e-6, 40.0])


def moving(n: int = 100, dt: float = 0.1) -> Trajectory:
    t = dt * np.arange(n + 1)
    ned = np.stack([5 * np.sin(0.3 * t), 12.0 * t, 0.5 * np.cos(0.2 * t)], axis=-1)
    return Trajectory.from_arrays(dt, offset(PLACE, ned), np.zeros((n + 1, 3)))


def test_velocity_is_that_of_the_track() -> None:
    found = moving()
    t = found.time
    expected = np.stack([1.5 * np.cos(0.3 * t), 12.0 + 0 * t, -0.1 * np.sin(0.2 * t)], axis=-1)
    # Cubic splines: dt^3 f''''/24 inside, ten times that at the ends; offset() uses radii half-way.
    np.testing.assert_allclose(found.velocity, expected, atol=2e-4)


def test_wrapped_longitudes_make_no_jump() -> None:
    one = moving()
    lla = one.lla.copy()
    lla[:, 1] = (lla[:, 1] + np.pi) % (2 * np.pi) - np.pi
    assert np.ptp(lla[:, 1]) > 6.0
    other = Trajectory.from_arrays(one.dt, lla, one.rpy)
    np.testing.assert_allclose(other.velocity, one.velocity, atol=1e-6)
    assert np.ptp(other.lla[:, 1]) < 1e-3


@pytest.mark.parametrize("n", [1, 2, 3])
def test_few_epochs(n: int) -> None:
    found = moving(n)
    assert (found.n, found.duration) == (n, pytest.approx(0.1 * n))
    np.testing.assert_allclose(found.velocity[:, 1], 12.0, atol=1e-3)


def test_segments_share_epochs() -> None:
    found = moving().segment(2.0, 3.04)
    assert found.n == 10
    np.testing.assert_array_equal(found.lla, moving().lla[20:31])
    np.testing.assert_array_equal(found.state(-1).velocity, moving().state(30).velocity)


@pytest.mark.parametrize(("start", "end"), [(-1, 3), (3, 3), (4, 2), (0, 11), (float("nan"), 2)])
def test_segments_outside_are_refused(start: float, end: float) -> None:
    with pytest.raises(InputError, match="give two times in order, within 0 to 10 s"):
        moving().segment(start, end)


@pytest.mark.parametrize("index", [101, -102, 10**9])
def test_epochs_outside_are_refused(index: int) -> None:
    with pytest.raises(InputError, match="the trajectory has 101 epochs"):
        moving().state(index)


def bad_place(row: int, column: int, value: float) -> np.ndarray:
    lla = np.tile([0.5, 0.1, 3.0], (5, 1))
    lla[row, column] = value
    return lla


@pytest.mark.parametrize(
    ("lla", "message"),
    [
        (bad_place(2, 0, math.radians(89.5)), r"latitude 89\.5 deg at index 2 is too near a pole"),
        (bad_place(1, 0, -1.57), "too near a pole"),
        (bad_place(3, 2, np.nan), "lla is not finite at index 3"),
        (bad_place(4, 1, np.inf), "lla is not finite at index 4"),
        (np.zeros((1, 3)), r"lla has shape \(1, 3\)"),
        (np.zeros((5, 2)), r"lla has shape \(5, 2\)"),
        ("north", "lla holds something that is not a number"),
    ],
)
def test_impossible_places_are_refused(lla: np.ndarray, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Trajectory.from_arrays(0.1, lla, np.zeros((5, 3)))


def test_different_lengths_are_refused() -> None:
    with pytest.raises(InputError, match=r"rpy has shape \(4, 3\)"):
        Trajectory.from_arrays(0.1, np.zeros((5, 3)), np.zeros((4, 3)))
    with pytest.raises(InputError, match="dt = -1"):
        Trajectory.from_arrays(-1, np.zeros((5, 3)), np.zeros((5, 3)))
    with pytest.raises(InputError, match=r"velocity = .*: give three finite numbers"):
        NavState(np.zeros(3), np.zeros(2), np.zeros(3))
