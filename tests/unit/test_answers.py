"""What counts as another answer than the recorded one."""

import numpy as np
import pytest

import recorded
from gmwm._core.notices import Notice

ANSWER = {
    "number": 1.5, "count": 1_000_000, "nothing": None, "holds": True, "infinite": np.inf,
    "array": np.linspace(1.0, 2.0, 30), "ragged": [[1.0], [2.0, 3.0]], "short": [0.0, 1e-20],
    "notice": Notice("gap", "note", "gyro_x", "12 samples of 4,000 are missing " * 3, {"n": 12}),
}  # fmt: skip


@pytest.fixture
def compare(tmp_path, monkeypatch):
    monkeypatch.setattr(recorded, "GOLDEN", tmp_path)
    with monkeypatch.context() as at_first:
        at_first.setenv("RECORD", "1")
        recorded.assert_as_recorded("room/answer", ANSWER)
    monkeypatch.delenv("RECORD", raising=False)
    return lambda **changes: recorded.assert_as_recorded("room/answer", {**ANSWER, **changes})


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"number": 1.5 + 1e-6},
        {"array": ANSWER["array"] * (1.0 + 1e-7)},
        {"short": [1e-16, 0.0]},
    ],
)
def test_what_another_machine_computes_is_the_same(compare, changes):
    compare(**changes)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"number": 1.501}, "answer/number: 1.501 was 1.5"),
        ({"count": 1_000_001}, "answer/count: 1000001 was 1000000"),
        ({"nothing": 0}, "answer/nothing"), ({"holds": 1}, "answer/holds"),
        ({"infinite": -np.inf}, "'-inf' was 'inf'"),
        ({"array": ANSWER["array"][::-1]}, "array/sums"),
        ({"array": ANSWER["array"][:, None]}, "'30x1' was '30'"),
        ({"ragged": [[1.0], [2.0, 3.1]]}, "answer/ragged/1"),
        ({"notice": Notice("gap", "note", "gyro_x", "12 are gone " * 6, {"n": 12})}, "words"),
    ],
)  # fmt: skip
def test_what_is_another_answer(compare, changes, words):
    with pytest.raises(AssertionError, match=words):
        compare(**changes)
