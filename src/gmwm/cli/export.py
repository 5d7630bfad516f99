"""``gmwm export``: numbers for a filter in the file of the program that runs it."""

from __future__ import annotations

from pathlib import Path

import click

from gmwm._core.tables import plain_table
from gmwm.cli.hints import with_option
from gmwm.cli.options import FILE_TO_WRITE, PATH, options
from gmwm.errors import InputError


@click.command()
@click.argument("files", metavar="FILE...", nargs=-1, type=PATH)
@options(
    """
    --to NAME  The program; see --list.
    --horizon S  Longest outage that the numbers cover, in seconds; 60 by default.
    --form FORM  N+K, N+GM, ...: most programs hold one; state-space holds any.
    -o --output FILE  File to write instead of printing; .npz for state-space.
    --explain  Print what the numbers are, axis by axis, in place of the file.
    --force  Write the numbers although an axis is not valid.
    --list  List the programs.
    """,
    to={"name": "target"},
    output=FILE_TO_WRITE,
    list={"name": "listed"},
)
def export(
    files: tuple[Path, ...],
    target: str | None,
    horizon: float | None,
    form: str | None,
    output: Path | None,
    explain: bool,
    force: bool,
    listed: bool,
) -> None:
    """Write numbers for a filter as the program wants them.

    FILE is a calibration.json, or numbers that gmwm bound or gmwm reduce saved. Several files make
    one IMU, such as gyros and accelerometers of different rates. The numbers of a calibration are
    the smallest that are not overconfident for its error models; --explain has the details.

    Exit status: 0 if the numbers were written, 1 if an axis is not valid (nothing is written), 2 if
    the input cannot be used.

    \b
    Examples:
      gmwm export out/calibration.json --to openvins -o kalibr_imu_chain.yaml
      gmwm export gyro.json accel.json --to px4
      gmwm export --list
    """
    from gmwm.export import TARGETS, not_valid, refusal

    if listed:
        rows = [(t.name, t.title, t.form, t.file_name) for t in TARGETS.values()]
        click.echo(plain_table(("name", "program", "form", "file"), rows))
        return
    if not files or target is None:
        usage = "gmwm export calibration.json --to NAME (names: gmwm export --list)"
        raise InputError(f"gmwm export needs files and a program: {usage}")
    from gmwm import export as written, load
    from gmwm._core import checks

    checks.choice("--to", target, tuple(TARGETS))
    given = [load(file) for file in files]
    if explain:
        click.echo(TARGETS[target].explain(given, horizon, form), nl=False)
        return
    found = not_valid(given)
    if found and not force:
        why = refusal({name: with_option(each) for name, each in found.items()})
        click.echo(f"gmwm: {why}, or add --force", err=True)
        click.get_current_context().exit(1)
    text = written(given, target, horizon=horizon, form=form, path=output)
    click.echo(f"wrote {output}" if output else text, nl=output is not None)
