"""Models, curves and numbers for a filter as the file of the program that takes them, and back."""

import os
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from scipy.linalg import expm, logm

from gmwm._core import checks
from gmwm._core.files import content_of, moved_into_place, toml_beside, writable_file, write_text
from gmwm._core.typing import FloatArray
from gmwm._core.units import SI_UNIT
from gmwm.calibration import BiasCurve, Calibration
from gmwm.errors import InputError
from gmwm.export.imu import NO_RATE, in_motion, not_valid, numbers_of, reason
from gmwm.export.target import (
    ImuFile,
    JsonFile,
    MemoryKeys,
    Pair,
    Target,
    WalkKeys,
    comment,
    compiled_template,
    entries,
    json_text,
    not_valid_line,
    plain,
    wrapped,
)
from gmwm.filter_numbers import FORMS, FilterNumbers
from gmwm.motion import InMotion
from gmwm.process import Model, Process, StateSpace, block_diagonal

Matrices = dict[str, FloatArray]
"""F, G, H, Q, R, mean x0 and covariance P0 of the start."""

_AT = ("discrete", "continuous")


class StateSpaceFile(Target):
    """Needs one sensor at least and holds any model; a form makes the numbers of that form."""

    def export(self, given: Sequence[Any], horizon: float | None, form: str | None) -> str:
        return self._text(self._channels(given, horizon, form), given)

    def explain(
        self, given: Sequence[Any], horizon: float | None = None, form: str | None = None
    ) -> str:
        return "\n".join(line for text in self.about() for line in wrapped(text)) + "\n"

    def _text(self, channels: dict[str, dict[str, Any]], given: Sequence[Any]) -> str:
        lines = [line for text in (self.convention, self.caution) for line in wrapped(text)]
        invalid = {name: reason(each) for name, each in not_valid(given).items()}
        lines += [not_valid_line(invalid)] if invalid else []
        content: dict[str, Any] = {"comment": lines}
        content["channels"] = {
            name: {
                key: {k: v.tolist() for k, v in value.items()} if key in _AT and value else value
                for key, value in each.items()
            }
            for name, each in channels.items()
        }
        return json_text(content) + "\n"

    def save(
        self, path: str | os.PathLike[str], given: Sequence[Any], horizon: float | None, form: Any
    ) -> str:
        if Path(path).suffix != ".npz":
            return super().save(path, given, horizon, form)
        channels = self._channels(given, horizon, form)
        arrays: dict[str, Any] = {}
        for name, each in channels.items():
            arrays[f"{name}/dt"] = each["dt"]
            arrays[f"{name}/states"] = np.array(each["states"], dtype=np.str_)
            for kind in _AT:
                arrays |= {f"{name}/{kind}/{key}": v for key, v in (each[kind] or {}).items()}
        with moved_into_place(path) as temporary, open(temporary, "wb") as stream:
            np.savez(stream, **arrays)
        return self._text(channels, given)

    def _channels(
        self, given: Sequence[Any], horizon: float | None, form: str | None
    ) -> dict[str, dict[str, Any]]:
        """Matrices by channel."""
        if form is not None:
            checks.choice("form", form, FORMS)
        found: dict[str, dict[str, Any]] = {}
        for each in given:
            models: dict[str, tuple[Model, float, str, float]]
            if isinstance(each, Calibration) and form is None:
                if horizon is not None:
                    raise InputError(
                        "the full model has no horizon: leave the horizon out, or give a form too"
                    )
                models = {n: (f.model, f.wv.dt, f.wv.quantity or "", 0.0) for n, f in each.items()}
            else:
                wanted = form or (each.form if isinstance(each, FilterNumbers) else "")
                numbers = numbers_of(each, wanted, horizon)
                if not numbers.rate > 0.0:
                    raise InputError(NO_RATE)
                dt = 1.0 / numbers.rate
                models = {n: (o.model, dt, o.quantity, o.initial_sd) for n, o in numbers.items()}
            for name, about in models.items():
                if name in found:
                    raise InputError(f"{name} is given twice: give each sensor once")
                try:
                    found[name] = channel(*about)
                except InputError as error:
                    raise InputError(f"{name}: {error}") from None
        return found


