import re
from pathlib import Path

import pytest

from gmwm.report import write_validation_report
from marks import slow


def text_of(path: Path) -> str:
    return re.sub(r"<svg.*?</svg>", "", path.read_text(), flags=re.S)


def test_every_filter_is_on_the_page_and_no_name_is_markup(tmp_path, made_up):
    names = {"<b>bold</b>": 3.0, "a&b\"'": 1.0, "_x$y$": 1.0, "w" * 40: 1.0}
    text = text_of(write_validation_report(made_up(names, ((20, 10),)), tmp_path / "a.html"))
    for shown in ("&lt;b&gt;bold&lt;/b&gt;", "a&amp;b&#34;&#39;", "_x$y$", "w" * 40):
        assert text.count(shown) >= 5
    assert "<b>bold" not in text
    assert text.count('<figure class="picture') == 3


def test_the_page_needs_no_network_and_is_the_same_each_time(tmp_path, made_up):
    found = made_up({"A": 1.0}, ((20, 10),))
    first = write_validation_report(found, tmp_path / "a.html").read_bytes()
    assert write_validation_report(found, tmp_path / "a.html").read_bytes() == first
    for needle in (b"<script", b"@import", b"<link", b"src=", b"url(http"):
        assert needle not in first


@pytest.mark.parametrize(
    ("outages", "dead"),
    [((), ("bold",)), slow(((20, 10),), ("right",)), (((20, 10),), ("right", "bold"))],
)
def test_a_page_without_outages_or_with_filters_that_diverged(tmp_path, outages, dead, made_up):
    found = made_up({"right": 1.0, "bold": 3.0}, outages, dead=dead)
    path = write_validation_report(found, tmp_path / "a.html")
    assert text_of(path).count("diverged in 40 of 40 runs") == len(dead)
