"""Where files are that tests read."""

from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[1]
GOLDEN = REPOSITORY / "tests" / "golden"
SHARED = REPOSITORY.parent / "shared"
"""Real recordings, which are not part of the package: tests that need them skip without."""
