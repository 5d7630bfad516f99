"""What ``gmwm`` finds in four recordings of a real IMU: tables and pictures of docs/real-data.md.

Run with ``python examples/real_data.py FOLDER -o OUT``. FOLDER holds ``adis16405_1.csv.gz`` to
``adis16405_4.csv.gz``: an ADIS16405 at rest, 100 Hz, gyros in deg/s, accelerometers in g. OUT gets
the pictures and the calibrations, which are used again if they are there.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import numpy as np
from real_data_pictures import allan_picture, residual_picture, shock_picture, spectrum_picture
from real_data_recording import (
    ACCELEROMETERS,
    BUMPS,
    CHANNELS,
    NUMBERS,
    PIECES,
    Recorded,
    noise_of_pieces,
    parts_of,
    peaks_of_pieces,
    shown_unit,
)

import gmwm
from gmwm import Calibration, Fit, JointFit

SHAKEN = 4  # the recording with the shock
FEWEST_DOF = 30.0  # of a level whose misfit counts
SLOW = 1.0  # s
DPI = 80


def main() -> None:
    """Print the tables, write the pictures."""
    parser = argparse.ArgumentParser(description="Tables and pictures of docs/real-data.md.")
    parser.add_argument("folder", type=Path, help="where adis16405_1.csv.gz to _4.csv.gz are")
    parser.add_argument("-o", "--output", type=Path, default=Path("real-data"))
    given = parser.parse_args()
    given.output.mkdir(parents=True, exist_ok=True)

    recorded = [Recorded.read(given.folder, number) for number in NUMBERS]
    print(found_table(recorded))
    print(noise_table(recorded))
    print(peak_table(recorded))
    own = [
        kept(given.output / f"calibration_{r.number}.json", lambda r=r: gmwm.calibrate(r.raw))
        for r in recorded
    ]
    removed = [
        kept(
            given.output / f"calibration_{r.number}_removed.json",
            lambda r=r: gmwm.calibrate(r.raw, remove_departures=True),
        )
        for r in recorded
    ]
    together = kept(
        given.output / "calibration_joint.json", lambda: gmwm.calibrate([r.raw for r in recorded])
    )
    for table in (
        model_table(own, together), parameter_table(together), numbers_table(together),
        misfit_table(own), validity_table(own), validity_table(removed, "departures removed: "),
        joint_table(together), budget_table(own, together),
    ):  # fmt: skip
        print(table)
    pictures = {
        "allan": allan_picture(together),
        "residuals": residual_picture(together),
        "spectra": spectrum_picture(recorded),
        "shock": shock_picture(recorded[NUMBERS.index(SHAKEN)]),
    }
    for name, figure in pictures.items():
        path = given.output / f"real-{name}.png"
        figure.savefig(path, dpi=DPI, pil_kwargs={"optimize": True})


def kept(path: Path, make: Callable[[], Calibration]) -> Calibration:
    """The calibration in a file, made and saved first if it is not there."""
    if not path.exists():
        make().save(path)
    return gmwm.load(path)


def found_table(recorded: Sequence[Recorded]) -> str:
    """The line, the steps, the broad peak and the largest shock, as ``gmwm health`` has them."""
    lines = [
        "What gmwm health finds",
        f"{'':4}{'line on accel_x, y, z [Hz]':>24} {'amplitude [mg]':>15} {'step [mg]':>10} "
        f"{'step / noise':>15} {'peak on gyro_z [Hz]':>20} {'damping':>8}  largest shock",
    ]
    for r in recorded:
        mg = shown_unit("accel_x")[1]
        strongest = [r.health.lines(name)[0] for name in ACCELEROMETERS]
        frequencies = " ".join(f"{frequency:.4f}" for frequency, _ in strongest)
        amplitudes = " ".join(f"{amplitude / mg:.2f}" for _, amplitude in strongest)
        rounding = [r.health.of(name, "rounding")[0].values for name in ACCELEROMETERS]
        ratios = " ".join(f"{values['lsb'] / values['noise']:.2f}" for values in rounding)
        frequency, damping = r.health.resonances("gyro_z")[0]
        lines.append(
            f"{r.number:<4}{frequencies:>24} {amplitudes:>15} {rounding[0]['lsb'] / mg:>10.2f} "
            f"{ratios:>15} {frequency:>20.1f} {damping:>8.3f}  {largest_shocks(r)}"
        )
    return "\n".join([*lines, ""])


def largest_shocks(r: Recorded) -> str:
    """Height and time of the largest event of each sensor."""
    shocks = []
    for event in (r.largest_event("gyro"), r.largest_event("accel")):
        if event is not None:
            unit, one = shown_unit(event.where)
            height, time = event.values["height"] / one, event.values["time"]
            shocks.append(f"{event.where} {height:+.3g} {unit} at {time:.2f} s")
    return "; ".join(shocks)


def noise_table(recorded: Sequence[Recorded]) -> str:
    """How much the noise changes within each recording."""
    lines = [
        f"Deviation at 10 ms in {PIECES} pieces of a recording, least and largest in % of their "
        "mean (one standard error)",
        f"{'':4}" + "".join(f"{name:>19}" for name in CHANNELS),
    ]
    for r in recorded:
        cells = []
        for name in CHANNELS:
            level, error = noise_of_pieces(r.clean[name])
            low, high = 100.0 * (level.min() - 1.0), 100.0 * (level.max() - 1.0)
            cells.append(f"{low:+.1f} {high:+.1f} ({100.0 * error:.2f})")
        lines.append(f"{r.number:<4}" + "".join(f"{cell:>19}" for cell in cells))
    return "\n".join([*lines, ""])


def peak_table(recorded: Sequence[Recorded]) -> str:
    """Where the broad peaks of gyro_z and accel_x are as time goes."""
    lines = [f"Frequency of the broad peaks in {PIECES} pieces of a recording [Hz]"]
    for r in recorded:
        for name, band in BUMPS.items():
            cells = "".join(f"{peak:>7.2f}" for peak in peaks_of_pieces(r.clean[name], band))
            lines.append(f"{r.number:<4}{name:9}{cells}")
    return "\n".join([*lines, ""])


def model_table(own: Sequence[Calibration], together: Calibration) -> str:
    """Terms of each model."""
    lines = ["Models"]
    for name in CHANNELS:
        for label, calibration in zip(_labels(), (*own, together), strict=True):
            lines.append(f"{name:9}{label:6} {calibration[name].model.title()}")
    return "\n".join([*lines, ""])


def _labels() -> tuple[str, ...]:
    return (*map(str, NUMBERS), "joint")


def parameter_table(together: Calibration) -> str:
    """Parameters of the joint models in field units, and how they differ between recordings."""
    lines = ["Joint models, 95 % intervals, standard deviation between recordings beyond chance"]
    for name in CHANNELS:
        fit = together[name]
        spread = fit.spread if isinstance(fit, JointFit) else {}
        for row in fit.estimates:
            usual, interval = row.usual, row.kind
            if row.kind in ("estimated", "bound"):
                interval = f"{usual.lower:.4g} .. {usual.upper:.4g}"
            between = f"{100.0 * spread[row.key]:.0f} %" if row.key in spread else ""
            lines.append(
                f"{name:9}{row.key:20} {usual.value:>10.4g}  {interval:22} {usual.unit:16} "
                f"{between:>5}"
            )
    return "\n".join([*lines, ""])


def numbers_table(together: Calibration) -> str:
    """Sensor numbers of the joint models."""
    return f"Joint models: sensor numbers\n{together.numbers}\n"


def misfit_table(own: Sequence[Calibration]) -> str:
    """Largest misfit of each recording's own models among the levels that are known well."""
    lines = [
        f"Own models: largest misfit of the Allan deviation, levels of more than {FEWEST_DOF:g} "
        "degrees of freedom (in standard errors)",
        f"{'':9}" + "".join(f"{f'recording {number}':>33}" for number in NUMBERS),
    ]
    for name in CHANNELS:
        lines.append(f"{name:9}" + "".join(f"{misfit_of(c[name]):>33}" for c in own))
    return "\n".join([*lines, ""])


