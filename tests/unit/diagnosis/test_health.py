"""`Health`: what it prints, holds and refuses; and what it finds in real recordings."""

import json

import numpy as np
import pytest

import gmwm
from gmwm import Health, InputError
from gmwm.diagnosis.resonances import peaks
from gmwm.issues import SEVERITIES, Notice
from marks import every
from places import SHARED

ADIS = SHARED / "data/adis16405"
needs_adis = pytest.mark.skipif(not ADIS.exists(), reason="ADIS16405 recordings are not here")


def adis(number, **more):
    units = {"gyro": "deg/s", "accel": "g"}
    return gmwm.read(ADIS / f"adis16405_{number}.csv.gz", rate=100, units=units, **more)


@pytest.fixture
def sick(record):
    """A channel with much to tell and one with nothing."""
    rng = np.random.default_rng(1)
    x, y = rng.normal(size=20_000), rng.normal(size=20_000)
    x += np.linspace(0.0, 20.0, x.size) + 0.4 * np.sin(0.5 * np.arange(x.size))
    x[7000] += 30.0
    x[9000:9050] = x[8999]
    return record(gyro_x=np.rint(x / 1.5) * 1.5, gyro_y=y)


def test_printed_within_80_columns_worst_first(sick):
    found = gmwm.health(sick)
    text = str(found)
    assert max(map(len, text.splitlines())) <= 80
    order = [SEVERITIES.index(notice.severity) for notice in found.of("gyro_x")]
    assert order == sorted(order)
    blocks = text.split("\n\n")
    assert [block.splitlines()[0] for block in blocks[1:]] == [
        "whole recording",
        "gyro_x",
        "gyro_y",
    ]
    for notice in found.notices:
        assert "".join(notice.text.split()) in "".join(text.split())


def test_everything_is_found_at_once(sick):
    found = gmwm.health(sick)
    kinds = {notice.code for notice in found.of("gyro_x")}
    assert {"event", "stuck", "line", "drift", "rounding"} <= kinds
    assert [notice.code for notice in found.of("gyro_y")] == ["clean"]
    assert found.lsb("gyro_x") == pytest.approx(1.5)
    assert found.lsb("gyro_y") == 0.0


def test_json_holds_everything(sick):
    found = gmwm.health(sick)
    content = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert content["schema"] == "gmwm.health"
    assert content["rate_hz"] == 100.0
    assert len(content["notices"]) == len(found.notices)
    assert content["channels"]["gyro_x"]["events"] == [list(e) for e in found.events("gyro_x")]
    assert content["channels"]["gyro_x"]["lines"] == [list(e) for e in found.lines("gyro_x")]
    assert content["worst"] == found.worst


def test_a_file_comes_back_and_one_of_an_older_version_is_refused(sick, tmp_path):
    found = gmwm.health(sick)
    again = Health.load(found.save(tmp_path / "health.json"))
    assert again.to_dict() == found.to_dict()
    assert again.events("gyro_x") == found.events("gyro_x")
    assert str(again) == str(found)
    with pytest.raises(InputError, match="schema version 1 is unknown"):
        Health.from_dict(found.to_dict() | {"schema_version": 1})


def test_unknown_channel_lists_those_there_are(sick):
    found = gmwm.health(sick)
    for ask in (found.lines, found.events, found.resonances, found.lsb):
        with pytest.raises(InputError, match="no channel 'gyro_q' was examined: there are gyro_x"):
            ask("gyro_q")


def test_progress_is_reported(sick):
    steps = []
    gmwm.health(sick, progress=lambda *step: steps.append(step))
    assert steps == [(0, 2, "gyro_x"), (1, 2, "gyro_y"), (2, 2, "")]


def test_the_recording_stays_as_it_is(sick):
    before = [channel.values.copy() for channel in sick.values()]
    gmwm.health(sick)
    for channel, values in zip(sick.values(), before, strict=True):
        np.testing.assert_array_equal(channel.values, values)


