"""Formats that are given by name."""

import numpy as np
import pytest

import gmwm
from gmwm.errors import InputError

ROWS = np.random.default_rng(1).normal(size=(100, 1))


def test_a_name_overrides_what_the_file_looks_like(tmp_path):
    text = tmp_path / "log.npy"  # delimited text of a foreign name
    np.savetxt(text, ROWS, header="gyro_x [rad/s]", comments="")
    with pytest.raises(InputError):
        gmwm.read(text, rate=100.0)
    found = gmwm.read(text, rate=100.0, format="text")
    np.testing.assert_allclose(found["gyro_x"].values, ROWS[:, 0], rtol=1e-12)
    with pytest.raises(InputError, match="damaged or cut off"):
        gmwm.read(text, rate=100.0, format="parquet")


@pytest.mark.parametrize(
    ("options", "what"),
    [
        ({"format": "csv"}, "give one of"),
        ({"format": "text", "layout": "IMAR"}, "leave out format"),
    ],
)
def test_what_cannot_be(tmp_path, options, what):
    (tmp_path / "log.csv").write_text("gyro_x [rad/s]\n" + "1\n" * 100)
    with pytest.raises(InputError, match=what):
        gmwm.read(tmp_path / "log.csv", rate=100.0, **options)
