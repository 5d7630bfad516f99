"""False findings in lots of equal units, and whether planted ones are found.

Run with ``python benchmarks/lots.py`` (twenty lots of 30 units of an hour at 100 Hz, one axis;
``--lots 2 --units 10`` for a first look, ``--seed 1`` for other noise). Of each kind of lot are
printed: the largest error of N of any unit, the lots with a finding on a unit that is like the
others, and the lots in which the planted unit is found.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence

import numpy as np

import gmwm
from gmwm import Calibration, Fit, Fleet, GaussMarkov, Model, RandomWalk, WhiteNoise
from gmwm.population.unit import Choice, Unit

RATE, SECONDS = 100.0, 3600
DEG_PER_ROOT_HOUR = np.pi / 180.0 / 60.0
DEG_PER_HOUR = np.pi / 180.0 / 3600.0
DEG_PER_HOUR_PER_ROOT_HOUR = DEG_PER_HOUR / 60.0

N = 0.2 * DEG_PER_ROOT_HOUR
SLOW = GaussMarkov(25.0 * DEG_PER_HOUR, 20.0)
SMALL = 3.0 * DEG_PER_HOUR_PER_ROOT_HOUR
K = 20.0 * DEG_PER_HOUR_PER_ROOT_HOUR


def fitted(truth: Model, seed: Sequence[int]) -> Fit:
    """The model selected for an hour of noise."""
    x = truth.simulate(int(RATE * SECONDS), 1.0 / RATE, np.random.default_rng(seed))
    channel = gmwm.Recording.from_arrays({"gyro_x": x}, RATE, {"gyro": "rad/s"})["gyro_x"]
    return gmwm.select(channel).fit


def fleet_of(fits: Mapping[str, Fit]) -> Fleet:
    """A fleet of one axis from the fits of its units."""
    structure = Choice({"gyro_x": fits}, is_given=False)("gyro_x")
    units = {
        name: Unit(name, name, Calibration({"gyro_x": fit}, {}, name, RATE, fit.wv.n))
        for name, fit in fits.items()
    }
    return Fleet(units, (structure,), {}, {})


def row(title: str, lots: Sequence[Fleet], truths: Sequence[float], planted: str = "") -> None:
    """Print what was found in some lots."""
    false = [{name for name in lot.findings if name != planted} for lot in lots]
    errors = [
        (numbers["N"].value or 0.0) / truth - 1.0
        for lot in lots
        for (name, numbers), truth in zip(lot.structures[0].numbers.items(), truths, strict=True)
        if name != planted
    ]
    found = sum(planted in lot.findings for lot in lots)
    words = f"{found} of {len(lots)}" if planted else "-"
    models = sorted({lot.structures[0].model for lot in lots})
    counted = f"{sum(map(bool, false))} of {len(lots)}"
    error = f"{100.0 * np.max(np.abs(errors)):.2f} %"
    print(f"{title:<28} {error:>10} {counted:>10} {words:>10}  {'; '.join(models)}", flush=True)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--lots", type=int, default=20)
    parser.add_argument("--units", type=int, default=30)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    fresh = (arguments.seed,) if arguments.seed else ()
    names = [f"unit-{i:02d}" for i in range(arguments.units)]
    print(f"{arguments.lots} lots of {arguments.units} units, one axis, {SECONDS} s at {RATE:g} Hz")
    print(f"{'':<28} {'error of N':>10} {'false':>10} {'planted':>10}  model")

    def lots(kind: int, truths: Sequence[Model]) -> list[dict[str, Fit]]:
        return [
            {name: fitted(truth, (*fresh, kind, lot, i))
             for i, (name, truth) in enumerate(zip(names, truths, strict=True))}
            for lot in range(arguments.lots)
        ]  # fmt: skip

    for kind, (title, truth, odd) in enumerate((
        ("N + GM, one N x 1.3", WhiteNoise(N) + SLOW, WhiteNoise(1.3 * N) + SLOW),
        ("N + K, one K x 4", WhiteNoise(N) + RandomWalk(K), WhiteNoise(N) + RandomWalk(4.0 * K)),
        ("N + K just seen, one K x 4", WhiteNoise(N) + RandomWalk(SMALL),
         WhiteNoise(N) + RandomWalk(4.0 * SMALL)),
    )):  # fmt: skip
        equal = lots(kind, [truth] * len(names))
        truths = [N] * len(names)
        row(title.partition(",")[0], [fleet_of(each) for each in equal], truths)
        for lot, each in enumerate(equal):
            each[names[-1]] = fitted(odd, (*fresh, 100 + kind, lot))
        row(title, [fleet_of(each) for each in equal], truths, names[-1])
    rng = np.random.default_rng(7)
    sizes = N * np.exp(0.1 * rng.standard_normal(len(names)))
    made = lots(9, [WhiteNoise(size) + SLOW for size in sizes])
    row("N + GM, N differs by 10 %", [fleet_of(each) for each in made], list(sizes))
    for count in (5, 3):
        some = [dict(list(each.items())[:count]) for each in made]
        row(f"  the first {count} of them", [fleet_of(each) for each in some], list(sizes[:count]))


if __name__ == "__main__":
    main()
