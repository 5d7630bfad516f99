"""Integrated navigation: does a sensor model navigate well, and does the filter know how well?

Conventions, everywhere in this subpackage:

- The Earth is the rotating WGS-84 ellipsoid with normal gravity.
- Navigation axes are local north, east and down (NED), body axes forward, right and down.
- Angles are in rad, everything in SI units. Positions are latitude, longitude and height above the
  ellipsoid (lla). Attitude is C_bn, which takes vectors from body to navigation axes, or roll,
  pitch and yaw (z-y-x).
- n increments of an IMU lie between n + 1 epochs, counted from 0.
- Errors are estimate less truth; an attitude error phi is a rotation about north, east and down,
  ``C_estimate = (I - [phi x]) C``. Sensors are gyro x, y, z, then accelerometer x, y, z.

A trajectory (`helicopter_mapping`, `perform`, `Trajectory.read`) gives error-free increments
(`emulate`); errors are drawn from `SensorModels` or taken from a recording (`Recorded`); `navigate`
filters them with `Aiding`; `monte_carlo` does so many times for several filters, `Validation` says
what came out. `covariance_analysis` needs no runs;
`preintegrate` has the covariance of increments between keyframes for a factor graph. Real data are
read by `read_imu` and `read_fixes` (`Measured`); `Navigated` aligns and filters them.

Names are loaded when they are first used.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