def test_units_do_not_matter():
    rng = np.random.default_rng(2)
    x = np.round(rng.normal(size=20_000), 2)
    x[100] = 50.0

    def examined(scale, unit):
        recording = gmwm.Recording.from_arrays({"gyro_x": x * scale}, 100.0, {"gyro": unit})
        return gmwm.health(recording)

    one, other = examined(1.0, "deg/s"), examined(3600.0, "deg/h")
    assert [str(f) for f in one.notices] == [str(f) for f in other.notices]


def test_notices_of_the_reader_are_kept():
    notice = Notice("columns-not-used", "note", "", "column not used: 'foo'")
    recording = gmwm.Recording.from_arrays(
        {"gyro_x": np.random.default_rng(3).normal(size=500)}, 100.0, {"gyro": "rad/s"},
        notices=[notice],
    )  # fmt: skip
    assert gmwm.health(recording).of(code="columns-not-used") == (notice,)


@pytest.mark.parametrize("n", [1, 2, 3, 16, 63, 64, 65, 66, 100, 127, 511, 512, 1000, 1025])
@pytest.mark.parametrize("make", ["noise", "steps", "ramp", "gaps", "spike", "two values"])
def test_any_length_of_anything_is_survived(record, n, make):
    rng = np.random.default_rng(n)
    x = {
        "noise": rng.normal(size=n),
        "steps": np.rint(rng.normal(size=n)),
        "ramp": np.arange(n, dtype=float),
        "gaps": np.where(rng.random(n) < 0.3, np.nan, rng.normal(size=n)),
        "spike": np.where(np.arange(n) == n // 2, 1e6, 0.0),
        "two values": np.where(rng.random(n) < 0.5, 0.0, 1.0),
    }[make]
    with np.errstate(all="raise", under="ignore"):
        found = gmwm.health(record(gyro_x=x, accel_y=rng.normal(size=n)))
    assert isinstance(found, Health)
    json.dumps(found.to_dict(), allow_nan=False)
    assert all(isinstance(notice, Notice) for notice in found.notices)


@pytest.mark.parametrize("scale", [1e-60, 1e60])
def test_extreme_scales_are_survived(record, scale):
    x = scale * np.random.default_rng(4).normal(size=3000)
    json.dumps(gmwm.health(record(gyro_x=x)).to_dict(), allow_nan=False)


# -- real recordings ------------------------------------------------------------------------------


@needs_adis
@pytest.mark.parametrize(
    ("number", "frequency"), every(3, [(1, 0.565), (2, 0.568), (3, 0.540), (4, 0.534)])
)
def test_line_of_the_accelerometers(number, frequency):
    recording = adis(number, channels={"accel_x": 3})
    found, _ = peaks(recording["accel_x"].values, recording.dt)
    assert found[0].frequency == pytest.approx(frequency, abs=0.005)
    assert found[0].ratio > 30.0
    assert found[0].amplitude == pytest.approx(0.008, rel=0.25)  # m/s^2


@needs_adis
def test_health_of_a_real_recording():
    recording = adis(4)
    found = gmwm.health(recording)
    for name in ("accel_x", "accel_y", "accel_z"):
        assert found.lines(name)[0][0] == pytest.approx(0.534, abs=0.005)
        assert found.lsb(name) == pytest.approx(0.00333 * 9.80665, rel=1e-4)
    for name in ("gyro_x", "gyro_y", "gyro_z"):
        assert found.lines(name) == ()
        assert found.lsb(name) == pytest.approx(np.radians(0.05), rel=1e-4)
    ((frequency, damping),) = found.resonances("gyro_z")
    assert frequency == pytest.approx(20.0, abs=0.5)
    assert 0.01 < damping < 0.04
    (shock,) = found.of("gyro_x", "event")
    assert abs(shock.values["height"]) == pytest.approx(np.radians(17.0), rel=0.05)
    assert shock.values["time"] == pytest.approx(4046.0, abs=0.5)
    # All channels that felt it agree on when.
    for name in ("gyro_x", "gyro_y", "accel_x", "accel_y", "accel_z"):
        assert any(start <= 404_600 < stop + 50 for start, stop in found.events(name))
    assert max(map(len, str(found).splitlines())) <= 80
