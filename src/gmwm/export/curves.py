"""Curves of the bias against the temperature as files of autopilots, tables and functions."""

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Any

import numpy as np

from gmwm._core.files import toml_beside
from gmwm.calibration import BiasCurve, Calibration
from gmwm.errors import InputError
from gmwm.export.imu import not_valid, reason
from gmwm.export.target import comment, compiled_template, not_valid_line, plain, wrapped

_LETTERS = "xyz"
_CUBIC = 3

Curves = Mapping[str, BiasCurve]


@dataclass(frozen=True)
class CurveFile:
    """A file of curves.

    title, file_name: The program, and how the file is called.
    convention: What its values are.
    source: Where the program's own source says so.
    template: Of the file below the comments, of Jinja.
    mark: What a comment begins with.
    """

    title: str
    file_name: str
    convention: str
    template: str
    source: str = ""
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
        invalid = {name: reason(each) for name, each in not_valid(given).items()}
        lines += [not_valid_line(invalid)] if invalid else []
        if lost := sorted({r.title for c in curves.values() for r in c.regressors if r.constant}):
            lines += wrapped(f"left out, as at a steady temperature: {', '.join(lost)}")
        body = compiled_template(self.template).render(
            curves=curves,
            triads=partial(_triads, curves),
            powers=_powers,
            rows=lambda curve: [
                ",".join(f"{each:.9g}" for each in row) for row in zip(*curve.band(), strict=True)
            ],
            polynomial=_polynomial,
            identifier=partial(re.sub, r"\W", "_"),
        )
        return "\n".join([*comment(lines, self.mark), body.rstrip("\n")]) + "\n"

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
            raise InputError(f"{quantity}_{missing[0]} has no curve: calibrate all three axes")
        for each in own.values():
            if each.main is None or each.main.unit != "degC":
                raise InputError(
                    f"the curve of {each.name} is not one against a temperature in degC"
                )
            if each.degree > _CUBIC:
                raise InputError(
                    f"the curve of {each.name} has degree {each.degree}, above the 3 of these "
                    "parameters: calibrate with degree 3"
                )
        axes = [own[letter] for letter in _LETTERS]
        ranges = [each.main for each in axes if each.main is not None]
        low, high = max(one.low for one in ranges), min(one.high for one in ranges)
        found[quantity] = axes, low, high
    return found


def _powers(curve: BiasCurve, reference: float) -> list[float]:
    powers = curve.polynomial(reference)
    return [float(value) for value in np.pad(powers, (0, _CUBIC + 1 - powers.size))]


def _polynomial(curve: BiasCurve) -> str:
    """A polynomial in d = x - centre by Horner's rule."""
    text = ""
    for value in curve.polynomial()[::-1]:
        text = f"{float(value):.12g}" + (f" + d * ({text})" if text else "")
    return text


CURVES: Mapping[str, CurveFile] = MappingProxyType(
    {name: CurveFile(**content) for name, content in toml_beside(__file__).items()}
)
"""Files of curves by name."""


def curve_files(calibration: Calibration) -> list[str]:
    """Names of the files that can hold the curves of a calibration."""
    found = []
    for name, each in CURVES.items():
        with suppress(InputError):
            each.text([calibration])
            found.append(name)
    return found
