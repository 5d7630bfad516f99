import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from gmwm.ins.trajectory.trajectory import smoothed, unwrapped_angles


def test_smoothing_keeps_cubics_and_slow_waves() -> None:
    t = 0.01 * np.arange(1001)
    cubic = np.stack([1 + t, 500 - t**2, t**3 - 4 * t], axis=-1)
    np.testing.assert_allclose(smoothed(cubic, 0.01, 0.5), cubic, atol=1e-9)
    wave = np.stack([np.sin(2 * np.pi * f * t) for f in (0.1, 0.2, 20.0)], axis=-1)
    found = smoothed(wave, 0.01, 1.0)
    # A cubic spline with knots every h misses a wave by (w h)^4/384 at most; w h = 0.63.
    np.testing.assert_allclose(found[:, :2], wave[:, :2], atol=1e-3)
    assert np.std(found[100:-100, 2]) < 0.01


@pytest.mark.parametrize("dt", [0.01, 0.001])
@pytest.mark.parametrize("n", [101, 5000])
def test_smoothing_solves_least_squares(n: int, dt: float) -> None:
    rng = np.random.default_rng(n)
    values = 1e3 + rng.normal(size=(n + 1, 3))
    found = smoothed(values, dt, 2.0)
    # The residuals are orthogonal to every cubic spline on the same knots.
    x = dt * np.arange(n + 1)
    spans = max(round(4.0 * n * dt), 1)
    knots = np.linspace(0.0, x[-1], spans + 1)
    other = CubicSpline(knots, rng.normal(size=spans + 1))(x) if spans > 3 else x**3
    product = (values - found).T @ other
    assert np.max(np.abs(product)) < 1e-9 * np.linalg.norm(other) * np.linalg.norm(values)


def test_pitch_is_never_unwrapped() -> None:
    rpy = np.zeros((4, 3))
    rpy[:, 1] = [1.5, 0.7, -0.7, -1.5]
    rpy[:, 0] = [3.1, -3.1, -3.0, 3.1]
    found = unwrapped_angles(rpy)
    np.testing.assert_array_equal(found[:, 1], rpy[:, 1])
    assert np.max(np.abs(np.diff(found[:, 0]))) < 0.3
