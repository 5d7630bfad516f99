"""Numbers in use, from files of programs."""

import pytest

from gmwm import InputError
from gmwm.export import read_numbers

VINS = "acc_n: 0.03\ngyr_n: 0.004\nacc_w: 6e-4\ngyr_w: 4e-5\n"
FASTLIO = "mapping:\n    acc_cov: 0.1\n    gyr_cov: 0.1\n    b_acc_cov: 1e-4\n    b_gyr_cov: 1e-4\n"


@pytest.mark.parametrize("text", [VINS, FASTLIO])
def test_numbers_that_depend_on_the_rate_need_one(tmp_path, text):
    path = tmp_path / "imu.yaml"
    path.write_text(text)
    with pytest.raises(InputError, match="give the rate in Hz"):
        read_numbers(path)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("imu: none\n", "no noise parameters of a known name"),
        ("gyroscope_noise_density: 1e-4\n", "gyroscope_random_walk is missing"),
        ("gyr_n: 0.1\ngyr_w: 0.1\nacc_n: 0.0\nacc_w: 0.1\n", "acc_n = 0"),
        (VINS + VINS.replace("0.03", "0.3"), "acc_n has several values: keep those of one IMU"),
    ],
)
def test_files_that_cannot_be_used(tmp_path, content, message):
    path = tmp_path / "imu.yaml"
    path.write_text(content)
    with pytest.raises(InputError, match=message):
        read_numbers(path)
    with pytest.raises(InputError, match="cannot be read"):
        read_numbers(tmp_path / "missing.yaml")
