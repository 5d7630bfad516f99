"""A factor graph of GTSAM beside its certificate: benchmarks/smoother.py with fewer samples."""

import importlib.util
import sys

import numpy as np
import pytest

from gmwm.ins import SensorModels
from places import REPOSITORY

pytest.importorskip("gtsam")

DT, SECONDS, RUNS = 0.05, 12, 12


@pytest.fixture(scope="module")
def smoother():
    spec = importlib.util.spec_from_file_location("smoother", REPOSITORY / "benchmarks/smoother.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["smoother"] = module  # where dataclasses look
    spec.loader.exec_module(module)
    module.DT, module.PER, module.SECONDS = DT, round(1.0 / DT), SECONDS
    return module


def test_its_nees_is_the_certified_one(smoother):
    """Of the next pose, relative to the last keyframe, with N and K by four rules."""
    truth = smoother.TRUTHS["N + 3 GM"]
    rules = smoother.rules(truth)
    motion = smoother.Motion.of(SECONDS, True)
    models = SensorModels.of(truth, smoother.TURN_ON)
    runs = [smoother.nees(motion, models, rules, seed) for seed in range(RUNS)]
    for rule, numbers in rules.items():
        turn, step = np.mean([run[rule] for run in runs], axis=0)[-2:]
        rights = smoother.expected(truth, numbers)
        # The mean of squares of normal errors, three of a turn and six of a step in each run.
        for found, right, size in ((turn, rights[0], 3), (step, rights[1], 6)):
            assert found == pytest.approx(right, rel=4.0 * np.sqrt(2.0 / size / RUNS)), rule
