"""Real data: an IMU's log and GNSS fixes, made here from a known drive, so that truth is known."""

import os
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

from gmwm.errors import InputError
from gmwm.ins import Measured, Navigated, Outage, car_drive, emulate, fixed_wing_loiter, gnss
from gmwm.ins.fields import sensor_models
from gmwm.ins.filter import KINDS
from gmwm.ins.geometry import ned_difference
from gmwm.ins.logs.replay import innovation_sizes

RATE, START = 10.0, 1000.0
SENSORS = {
    "gyro": {"N": "20 deg/h/sqrt(Hz)", "GM": [["20 deg/h", 100]]},
    "accel": {"N": "100 ug/sqrt(Hz)", "GM": [["100 ug", 100]]},
}
WRONG = {"gyro": {"N": "0.02 deg/h/sqrt(Hz)"}, "accel": {"N": "1 ug/sqrt(Hz)"}}
ARM = [1.0, 0.3, -1.0]
IMU_HEADER = "time_s,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z"
UNITS = {"gyro": "rad/s", "accel": "m/s^2"}


def table(path, header, columns):
    with open(path, "w") as stream:
        np.savetxt(stream, np.column_stack(columns), "%.12g", ",", header=header, comments="")


def drive(folder, seed=0, trajectory=None, velocity=(0.1, 0.1, 0.15), deviations=True,
          hole=(100.0, 120.0)):  # fmt: skip
    """Write imu.csv and fixes.csv of a drive; returns the true trajectory."""
    rng = np.random.default_rng(seed)
    truth = trajectory or car_drive(duration=160.0, dt=1.0 / RATE)
    ideal = emulate(truth)
    errors = sensor_models(SENSORS, "test").simulate(ideal.n, ideal.dt, rng).total
    errors += np.repeat([0.002, 0.05], 3) * rng.standard_normal(6)
    imu = ideal.with_errors(errors[:, :3], errors[:, 3:])
    stamps = START + imu.dt * (1.0 + np.arange(imu.n))
    table(folder / "imu.csv", IMU_HEADER, [stamps, imu.rotation / imu.dt, imu.velocity / imu.dt])
    aiding = gnss(truth, velocity_sd=velocity, lever_arm=ARM, imu=ideal)
    aiding = aiding.without([Outage(hole[0], hole[1] - hole[0])]).noisy(rng)
    position = aiding.fixes[0]
    names = ["time_s", "latitude_deg", "longitude_deg", "height_m"]
    columns = [START + position.time, np.degrees(position.value[:, :2]), position.value[:, 2]]
    if deviations:
        names += ["sd_north_m", "sd_east_m", "sd_down_m"]
        columns.append(position.sd)
    if velocity:
        names += ["velocity_north_mps", "velocity_east_mps", "velocity_up_mps"]
        columns.append(aiding.fixes[1].value * [1.0, 1.0, -1.0])
    table(folder / "fixes.csv", ",".join(names), columns)
    return truth


def content(**changes):
    found = {
        "imu": {"file": "imu.csv", "units": UNITS},
        "gnss_fixes": "fixes.csv",
        "sensors": SENSORS,
        "lever_arm": ARM,
    }
    return found | changes


def filtered(folder, **changes):
    return Navigated.of(Measured.of(content(**changes), folder))


def standardised(found, truth):
    """Errors of the solution in their predicted standard deviations, (K, 9)."""
    part = truth.segment(found.alignment.epoch * truth.dt, truth.duration)
    return found.solution.errors(part) / found.solution.sd


@pytest.mark.parametrize("velocity", [(0.1, 0.1, 0.15), None])
def test_a_drive_comes_back_within_its_own_standard_deviations(tmp_path, velocity):
    squares, fits = [], 0
    for seed in range(4):
        truth = drive(tmp_path, seed, velocity=velocity)
        found = filtered(tmp_path)
        squares.append(np.mean(standardised(found, truth) ** 2, axis=0))
        fits += found.fits
        assert found.longest_outage.end - found.longest_outage.start == pytest.approx(20.0)
    # Errors are correlated over some 10 s, so a run counts as 16 draws at least: 64 in all, of
    # which the mean square lies within 1 +- 5 sqrt(2 / 64); less is allowed, for the biases drawn
    # are smaller than what the filter is told to expect.
    assert np.all(np.mean(squares, axis=0) < 1.9)
    assert np.all(np.mean(squares, axis=0)[:3] > 0.4)
    assert fits == 4


