"""Memory for arrays is kept where Dask's nannies have it given back at once."""

import os
import subprocess
import sys

import pytest

from gmwm._core.runs.allocation import _library

PROGRAM = """
import resource, sys
from contextlib import nullcontext
import numpy as np
from gmwm._core.runs.allocation import memory_kept

def faults():
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(40):
        np.ones(500_000)  # 4 MB, a thousand pages
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before

alone = faults()
with memory_kept():
    np.ones(500_000)
    print(alone, faults())
"""


@pytest.mark.skipif(_library() is None, reason="only glibc gives memory back at once")
@pytest.mark.parametrize("given", ["65536", None])
def test_pages_are_used_again_within_the_block(given):
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    environment.pop("MALLOC_TRIM_THRESHOLD_", None)
    environment |= {} if given is None else {"MALLOC_TRIM_THRESHOLD_": given}
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], env=environment, capture_output=True, text=True, check=True
    )
    alone, kept = map(int, done.stdout.split())
    if given is None:  # glibc learns by itself, and nothing is changed
        assert alone < 20_000
    else:
        assert alone > 20_000
    assert kept < 5_000
