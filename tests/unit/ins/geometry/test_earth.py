import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from gmwm.ins.geometry import gravity, ned_difference, offset, radii_at

LATITUDES = st.floats(-math.radians(88), math.radians(88))


def potential_gravity(lat: float, h: float) -> float:
    """Normal gravity of the WGS-84 level ellipsoid in closed form (NGA.STND.0036, ch. 4)."""
    a, flattening, gm, rate = 6378137.0, 1 / 298.257223563, 3.986004418e14, 7.292115e-5
    b = a * (1 - flattening)
    focal = math.sqrt(a * a - b * b)
    e2 = flattening * (2 - flattening)
    normal = a / math.sqrt(1 - e2 * math.sin(lat) ** 2)
    x, z = (normal + h) * math.cos(lat), (normal * (1 - e2) + h) * math.sin(lat)
    r2 = x * x + z * z - focal**2
    u = math.sqrt(0.5 * r2 * (1 + math.sqrt(1 + 4 * focal**2 * z * z / r2**2)))
    big = math.hypot(u, focal)
    beta = math.atan2(z * big, u * x)
    w = math.sqrt((u * u + (focal * math.sin(beta)) ** 2) / big**2)

    def q(value: float) -> float:
        ratio = value / focal
        return 0.5 * ((1 + 3 * ratio**2) * math.atan(1 / ratio) - 3 * ratio)

    q_prime = 3 * (1 + (u / focal) ** 2) * (1 - u / focal * math.atan(focal / u)) - 1
    radial = gm / big**2 + (rate * a) ** 2 * focal / big**2 * q_prime / q(b) * (
        0.5 * math.sin(beta) ** 2 - 1 / 6
    )
    g_u = (-radial + rate**2 * u * math.cos(beta) ** 2) / w
    sc = math.sin(beta) * math.cos(beta)
    g_beta = ((rate * a) ** 2 / big * q(u) / q(b) - rate**2 * big) * sc / w
    return math.hypot(g_u, g_beta)


@pytest.mark.parametrize("lat", [-80, -45, 0, 30, 60, 88])
@pytest.mark.parametrize(("h", "bound"), [(0, 1e-7), (1000, 1e-6), (10_000, 3e-6)])
def test_gravity_is_that_of_the_normal_potential(lat: float, h: float, bound: float) -> None:
    # The second-order free-air formula leaves out terms of (h/a)^3 and of flattening (h/a)^2.
    phi = math.radians(lat)
    assert gravity(phi, float(h)) == pytest.approx(potential_gravity(phi, h), abs=bound)


def test_radii_and_gravity_agree_with_pyins() -> None:
    theirs = pytest.importorskip("pyins.earth")
    for lat in (-75.0, -10.0, 0.0, 46.5, 89.0):
        north, east, _ = theirs.principal_radii(lat, 0.0)
        assert radii_at(math.sin(math.radians(lat))) == pytest.approx((north, east), rel=1e-12)
        assert gravity(math.radians(lat), 0.0) == pytest.approx(theirs.gravity(lat, 0), rel=1e-9)


@given(LATITUDES, st.floats(-4, 4), st.floats(0, 2 * math.pi), st.floats(1, 3000))
def test_differences_are_distances_in_space(
    lat: float, lon: float, bearing: float, distance: float
) -> None:
    pymap3d = pytest.importorskip("pymap3d")
    ned = np.array([distance * math.cos(bearing), distance * math.sin(bearing), 40.0])
    here = np.array([lat, lon, 700.0])
    there = offset(here, ned)
    points = [np.array(pymap3d.geodetic2ecef(*p, deg=False)) for p in (here, there)]
    # The chord over d metres differs from the way by curvature only; within 2 deg of a pole the
    # parallel is a tight circle.
    bound = 1e-3 + distance**3 / (6.37e6 * math.cos(lat)) ** 2
    assert np.linalg.norm(points[1] - points[0]) == pytest.approx(
        np.linalg.norm(ned), abs=bound + 40.0 * distance / 6.37e6
    )
    np.testing.assert_allclose(ned_difference(there, here), ned, atol=1e-6)
    np.testing.assert_allclose(ned_difference(here, there), -ned, atol=1e-6)


def test_small_differences_are_those_of_pymap3d() -> None:
    pymap3d = pytest.importorskip("pymap3d")
    reference = np.array([-0.9, 2.0, 120.0])
    lla = reference + np.array([[3e-7, -5e-7, 2.0], [0, 1e-6, 0], [-1e-6, 0, -1]])
    east, north, up = pymap3d.geodetic2enu(*lla.T, *reference, deg=False)
    # Over 10 m the tangent plane leaves the Earth by 10 micrometres.
    expected = np.stack([north, east, -up], axis=-1)
    np.testing.assert_allclose(ned_difference(lla, reference), expected, atol=2e-5)


@pytest.mark.parametrize("turns", [-2, 0, 1])
def test_the_date_line_is_crossed_the_shorter_way(turns: int) -> None:
    west = np.array([0.3, math.pi - 1e-6, 0.0])
    east = np.array([0.3, -math.pi + 1e-6 + 2 * math.pi * turns, 0.0])
    _, transverse = radii_at(math.sin(0.3))
    expected = 2e-6 * transverse * math.cos(0.3)
    assert ned_difference(east, west)[1] == pytest.approx(expected, rel=1e-6)
    assert ned_difference(west, east)[1] == pytest.approx(-expected, rel=1e-6)
