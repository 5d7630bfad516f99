"""``gmwm demo`` and ``gmwm reproduce``: what is simulated, and compared with the truth."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gmwm._core.files import folder_to_fill, moved_into_place, moved_together, write_text
from gmwm.cli.calibrate import folder_of_results, show, write_files
from gmwm.cli.options import folder_to_write, options, print_result, progress_bar, read_recording
from gmwm.errors import InputError

if TYPE_CHECKING:
    import pyarrow

    from gmwm.process import Model


@click.command()
@options(
    """
    -o --output  Folder for calibration.json, report.html, imu.yaml.
    --hours NUMBER  Length of the simulated recording in hours.
    --seed N  Seed of the noise.
    -v --verbose  Print the error model of each axis and all notices too.
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


_SIMULATED = (
    *("table2", "table3", "table4", "five-gm", "fig2", "fig3", "fig4"),
    *("weights2", "weights3", "weights4", "em4", "starts4", "arma4", "indirect2"),
)
_SENSORS = ("fig1", "fig5", "fig6", "table5", "table6")
_NAVIGATED, _ROTATED = ("fig7", "fig8", "fig9"), ("fig8", "fig9")
_TESTS = ("appendix-a", "selection")

Found = tuple[str, Sequence[Path]]
"""What to print, and the files that were written."""


@click.command()
@click.argument(
    "experiment",
    type=click.Choice([*_SIMULATED, *_SENSORS, *_NAVIGATED, *_TESTS]),
    metavar="EXPERIMENT",
)
@options(
    """
    -o --output  Folder for tables, figures and raw estimates.
    --runs N  Number of simulated series.
    --seed N  Seed of the first series.
    --jobs
    --method NAME  Only this method, e.g. GMWM; repeat. By default all of the table.
    --resume
    --cluster
    --recording FILE  fig1, fig5 to fig9: a real static recording instead of a simulated one;
        fig7 to fig9 calibrate the first and navigate with the others. table5, table6: beside the
        simulated one. Repeat.
    --rotate  fig8, fig9: calibrate every recording in turn and navigate with the others; further
        filters, intervals over recordings.
    --reading
    """,
    output=folder_to_write("gmwm-study"),
    runs={"type": click.IntRange(min=2)},
    seed={"type": click.IntRange(min=0), "default": 0},
    method={"multiple": True},
    recording={"multiple": True},
)
def reproduce(
    experiment: str, output: Path, recording: Sequence[Path], rotate: bool, **options: Any
) -> None:
    """Repeat an experiment of the paper, or a harder one.

    The paper is Stebler and others (2012).

    table2, table3 and table4 print errors (root mean square, relative, over the Cramer-Rao
    bound), coverage of the 95 % intervals and the paper's own errors; fig2, fig3 and fig4 draw
    the same runs as boxplots; five-gm is white noise + five Gauss-Markov processes; appendix-a
    shows the bias of lines in the Allan plot; weights2, weights3 and weights4 compare weights and
    wavelets of the method of moments; em4, starts4 and arma4 try EM, starting values and ARMA(3,2)
    for three Gauss-Markov processes; indirect2 simulates the moments; selection counts how often
    the true model is chosen. fig1, fig5 and fig6 show the way from a signal to its model, the lines
    and the model of a gyro and an accelerometer; table5 and table6 have the paper's parameters
    beside ours; fig7 and fig8 navigate a helicopter, fig9 a car, with GNSS outages, by filters with
    different calibrations.
    Times are in seconds, rates in 1/s. Raw estimates are kept in Parquet.

    \b
    Example:
      gmwm reproduce table2 --runs 200 -o study
      gmwm reproduce fig2 --runs 200 -o study --resume
      gmwm reproduce fig9 --recording a.csv --recording b.csv --rate 100 \\
        --gyro-unit deg/s --accel-unit g --rotate
    """
    from gmwm.study import reproduce_figure, reproduce_rotation, reproduce_sensor

    alone = {name: options.pop(name) for name in ("method", "cluster", "resume")}
    known = set(alone) if experiment in _SIMULATED else set()
    if experiment in _SENSORS:
        known = {"recording"}
    if experiment in _NAVIGATED:
        known = {"recording", "resume"} | ({"rotate"} if experiment in _ROTATED else set())
    for name, each in {**alone, "recording": recording, "rotate": rotate}.items():
        if each and name not in known:
            raise InputError(f"{experiment} has no option --{name}: leave it out")
    work = {name: options.pop(name) for name in ("runs", "seed", "jobs")}
    recordings = [read_recording(file, **options) for file in recording]
    with folder_to_fill(output) as folder:
        try:
            if experiment in _SIMULATED:
                text, paths = _simulated(experiment, folder, **work, **alone)
            elif experiment in _SENSORS:
                own = {"seed": work["seed"], "recordings": recordings}
                with progress_bar(experiment, "recordings") as bar:
                    text, paths = reproduce_sensor(experiment, folder, progress=bar, **own)
            elif experiment in _NAVIGATED:
                work |= {"recordings": recordings, "resume": alone["resume"]}
                run = reproduce_rotation if rotate else reproduce_figure
                with progress_bar(experiment, "recordings" if rotate else "runs") as bar:
                    text, paths = run(experiment, folder, progress=bar, **work)
            else:
                text, paths = _tested(experiment, folder, **work)
        except KeyboardInterrupt:
            if "resume" in known:
                click.echo(f"finished runs are in {folder}: add --resume to continue", err=True)
            raise
    print_result(text, *paths)


def _simulated(
    experiment: str, folder: Path, *, runs: int | None, seed: int, method: Any, **work: Any
) -> Found:
    from gmwm.study import FIGURES, STUDIES, boxplots, run_study, summarise

    study = FIGURES.get(experiment) or STUDIES[experiment]
    with progress_bar(study.name, "runs") as bar:
        work |= {"methods": method or None, "progress": bar}
        table = run_study(study, folder, runs=runs or study.runs, seed=seed, **work)
    raw = _raw(table, folder / f"{experiment}.parquet")
    if experiment in FIGURES:
        return "", [raw, *boxplots(study, table, folder / experiment)]
    text = str(summarise(study, table, seed))
    return text, [raw, write_text(folder / f"{study.name}.txt", text)]


def _raw(table: pyarrow.Table, path: Path) -> Path:
    """Keep raw estimates."""
    import pyarrow.parquet as pq

    with moved_into_place(path) as temporary:
        pq.write_table(table, temporary)
    return path


def _tested(experiment: str, folder: Path, *, runs: int | None, seed: int, jobs: int) -> Found:
    from gmwm import study

    stem, paths = folder / experiment, []
    if experiment == "selection":
        text = study.choice_table(study.choice_study(runs or 100, seed, jobs))
    else:
        rows = study.converge(runs or 200, seed, jobs)
        text = study.convergence_table(rows)
        paths = [_raw(study.raw_estimates(rows), stem.with_suffix(".parquet"))]
        paths += study.saved(study.convergence_boxes(rows), stem)
    return text, [write_text(stem.with_suffix(".txt"), text), *paths]
