"""Parts of the search for stretches at rest, from blocks made by hand."""

import numpy as np
import pytest

from gmwm import Recording, health
from gmwm.diagnosis import Still, find_still, rest_of, tuning


def test_a_timeline_shows_where_it_rests():
    found = Still(((0.0, 25.0), (50.0, 50.1)), 25.0, ((75.0, 100.0),), 100.0)
    width = len(found.timeline)
    marks = list("." * width)
    marks[: width // 4] = "#" * (width // 4)
    marks[width // 2] = "#"
    marks[3 * width // 4 :] = "~" * (width - 3 * width // 4)
    assert found.timeline == "".join(marks)
    assert found.total == pytest.approx(25.1)
    assert found.notice().values == {
        "stretches": 2, "total": pytest.approx(25.1), "longest": 25.0, "duration": 100.0,
    }  # fmt: skip


@pytest.mark.parametrize(("count", "more"), [(8, None), (9, " and 1 more"), (12, " and 4 more")])
def test_eight_stretches_are_listed(count, more):
    spans = tuple((20.0 * k, 20.0 * k + 10.0) for k in range(count))
    text = Still(spans, 10.0, (), 300.0).notice().text
    assert text.count(" to ") == 8 and ("more" in text) is (more is not None)
    assert more is None or more in text


@pytest.mark.parametrize("step", [0.0, 1e-8])
def test_zeros_written_for_lost_samples_are_no_rest(step):
    rng = np.random.default_rng(5)
    values = 1e-3 * rng.normal(size=(2, 60_000)) + 3e-4
    for start in range(2000, 60_000, 3000):
        values[:, start : start + 250] = 0.0
    if step:
        values = np.round(values / step) * step
    channels = {f"gyro_{axis}": x for axis, x in zip("xy", values, strict=True)}
    recording = Recording.from_arrays(channels, 50.0, {"gyro": "rad/s"})
    assert rest_of(recording) is None
    found = health(recording)
    assert not found.of(code="vibration")
    assert all("stuck 20 times" in found.of(name, "stuck")[0].text for name in channels)


def test_stretches_end_a_block_before_motion_and_with_the_recording():
    rng = np.random.default_rng(4)
    n = 12_007
    values = rng.normal(size=(6, n)) * np.array([[1e-3]] * 3 + [[1e-2]] * 3)
    values[5] += 9.80665
    values[2, 4000:6000] += 0.5 + rng.normal(size=2000)
    names = [f"{sensor}_{axis}" for sensor in ("gyro", "accel") for axis in "xyz"]
    recording = Recording.from_arrays(
        dict(zip(names, values, strict=True)), 100.0, {"gyro": "rad/s", "accel": "m/s^2"}
    )
    (begin, stop), (start, end) = find_still(recording).stretches
    assert (begin, end) == (0.0, recording.duration)
    # The block after a turn has another mean than the one before it.
    assert (stop, start) == (40.0 - tuning.STILL_BLOCK, 60.0 + 2 * tuning.STILL_BLOCK)
