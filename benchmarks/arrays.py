"""What axes and sensors share, on simulated truths and on real recordings.

    python benchmarks/arrays.py weights [--runs 20 --seed 1]
    python benchmarks/arrays.py size [--runs 300]
    python benchmarks/arrays.py coverage [--runs 100]
    python benchmarks/arrays.py recordings FOLDER
    python benchmarks/arrays.py budget FOLDER
    python benchmarks/arrays.py navigate FOLDER

`weights` simulates four gyros of different noise that share slow errors, finds weights from two
hours of them, and prints by how much the variance after an outage exceeds that of the best
weights, beside weights of the empirical covariances of the coefficients, the mean, and 1/N^2; and
how often the intervals hold the best weights. `size` prints how often independent channels are
found to share slow errors at 5 %, under their own models and under fitted ones. `coverage` prints
how often 95 % intervals hold the elements of the matrices of three channels.

FOLDER holds ``adis16405_1.csv.gz`` to 4, static recordings of one IMU. `recordings` prints
correlations of coefficients at 31 s, and the standard deviation of an error budget of independent
axes over that with what they share. `budget` prints that of independent axes over the errors of
4,000 simulated outages with what they share.
`navigate` takes the matrices from recording 1 and navigates the others at rest, with position fixes
that end: horizontal error and NEES after outages, with what axes share and without.
"""

from __future__ import annotations

import argparse
import warnings
from pathlib import Path

import numpy as np

import gmwm
from gmwm import Channel, GaussMarkov, RandomWalk, WhiteNoise, wavelet_covariance
from gmwm.calibration.sharing import sharing
from gmwm.estimate import fit_shared
from gmwm.filter_numbers import integral_rms
from gmwm.filter_numbers.propagation import integrated, power


def matrix(deviations, correlation):
    """Covariance matrix of equal correlations."""
    scale, size = np.diag(deviations), len(deviations)
    return scale @ (correlation * np.ones((size, size)) + (1 - correlation) * np.eye(size)) @ scale


def drawn(parts, matrices, n, dt, rng):
    """Channels whose parts have these covariance matrices, (p, n)."""
    size = len(matrices[0])
    return sum(
        np.linalg.cholesky(each) @ np.stack([part.simulate(n, dt, rng) for _ in range(size)])
        for part, each in zip(parts, matrices, strict=True)
    )


# Gyros in rad/s: white noise, a slow error of each, one that they share unequally, a walk.
GYROS = (WhiteNoise(1.0), GaussMarkov(1.0, 20.0), GaussMarkov(1.0, 300.0), RandomWalk(1.0))
OF_GYROS = np.array(
    [
        matrix([1.0e-4, 1.3e-4, 0.8e-4, 2.0e-4], 0.0),
        matrix([3e-5, 1e-5, 4e-5, 1e-5], 0.0),
        matrix([3e-5, 2e-5, 9e-5, 2e-5], 0.7),
        matrix([1e-6, 1e-6, 3e-6, 1e-6], 0.3),
    ]
)


def weights_of(total):
    found = np.linalg.solve(total, np.ones(len(total)))
    return found / np.sum(found)


def weights(args) -> None:
    rng, n, dt = np.random.default_rng(args.seed), 72_000, 0.1
    horizons = (1.0, 60.0, 300.0)
    excess = {name: [] for name in ("cone", "empirical", "mean", "1/N^2")}
    inside, cost = [], []
    for _ in range(args.runs):
        values = drawn(GYROS, OF_GYROS, n, dt, rng)
        imus = {
            f"imu{k}": gmwm.Recording.from_arrays({"gyro_x": own}, 1 / dt, {"gyro": "rad/s"})
            for k, own in enumerate(values)
        }
        data = wavelet_covariance([each["gyro_x"] for each in imus.values()])
        rows = {name: [] for name in excess}
        for horizon in horizons:
            growth = [integral_rms(p, [horizon], dt, known_start=True)[0, 0] ** 2 for p in GYROS]
            total = np.einsum("k,kab->ab", growth, OF_GYROS)
            best = weights_of(total)
            found = gmwm.array(imus, horizon=horizon).axes[0]
            level = int(np.argmin(np.abs(np.log(data.tau / horizon))))
            plain = 1.0 / np.diag(OF_GYROS[0])
            tried = (found.weights, weights_of(data.values[level]), np.full(4, 0.25),
                     plain / np.sum(plain))  # fmt: skip
            for name, own in zip(excess, tried, strict=True):
                rows[name].append(own @ total @ own / (best @ total @ best) - 1.0)
            inside.append((found.lower < best) & (best < found.upper))
            cost.append(found.cost)
        for name, own in rows.items():
            excess[name].append(own)
    print("variance above the best, %  " + "".join(f"{h:9g} s" for h in horizons))
    for name, own in excess.items():
        print(f"{name:27s} " + "".join(f"{100 * v:11.1f}" for v in np.mean(own, axis=0)))
    told = np.mean(np.reshape(cost, (args.runs, -1)), axis=0)
    print(f"{'cone, as predicted':27s} " + "".join(f"{100 * v:11.1f}" for v in told))
    held = np.mean(np.reshape(inside, (args.runs, len(horizons), -1)), axis=(0, 2))
    print(f"{'intervals that hold, %':27s} " + "".join(f"{100 * v:11.1f}" for v in held))


