"""Cases that are not run by default."""

import pytest


def slow(*values, **named):
    """A case for ``pytest -m slow``: one like it is always run."""
    return pytest.param(*values, marks=pytest.mark.slow, **named)
