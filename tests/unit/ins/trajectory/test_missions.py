import math

import numpy as np
import pytest

from gmwm.errors import InputError
from gmwm.ins import car_drive, emulate, fixed_wing_loiter, helicopter_mapping
from gmwm.ins.geometry import ned_difference


def test_strips_lie_side_by_side() -> None:
    found = helicopter_mapping(heading=0.0, strip=1500.0, dt=0.1, duration=900.0)
    ned = ned_difference(found.lla, found.lla[0])
    on_strip = (np.abs(np.sin(found.rpy[:, 2])) < 1e-9) & (np.abs(found.velocity[:, 0]) > 0.99 * 30)
    edges = np.flatnonzero(np.diff(on_strip.astype(int), prepend=0, append=0))
    strips = [ned[a:b] for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a > 100][:-1]
    assert len(strips) >= 4
    sides = [np.mean(strip[:, 1]) for strip in strips]
    np.testing.assert_allclose(np.diff(sides), 300.0, atol=1.0)
    begin = max(np.min(strip[:, 0]) for strip in strips)
    end = min(np.max(strip[:, 0]) for strip in strips)
    assert end - begin == pytest.approx(1500.0, abs=120.0)


def test_the_car_stops_turns_and_climbs() -> None:
    found = car_drive(dt=0.1)
    speed = np.hypot(*found.velocity[:, :2].T)
    assert found.duration == pytest.approx(1200.0)
    assert np.mean(speed < 0.01) > 0.1
    assert np.max(speed) == pytest.approx(24.0, abs=0.01)
    assert np.ptp(found.lla[:, 2]) > 20.0
    force = emulate(found).velocity / 0.1
    assert np.max(np.abs(force[:, :2])) < 3.0
    assert np.max(np.abs(found.rpy[:, 1])) < math.radians(5.0)


def test_the_aircraft_circles_both_ways() -> None:
    found = fixed_wing_loiter(dt=0.1, start=(-0.5, math.pi, 0.0))
    assert found.duration == pytest.approx(1200.0)
    assert np.max(found.rpy[:, 0]) == pytest.approx(math.atan(22.0**2 / 200.0 / 9.79), rel=0.02)
    assert np.min(found.rpy[:, 0]) == pytest.approx(-math.atan(22.0**2 / 200.0 / 9.79), rel=0.02)
    np.testing.assert_allclose(np.hypot(*found.velocity[:, :2].T), 22.0, atol=1e-3)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"strip": -1.0}, "strip = -1"),
        ({"duration": 0.0}, "duration = 0"),
        ({"duration": 1e9}, "10,000,000 steps"),
        ({"dt": 0.0}, "dt = 0"),
        ({"start": (1.56, 0.0, 0.0)}, "too near a pole"),
    ],
)
def test_impossible_missions_are_refused(options: dict[str, float], message: str) -> None:
    fly = fixed_wing_loiter if "radius" in options else helicopter_mapping
    with pytest.raises(InputError, match=message):
        fly(**options)