def reference(folder, truth, start=START, step=5):
    """Write reference.csv, the truth of a drive at a fifth of the rate."""
    time = start + truth.dt * np.arange(0, truth.n + 1, step)
    angles = [np.degrees(each[::step]) for each in (truth.lla[:, :2], truth.rpy)]
    table(
        folder / "reference.csv",
        "time_s,latitude_deg,longitude_deg,height_m,roll_deg,pitch_deg,yaw_deg",
        [time, angles[0], truth.lla[::step, 2], angles[1]],
    )


def test_a_reference_shows_the_errors_of_the_solution(tmp_path):
    truth = drive(tmp_path)
    reference(tmp_path, truth)
    found = filtered(tmp_path, reference="reference.csv")
    part = truth.segment(found.alignment.epoch * truth.dt, truth.duration)
    expected = found.solution.errors(part)[~found.solution.before]
    against = found.against
    assert len(against.error) == len(expected)
    # A spline through 2 Hz of a car's track; straight roads end in turns within half a second.
    np.testing.assert_allclose(against.error[:, :3], expected[:, :3], atol=0.02)
    np.testing.assert_allclose(against.error[:, 8], expected[:, 8], atol=2e-3)
    nees = against.nees("position")
    assert nees.within and 0.2 < nees.lower < 1.0 < nees.upper < 3.0
    assert not against.disagreeing
    assert found.verdict.code == "consistent"
    assert "errors against reference.csv agree" in found.verdict.text
    assert found.to_dict()["reference"]["epochs"] == len(expected)
    assert "Against reference.csv, " in " ".join(str(found).split())
    reference(tmp_path, truth, start=START + 0.3)  # late stamps are errors of metres
    late = filtered(tmp_path, reference="reference.csv")
    assert late.against.nees("position").value > 10.0
    assert (late.verdict.code, late.verdict.severity) == ("errors-contradict", "bad")
    assert late.verdict.values["position"] == late.against.nees("position").value ** 0.5
    assert "which it is not" in late.accuracy[0]
    reference(tmp_path, truth, start=0.0)
    with pytest.raises(InputError, match="bring both to one clock"):
        filtered(tmp_path, reference="reference.csv")


def test_a_record_that_begins_in_flight_takes_heading_and_speed_from_gnss(tmp_path):
    truth = drive(tmp_path, 3, fixed_wing_loiter(duration=120.0, dt=1.0 / RATE), hole=(80.0, 90.0))
    found = filtered(tmp_path)
    assert "in steady motion" in " ".join(map(str, found.alignment.notices))
    assert found.alignment.gyro_bias_sd is None
    assert np.all(np.abs(standardised(found, truth)[0]) < 4.5)
    assert np.all(np.abs(standardised(found, truth)[-1]) < 4.5)


def test_a_heading_that_is_given_is_taken(tmp_path):
    truth = drive(tmp_path)
    true = np.degrees(truth.rpy[int(RATE), 2])
    found = filtered(tmp_path, heading=f"{true + 0.5} deg", heading_sd="1 deg")
    assert np.degrees(found.alignment.state.rpy[2]) == pytest.approx(true + 0.5)
    assert np.degrees(found.alignment.sd.heading) == pytest.approx(1.0)


def test_a_vehicle_that_never_moves_has_no_heading_unless_its_gyros_feel_the_earth(tmp_path):
    drive(tmp_path)
    for name, rows in (("imu.csv", int(19 * RATE)), ("fixes.csv", 19)):
        lines = (tmp_path / name).read_text().splitlines()[: rows + 1]
        (tmp_path / name).write_text("\n".join(lines))
    with pytest.raises(InputError, match="give the heading"):
        filtered(tmp_path)
    assert filtered(tmp_path, heading=1.0).solution.time[-1] == pytest.approx(18.0)


@pytest.mark.parametrize(
    ("changes", "verdict"),
    [
        ({"sensors": {"gyro": {"N": "1 deg/s/sqrt(Hz)"}, "accel": {"N": "30000 ug/sqrt(Hz)"}}},
         "too-small"),
        ({"position_sd": 0.3}, "too-large"),
    ],
)  # fmt: skip
def test_a_wrong_model_is_told(tmp_path, changes, verdict):
    short = car_drive(duration=80.0, dt=1.0 / RATE)
    drive(tmp_path, trajectory=short, deviations=False, hole=(50.0, 60.0))
    found = filtered(tmp_path, **changes)
    assert not found.fits
    assert (found.verdict.code, found.verdict.severity) == (verdict, "bad")


