"""Curves of the bias against the temperature as files of autopilots, tables and functions."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from gmwm.calibration import BiasCurve, Calibration
from gmwm.errors import InputError
from gmwm.export.target import comment, plain, wrapped

_LETTERS = "xyz"
_CUBIC = 3
_ARDUPILOT_REFERENCE = 35.0  # degC, TEMP_REFERENCE of its source
_ARDUPILOT_SCALE = 1e6  # SCALE_FACTOR
_REAL, _INTEGER = 9, 6  # MAV_PARAM_TYPE

Curves = Mapping[str, BiasCurve]


@dataclass(frozen=True)
class CurveFile:
    """A file of curves.

    title, file_name: The program, and how the file is called.
    convention: What its values are.
    source: Where the program's own source says so.
    body: Lines of the file.
    mark: What a comment begins with.
    """

    title: str
    file_name: str
    convention: str
    source: str
    body: Callable[[Curves], list[str]]
    mark: str = "#"

    def text(self, given: Sequence[Any]) -> str:
        """The file of calibrations.

        Raises InputError if they have no curves, or some that the file cannot hold.
        """
        found: dict[str, BiasCurve] = {}
        for each in given:
            found |= each.curves if isinstance(each, Calibration) else {}
        curves = {name: each for name, each in found.items() if each.degree > 0}
        if not curves:
            raise InputError(
                f"{self.title} needs curves of a covariate: calibrate with "
                'covariates={"temperature": "auto"}'
            )
        sources = ", ".join(dict.fromkeys(each.source for each in given if each.source))
        lines = wrapped(plain(f"{self.title}: {sources or 'a recording'}"))
        lines += wrapped(self.convention)
        if lost := sorted({r.title for c in curves.values() for r in c.regressors if r.constant}):
            lines += wrapped(f"left out, as at a steady temperature: {', '.join(lost)}")
        return "\n".join([*comment(lines, self.mark), *self.body(curves)]) + "\n"

    def about(self) -> str:
        return (
            "\n".join([*wrapped(f"{self.title}: {self.convention}"), *wrapped(self.source)]) + "\n"
        )


def _triads(curves: Curves) -> dict[str, tuple[list[BiasCurve], float, float]]:
    """By sensor the curves of x, y and z, and the range that they have in common, degC.

    Raises InputError for other covariates, too high a degree, or an axis without a curve.
    """
    found = {}
    for quantity in ("gyro", "accel"):
        own = {name[-1]: each for name, each in curves.items() if each.quantity == quantity}
        if not own:
            continue
        if missing := [letter for letter in _LETTERS if letter not in own]:
            raise InputError(
                f"{quantity}_{missing[0]} has no curve: the parameters hold all three axes"
            )
        for each in own.values():
            if each.main is None or each.main.unit != "degC":
                raise InputError(f"the curve of {each.name} is not one of a temperature in degC")
            if each.degree > _CUBIC:
                raise InputError(
                    f"the curve of {each.name} has degree {each.degree}, and the parameters hold "
                    "a cubic: calibrate with degree 3 (--degree 3)"
                )
        axes = [own[letter] for letter in _LETTERS]
        ranges = [each.main for each in axes if each.main is not None]
        low, high = max(one.low for one in ranges), min(one.high for one in ranges)
        found[quantity] = axes, low, high
    return found


def _powers(curve: BiasCurve, reference: float) -> list[float]:
    powers = curve.polynomial(reference)
    return [float(value) for value in np.pad(powers, (0, _CUBIC + 1 - powers.size))]


def _px4(curves: Curves) -> list[str]:
    lines = []
    for quantity, (axes, low, high) in _triads(curves).items():
        letter, middle = quantity[0].upper(), 0.5 * (low + high)
        own: list[tuple[str, float, int]] = [(f"TC_{letter}_ENABLE", 1, _INTEGER)]
        for axis, curve in enumerate(axes):
            powers = _powers(curve, middle)
            if quantity == "accel":
                powers[0] = 0.0  # it holds gravity
            own += [(f"TC_{letter}0_X{k}_{axis}", v, _REAL) for k, v in enumerate(powers)]
        ends = {"TREF": middle, "TMIN": low, "TMAX": high}
        own += [(f"TC_{letter}0_{key}", value, _REAL) for key, value in ends.items()]
        lines.append(f"# set TC_{letter}0_ID to the device id, CAL_{_CALIBRATED[letter]}0_ID")
        lines += [f"1\t1\t{name}\t{value:.9g}\t{kind}" for name, value, kind in own]
    return lines


_CALIBRATED = {"G": "GYRO", "A": "ACC"}


def _ardupilot(curves: Curves) -> list[str]:
    triads = _triads(curves)
    low = max(each[1] for each in triads.values())
    high = min(each[2] for each in triads.values())
    lines = ["INS_TCAL1_ENABLE,1", f"INS_TCAL1_TMIN,{low:.6g}", f"INS_TCAL1_TMAX,{high:.6g}"]
    for quantity, (axes, *_) in triads.items():
        name = {"gyro": "GYR", "accel": "ACC"}[quantity]
        for letter, curve in zip(_LETTERS.upper(), axes, strict=True):
            powers = _powers(curve, _ARDUPILOT_REFERENCE)
            lines += [
                f"INS_TCAL1_{name}{k}_{letter},{_ARDUPILOT_SCALE * powers[k]:.9g}"
                for k in range(1, _CUBIC + 1)
            ]
    return lines


def _csv(curves: Curves) -> list[str]:
    lines = []
    for name, curve in curves.items():
        one, unit = curve.main, curve.unit
        assert one is not None
        lines.append(f"{one.name} [{one.unit}],{name} [{unit}],+- 95 % [{unit}]")
        rows = zip(*curve.band(), strict=True)
        lines += [",".join(f"{each:.9g}" for each in row) for row in rows]
    return lines


def _function(curve: BiasCurve) -> tuple[str, str, float, float]:
    """A polynomial in x - centre by Horner's rule, the centre, and the range."""
    one = curve.main
    assert one is not None
    text = ""
    for value in curve.polynomial()[::-1]:
        text = f"{float(value):.12g}" + (f" + d * ({text})" if text else "")
    return text, f"{one.centre:.12g}", one.low, one.high