def channel(model: Model, dt: float, quantity: str, initial_sd: float = 0.0) -> dict[str, Any]:
    """Matrices of one channel in discrete and, if there is one, continuous form.

    Returns: ``continuous`` is ``None`` where a term is defined for samples only.
    Raises InputError if a term has no state space.
    """
    parts = [term.state_space(dt) for term in model.terms]
    starts = [
        part.initial_covariance + (initial_sd**2 if term.is_walk else 0.0)
        for term, part in zip(model.terms, parts, strict=True)
    ]
    whole = StateSpace.stack(parts)
    common: Matrices = {
        "H": whole.output[None, :],
        "x0": whole.initial_mean,
        "P0": block_diagonal(starts),
    }
    discrete = {
        **_driven(whole.transition, whole.process_noise),
        **common,
        "R": np.array([[whole.measurement_noise]]),
    }
    pairs = [continuous(term, part, dt) for term, part in zip(model.terms, parts, strict=True)]
    rates: Matrices | None = None
    known = [pair for pair in pairs if pair is not None]
    if len(known) == len(pairs):
        drift, density = (block_diagonal([pair[i] for pair in known]) for i in (0, 1))
        rates = {**_driven(drift, density), **common, "R": np.array([[model.white_density()]])}
    return {
        "unit": SI_UNIT.get(quantity, "u"),
        "model": repr(model),
        "dt": dt,
        "states": list(whole.names),
        "approximate": not all(term.has_finite_state_space for term in model.terms),
        "discrete": discrete,
        "continuous": rates,
    }


def continuous(term: Process, part: StateSpace, dt: float) -> tuple[FloatArray, FloatArray] | None:
    """F and G Q G' in continuous time that give a term's samples, if there are any.

    F = log(transition)/dt, and Q solves transition noise = integral of exp(F s) Q exp(F' s) over
    a step, linear in Q: vec(noise) = integral of exp((F + F) s) ds vec(Q) with the Kronecker sum
    (Van Loan 1978, *IEEE Trans. Autom. Control* 23(3), 395-404).
    """
    p = part.n_states
    if p == 0:
        return np.zeros((0, 0)), np.zeros((0, 0))
    roots = np.linalg.eigvals(part.transition)
    if np.any((roots.real <= 0.0) & (np.abs(roots.imag) < 1e-12)):
        return None  # a difference or an alternating sequence: it lives on samples
    drift = np.real(logm(part.transition)) / dt
    total = np.kron(drift, np.eye(p)) + np.kron(np.eye(p), drift)
    block = np.block([[total, np.eye(p * p)], [np.zeros((p * p, 2 * p * p))]])
    integral = expm(block * dt)[: p * p, p * p :]
    density = np.linalg.solve(integral, part.process_noise.ravel()).reshape(p, p)
    density = 0.5 * (density + density.T)
    scale = float(np.max(np.abs(density)))
    lowest = float(np.linalg.eigvalsh(density)[0])
    if lowest < -1e-6 * scale:
        return None
    # Rounding leaves traces where nothing drives.
    return drift, np.where(np.abs(density) < 1e-9 * scale, 0.0, density)


def _driven(transition: FloatArray, noise: FloatArray) -> Matrices:
    """F, and the noise of those states only that have some."""
    driven = np.diag(noise) > 0.0
    return {"F": transition, "G": np.eye(len(noise))[:, driven], "Q": noise[np.ix_(driven, driven)]}


_LETTERS = "xyz"
_CUBIC = 3

Curves = Mapping[str, BiasCurve]


