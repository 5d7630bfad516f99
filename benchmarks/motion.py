"""Noise in motion of simulated errors on real flights, and of these flights themselves.

    python benchmarks/motion.py simulate FOLDER [--runs 100 --imus 3 --seed 1 --offset 0.01]
    python benchmarks/motion.py sessions FOLDER --static calibration.json --save .
    python benchmarks/motion.py predict FOLDER --static calibration.json
    python benchmarks/motion.py aliases FOLDER

FOLDER holds ``flight_NN_imu_K.csv.gz`` of four IMUs on one quadrotor, 120 Hz (Hurwitz and Klein
2023, CC BY 4.0). `simulate` takes the motion below 15 Hz of one IMU for the truth, gives each of
several IMUs a clock, a rotation, a lever arm and errors of known Allan variance (white noise,
differenced white noise, random walk), and prints the ratio of the variances to the truth, the
coverage of 95 % intervals with its own interval, and the errors of clocks and lever arms in
standard errors. `sessions` prints in-motion over static Allan deviation by session. `predict` takes
the numbers from every second flight of a session, and prints on the others, and the other way
round, the NEES of the difference of two IMUs, also with the shares of time that classes of
vibration have in each flight. `aliases` prints whether the phase between two IMUs at 45 to 58 Hz
follows how far apart they sample, as it does for vibration above half the rate, and how the
variances in motion stand to those of the samples themselves above 20 Hz.
"""

from __future__ import annotations

import argparse
from itertools import combinations, product
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import butter, csd, sosfiltfilt
from scipy.spatial.transform import Rotation

import gmwm

SESSIONS = {"1-7": (1, 3, 5, 7), "9-15": (9, 11, 13, 15), "17-21": (17, 19, 21),
            "23-27": (23, 25, 27)}  # fmt: skip
AXES = [f"{sensor}_{axis}" for sensor in ("gyro", "accel") for axis in "xyz"]
DT = 1.0 / 120.0


def flight(folder: Path, number: int) -> list[gmwm.Recording]:
    return [gmwm.read(folder / f"flight_{number:02d}_imu_{k}.csv.gz") for k in range(1, 5)]


def simulated(recording, imus, rng, offset, drift, turn, arm):
    """Recordings of IMUs on a motion with their Allan variances, clocks and lever arms."""
    truth = np.stack([recording[name].values for name in AXES], axis=1)
    truth = np.where(np.isnan(truth), np.nanmean(truth, axis=0), truth)
    smooth = sosfiltfilt(butter(4, 15.0, fs=1.0 / DT, output="sos"), truth, axis=0)
    spline = CubicSpline(np.arange(len(smooth)) * DT, smooth)
    found = []
    for k in range(imus):
        ahead, slow = (offset * k * (-1) ** k, drift * k) if k else (0.0, 0.0)
        # The time of the first IMU at samples of this one.
        time = (np.arange(len(truth)) * DT - ahead) / (1.0 + slow)
        time = np.clip(time, 0.0, spline.x[-1])
        axis, lever = rng.normal(size=(2, 3))
        lever *= arm * bool(k) / np.linalg.norm(lever)
        angle = np.deg2rad(turn) * bool(k) / np.linalg.norm(axis)
        rotation = Rotation.from_rotvec(angle * axis).as_matrix()
        rates, slopes = spline(time)[:, :3], spline(time, 1)[:, :3]
        forces = spline(time)[:, 3:] + np.cross(slopes, lever)
        forces += np.cross(rates, np.cross(rates, lever))
        N = 1e-3 * (1.0 + 0.3 * k) * np.array([1.0] * 3 + [10.0] * 3)
        n = len(time)
        errors = rng.normal(size=(n, 6)) / np.sqrt(DT)
        errors += 10.0 * np.diff(rng.normal(size=(n + 1, 6)), axis=0)
        errors += 0.3 * np.sqrt(DT) * np.cumsum(rng.normal(size=(n, 6)), axis=0)
        values = np.hstack([rates @ rotation.T, forces @ rotation.T]) + N * errors
        units = {"gyro": "rad/s", "accel": "m/s^2"}
        arrays = dict(zip(AXES, values.T, strict=True))
        found.append((gmwm.Recording.from_arrays(arrays, 1.0 / DT, units), N, (ahead, slow, lever)))
    return found


def allan(tau, N):
    """Of the errors above, u^2."""
    return N**2 * (
        1.0 / tau + 300.0 * (DT / tau) ** 2 + 0.09 * tau * (1 + 0.5 * (DT / tau) ** 2) / 3
    )


def share_of(covered: dict[int, list[bool]]) -> str:
    """Share of intervals, with its 95 % interval: those of one run are not independent."""
    is_in = np.concatenate([*covered.values()])
    away = [sum(own) - len(own) * is_in.mean() for own in covered.values()]
    reach = 196.0 * np.sqrt(np.sum(np.square(away))) / is_in.size
    return f"{100 * is_in.mean():.1f} +-{reach:.1f} % of {is_in.size}"