def size(args) -> None:
    warnings.simplefilter("ignore")
    rng, n, dt = np.random.default_rng(args.seed), 4096, 0.25
    truths = {
        "a": WhiteNoise(1.0) + GaussMarkov(0.5, 20.0),
        "b": WhiteNoise(2.0) + GaussMarkov(0.8, 40.0),
        "c": WhiteNoise(1.0) + RandomWalk(0.03),
    }
    p_values = {"own models": [], "fitted models": []}
    for _ in range(args.runs):
        own = [Channel(name, truth.simulate(n, dt, rng), dt) for name, truth in truths.items()]
        fits = {c.name: gmwm.fit(truths[c.name].opened(), c).model for c in own}
        data = wavelet_covariance(own)
        for name, models in zip(p_values, (truths, fits), strict=True):
            p_values[name].append([each.p_value for each in sharing(models, data)])
    for name, own in p_values.items():
        pairs = np.concatenate(own)
        shares = [100 * np.mean(pairs < level) for level in (0.05, 0.01)]
        named = 100 * np.mean([min(p, default=1.0) * len(p) < 0.01 for p in own])
        print(f"{name}: {len(pairs)} pairs, found at 5, 1 %: "
              + ", ".join(f"{v:.2f} %" for v in shares)
              + f"; recordings with a finding: {named:.2f} %")  # fmt: skip


def coverage(args) -> None:
    rng, n, dt = np.random.default_rng(args.seed), 8192, 1.0
    parts = (WhiteNoise(1.0), GaussMarkov(1.0, 40.0), RandomWalk(1.0))
    truth = np.array(
        [matrix([1, 0.8, 1.2], 0.0), matrix([0.5, 0.4, 0.6], 0.6), matrix([0.01, 0.02, 0.01], 0)]
    )
    first, second = np.triu_indices(3)
    inside = []
    for _ in range(args.runs):
        channels = [Channel(c, v, dt) for c, v in zip("abc", drawn(parts, truth, n, dt, rng),
                                                      strict=True)]  # fmt: skip
        start = (parts[0], GaussMarkov(1.0, 20.0), parts[2])
        low, high = fit_shared(start, wavelet_covariance(channels)).interval()
        inside.append(((low < truth) & (truth < high))[:, first, second])
    held = 100 * np.mean(inside, axis=0)
    for part, row in zip(parts, held, strict=True):
        print(f"{type(part).__name__:14s}", " ".join(f"{v:5.1f}" for v in row))
    print(f"all {np.mean(held):.1f} %")


AXES = ("gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z")
SLOW = (*(GaussMarkov(1.0, tau) for tau in (1.0, 4.0, 16.0, 64.0, 256.0, 1024.0)), RandomWalk(1.0))
GRAVITY, BLOCK = 9.80665, 12


def recorded(folder: Path, number: int) -> gmwm.Recording:
    units = {"gyro": "deg/s", "accel": "g"}
    return gmwm.read(folder / f"adis16405_{number}.csv.gz", rate=100.0, units=units)


def recordings(args) -> None:
    parts = (WhiteNoise(1.0), *SLOW)
    print("independent / shared, 1 sigma      " + "".join(f"{t:8g} s" for t in (1, 10, 60, 300)))
    for number in (1, 2, 3, 4):
        channels = [recorded(args.folder, number)[name] for name in AXES]
        data = wavelet_covariance(channels, block=BLOCK)
        fit, rows = fit_shared(parts, data, refine=False), {}
        level = int(np.argmin(np.abs(data.tau - 30.0)))
        found = data.correlation[level]
        print(f"recording {number}, correlations at {data.tau[level]:.0f} s: "
              f"accel xy {found[3, 4]:.2f}, xz {found[3, 5]:.2f}, yz {found[4, 5]:.2f}; gyro x "
              f"and accel x {found[0, 3]:.2f}; gyro xy {found[0, 1]:.2f}")  # fmt: skip
        for horizon in (1.0, 10.0, 60.0, 300.0):
            grown = [power(*integrated(p.state_space(0.01), 0.01, 3), round(horizon / 0.01))[1]
                     for p in parts]  # fmt: skip
            joint = np.einsum("kab,kij->aibj", fit.matrices, [each[:3, :3] for each in grown])
            for order, quantity in ((0, "velocity"), (1, "position")):
                alone = shared = 0.0
                # Level, z down: a pitch error accelerates to the back, a roll error to the right.
                for axis, (gyro, sign) in {"x": (1, -1.0), "y": (0, 1.0)}.items():
                    accel = AXES.index(f"accel_{axis}")
                    own = joint[accel, order, accel, order]
                    own += GRAVITY**2 * joint[gyro, order + 1, gyro, order + 1]
                    both = own + 2.0 * sign * GRAVITY * joint[accel, order, gyro, order + 1]
                    rows.setdefault(f"{quantity} {axis}", []).append(np.sqrt(own / both))
                    alone, shared = alone + own, shared + both
                rows.setdefault(f"{quantity} radial", []).append(np.sqrt(alone / shared))
        for name, row in rows.items():
            print(f"recording {number}, {name:20s}", "".join(f"{v:10.3f}" for v in row))


