"""What tests of readers look at in a recording, and in the sentence that rejects one."""

import numpy as np
import pytest

import gmwm
from gmwm.readers.names import CANONICAL

SI = {"gyro": "rad/s", "accel": "m/s^2"}


def texts(recording):
    """What the reader noticed."""
    return tuple(map(str, recording.notices))


def codes(recording):
    return {notice.code for notice in recording.notices}


def assert_holds(recording, samples, names=CANONICAL):
    assert recording.names == tuple(names)
    for channel, column in zip(recording.values(), samples.T, strict=True):
        np.testing.assert_array_equal(channel.values, column)


def refusal(path, **options):
    """The one sentence with which it is rejected."""
    with pytest.raises(gmwm.InputError) as caught:
        gmwm.read(path, **options)
    message = str(caught.value)
    assert "\n" not in message
    assert ": " in message
    return message
