"""``gmwm reproduce``: parse, run, print, write."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gmwm.cli.console import progress_bar
from gmwm.cli.options import PATH, option, output_folder, read_recording, reading_options
from gmwm.errors import InputError

if TYPE_CHECKING:
    import pyarrow as pa

    from gmwm.readers import Recording
    from gmwm.study import Study

EXPERIMENTS = (
    "table2",
    "table3",
    "table4",
    "five-gm",
    "fig2",
    "fig3",
    "fig4",
    "appendix-a",
    "fig5",
    "fig6",
    "fig7",
    "fig8",
    "fig9",
    "selection",
    "weights2",
    "weights3",
    "weights4",
)


NAVIGATION = ("fig5", "fig6", "fig7", "fig8", "fig9")
ROTATED = ("fig8", "fig9")


@click.command()
@click.argument("experiment", type=click.Choice(EXPERIMENTS), metavar="EXPERIMENT")
@output_folder("gmwm-study", "Folder for tables, figures and raw estimates.")
@option("--runs N", "Number of simulated series.", type=click.IntRange(min=2))
@option("--seed N", "", type=click.IntRange(min=0), default=0)
@option("--jobs N", "Processes; one a core by default.", type=click.IntRange(min=1))
@option(
    "--method NAME",
    "Only this method, e.g. GMWM; repeat. By default all of the table.",
    name="methods",
    multiple=True,
)
@option("--resume", "Go on with the runs that the folder holds.")
@option("--cluster ADDRESS", "Dask scheduler that does the runs, e.g. tcp://10.0.0.1:8786.")
@option(
    "--recording FILE",
    "fig5 to fig9: a real static recording in place of a simulated one; the first is "
    "calibrated, the others are navigated with; repeat.",
    name="recordings",
    multiple=True,
    type=PATH,
)
@option(
    "--rotate",
    "fig8, fig9: calibrate every recording in turn and navigate with the others; "
    "further filters, intervals over recordings.",
)
@reading_options
def reproduce(
    experiment: str,
    output: Path,
    runs: int | None,
    seed: int,
    jobs: int | None,
    methods: tuple[str, ...],
    resume: bool,
    cluster: str | None,
    recordings: tuple[Path, ...],
    rotate: bool,
    **reading: Any,
) -> None:
    """Repeat an experiment of the paper, or our own harder one.

    The paper is Stebler and others (2012).

    table2, table3 and table4 print errors (root mean square, relative, over the Cramer-Rao
    bound), coverage of the 95 % intervals and the paper's own errors; fig2, fig3 and fig4 draw
    the same runs as boxplots; five-gm is white noise + five Gauss-Markov processes; appendix-a
    shows the bias of lines in the Allan plot; weights2, weights3 and weights4 compare weights and
    wavelets of the method of moments; selection counts how often the true model is chosen. fig5
    and fig6 show one gyro with lines and with the fitted model; fig7 and fig8 navigate a
    helicopter, fig9 a car, with GNSS outages, by filters with different calibrations.
    Times are in seconds, rates in 1/s. Raw estimates are kept in Parquet.

    \b
    Example:
      gmwm reproduce table2 --runs 200 -o study
      gmwm reproduce fig2 --runs 200 -o study --resume
      gmwm reproduce fig9 --recording a.csv --recording b.csv --rate 100 \\
        --gyro-unit deg/s --accel-unit g --rotate
    """
    from gmwm._core.files import folder_to_fill

    processes = jobs or os.cpu_count() or 1
    if experiment in NAVIGATION:
        _check_alone(
            experiment,
            {
                "--method": methods,
                "--cluster": cluster,
                "--resume": resume and not rotate,
                "--rotate": rotate and experiment not in ROTATED,
            },
        )
        given = [read_recording(file, **reading) for file in recordings]
        with folder_to_fill(output) as folder:
            options = {"runs": runs, "seed": seed, "jobs": processes}
            options |= {"resume": resume} if rotate else {}
            _navigated(experiment, folder, given, rotate, **options)
        return
    _check_alone(experiment, {"--recording": recordings, "--rotate": rotate})
    if experiment in ("appendix-a", "selection"):
        _check_alone(experiment, {"--method": methods, "--resume": resume, "--cluster": cluster})
        with folder_to_fill(output) as folder:
            _alone(experiment, folder, runs, seed, processes)
        return
    with folder_to_fill(output) as folder:
        work: dict[str, Any] = {"jobs": processes, "resume": resume, "cluster": cluster}
        _simulated(experiment, folder, seed, runs=runs, methods=methods or None, **work)


def _simulated(experiment: str, folder: Path, seed: int, *, runs: int | None, **work: Any) -> None:
    """Tables and boxplots of simulated series."""
    from gmwm.study import FIGURES, STUDIES, boxplots, run_study

    study = FIGURES.get(experiment) or STUDIES[experiment]
    try:
        with progress_bar(study.name, "runs") as bar:
            count = runs or study.runs
            table = run_study(study, folder, runs=count, seed=seed, progress=bar, **work)
    except KeyboardInterrupt:
        click.echo(f"finished runs are kept in {folder}: add --resume to go on", err=True)
        raise
    written = [_raw(experiment, table, folder)]
    if experiment in FIGURES:
        written += boxplots(study, table, folder / experiment)
    else:
        written += _tables(study, table, seed, folder)
    click.echo("\n".join(f"wrote {path}" for path in written))


def _check_alone(experiment: str, options: Mapping[str, object]) -> None:
    for name, given in options.items():
        if given:
            raise InputError(f"{experiment} has no option {name}: leave it out")


def _raw(experiment: str, table: pa.Table, folder: Path) -> Path:
    import pyarrow.parquet as pq

    from gmwm._core.files import moved_into_place

    target = folder / f"{experiment}.parquet"
    with moved_into_place(target) as temporary:
        pq.write_table(table, temporary)
    return target


def _tables(study: Study, table: pa.Table, seed: int, folder: Path) -> list[Path]:
    from gmwm._core.files import written
    from gmwm.study import summarise

    summary = summarise(study, table, seed)
    targets = [folder / f"{study.name}.txt", folder / f"{study.name}.md"]
    for target, text in zip(targets, (str(summary), summary.markdown()), strict=True):
        with written(target) as stream:
            stream.write(text + "\n")
    click.echo(f"{summary}\n")
    return targets


def _alone(experiment: str, folder: Path, runs: int | None, seed: int, jobs: int) -> None:
    """An experiment that is a table of its own kind."""
    from gmwm._core.files import written
    from gmwm.study import choice_study, choice_table, converge, convergence_table

    if experiment == "selection":
        report = choice_table(choice_study(runs or 100, seed, jobs))
    else:
        report = convergence_table(converge(runs or 200, seed, jobs))
    target = folder / f"{experiment}.txt"
    with written(target) as stream:
        stream.write(report + "\n")
    click.echo(f"{report}\n\nwrote {target}")


def _navigated(
    experiment: str, folder: Path, recordings: list[Recording], rotate: bool, **options: Any
) -> None:
    """Figures 5 to 9; 8 and 9 with every recording calibrated in turn if ``rotate``."""
    from gmwm.study import reproduce_figure, reproduce_rotation

    run = reproduce_rotation if rotate else reproduce_figure
    try:
        with progress_bar(experiment, "recordings" if rotate else "runs") as bar:
            text, paths = run(experiment, folder, recordings=recordings, progress=bar, **options)
    except KeyboardInterrupt:
        if rotate:
            click.echo(f"finished work is kept in {folder}: add --resume to go on", err=True)
        raise
    click.echo(text)
    click.echo("\n" + "\n".join(f"wrote {path}" for path in paths))
