"""What the first screen and the section of health say of length and of ties; a notebook."""

import re
from dataclasses import replace

import pytest

from gmwm.issues import Notice
from gmwm.report.health import health, known_at, length_sentence


def seconds(text):
    """Of a duration such as ``40 s``, ``2 h 46 min`` or ``12 days``."""
    units = {"s": 1.0, "min": 60.0, "h": 3600.0, "days": 86400.0}
    found = re.findall(r"([\d.]+) (s|min|h|days)\b", text)
    return sum(float(number) * units[unit] for number, unit in found)


@pytest.fixture(scope="module")
def gyro(calibration):
    return replace(calibration, fits={"gyro_x": calibration["gyro_x"]}, skipped={})


def test_a_curve_that_ends_before_the_horizon_tells_no_length(gyro):
    assert length_sentence(gyro, 60.0) == "too short for 60 s outages: record an hour or more"


@pytest.mark.parametrize("horizon", [1.0, 5.0])
def test_the_advised_length_gives_an_error_of_a_tenth(gyro, horizon):
    known = known_at(gyro["gyro_x"], horizon)
    least = max(gyro.duration * (known / 0.1) ** 2, 4.0 * horizon)
    text = length_sentence(gyro, horizon)
    enough = least <= gyro.duration
    start = "long enough" if enough else "too short" if known < 0.1 else "gyro_x's deviation at"
    assert text.startswith(start)
    named = re.search(r"; (.*) would give" if enough else r"record (.*?)(?: in all|$)", text)[1]
    assert seconds(named) == pytest.approx(least, rel=0.02, abs=30.0)


def test_a_part_of_the_recording_is_judged_too(gyro):
    known = known_at(gyro["gyro_x"], 60.0)
    least = max(gyro.duration * (known / 0.1) ** 2, 240.0)
    enough = "That part is long enough for 60 s outages."
    less = "There, a deviation at 60 s is known less well than to +-10 %."
    for length, word in ((1.01 * least, enough), (0.99 * least, less)):
        values = {"start": 100.0, "stop": 100.0 + length}
        part = Notice("longest-part", "note", "", "the longest part", values, "calibrate it")
        (advice,) = health(replace(gyro, notices=(part,)))["advice"]
        assert advice == f"The longest part: calibrate it. {word}"
