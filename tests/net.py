# ruff: noqa: E501 - calls in a line
"""Public behaviour as JSON files, and how that of two trees differs.

``python tests/net.py record FOLDER [--only PART,...] [--inputs FOLDER/inputs]`` runs the commands
and public functions of the package of the current directory. ``python tests/net.py compare BEFORE
AFTER [--tolerance 1e-9]`` lists what differs and ends with status 1 if anything does.

Files of ``FOLDER/inputs`` are made where they are absent: give ``--inputs`` of an earlier record, so
that both trees have the same ones, stored calibrations and damaged files included. Texts are left out:
codes, severities and values are compared.
"""

from __future__ import annotations

import argparse
import contextlib
import gzip
import importlib
import io
import json
import math
import os
import random
import re
import runpy
import shutil
import sys
import tempfile
import time
import warnings
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from shlex import split
from typing import Any

import numpy as np

import gmwm
from gmwm import GaussMarkov, RandomWalk, Sinusoid, WhiteNoise, ins
from gmwm.export import TARGETS, read_numbers
from gmwm.process import as_model

SI = {"gyro": "rad/s", "accel": "m/s^2"}
TEXTS = {"comment", "text", "hint", "action", "sentence", "message", "prose"}
"""Keys that are not recorded."""
ROUND_OFF = {"jitter": 1e-9}
"""Absolute tolerance of keys whose value may be what rounding leaves of zero."""
LONGEST = 100  # numbers of a list that are recorded one by one
SENTENCE = 4  # words that make a text
ADIS_ROWS = {1: (0, 100_000), 2: (400_000, 100_000), 3: (900_000, 100_000), 4: (0, 100_000)}
PER_KIND = {"document": 40, "text": 40, "study": 5, "field": 5, "odd": 8, "fleet": 4}
"""Damaged files of a kind; of the others 15."""

Cases = Iterator[tuple[str, Callable[[], Any]]]
"""Names of cases, and what is done in each."""
PARTS: dict[str, Callable[[], Cases]] = {}


def part(make: Callable[[], Cases]) -> Any:
    PARTS[make.__name__.rstrip("_")] = make
    return make


# -- what is recorded -----------------------------------------------------------------------------


def plain(value: Any) -> Any:
    """A result in JSON types, without texts, with sums in place of long arrays."""
    if hasattr(value, "to_dict") and not isinstance(value, type):
        return plain(value.to_dict())
    if is_dataclass(value) and not isinstance(value, type):
        value = {each.name: getattr(value, each.name) for each in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): plain(each) for key, each in value.items() if str(key) not in TEXTS}
    if isinstance(value, str):
        return "<text>" if len(value.split()) >= SENTENCE else value
    if callable(value):
        return "<callable>"
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    if value is None or isinstance(value, bool | int | float):
        return value
    if isinstance(value, np.ndarray) and value.dtype.kind in "biuf":
        return array(value)
    if isinstance(value, set | frozenset):
        value = sorted(value)
    if isinstance(value, list | tuple | np.ndarray):
        if len(value) > LONGEST and all(isinstance(each, int | float) for each in value):
            return array(np.asarray(value, dtype=float))
        return [plain(each) for each in value]
    return f"<{type(value).__name__}>"


def array(values: np.ndarray) -> Any:
    if values.size <= LONGEST:
        return plain(values.tolist())
    flat = values.astype(float).ravel()
    there = np.where(np.isfinite(flat), flat, 0.0)
    wave = np.cos(math.sqrt(2.0) * np.arange(flat.size))
    size, scale = float(np.sum(np.abs(there))), float(np.sum(np.abs(there)) or 1.0)
    return {
        "shape": list(values.shape),
        "missing": int(np.sum(~np.isfinite(flat))),
        "sum": size,
        "wave": round(float(there @ wave) / scale, 12),
    }


def recording(given: Any) -> Any:
    channels = {
        c.name: [c.n, c.dt, c.quantity, c.unit, c.missing, array(np.asarray(c.values, float))]
        for c in given.channels
    }
    whole = {name: getattr(given, name) for name in ("rate", "jitter", "notices")}
    return {**whole, "channels": channels}