def simulate(folder: Path, args: argparse.Namespace) -> None:
    rng = np.random.default_rng(args.seed)
    numbers = [n for own in SESSIONS.values() for n in own]
    motions = {n: flight(folder, n)[0] for n in numbers}
    ratios, covered, away = {}, {}, {"offset": [], "drift": [], "lever arm": []}
    for run in range(args.runs):
        recording = motions[numbers[run % len(numbers)]]
        imus = simulated(recording, args.imus, rng, args.offset, args.drift, args.turn, args.arm)
        found = gmwm.motion([each[0] for each in imus])
        for curve in found.curves:
            N = imus[found.imus.index(curve.imu)][1][AXES.index(curve.channel)]
            truth = allan(curve.tau, N)
            used = curve.tau <= found.durations[0] / args.least
            inside = (curve.lower <= truth) & (truth <= curve.upper)
            for tau, ratio, is_in in zip(curve.tau[used], (curve.variance / truth)[used],
                                         inside[used], strict=True):  # fmt: skip
                key = curve.quantity, round(float(tau), 4)
                ratios.setdefault(key, []).append(ratio)
                for each in (key, ("all", curve.quantity), ("all", "octaves")):
                    covered.setdefault(each, {}).setdefault(run, []).append(is_in)
        for clock, (_, _, (ahead, slow, _)) in zip(found.clocks, imus[1:], strict=True):
            away["offset"].append((clock.offset - ahead) / clock.offset_error)
            away["drift"].append((clock.drift - slow) / clock.drift_error)
        for each in found.mountings:
            if each.sensor == "accel" and each.target == "imu 1":
                true = imus[found.imus.index(each.imu)][2][2]
                away["lever arm"] += list((-true - each.lever_arm) / each.lever_arm_error)
    print(f"{args.imus} IMUs, {args.runs} runs, seed {args.seed}: {vars(args)}")
    for key in sorted(ratios):
        own = np.array(ratios[key])
        error = own.std() / np.sqrt(len(own))
        print(f"{key[0]:5s} {key[1]:7.4f} s  variance / truth {own.mean():.3f} +-{error:.3f}  "
              f"covered {share_of(covered[key])}")  # fmt: skip
    for quantity in ("gyro", "accel", "octaves"):
        print(f"all {quantity}: covered {share_of(covered['all', quantity])}")
    for name, values in away.items():
        print(f"{name}: rms error {np.sqrt(np.mean(np.square(values))):.2f} standard errors")


def sessions(folder: Path, args: argparse.Namespace) -> None:
    static = gmwm.load(args.static) if args.static else None
    for name, numbers in SESSIONS.items():
        found = gmwm.motion([flight(folder, n) for n in numbers], static=static)
        print(f"\nFlights {name}\n{found}")
        if args.save is not None:
            found.save(args.save / f"flights {name}.json")


def by_class(first, found, variance) -> np.ndarray:
    """Variances of the classes of vibration of some flights, in the shares of another one."""
    shares = {each.name: each.share for each in found.classes}
    own = [(variance(first.at(each.name)), shares.get(each.name, 0.0)) for each in first.classes]
    return sum(share * each for each, share in own) / sum(share for _, share in own)


def ratios(first, found, channel: str, a: int, b: int) -> list[float]:
    """Mean over octaves of the measured over each predicted variance of a difference."""
    curve = found.curve(f"imu {a + 1}", channel)
    J = min(len(first.curves[0].tau), len(curve.tau))
    tau, measured = curve.tau[:J], curve.differences[b - 1, :J]

    def both(variance) -> np.ndarray:
        """Sum over the two IMUs, of which none is below the one at rest."""
        own = [(variance(f"imu {k + 1}", k, other), k) for k, other in ((a, b), (b, a))]
        static = [first.curve(f"imu {k + 1}", channel).static for _, k in own]
        return sum(np.maximum(v, s)[:J] for (v, _), s in zip(own, static, strict=True))

    def apart(result, imu, k, other) -> np.ndarray:
        """Without what the two share: from the pairs of others that have the other one."""
        pairs = combinations([each for each in range(4) if each != k], 2)
        return result.curve(imu, channel).pairs[[other in pair for pair in pairs]].mean(axis=0)

    def bounds(imu, *_) -> np.ndarray:
        tau = first.curves[0].tau
        return 2.0 * first.numbers(imu=imu)[channel].haar_variance(tau, DT)

    predicted = [
        both(lambda imu, *_: first.curve(imu, channel).variance),
        both(lambda *which: apart(first, *which)),
        both(
            lambda *which: (
                by_class(first, found, lambda result: apart(result, *which))
                if len(first.classes) == 3
                else apart(first, *which)
            )
        ),
        both(lambda imu, *_: first.curve(imu, channel).static),
    ]
    used, inside = (tau >= 0.06) & (tau < 5.0), (tau >= 0.1) & (tau <= 1.1)
    plain, own, classes, rest = (float(np.mean((measured / each)[used])) for each in predicted)
    return [plain, own, classes, rest, rest / 100.0, np.max((measured / both(bounds))[inside])]