def budget(args) -> None:
    """Independent budgets against simulated errors with what the axes share, known at the start."""
    parts, dt, runs, rng = (WhiteNoise(1.0), *SLOW), 0.1, 4000, np.random.default_rng(1)
    print("independent budget / simulated, 1 sigma" + "".join(f"{t:8g} s" for t in (10, 60, 300)))
    for number in (1, 2, 3, 4):
        channels = [recorded(args.folder, number)[name] for name in AXES]
        fit = fit_shared(parts, wavelet_covariance(channels, block=BLOCK), refine=False)
        roots = [vectors * np.sqrt(np.maximum(values, 0.0))
                 for values, vectors in map(np.linalg.eigh, fit.matrices)]  # fmt: skip
        spaces = [part.state_space(dt) for part in SLOW]
        slow, tilt, velocity, position = (np.zeros((k, n, runs)) for k, n in
                                          ((len(SLOW), 6), (1, 2), (1, 2), (1, 2)))  # fmt: skip
        rows: dict[str, list[float]] = {}
        for step in range(1, round(300.0 / dt) + 1):
            errors = roots[0] @ rng.normal(size=(6, runs)) / np.sqrt(dt) + np.sum(slow, axis=0)
            for k, (space, root) in enumerate(zip(spaces, roots[1:], strict=True)):
                driven = root @ rng.normal(size=(6, runs)) * np.sqrt(space.process_noise[0, 0])
                slow[k] = space.transition[0, 0] * slow[k] + driven
            # Level, z down: a pitch error accelerates to the back, a roll error to the right.
            position += velocity * dt
            velocity[0] += dt * (errors[3:5] + GRAVITY * np.stack([-tilt[0, 1], tilt[0, 0]]))
            tilt[0] += dt * errors[:2]
            if step * dt not in (10.0, 60.0, 300.0):
                continue
            grown = [power(*integrated(p.state_space(dt), dt, 3), step)[1] for p in parts]
            joint = np.einsum("kab,kij->aibj", fit.matrices, [each[:3, :3] for each in grown])
            for axis, gyro in enumerate((1, 0)):
                for order, (name, found) in enumerate((("velocity", velocity),
                                                       ("position", position))):  # fmt: skip
                    own = joint[3 + axis, order, 3 + axis, order]
                    own += GRAVITY**2 * joint[gyro, order + 1, gyro, order + 1]
                    ratio = np.sqrt(own / np.mean(found[0, axis] ** 2))
                    rows.setdefault(f"{name} {'xy'[axis]}", []).append(float(ratio))
        for name, row in rows.items():
            print(f"recording {number}, {name:25s}", "".join(f"{v:10.3f}" for v in row))


