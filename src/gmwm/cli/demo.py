"""``gmwm demo``: a simulated recording, calibrated and compared with the truth."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from gmwm._core.files import folder_to_fill, moved_together
from gmwm.cli.calibrate import folder_of_results, show, write_files
from gmwm.cli.console import progress_bar
from gmwm.cli.options import options

if TYPE_CHECKING:
    from gmwm.calibration import Calibration
    from gmwm.process import Model


@click.command()
@options(
    """
    -o --output  Folder for calibration.json, report.html, imu.yaml.
    --hours NUMBER  Length of the simulated recording in hours.
    --seed N  Of the noise.
    -v --verbose  Print the error models, all notices and the truth beside the estimates too.
    --files  Only write files to try the other commands with: static.csv of a sensor at rest,
        imu.csv and fixes.csv of a drive with it.
    """,
    output=folder_of_results("gmwm-demo"),
    hours={"type": click.FloatRange(0.01, 100.0), "default": 1.0},
    seed={"type": int, "default": 1},
)
def demo(output: Path, hours: float, seed: int, verbose: bool, files: bool) -> None:
    """Simulate an IMU and calibrate it: the page that gmwm calibrate prints, and the truth.

    The IMU is a MEMS sensor of six axes at 100 Hz. Gyros have white noise and a Gauss-Markov
    process, accelerometers white noise and a random walk.

    \b
    Examples:
      gmwm demo --hours 4 --seed 2
      gmwm demo --files -o try
    """
    if files:
        write_files_to_try(output, hours, seed)
        return
    from gmwm.calibration import calibrate as run
    from gmwm.study import simulated_imu

    with folder_to_fill(output) as folder:
        recording, truth = simulated_imu(3600.0 * hours, seed)
        with progress_bar("calibrating", "channels") as bar:
            result = run(recording, progress=bar)
        written = write_files(result, folder, recording)
    show(result, [*_truth_lines(truth), *written], verbose=verbose)
    if verbose:
        forms = {name: model.opened() for name, model in truth.items()}
        with progress_bar("fitting", "channels") as bar:
            fitted = run(recording, forms, progress=bar)
        click.echo("\nTruth and estimate, the form of each model known:\n")
        show_truth(fitted, truth)


def _truth_lines(truth: dict[str, Model]) -> list[str]:
    """The truth of the simulation, of one axis of each sensor."""
    from gmwm._core.text import wrapped
    from gmwm._core.units import SI_UNIT, customary_unit

    parts = []
    for quantity, unit in SI_UNIT.items():
        values = []
        for item in truth[f"{quantity}_x"].parameters:
            name, per_si = customary_unit(item.parameter.unit, quantity, unit)
            values.append(f"{item.key} {(item.value or 0.0) * per_si:.4g} {name}")
        parts.append(f"{quantity} {', '.join(values)}")
    return wrapped(f"truth: {'; '.join(parts)}", indent=2)


def write_files_to_try(output: Path, hours: float, seed: int) -> None:
    """Write the files, and print what can be done with them."""
    from gmwm.study import write_demo_files

    with folder_to_fill(output) as folder, moved_together(folder) as new:
        arm = write_demo_files(new, 3600.0 * hours, seed)
    for name in ("static.csv", "imu.csv", "fixes.csv"):
        click.echo(f"wrote {output / name}")
    lever_arm = ",".join(f"{each:g}" for each in arm)
    click.echo(
        f"\nTry:\n"
        f"  gmwm health {output / 'static.csv'}\n"
        f"  gmwm calibrate {output / 'static.csv'} -o {output / 'out'}\n"
        f"  gmwm navigate --imu {output / 'imu.csv'} --gnss {output / 'fixes.csv'} \\\n"
        f"    --sensors {output / 'out' / 'calibration.json'} --lever-arm {lever_arm}"
    )


def show_truth(fitted: Calibration, truth: dict[str, Model]) -> None:
    """One table of truth beside estimate."""
    from gmwm._core.tables import plain_table
    from gmwm._core.text import wrapped
    from gmwm.study import compare

    table, shown = [], [row for name, fit in fitted.items() for row in compare(fit, truth[name])]
    for row in shown:
        cells = [f"{row.estimate:.4g}", f"{row.lower:.4g} .. {row.upper:.4g}"]
        if not row.determined:
            cells = ["-", "too short to tell"]
        elif row.lower == 0.0:
            cells[1] = f"<= {row.upper:.4g}"
        cells[1] += "" if row.covered else " *"
        table.append((row.channel, row.what, f"{row.truth:.4g}", *cells, row.unit))
    click.echo(
        plain_table(("channel", "parameter", "truth", "estimate", "95 % interval", "unit"), table)
    )
    determined = [row.covered for row in shown if row.determined]
    text = f"{len(determined)} of {len(shown)} parameters are determined by this record; "
    text += f"{sum(determined)} of these {len(determined)} intervals hold the truth (* does not)."
    click.echo("\n".join(wrapped(text)))