def test_standard_deviations_that_were_assumed_are_not_blamed_on_the_log(tmp_path):
    """Velocities of 0.08 m/s, in a file without standard deviations."""
    drive(tmp_path, velocity=(0.08, 0.08, 0.12))
    measured = Measured.of(content(), tmp_path)
    (assumed,) = (each for each in measured.notices if each.code == "sd-assumed")
    assert (assumed.where, assumed.values["down"]) == ("velocity", 0.15)
    found = Navigated.of(measured)
    verdict = found.verdict
    assert (verdict.code, verdict.severity, verdict.hint) == (
        "too-small", "note", "give velocity_sd",
    )  # fmt: skip
    assert verdict.values["velocity"] == pytest.approx(0.85, rel=0.1)
    assert "Only the standard deviations assumed" in verdict.text
    assert "which it is not" not in str(found)
    # Given ones are the user's own: they are wrong, and used only where the file has none.
    given = Measured.of(content(velocity_sd=[0.1, 0.1, 0.15], position_sd=3.0), tmp_path)
    codes = {(each.code, each.where) for each in given.notices}
    assert ("sd-not-used", "position") in codes
    assert ("sd-assumed", "velocity") not in codes
    assert Navigated.of(given).verdict.severity == "bad"
    # Far from the assumed ones is more than a note.
    drive(tmp_path, velocity=(0.02, 0.02, 0.03))
    found = filtered(tmp_path).verdict
    assert (found.severity, found.hint) == ("bad", "give velocity_sd")


def test_a_z_axis_that_points_up_is_the_first_thing_to_look_at_when_the_filter_is_lost(tmp_path):
    drive(tmp_path, trajectory=car_drive(duration=80.0, dt=1.0 / RATE), hole=(50.0, 60.0))
    path = tmp_path / "imu.csv"
    rows = np.genfromtxt(path, delimiter=",", skip_header=1)
    rows[:, [2, 3, 5, 6]] *= -1.0  # forward, left, up
    table(path, IMU_HEADER, [rows])
    bad = {"sensors": WRONG, "bias": {"gyro": 0, "accel": 0}}
    found = filtered(tmp_path, **bad)
    assert not found.fits
    (up,) = (each for each in found.notices if each.code == "axis-up")
    assert "reverse gyro_z and accel_z" in up.hint
    assert (found.verdict.code, found.verdict.severity) == ("lost", "bad")
    assert f"Look first at accel_z, which points up ({up.hint}), then at" in found.verdict.text


@pytest.fixture
def run(run):
    return partial(run, "navigate")


def test_the_command_writes_the_solution_and_a_report(run, monkeypatch):
    folder, out, replace, beside = Path("data"), Path("out"), os.replace, []
    folder.mkdir()
    out.mkdir()
    for name in ("solution.csv", "report.html"):
        (out / name).write_text("of an earlier run")

    def watched(*paths):
        replace(*paths)
        beside.append(sum(each.stat().st_size < 100 for each in out.glob("[rs]*")))

    monkeypatch.setattr(os, "replace", watched)
    truth = drive(folder)
    (folder / "run.yaml").write_text(yaml.safe_dump(content()))
    code, printed, told = run(folder / "run.yaml", "-o", "out")
    assert (code, told) == (0, "")
    assert beside == [2, 2, 0, 0], "a kill would mix two runs"
    assert max(map(len, printed.splitlines())) <= 80
    for text in ("Innovations: NIS", "Predicted accuracy at the end", "agree with",
                 "Longest time without a position fix: 20 s, from 1100 s to 1120 s"):  # fmt: skip
        assert text in printed
    rows = np.genfromtxt("out/solution.csv", delimiter=",", names=True)
    epoch = np.rint((rows["time_s"] - START) * RATE).astype(int)
    lla = np.column_stack([np.radians(rows["latitude_deg"]), np.radians(rows["longitude_deg"]),
                           rows["height_m"]])  # fmt: skip
    error = ned_difference(lla, truth.lla[epoch])
    sd = np.column_stack([rows[f"sd_{axis}_m"] for axis in ("north", "east", "down")])
    assert np.max(np.abs(error / sd)) < 5.0
    turn = (rows["yaw_deg"] - np.degrees(truth.rpy[epoch, 2]) + 180.0) % 360.0 - 180.0
    assert np.max(np.abs(turn / rows["sd_heading_deg"])) < 5.0
    page = Path("out/report.html").read_text()
    assert "agree with the filter&#39;s model" in page
    assert "<script" not in page
    assert (
        "gyro_x: white noise N 0.3333 deg/sqrt(h); Gauss-Markov sigma 20 deg/h, tau 100 s; "
        "bias at switch-on 0.1 deg/s"
    ) in page
    assert page.index("Predicted accuracy") < page.index(
        "<li>initial roll and pitch from 20 s at rest, from 0 s"
    )


