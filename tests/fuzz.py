# ruff: noqa: E501 - tables of hostile values
"""Damaged inputs: every file that gmwm reads, mutated, is used or refused in one sentence.

``python tests/fuzz.py --cases 70000`` draws as many over all kinds of files, prints how many were used
and refused, and ends with status 1 if any was neither: a traceback, a warning, more than 10 s of the
processor, or more than 1 GB. ``--only KIND --first CASE --cases 1`` repeats one. The suite runs some of
each.
"""

from __future__ import annotations

import argparse
import atexit
import gzip
import io
import json
import logging
import random
import re
import shutil
import signal
import sys
import tempfile
import time
import traceback
import warnings
import zipfile
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

import fuzz_formats as formats
import gmwm
from fleets import QUICK
from gmwm._core.runs import do_runs
from gmwm.datasheet import read_datasheet
from gmwm.diagnosis import health
from gmwm.estimate import bootstrap, cramer_rao
from gmwm.export import TARGETS, export, read_numbers
from gmwm.ins.fields import read_document
from gmwm.ins.logs import Measured, read_fix_log, read_imu_log
from gmwm.ins.spec import experiment_from
from gmwm.ins.trajectory.trajectory import read_log
from gmwm.report import write_report

SECONDS, BYTES = 10, 1 << 30
TOO_LARGE = "too large"
LONGEST = 2000  # characters of a message, with the path
SI = formats.SI

HOSTILE = (
    "", " ", "nan", "inf", "-1", "0", "1e999", "1e308", "1e-320", "9" * 400, "-0", "1_0", "٣", "0x1",
    "\x00", "\x1b[31m", "\x1b]0;x\x07", "\r", "\n", "\u2028", "\u202e", "\ud800", "é", "µ", "²",
    "[/red]", "[bold]x[/bold]", "temp [/degC]", ":smile:", "<!--<script>", "</script>", "{{ 7*7 }}",
    "%s%n", "a: b", "- x", "&a", "*a", "!!int", "'", '"', "#", "../../x", "x" * 3000,
)  # fmt: skip
VALUES = (
    None, True, False, 0, -1, -5, -100, 1, 2, 3, 64, 10**9, 10**18, 10**400, 0.0, -0.0, 0.5, -1.0,
    1e-320, 1e-200, 1e-30, 1e20, 1e150, 1e200, 1e308, -1e308, float("nan"), float("inf"), [], {},
    [[]], [0.0], {"a": 1}, *HOSTILE,
)  # fmt: skip


# -- mutations ------------------------------------------------------------------------------------


def mutated_text(rng: random.Random, data: bytes) -> bytes:
    """A few things done to the bytes of a text: in fields, in lines, anywhere."""
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        data = _one_change(rng, data)
    return data


