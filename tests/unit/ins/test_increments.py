"""Increments that are none."""

import numpy as np
import pytest

from gmwm import InputError
from gmwm.ins import Imu

RIGHT = np.zeros((5, 3))


@pytest.mark.parametrize("name", ["rotation", "velocity"])
@pytest.mark.parametrize("shape", [(5,), (3,), (5, 2), (5, 4), (5, 3, 1), ()])
def test_a_shape_that_is_refused(name, shape):
    values = {"rotation": RIGHT, "velocity": RIGHT} | {name: np.zeros(shape)}
    with pytest.raises(InputError, match=f"{name} has shape"):
        Imu(0.1, **values)


def test_rotation_and_velocity_have_a_row_each():
    for velocity in (RIGHT[:4], np.zeros((6, 3))):
        with pytest.raises(InputError, match="velocity has shape"):
            Imu(0.1, RIGHT, velocity)
    assert Imu(0.1, RIGHT, RIGHT).n == 5
    assert Imu(0.1, RIGHT[:1], RIGHT[:1]).n == 1


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_numbers_are_finite_and_intervals_positive(value):
    wrong = RIGHT.copy()
    wrong[3, 1] = value
    with pytest.raises(InputError):
        Imu(0.1, wrong, RIGHT)
    for dt in (0.0, -1.0, value):
        with pytest.raises(InputError):
            Imu(dt, RIGHT, RIGHT)
