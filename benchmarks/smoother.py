"""A factor graph of GTSAM with numbers by several rules: its NEES beside the certified one.

Run with ``python benchmarks/smoother.py [--runs 40] [--free] [--gravity 9.81] [--seed 0] [--truth
NAME] [--numbers RULE]``; the tables of docs/filter-numbers.md. An IMU at 100 Hz, moved as by hand,
and a relative pose every second for a minute (``KEYFRAME_SD``). All are smoothed at once, with
combined preintegration between keyframes. The trajectory is what the graph's own integration makes
of error-free samples: no error is left but those of the sensors. ``--free`` is an IMU that floats,
without gravity or motion, where each axis is alone, as in a certificate.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from textwrap import fill

import gtsam
import numpy as np
from gtsam.symbol_shorthand import B, V, X
from scipy.spatial.transform import Rotation

import gmwm
from gmwm import GaussMarkov, Model, RandomWalk, WhiteNoise
from gmwm.filter_numbers import Chain
from gmwm.filter_numbers.axes import SensorAxes
from gmwm.filter_numbers.tuning import KEYFRAME_SD, KEYFRAMES
from gmwm.ins import SensorModels
from gmwm.ins.sensors import AXES

DT, SECONDS = 0.01, 60
PER = round(1.0 / DT)
GRAVITY = 9.81
POSE_SD = np.repeat([KEYFRAME_SD["gyro"], KEYFRAME_SD["accel"]], 3)
START_SD = np.repeat([1e-3, 1e-3, 0.1], 3)  # attitude, position, velocity
TURN_ON = {"gyro": 1e-3, "accel": 2e-2}
TRUTHS = {
    "N + K": {
        "gyro": WhiteNoise(2e-4) + RandomWalk(3e-5),
        "accel": WhiteNoise(2e-3) + RandomWalk(3e-4),
    },
    "N + slow GM": {
        "gyro": WhiteNoise(2e-4) + GaussMarkov(4e-4, 60.0),
        "accel": WhiteNoise(2e-3) + GaussMarkov(4e-3, 100.0),
    },
    "N + 2 GM": {
        "gyro": WhiteNoise(2e-4) + GaussMarkov(1e-3, 0.5) + GaussMarkov(4e-4, 30.0),
        "accel": WhiteNoise(2e-3) + GaussMarkov(1e-2, 0.3) + GaussMarkov(4e-3, 60.0),
    },
    "N + 3 GM": {
        "gyro": WhiteNoise(1e-4) + GaussMarkov(5e-4, 1.0) + GaussMarkov(4e-4, 8.0)
        + GaussMarkov(4e-4, 300.0),
        "accel": WhiteNoise(1e-3) + GaussMarkov(5e-3, 0.5) + GaussMarkov(5e-3, 5.0)
        + GaussMarkov(5e-3, 200.0),
    },
}  # fmt: skip
RULES = ("Allan lines", "times ten", "bound", "reduce")
LINE = 1000.0  # s, where the line of slope +1/2 touches an Allan deviation
HEADS = ("attit.", "veloc.", "posit.", "gyro b", "acc. b",
         "turn", "cert.", "of runs", "step", "cert.", "of runs")  # fmt: skip


@dataclass(frozen=True)
class Motion:
    """Error-free samples, and the states at the keyframes that the graph makes of them."""

    rate: np.ndarray
    force: np.ndarray
    gravity: float
    states: list[gtsam.NavState]

    @classmethod
    def of(cls, seconds: int, free: bool, gravity: float = GRAVITY) -> Motion:
        """By hand, or none."""
        t = DT * (np.arange(PER * seconds) + 0.5)[:, None]
        gravity = 0.0 if free else gravity
        size = 0.0 if free else 1.0
        rate = size * 0.7 * np.sin(np.array([2.1, 1.7, 1.3]) * t + np.array([0.0, 1.0, 2.0]))
        moved = size * 1.5 * np.sin(np.array([1.9, 2.3, 1.1]) * t + np.array([0.5, 1.5, 2.5]))
        moved[:, 2] += gravity
        at, force = Rotation.identity(), np.empty_like(rate)
        for k in range(len(rate)):
            force[k] = at.inv().apply(moved[k])
            at = at * Rotation.from_rotvec(rate[k] * DT)
        params = parameters(dict.fromkeys(AXES, (1e-4, 1e-6)), gravity)
        state, states = gtsam.NavState(), [gtsam.NavState()]
        for k in range(seconds):
            state = preintegrated(params, rate, force, k).predict(
                state, gtsam.imuBias.ConstantBias()
            )
            states.append(state)
        return cls(rate, force, gravity, states)


def parameters(numbers: dict[str, tuple[float, float]], gravity: float):
    """Of combined preintegration, with N and K of each axis."""
    params = gtsam.PreintegrationCombinedParams.MakeSharedU(gravity)
    squares = np.square([numbers[axis] for axis in AXES])
    params.setGyroscopeCovariance(np.diag(squares[:3, 0]))
    params.setAccelerometerCovariance(np.diag(squares[3:, 0]))
    params.setBiasOmegaCovariance(np.diag(squares[:3, 1]))
    params.setBiasAccCovariance(np.diag(squares[3:, 1]))
    params.setIntegrationCovariance(1e-16 * np.eye(3))
    if hasattr(params, "setBiasAccOmegaInit"):
        params.setBiasAccOmegaInit(np.zeros((6, 6)))
    return params


def preintegrated(params, rate: np.ndarray, force: np.ndarray, k: int):
    """Samples from keyframe k to the next."""
    result = gtsam.PreintegratedCombinedMeasurements(params)
    for i in range(k * PER, (k + 1) * PER):
        result.integrateMeasurement(force[i], rate[i], DT)
    return result


def rules(truth: dict[str, Model]) -> dict[str, dict[str, tuple[float, float, float]]]:
    """N, K and the standard deviation of the bias at the start of each kind, by rule."""
    safe = gmwm.bound(truth, horizon=1.0, bias_sd=TURN_ON)
    small = gmwm.reduce(truth, keyframe=1.0, bias_sd=TURN_ON)
    tau = DT * 2.0 ** np.arange(24)
    lines = {}
    for kind, model in truth.items():
        deviation = np.sqrt(2.0 * model.haar_variance(tau, DT))
        N, end = np.interp(np.log([1.0, LINE]), np.log(tau), deviation)
        lines[kind] = (float(N), float(np.sqrt(3.0 / LINE) * end))
    start = {kind: safe[kind].initial_sd for kind in truth}
    return {
        "Allan lines": {q: (*lines[q], start[q]) for q in truth},
        "times ten": {q: (10.0 * lines[q][0], 10.0 * lines[q][1], start[q]) for q in truth},
        "bound": {q: (safe[q].N, safe[q].K, start[q]) for q in truth},
        "reduce": {q: (small[q].N, small[q].K, small[q].initial_sd) for q in truth},
    }


def certified(truth: dict[str, Model], rule: dict[str, tuple[float, float, float]]) -> list[float]:
    """NEES of turn and step by `gmwm.certify`."""
    found = gmwm.certify(truth, _models(rule), outages=(1.0,), keyframe=1.0, bias_sd=TURN_ON)
    return [check.nees for check in found.of("keyframes")]


def expected(truth: dict[str, Model], rule: dict[str, tuple[float, float, float]]) -> list[float]:
    """The same after as many keyframes as here."""
    models, result = _models(rule), []
    for axis in SensorAxes.of(truth, DT, TURN_ON).axes:
        chain = replace(Chain.of_poses(axis.quantity, 1.0), settled=SECONDS - 1.0)
        errors = chain.errors(axis.model, models[axis.name], DT, (1.0,), true_sd=axis.bias_sd,
                              believed_sd=rule[axis.name][2])  # fmt: skip
        result.append(float(errors.nees()[0]))
    return result


def _models(rule: dict[str, tuple[float, float, float]]) -> dict[str, Model]:
    return {q: WhiteNoise(N) + RandomWalk(K) for q, (N, K, _) in rule.items()}


def nees(motion: Motion, truth: SensorModels, rules_: dict, seed: int) -> dict[str, np.ndarray]:
    """Normalised errors squared per degree of freedom, by rule.

    Of attitude, velocity, position and biases at the last keyframe, and of the turn and of the
    step with the velocity to the next.
    """
    rng = np.random.default_rng(seed)
    seconds = len(motion.states) - 1
    errors = truth.simulate(PER * seconds, DT, rng)
    poses = [state.pose() for state in motion.states]
    noise = POSE_SD * rng.standard_normal((seconds - 1, 6))
    seen = [a.between(b).retract(e) for a, b, e in zip(poses, poses[1:], noise, strict=False)]
    first = START_SD * rng.standard_normal(9)
    start = poses[0].retract(first[:6]), first[6:]
    # The order of GTSAM's bias is accelerometer, gyro.
    bias = errors.slow[PER * (seconds - 1), [3, 4, 5, 0, 1, 2]]
    rate, force = motion.rate + errors.total[:, :3], motion.force + errors.total[:, 3:]
    found = {}
    for name, rule in rules_.items():
        params = parameters(
            {axis: rule[axis.partition("_")[0]][:2] for axis in AXES}, motion.gravity
        )
        sd = np.repeat([rule["accel"][2], rule["gyro"][2]], 3)
        graph = _graph(params, rate, force, seen, start, sd)
        values = gtsam.Values()
        for k, state in enumerate(motion.states):
            values.insert(X(k), state.pose())
            values.insert(V(k), state.velocity())
            values.insert(B(k), gtsam.imuBias.ConstantBias())
        values = gtsam.LevenbergMarquardtOptimizer(graph, values).optimize()
        found[name] = _judged(graph, values, motion.states, bias)
    return found


def _graph(params, rate, force, seen, start, bias_sd):
    graph, sigmas = gtsam.NonlinearFactorGraph(), gtsam.noiseModel.Diagonal.Sigmas
    pose, velocity = start
    graph.add(gtsam.PriorFactorPose3(X(0), pose, sigmas(START_SD[:6])))
    graph.add(gtsam.PriorFactorVector(V(0), velocity, sigmas(START_SD[6:])))
    none = gtsam.imuBias.ConstantBias()
    graph.add(gtsam.PriorFactorConstantBias(B(0), none, sigmas(bias_sd)))
    for k in range(len(seen) + 1):
        pim = preintegrated(params, rate, force, k)
        graph.add(gtsam.CombinedImuFactor(X(k), V(k), X(k + 1), V(k + 1), B(k), B(k + 1), pim))
    for k, each in enumerate(seen):
        graph.add(gtsam.BetweenFactorPose3(X(k), X(k + 1), each, sigmas(POSE_SD)))
    return graph


def _judged(graph, values, states, bias) -> np.ndarray:
    n = len(states) - 2
    own, true = values.atPose3(X(n)), states[n].pose()
    marginals = gtsam.Marginals(graph, values)
    P = marginals.marginalCovariance(X(n))
    at = own.localCoordinates(true)
    biases = bias - values.atConstantBias(B(n)).vector()
    Q = marginals.marginalCovariance(B(n))
    # The last pose relative to the one before, and the velocity in the axes of that.
    keys = [X(n), X(n + 1), V(n + 1)]
    joint = marginals.jointMarginalCovariance(gtsam.KeyVector(keys))
    blocks = np.block([[joint.at(i, j) for j in keys] for i in keys])
    relative = own.between(values.atPose3(X(n + 1)))
    H = np.zeros((9, 15))
    H[:6, :6], H[:6, 6:12] = -relative.inverse().AdjointMap(), np.eye(6)
    H[6:, 12:] = np.eye(3)
    step = np.concatenate([
        relative.localCoordinates(true.between(states[n + 1].pose())),
        states[n + 1].velocity() - values.atVector(V(n + 1)),
    ])  # fmt: skip
    S = H @ blocks @ H.T
    pairs = (
        (at[:3], P[:3, :3]),
        (states[n].velocity() - values.atVector(V(n)), marginals.marginalCovariance(V(n))),
        (at[3:], P[3:, 3:]),
        (biases[3:], Q[3:, 3:]),
        (biases[:3], Q[:3, :3]),
        (step[:3], S[:3, :3]),
        (step[3:], S[3:, 3:]),
    )
    return np.array([e @ np.linalg.solve(C, e) / e.size for e, C in pairs])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=40)
    parser.add_argument("--free", action="store_true")
    parser.add_argument("--gravity", type=float, default=GRAVITY)
    parser.add_argument("--seed", type=int, default=0, help="of the first run")
    parser.add_argument("--truth", choices=list(TRUTHS), help="one of them alone")
    parser.add_argument("--numbers", choices=RULES, help="by one rule alone")
    options = parser.parse_args()
    motion = Motion.of(SECONDS, options.free, options.gravity)
    se = [np.sqrt(2.0 / n / options.runs) for n in (3, 6)]
    text = (
        f"{options.runs} runs of {SECONDS} s: NEES per degree of freedom of the last keyframe, and "
        "of the next pose relative to it, predicted from the IMU alone (turn; step with velocity). "
        f"cert.: what gmwm.certify predicts for one axis after {KEYFRAMES} keyframes; of runs: "
        f"after {SECONDS - 1}, as in these runs. Standard error of a NEES of 1: {se[0]:.2f}, of "
        f"the step {se[1]:.2f}."
    )
    print(fill(text, 96))
    print(f"{'truth':<12}{'numbers':<12}" + "".join(f"{head:>8}" for head in HEADS))
    for name, models in TRUTHS.items():
        if options.truth not in (None, name):
            continue
        by_rule = {k: v for k, v in rules(models).items() if options.numbers in (None, k)}
        truth = SensorModels.of(models, TURN_ON)
        seeds = range(options.seed, options.seed + options.runs)
        runs = [nees(motion, truth, by_rule, seed) for seed in seeds]
        for rule, numbers in by_rule.items():
            *state, turn, step = np.mean([run[rule] for run in runs], axis=0)
            turns, steps = zip(certified(models, numbers), expected(models, numbers), strict=True)
            cells = [*state, turn, *turns, step, *steps]
            print(f"{name:<12}{rule:<12}" + "".join(f"{c:>8.3g}" for c in cells), flush=True)


if __name__ == "__main__":
    main()
