"""The files as they are, one a program; run this file to write them again, and read the diff."""

import re

import pytest

import gmwm
from gmwm.export import TARGETS
from imu_numbers import FORMS, numbers
from places import GOLDEN, REPOSITORY

NUMBER = re.compile(r"(?<![\w.])[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?(?![\w.])")
SOURCE = "bench.csv, a name\nof two lines: {\\"


def file_of(name):
    given = numbers(FORMS.get(name, TARGETS[name].form), source=SOURCE)
    return gmwm.export(given, name)


def path_of(name):
    return GOLDEN / "export" / f"{name}.txt"


@pytest.mark.parametrize("name", TARGETS)
def test_file(name):
    found, kept = file_of(name), path_of(name).read_text(encoding="utf-8")
    assert NUMBER.sub("0", found) == NUMBER.sub("0", kept)
    values = [[float(v) for v in NUMBER.findall(text)] for text in (found, kept)]
    assert values[0] == pytest.approx(values[1], rel=1e-9, abs=1e-30)


def test_nothing_else_is_kept():
    assert {path.stem for path in (GOLDEN / "export").iterdir()} == set(TARGETS)


def test_the_page_of_programs_has_them_all():
    page = (REPOSITORY / "docs" / "export.md").read_text(encoding="utf-8")
    for name in TARGETS:
        assert f"`{name}`" in page, name


if __name__ == "__main__":
    for each in TARGETS:
        path_of(each).write_text(file_of(each), encoding="utf-8")
