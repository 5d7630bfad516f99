"""A certificate of a file that `gmwm export` wrote says what the file says, and recommends it."""

import re

import pytest

import gmwm
import marks
from gmwm import Channel, GaussMarkov, RandomWalk, Recording, WhiteNoise
from gmwm.export import TARGETS, read_numbers
from gmwm.process import as_model
from places import SHARED

READABLE = sorted(name for name, each in TARGETS.items() if each.keys is not None)
DT = 0.01


def calibrated(models, n=30_000):
    """Of one simulated channel a model, with the terms given."""
    channels = [
        Channel(name, model.simulate(n, DT, seed), DT, *unit(name))
        for seed, (name, model) in enumerate(models.items())
    ]
    forms = {name: as_model(model).opened() for name, model in models.items()}
    return gmwm.calibrate(Recording(tuple(channels), "bench.csv"), forms)


def unit(name):
    return ("gyro", "rad/s") if name[0] == "g" else ("accel", "m/s^2")


def six(gyro, accel):
    return {f"{q}_{a}": m for q, m in (("gyro", gyro), ("accel", accel)) for a in "xyz"}


SLOW = six(WhiteNoise(8e-5) + GaussMarkov(1e-4, 20.0), WhiteNoise(1e-3) + GaussMarkov(5e-4, 10.0))
WITHOUT = SLOW | {"gyro_y": WhiteNoise(8e-5)}
FLAT = six(WhiteNoise(8e-5) + RandomWalk(3e-6), WhiteNoise(1e-3))


@pytest.fixture(scope="module")
def calibrations():
    return {}


def calibration_of(kept, name):
    if name not in kept:
        if name == "recording":
            file = SHARED / "data" / "adis16405" / "adis16405_1.csv.gz"
            if not file.exists():
                pytest.skip("the recording is not here")
            kept[name] = gmwm.calibrate(
                gmwm.read(file, rate=100.0, gyro_unit="deg/s", accel_unit="g"), jobs=2
            )
        else:
            given = {"slow": SLOW, "one without K": WITHOUT, "accels without K": FLAT}
            kept[name] = calibrated(given[name])
    return kept[name]


@pytest.mark.parametrize("target", marks.every(3, READABLE))
@pytest.mark.parametrize(
    "name", ["one without K", *map(marks.slow, ("slow", "accels without K", "recording"))]
)
def test_a_certificate_agrees_with_the_file(calibrations, tmp_path, name, target):
    calibration = calibration_of(calibrations, name)
    text = gmwm.export(calibration, target, path=tmp_path / "file")
    given = read_numbers(tmp_path / "file", calibration.rate)
    found = gmwm.certify(calibration, given)
    (line,) = re.findall("NEES at 60 s: .*;", text)
    for quantity in ("gyro", "accel"):
        ends = re.search(rf"{quantity} ([\d.]+)(?: to ([\d.]+))?", line).groups()
        low, high = float(ends[0]), float(ends[1] or ends[0])
        checks = [
            each.nees
            for each in found.of("free")
            if each.where.startswith(quantity) and each.time == 60.0
        ]
        assert min(checks) == pytest.approx(low, rel=0.02)
        assert max(checks) == pytest.approx(high, rel=0.02)
    for axis, one in found.recommended.items():
        own = found.numbers[axis]
        assert one.form == own.form
        assert one.model.params == pytest.approx(own.model.params, rel=1e-4)