@dataclass(frozen=True)
class CurveFile:
    """A file of curves.

    title, file_name: The program, and how the file is called.
    convention: What its values are.
    source: Where the program's own source says so.
    template: Of the file below the comments, of Jinja.
    mark: What a comment begins with.
    """

    title: str
    file_name: str
    convention: str
    template: str
    source: str = ""
    mark: str = "#"

    def text(self, given: Sequence[Any]) -> str:
        """The file of calibrations.

        Raises InputError if they have no curves, or some that the file cannot hold.
        """
        found: dict[str, BiasCurve] = {}
        for each in given:
            found |= each.curves if isinstance(each, Calibration) else {}
        curves = {name: each for name, each in found.items() if each.degree > 0}
        if not curves:
            raise InputError(
                f"{self.title} needs curves of a covariate: calibrate with "
                'covariates={"temperature": "auto"}'
            )
        sources = ", ".join(dict.fromkeys(each.source for each in given if each.source))
        lines = wrapped(plain(f"{self.title}: {sources or 'a recording'}"))
        lines += wrapped(self.convention)
        invalid = {name: reason(each) for name, each in not_valid(given).items()}
        lines += [not_valid_line(invalid)] if invalid else []
        if lost := sorted({r.title for c in curves.values() for r in c.regressors if r.constant}):
            lines += wrapped(f"left out, as at a steady temperature: {', '.join(lost)}")
        body = compiled_template(self.template).render(
            curves=curves,
            triads=partial(_triads, curves),
            powers=_powers,
            rows=lambda curve: [
                ",".join(f"{each:.9g}" for each in row) for row in zip(*curve.band(), strict=True)
            ],
            polynomial=_polynomial,
            identifier=partial(re.sub, r"\W", "_"),
        )
        return "\n".join([*comment(lines, self.mark), body.rstrip("\n")]) + "\n"

    def about(self) -> str:
        return (
            "\n".join([*wrapped(f"{self.title}: {self.convention}"), *wrapped(self.source)]) + "\n"
        )


def _triads(curves: Curves) -> dict[str, tuple[list[BiasCurve], float, float]]:
    """By sensor the curves of x, y and z, and the range that they have in common, degC."""
    found = {}
    for quantity in ("gyro", "accel"):
        own = {name[-1]: each for name, each in curves.items() if each.quantity == quantity}
        if not own:
            continue
        if missing := [letter for letter in _LETTERS if letter not in own]:
            raise InputError(f"{quantity}_{missing[0]} has no curve: calibrate all three axes")
        for each in own.values():
            if each.main is None or each.main.unit != "degC":
                raise InputError(
                    f"the curve of {each.name} is not against degC: calibrate with a temperature"
                )
            if each.degree > _CUBIC:
                raise InputError(
                    f"the curve of {each.name} has degree {each.degree}, above the 3 of these "
                    "parameters: calibrate with degree 3"
                )
        axes = [own[letter] for letter in _LETTERS]
        ranges = [each.main for each in axes if each.main is not None]
        low, high = max(one.low for one in ranges), min(one.high for one in ranges)
        found[quantity] = axes, low, high
    return found


def _powers(curve: BiasCurve, reference: float) -> list[float]:
    powers = curve.polynomial(reference)
    return [float(value) for value in np.pad(powers, (0, _CUBIC + 1 - powers.size))]


def _polynomial(curve: BiasCurve) -> str:
    """A polynomial in d = x - centre by Horner's rule."""
    text = ""
    for value in curve.polynomial()[::-1]:
        text = f"{float(value):.12g}" + (f" + d * ({text})" if text else "")
    return text


_CURVES = toml_beside(Path(__file__).with_name("curves"))
CURVES: Mapping[str, CurveFile] = MappingProxyType(
    {name: CurveFile(**content) for name, content in _CURVES.items()}
)
"""Files of curves by name."""


def curve_files(calibration: Calibration) -> list[str]:
    """Names of the files that can hold the curves of a calibration."""
    found = []
    for name, each in CURVES.items():
        with suppress(InputError):
            each.text([calibration])
            found.append(name)
    return found


_KINDS = {"json": JsonFile, "state-space": StateSpaceFile}


def _target(name: str, content: dict[str, Any]) -> Target:
    """A consumer as export.toml describes it."""
    kind = _KINDS.get(content.pop("kind", ""), ImuFile)
    for given, keys in (("walk_keys", WalkKeys), ("memory_keys", MemoryKeys)):
        if given in content:
            content["keys"] = keys(**_fixed(content.pop(given)))
    return kind(name, **{"file_name": f"{name}.yaml", **_fixed(content)})


def _fixed(content: dict[str, Any]) -> dict[str, Any]:
    return {key: tuple(each) if isinstance(each, list) else each for key, each in content.items()}


