"""Logs that are navigated, and all that is said of them, as recorded."""

from dataclasses import replace

import numpy as np
import pytest

from gmwm._core.notices import Notice
from gmwm.ins import Measured, Navigated, Outage, compare
from gmwm.ins.field.explanations import Explanation
from gmwm.ins.field.outage_pictures import outage_pictures
from gmwm.ins.field.replay import Replay, alignment_of
from gmwm.ins.field.smoother import smooth
from gmwm.ins.field.start.alignment import align
from gmwm.study.emulated_logs import emulated_log, sensors
from recorded import Pictures, assert_as_recorded, summed


def all_of(navigated):
    solution = navigated.solution
    faults = navigated.faults
    return {
        "alignment": summed(navigated.alignment), "hole": navigated.hole, "lla": solution.lla,
        "sd": solution.sd, "farthest": navigated.farthest, "usual": navigated._usual_size,
        "accuracy": navigated.accuracy, "notices": navigated.notices,
        "verdict": navigated.verdict, "tests": [navigated.test(), navigated.test("position")],
        "found": [
            [each.code, each.where, each.gain, each.cost, each.values, each.errors]
            for each in faults.found
        ],
        "resolution": faults.resolution, "alternatives": list(faults.alternatives),
    }  # fmt: skip


LOGS = {
    "car": {"seed": 1},
    "no velocity": {"seed": 4, "vehicle": "loiter", "velocity": False},
    "stamps": {"seed": 5, "faults": ("stamps",)},
    "arm": {"seed": 6, "vehicle": "loiter", "faults": ("lever arm",)},
    "coloured": {"seed": 8, "faults": ("coloured",)},
    "scale": {"seed": 9, "vehicle": "loiter", "faults": ("gyro scale",)},
}


@pytest.mark.parametrize("name", LOGS)
def test_a_log(name):
    log, _ = emulated_log(**LOGS[name], duration=50.0, rate=4.0)
    navigated = Navigated.of(replace(log, start=100.0))
    assert_as_recorded(f"ins/log_{name.replace(' ', '_')}", all_of(navigated), rtol=1e-4)


def test_models_that_are_compared():
    log, _ = emulated_log(21, duration=190.0, rate=2.0)
    found = compare(log, {"right": sensors(), "bold": sensors(gyro=0.1, accel=0.1, slow=0.1)}, 15.0)
    replay = Replay.of(log, align(log.imu, log.aiding, log.sensors))
    smoothed = smooth(replay, np.array([10.5, 70.0, 120.5]))
    everything = {
        "outcomes": found.outcomes, "outages": found.outages,
        "pairs": {"/".join(names): each for names, each in found.pairs.items()},
        "verdict": found.verdict, "text": str(found), "resolved": found.resolved,
        "needed": found.length_needed,
        "smoothed": [smoothed.lla, smoothed.covariance, smoothed.solution.lla],
    }  # fmt: skip
    assert_as_recorded("ins/compared", everything, rtol=1e-4)


SENSORS = {
    "gyro": {"N": "10 deg/h/sqrt(Hz)", "GM": [["10 deg/h", 100]]},
    "accel": {"N": "100 ug/sqrt(Hz)", "GM": [["100 ug", 100]]},
}


def test_files_of_a_log(tmp_path):
    """Stamps that tremble, samples that are lost, dates, a barometer, standstills."""
    log, truth = emulated_log(31, duration=60.0, rate=10.0)
    rng = np.random.default_rng(32)
    imu, position = log.imu, log.aiding.of("position")
    stamps = 1000.0 + imu.dt * (1.0 + np.arange(imu.n)) + 1e-3 * rng.uniform(-1.0, 1.0, imu.n)
    rows = np.column_stack([stamps, imu.rotation / imu.dt, imu.velocity / imu.dt])
    rows = np.delete(rows, [100, 250], axis=0)
    np.savetxt(tmp_path / "imu.csv", rows, "%.9g", ",", comments="",
               header="time_s,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z")  # fmt: skip
    fixes = np.column_stack([1000.0 + position.time, np.degrees(position.value[:, :2]),
                             position.value[:, 2]])  # fmt: skip
    np.savetxt(tmp_path / "fixes.csv", fixes, "%.11g", ",", comments="",
               header="time_s,latitude_deg,longitude_deg,height_m")  # fmt: skip
    heights = np.column_stack([1000.5 + np.arange(50.0), truth.lla[5:505:10, 2] + 30.0])
    np.savetxt(tmp_path / "barometer.csv", heights, "%.9g", ",", comments="",
               header="time_s,height_m")  # fmt: skip
    content = {
        "imu": {"file": "imu.csv", "units": {"gyro": "rad/s", "accel": "m/s^2"}},
        "gnss_fixes": "fixes.csv", "sensors": SENSORS, "barometer": "barometer.csv",
        "zero_velocity": 0.05, "lever_arm": [1.0, 0.3, -1.0], "position_sd": [1.0, 1.0, 1.5],
        "bias": {"gyro": "0.02 deg/s", "accel": "5 mg"}, "gnss_shift": 0.02, "gate": 0.001,
    }  # fmt: skip
    measured = Measured.of(content, tmp_path)
    found = {
        "imu": measured.imu, "fixes": measured.aiding.fixes, "start": measured.start,
        "sd": measured.sensors.bias_sd, "gate": measured.aiding.gate,
        "notices": [(each.code, each.text, each.values) for each in measured.notices],
        "solution": Navigated.of(measured).solution.lla,
    }  # fmt: skip
    assert_as_recorded("ins/log_of_files", found, rtol=1e-4)


