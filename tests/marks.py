"""Cases that are not run by default."""

import pytest

from gmwm.process import CATALOGUE


def slow(*values, **named):
    """A case for ``pytest -m slow``: one like it is always run."""
    return pytest.param(*values, marks=pytest.mark.slow, **named)


def every(step, cases):
    """Cases of which one in so many is always run and the others are slow."""
    return [case if k % step == 0 else slow(*case if isinstance(case, tuple) else (case,))
            for k, case in enumerate(cases)]  # fmt: skip


EXAMPLES = [process for kind in CATALOGUE for process in kind.examples()]
FIRST = [
    (slow if i else pytest.param)(process, id=repr(process))
    for kind in CATALOGUE
    for i, process in enumerate(kind.examples())
]
"""One of each kind, where a law that all of them obey would show no other fault."""
