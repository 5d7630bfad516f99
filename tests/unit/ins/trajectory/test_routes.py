import math

import numpy as np
import pytest

from gmwm.errors import InputError
from gmwm.ins import Trajectory, through
from gmwm.ins.geometry import ned_difference, offset

START = np.array([math.radians(47.0), math.pi - 1e-4, 300.0])
CORNERS = np.array(
    [[0, 0, 0], [2000, 0, -50], [2500, 1500, -50], [-500, 2500, 20], [-1500, 0, 0.0]]
)


def distance_to_polyline(track: np.ndarray, corners: np.ndarray) -> np.ndarray:
    best = np.full(len(track), np.inf)
    for a, b in zip(corners[:-1, :2], corners[1:, :2], strict=True):
        along = np.clip((track - a) @ (b - a) / np.sum((b - a) ** 2), 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(track - a - along[:, None] * (b - a), axis=1))
    return best


def fly(corners: np.ndarray, **options: float) -> tuple[Trajectory, np.ndarray]:
    # Leg after leg, as offsets over some km are not vectors that add.
    waypoints = [START]
    for leg in np.diff(corners, axis=0):
        waypoints.append(offset(waypoints[-1], leg))
    found = through(waypoints, speed=30.0, turn_rate=0.1, dt=0.05, **options)
    return found, np.array(waypoints)


def test_the_track_follows_the_legs() -> None:
    found, waypoints = fly(CORNERS)
    track = ned_difference(found.lla, START)
    corners = ned_difference(waypoints, START)
    off = distance_to_polyline(track[:, :2], corners)
    straight = np.abs(np.gradient(found.rpy[:, 2])) < 1e-9
    assert np.max(off[straight]) < 1.0
    # Within the corners the way leaves the legs by R (1/cos(turn/2) - 1) and some for the ramps.
    sharpest = math.radians(125.0)
    assert np.max(off) < 300.0 * (1 / math.cos(sharpest / 2) - 1) + 100.0
    np.testing.assert_allclose(ned_difference(found.lla[-1], waypoints[-1]), 0.0, atol=2.0)
    np.testing.assert_allclose(found.lla[[0, -1], 2], waypoints[[0, -1], 2], atol=1e-3)
    assert np.hypot(*found.velocity[:, :2].T) == pytest.approx(30.0, abs=1e-3)


def test_heights_change_between_corners() -> None:
    found, waypoints = fly(CORNERS)
    for waypoint in waypoints[1:-1]:
        near = np.argmin(np.linalg.norm(ned_difference(found.lla, waypoint)[:, :2], axis=1))
        assert found.lla[near, 2] == pytest.approx(waypoint[2], abs=0.5)


@pytest.mark.parametrize(
    ("corners", "message"),
    [
        ([[0, 0, 0]], r"waypoints has shape \(1, 3\)"),
        ([[0, 0, 0], [500, 0, 0], [500, 0, 9]], "waypoints 1 and 2 coincide"),
        ([[0, 0, 0], [5000, 0, 0], [0, 0, 0]], "path turns back at waypoint 1"),
        ([[0, 0, 0], [200, 0, 0], [200, 900, 0]], "waypoints 0 and 1 are 200 m apart where"),
        ([[0, 0, 0], [90, 0, -20]], "waypoints 0 and 1 leave only 3 s to climb 20 m"),
    ],
)
def test_impossible_routes_are_refused(corners: list[list[float]], message: str) -> None:
    with pytest.raises(InputError, match=message):
        fly(np.array(corners, dtype=float))