def test_a_start_at_rest_and_one_with_a_given_attitude():
    log, _ = emulated_log(33, duration=60.0, rate=10.0)
    found = {}
    for name, options in {
        "plain": {}, "heading": {"heading": 1.0, "heading_sd": 0.02},
        "attitude": {"attitude": (0.0, 0.01, 1.0), "attitude_sd": 0.02},
    }.items():  # fmt: skip
        measured = replace(log, **options)
        found[name] = alignment_of(measured)
    assert_as_recorded("ins/alignments", found)


@pytest.fixture(scope="module")
def plain():
    log, _ = emulated_log(1, duration=50.0, rate=4.0)
    return Navigated.of(replace(log, start=100.0))


def made_up(plain, change, notices=(), diverged=None, **faults):
    """The same log with other innovations, and nothing found that explains them."""
    solution = plain.solution
    innovations = solution.innovations
    factor = change(innovations)
    innovations = replace(innovations, value=innovations.value * factor[:, None])
    measured = replace(plain.measured, notices=notices)
    solution = replace(solution, innovations=innovations, diverged_at=diverged)
    made = replace(plain, measured=measured, solution=solution)
    vars(made)["faults"] = replace(plain.faults, **{"found": (), "explained": False, **faults})
    return made


UP = Notice("axis-up", "warning", "accel_z", "", {}, "turn it round")
STUCK = Notice("stuck", "bad", "gyro_x", "it holds one value")


@pytest.mark.parametrize(
    ("code", "change", "notices"),
    [
        ("consistent", lambda i: np.ones(i.kind.size), ()),
        ("too-small", lambda i: np.full(i.kind.size, 0.5), ()),
        ("too-large", lambda i: np.full(i.kind.size, 2.0), ()),
        ("mixed-sizes", lambda i: np.where(i.kind == i.kind[0], 0.4, 3.0), ()),
        ("outliers", lambda i: np.where(np.arange(i.kind.size) % 20 == 7, 12.0, 1.0), ()),
        ("lost", lambda i: np.full(i.kind.size, 300.0), ()),
        ("lost", lambda i: np.full(i.kind.size, 300.0), (UP, STUCK)),
    ],
)
def test_what_innovations_of_a_size_mean(plain, code, change, notices):
    made = made_up(plain, change, notices)
    verdict = made.verdict
    assert verdict.code == code
    assert made.fits == (code == "consistent")
    assert ("were its model right, which it is not" in made.accuracy[0]) == (code != "consistent")
    found = {"verdict": verdict, "accuracy": made.accuracy, "misfits": made._misfits,
             "text": str(made), "rejected": made.rejections, "usual": made._usual_size}  # fmt: skip
    assert_as_recorded(f"ins/verdict_{code}{len(notices)}", found, rtol=1e-5)


def test_a_filter_that_diverged(plain):
    made = made_up(plain, lambda i: np.ones(i.kind.size), diverged=20.0)
    assert made.verdict.code == "diverged"
    assert not made.fits
    start = float(made.clock(np.array([20.0]))[0])
    assert made.accuracy[0] == f"The filter diverged at {start:.10g} s and was stopped"


@pytest.mark.parametrize(
    ("factor", "assumed", "severity"),
    [(1.2, False, "warning"), (1.2, True, "note"), (4.0, False, "bad"), (4.0, True, "warning")],
)
def test_fixes_of_another_noise_and_what_is_believed_then(plain, factor, assumed, severity):
    """Of a filter that is not right its own accuracy is; a note is no fault of the log."""
    values = {"factor": factor}
    fault = Explanation("fix-noise", "position", lambda log: log, plain.faults.replay, 30.0, 8.0,
                        values)  # fmt: skip
    sizes = {"north": 1.0, "east": 1.0, "down": 1.5}
    notice = Notice("sd-assumed", "note", "position", "", sizes, "give position_sd")
    notices = (notice,) if assumed else ()
    made = made_up(plain, lambda i: np.ones(i.kind.size), notices, found=(fault,), explained=True)
    assert (made.verdict.code, made.verdict.severity) == ("fix-noise", severity)
    assert ("which it is not" in made.accuracy[0]) == (severity != "note")
    assert ("Only the standard deviations assumed" in made.verdict.text) == assumed
    assert made.verdict.text.endswith(
        "With that, the innovations are as large as expected, and white."
    )
    left = made_up(plain, lambda i: np.ones(i.kind.size), notices, found=(fault,),
                   alternatives=("coloured", "outliers"))  # fmt: skip
    assert (
        "; nearly as probable: coloured, outliers. That does not explain all" in left.verdict.text
    )
    assert left.verdict.values["faults"] == 1


def test_what_is_drawn_of_a_log(monkeypatch):
    """With two times without fixes, one of them too short to be shown."""
    log, _ = emulated_log(3, "loiter", duration=90.0, rate=4.0)
    log = replace(log, aiding=log.aiding.without((Outage(60.0, 12.0), Outage(80.0, 3.0))))
    navigated = Navigated.of(log)
    pictures = Pictures(monkeypatch)
    navigated.plot_track()
    navigated.plot_innovations()
    titles = [title for title, _ in outage_pictures(navigated)]
    assert len(titles) == 1
    models = {"right": sensors(), "bold": sensors(gyro=0.1, accel=0.1, slow=0.1)}
    compare(emulated_log(21, duration=190.0, rate=2.0)[0], models, 15.0).plot()
    assert_as_recorded("ins/drawn_log", [titles, pictures.asked], rtol=1e-4)