def misfit_of(fit: Fit) -> str:
    """Misfit, where it is, how unusual it is there, and whether the fit is valid."""
    goodness = fit.goodness
    worst = goodness.worst
    if worst is None:
        return "no level known well"
    misfit, tau = worst
    residual = goodness.residual[int(np.argmin(np.abs(goodness.tau - tau)))]
    valid = "" if fit.valid else " not valid"
    return f"{100.0 * misfit:+.1f} % {tau:.4g} s ({residual:+.1f}){valid}"


def validity_table(own: Sequence[Calibration], how: str = "") -> str:
    """How many fits are valid, and why the others are not."""
    fits = [fit for calibration in own for fit in calibration.values()]
    lines = [f"Own models, {how}{sum(fit.valid for fit in fits)} of {len(fits)} are valid"]
    for number, calibration in zip(NUMBERS, own, strict=True):
        for name, fit in calibration.items():
            lacks = list(fit.reasons)
            if lacks:
                lines.append(f"{number} {name}: {', '.join(lacks)}")
    return "\n".join([*lines, ""])


def joint_table(together: Calibration) -> str:
    """Levels whose interval holds the joint curve, equality of the parameters, and misfits."""
    lines = [
        f"Joint model: fraction of levels below {SLOW:g} s and from {SLOW:g} s whose 95 % interval "
        f"holds it; largest misfit at more than {FEWEST_DOF:g} degrees of freedom",
        f"{'':9}{'valid':>6} {'equal, p':>9}"
        + "".join(f"{f'recording {number}':>28}" for number in NUMBERS),
    ]
    for name in CHANNELS:
        fit = together[name]
        p = fit.equality_p if isinstance(fit, JointFit) else float("nan")
        if isinstance(fit, JointFit) and np.isnan(p):
            p = fit.curves_p
        equal = f"{p:.2g}"
        cells = "".join(f"{held(fit, part) + off(fit, part):>28}" for part in parts_of(fit))
        lines.append(f"{name:9}{'yes' if fit.valid else 'no':>6} {equal:>9}{cells}")
    return "\n".join([*lines, ""])


