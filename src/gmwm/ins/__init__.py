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
what came out. `covariance_analysis` needs no runs, and `reduce` finds the best small model. Real
data are read by `read_imu` and `read_fixes` (`Measured`); `Navigated` aligns and filters them.

Names are loaded when they are first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gmwm.ins.aiding import Aiding, Fixes, Outage, barometer, gnss, standstills
    from gmwm.ins.analysis import Analysis, covariance_analysis
    from gmwm.ins.consistency import Consistency, at_epoch, innovation_test, over_time
    from gmwm.ins.emulation import Imu, emulate
    from gmwm.ins.experiment import Experiment, read_experiment
    from gmwm.ins.filter import InitialSd, navigate
    from gmwm.ins.fix_file import read_fixes
    from gmwm.ins.imu_file import read_imu
    from gmwm.ins.manoeuvres import Accelerate, Climb, Stop, Straight, Turn, perform
    from gmwm.ins.measured import Measured
    from gmwm.ins.mechanization import integrate
    from gmwm.ins.missions import car_drive, fixed_wing_loiter, helicopter_mapping
    from gmwm.ins.navigated import Navigated
    from gmwm.ins.outage_errors import difference, spread
    from gmwm.ins.recorded import Recorded
    from gmwm.ins.reduction import Reduction, reduce
    from gmwm.ins.routes import through
    from gmwm.ins.runs import Runs
    from gmwm.ins.scenario import Scenario, Simulated
    from gmwm.ins.sensors import SensorErrors, SensorModels
    from gmwm.ins.solution import Innovations, Solution
    from gmwm.ins.trajectory import NavState, Trajectory
    from gmwm.ins.trials import MonteCarlo, monte_carlo
    from gmwm.ins.validation import Validation

_HOME = {
    **dict.fromkeys(("Aiding", "Fixes", "Outage", "barometer", "gnss", "standstills"), "aiding"),
    **dict.fromkeys(("Consistency", "at_epoch", "innovation_test", "over_time"), "consistency"),
    **dict.fromkeys(("Analysis", "covariance_analysis"), "analysis"),
    **dict.fromkeys(("Imu", "emulate"), "emulation"),
    **dict.fromkeys(("Experiment", "read_experiment"), "experiment"),
    **dict.fromkeys(("InitialSd", "navigate"), "filter"),
    **dict.fromkeys(("read_fixes",), "fix_file"),
    **dict.fromkeys(("read_imu",), "imu_file"),
    **dict.fromkeys(("Measured",), "measured"),
    **dict.fromkeys(("Navigated",), "navigated"),
    **dict.fromkeys(("Accelerate", "Climb", "Stop", "Straight", "Turn", "perform"), "manoeuvres"),
    **dict.fromkeys(("integrate",), "mechanization"),
    **dict.fromkeys(("car_drive", "fixed_wing_loiter", "helicopter_mapping"), "missions"),
    "Runs": "runs",
    **dict.fromkeys(("Scenario", "Simulated"), "scenario"),
    **dict.fromkeys(("MonteCarlo", "monte_carlo"), "trials"),
    **dict.fromkeys(("difference", "spread"), "outage_errors"),
    **dict.fromkeys(("Recorded",), "recorded"),
    **dict.fromkeys(("Reduction", "reduce"), "reduction"),
    **dict.fromkeys(("through",), "routes"),
    **dict.fromkeys(("SensorErrors", "SensorModels"), "sensors"),
    **dict.fromkeys(("Innovations", "Solution"), "solution"),
    **dict.fromkeys(("NavState", "Trajectory"), "trajectory"),
    **dict.fromkeys(("Validation",), "validation"),
}

__all__ = [
    "Accelerate",
    "Aiding",
    "Analysis",
    "Climb",
    "Consistency",
    "Experiment",
    "Fixes",
    "Imu",
    "InitialSd",
    "Innovations",
    "Measured",
    "MonteCarlo",
    "NavState",
    "Navigated",
    "Outage",
    "Recorded",
    "Reduction",
    "Runs",
    "Scenario",
    "SensorErrors",
    "SensorModels",
    "Simulated",
    "Solution",
    "Stop",
    "Straight",
    "Trajectory",
    "Turn",
    "Validation",
    "at_epoch",
    "barometer",
    "car_drive",
    "covariance_analysis",
    "difference",
    "emulate",
    "fixed_wing_loiter",
    "gnss",
    "helicopter_mapping",
    "innovation_test",
    "integrate",
    "monte_carlo",
    "navigate",
    "over_time",
    "perform",
    "read_experiment",
    "read_fixes",
    "read_imu",
    "reduce",
    "spread",
    "standstills",
    "through",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'gmwm.ins' has no attribute {name!r}")
    value = getattr(import_module(f"gmwm.ins.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
