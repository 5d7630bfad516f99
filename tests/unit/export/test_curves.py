"""Files of curves, put through the equations of the programs that read them."""

import subprocess
from shutil import which

import numpy as np
import pytest

import gmwm
from gmwm import RandomWalk, WhiteNoise
from gmwm.export import CURVES, curve_files

SIZE, DT = 1024, 1.0
AT = np.linspace(26.0, 63.0, 7)


def calibration(words="cubic", channels="xyz"):
    temperature = 25.0 + 40.0 * np.sin(0.5 * np.pi * np.arange(SIZE) / SIZE)
    u = (temperature - 45.0) / 20.0
    arrays, units = {"temperature": temperature}, {"temperature": "degC"}
    for quantity, unit in (("gyro", "rad/s"), ("accel", "m/s^2")):
        units[quantity] = unit
        for k, axis in enumerate(channels):
            x = (WhiteNoise(1e-3) + RandomWalk(3e-5)).simulate(SIZE, DT, k)
            arrays[f"{quantity}_{axis}"] = x + 0.1 + 0.02 * (k + 1) * (u + 0.4 * u**2 - 0.2 * u**3)
    rec = gmwm.Recording.from_arrays(arrays, 1.0 / DT, units, "chamber.csv")
    model = WhiteNoise() + RandomWalk()
    given = {"covariates": {"temperature": words}, "jobs": 1, "still": False}
    return gmwm.calibrate(rec, model, screening=(), **given)


@pytest.fixture(scope="module")
def found():
    return calibration()


def values(text, separator):
    rows = [line.split(separator) for line in text.splitlines() if not line.startswith("#")]
    return {row[-2 if separator == "," else 2]: float(row[-1 if separator == "," else 3])
            for row in rows}  # fmt: skip


def differences(curve):
    return curve(AT) - curve(AT[:1])


def test_px4_subtracts_the_curve(found):
    """calc_thermal_offsets_3D: x0 + x1 d + x2 d^2 + x3 d^3 with d = T - TREF."""
    own = values(gmwm.export(found, "px4-tc"), "\t")
    for letter, quantity in (("G", "gyro"), ("A", "accel")):
        assert own[f"TC_{letter}_ENABLE"] == 1
        delta = AT - own[f"TC_{letter}0_TREF"]
        for axis, name in enumerate("xyz"):
            powers = [own[f"TC_{letter}0_X{k}_{axis}"] for k in range(4)]
            offset = np.polyval(powers[::-1], delta)
            curve = found.curves[f"{quantity}_{name}"]
            np.testing.assert_allclose(offset - offset[0], differences(curve), rtol=1e-6, atol=1e-9)
            assert (powers[0] == 0.0) == (quantity == "accel")
            if quantity == "gyro":
                np.testing.assert_allclose(offset, curve(AT), rtol=1e-6)
        one = found.curves["gyro_x"].main
        ends = (own[f"TC_{letter}0_TMIN"], own[f"TC_{letter}0_TMAX"])
        assert ends == pytest.approx((one.low, one.high))


def test_ardupilot_subtracts_the_curve(found):
    """polynomial_eval: (c0 + (c1 + c2 d) d) d 1e-6 with d = T - 35."""
    own = values(gmwm.export(found, "ardupilot-tcal"), ",")
    delta = AT - 35.0
    for key, quantity in (("GYR", "gyro"), ("ACC", "accel")):
        for letter in "XYZ":
            c = [own[f"INS_TCAL1_{key}{k}_{letter}"] for k in (1, 2, 3)]
            correction = (c[0] + (c[1] + c[2] * delta) * delta) * delta * 1e-6
            curve = found.curves[f"{quantity}_{letter.lower()}"]
            np.testing.assert_allclose(
                correction - correction[0], differences(curve), rtol=1e-6, atol=1e-9
            )


def test_the_python_function_is_the_curve_in_its_range(found):
    names = {}
    exec(gmwm.export(found, "curve-python"), names)
    for name, curve in found.curves.items():
        own = [names[f"{name}_curve"](x) for x in AT]
        np.testing.assert_allclose(own, curve(AT), rtol=1e-9)
        with pytest.raises(ValueError, match="known from"):
            names[f"{name}_curve"](curve.main.high + 1.0)


@pytest.mark.skipif(which("cc") is None, reason="no C compiler")
def test_the_c_function_is_the_curve_in_its_range(found, tmp_path):
    (tmp_path / "curves.h").write_text(gmwm.export(found, "curve-c"))
    (tmp_path / "main.c").write_text(
        '#include <stdio.h>\n#include "curves.h"\n'
        'int main(void) { double v = 7.0; int a = gyro_y_curve(50.0, &v); printf("%d %.12g", a, v);'
        ' v = 7.0; a = gyro_y_curve(90.0, &v); printf(" %d %g", a, v); return 0; }\n'
    )
    subprocess.run(["cc", "-Wall", "-Werror", "-Wno-unused-function", "-o", "run", "main.c"],
                   cwd=tmp_path, check=True)  # fmt: skip
    said = subprocess.run(["./run"], cwd=tmp_path, capture_output=True, text=True, check=True)
    inside, value, outside, left = said.stdout.split()
    assert (inside, outside, left) == ("0", "-1", "7")
    assert float(value) == pytest.approx(float(found.curves["gyro_y"](50.0)), rel=1e-9)


def test_a_table_has_the_band(found):
    lines = gmwm.export(found, "curve-csv").splitlines()
    rows = [line for line in lines if not line.startswith("#")]
    assert rows[0] == "temperature [degC],gyro_x [rad/s],+- 95 % [rad/s]"
    at, value, error = (float(each) for each in rows[1].split(","))
    curve = found.curves["gyro_x"]
    assert value == pytest.approx(float(curve(at)))
    assert error == pytest.approx(curve.band(np.array([at]))[2][0])


@pytest.mark.slow
def test_what_autopilots_cannot_hold_is_said(found):
    assert curve_files(found) == list(CURVES)
    with pytest.raises(gmwm.InputError, match=r"degree 4.*calibrate with degree 3"):
        gmwm.export(calibration("4", "xyz"), "px4-tc")
    single = calibration("linear", "x")
    assert curve_files(single) == ["curve-csv", "curve-c", "curve-python"]
    with pytest.raises(gmwm.InputError, match="gyro_y has no curve"):
        gmwm.export(single, "ardupilot-tcal")
    lagged = gmwm.export(calibration("linear, lag 60 s"), "px4-tc")
    assert "left out, as at a steady temperature: temperature lag 60 s" in lagged


def test_curves_need_covariates():
    x = WhiteNoise(1e-3).simulate(1024, 1.0, 1)
    rec = gmwm.Recording.from_arrays({"gyro_x": x}, 1.0, {"gyro": "rad/s"})
    plain = gmwm.calibrate(rec, WhiteNoise(), jobs=1)
    with pytest.raises(gmwm.InputError, match="needs curves of a covariate"):
        gmwm.export(plain, "curve-csv")


def test_functions_leave_gravity_in_the_samples(found):
    """The constant of an accelerometer was the mean of its samples."""
    for name, curve in found.curves.items():
        assert (curve(curve.main.centre) == 0.0) == name.startswith("accel")
