"""What the horizon of filter numbers costs a filter that is aided, by exact covariance analysis.

    python benchmarks/aided.py calibration.json [...] [--horizons 1 10 60]
    python benchmarks/aided.py calibration.json [...] --best

A horizontal channel: position, velocity, tilt, driven by a gyro and an accelerometer with their
error models, and aided by positions. After 900 s of aiding it goes on without. For each aiding,
filters with N and K of `gmwm.bound` for several horizons, one value for the axes of a sensor as
files have them, are compared with the filter that has the full models: the table has the ranges,
over calibrations, pairs of axes and 0, 1, 10 and 60 s after the aiding ends, of the ratios of
position errors, true and predicted, to the true errors of that filter.

Terms that average out within a second are white noise of their density at low frequencies in the
truth; slower terms are its states. The filter with the full models leaves out vibration lines, as
the others do.

``--best`` searches the N and K of gyro and accelerometer whose largest true ratio at those times is
least: no N+K can do better, however it is found.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

import gmwm
from gmwm import Model, RandomWalk, WhiteNoise
from gmwm.calibration import fast_density

GRAVITY = 9.81
AIDINGS = {
    "GNSS 1 Hz, 1 m": (1.0, 1.0),
    "LIO 10 Hz, 3 cm": (0.1, 0.03),
    "VIO 20 Hz, 2 mm": (0.05, 0.002),
}
"""Interval of positions in s, and their standard deviation in m."""

STEPS = {"GNSS 1 Hz, 1 m": 0.1, "LIO 10 Hz, 3 cm": 0.1, "VIO 20 Hz, 2 mm": 0.05}
"""s: of the propagation."""

AIDED, AFTER = 900.0, (0.0, 1.0, 10.0, 60.0)  # s
PAIRS = (("gyro_x", "accel_y"), ("gyro_y", "accel_x"))


@dataclass(frozen=True)
class Channel:
    """A linear system whose state begins with position, velocity and tilt.

    transition, noise: (p, p), of one step.
    initial: (p, p).
    """

    transition: np.ndarray
    noise: np.ndarray
    initial: np.ndarray


def channel(gyro: Model, accel: Model, step: float, start: tuple[float, float]) -> Channel:
    """The channel with the errors of two sensors as states; ``start``: sd of constant biases."""
    transition = np.array([[1.0, step, 0.0], [0.0, 1.0, GRAVITY * step], [0.0, 0.0, 1.0]])
    noise = np.zeros((3, 3))
    initial = np.diag([10.0, 1.0, 0.02]) ** 2
    for model, row, sd in ((accel, 1, start[1]), (gyro, 2, start[0])):
        density = fast_density(model, step / 10.0)
        fast = [fast_density(Model((term,)), step / 10.0) > 0.0 for term in model.terms]
        parts = [t for t, is_fast in zip(model.terms, fast, strict=True) if not is_fast]
        states = [part.state_space(step) for part in parts]
        states = [s for s in states if s.n_states]
        size, own = len(transition), sum(s.n_states for s in states)
        grown = np.eye(size + own)
        grown[:size, :size] = transition
        noise, initial = (np.pad(each, (0, own)) for each in (noise, initial))
        noise[row, row] += density * step
        at = size
        for s in states:
            here = slice(at, at + s.n_states)
            grown[here, here] = s.transition
            grown[row, here] = step * s.output
            noise[here, here] = s.process_noise
            initial[here, here] = s.initial_covariance
            at += s.n_states
        if own:
            initial[size, size] += sd**2
        transition = grown
    return Channel(transition, noise, initial)


def without_lines(model: Model) -> Model:
    """The model without its periodic lines."""
    return Model(tuple(term for term in model.terms if not term.is_line))


def errors(
    truth: Channel, belief: Channel, sd: float, every: int, step: float
) -> tuple[np.ndarray, np.ndarray]:
    """True and predicted standard deviations of the position at `AFTER`, m.

    The filter knows only `belief`. Its gains follow from its own covariance; the error of position,
    velocity and tilt, its other states and those of the truth make the joint covariance.
    """
    p, q = len(truth.transition), len(belief.transition)
    own, others = q - 3, p - 3
    joint = np.zeros((3 + own + others,) * 2)
    joint_noise, joint_start = joint.copy(), joint.copy()
    nav, mine, theirs = slice(0, 3), slice(3, q), slice(q, q + others)
    joint[nav, nav] = truth.transition[:3, :3]
    joint[nav, mine] = -belief.transition[:3, 3:]
    joint[nav, theirs] = truth.transition[:3, 3:]
    joint[mine, mine] = belief.transition[3:, 3:]
    joint[theirs, theirs] = truth.transition[3:, 3:]
    for target, source in ((joint_noise, truth.noise), (joint_start, truth.initial)):
        target[nav, nav] = source[:3, :3]
        target[theirs, theirs] = source[3:, 3:]
    covariance, actual = belief.initial, joint_start
    aided, total = round(AIDED / step), round((AIDED + AFTER[-1]) / step)
    wanted = {aided + round(after / step) for after in AFTER}
    found = []
    for k in range(total + 1):
        if k % every == 0 and k <= aided:
            gain = covariance[:, 0] / (covariance[0, 0] + sd**2)
            covariance = covariance - np.outer(gain, covariance[0])
            change = np.eye(len(joint))
            change[nav, 0] -= gain[:3]
            change[mine, 0] += gain[3:]
            moved = np.concatenate([-gain[:3], gain[3:], np.zeros(others)])
            actual = change @ actual @ change.T + sd**2 * np.outer(moved, moved)
        if k in wanted:
            found.append((actual[0, 0], covariance[0, 0]))
        covariance = belief.transition @ covariance @ belief.transition.T + belief.noise
        actual = joint @ actual @ joint.T + joint_noise
    result = np.sqrt(np.array(found)).T
    return result[0], result[1]


def numbers_of(
    calibration: gmwm.Calibration, form: str, horizon: float
) -> dict[str, tuple[Model, float]]:
    """Model and standard deviation of the bias at the start by channel."""
    bound = gmwm.bound(calibration, form, horizon=horizon, shared=form == "N+K")
    return {name: (each.model, each.initial_sd) for name, each in bound.items()}


def print_best(calibration: gmwm.Calibration) -> None:
    """Print the true ratios of `gmwm.bound` and `gmwm.reduce` for 60 s, and of the best N+K."""
    gyro, accel = PAIRS[0]
    models = calibration[gyro].model, calibration[accel].model
    found = {
        "bound": gmwm.bound(calibration, "N+K", 60.0, shared=True),
        "reduce": gmwm.reduce(calibration, "N+K", (60.0,), shared=True),
    }
    start = tuple(found["bound"][axis].initial_sd for axis in (gyro, accel))
    for name in AIDINGS:
        ratios = _true_ratios(models, name, start)
        given = {
            key: np.log([value for axis in (gyro, accel) for value in (each[axis].N, each[axis].K)])
            for key, each in found.items()
        }
        first = given["bound"]
        options = {
            "maxfev": 130,
            "xatol": 0.03,
            "fatol": 1e-3,
            "initial_simplex": np.vstack([first, first - np.diag([0.3, 1.0, 0.3, 1.0])]),
        }
        found_best = minimize(
            lambda x, f=ratios: np.max(f(x)), first, method="Nelder-Mead", options=options
        )
        given["best"] = found_best.x
        for key, logs in given.items():
            cells = "".join(f"{each:8.3f}" for each in ratios(logs))
            print(f"{calibration.source[:24]:<26}{name:<18}{key:<8}{cells}", flush=True)


def _true_ratios(models: tuple[Model, Model], name: str, start: tuple[float, float]):
    """Function of the logarithms of N and K of gyro and accelerometer: true ratios at `AFTER`."""
    (interval, sd), step = AIDINGS[name], STEPS[name]
    every = round(interval / step)
    truth = channel(*models, step, (0.0, 0.0))
    full = channel(*map(without_lines, models), step, (0.0, 0.0))
    least, _ = errors(truth, full, sd, every, step)

    def ratios(logs: np.ndarray) -> np.ndarray:
        N, K, n, k = np.exp(logs)
        own = WhiteNoise(N) + RandomWalk(K), WhiteNoise(n) + RandomWalk(k)
        return errors(truth, channel(*own, step, start), sd, every, step)[0] / least

    return ratios


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("files", nargs="+")
    parser.add_argument("--horizons", nargs="+", type=float, default=[1.0, 10.0, 60.0])
    parser.add_argument("--best", action="store_true")
    options = parser.parse_args()
    calibrations = [gmwm.load(file) for file in options.files]
    if options.best:
        print(f"true ratio after{'':<36}" + "".join(f"{f'{after:g} s':>8}" for after in AFTER))
        for calibration in calibrations:
            print_best(calibration)
        return
    choices = [("N+K", horizon) for horizon in options.horizons] + [("N+K+GM", 60.0)]
    print(f"{'aiding':<18}" + "".join(f"{f'{form} {t:g} s':^24}" for form, t in choices))
    print(f"{'':<18}" + f"{'true':^12}{'predicted':^12}" * len(choices))
    for name, (interval, sd) in AIDINGS.items():
        step = STEPS[name]
        every, ratios = round(interval / step), {choice: [] for choice in choices}
        for calibration in calibrations:
            given = {choice: numbers_of(calibration, *choice) for choice in choices}
            for gyro, accel in PAIRS:
                models = calibration[gyro].model, calibration[accel].model
                biases = [given["N+K", 60.0][axis][1] for axis in (gyro, accel)]
                truth = channel(*models, step, (0.0, 0.0))
                full = channel(*map(without_lines, models), step, (0.0, 0.0))
                best, _ = errors(truth, full, sd, every, step)
                for choice in choices:
                    own = [given[choice][axis] for axis in (gyro, accel)]
                    start = (own[0][1] or biases[0], own[1][1] or biases[1])
                    belief = channel(own[0][0], own[1][0], step, start)
                    true, predicted = errors(truth, belief, sd, every, step)
                    ratios[choice].append((true / best, predicted / best))
        cells = ""
        for choice in choices:
            for kind in (0, 1):
                all_ = np.array([each[kind] for each in ratios[choice]])
                cells += f"{f'{all_.min():.2f}-{all_.max():.2f}':^12}"
        print(f"{name:<18}{cells}", flush=True)


if __name__ == "__main__":
    main()
