"""Units at the edges: every conversion against numbers worked out by hand."""

from math import pi, sqrt

import pytest

from gmwm._core.units import SI_UNIT, factor, field_units, quantity_of, si_parameter_unit as spelled
from gmwm.errors import InputError
from gmwm.process import CATALOGUE

DEGREE = pi / 180.0
HOUR = 3600.0
GRAVITY = 9.80665

PARAMETER_UNITS = sorted(
    {p.unit for kind in CATALOGUE for term in kind.examples() for p in term.parameters}
)


@pytest.mark.parametrize(
    ("unit", "si_unit", "expected"),
    [
        ("rad/s", "rad/s", 1.0),
        ("deg/s", "rad/s", DEGREE),
        ("dps", "rad/s", DEGREE),
        ("mdeg/s", "rad/s", 1e-3 * DEGREE),
        ("deg/h", "rad/s", DEGREE / HOUR),
        ("deg/hr", "rad/s", DEGREE / HOUR),
        ("deg/min", "rad/s", DEGREE / 60.0),
        ("arcsec/s", "rad/s", DEGREE / 3600.0),
        ("m/s^2", "m/s^2", 1.0),
        ("m/s2", "m/s^2", 1.0),
        ("m/s²", "m/s^2", 1.0),
        ("g", "m/s^2", GRAVITY),
        (" g ", "m/s^2", GRAVITY),
        ("mg", "m/s^2", 1e-3 * GRAVITY),
        ("ug", "m/s^2", 1e-6 * GRAVITY),
        ("\u00b5g", "m/s^2", 1e-6 * GRAVITY),
        ("arcsec", "rad", DEGREE / 3600.0),
        ("arcmin", "rad", DEGREE / 60.0),
        ("deg/sqrt(h)", "rad/s/sqrt(Hz)", DEGREE / sqrt(HOUR)),
        ("deg/√h", "rad/s/sqrt(Hz)", DEGREE / sqrt(HOUR)),
        ("deg/√(h)", "rad/s/sqrt(Hz)", DEGREE / sqrt(HOUR)),
        ("°/√hr", "rad/s/sqrt(Hz)", DEGREE / sqrt(HOUR)),
        ("deg/rt-hr", "rad/s/sqrt(Hz)", DEGREE / sqrt(HOUR)),
        ("deg/h^(1/2)", "rad/s/sqrt(Hz)", DEGREE / sqrt(HOUR)),
        ("\u03bcg/rtHz", "m/s^2/sqrt(Hz)", 9.80665e-6),
        ("deg/h/sqrt(Hz)", "rad/s/sqrt(Hz)", DEGREE / HOUR),
        ("deg/s/sqrt(Hz)", "rad/s/sqrt(Hz)", DEGREE),
        ("mdeg/s/√Hz", "rad/s/sqrt(Hz)", 1e-3 * DEGREE),
        ("ug/sqrt(Hz)", "m/s^2/sqrt(Hz)", 1e-6 * GRAVITY),
        ("m/s/sqrt(h)", "m/s^2/sqrt(Hz)", 1.0 / 60.0),
        ("deg/h/sqrt(h)", "rad/s/s/sqrt(Hz)", DEGREE / HOUR / sqrt(HOUR)),
        ("ug/sqrt(h)", "m/s^2/s/sqrt(Hz)", 1e-6 * GRAVITY / sqrt(HOUR)),
        ("deg/h/h", "rad/s/s", DEGREE / HOUR**2),
        ("ug/h", "m/s^2/s", 1e-6 * GRAVITY / HOUR),
    ],
)
def test_conversion(unit, si_unit, expected):
    assert factor(unit, si_unit) == pytest.approx(expected, rel=1e-12, abs=0.0)
    assert factor(si_unit, unit) == pytest.approx(1.0 / expected, rel=1e-12, abs=0.0)


@pytest.mark.parametrize(
    "unit",
    [
        "furlong",
        "",
        "  ",
        "deg//s",
        "m/s^",
        "Deg/s",
        "deg/sqrt(h",
        "__import__('os')",
        # A unit is no formula.
        "deg/s/0",
        "0*g",
        "-g",
        "1e400*g",
        "9**9**9*g",
    ],
)
def test_unknown_unit_is_refused_with_examples(unit):
    with pytest.raises(InputError) as caught:
        factor(unit, "rad/s")
    message = str(caught.value)
    assert message.startswith(f"unknown unit {unit!r}: ")
    assert "deg/s" in message
    assert "\n" not in message


def test_quantity_of():
    assert {quantity_of(unit) for unit in ("rad/s", "deg/s", "deg/h", "mdeg/s")} == {"gyro"}
    assert {quantity_of(unit) for unit in ("m/s^2", "g", "mg", "ug")} == {"accel"}


@pytest.mark.parametrize(
    ("quantity", "parameter_unit", "expected"),
    [
        ("gyro", "u s", [("arcsec", 3600.0 / DEGREE)]),
        ("gyro", "u/sqrt(Hz)", [("deg/sqrt(h)", 60.0 / DEGREE), ("deg/h/sqrt(Hz)", HOUR / DEGREE)]),
        ("gyro", "u", [("deg/h", HOUR / DEGREE)]),
        ("gyro", "u/s/sqrt(Hz)", [("deg/h/sqrt(h)", HOUR**1.5 / DEGREE)]),
        ("gyro", "u/s", [("deg/h/h", HOUR**2 / DEGREE)]),
        ("accel", "u s", [("m/s", 1.0)]),
        ("accel", "u/sqrt(Hz)", [("ug/sqrt(Hz)", 1e6 / GRAVITY), ("m/s/sqrt(h)", 60.0)]),
        ("accel", "u", [("ug", 1e6 / GRAVITY)]),
        ("accel", "u/s/sqrt(Hz)", [("ug/sqrt(h)", 60e6 / GRAVITY)]),
        ("accel", "u/s", [("ug/h", HOUR * 1e6 / GRAVITY)]),
        ("gyro", "s", []),
        ("accel", "Hz", []),
        ("gyro", "-", []),
        (None, "u", []),
        (None, "u/sqrt(Hz)", []),
    ],
)
def test_field_units(quantity, parameter_unit, expected):
    found = field_units(parameter_unit, quantity)
    assert [item.unit for item in found] == [unit for unit, _ in expected]
    for item, (_, per_si) in zip(found, expected, strict=True):
        assert item.per_si == pytest.approx(per_si, rel=1e-12, abs=0.0)


@pytest.mark.parametrize("quantity", ["gyro", "accel"])
@pytest.mark.parametrize("unit", [unit for unit in PARAMETER_UNITS if unit.startswith("u")])
def test_spelled_units_of_all_processes_measure_what_they_say(unit, quantity):
    # The placeholder put in brackets has the right dimension whatever the spelling.
    exact = unit.replace("u", f"({SI_UNIT[quantity]})", 1).replace(" s", "*s")
    assert factor(spelled(unit, quantity).replace(" s", "*s"), exact) == pytest.approx(1.0)


@pytest.mark.parametrize("quantity", ["gyro", "accel"])
def test_first_order_parameters_of_all_processes_have_a_field_unit(quantity):
    for unit in PARAMETER_UNITS:
        expected = unit.startswith("u") and unit != "u^2"
        assert bool(field_units(unit, quantity)) is expected, unit
