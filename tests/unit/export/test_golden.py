"""The files as they are, one a program; run this file to write them again, and read the diff."""

import re

import pytest

import gmwm
from gmwm import InputError
from gmwm.export import TARGETS, read_numbers
from imu_numbers import FORMS, RATE, K, N, numbers
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


READ = {
    "kalibr": 1, "openvins": 1, "vins": 1, "orbslam3": 1, "fastlio": 1, "liosam": 1, "kimera": 1,
    "okvis2": 1, "maplab": 1, "px4": 1, "basalt": 3, "gtsam": 3, "gtsam-cpp": 3, "gnss-ins-sim": 3,
    "kfgins": 3,
}  # fmt: skip
"""Files that a certificate reads, and whether they hold one number for all axes or three."""


@pytest.mark.parametrize("name", READ)
def test_numbers_come_back_from_the_file(name):
    found = read_numbers(path_of(name), RATE)
    given = numbers(TARGETS[name].form)
    if READ[name] == 1:
        largest = {kind: (max(N[kind]), max(K[kind])) for kind in ("gyro", "accel")}
        assert found == {kind: pytest.approx(pair, rel=1e-6) for kind, pair in largest.items()}
        return
    assert list(found) == list(given)
    for axis, own in found.items():
        if isinstance(own, tuple):
            assert own == pytest.approx((given[axis].N, given[axis].K), rel=1e-6)
            continue
        if name == "kfgins":
            # Found anew for one correlation time.
            assert own.params["N"] >= (1.0 - 1e-6) * given[axis].N
            assert own.params["tau"] == found["gyro_x"].params["tau"]
            continue
        assert own.params["N"] == pytest.approx(given[axis].N, rel=1e-6)
        assert own.params["sigma"] >= 0.99 * given[axis].sigma[0]
        assert own.params["tau"] == pytest.approx(given[axis].tau[0], rel=1e-6)


@pytest.mark.parametrize("name", sorted(set(TARGETS) - set(READ)))
def test_files_without_both_numbers_or_without_names_of_their_own_are_refused(name):
    with pytest.raises(InputError, match="has no noise parameters of a known name"):
        read_numbers(path_of(name), RATE)


def test_the_page_of_programs_has_them_all():
    page = (REPOSITORY / "docs" / "export.md").read_text(encoding="utf-8")
    for name in TARGETS:
        assert f"`{name}`" in page, name


if __name__ == "__main__":
    for each in TARGETS:
        path_of(each).write_text(file_of(each), encoding="utf-8")
