"""What every test runs under."""

import os
import sys

# Before numpy is imported: as many workers as cores, each with threads of its own, wait for each
# other more than they compute.
os.environ.setdefault("OMP_NUM_THREADS", "1")

from hypothesis import settings

# Without bytecode every worker rewrites the assertions of all tests anew, and every process that
# a test starts compiles the package. It stands in __pycache__ beside the compiled kernels.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# A suite that fails one day in fifty teaches people to run it again; the bounds of statistical
# properties hold with a probability. `pytest --hypothesis-profile explore` draws examples anew.
settings.register_profile("fixed", derandomize=True, deadline=None)
settings.register_profile("explore", deadline=None, max_examples=500)
settings.load_profile("fixed")
