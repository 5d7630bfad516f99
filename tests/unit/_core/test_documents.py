"""Stored results: what they must hold, in one sentence."""

import copy
import json

import numpy as np
import pytest

import gmwm
from gmwm import InputError

RNG = np.random.default_rng(3)
X = RNG.normal(size=700) + np.cumsum(0.05 * RNG.normal(size=700))
HOLES = np.where(RNG.random(700) < 0.02, np.nan, X)
MODEL = gmwm.WhiteNoise() + gmwm.RandomWalk()


@pytest.fixture(scope="module")
def stored():
    recording = gmwm.Recording.from_arrays(
        {"gyro_x": X, "gyro_y": HOLES, "gyro_z": np.ones(700)}, 100.0, {"gyro": "rad/s"}
    )
    fit = gmwm.fit(MODEL, X, 1.0)
    return {
        "calibration": gmwm.calibrate(recording, MODEL),
        "joint": gmwm.fit(MODEL, [X, X[:600]], 1.0),
        "health": gmwm.health(recording),
        "selection": gmwm.select(X[:300], 1.0),
        "bootstrap": gmwm.bootstrap(fit, 5),
        "bound": gmwm.cramer_rao(fit.model, 700, 1.0),
    }


GYRO = "channels.gyro_x."
WV = GYRO + "wavelet_variance."
CASES = [
    ("calibration", "rate_hz", -100, "rate_hz = -100: input should be greater"),
    ("calibration", "n", -5, "n = -5: input should be greater than or equal to 1"),
    ("calibration", "n", True, "n = True: input should be a valid integer"),
    ("calibration", "skipped.gyro_z.severity", "worst", "skipped.gyro_z: severity = 'worst'"),
    ("calibration", "source", 3, "source = 3: input should be a valid string"),
    ("calibration", GYRO + "covariance", [[1.0, 0.0], [0.0, -1.0]], "not positive"),
    ("calibration", GYRO + "covariance", [[1.0, 0.5], [0.0, 1.0]], "not symmetric"),
    ("calibration", GYRO + "covariance", [[1.0, 2.0], [2.0, 1.0]], "not positive semi-definite"),
    ("calibration", GYRO + "covariance", [[1e-320, 1e300], [1e300, 1.0]], "not positive semi-def"),
    ("calibration", GYRO + "covariance", [[1.0]], "covariance is not 2 x 2"),
    ("calibration", GYRO + "keys", ["N", "N"], "stands twice"),
    ("calibration", GYRO + "upper_bounds", {"N": -1.0}, "upper_bounds.N = -1.0"),
    ("calibration", GYRO + "model.0.N", -1.0, "N"),
    ("calibration", WV + "dt", 0.0, "dt = 0.0"),
    ("calibration", WV + "n", 10**6, "levels where 1,000,000 samples have 19"),
    ("calibration", WV + "variance.0", -1.0, "a variance is negative"),
    ("calibration", WV + "mean", [0.0], "mean is not a list of"),
    ("calibration", WV + "tau.1", 0.5, "not octaves"),
    ("calibration", WV + "efficiency", 2.0, "efficiency = 2.0"),
    ("calibration", WV + "block", 10**6, "blocks hold more samples"),
    ("calibration", WV + "wavelet", "db99", "db99"),
    ("calibration", "channels.gyro_y.wavelet_variance.gaps.missing", 701, "of another series"),
    (
        "calibration",
        "channels.gyro_y.wavelet_variance.gaps.counts.0",
        0.0,
        "gaps leave no coefficients",
    ),
    ("joint", "parts", [], "parts = []"),
    ("joint", "equality_p", 1.5, "equality_p = 1.5"),
    ("health", "channels.gyro_x.events", [[5, 4]], "not an interval of samples"),
    ("health", "channels.gyro_x.lines", [[1.0]], "channels.gyro_x.lines.0"),
    ("selection", "chosen", 99, "the chosen model is not in the ranking: make the selection again"),
    ("selection", "ranking.0.n_parameters", 0, "ranking.0.n_parameters = 0"),
    ("selection", "ranking.0.dof", None, "ranking.0.dof = None"),
    ("bootstrap", "draws", [[1.0], [2.0]], "draws are not one value a key"),
    ("bound", "keys", ["N", "X"], "keys do not match the model"),
]


def refusal(path):
    with pytest.raises(InputError) as caught:
        gmwm.load(path)
    text = str(caught.value)
    assert text.startswith(f"{path}: ")
    assert text.isprintable()
    assert len(text) < len(str(path)) + 300
    return text


@pytest.mark.parametrize(("kind", "place", "value", "words"), CASES)
def test_a_wrong_value_is_named_with_its_place(stored, tmp_path, kind, place, value, words):
    content = json.loads(json.dumps(stored[kind].to_dict()))
    inner, *path = content, *place.split(".")
    for key in path[:-1]:
        inner = inner[int(key) if key.isdigit() else key]
    last = int(path[-1]) if path[-1].isdigit() else path[-1]
    assert last in inner if isinstance(inner, dict) else last < len(inner)
    inner[last] = value
    path = tmp_path / "stored.json"
    path.write_text(json.dumps(content))
    assert words in refusal(path)


@pytest.mark.parametrize(
    "kind", ["calibration", "joint", "health", "selection", "bootstrap", "bound"]
)
def test_every_result_comes_back(stored, tmp_path, kind):
    result = stored[kind]
    path = result.save(tmp_path / "stored.json")
    found = gmwm.load(path)
    assert type(found) is type(result)
    assert found.to_dict() == type(result).load(path).to_dict() == result.to_dict()
    if kind == "health":
        with pytest.raises(InputError, match=r"stored\.json: this is not a calibration"):
            gmwm.Calibration.load(path)
    again = copy.deepcopy(result.to_dict()) | {"of a later version": 1}
    assert type(result).from_dict(again).to_dict() == result.to_dict()


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity", "1e999", "9" * 5000])
def test_numbers_are_finite(stored, tmp_path, number):
    path = tmp_path / "stored.json"
    path.write_text(json.dumps(stored["calibration"].to_dict() | {"n": "@"}).replace('"@"', number))
    refusal(path)


@pytest.mark.parametrize("depth", [900, 100_000])
def test_what_is_nested_deeply_is_refused(tmp_path, depth):
    path = tmp_path / "deep.json"
    path.write_text('{"schema": "gmwm.calibration", "channels": ' + "[" * depth + "]" * depth + "}")
    assert "is not JSON" in refusal(path)
