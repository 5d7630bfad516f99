"""Numbers of an IMU whose axes differ, for all tests of this room."""

from gmwm import GaussMarkov, RandomWalk, WhiteNoise
from gmwm.filter_numbers import AxisFilterNumbers, FilterNumbers, Predicted

RATE = 200.0
N = {"gyro": (1e-4, 1.1e-4, 1.2e-4), "accel": (2e-3, 2.4e-3, 2.2e-3)}
K = {"gyro": (5e-6, 7e-6, 6e-6), "accel": (1e-4, 1.2e-4, 1.4e-4)}
SIGMA = {"gyro": (4e-5, 5e-5, 3e-5), "accel": (8e-4, 6e-4, 1e-3)}
TAU = {"gyro": (60.0, 120.0, 200.0), "accel": (50.0, 90.0, 150.0)}
START = {"gyro": (2e-4, 1e-4, 0.0), "accel": (4e-3, 3e-3, 0.0)}
FORMS = {"state-space": "N+GM"}


def numbers(form, axes="xyz", quantities=("gyro", "accel"), **changes):
    """Numbers of a form, by channel."""
    found = {}
    for quantity in quantities:
        for axis in axes:
            i = "xyz".index(axis)
            slow = RandomWalk(K[quantity][i])
            if form == "N+GM":
                slow = GaussMarkov(SIGMA[quantity][i], TAU[quantity][i])
            found[f"{quantity}_{axis}"] = AxisFilterNumbers(
                form=form,
                model=WhiteNoise(N[quantity][i]) + slow,
                horizon=60.0,
                initial_sd=START[quantity][i],
                method="bound",
                predicted=(Predicted(60.0, 0.93, 1.1), Predicted(600.0, 0.8, 1.2)),
                quantity=quantity,
            )
    given = {"source": "bench.csv", "rate": RATE, "duration": 3600.0}
    return FilterNumbers(found, **(given | changes))