def _c(curves: Curves) -> list[str]:
    lines = []
    for key, curve in curves.items():
        name = re.sub(r"\W", "_", key)
        polynomial, centre, low, high = _function(curve)
        lines += [
            "",
            f"/* {name}, {curve.unit}: 0 if x is in the range of the curve, else -1, no value. */",
            f"static inline int {name}_curve(double x, double *value)",
            "{",
            f"    const double d = x - {centre};",
            f"    if (!(x >= {low:.9g} && x <= {high:.9g})) return -1;",
            f"    *value = {polynomial};",
            "    return 0;",
            "}",
        ]
    return lines


def _python(curves: Curves) -> list[str]:
    lines = []
    for key, curve in curves.items():
        name = re.sub(r"\W", "_", key)
        polynomial, centre, low, high = _function(curve)
        lines += [
            "",
            "",
            f"def {name}_curve(x):",
            f'    """Bias of {name} in {curve.unit}; raises ValueError outside the range."""',
            f"    if not {low:.9g} <= x <= {high:.9g}:",
            f'        raise ValueError(f"{{x}}: known from {low:.4g} to {high:.4g}")',
            f"    d = x - {centre}",
            f"    return {polynomial}",
        ]
    return lines


CURVES: Mapping[str, CurveFile] = MappingProxyType(
    {
        "px4-tc": CurveFile(
            "PX4 thermal compensation", "px4-tc.params",
            "TC_*: offsets in SI by powers of T - TREF, clipped to TMIN and TMAX; accelerometers "
            "have none at TREF. Load with QGroundControl, then restart",
            "PX4-Autopilot: temperature_compensation/TemperatureCompensation.cpp, "
            "calc_thermal_offsets_3D", _px4,
        ),
        "ardupilot-tcal": CurveFile(
            "ArduPilot IMU temperature calibration", "ardupilot-tcal.param",
            "INS_TCAL1_*: 1e6 times the coefficients in SI of powers of T - 35 degC, without a "
            "constant, clipped to TMIN and TMAX; calibrate offsets again after loading",
            "ardupilot: AP_InertialSensor_tempcal.cpp, polynomial_eval and correct_sensor",
            _ardupilot,
        ),
        "curve-csv": CurveFile(
            "table of curves", "curves.csv", "value and half the 95 % interval, SI; the interval "
            "is of the difference from the middle of the range", "", _csv,
        ),
        "curve-c": CurveFile(
            "C functions of curves", "curves.h", "subtract the value from the sample, both in SI",
            "", _c, "//",
        ),
        "curve-python": CurveFile(
            "Python functions of curves", "curves.py", "subtract the value from the sample, both "
            "in SI", "", _python,
        ),
    }
)  # fmt: skip
"""Files of curves by name."""