def held(fit: Fit, part: Fit) -> str:
    """Fractions of a recording's levels, fast and slow, whose interval holds the joint curve."""
    wv = part.wv
    curve = fit.implied[: wv.tau.size]
    inside = (wv.lower <= curve) & (curve <= wv.upper)
    fast = wv.tau < SLOW
    return f"{100.0 * np.mean(inside[fast]):.0f} % {100.0 * np.mean(inside[~fast]):.0f} %"


def off(fit: Fit, part: Fit) -> str:
    """Largest misfit of the joint curve to a recording, and where."""
    known = np.flatnonzero(part.wv.dof > FEWEST_DOF)
    misfit = part.wv.allan_deviation[known] / np.sqrt(2.0 * fit.implied[known]) - 1.0
    worst = int(np.argmax(np.abs(misfit)))
    return f" {100.0 * misfit[worst]:+6.1f} % {part.wv.tau[known[worst]]:5.4g} s"


def budget_table(own: Sequence[Calibration], together: Calibration) -> str:
    """Errors after coasting, by the models of each recording and by the joint ones."""
    times = (10.0, 60.0)
    listed = " and ".join(f"{time:g} s" for time in times)
    lines = [
        f"gmwm budget: coasting for {listed}, 1 sigma, slow errors known at the start",
        f"{'':7}{'tilt [deg]':>18}{'heading [deg]':>18}{'velocity [m/s]':>18}{'position [m]':>18}",
    ]
    for label, calibration in zip(_labels(), (*own, together), strict=True):
        budget = gmwm.error_budget(calibration, times)
        level, heading = budget.total(), budget.total("gyro_z")
        angles = np.degrees([level["attitude"], heading["attitude"]])
        cells = [f"{a:.3g} {b:.3g}" for a, b in (*angles, level["velocity"], level["position"])]
        lines.append(f"{label:7}" + "".join(f"{cell:>18}" for cell in cells))
    return "\n".join([*lines, ""])


if __name__ == "__main__":
    main()
