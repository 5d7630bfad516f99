"""`Health`: what it prints, holds and refuses; and what it finds in real recordings."""

import json

import numpy as np
import pytest

import gmwm
from gmwm import Health, InputError
from gmwm.issues import Notice
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


# -- real recordings ------------------------------------------------------------------------------


@pytest.mark.slow
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