def _one_change(rng: random.Random, data: bytes) -> bytes:
    place = rng.randrange(len(data) + 1)
    kind = rng.randrange(12)
    if kind == 0:
        return data[:place] + data[place + rng.randrange(1, 40) :]
    if kind == 1:
        return data[:place]
    if kind == 2:
        return data[:place] + rng.randbytes(rng.choice((1, 1, 4, 200))) + data[place:]
    if kind == 3:
        return data[:place] + _hostile(rng) + data[place:]
    if kind == 4:
        old, new = rng.sample([b",", b";", b"\t", b" ", b".", b"\n", b"\r\n", b"|", b":", b'"'], 2)
        return data.replace(old, new, rng.choice((1, 7, -1)))
    lines = data.split(b"\n")
    i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
    if kind == 5:
        lines[i], lines[j] = lines[j], lines[i]
    elif kind == 6:
        del lines[i]
    elif kind == 7:
        lines[i:i] = [lines[j]] * rng.choice((1, 1, 100))
    elif kind == 8:
        lines[i] = _hostile(rng)
    else:
        i = rng.choice((0, 0, i))  # the header says most
        parts = re.split(rb"([,;\t :{}\[\]]+)", lines[i])
        parts[2 * rng.randrange((len(parts) + 1) // 2)] = _hostile(rng)
        lines[i] = b"".join(parts)
    return b"\n".join(lines)


def _hostile(rng: random.Random) -> bytes:
    return rng.choice(HOSTILE).encode("utf-8", "surrogatepass")


def mutated_json(rng: random.Random, text: str) -> bytes:
    """Values of a document replaced, left out, doubled, nested; now and then its bytes."""
    if rng.random() < 0.15:
        return mutated_text(rng, text.encode())
    content = json.loads(text)
    for _ in range(rng.choice((0, 1, 1, 1, 2, 3))):
        content = _changed(rng, content)
    with suppress(ValueError):  # a part may now hold itself
        text = json.dumps(content)
    return text.encode()


def _changed(rng: random.Random, content: Any) -> Any:
    """The content with something done to one of its parts, each depth as likely as another."""
    if not isinstance(content, dict | list) or not content or rng.random() < 0.12:
        return _replaced(rng, content)
    keys = list(content) if isinstance(content, dict) else list(range(len(content)))
    key, kind = rng.choice(keys), rng.random()
    if kind < 0.06:
        del content[key]
    elif kind < 0.1 and isinstance(content, list):
        content.insert(key, content[rng.randrange(len(content))])
    elif kind < 0.12 and isinstance(content, dict):
        content[rng.choice(HOSTILE)] = content.pop(key)
    else:
        content[key] = _changed(rng, content[key])
    return content


def _is_number(value: Any) -> bool:
    """One that can be multiplied by another."""
    is_some = isinstance(value, int | float) and not isinstance(value, bool)
    return is_some and not (isinstance(value, int) and abs(value) > 10**300)


def _replaced(rng: random.Random, value: Any) -> Any:
    kind = rng.random()
    if _is_number(value) and kind < 0.4:
        return value * rng.choice((-1, 0, 2, 0.5, 1e-30, 1e30, 1e-300, 1.0000001))
    if kind < 0.45:
        for _ in range(rng.choice((2, 40, 200))):
            value = [value]
        return value
    return rng.choice(VALUES)


def mutated_bytes(rng: random.Random, data: bytes) -> bytes:
    """Bytes of a binary file, most often near its ends, where the headers are."""
    for _ in range(rng.choice((0, 1, 1, 2, 4))):
        u = rng.random()
        place = int(len(data) * rng.choice((u, u**3, 1.0 - u**3)))
        new = rng.choice((b"", rng.randbytes(rng.randrange(1, 4)), b"9", b"(", b"O", b"'", b"\xff"))
        data = data[:place] + new + data[place + rng.randrange(4) :]
    return data[: rng.randrange(len(data) + 1)] if rng.random() < 0.1 else data


# -- originals ------------------------------------------------------------------------------------


@cache
def noise(n: int = 96) -> np.ndarray:
    rows = 1e-3 * np.random.default_rng(0).normal(size=(n, 6))
    return rows + np.array([0.0, 0.0, 0.0, 0.0, 0.0, 9.8])


def table(rng: random.Random, names: str, columns: np.ndarray) -> bytes:
    mark = rng.choice((",", ";", "\t", " "))
    lines = [names.replace(",", mark)] if names else []
    lines += [mark.join(f"{value:.6g}" for value in row) for row in columns]
    return "\n".join([*lines, ""]).encode()


AXES = "gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z"


def recording(rng: random.Random) -> bytes:
    rows, width = noise(), rng.choice((7, 8))
    stamped = np.column_stack([0.01 * np.arange(len(rows)), rows, 20.0 + rows[:, 0]])
    names, step = rng.choice((
        (f"time_s,{AXES},temp [degC]", 1.0),
        ("t [ms],wx [rad/s],wy [rad/s],wz [rad/s],ax [m/s^2],ay [m/s^2],az [m/s^2],T [K]", 1e3),
        ("", 1.0),
    ))  # fmt: skip
    stamped[:, 0] *= step
    width = width if names else 7
    return table(rng, ",".join(names.split(",")[:width]) if names else "", stamped[:, :width])


def fixes(rng: random.Random) -> bytes:
    k = np.arange(40.0)
    columns = [k, 45 + 1e-6 * k, 7 + 1e-6 * k, 400 + 0 * k, 1 + 0 * k, 0 * k, 0 * k]
    names = "time_s,latitude_deg,longitude_deg,height_m,velocity_north,velocity_east,velocity_down"
    return table(rng, names, np.column_stack(columns))


def trajectory(rng: random.Random) -> bytes:
    k = 0.1 * np.arange(80.0)
    columns = [k, 45 + 1e-6 * k, 7 + 1e-6 * k, 400 + 0 * k, 0.1 * k, 0 * k, 2 * k]
    names = "time_s,latitude_deg,longitude_deg,height_m,roll_deg,pitch_deg,heading_deg"
    return table(rng, names, np.column_stack(columns))


@cache
def documents() -> tuple[str, ...]:
    """One of each kind of stored result."""
    rng = np.random.default_rng(1)
    x = np.cumsum(0.01 * rng.normal(size=700)) + rng.normal(size=700)
    holes = np.where(rng.random(700) < 0.02, np.nan, x)
    model = gmwm.WhiteNoise() + gmwm.RandomWalk()
    data = {"gyro_x": 1e-3 * x, "gyro_y": 1e-3 * holes, "accel_x": x, "accel_y": np.ones(700)}
    given = gmwm.Recording.from_arrays(data, rate=100.0, units=SI, source="static.csv")
    backwards = {name: values[::-1] for name, values in data.items()}
    other = gmwm.Recording.from_arrays(backwards, rate=100.0, units=SI, source="static.csv")
    calibrations = [gmwm.calibrate(given, model), gmwm.calibrate([given, other], model)]
    numbers = gmwm.bound(calibrations[0], "N+K", horizon=60.0)
    fit = gmwm.fit(gmwm.WhiteNoise() + gmwm.GaussMarkov(tau=30.0), x, 1.0)
    selection = gmwm.select(x[:300], 1.0)
    others = [fit, selection, health(given), bootstrap(fit, 5), cramer_rao(fit.model, 99, 1.0),
              numbers, numbers["gyro_x"], gmwm.certify(calibrations[0], numbers)]  # fmt: skip
    return tuple(json.dumps(each.to_dict()) for each in (*calibrations, *others))


STUDY = """\
trajectory: car
duration: 30 s
rate: 10 Hz
truth: {gyro: {N: 140 deg/h/sqrt(Hz), GM: [[113 deg/h, 2000 s]]}, accel: {N: 200 ug/sqrt(Hz), K: 1e-6}}
filters:
  right: truth
  own:
    gyro: {N: 0.001, bias: 1 deg/h}
    accel: {N: 0.002, bias: 1 mg}
outages: [[10, 5], [20 s, 5 s]]
gnss: {interval: 1, position_sd: [2, 2, 4], velocity_sd: 0.1, lever_arm: [1, 0, 0]}
initial_sd: {tilt: 0.1 deg, heading: 1 deg}
runs: 2
seed: 1
"""
FIELD = """\
imu: {file: imu.csv, rate: 100, units: {gyro: rad/s, accel: m/s^2}}
gnss_fixes: fixes.csv
sensors: {gyro: {N: 140 deg/h/sqrt(Hz)}, accel: {N: 200 ug/sqrt(Hz)}}
lever_arm: [1, 0, 0.5]
heading: 30 deg
position_sd: 2 m
bias: {gyro: 10 deg/h, accel: 2 mg}
"""
DATASHEET = """\
gyro: {N: 0.15 deg/sqrt(h), B: 7 deg/h, K: 1e-6 rad/s^2/sqrt(Hz)}
accel_x: {N: 60 ug/sqrt(Hz), B: 0.03 mg}
"""


@cache
def programs() -> tuple[tuple[str, bytes], ...]:
    """Numbers as the files of programs hold them: suffix and content."""
    rng = np.random.default_rng(3)
    data = {f"{sensor}_{axis}": 1e-3 * rng.normal(size=300) for sensor in SI for axis in "xyz"}
    given = gmwm.Recording.from_arrays(data, rate=100.0, units=SI)
    found = gmwm.bound(gmwm.calibrate(given, gmwm.WhiteNoise() + gmwm.RandomWalk(K=1e-5)))
    texts = []
    for name, target in TARGETS.items():
        with suppress(gmwm.InputError):  # without a place for a random walk
            texts.append((Path(target.file).suffix, export(found, name).encode()))
    return tuple(texts)


def make_numbers(rng: random.Random, folder: Path) -> Path:
    suffix, text = rng.choice(programs())
    path = folder / f"imu{suffix}"
    odd = mutated_json(rng, text.decode()) if suffix == ".json" else mutated_text(rng, text)
    path.write_bytes(odd)
    return path


YAML = ("!!float x", "!!bool 2", "!!timestamp x", "!!binary =", "!!int 1e9", "!!null 3", "!!set {a}",
        "!!map [1]", "!!omap 3", "!!python/object:os.system x", "1.0e+999", "-.inf", ".nan", "2001-13-45",
        "1:99:99", "[[[[[[1]]]]]]", "[" * 500, "&a [*a, *a]", "{? [1]: 2}", "<<: 1", "1e150 deg/s",
        "1e308", "-3", "0", "1e-300", "7 parsecs", "1 " + "(" * 50, "9" * 5000, "~", "yes")  # fmt: skip


def yaml_text(rng: random.Random, text: str) -> bytes:
    if rng.random() < 0.4:
        return mutated_text(rng, text.encode())
    for _ in range(rng.choice((1, 1, 2))):
        found = list(re.finditer(r"(?<=[:\[,] )[^,\]}{\n]+|(?<=\[)[^,\[\]\n]+", text))
        place = rng.choice(found)
        text = text[: place.start()] + rng.choice(YAML + HOSTILE) + text[place.end() :]
    return text.encode("utf-8", "surrogatepass")


def archive(rng: random.Random) -> bytes:
    """An NPZ file with odd entries."""
    rows, stream = noise(), io.BytesIO()
    entries: dict[str, Any] = {
        "t": 0.01 * np.arange(len(rows)),
        "gyro": rows[:, :3],
        "ax": rows[:, 3],
    }
    odd = (
        np.float32(3), rows.astype(complex), rows > 0, np.array(["a"] * len(rows)), rows[:, :, None],
        np.zeros((0, 3)), np.zeros(len(rows), "M8[s]"), rows.astype(np.float16), rows[::-1, :3],
        np.asfortranarray(rows), rows.astype(">f8"), np.zeros(len(rows), [("x", "f8"), ("y", "f4", 3)]),
        np.full((len(rows), 3), 1e308), np.array({"a": 1}), rows[:50],
    )  # fmt: skip
    for _ in range(rng.choice((0, 1, 2))):
        entries[rng.choice((*entries, "accel", "rate", "dt", *HOSTILE[20:30]))] = rng.choice(odd)
    saver = rng.choice((np.savez, np.savez_compressed))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        saver(stream, **{name.replace("\x00", "").replace("\ud800", "") or "a": each
                         for name, each in entries.items()})  # fmt: skip
    return stream.getvalue()


def declared(rng: random.Random) -> bytes:
    """An array whose header promises anything."""
    stream = io.BytesIO()
    size = rng.choice((3, 10**6, 10**10, 10**15, 10**30, -1))
    kind = rng.choice(("<f8", "|O", "<U9999999", "|V8", "<f2", "<c16"))
    text = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': ({size}, 3), }}"
    header = text.ljust(117) + "\n"
    stream.write(b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header.encode())
    stream.write(noise().tobytes()[: rng.choice((0, 100, 4608))])
    return stream.getvalue()


# -- kinds of files -------------------------------------------------------------------------------


@dataclass(frozen=True)
class Kind:
    """How inputs are made, and used."""

    share: float
    make: Callable[[random.Random, Path], Path]
    use: Callable[[random.Random, Path], Any]


def file_of(
    name: str, make: Callable[[random.Random], bytes]
) -> Callable[[random.Random, Path], Path]:
    def write(rng: random.Random, folder: Path) -> Path:
        path = folder / name
        path.write_bytes(make(rng))
        return path

    return write


def packed(rng: random.Random) -> bytes:
    data = gzip.compress(mutated_text(rng, recording(rng)), 1)
    return mutated_bytes(rng, data) if rng.random() < 0.5 else data


def zipped(rng: random.Random) -> bytes:
    if rng.random() < 0.2:
        stream = io.BytesIO()
        with zipfile.ZipFile(stream, "w") as out:
            out.writestr("gyro.npy", declared(rng))
        return stream.getvalue()
    data = archive(rng)
    return mutated_bytes(rng, data) if rng.random() < 0.6 else data


def binary(rng: random.Random) -> bytes:
    if rng.random() < 0.2:
        return declared(rng)
    stream = io.BytesIO()
    rows = noise()
    named = np.zeros(len(rows), [("t", "f8"), ("gyro", "f4", (3,)), ("ax", "i2")])
    np.save(stream, rng.choice((rows, rows[:, 0], rows.T, named)))
    return mutated_bytes(rng, stream.getvalue())


def read_as_people_do(rng: random.Random, path: Path) -> Any:
    options: dict[str, Any] = {}
    if rng.random() < 0.5:
        options["rate"] = rng.choice((100, 100, 100, 100, 99.99, 1e-3, 5e8))
    if rng.random() < 0.9:
        options["units"] = SI if rng.random() < 0.95 else {"gyro": rng.choice(HOSTILE)}
    if rng.random() < 0.1:
        options["channels"] = {rng.choice(("gyro_x", "accel_y", *HOSTILE[18:30])): rng.randrange(8)}
    if rng.random() < 0.3:
        options["time"] = rng.choice((False, False, False, 0, 3, "time_s"))
    found = gmwm.read(path, **options)
    assert found.source == gmwm.errors.printable(path.name)
    assert 0.0 < found.dt < np.inf
    assert found.n - min(channel.missing for channel in found.values()) >= 64
    for channel in found.values():
        assert channel.values.shape == (found.n,)
        assert channel.values.dtype == np.float64
        assert not np.any(np.isinf(channel.values))
    assert all(str(notice).isprintable() for notice in found.notices)
    str(found)
    return found


def load_and_show(rng: random.Random, path: Path) -> Any:
    found = gmwm.load(path)
    str(found), repr(found)
    json.dumps(found.to_dict())
    if isinstance(found, gmwm.Calibration) and rng.random() < 0.2:
        write_report(found, path.with_suffix(".html"))
        export(found, "kalibr", path=path.with_suffix(".yaml"))
    if isinstance(found, gmwm.FilterNumbers) and rng.random() < 0.2:
        export(found, rng.choice(sorted(TARGETS)))
    if isinstance(found, gmwm.FilterNumbers) and rng.random() < 0.05:
        gmwm.certify(gmwm.Calibration.from_dict(json.loads(documents()[0])), found)
    return found


def make_store(rng: random.Random, folder: Path) -> Path:
    store = folder / "runs"
    store.mkdir(exist_ok=True)
    for part in store.iterdir():
        part.unlink()
    do_runs(values_of_run, 3, {"seed": 1}, folder=store)
    (part,) = store.glob("part-*.npz")
    part.write_bytes(zipped(rng) if rng.random() < 0.2 else mutated_bytes(rng, part.read_bytes()))
    return store


def values_of_run(run: int) -> dict[str, Any]:
    return {"number": float(run), "rows": np.arange(3.0) * run, "name": f"run {run}"}


def resumed(_: random.Random, path: Path) -> Any:
    return do_runs(values_of_run, 4, {"seed": 1}, folder=path)


def make_field(rng: random.Random, folder: Path) -> Path:
    rows = np.column_stack([0.01 * np.arange(96), noise() * [1, 1, 1, 1, 1, -1]])
    (folder / "imu.csv").write_bytes(table(rng, f"time_s,{AXES}", rows))
    (folder / "fixes.csv").write_bytes(fixes(rng))
    return file_of("field.yaml", lambda rng: yaml_text(rng, FIELD))(rng, folder)


@cache
def fleet_outputs() -> tuple[Path, Path]:
    """Recordings of three units, and the folder of their fleet."""
    folder = Path(tempfile.mkdtemp(prefix="fuzz-fleet-"))
    atexit.register(shutil.rmtree, folder, True)
    for i in range(3):
        np.savez(folder / f"unit{i}.npz", gyro_x=1e-3 * np.random.default_rng(i).normal(size=200))
    gmwm.fleet(str(folder / "*.npz"), folder=folder / "out", **QUICK)
    return folder, folder / "out"


def make_fleet(rng: random.Random, folder: Path) -> Path:
    """A fleet's folder with something damaged in it."""
    _, whole = fleet_outputs()
    own = folder / "out"
    shutil.rmtree(own, ignore_errors=True)
    shutil.copytree(whole, own)
    path = rng.choice(sorted(each for each in own.rglob("*") if each.is_file()))
    if path.suffix == ".json":
        path.write_bytes(mutated_json(rng, path.read_text()))
    else:
        path.write_bytes(formats.damaged(rng, path.read_bytes()))
    return own


def fleet_resumed(rng: random.Random, path: Path) -> Any:
    if rng.random() < 0.5:
        return str(gmwm.Fleet.load(path))
    lot, _ = fleet_outputs()
    return gmwm.fleet(str(lot / "*.npz"), folder=path, resume=True, **QUICK)


def make_checkpoint(rng: random.Random, folder: Path) -> Path:
    stream = gmwm.StreamingVariance(0.01, SI_AXES if rng.random() < 0.5 else None)
    values = noise(rng.choice((1, 64, 700)))[:, : 2 if stream.channels else 1]
    stream.update(values if stream.channels else values[:, 0])
    path = stream.save(folder / "checkpoint.npz")
    if rng.random() < 0.5:
        path.write_bytes(formats.damaged(rng, path.read_bytes()))
        return path
    with np.load(path) as stored:
        arrays = dict(stored)
    for _ in range(rng.choice((1, 1, 3))):
        name = rng.choice(sorted(name for name, each in arrays.items() if each.size))
        values = arrays[name].reshape(-1)
        ends = (0, 1, 2, -1, 63, 5000, 10**9, 2**31, 2**62, -(2**63))
        with np.errstate(all="ignore"), suppress(ValueError):
            values[rng.randrange(values.size)] = rng.choice(
                ends if values.dtype == int else HOSTILE
            )
        if rng.random() < 0.1:
            arrays[name] = arrays[name].reshape(-1)[: rng.randrange(4)]
    np.savez(path, **arrays)
    return path


def gone_on(_: random.Random, path: Path) -> Any:
    stream = gmwm.StreamingVariance.load(path)
    width = max(len(stream.channels), 1)
    stream.update(noise()[:, :width] if stream.channels else noise()[:, 0])
    stream.results()
    str(stream)
    return stream


SI_AXES = {"gyro_x": "rad/s", "accel_x": "m/s^2"}
ODD = ("square", "decades", "tiny", "constant", "alternating", "spike", "steps", "sine", "huge",
       "integers", "ramp", "missing", "half", "denormal", "impulses", "stairs", "cauchy")  # fmt: skip


def odd_series(rng: random.Random, kind: str, n: int) -> np.ndarray:
    """A channel that no sensor should give, and some do."""
    random_ = np.random.default_rng(rng.randrange(1 << 30))
    k, x = np.arange(n), random_.normal(size=n)
    period = rng.choice((2, 7, 64, 200))
    return {
        "square": np.where(k // period % 2, 1.0, -1.0) * rng.choice((1.0, 1e-12, 1e9)),
        "decades": 10.0 ** random_.uniform(-10, 10, n),
        "tiny": 1e-200 * x,
        "constant": np.full(n, rng.choice((0.0, 1.0, 1e-300, 1e100))),
        "alternating": np.where(k % 2, 1.0, -1.0),
        "spike": np.where(k == n // 2, rng.choice((1.0, 1e100, 1e-30)), 0.0),
        "steps": np.floor(4.0 * k / n),
        "sine": np.sin(2.0 * np.pi * k / rng.choice((2.0, 3.0, 50.5, n))),
        "huge": 1e140 * x,
        "integers": np.round(x),
        "ramp": k * 1e-3,
        "missing": np.where(random_.random(n) < 0.45, np.nan, x),
        "half": np.where(k < n // 2, 0.0, x),
        "denormal": 5e-324 * np.round(3 * x),
        "impulses": np.where(k % period, 0.0, 1.0),
        "stairs": np.repeat(x, period)[:n],
        "cauchy": random_.standard_cauchy(n),
    }[kind]


def make_odd(rng: random.Random, folder: Path) -> Path:
    n = rng.choice((64, 130, 700, 2048))
    ordinary = 1e-3 * np.random.default_rng(2).normal(size=n)
    first, second = rng.choice(ODD), rng.choice(ODD)
    path = folder / "odd.npz"
    with np.errstate(all="ignore"):
        np.savez(path, gyro_x=odd_series(rng, first, n), accel_x=odd_series(rng, second, n),
                 gyro_y=ordinary, rate=rng.choice((100.0, 1e-3, 1e6)))  # fmt: skip
    return path


def examine_and_calibrate(rng: random.Random, path: Path) -> Any:
    given = gmwm.read(path, units=SI)
    str(health(given))
    model = rng.choice((None, gmwm.WhiteNoise() + gmwm.RandomWalk()))
    found = gmwm.calibrate(given, model)
    assert "gyro_y" in found, "an odd channel spoilt another"
    json.dumps(found.to_dict(), allow_nan=False)
    path = found.save(path.with_name("calibration.json"))
    return load_and_show(rng, path)


KINDS = {
    "text": Kind(20, file_of("a.csv", lambda rng: mutated_text(rng, recording(rng))), read_as_people_do),
    "gzip": Kind(8, file_of("a.csv.gz", packed), read_as_people_do),
    "npy": Kind(8, file_of("a.npy", binary), read_as_people_do),
    "npz": Kind(10, file_of("a.npz", zipped), read_as_people_do),
    "document": Kind(
        24, file_of("a.json", lambda rng: mutated_json(rng, rng.choice(documents()))), load_and_show
    ),
    "imu": Kind(
        4, file_of("i.csv", lambda rng: mutated_text(rng, recording(rng))),
        lambda rng, path: read_imu_log(path, rate=rng.choice((None, 100.0)), units=SI),
    ),
    "fixes": Kind(
        6, file_of("f.csv", lambda rng: mutated_text(rng, fixes(rng))),
        lambda rng, path: read_fix_log(path),
    ),
    "trajectory": Kind(
        6, file_of("t.csv", lambda rng: mutated_text(rng, trajectory(rng))),
        lambda rng, path: read_log(path),
    ),
    "study": Kind(
        5, file_of("study.yaml", lambda rng: yaml_text(rng, STUDY)),
        lambda rng, path: experiment_from(read_document(path), path.parent),
    ),
    "field": Kind(5, make_field, lambda rng, path: Measured.of(read_document(path), path.parent)),
    "store": Kind(4, make_store, resumed),
    "odd": Kind(0.3, make_odd, examine_and_calibrate),
    "ulog": Kind(7, partial(formats.make, formats.ulog), formats.read),
    "ardupilot": Kind(7, partial(formats.make, formats.ardupilot), formats.read),
    "mat": Kind(7, partial(formats.make, formats.mat), formats.read),
    "mat73": Kind(4, partial(formats.make, partial(formats.hdf5, is_mat=True)), formats.read),
    "hdf5": Kind(5, partial(formats.make, formats.hdf5), formats.read),
    "parquet": Kind(6, partial(formats.make, partial(formats.arrow, "parquet")), formats.read),
    "feather": Kind(4, partial(formats.make, partial(formats.arrow, "feather")), formats.read),
    "bag1": Kind(6, partial(formats.make, partial(formats.bag, "1")), formats.read),
    "sqlite3": Kind(5, partial(formats.make_bag2, "SQLITE3"), formats.read),
    "mcap": Kind(6, partial(formats.make_bag2, "MCAP"), formats.read),
    "records": Kind(5, formats.make_records, formats.read),
    "numbers": Kind(
        8, make_numbers, lambda rng, path: read_numbers(path, rng.choice((None, 100.0)))
    ),
    "datasheet": Kind(
        4, file_of("sheet.yaml", lambda rng: yaml_text(rng, DATASHEET)),
        lambda rng, path: read_datasheet(path, dict(gyro_x="gyro", accel_x="accel")),
    ),
    "checkpoint": Kind(4, make_checkpoint, gone_on),
    "fleet": Kind(1, make_fleet, fleet_resumed),
}  # fmt: skip


# -- running --------------------------------------------------------------------------------------


@dataclass
class Tally:
    """What became of the inputs of a kind."""

    outcomes: Counter[str] = field(default_factory=Counter)
    slowest: float = 0.0
    total: float = 0.0
    largest: int = 0

    def add(self, outcome: str, seconds: float, size: int) -> None:
        self.outcomes[outcome] += 1
        self.slowest, self.total = max(self.slowest, seconds), self.total + seconds
        self.largest = max(self.largest, size)

    @property
    def failures(self) -> int:
        return sum(self.outcomes[each] for each in ("failed", TOO_LARGE))

    def __str__(self) -> str:
        counts = ", ".join(f"{count:,} {outcome}" for outcome, count in self.outcomes.items())
        return (
            f"{counts}; {self.total:.0f} s, one at most {self.slowest:.2f} s and "
            f"{self.largest / (1 << 30):.2f} GB"
        )


class TooSlowError(Exception):
    """An input that takes too long."""


def _too_slow(*_: Any) -> None:
    raise TooSlowError(f"more than {SECONDS} s")


def _peak(*, begin: bool = False) -> int:
    """Bytes that the process held at most since the last beginning, where Linux counts them."""
    with suppress(OSError, StopIteration):
        if begin:
            Path("/proc/self/clear_refs").write_text("5")
        lines = Path("/proc/self/status").read_text().splitlines()
        return int(next(line.split()[1] for line in lines if line.startswith("VmHWM"))) << 10
    return 0


def attempt(name: str, seed: int, case: int, folder: Path) -> str | None:
    """Use one input; the sentence of a refusal, or ``None``.

    Raises
    ------
    Exception
        Where it is neither used nor refused in a sentence.
    """
    kind, rng = KINDS[name], random.Random(f"{seed}/{name}/{case}")
    path = kind.make(rng, folder)
    # Of this process: another's work is not counted.
    signal.signal(signal.SIGPROF, _too_slow)
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", gmwm.FitWarning)
            kind.use(rng, path)
    except gmwm.InputError as error:
        text = str(error)
        assert text.isprintable(), f"not one line: {text!r}"
        assert 10 < len(text) < LONGEST, text
        return text
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
    return None


def run(names: list[str], cases: int, seed: int, first: int = 0) -> dict[str, Tally]:
    """Many inputs of all kinds, in proportion to their shares; prints each failure."""
    tallies = {}
    failures: Counter[str] = Counter()
    total = sum(KINDS[name].share for name in names)
    for name in names:
        tally = tallies[name] = Tally()
        with tempfile.TemporaryDirectory() as folder:
            for case in range(first, first + max(round(cases * KINDS[name].share / total), 1)):
                start, outcome, held = time.process_time(), "refused", _peak(begin=True)
                try:
                    outcome = (
                        "used" if attempt(name, seed, case, Path(folder)) is None else "refused"
                    )
                except Exception as error:  # whatever is no InputError is what is looked for
                    outcome = "failed"
                    where = traceback.extract_tb(error.__traceback__)[-1]
                    which = f"{type(error).__name__} {Path(where.filename).name}:{where.lineno}"
                    failures[which] += 1
                    if failures[which] == 1:
                        text = f"--only {name} --seed {seed} --first {case}: {which}: {error}"[:500]
                        print(text, flush=True)
                seconds, size = time.process_time() - start, max(_peak() - held, 0)
                if size > BYTES:
                    outcome = TOO_LARGE
                    print(f"--only {name} --seed {seed} --first {case}: {size:,} bytes", flush=True)
                tally.add(outcome, seconds, size)
        print(f"{name}: {tally}", flush=True)
    for which, count in failures.most_common():
        print(f"{count:6} x {which}")
    return tallies


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--only", choices=sorted(KINDS), action="append")
    given = parser.parse_args()
    logging.disable()
    names = given.only or list(KINDS)
    tallies = run(names, given.cases, given.seed, given.first).values()
    total = sum(sum(each.outcomes.values()) for each in tallies)
    failures = sum(each.failures for each in tallies)
    seconds, largest = sum(each.total for each in tallies), max(each.largest for each in tallies)
    print(
        f"{total:,} inputs, {failures} failures, {total / max(seconds, 1e-9):.0f} cases a second, "
        f"{largest / (1 << 30):.2f} GB at most"
    )
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
