"""``gmwm export``: files from calibrations, and how it refuses what it cannot use."""

from dataclasses import replace

import numpy as np
import pytest

import gmwm
from gmwm import Channel, GaussMarkov, Recording, WhiteNoise, bound
from gmwm.export import TARGETS
from gmwm.issues import Notice
from imu_numbers import numbers

DT = 0.01


@pytest.fixture(scope="module")
def calibration():
    rng = np.random.default_rng(4)
    model = WhiteNoise(1e-4) + GaussMarkov(2e-4, 1.0)
    channels = (("gyro", "rad/s"), ("accel", "m/s^2"))
    recording = Recording(
        tuple(
            Channel(f"{q}_x", model.simulate(20_000, DT, rng), DT, q, unit) for q, unit in channels
        ),
        "bench.csv",
    )
    return gmwm.calibrate(recording, model.opened())


@pytest.fixture
def file(calibration, tmp_path):
    return calibration.save(tmp_path / "calibration.json")


def test_it_is_printed_or_written(run, file, calibration, tmp_path):
    code, printed, reported = run("export", file, "--to", "openvins")
    assert (code, reported) == (0, "")
    assert printed == gmwm.export(calibration, "openvins")
    code, said, _ = run("export", file, "--to", "openvins", "-o", "chain.yaml")
    assert code == 0
    assert said == "wrote chain.yaml\n"
    assert (tmp_path / "chain.yaml").read_text() == printed


def test_horizon_and_form(run, file, calibration):
    code, printed, _ = run("export", file, "--to", "kalibr", "--horizon", "30", "--form", "N+K")
    assert code == 0
    assert printed == gmwm.export(calibration, "kalibr", horizon=30.0)
    code, printed, _ = run("export", file, "--to", "state-space", "--form", "N+K+GM")
    assert code == 0
    assert printed == gmwm.export(calibration, "state-space", form="N+K+GM")


def test_the_list_has_every_program(run):
    code, printed, _ = run("export", "--list")
    assert code == 0
    for name in TARGETS:
        assert f"\n{name} " in printed, name
    assert len({target.title for target in TARGETS.values()}) == len(TARGETS)


def test_an_axis_that_is_not_valid_is_exported_by_force_only(run, calibration, tmp_path):
    bad = Notice("step", "bad", "", "a step", {}, "cut it off")
    fits = {**calibration.fits, "accel_x": replace(calibration["accel_x"], notices=(bad,))}
    replace(calibration, fits=fits).save(tmp_path / "bad.json")
    for target in ("kalibr", "state-space"):
        code, printed, said = run("export", "bad.json", "--to", target, "-o", "file")
        assert (code, printed, said.count("\n")) == (1, "", 1)
        assert said.startswith("gmwm: not valid: accel_x (")
        assert said.endswith("; cut it off, or add --force\n")
        assert not (tmp_path / "file").exists()
    code, printed, _ = run("export", "bad.json", "--to", "kalibr", "--force")
    assert code == 0
    assert "# not valid, do not use: accel_x" in printed
    # The numbers have the mark too.
    bound(replace(calibration, fits=fits)).save(tmp_path / "numbers.json")
    assert run("export", "numbers.json", "--to", "kalibr")[0] == 1
    # Each cause has its own way out.
    other = Notice("unit", "bad", "", "a wrong unit", {}, "give the unit")
    fits["gyro_x"] = replace(calibration["gyro_x"], notices=(other,))
    replace(calibration, fits=fits).save(tmp_path / "bad.json")
    said = run("export", "bad.json", "--to", "kalibr")[2]
    assert said.endswith("; gyro_x: give the unit; accel_x: cut it off, or add --force\n")


def test_files_of_two_runs_in_one_folder_are_reported(run, tmp_path):
    """A page or a Kalibr file that another calibration.json was written with is told apart."""
    units = ("--rate", "100", "--gyro-unit", "rad/s", "--accel-unit", "m/s^2")
    for name, seed in (("a", 8), ("b", 9)):
        rows = np.random.default_rng(seed).normal(size=(3000, 2)) * [1e-3, 1e-2]
        lines = ["gyro_x,accel_x", *(f"{x:.9g},{y:.9g}" for x, y in rows), ""]
        (tmp_path / f"{name}.csv").write_text("\n".join(lines))
        assert run("calibrate", f"{name}.csv", *units, "-o", name)[0] == 0
    path = tmp_path / "a" / "calibration.json"
    assert "other-run" not in [each.code for each in gmwm.load(path).notices]
    assert run("export", path, "--to", "kalibr")[2] == ""
    for name in ("imu.yaml", "report.html"):
        (tmp_path / "a" / name).write_bytes((tmp_path / "b" / name).read_bytes())
    (found,) = (each for each in gmwm.load(path).notices if each.code == "other-run")
    assert found.values == {"files": "report.html, imu.yaml"}
    code, _, told = run("export", path, "--to", "kalibr")
    assert (code, told) == (0, f"gmwm: {found}\n")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("calibration.json",), "needs files and a program"),
        (("--to", "kalibr"), "needs files and a program"),
        (("calibration.json", "--to", "rosbag"), "choose from kalibr, openvins"),
        (("nowhere.json", "--to", "kalibr"), "cannot be read"),
        (("calibration.json", "--to", "kalibr", "--horizon", "0"), "give a positive time"),
        (("calibration.json", "--to", "kalibr", "--form", "N+GM"), r"takes N+K only"),
        (("calibration.json", "calibration.json", "--to", "vins"), "is given twice"),
        (("calibration.json", "--to", "vins", "-o", "no/a.yaml"), "cannot be written"),
        (("gyro.json", "--to", "vins"), "the accelerometer is missing"),
        (("fit.json", "--to", "vins"), "has no numbers to export"),
    ],
)
def test_bad_input(run, file, calibration, tmp_path, arguments, message):
    numbers("N+K", quantities=("gyro",)).save(tmp_path / "gyro.json")
    calibration["gyro_x"].save(tmp_path / "fit.json")
    before = sorted(path.name for path in tmp_path.iterdir())
    code, printed, reported = run("export", *arguments)
    assert code == 2
    assert printed == ""
    assert message in reported
    assert reported.startswith("gmwm: ")
    assert reported.count("\n") == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == before