class Filter:
    """Tilt, velocity and position at rest, and the slow errors of six axes part by part."""

    def __init__(self, matrices, dt) -> None:
        white, slow = matrices[0], matrices[1:]
        kept = [p.state_space(dt).transition[0, 0] for p in SLOW]
        noise = [p.state_space(dt).process_noise[0, 0] for p in SLOW]
        # A walk about the mean of a recording of 10,000 s has a sixth of the variance at its end.
        start = [1.0] * (len(SLOW) - 1) + [10_000.0 / 6.0]
        size = 8 + 6 * len(SLOW)
        self.F, self.Q, self.P = np.eye(size), np.zeros((size, size)), np.zeros((size, size))
        self.driven = np.zeros((8, 6))
        self.driven[0, 0] = self.driven[1, 1] = dt
        self.driven[[2, 3, 4], [3, 4, 5]] = dt
        self.F[3, 0], self.F[2, 1] = GRAVITY * dt, -GRAVITY * dt
        self.F[[5, 6, 7], [2, 3, 4]] = dt
        self.P[:8, :8] = np.diag([0.01, 0.01, 0.1, 0.1, 0.1, 1.0, 1.0, 1.0]) ** 2
        self.Q[:8, :8] = self.driven @ (white / dt) @ self.driven.T
        for k, matrix in enumerate(slow):
            at = slice(8 + 6 * k, 14 + 6 * k)
            self.F[at, at] *= kept[k]
            self.F[:8, at] = self.driven
            self.Q[at, at], self.P[at, at] = noise[k] * matrix, start[k] * matrix

    def run(self, errors, fixes, every, aided):
        """Errors of the first eight states and their covariance at each block.

        errors: (blocks, 6, windows), of the sensors. fixes: (blocks, 3, windows), noise, m.
        """
        H = np.zeros((3, len(self.F)))
        H[[0, 1, 2], [5, 6, 7]] = 1.0
        P, true, found = self.P.copy(), np.zeros((8, errors.shape[2])), 0.0
        found = np.zeros((len(self.F), errors.shape[2]))
        kept = []
        for k, own in enumerate(errors):
            true = self.F[:8, :8] @ true + self.driven @ own
            found = self.F @ found
            P = self.F @ P @ self.F.T + self.Q
            if k % every == 0 and k < aided:
                gain = np.linalg.solve(H @ P @ H.T + np.eye(3), H @ P).T
                found += gain @ (true[5:8] + fixes[k] - H @ found)
                P = (np.eye(len(P)) - gain @ H) @ P
                P = 0.5 * (P + P.T)
            kept.append((true - found[:8], P[:8, :8].copy()))
        return kept


def navigate(args) -> None:
    rng, dt = np.random.default_rng(1), BLOCK * 0.01
    parts = (WhiteNoise(1.0), *SLOW)
    first = [recorded(args.folder, 1)[name] for name in AXES]
    matrices = fit_shared(parts, wavelet_covariance(first, block=BLOCK), refine=False).matrices
    aided, blocks = round(300.0 / dt), round(360.0 / dt)
    windows = []
    for number in (2, 3, 4):
        recording = recorded(args.folder, number)
        values = np.array([recording[name].values for name in AXES])
        values = values[:, : values.shape[1] // BLOCK * BLOCK].reshape(6, -1, BLOCK).mean(axis=2)
        values -= values.mean(axis=1, keepdims=True)
        windows += [values[:, k * blocks : (k + 1) * blocks].T
                    for k in range(values.shape[1] // blocks)]  # fmt: skip
    errors = np.stack(windows, axis=2)
    fixes = rng.normal(size=(blocks, 3, errors.shape[2]))
    alone = matrices * np.eye(6)
    runs = {"independent": Filter(alone, dt), "shared": Filter(matrices, dt)}
    kept = {name: own.run(errors, fixes, round(1.0 / dt), aided) for name, own in runs.items()}
    print(f"{errors.shape[2]} windows of recordings 2 to 4: 300 s of fixes (1 m, 1 Hz), then none")
    for after in (0.0, 10.0, 60.0):
        place, rows = min(aided + round(after / dt), blocks) - 1, {}
        for name, own in kept.items():
            error, P = own[place][0][5:7], own[place][1][5:7, 5:7]
            nees = 0.5 * np.einsum("iw,ij,jw->w", error, np.linalg.inv(P), error)
            rows[name] = np.sum(error**2, axis=0), nees
            size, told = np.sqrt(np.mean(rows[name][0])), np.sqrt(np.trace(P))
            print(f"{after:4g} s {name:12s} horizontal {size:8.3f} m, predicted {told:8.3f} m, "
                  f"NEES {np.mean(nees):5.2f}")  # fmt: skip
        draws = rng.integers(errors.shape[2], size=(2000, errors.shape[2]))
        ratio = [np.sqrt(np.mean(rows["shared"][0][d]) / np.mean(rows["independent"][0][d]))
                 for d in draws]  # fmt: skip
        low, high = np.quantile(ratio, [0.025, 0.975])
        print(
            f"       error, shared over independent: {np.mean(ratio):.3f} ({low:.3f} to {high:.3f})"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = {f.__name__: f for f in (weights, size, coverage, recordings, budget, navigate)}
    runs = {"weights": 20, "size": 300, "coverage": 100}
    chosen = parser.add_subparsers(dest="command", required=True)
    for name in commands:
        own = chosen.add_parser(name)
        if name in runs:
            own.add_argument("--runs", type=int, default=runs[name])
            own.add_argument("--seed", type=int, default=1)
        else:
            own.add_argument("folder", type=Path)
    args = parser.parse_args()
    commands[args.command](args)


if __name__ == "__main__":
    main()