def outcome(act: Callable[[], Any]) -> Any:
    """What comes of an act, or the code with which it is rejected."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return plain(act())
        except gmwm.InputError as error:
            return {"rejected": error.code, "values": plain(error.values)}
        except Exception as error:
            return {"failed": type(error).__name__, "what": plain(str(error)[:80].split())}


def command(*args: Any) -> Any:
    """What ``gmwm ARGS`` prints and its exit status; JSON as such, of anything else the numbers."""
    printed, errors, code, argv = io.StringIO(), io.StringIO(), 0, sys.argv
    sys.argv = ["gmwm", *map(str, args)]
    try:
        with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(errors):
            runpy.run_module("gmwm", run_name="__main__")
    except SystemExit as ended:
        code = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    finally:
        sys.argv = argv
    text = printed.getvalue()
    with contextlib.suppress(ValueError):
        return {"status": code, "printed": json.loads(text) if text else None}
    return {"status": code, "printed": tokens(text)}


NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


def tokens(text: str) -> list[Any]:
    """Words and numbers of each line, without comments."""
    text = re.sub(r'"""[\s\S]*?"""|<!--[\s\S]*?-->|/\*[\s\S]*?\*/', "", text)
    lines = [re.sub(r"(^|\s)(#|//|%).*", "", line).strip() for line in text.splitlines()]
    words = [re.split(rf"({NUMBER.pattern})", line) for line in lines if line]
    return [
        [float(each) if NUMBER.fullmatch(each) else each.strip() for each in line if each.strip()]
        for line in words
    ]


# -- inputs ---------------------------------------------------------------------------------------


def shared() -> Path | None:
    """Folder of real recordings: beside the repository, or above."""
    places = [each / "shared/data/adis16405" for each in Path(os.environ["NET_HOME"]).parents]
    return next((each for each in places if each.exists()), None)


def made(name: str, make: Callable[[Path], Any]) -> Path:
    """A file or folder of the inputs, made where it is absent."""
    path = Path(name)
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        draft = path.with_name(f"draft-{path.name}")
        make(draft)
        draft.rename(path)
    return path


def csv(path: Path, columns: Mapping[str, np.ndarray], rate: float = 100.0) -> None:
    n = len(next(iter(columns.values())))
    rows = np.column_stack([np.arange(n) / rate, *columns.values()])
    header = ",".join(["time_s", *(f"{name} [{SI[name.split('_')[0]]}]" for name in columns)])
    np.savetxt(path, rows, fmt="%.9g", delimiter=",", header=header, comments="")


def drive() -> Path:
    return made("drive", lambda path: command("demo", "--files", "-o", path))


def mems_series(seed: int, n: int = 40_000) -> dict[str, np.ndarray]:
    gyro, accel = WhiteNoise(6e-5) + GaussMarkov(1e-4, 20.0), WhiteNoise(8e-4) + RandomWalk(3e-5)
    return {
        f"{sensor}_{axis}": gmwm.simulate(model, n, 0.01, seed=10 * seed + 3 * k + i)
        for k, (sensor, model) in enumerate({"gyro": gyro, "accel": accel}.items())
        for i, axis in enumerate("xyz")
    }


def mems(seed: int = 1) -> Path:
    return made(f"mems_{seed}.csv", lambda path: csv(path, mems_series(seed)))


def arrays(name: str, make: Callable[[], Any]) -> Any:
    """Arrays of a file of the inputs, made where it is absent."""

    def written(path: Path) -> None:
        values = make()
        with path.open("wb") as stream:
            np.savez(stream, **values) if isinstance(values, dict) else np.save(stream, values)

    return np.load(made(name, written))


def walk() -> np.ndarray:
    model = WhiteNoise(1.0) + RandomWalk(0.1)
    return arrays("walk.npy", lambda: gmwm.simulate(model, 20_000, 0.01, seed=3))


def series() -> Mapping[str, np.ndarray]:
    """Of each of `MODELS`."""
    simulated = partial(gmwm.simulate, n=6000, dt=0.1, seed=5)
    return arrays("series.npz", lambda: {name: simulated(each) for name, each in MODELS.items()})


def faulty() -> Path:
    """A recording in which much is wrong."""

    def make(path: Path) -> None:
        x = mems_series(7)
        t = 0.01 * np.arange(40_000)
        x["gyro_x"] += 3e-4 * np.sin(2 * np.pi * 7.3 * t)
        x["gyro_y"][[500, 9000, 21_000]] += 0.05
        x["gyro_z"][20_000:] += 5e-4
        x["accel_x"][10_000:10_400] = np.nan
        x["accel_y"] = 0.004 * np.round(x["accel_y"] / 0.004)
        x["accel_z"] = np.clip(9.8 + x["accel_z"] + 0.05 * np.exp(-t / 40.0), None, 9.83)
        csv(path, x)

    return made("faulty.csv", make)


def adis(number: int) -> Path | None:
    """Some rows of a real recording."""
    folder, name = shared(), f"adis_{number}.csv"
    if not Path(name).exists() and folder is None:
        return None

    def make(path: Path) -> None:
        first, n = ADIS_ROWS[number]
        with gzip.open(folder / f"adis16405_{number}.csv.gz", "rt") as stream:
            path.write_text("".join([next(stream), *islice(stream, first, first + n)]))

    return made(name, make)


ADIS_OPTIONS = ("--rate", 100, "--gyro-unit", "deg/s", "--accel-unit", "g")


def calibration(name: str) -> Path:
    """A stored calibration: of mems_K or of adis_K."""

    def make(path: Path) -> None:
        kind, number = name.split("_")
        source = mems(int(number)) if kind == "mems" else adis(int(number))
        options = ADIS_OPTIONS if kind == "adis" else ()
        with tempfile.TemporaryDirectory() as folder:
            command("calibrate", source, *options, "--jobs", 1, "-q", "-o", folder)
            shutil.copy(Path(folder) / "calibration.json", path)

    return made(f"cal_{name}.json", make)


def calibrations() -> list[str]:
    return ["mems_1", *(["adis_1"] if Path("adis_1.csv").exists() or shared() else [])]


# -- parts ----------------------------------------------------------------------------------------


@part
def readers() -> Cases:
    for name, path in {"drive": drive() / "imu.csv", "mems": mems(), "faulty": faulty()}.items():
        yield name, partial(_recorded, path)
    for number in ADIS_ROWS:
        if path := adis(number):
            given = {"rate": 100.0, "units": {"gyro": "deg/s", "accel": "g"}}
            yield f"adis_{number}", partial(_recorded, path, **given)
    yield "imu", lambda: ins.read_imu(drive() / "imu.csv")
    yield "fixes", lambda: ins.read_fixes(drive() / "fixes.csv")
    columns = {"channels": {"gyro_x": 1, "accel_z": 6}, "units": SI, "time": 0}
    yield "columns", partial(_recorded, mems(), **columns)
    yield "part", lambda: recording(gmwm.read(faulty()).part(50.0, 150.0))
    for path in made("formats", _make_formats).iterdir():
        files = [each for each in sorted(path.iterdir()) if each.name != "layout"]
        layout = path / "layout"
        given = {"layout": layout.read_text()} if layout.exists() else {}
        yield path.name, partial(_recorded, files[0], **given)


def _recorded(path: Path, **given: Any) -> Any:
    return recording(gmwm.read(path, **given))


LOGS = ("ulog", "ardupilot", "mat", "hdf5")


def _make_formats(folder: Path) -> None:
    """Whole files of all formats."""
    formats = importlib.import_module("fuzz_formats")
    for variant in range(8):
        originals = {
            **{name: getattr(formats, name)(variant) for name in LOGS},
            "mat73": formats.hdf5(variant, is_mat=True),
            **{kind: formats.arrow(kind, variant) for kind in ("parquet", "feather")},
            **{f"bag{kind}": formats.bag(kind, variant) for kind in ("1", "SQLITE3", "MCAP")},
        }
        for name, files in originals.items():
            for file, data in files.items():
                path = folder / f"{name}_{variant}" / file
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(data)


@part
def variance() -> Cases:
    x = walk()
    holes = x.copy()
    holes[3000:3200] = holes[7000] = np.nan
    for wavelet in ("haar", "db2", "sym4", "coif1"):
        yield wavelet, lambda wavelet=wavelet: gmwm.wavelet_variance(x, 0.01, wavelet=wavelet)
    yield "gaps", lambda: gmwm.wavelet_variance(holes, 0.01)
    yield "robust", lambda: gmwm.wavelet_variance(x, 0.01, robust=True)
    yield "robust_gaps", lambda: gmwm.wavelet_variance(holes, 0.01, robust=True, efficiency=0.8)
    yield "octave", lambda: gmwm.wavelet_variance(x, 0.01, data_covariance="octave")
    model = WhiteNoise(1.0) + RandomWalk(0.1)
    yield "covariance", lambda: gmwm.wavelet_variance(x, 0.01).covariance
    yield "covariance_under", lambda: gmwm.wavelet_variance(x, 0.01).covariance_under(model.psd)
    yield "covariance_gaps", lambda: gmwm.wavelet_variance(holes, 0.01).covariance_under(model.psd)
    yield "haar_covariance", lambda: gmwm.haar_covariance(GaussMarkov(1.0, 3.0).psd, 5000, 0.1)
    for tau in ("octave", "decade", [0.01, 0.05, 1.0]):
        yield f"deviations_{tau}", lambda tau=tau: gmwm.deviations(x[:8000], 0.01, tau=tau)
    yield "modwt", lambda: [*gmwm.modwt(x[:500], "db2").detail, gmwm.modwt(x[:500], "db2").smooth]
    yield "stream", lambda: list(map(plain, gmwm.stream(mems()).variances.values()))
    yield "live", _live


def _live() -> Any:
    stream = gmwm.StreamingVariance(0.01)
    for piece in np.array_split(walk(), 7):
        stream.update(piece)
    return stream.results()


@part
def diagnosis() -> Cases:
    files = {"mems": mems(), "faulty": faulty(), "drive": drive() / "imu.csv"}
    for name, path in files.items():
        yield name, partial(command, "health", path, "--json")
    yield "still", lambda: gmwm.find_still(gmwm.read(drive() / "imu.csv"))
    for number in ADIS_ROWS:
        if path := adis(number):
            yield f"adis_{number}", partial(command, "health", path, *ADIS_OPTIONS, "--json")


MODELS = {
    "N": WhiteNoise(1.0),
    "Q+N": gmwm.QuantizationNoise(0.05) + WhiteNoise(1.0),
    "N+B": WhiteNoise(1.0) + gmwm.BiasInstability(0.5),
    "N+K": WhiteNoise(1.0) + RandomWalk(0.1),
    "N+R": WhiteNoise(1.0) + gmwm.RateRamp(0.02),
    "N+GM": WhiteNoise(1.0) + GaussMarkov(1.0, 5.0),
    "N+2GM": WhiteNoise(1.0) + GaussMarkov(1.0, 2.0) + GaussMarkov(1.0, 50.0),
    "N+line": WhiteNoise(1.0) + Sinusoid(1.0, 0.5),
    "N+resonance": WhiteNoise(1.0) + gmwm.Resonance(2.0, 1.0, 0.05),
    "lowpass": gmwm.LowPassNoise(1.0, 2.0, 1.0, 0.7) + RandomWalk(0.1),
    "averaged": gmwm.AveragedNoise(1.0, 0.5) + RandomWalk(0.1),
    "AR": gmwm.AR([0.9], 1.0),
    "MA": gmwm.MA([0.4], 1.0),
    "ARMA": gmwm.ARMA([0.8], [0.3], 1.0),
    "ARIMA": gmwm.ARIMA([0.5], 1, [0.3], 1.0) + WhiteNoise(3.0),
}
METHODS = ("gmwm", "mle", "whittle", "em", "allan", "simulated")
WEIGHTS = ("model", "data", "diagonal", "identity")


@part
def process() -> Cases:
    tau, f = 0.1 * 2.0 ** np.arange(12), np.geomspace(1e-3, 5.0, 30)
    for name, model in MODELS.items():
        yield name, partial(_laws, as_model(model), tau, f)
    for each in ("WhiteNoise", "GaussMarkov", "Resonance", "LowPassNoise", "ARMA", "Sinusoid"):
        for values in ((-1.0,), (0.0,), (float("nan"),), (1.0, -1.0), (1.0, 1.0, 1.0, 1.0)):
            yield f"{each}{values}", lambda e=each, v=values: str(getattr(gmwm, e)(*v))


def _laws(model: gmwm.Model, tau: np.ndarray, f: np.ndarray) -> dict[str, Any]:
    laws = {
        "params": lambda: model.params,
        "keys": lambda: [each.key for each in model.parameters],
        "terms": lambda: [each.to_dict() for each in model.terms],
        "labels": model.term_labels,
        "haar": lambda: model.haar_variance(tau, 0.1),
        "db2": lambda: model.wavelet_variance(tau, 0.1, "db2"),
        "psd": lambda: model.psd(f, 0.1),
        "autocovariance": lambda: model.autocovariance(np.arange(5), 0.1),
        "states": lambda: model.state_space(0.1),
        "drawn": lambda: model.simulate(500, 0.1, seed=2),
        "white": model.white_density,
        "drift": model.drift_rate,
        "lines": model.lines,
    }
    return {name: outcome(law) for name, law in laws.items()}


@part
def estimate() -> Cases:
    given_series = series()
    for name, model in MODELS.items():
        free, own = as_model(model).opened(), given_series[name]
        wv = gmwm.wavelet_variance(own, 0.1)
        octave = gmwm.wavelet_variance(own, 0.1, data_covariance="octave")
        for weights in WEIGHTS:
            given = octave if weights == "data" else wv
            yield f"{name}_{weights}", partial(gmwm.fit, free, given, weights=weights)
        for method in METHODS[1:]:
            if method == "em" and name not in ("N+K", "N+GM", "N+R"):
                continue
            n = 1500 if method in ("mle", "em") else 6000
            yield f"{name}_{method}", partial(gmwm.fit, free, own[:n], 0.1, method=method)
    model, x = MODELS["N+K"], given_series["N+K"]
    halves = [gmwm.wavelet_variance(each, 0.1) for each in np.split(x, 2)]
    yield "joint", lambda: gmwm.fit(model.opened(), halves)
    yield "robust", lambda: gmwm.fit(model.opened(), gmwm.wavelet_variance(x, 0.1, robust=True))
    yield "fixed", lambda: gmwm.fit(WhiteNoise() + GaussMarkov(tau=5.0), given_series["N+GM"], 0.1)
    yield "bootstrap", lambda: gmwm.bootstrap(gmwm.fit(model.opened(), x, 0.1), 8, seed=1)
    white = gmwm.fit(WhiteNoise(), x[:1000], 0.1)
    yield "test", lambda: gmwm.bootstrap_test(white, WhiteNoise() + RandomWalk(), 8)
    yield "parts", lambda: _parts_of(gmwm.fit(model.opened(), x, 0.1))
    for name in ("N+K", "N+GM", "N+2GM", "Q+N", "N+R", "lowpass", "N+B"):
        yield f"cramer_rao_{name}", partial(gmwm.cramer_rao, MODELS[name], 2000, 0.1)


def _parts_of(fit: Any) -> Any:
    texts = [each.to_dict() for each in fit.estimates]
    numbers = [fit.interval(0.9), fit.error_growth, fit.needed_length()]
    return [*numbers, fit.deviation_interval(fit.wv.tau), texts, fit.reasons, fit.implied]


@part
def selection() -> Cases:
    given = series()
    for name in ("N", "N+K", "N+2GM", "N+B", "Q+N", "N+R", "lowpass", "AR"):
        yield name, partial(gmwm.select, given[name], 0.1)
    yield "validity", lambda: gmwm.select(given["N+GM"], 0.1, max_gauss_markov=2, rule="validity")
    line = {"max_gauss_markov": 1, "extra": [Sinusoid()]}
    yield "extra", partial(gmwm.select, given["N+line"], 0.1, **line)


@part
def calibration_() -> Cases:
    out = ("--jobs", 1, "--json", "-o", tempfile.mkdtemp())
    for name, files, options in (
        ("mems", [mems()], ""),
        ("faulty", [faulty()], ""),
        ("departures", [faulty()], "--remove-departures --channels gyro_z,accel_z"),
        ("given", [mems()], "--model 'N + GM'"),
        ("left", [faulty()], "--leave all --channels gyro"),
        ("several", [mems(), mems(2)], "--model 'N + K' --channels gyro_x,accel_x"),
        ("drive", [drive() / "imu.csv"], "--channels gyro_x"),
    ):
        yield name, partial(command, "calibrate", *files, *split(options), *out)
    for number, channels in {1: "gyro,accel", 3: "gyro_z,accel_y", 4: "gyro_x,accel_z"}.items():
        if path := adis(number):
            more = (*ADIS_OPTIONS, "--channels", channels, *out)
            yield f"adis_{number}", partial(command, "calibrate", path, *more)
    for name in calibrations():
        yield f"loaded_{name}", lambda name=name: _loaded(gmwm.load(calibration(name)))


def _loaded(found: Any) -> Any:
    frame = found.to_frame()
    return {"whole": found, "columns": list(frame.columns), "rows": frame.to_dict(orient="list")}


@part
def filter_numbers() -> Cases:
    for name in calibrations():
        path = calibration(name)
        for form in ("N+K", "N+GM", "N+K+GM", "N+2GM"):
            for kind in ("bound", "reduce"):
                more = () if kind == "reduce" or "GM" not in form else ("--tau", 100)
                given = (kind, path, "--form", form, *more, "--json")
                yield f"{kind}_{form}_{name}", partial(command, *given)
        shared = "--form N+GM --shared --gyro-bias 0.001 --accel-bias 0.01 --json --tau"
        certify = ("certify", path, *split("-N 1e-4,2e-3 -K 1e-6,3e-5 --json"))
        motion = "--motion car --scale-error 1 --misalignment 0.2 --g-sensitivity 0.01"
        motion += " --time-offset 5 --keyframe 0.5"
        for kind, given in {
            "keyframe": ("reduce", path, "--keyframe", 1, "--json"),
            "bound_shared": ("bound", path, *split(shared), 50),
            "reduce_shared": ("reduce", path, *split(shared), "shared"),
            "level": ("bound", path, *split("--level 0.9 --horizon 10 --json")),
            "certify": certify,
            "imperfections": (*certify, *split(motion)),
            "unknown": ("budget", path, "--unknown-start"),
        }.items():
            yield f"{kind}_{name}", partial(command, *given)
        yield f"budget_{name}", lambda path=path: gmwm.error_budget(gmwm.load(path), dt=0.01)
        yield f"own_{name}", lambda path=path: _certified(gmwm.load(path))
    truth = WhiteNoise(1e-4) + GaussMarkov(2e-4, 5.0) + RandomWalk(2e-6)
    for form in ("N+K", "N+GM", "N+K+GM"):
        tau = None if form == "N+K" else 100.0
        yield f"model_bound_{form}", partial(gmwm.bound, truth, form, tau=tau, dt=0.01)
        yield f"model_reduce_{form}", partial(gmwm.reduce, truth, form, dt=0.01)
    for name, model in MODELS.items():
        yield f"model_{name}", partial(gmwm.bound, model, dt=0.1)


def _certified(found: Any) -> Any:
    return gmwm.certify(found, gmwm.bound(found))


STUDY = """\
trajectory: car
duration: 60 s
rate: 20 Hz
truth: {gyro: {N: 140 deg/h/sqrt(Hz), GM: [[113 deg/h, 2000 s]]}, accel: {N: 200 ug/sqrt(Hz), K: 1e-6}}
filters: {right: truth, small: {gyro: {N: 140 deg/h/sqrt(Hz)}, accel: {N: 200 ug/sqrt(Hz)}}}
outages: [[20, 10], [40 s, 10 s]]
gnss: {interval: 1, position_sd: [2, 2, 4], velocity_sd: 0.1, lever_arm: [1, 0, 0]}
initial_sd: {tilt: 0.1 deg, heading: 1 deg}
runs: 4
seed: 1
"""


def _study(**changes: Any) -> Any:
    import yaml

    return ins.experiment_from(yaml.safe_load(STUDY) | changes)


def _validation() -> Any:
    own = _study()
    found = ins.monte_carlo(own.scenario, own.source, own.filters, own.runs, own.seed)
    names = ("time", "error", "sd", "nees", "nis", "sensor_error", "diverged")
    filters = {k: [getattr(each, name) for name in names] for k, each in found.filters.items()}
    return {"filters": filters, "notices": found.notices}


def _analysis() -> Any:
    own = _study()
    found = ins.covariance_analysis(own.scenario, own.truth, own.filters["small"])
    return [found.time, found.predicted, found.actual, found.nees, found.notices]


@part
def ins_() -> Cases:
    log = ("navigate", f"--imu={drive() / 'imu.csv'}", f"--gnss={drive() / 'fixes.csv'}")
    out = ("--json", "-o", tempfile.mkdtemp())
    cal, other = (f"{calibration(f'mems_{k}')}" for k in (1, 2))
    arm = split("--lever-arm 1,0.3,-1 --gate 1e-5 --zero-velocity '0.02 m/s' --heading 30")
    models = (f"--sensors=A={cal}", f"--sensors=B={other}")
    yield "own", partial(command, *log, f"--sensors={cal}", *out)
    yield "arm", partial(command, *log, f"--sensors={cal}", *arm, *out)
    yield "compared", partial(command, *log, *models, "--outages", 30, *out)
    yield "study", _validation
    yield "covariance", _analysis
    for form in ("car", "helicopter", "loiter"):
        yield f"trajectory_{form}", lambda form=form: _study(trajectory=form).scenario.trajectory
    path = ins.car_drive(duration=20.0)
    yield "emulate", lambda: ins.emulate(path)
    yield "integrate", lambda: ins.integrate(ins.emulate(path), path.state(0))
    yield "preintegrate", lambda: ins.preintegrate(ins.emulate(path), _study().truth)
    arm_of = {"lever_arm": (1.0, 0.0, 0.0), "imu": ins.emulate(path)}
    yield "gnss", partial(ins.gnss, path, velocity_sd=0.1, **arm_of)


@part
def population() -> Cases:
    paths = [calibration(name) for name in ("mems_1", "mems_2")]
    yield "compare", lambda: command("compare", *paths, "--json", "-o", _new("compare.html"))
    if Path("adis_1.csv").exists():
        more = (calibration("mems_1"), calibration("adis_1"))
        yield "unequal", lambda: command("compare", *more, "--json", "-o", _new("compare.html"))
    lot = made("lot", _make_lot)
    for name, files, more in (
        ("fleet", lot / "*.csv", ("--model", "N + K")),
        ("selected", lot / "unit_[12].csv", ()),
    ):
        given = ("fleet", files, "--jobs", 1, *more, "--json", "-o", _new("fleet"))
        yield name, partial(command, *given)


def _new(name: str) -> str:
    return f"{tempfile.mkdtemp()}/{name}"


def _make_lot(folder: Path) -> None:
    folder.mkdir()
    for unit in range(6):
        model = WhiteNoise(1e-4 * (1 + 0.1 * unit)) + RandomWalk(1e-5 * (1 + (unit == 4)))
        values = {"gyro_x": gmwm.simulate(model, 5000, 0.01, seed=unit)}
        csv(folder / f"unit_{unit}.csv", values)
    (folder / "unit_9.csv").write_text("no,numbers\nat,all\n")


@part
def export() -> Cases:
    for name in calibrations():
        found = gmwm.load(calibration(name))
        for target in TARGETS:
            yield f"{target}_{name}", lambda found=found, target=target: _exported(found, target)
    found = gmwm.load(calibration("mems_1"))
    for target, more in {
        "kalibr": {"horizon": 10.0},
        "kfgins": {"horizon": 30.0},
        "state-space": {"form": "N+GM"},
        "gazebo": {"form": "N+K"},
        "px4": {"form": "N+GM"},
        "nothing": {},
    }.items():
        yield f"{target}_{more}", lambda target=target, more=more: _exported(found, target, **more)
    yield "list", lambda: command("export", "--list")


def _exported(found: Any, target: str, **more: Any) -> Any:
    text = gmwm.export(found, target, **more)
    with contextlib.suppress(ValueError):
        return json.loads(text)
    return tokens(text)


# -- damaged files --------------------------------------------------------------------------------

BINARY = "ulog ardupilot mat mat73 hdf5 parquet feather bag1 sqlite3 mcap records"
READ = ("text", "gzip", "npy", "npz", *BINARY.split(" "))
USES: dict[str, Callable[[Path, int], Any]] = {
    "document": lambda path, case: gmwm.load(path),
    "imu": lambda path, case: ins.read_imu(path, 100.0 if case % 2 else None, SI),
    "fixes": lambda path, case: ins.read_fixes(path),
    "trajectory": lambda path, case: ins.Trajectory.read(path),
    "study": lambda path, case: command("navigate", path, "--jobs", 1, "-o", _new("nav"))["status"],
    "field": lambda path, case: command("navigate", path, "--json", "-o", _new("nav")),
    "odd": lambda path, case: [
        gmwm.health(gmwm.read(path, units=SI)),
        gmwm.calibrate(gmwm.read(path, units=SI), WhiteNoise() + RandomWalk(), jobs=1),
    ],
    "numbers": lambda path, case: read_numbers(path, 100.0 if case % 2 else None),
    "datasheet": lambda path, case: gmwm.datasheet.read_datasheet(
        path, {"gyro_x": "gyro", "accel_x": "accel"}
    ),
    "checkpoint": lambda path, case: gmwm.StreamingVariance.load(path).results(),
    "fleet": lambda path, case: gmwm.Fleet.load(path),
}


def _read(path: Path, case: int) -> Any:
    options: dict[str, Any] = {"units": SI, "damaged": case % 3 == 0}
    if case % 2:
        options["rate"] = 100.0
    if path.suffix == ".dat":
        options["layout"] = path.with_name("layout").read_text()
    return recording(gmwm.read(path, **options))


def _make_corpus(folder: Path) -> None:
    kinds = importlib.import_module("fuzz").KINDS
    for kind in (*READ, *USES):
        for case in range(PER_KIND.get(kind, 15)):
            own = folder / kind / str(case)
            own.mkdir(parents=True)
            path = kinds[kind].make(random.Random(f"net/{kind}/{case}"), own)
            (own / "path.txt").write_text(str(path.relative_to(own)))


@part
def fuzz() -> Cases:
    corpus = made("fuzz", _make_corpus)
    importlib.import_module("gmwm.report")
    for kind in (*READ, *USES):
        for own in sorted((corpus / kind).iterdir(), key=lambda path: int(path.name)):
            use, case = USES.get(kind, _read), int(own.name)
            path = own / (own / "path.txt").read_text()
            yield f"{kind}/{case}", lambda use=use, path=path, case=case: use(path, case)


# -- recording and comparing ----------------------------------------------------------------------


def record(folder: Path, only: list[str], inputs: Path | None) -> None:
    """Write a file of JSON for each part."""
    folder.mkdir(parents=True, exist_ok=True)
    home, folder = Path.cwd(), folder.resolve()
    os.environ["NET_HOME"] = str(home / "x")
    inputs = (inputs or folder / "inputs").resolve()
    inputs.mkdir(parents=True, exist_ok=True)
    sys.path.insert(0, str(home / "tests"))
    print(f"gmwm of {Path(gmwm.__file__).parent}")
    try:
        os.chdir(inputs)
        for name in only or PARTS:
            start = time.process_time()
            found = {case: outcome(act) for case, act in PARTS[name]()}
            seconds = time.process_time() - start
            failed = [k for k, each in found.items() if isinstance(each, dict) and "failed" in each]
            print(f"{name}: {len(found)} cases, {seconds:.0f} s; failed: {failed}", flush=True)
            text = json.dumps(found, indent=0, sort_keys=True)
            (folder / f"{name}.json").write_text(text, encoding="utf-8")
    finally:
        os.chdir(home)


def differences(
    a: Any, b: Any, tolerance: float, path: str = "", scale: float = 0.0
) -> Iterator[tuple[str, Any, Any]]:
    """Place and both values wherever they are not the same.

    scale: Of the numbers beside these: a thousandth of it is the least that is compared with.
    """
    if isinstance(a, dict) and isinstance(b, dict):
        for key in sorted({*a, *b}):
            one, other = a.get(key, "(none)"), b.get(key, "(none)")
            yield from differences(one, other, tolerance, f"{path}/{key}")
    elif _is_number(a) and _is_number(b):
        floor = ROUND_OFF.get(path.rsplit("/", 1)[-1], 0.0)
        if abs(a - b) > max(tolerance * max(abs(a), abs(b), 1e-3 * scale), floor):
            yield path, a, b
    elif isinstance(a, list) and isinstance(b, list) and len(a) == len(b):
        largest = max((abs(each) for each in (*a, *b) if _is_number(each)), default=0.0)
        for i, pair in enumerate(zip(a, b, strict=True)):
            yield from differences(*pair, tolerance, f"{path}/{i}", largest)
    elif a != b:
        yield path, a, b


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def compare(before: Path, after: Path, tolerance: float, most: int) -> int:
    """Print the differences of two records, grouped by part and key; how many there are."""
    count = 0
    for file in sorted(after.glob("*.json")):
        if not (before / file.name).exists():
            print(f"{file.name}: not in {before}")
            continue
        old, new = (json.loads((each / file.name).read_text()) for each in (before, after))
        groups: dict[str, list[tuple[str, Any, Any]]] = defaultdict(list)
        for place, one, other in differences(old, new, tolerance):
            case, _, rest = place[1:].partition("/")
            groups[re.sub(r"/\d+(?=/|$)", "/*", rest) or "(whole)"].append((case, one, other))
        found = sum(map(len, groups.values()))
        count += found
        print(f"{file.stem}: {len(old)} cases, {found} differences")
        for key, each in sorted(groups.items(), key=lambda item: -len(item[1])):
            print(f"  {len(each)} x {key}")
            for case, one, other in each[:most]:
                print(f"    {case}: {str(one)[:160]}  ->  {str(other)[:160]}")
    return count


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("command", choices=("record", "compare"))
    parser.add_argument("folders", type=Path, nargs="+")
    parser.add_argument("--only", type=lambda text: text.split(","), default=[])
    parser.add_argument("--inputs", type=Path)
    parser.add_argument("--tolerance", type=float, default=1e-9)
    parser.add_argument("--most", type=int, default=4, help="examples of each group")
    given = parser.parse_args()
    if len(given.folders) != 1 + (given.command == "compare"):
        parser.error("give a folder to record into, or two to compare")
    if given.command == "record":
        record(*given.folders, given.only, given.inputs)
    else:
        sys.exit(compare(*given.folders, given.tolerance, given.most) > 0)


if __name__ == "__main__":
    main()
