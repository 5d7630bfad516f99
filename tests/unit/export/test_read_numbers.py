"""Numbers in use, from files of programs."""

import numpy as np
import pytest

from gmwm import InputError
from gmwm.export import read_numbers

F = 200.0
NUMBERS = {"gyro": (2e-4, 3e-6), "accel": (3e-3, 4e-5)}


def text(kind):
    (Ng, Kg), (Na, Ka) = NUMBERS.values()
    if kind == "kalibr":
        return (
            f"#Accelerometers\naccelerometer_noise_density: {Na}  # m/s^2/sqrt(Hz)\n"
            f"accelerometer_random_walk: {Ka}\ngyroscope_noise_density: {Ng:e}\n"
            f"gyroscope_random_walk: {Kg}\nrostopic: /imu0\nupdate_rate: {F}\n"
        )
    if kind == "openvins":
        return "%YAML:1.0\n\nimu0:\n" + "".join(
            f"  {line}\n" for line in text("kalibr").splitlines()
        )
    if kind == "orbslam3":
        return (
            f"%YAML:1.0\nIMU.NoiseGyro: {Ng}\nIMU.NoiseAcc: {Na}\nIMU.GyroWalk: {Kg}\n"
            f"IMU.AccWalk: {Ka}\nIMU.Frequency: {F}\n"
        )
    if kind == "vins":
        g, h = np.sqrt(2.0 * F), np.sqrt(F)
        return f"acc_n: {Na * g}\ngyr_n: {Ng * g}\nacc_w: {Ka * h}\ngyr_w: {Kg * h}\n"
    if kind == "fastlio":
        return (
            f"mapping:\n    acc_cov: {Na**2 * F}\n    gyr_cov: {Ng**2 * F}\n"
            f"    b_acc_cov: {Ka**2 * F}\n    b_gyr_cov: {Kg**2 * F}\n"
        )
    return f"imuAccNoise: {Na}\nimuGyrNoise: {Ng}\nimuAccBiasN: {Ka}\nimuGyrBiasN: {Kg}\n"


@pytest.mark.parametrize("kind", ["kalibr", "openvins", "orbslam3", "vins", "fastlio", "liosam"])
def test_files_of_programs(tmp_path, kind):
    path = tmp_path / "imu.yaml"
    path.write_text(text(kind))
    found = read_numbers(path, F)
    assert list(found) == ["gyro", "accel"]
    for name, pair in NUMBERS.items():
        assert found[name] == pytest.approx(pair, rel=1e-9)


@pytest.mark.parametrize("kind", ["vins", "fastlio"])
def test_numbers_that_depend_on_the_rate_need_one(tmp_path, kind):
    path = tmp_path / "imu.yaml"
    path.write_text(text(kind))
    with pytest.raises(InputError, match="give it in Hz"):
        read_numbers(path)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("imu: none\n", "no noise parameters by names known here"),
        ("gyroscope_noise_density: 1e-4\n", "gyroscope_random_walk is missing"),
        (text("kalibr").replace("0.003", "0.0"), "accelerometer_noise_density = 0"),
    ],
)
def test_files_that_cannot_be_used(tmp_path, content, message):
    path = tmp_path / "imu.yaml"
    path.write_text(content)
    with pytest.raises(InputError, match=message):
        read_numbers(path)
    with pytest.raises(InputError, match="cannot be read"):
        read_numbers(tmp_path / "missing.yaml")
