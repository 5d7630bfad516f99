"""``gmwm export``: numbers for a filter in the file of the program that runs it."""

from __future__ import annotations

from pathlib import Path

import click

from gmwm.cli.options import FILE_TO_WRITE, PATH, options
from gmwm.errors import InputError


@click.command()
@click.argument("files", metavar="FILE...", nargs=-1, type=PATH)
@options(
    """
    --to NAME  The program; see --list.
    --horizon S  Longest outage that the numbers cover, in seconds; by default 1 (keyframes, scans)
        or 60, see --list.
    --form FORM  N+K, N+GM, ...: most programs hold one; state-space holds any.
    -o --output FILE  File to write instead of printing; .npz for state-space.
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
    listed: bool,
) -> None:
    """Write numbers for a filter as the program wants them.

    FILE is a calibration.json, or numbers that gmwm bound or gmwm reduce saved. Several files make
    one IMU, such as gyros and accelerometers of different rates. The numbers of a calibration are
    the smallest that are not overconfident for its error models; comments explain them.

    \b
    Examples:
      gmwm export out/calibration.json --to openvins -o kalibr_imu_chain.yaml
      gmwm export gyro.json accel.json --to px4
      gmwm export out/calibration.json --to kfgins --horizon 30
      gmwm export --list
    """
    if listed:
        _list()
        return
    if not files or target is None:
        raise InputError(
            "gmwm export needs files and a program: gmwm export calibration.json --to NAME "
            "(names: gmwm export --list)"
        )
    from gmwm import export as written, load

    text = written([load(file) for file in files], target, horizon=horizon, form=form, path=output)
    click.echo(f"wrote {output}" if output else text, nl=output is not None)


def _list() -> None:
    from gmwm._core.tables import plain_table
    from gmwm.export import TARGETS

    rows = [
        (t.name, t.title, t.form, "" if t.form == "full model" else f"{t.horizon:g} s")
        for t in TARGETS.values()
    ]
    click.echo(plain_table(("name", "program", "form", "horizon"), rows))
