"""What the first screen and the section of health say of length and of ties; a notebook."""

import re
from dataclasses import replace
from html import unescape

import numpy as np
import pytest

import gmwm
from gmwm import QuantizationNoise, RandomWalk, WhiteNoise
from gmwm.issues import Notice
from gmwm.report.health import ambiguity, health, known_at, length_sentence

TIE = Notice("ambiguity", "note", "gyro_x", "2 models fit", hint="the first is used")


def seconds(text):
    """Of a duration such as ``40 s``, ``2 h 46 min`` or ``12 days``."""
    units = {"s": 1.0, "min": 60.0, "h": 3600.0, "days": 86400.0}
    found = re.findall(r"([\d.]+) (s|min|h|days)\b", text)
    return sum(float(number) * units[unit] for number, unit in found)


@pytest.fixture(scope="module")
def gyro(calibration):
    return replace(calibration, fits={"gyro_x": calibration["gyro_x"]}, skipped={})


@pytest.mark.parametrize("horizon", [1.0, 5.0, 60.0])
def test_the_advised_length_gives_an_error_of_a_tenth(gyro, horizon):
    known = known_at(gyro["gyro_x"], horizon)
    least = max(gyro.duration * (known / 0.1) ** 2, 4.0 * horizon)
    text = length_sentence(gyro, horizon)
    enough = least <= gyro.duration
    is_short = gyro["gyro_x"].wv.tau[-1] < horizon or known < 0.1
    start = "long enough" if enough else "too short" if is_short else "gyro_x's deviation at"
    assert text.startswith(start)
    named = re.search(r"; (.*) would give" if enough else r"record (.*?)(?: in all|$)", text)[1]
    assert seconds(named) == pytest.approx(least, rel=0.02, abs=30.0)


def test_a_part_of_the_recording_is_judged_too(gyro):
    known = known_at(gyro["gyro_x"], 60.0)
    least = max(gyro.duration * (known / 0.1) ** 2, 240.0)
    for length, word in ((1.01 * least, "long enough"), (0.99 * least, "too short")):
        values = {"start": 100.0, "stop": 100.0 + length}
        part = Notice("longest-part", "note", "", "the longest part", values, "calibrate it")
        (advice,) = health(replace(gyro, notices=(part,)))["advice"]
        assert advice == (f"The longest part: calibrate it. That part is {word} for 60 s outages.")


def test_what_a_tie_does_to_a_filter_is_said(gyro):
    model = gyro["gyro_x"].model
    (other,) = ambiguity(replace(gyro, notices=(TIE,)), "gyro_x")
    assert other == "2 models fit (the first is used)"  # of which nothing is known
    alike, larger = model + QuantizationNoise(1e-9), WhiteNoise(5e-4) + RandomWalk(3e-4)
    for rivals, end in (((alike,), "less than 0.1 %"), ((alike, larger), "at most {:.2g} %")):
        pairs = [(b.N, b.K) for b in (gmwm.bound(m, dt=0.01) for m in (model, *rivals))]
        change = 100.0 * (np.max(np.max(pairs, axis=0) / np.min(pairs, axis=0)) - 1.0)
        tied = replace(gyro, notices=(TIE,), rivals={"gyro_x": rivals})
        (text,) = ambiguity(tied, "gyro_x")
        size = end.format(change)
        said = f"Filter N and K for 60 s change by {size} with another of these models"
        assert text == f"2 models fit (the first is used). {said}"


def test_a_notebook_has_the_answers(calibration):
    shown = unescape(calibration._repr_html_())
    assert "bench.csv: 80 s at 100 Hz. Usable: gyro_x and voltage." in shown
    text = " ".join(re.sub("<[^>]+>", " ", shown).split())
    axis = calibration.numbers["gyro_x"]
    n, k = (axis.text(letter).replace("+-", "±") for letter in "NK")
    assert re.search(rf"gyro_x {re.escape(n)} .* {re.escape(k)} ", text)
    assert re.search(r"accel_x not valid : \w+", text)
    numbers = gmwm.bound(calibration["gyro_x"], horizon=60.0)
    assert f"gyro {numbers.N:.2e} rad/s/sqrt(Hz)".replace("e-0", "e-") in text
    assert "do not use yet: accel_x is not valid" in text
    alone = replace(calibration, fits={"voltage": calibration["voltage"]})
    assert "For your filter" not in alone._repr_html_()
