"""Matrices of the full model of every channel, continuous and discrete, as JSON or NPZ.

Discrete: x[k+1] = F x[k] + G w[k], y[k] = H x[k] + v[k] with covariances Q of w and R of v.
Continuous: dx/dt = F x + G w, y = H x + v with spectral densities Q and R.
"""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import expm, logm

from gmwm._core import checks
from gmwm._core.files import moved_into_place
from gmwm._core.typing import FloatArray
from gmwm._core.units import SI_UNIT
from gmwm.calibration import Calibration
from gmwm.errors import InputError
from gmwm.export.imu import NO_RATE, not_valid, numbers_of, reason
from gmwm.export.target import Target, json_text, not_valid_line, wrapped
from gmwm.filter_numbers import FORMS, FilterNumbers
from gmwm.process import Model, Process, StateSpace, block_diagonal

Matrices = dict[str, FloatArray]
"""F, G, H, Q, R, mean x0 and covariance P0 of the start."""

_KINDS = ("discrete", "continuous")


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
                key: {k: v.tolist() for k, v in value.items()} if key in _KINDS and value else value
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
            for kind in _KINDS:
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

    model: With given parameters.
    dt: Sampling interval, s.
    initial_sd: Standard deviation at the start of a random walk, u.
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
