"""Formats that are given by name."""

import numpy as np
import pytest
from click.testing import CliRunner

import gmwm
from gmwm.cli import options
from gmwm.cli.main import cli
from gmwm.errors import InputError
from gmwm.readers import NAMES

ROWS = np.random.default_rng(1).normal(size=(100, 1))


def test_the_command_line_knows_all():
    assert NAMES == options.FORMATS


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


@pytest.mark.parametrize("command", ["calibrate", "health", "navigate", "reproduce"])
def test_every_command_that_reads_has_the_options(command):
    shown = CliRunner().invoke(cli, [command, "--help"]).output
    assert "--format NAME" in shown
    assert "--layout LAYOUT" in shown


def test_health_of_a_file_of_a_foreign_name(tmp_path):
    text = tmp_path / "log.npy"
    np.savetxt(text, ROWS, header="gyro_x [rad/s]", comments="")
    shown = CliRunner().invoke(cli, ["health", str(text), "--rate", "100", "--format", "text"])
    assert shown.exit_code == 0
    assert "gyro_x" in shown.output
