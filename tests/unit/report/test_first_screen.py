"""What the first screen says of length, of ties, and of values that have one name."""

import re
from dataclasses import replace
from html import unescape

import numpy as np
import pytest

import gmwm
from gmwm import GaussMarkov, QuantizationNoise, RandomWalk, WhiteNoise
from gmwm.issues import Notice
from gmwm.report.answer import filter_sentence
from gmwm.report.health import (
    ambiguity,
    health,
    known_at,
    length_sentence,
    parameters_sentence,
)

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
    assert text.startswith("long enough" if enough else "too short")
    assert f" for {horizon:g} s outages: " in text
    named = re.search(r"; (.*) would give" if enough else r"record (.*?)(?: \(|$)", text)[1]
    assert seconds(named) == pytest.approx(least, rel=0.02, abs=30.0)


def test_a_part_of_the_recording_is_judged_too(gyro):
    known = known_at(gyro["gyro_x"], 60.0)
    least = max(gyro.duration * (known / 0.1) ** 2, 240.0)
    for length, word in ((1.01 * least, "long enough"), (0.99 * least, "too short")):
        values = {"start": 100.0, "stop": 100.0 + length}
        part = Notice("longest-part", "note", "", "the longest part", values, "calibrate it")
        (advice,) = health(replace(gyro, notices=(part,)))["advice"]
        assert advice == (f"The longest part: calibrate it. That part is {word} for 60 s outages.")


def test_parameters_need_more_length_than_a_filter(gyro, monkeypatch):
    lengths = gyro["gyro_x"].needed_length(0.1)
    longest, key = max((seconds, key) for key, seconds in lengths.items())
    least = gyro.duration * (known_at(gyro["gyro_x"], 60.0) / 0.1) ** 2
    assert gyro.duration < longest < least
    text = parameters_sentence(gyro)
    assert text.startswith("For 10 % in every parameter record ")
    assert text.endswith(f"({key} of gyro_x)")
    monkeypatch.setattr("gmwm.report.health.known_at", lambda *_: 0.01)
    assert parameters_sentence(gyro).endswith("; a filter needs less")


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


def test_one_name_of_two_values_is_explained(calibration, tmp_path):
    truth = WhiteNoise(2e-4) + GaussMarkov(1e-3, 20.0)
    wv = gmwm.wavelet_variance(truth.simulate(40_000, 0.01, 5), 0.01)
    wv = replace(wv, name="gyro_x", quantity="gyro", unit="rad/s")
    fit = gmwm.fit(truth.opened(), wv)
    own = gmwm.bound(fit, horizon=60.0)
    assert 1.05 * fit.params["N"] < own.N
    text = replace(calibration, fits={"gyro_x": fit}).report(tmp_path / "r.html")
    shown = own.N * np.degrees(1.0) * 60.0
    assert f"Filter N for 60 s is {shown:.3g} deg/sqrt(h): it covers slower terms too" in unescape(
        text.read_text()
    )


def test_a_notebook_has_the_answers(calibration):
    shown = calibration._repr_html_()
    lines = re.findall(r"<p>(.*?)</p>", shown)
    assert lines[1] == filter_sentence(calibration)
    numbers = gmwm.bound(calibration["gyro_x"], horizon=60.0)
    assert lines[1].startswith(
        f"N and K for outages up to 60 s: gyro N {numbers.N:.3g} rad/s/sqrt(Hz), K "
    )
    assert "do not use accel_x yet" in lines[1]
    assert lines[2].startswith(f"Length: {length_sentence(calibration, 60.0)}. ")
    alone = replace(calibration, fits={"voltage": calibration["voltage"]})
    assert "N and K for" not in alone._repr_html_()