BAD = {
    "no sensors": ({"sensors": None}, "there is no sensors: filtering needs"),
    "no imu": ({"imu": None}, "there is no imu"),
    "imu: missing": ({"imu": {"file": "no.csv", "units": UNITS}}, "no.csv does not exist"),
    "imu: unit": ({"imu": {"file": "imu.csv", "units": {"gyro": "rad/s", "accel": "g"}}},
                  "far from gravity"),
    "imu: fixes": ({"imu": {"file": "fixes.csv", "units": UNITS}}, "fixes.csv"),
    "fixes: imu": ({"gnss_fixes": "imu.csv"}, "has no column for latitude, longitude, height"),
    "fixes: folder": ({"gnss_fixes": "."}, "is a directory"),
    "both": ({"trajectory": "car"}, "'trajectory' is unknown"),
    "arm": ({"lever_arm": [1, 2]}, "lever_arm: [1, 2]: write three values"),
    "heading": ({"heading": "north"}, "heading: 'north' is not a number"),
    "sd": ({"position_sd": -1}, "position_sd[0]: -1: input should"),
    "bias": ({"bias": {"mag": 1}}, "'mag' is unknown"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_what_cannot_be_used_is_refused_in_one_sentence(run, case):
    drive(Path(), trajectory=car_drive(duration=30.0, dt=1.0 / RATE), hole=(10.0, 12.0))
    changes, message = BAD[case]
    Path("run.yaml").write_text(yaml.safe_dump(content(**changes)))
    code, printed, told = run("run.yaml", "-o", "out")
    assert (code, printed) == (2, "")
    assert told.startswith("gmwm: ")
    assert told.count("\n") == 1
    assert message in told, told
    assert not Path("out").exists()


def test_files_of_two_clocks_are_refused_with_both_spans(tmp_path):
    drive(tmp_path)
    path = tmp_path / "fixes.csv"
    path.write_text(path.read_text().replace("\n1", "\n9"))
    with pytest.raises(InputError, match=r"but imu.csv lasts from 1000 s to 1160 s"):
        Measured.of(content(), tmp_path)


def test_an_imu_that_is_shaken_all_the_time_needs_an_attitude(tmp_path):
    truth = drive(tmp_path)
    rows = np.genfromtxt(tmp_path / "imu.csv", delimiter=",", skip_header=1)
    rows[:, 4] += 3.0 * np.sin(2.0 * np.pi * 0.37 * rows[:, 0])
    table(tmp_path / "imu.csv", IMU_HEADER, [rows])
    with pytest.raises(InputError, match="give the attitude") as caught:
        filtered(tmp_path)
    assert caught.value.code == "attitude-unknown"
    rpy = truth.rpy[int(RATE)].tolist()
    assert filtered(tmp_path, attitude=rpy).alignment.notices[0].code == "attitude-given"


def test_misfits_of_two_kinds_do_not_make_each_other_good(tmp_path):
    """Fixes whose positions are worse than said and whose velocities are better."""
    drive(tmp_path, deviations=False)
    found = filtered(tmp_path, position_sd=[0.8, 0.8, 1.2], velocity_sd=0.2)
    assert not found.fits
    sizes = found.verdict.values
    assert found.verdict.code == "mixed-sizes"
    assert sizes["position"] > 1.0 > sizes["velocity"]
    assert "which it is not" in " ".join(str(found).split())


def test_the_longest_time_without_a_fix_ends_at_a_fix_between_two_samples(tmp_path):
    """Its predicted error was nan where the fix was not at a sample of the IMU."""
    drive(tmp_path)
    path = tmp_path / "fixes.csv"
    header, *rows = path.read_text().splitlines()
    cells = [row.split(",") for row in rows]
    moved = [",".join([f"{float(first) + 0.013:.6f}", *rest]) for first, *rest in cells]
    path.write_text("\n".join([header, *moved]))
    found = filtered(tmp_path)
    assert np.all(np.isfinite(found.longest_outage.sd)) and 1.0 < found.longest_outage.sd[0] < 100.0
    assert found.longest_outage.distance is not None
    assert found.longest_outage.end - found.longest_outage.start == pytest.approx(20.0)
    assert "nan" not in str(found)


def test_innovations_of_one_kind_are_judged_by_themselves():
    kind = np.array([KINDS["position"], KINDS["velocity"]] * 50)
    standard = np.random.default_rng(1).standard_normal((100, 3))
    for name in ("position", "velocity"):
        wild = np.where((kind != KINDS[name])[:, None], 30.0, 1.0) * standard
        one, other = (SimpleNamespace(kind=kind, standard=each) for each in (standard, wild))
        assert innovation_sizes(one, name) == innovation_sizes(other, name)
