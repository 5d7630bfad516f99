"""Numbers as people write them."""

import pytest

from gmwm._core.text import per_cent


@pytest.mark.parametrize(
    ("share", "text"),
    [(1.184, "120 %"), (0.5, "50 %"), (-0.0123, "-1.2 %"), (12.34, "1,200 %"), (0.0, "0 %")],
)
def test_a_share_has_no_exponent(share, text):
    assert per_cent(share) == text
