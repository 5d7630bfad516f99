"""A fleet: every unit by itself, kept on disk, gone on with, never mixed up."""

import csv
import json
import re
import shutil
from dataclasses import FrozenInstanceError
from functools import wraps

import numpy as np
import pyarrow.parquet as pq
import pytest

import gmwm
from fleets import QUICK
from gmwm import Calibration, Fleet, InputError, RandomWalk, WhiteNoise
from gmwm.issues import Notice
from gmwm.population import LETTERS, SCHEMA, task as tasks, unit as lots

READING = ("rate", "units")


@pytest.fixture(scope="module", autouse=True)
def quick():
    """Without the search for steps and drifts, which takes most of the time of short recordings."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("gmwm.calibration.channel.departures", lambda *_: ())
        yield


@pytest.fixture(scope="module")
def record():
    """Write a recording of white noise, a CSV file with time stamps or an NPZ file without."""

    def _record(path, seed=0, N=1e-3, channels=("gyro_x", "gyro_y"), n=200, dt=1.0):
        path.parent.mkdir(parents=True, exist_ok=True)
        rng = np.random.default_rng(seed)
        columns = {name: WhiteNoise(N).simulate(n, 1.0, rng) for name in channels}
        if path.suffix == ".csv":
            rows = np.column_stack([dt * np.arange(n), *columns.values()])
            header = ",".join(["time_s", *channels])
            np.savetxt(path, rows, delimiter=",", header=header, comments="")
        else:
            np.savez(path, **columns)
        return str(path)

    return _record


@pytest.fixture(scope="module")
def lot(record, tmp_path_factory):
    """Three recordings and one that is damaged."""
    folder = tmp_path_factory.mktemp("lot")
    paths = [record(folder / f"unit {i}.npz", seed=i) for i in range(2)]
    paths.append(record(folder / "third.npz", seed=2, N=2e-3, channels=("gyro_x",)))
    (folder / "<b>damaged.npz").write_text("nothing")
    return [*paths, str(folder / "<b>damaged.npz")]


@pytest.fixture(scope="module")
def outputs(lot, tmp_path_factory):
    folder = tmp_path_factory.mktemp("outputs") / "out"
    return folder, gmwm.fleet(lot, folder=folder, **QUICK)


@pytest.fixture
def copied(outputs, tmp_path):
    """A copy of the outputs, to be damaged."""
    shutil.copytree(outputs[0], tmp_path / "out")
    return tmp_path / "out"


@pytest.fixture
def worked(monkeypatch):
    """Sources of the recordings that are calibrated."""
    seen = []
    usual = tasks.calibrate

    def _calibrate(recording, *rest, **named):
        seen.append(recording.source)
        return usual(recording, *rest, **named)

    monkeypatch.setattr(tasks, "calibrate", _calibrate)
    return seen


# -- the result -----------------------------------------------------------------------------------


def codes(found):
    return {notice.code for notice in found.notices}


def test_a_fleet_is_a_mapping_of_paths_to_calibrations_or_why_not(lot, outputs):
    _, found = outputs
    assert list(found) == lot
    assert [type(each) for each in found.values()] == [*[Calibration] * 3, Notice]
    assert list(found.failed) == lot[3:]
    assert "is not an NPZ file" in found[lot[3]].text
    assert found.valid
    alone = gmwm.calibrate(gmwm.read(lot[0], 1.0, {"gyro": "rad/s"}), WhiteNoise(), screening=())
    assert found[lot[0]].to_dict() == alone.to_dict()
    with pytest.raises(KeyError, match="the fleet has no recording 'x'"):
        found["x"]
    with pytest.raises(FrozenInstanceError):
        found.limits = {}
    assert repr(found) == "<Fleet of 4 units: 3 calibrated, 1 not>"


def test_the_table_has_a_row_per_unit_channel_and_number(lot, outputs):
    folder, found = outputs
    table = pq.read_table(folder / "fleet.parquet")
    assert table.schema.equals(SCHEMA)
    assert table.to_pylist() == [dict(row) for row in found.rows]
    keys = [(row["device"], row["channel"], row["number"]) for row in found.rows]
    assert len(set(keys)) == len(keys) == 5 * len(LETTERS) + 1
    (row,) = [row for row in found.rows if row["device"] == "_b_damaged"]
    assert row["channel"] is None
    assert not row["valid"]
    assert row["reasons"] == row["notices"] == ["not-calibrated"]
    own = found[lot[0]].numbers["gyro_x"]
    for row in found.rows[:3]:
        number = getattr(own, row["number"])
        value = None if number.kind == "bound" else number.value
        assert (row["kind"], row["value"], row["unit"]) == (number.kind, value, number.unit)
        assert row["upper"] == pytest.approx(number.upper)
    with open(folder / "fleet.csv", encoding="utf-8", newline="") as stream:
        lines = list(csv.DictReader(stream))
    assert [line["device"] for line in lines] == [row["device"] for row in found.rows]
    assert float(lines[0]["value"]) == found.rows[0]["value"]
    assert lines[-1]["reasons"] == "not-calibrated"
    assert len(found.to_frame()) == len(keys)
    json.dumps(found.to_dict(), allow_nan=False)


def test_limits_give_a_verdict_on_every_unit_and_axis(lot, outputs, tmp_path):
    limits = {"gyro": {"N": 1.5e-3, "K": 1.0}, "gyro_y": {"N": 1e-3}, "accel": {"N": 1.0}}
    found = gmwm.fleet(lot, limits=limits, folder=tmp_path / "out", **QUICK)
    assert found.grid["unit 0"]["gyro_x"] == {"N": "pass", "K": "pass"}
    assert found.grid["unit 0"]["gyro_y"] == {"N": "?"}  # the truth is at the limit
    assert found.grid["third"]["gyro_x"] == {"N": "FAIL", "K": "pass"}
    assert found.grid["third"]["gyro_y"] == {"N": "none"}
    assert found.grid["_b_damaged"]["gyro_x"] == {"N": "none", "K": "none"}
    assert {row["accel"]["N"] for row in found.grid.values()} == {"none"}
    assert not found.meets_limits
    assert gmwm.fleet(lot[:1], limits={"gyro": {"N": 2e-3}}, **QUICK).meets_limits
    text = str(found)
    assert "Limits: 0 of 4 units pass" in text
    assert re.search(r"third +FAIL N +none +none", text)
    assert all(len(line) <= 80 for line in text.splitlines())
    assert ">FAIL N<" in (tmp_path / "out" / "fleet.html").read_text()
    again = Fleet.load(tmp_path / "out")
    assert (str(again), again.grid) == (text, found.grid)
    assert outputs[1].grid["unit 0"] == {}
    assert outputs[1].meets_limits


def test_a_report_is_self_contained_and_names_are_no_markup(outputs):
    text = (outputs[0] / "fleet.html").read_text(encoding="utf-8")
    assert "default-src &#39;none&#39;; script-src &#39;none&#39;" in text
    assert "&lt;b&gt;damaged.npz is not an NPZ file" in text
    assert "<b>damaged" not in text
    assert "<b>still</b>: yes</span>" in text
    assert "[&#39;" not in text
    assert "http" not in re.sub(r"<svg.*?</svg>", "", text.replace("http-equiv", ""), flags=re.S)
    assert len(text) < 200_000


# -- the folder -----------------------------------------------------------------------------------


def test_every_unit_has_a_calibration_of_its_own(lot, outputs):
    folder, found = outputs
    kept = sorted((folder / "calibrations").iterdir())
    assert [path.stem for path in kept] == ["third", "unit 0", "unit 1"]
    assert gmwm.load(kept[1]).to_dict() == found[lot[0]].to_dict()


def test_what_is_done_is_not_done_again(lot, outputs, copied, worked):
    usual = {"clock": "header", "topic": (), "channels": None, "layout": None}
    again = gmwm.fleet(lot, folder=copied, resume=True, **QUICK, **usual)
    assert worked == []
    assert again.to_dict() == outputs[1].to_dict()


def test_without_resume_nothing_is_touched(lot, copied, worked):
    with pytest.raises(InputError, match="resume it, or give another folder") as caught:
        gmwm.fleet(lot, folder=copied, **QUICK)
    assert caught.value.code == "earlier-runs"
    assert worked == []


def test_a_recording_that_changed_is_done_again(lot, copied, worked, record, tmp_path):
    paths = [record(tmp_path / f"{i}.npz", seed=i) for i in range(2)]
    folder = tmp_path / "new"
    gmwm.fleet(paths, folder=folder, **QUICK)
    record(tmp_path / "1.npz", seed=9)
    worked.clear()
    found = gmwm.fleet(paths, folder=folder, resume=True, **QUICK)
    assert worked == ["1.npz"]
    assert gmwm.load(folder / "calibrations" / "1.json").to_dict() == found[paths[1]].to_dict()


@pytest.mark.parametrize(
    ("change", "other"),
    [
        ({"model": RandomWalk()}, "models"),
        ({"rate": 2.0}, "reading"),
        ({"start": 10.0, "stop": 100.0}, "start, stop"),
    ],
)
def test_units_of_other_options_are_not_mixed_in(lot, copied, worked, change, other):
    before = {path: path.read_bytes() for path in copied.rglob("*.*") if path.is_file()}
    with pytest.raises(InputError, match=rf"another fleet \(other {other}\)") as caught:
        gmwm.fleet(lot, folder=copied, resume=True, **(QUICK | change))
    assert caught.value.code == "other-runs"
    assert {path: path.read_bytes() for path in copied.rglob("*.*") if path.is_file()} == before
    assert worked == []


def test_units_of_another_version_are_not_mixed_in(lot, copied, monkeypatch):
    monkeypatch.setattr("gmwm._core.__version__", "0.0.0")
    with pytest.raises(InputError, match="other version"):
        gmwm.fleet(lot, folder=copied, resume=True, **QUICK)


@pytest.mark.parametrize(
    "damage", ["empty", "cut", "foreign", "plain", "origin", "odd", "list", "null"]
)
def test_a_damaged_or_foreign_calibration_is_refused_in_one_sentence(
    lot, outputs, copied, worked, damage
):
    path = copied / "calibrations" / "unit 0.json"
    text = path.read_text()
    content = json.loads(text)
    if damage == "origin":
        content["fleet"]["sha256"] = "large"
    if damage == "odd":
        content["fleet"] = ["a"]
    if damage == "plain":
        del content["fleet"]
    path.write_text({
        "empty": "", "cut": text[: len(text) // 2], "foreign": '{"schema": "x", "fleet": {}}',
        "list": "[1]", "null": "null",
    }.get(damage, json.dumps(content)))  # fmt: skip
    for again in (lambda: gmwm.fleet(lot, folder=copied, resume=True, **QUICK),
                  lambda: Fleet.load(copied)):  # fmt: skip
        with pytest.raises(InputError) as caught:
            again()
        assert str(path) in str(caught.value)
        assert "\n" not in str(caught.value)
    assert worked == []


def test_another_recording_of_the_same_name_is_not_taken_for_it(record, tmp_path, worked):
    first, second = (record(tmp_path / each / "static.npz", seed) for seed, each in
                     enumerate("ab"))  # fmt: skip
    gmwm.fleet(first, folder=tmp_path / "out", **QUICK)
    with pytest.raises(InputError, match=r"belongs to .*a/static.npz, not .*b/static.npz"):
        gmwm.fleet(second, folder=tmp_path / "out", resume=True, **QUICK)
    both = gmwm.fleet([first, second], folder=tmp_path / "both", **QUICK)
    assert [unit.name for unit in both.units.values()] == ["a-static.npz", "b-static.npz"]
    # The same recording at another place is known by its content.
    worked.clear()
    (tmp_path / "moved").mkdir()
    shutil.move(first, tmp_path / "moved")
    gmwm.fleet(tmp_path / "moved" / "static.npz", folder=tmp_path / "out", resume=True, **QUICK)
    assert worked == []


def test_calibrations_of_other_recordings_are_left_and_not_counted(lot, copied):
    found = gmwm.fleet(lot[:1], folder=copied, resume=True, **QUICK)
    assert len(found) == 1
    (notice,) = [each for each in found.notices if each.code == "left-over"]
    assert notice.values == {"units": 2}
    assert len(list((copied / "calibrations").iterdir())) == 3


@pytest.mark.parametrize("at", [0, 2])
def test_an_interrupt_keeps_what_is_done(lot, tmp_path, at, outputs, monkeypatch):
    usual, count = tasks.calibrate, iter(range(9))

    def interrupted(*rest, **named):
        if next(count) == at:
            raise KeyboardInterrupt
        return usual(*rest, **named)

    monkeypatch.setattr(tasks, "calibrate", interrupted)
    folder = tmp_path / "out"
    with pytest.raises(KeyboardInterrupt):
        gmwm.fleet(lot, folder=folder, **QUICK)
    kept = sorted(folder.rglob("*.*")) if at else []
    assert len([path for path in kept if path.suffix == ".json"]) == at
    assert folder.exists() == bool(at)
    assert not (folder / "fleet.parquet").exists()
    again = gmwm.fleet(lot, folder=folder, resume=True, **QUICK)
    assert again.to_dict() == outputs[1].to_dict()


def test_a_folder_has_one_fleet_at_a_time(lot, tmp_path):
    def second(done, total, what):
        with pytest.raises(InputError, match="is in use") as caught:
            gmwm.fleet(lot, folder=tmp_path, resume=True, **QUICK)
        assert caught.value.code == "runs-in-use"

    gmwm.fleet(lot[:1], folder=tmp_path, progress=second, **QUICK)
    gmwm.fleet(lot[:1], folder=tmp_path, resume=True, **QUICK)


# -- units that are not like the others -----------------------------------------------------------


def test_where_nothing_can_be_calibrated_nothing_is_written(lot, tmp_path):
    with pytest.raises(InputError, match=r"damaged\.npz is not an NPZ file"):
        gmwm.fleet(lot[3], folder=tmp_path / "out", **QUICK)
    missing = str(tmp_path / "missing.npz")
    with pytest.raises(InputError, match="none of 3 recordings can be calibrated; the first:"):
        gmwm.fleet([lot[3], missing, str(tmp_path)], folder=tmp_path / "out", **QUICK)
    assert not (tmp_path / "out").exists()
    with pytest.raises(InputError, match="units") as caught:
        gmwm.fleet(lot[:1], rate=1.0)
    assert "gyro-unit-missing" in caught.value.code


def test_an_error_of_the_program_costs_one_unit_only(lot, monkeypatch):
    usual = tasks.calibrate

    def failing(recording, *rest, **named):
        if recording.source == "unit 0.npz":
            raise ZeroDivisionError("of all\nthings")
        if recording.source == "unit 1.npz":
            raise MemoryError
        return usual(recording, *rest, **named)

    monkeypatch.setattr(tasks, "calibrate", failing)
    found = gmwm.fleet(lot, **QUICK)
    assert [each.code for each in found.failed.values()] == [
        "unexpected", "memory", "not-calibrated"
    ]  # fmt: skip
    assert found[lot[0]].text == "ZeroDivisionError: of all things"


@pytest.mark.parametrize("stage", ["numbers_of", "to_dict"])
def test_a_unit_that_fails_beside_the_others_costs_one_unit(lot, tmp_path, monkeypatch, stage):
    """The second stage: one structure for all units; and what is written of each."""
    bad = gmwm.fleet(lot[:1], **QUICK)[lot[0]]["gyro_y"].wv.variance[0]
    place = lots if stage == "numbers_of" else Calibration
    usual = getattr(place, stage)

    def failing(given):
        if stage == "to_dict":
            return usual(given) | ({"odd": np.nan} if given.source == "unit 0.npz" else {})
        return 1 / 0 if given.wv.variance[0] == bad else usual(given)

    monkeypatch.setattr(place, stage, failing)
    found = gmwm.fleet(lot, folder=tmp_path / "out", **QUICK)
    assert list(found.failed) == [lot[0], lot[3]]
    assert found[lot[0]].code == "unexpected" and found[lot[0]] in found.notices
    assert found.failed == gmwm.Fleet.load(tmp_path / "out").failed
    assert {each.stem for each in (tmp_path / "out" / "calibrations").iterdir()} == {
        "unit 1", "third"
    }  # fmt: skip
    assert all("unit 0" not in each.numbers for each in found.structures)
    assert {row["device"] for row in found.rows if row["valid"]} == {"unit 1", "third"}


def test_models_are_given_by_channel_or_sensor(lot):
    given = {"gyro": WhiteNoise(), "gyro_y": RandomWalk()}
    found = gmwm.fleet(lot[:1], given, screening=(), **{k: QUICK[k] for k in READING})
    titles = [fit.model.title() for fit in found[lot[0]].values()]
    assert titles == ["white noise", "random walk"]
    with pytest.raises(InputError, match="no model is given for channel 'gyro_x'"):
        gmwm.fleet(lot[:1], {"accel": WhiteNoise()}, rate=1.0, units={"gyro": "rad/s"})


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"model": "N + X"}, "'X' is not a term"),
        ({"screening": ("shocks",)}, "screening = 'shocks'"),
        ({"still": "yes"}, "still = 'yes'"),
        ({"limits": 3}, "limits of '' = 3: give them in SI"),
        ({"limits": {"gyro": {"Q": 1.0}}}, "give them in SI"),
        ({"limits": {"gyro": {"N": -1.0}}}, "limit N of gyro = -1.0"),
        ({"jobs": 0}, "jobs = 0"),
        ({"unit": {"gyro": "rad/s"}}, "argument = 'unit': choose from rate"),
        ({"start": "a"}, "start = 'a'"),
        ({"stop": "a"}, "stop = 'a'"),
    ],
)
def test_options_are_checked_before_the_work(lot, worked, change, words):
    with pytest.raises(InputError) as caught:
        gmwm.fleet(lot, **(QUICK | change))
    assert words in str(caught.value)
    assert worked == []


def test_a_fleet_is_loaded_from_its_folder(outputs, copied):
    found = Fleet.load(copied)
    assert str(found) == str(outputs[1])
    assert found.to_dict() == outputs[1].to_dict()
    assert found.failed == outputs[1].failed
    text = (copied / "fleet.json").read_text()
    for old, new in (
        ('"limits": {}', '"limits": {"gyro": {"N": -1.0}}'),
        ('"channel": "gyro_x"', '"channel": "gyro_z"'),
        ('"unit 0"', '"../unit 0"'),
        ("unit 0", "unit 7"),
        (text[300:], ""),
    ):
        damage = text.replace(old, new)
        assert damage != text
        (copied / "fleet.json").write_text(damage)
        with pytest.raises(InputError, match=r"fleet.json|unit 7"):
            Fleet.load(copied)
    (copied / "fleet.json").unlink()
    with pytest.raises(InputError, match=r"holds no fleet\.json"):
        Fleet.load(copied)


def test_a_unit_that_fails_later_leaves_no_calibration(record, tmp_path):
    paths = [record(tmp_path / "in" / f"{i}.npz", i) for i in range(2)]
    first = gmwm.fleet(paths, folder=tmp_path / "out", **QUICK)
    (tmp_path / "in" / "1.npz").write_text("nothing")
    found = gmwm.fleet(paths, folder=tmp_path / "out", resume=True, **QUICK)
    assert list(found.failed) == paths[1:] and len(first.failed) == 0
    assert [each.name for each in (tmp_path / "out" / "calibrations").iterdir()] == ["0.json"]
    assert list(Fleet.load(tmp_path / "out").failed) == paths[1:]


@pytest.mark.parametrize("is_folder", [False, True])
def test_a_recording_that_changes_meanwhile_is_not_taken_for_the_other(
    record, tmp_path, monkeypatch, is_folder
):
    path = record(tmp_path / "in" / "a.npz")
    given = str(tmp_path / "in") if is_folder else path
    at_rest = gmwm.read(path, 1.0, {"gyro": "rad/s"})

    @wraps(gmwm.read)
    def changed(*_, **__):
        record(tmp_path / "in" / "a.npz", seed=9, n=300)
        return at_rest

    monkeypatch.setattr(tasks, "read", changed)
    with pytest.raises(InputError, match="changed while it was calibrated"):
        gmwm.fleet(given, **QUICK)


def test_units_of_another_kind_are_reported(record, tmp_path):
    options = {key: each for key, each in QUICK.items() if key != "rate"}
    paths = [record(tmp_path / f"{i}.csv", seed=i, channels=("gyro_x",)) for i in (1, 2)]
    shutil.copy(paths[0], tmp_path / "copy.csv")
    alike = [*paths, tmp_path / "copy.csv"]
    assert codes(gmwm.fleet(alike, **options)) == {"same-recording", "few-units"}
    short = record(tmp_path / "short.csv", channels=("gyro_y",), n=100, dt=0.5)
    assert codes(gmwm.fleet([*alike, short], **options)) == {
        "same-recording", "few-units", "rates-differ", "channels-differ",
    }  # fmt: skip