def predict(folder: Path, args: argparse.Namespace) -> None:
    static = gmwm.load(args.static)
    ranges = {}
    print("NEES of the difference of two IMUs, by numbers in motion; without what the two share; "
          "so by class of vibration; static; ten times that deviation; and the largest from 0.1 to "
          "1 s of numbers that bound")  # fmt: skip
    for (name, numbers), half in product(SESSIONS.items(), (0, 1)):
        first = gmwm.motion([flight(folder, n) for n in numbers[half::2]], static=static)
        # A class of less than 5 s is none.
        limits = [each.high for each in first.classes[:-1]] if len(first.classes) == 3 else None
        for number in numbers[1 - half :: 2]:
            found = gmwm.motion(flight(folder, number), limits=limits)
            for sensor in ("gyro", "accel"):
                texts = []
                for a, b in combinations(range(4), 2):
                    nees = np.mean([ratios(first, found, f"{sensor}_{axis}", a, b)
                                    for axis in "xyz"], axis=0)  # fmt: skip
                    texts.append(f"{a + 1}-{b + 1} {';'.join(f'{each:.3g}' for each in nees)}")
                    group = "1-15" if number < 16 else "17-27"
                    ranges.setdefault((group, sensor), []).append(nees)
                print(f"{name}, flight {number}, {sensor}: {', '.join(texts)}", flush=True)
    for (group, sensor), values in ranges.items():
        ends = np.quantile(values, [0.0, 0.05, 0.5, 0.95, 1.0], axis=0).T
        texts = ["{:.2f} ({:.2f} {:.2f} {:.2f} {:.2f})".format(*each[[2, 0, 1, 3, 4]])
                 for each in ends]  # fmt: skip
        print(f"flights {group}, {sensor}, {len(values)} pairs, median (least, 5 %, 95 %, "
              f"largest): {'; '.join(texts)}")  # fmt: skip


def aliases(folder: Path, args: argparse.Namespace) -> None:
    """Vibration of n fs - f is seen at f, n d turns on in samples that are d intervals later."""
    orders = np.arange(-3, 4)
    high = butter(6, 20.0, "highpass", fs=1.0 / DT, output="sos")
    sums, sizes, over = {}, {}, {}
    for number in (n for own in SESSIONS.values() for n in own):
        recordings = flight(folder, number)
        found = gmwm.motion(recordings)
        middle = found.durations[0] / 2.0
        late = np.array([0.0] + [each.own(middle) - middle for each in found.clocks]) / DT
        whole = np.round(late).astype(int)
        part = late - whole
        print(f"flight {number}: samples of the IMUs are off by {np.round(part, 2)} of an interval")
        count = min(each.n for each in recordings) - np.ptp(whole)
        for channel in AXES:
            own = [np.nan_to_num(r[channel].values - np.nanmean(r[channel].values))
                   for r in recordings]  # fmt: skip
            at_once = [x[k - whole.min() :][:count] for x, k in zip(own, whole, strict=True)]
            for a, b in combinations(range(4), 2):
                f, cross = csd(at_once[a], at_once[b], 1.0 / DT, nperseg=512)
                cross *= np.exp(2j * np.pi * f * DT * (part[b] - part[a]))
                turned = np.sum(cross[(f > 45.0) & (f < 58.0)])
                turned *= np.exp(-2j * np.pi * orders * (part[b] - part[a])) / np.abs(turned)
                sums[channel, a, b] = sums.get((channel, a, b), 0.0) + turned
                sizes[channel] = sizes.get(channel, 0) + 1
            for k, x in enumerate(own):
                means = sosfiltfilt(high, x)[: len(x) // 16 * 16].reshape(-1, 16).mean(axis=1)
                curve = found.curve(f"imu {k + 1}", channel)
                ratio = curve.variance[4] / (0.5 * np.mean(np.diff(means) ** 2))
                over.setdefault(channel, []).append(ratio)
    print(
        "Agreement of phases between IMUs, 1: all flights, with vibration of n fs - f at n =",
        *orders,
    )
    for channel in AXES:
        total = sum(abs(each) for (name, _, _), each in sums.items() if name == channel)
        print(f"{channel}: {' '.join(f'{each:.2f}' for each in total / sizes[channel])}")
    print(
        "Variance in motion at 0.13 s over that of the samples above 20 Hz, over IMUs and flights"
    )
    for channel in AXES:
        print(f"{channel}: {np.mean(over[channel]):.2f} ({np.min(over[channel]):.2f} to "
              f"{np.max(over[channel]):.2f})")  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("simulate", "sessions", "predict", "aliases"))
    parser.add_argument("folder", type=Path)
    parser.add_argument("--static")
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--imus", type=int, default=3)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--offset", type=float, default=0.01)
    parser.add_argument("--drift", type=float, default=3e-5)
    parser.add_argument("--turn", type=float, default=20.0)
    parser.add_argument("--arm", type=float, default=0.1)
    parser.add_argument("--least", type=float, default=20.0, help="averaging times in a record")
    parser.add_argument("--save", type=Path, help="folder for the results of `sessions`")
    args = parser.parse_args()
    runs = {each.__name__: each for each in (simulate, sessions, predict, aliases)}
    runs[args.what](args.folder, args)


if __name__ == "__main__":
    main()
