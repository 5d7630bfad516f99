"""Flight logs that are cut off or damaged in places: refused, unless what is there is asked for."""

from __future__ import annotations

import re

import numpy as np
import pytest
from pyulog import ULog

import gmwm
from flight_logs import IMU, X, combined, imu_messages, write_dataflash, write_ulog
from gmwm.readers.names import CANONICAL

LOGS = {
    "ulog": lambda path: write_ulog(path, combined()),
    "ardupilot": lambda path: write_dataflash(path, [IMU], imu_messages(X)),
}


@pytest.fixture(params=LOGS)
def log(request, tmp_path):
    return LOGS[request.param](tmp_path / "a.log")


def refusal(path):
    with pytest.raises(gmwm.InputError) as caught:
        gmwm.read(path)
    assert caught.value.code == "damaged"
    return str(caught.value)


def begin(recording):
    """Whether its samples are the first of the log."""
    return all(
        np.array_equal(recording[name].values, column[: recording.n].astype(float))
        for name, column in zip(CANONICAL, X.T, strict=True)
    )


def with_marks(whole):
    """A ULog with the marks that PX4 writes now and then, from which reading goes on."""
    if not whole.startswith(b"ULog"):
        return whole
    found, at = whole[:16], 16
    while at < len(whole):
        end = at + 3 + int.from_bytes(whole[at : at + 2], "little")
        found += whole[at:end]
        if whole[at + 2 : at + 3] == b"D":
            found += b"\x08\0S" + ULog.SYNC_BYTES
        at = end
    return found


@pytest.mark.parametrize("share", [0.5, 0.9, 0.99, 1.0])
def test_a_log_that_is_cut_off(log, share):
    whole = log.read_bytes()
    log.write_bytes(whole[: int(share * len(whole)) - 1])
    seconds = re.search(
        r"a\.log is cut off or damaged ([0-9.]+) s after its first sample, inside a message: "
        r"get a whole copy, or read the rest with damaged=True$",
        refusal(log),
    )[1]
    found = gmwm.read(log, damaged=True)
    assert begin(found) and 0.4 * len(X) * share < found.n < len(X)
    assert float(seconds) == pytest.approx((found.n - 1) * found.dt)
    (notice,) = [each for each in found.notices if each.code == "damaged"]
    assert notice.severity == "warning" and "cut off" in notice.text


@pytest.mark.parametrize("padding", [b"\0", b"\xff"])
@pytest.mark.parametrize("size", [1, 2, 3, 70_000])
def test_padding_is_no_damage(log, padding, size):
    log.write_bytes(log.read_bytes() + size * padding)
    found = gmwm.read(log)
    assert found.n == len(X) and begin(found)
    assert not [each for each in found.notices if each.code == "damaged"]


@pytest.mark.parametrize("hole", [bytes(700), bytes(range(256)) * 3], ids=["zeros", "bytes"])
def test_a_log_that_is_damaged_in_places(log, hole):
    whole = with_marks(log.read_bytes())
    half = len(whole) // 2
    log.write_bytes(whole[:half] + hole + whole[half + len(hole) :])
    assert "a.log is damaged in places" in refusal(log)
    found = gmwm.read(log, damaged=True)
    assert 0.7 * len(X) < sum(np.isfinite(found["gyro_x"].values)) < len(X)
    assert [each.text for each in found.notices if each.code == "damaged"]


def test_remains_of_a_page_at_the_end_of_dataflash(tmp_path):
    path = LOGS["ardupilot"](tmp_path / "a.bin")
    whole = path.read_bytes()
    path.write_bytes(whole + bytes(range(150)))  # what the memory of the recorder held before
    assert gmwm.read(path).n == len(X)
    path.write_bytes(whole + bytes(range(150)) * 4)
    assert "damaged in places" in refusal(path)


@pytest.mark.parametrize("field", ["uint64_t[99999]", "sensor_combined"])
def test_formats_of_absurd_messages_of_an_imu_are_rejected(tmp_path, field):
    path = LOGS["ulog"](tmp_path / "a.ulg")
    whole = path.read_bytes()
    text = f"sensor_combined:uint64_t timestamp;{field} more;".encode()
    header = len(text).to_bytes(2, "little") + b"F"
    path.write_bytes(whole[:16] + header + text + whole[16:])
    with pytest.raises(gmwm.InputError, match=r"a\.ulg is damaged in places"):
        gmwm.read(path)
