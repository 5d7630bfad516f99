"""Work on small matrices takes one thread of BLAS, and leaves those of the program as they were."""

from contextlib import ExitStack

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import gmwm
from gmwm._core.jobs import one_blas_thread


def numbers():
    return [each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas"]


@pytest.fixture(autouse=True)
def of_two_threads():
    """As where OMP_NUM_THREADS is not set."""
    with threadpool_limits(2, user_api="blas"):
        yield


def test_a_block_has_one_thread_however_it_ends():
    with pytest.raises(ValueError, match="within"), one_blas_thread():
        assert set(numbers()) == {1}
        raise ValueError("within")
    assert set(numbers()) == {2}


def test_of_blocks_side_by_side_the_last_one_to_end_sets_what_was_before():
    first, second = ExitStack(), ExitStack()
    first.enter_context(one_blas_thread())
    second.enter_context(one_blas_thread())
    first.close()
    assert set(numbers()) == {1}
    second.close()
    assert set(numbers()) == {2}


def test_a_calibration_has_one_thread():
    noise = np.random.default_rng(1).normal(size=4000)
    recording = gmwm.Recording.from_arrays({"gyro_x": noise}, 100.0, {"gyro": "deg/s"})
    seen = []
    gmwm.calibrate(recording, gmwm.WhiteNoise(), progress=lambda *_: seen.extend(numbers()), jobs=1)
    assert set(seen) == {1}
    assert set(numbers()) == {2}
