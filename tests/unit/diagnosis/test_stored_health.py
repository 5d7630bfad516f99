"""A stored health is refused where a number of it can be none."""

from copy import deepcopy

import pytest

from gmwm import InputError
from gmwm.diagnosis import Health, Repetition
from gmwm.diagnosis.health import ChannelHealth

GOOD = Health(
    (),
    {
        "gyro_x": ChannelHealth(
            lines=((0.5, 0.0),), resonances=((0.5, 0.5),), events=((0, 1), (9, 10)),
            outliers=1.0, held=1.0, repetition=Repetition(2, 1),
        )
    },
    "log", 10.0, 10,
)  # fmt: skip


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("outliers", 1.01), ("outliers", -0.01), ("held", 1.01), ("held", -0.01), ("noise", -0.01),
        ("lsb", -0.01), ("events", [[0, 0]]), ("events", [[2, 1]]), ("events", [[0, 11]]),
        ("events", [[-1, 1]]), ("lines", [[0.0, 1.0]]), ("lines", [[1.0, -0.01]]),
        ("resonances", [[1.0, 0.0]]), ("repetition", {"times": 1, "first": 0}),
        ("repetition", {"times": 2, "first": 2}), ("repetition", {"times": 2, "first": -1}),
    ],
)  # fmt: skip
def test_numbers_that_none_is(key, value):
    content = deepcopy(GOOD.to_dict())
    assert Health.from_dict(content).to_dict() == GOOD.to_dict()
    content["channels"]["gyro_x"][key] = value
    with pytest.raises(InputError):
        Health.from_dict(content)


def test_what_older_ones_lack_is_none():
    content = deepcopy(GOOD.to_dict())
    del content["channels"]["gyro_x"]["held"], content["channels"]["gyro_x"]["noise"]
    found = Health.from_dict(content).channels["gyro_x"]
    assert (found.held, found.noise) == (0.0, 0.0)