TARGETS: Mapping[str, Target] = MappingProxyType(
    {name: _target(name, content) for name, content in toml_beside(__file__).items()}
)
"""Every consumer by name."""

Source = Calibration | FilterNumbers | InMotion

_RATES = ("update_rate", "IMU.Frequency")
"""Keys of the rate of the IMU in files."""


def export(
    numbers: Source | Sequence[Source],
    target: str,
    *,
    horizon: float | None = None,
    interval: float | None = None,
    form: str | None = None,
    path: str | os.PathLike[str] | None = None,
) -> str:
    """Numbers for a small filter in the form that a program reads; see `TARGETS`.

    Or, for names of `CURVES` such as "px4-tc", the curves of the bias against the temperature.

    Parameters
    ----------
    numbers : Calibration, FilterNumbers, InMotion, or a sequence of them
        Of a calibration, those of `gmwm.bound` are written; those of `gmwm.reduce` if it has a
        random walk and the program has no place for one. Of noise in motion, `InMotion.numbers`
        from the interval to the horizon, the largest of all IMUs. Several together make one IMU,
        such as gyros and accelerometers of different rates.
    target : str
        Name of the program: "kalibr", "gtsam", ...
    horizon : float, optional
        Longest outage that the numbers are for, s; 60 s by default, 1 s in motion.
    interval : float, optional
        Shortest time between updates, s, for noise in motion; 0.1 s by default.
    form : str, optional
        Of the numbers, "N+K" or "N+GM"; each program holds one. For "state-space", which holds the
        full model, also another: see `gmwm.bound`.
    path : path-like, optional
        The file to write; "state-space" also writes NPZ, by suffix.

    Returns
    -------
    str
        The text of the file.

    Raises
    ------
    InputError
        If the program is not known, a sensor is missing, the numbers do not fit, or the file
        cannot be written.
    """
    checks.choice("target", target, (*TARGETS, *CURVES))
    given: list[Any] = list(numbers) if isinstance(numbers, Sequence) else [numbers]
    if target in CURVES:
        text = CURVES[target].text(given)
        if path is not None:
            write_text(writable_file(path), text)
        return text
    chosen, given = TARGETS[target], in_motion(given, horizon, interval)
    if path is None:
        return chosen.export(given, horizon, form)
    return chosen.save(writable_file(path), given, horizon, form)


def read_numbers(
    path: str | os.PathLike[str], rate: float | None = None
) -> dict[str, Pair | Model]:
    """The numbers of gyro and accelerometer in a program's file.

    path: Of a program of `TARGETS` that has keys: Kalibr, OpenVINS, GTSAM, PX4 and others.
    rate: Of the IMU, Hz, for programs whose numbers depend on it; by default the file's own.
    Returns: "gyro" and "accel", or each of the axes ("gyro_x" to "accel_z") where they differ -> N
        (u/sqrt(Hz)) and K (u/s/sqrt(Hz)), or a model with a Gauss-Markov process.
    """
    values, ambiguous = entries(content_of(path).decode("utf-8-sig", errors="replace"))
    layouts = {each.keys: None for each in TARGETS.values() if each.keys}
    keys = next((each for each in layouts if any(name in values for name in each.names)), None)
    if keys is None:
        known = "; ".join(", ".join(each.names[:2]) for each in layouts)
        raise InputError(f"{path}: has no noise parameters of a known name ({known}): give N and K")
    for name in keys.names:
        if name not in values:
            raise InputError(f"{path}: {name} is missing: add it")
        if name in ambiguous:
            raise InputError(f"{path}: {name} has several values: keep those of one IMU")
        if not np.all(values[name] > 0.0):
            raise InputError(f"{path}: {name} = {values[name][0]:g}: give a positive number")
    own_rate = next((float(values[key][0]) for key in _RATES if key in values), 0.0)
    try:
        found = keys.read(values, rate or own_rate)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    return {
        f"{kind}_{letter}" if letter else kind: item
        for kind, items in zip(("gyro", "accel"), found, strict=True)
        for letter, item in zip("xyz" if len(items) == 3 else ("",), items, strict=True)
    }
