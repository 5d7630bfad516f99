"""Numbers for filters from a data sheet: ``gmwm sheet``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gmwm._core.text import brief, bullets, wrapped
from gmwm.cli.console import print_result
from gmwm.cli.options import FILE_TO_WRITE, PATH, options
from gmwm.errors import InputError

_CAUTIOUS = 0.5  # NEES below which predicted errors are 1.4 times the true ones

if TYPE_CHECKING:
    from gmwm.filter_numbers import FilterNumbers


@click.command()
@click.argument("source", metavar="SHEET", required=False)
@options(
    """
    --horizon S
    --form TEXT  N+K, N+GM or N+K+GM.
    --unit-spread FACTOR  How many times as noisy as typical your unit may be.
    --rate HZ  Sampling rate, for programs that want it beside the numbers.
    --imu FILE  Numbers in use, to be judged: a file of Kalibr, OpenVINS, VINS or their like.
    --report HTML  Page to write: the models in the Allan plot, and the numbers.
    -o --output JSON  File to save the numbers in, for gmwm export.
    --list  List the sensors whose data sheets are installed.
    --units
    --json
    """,
    form={"default": "N+K"},
    unit_spread={"type": float, "default": 1.25},
    rate={"type": float, "default": float("nan"), "show_default": False},
    imu={"type": PATH},
    report=FILE_TO_WRITE,
    output=FILE_TO_WRITE,
    list={"name": "listed"},
)
def sheet(
    source: str | None,
    horizon: float,
    form: str,
    imu: Path | None,
    report: Path | None,
    output: Path | None,
    listed: bool,
    units: str,
    as_json: bool,
    **how: float,
) -> None:
    """Find numbers for a filter from a data sheet, where there is no recording.

    SHEET is a YAML file such as 'gyro: {N: 0.15 deg/sqrt(h), B: 7 deg/h}', or a sensor of --list.
    Write lowest_deviation in place of B where the sheet calls the lowest point of the Allan plot
    bias instability: many do. All keys: docs/data-sheets.md.
    Two numbers leave much open: N and K are found for every kind of error model that agrees with
    them; printed first is what covers them all. An hour of recording tells more.

    \b
    Examples:
      gmwm sheet --list
      gmwm sheet stim300 --rate 200 -o numbers.json
      gmwm export numbers.json --to kalibr
      gmwm sheet mine.yaml --imu imu.yaml
    """
    from gmwm.datasheet import datasheet, sheets

    if listed:
        for name in sheets():
            each = datasheet(name)
            about = f"{each.document}{'; N only' if each.leaves_K_open else ''}"
            click.echo("\n".join(wrapped(about, f"{name:<11} ", 12)))
        return
    if source is None:
        raise InputError("gmwm sheet needs a YAML file or a sensor (sensors: gmwm sheet --list)")
    found = datasheet(source)
    if found.leaves_K_open and not (output or report or imu or as_json):
        click.echo(found.text(units, form, horizon))
        return
    numbers = found.numbers(form, horizon, **how)
    if output is not None:
        numbers.save(output)
    answer = _for_filter(found.name, numbers, how["unit_spread"])
    if report is not None:
        from gmwm.report import write_sheet_report

        write_sheet_report(found, report, numbers, answer)
    parts = [answer, found.text(units, form, horizon)]
    if imu is not None:
        parts.append(
            _judged(found.judged(_in_use(imu, how["rate"]), horizon, how["unit_spread"]), imu)
        )
    print_result(numbers, report, output, text="\n\n".join(parts), as_json=as_json)


def _for_filter(name: str, numbers: FilterNumbers, unit_spread: float) -> str:
    """N, K and the start bias of each sensor in SI by key, and how consistent they are."""
    from gmwm._core.units import SI_UNIT
    from gmwm.filter_numbers import shown_unit
    from gmwm.report import filter_key

    title = (
        f"{name}, for your filter (keys of Kalibr, OpenVINS): covers all models that agree with "
        f"the sheet, units up to {unit_spread:g} times as noisy, outages up to "
        f"{numbers.horizon:g} s"
    )
    lines = wrapped(title)
    for quantity, each in numbers.items():
        for letter in "NK":
            (unit, scale), value = shown_unit(letter, quantity, "field"), getattr(each, letter)
            si = f"{value:.2e} {shown_unit(letter, quantity, 'si')[0]}"
            key = filter_key(quantity, letter)
            lines.append(f"{key:<27}  {letter} {si:<25}  {brief(value * scale, 3)} {unit}")
    starts = [f"{k} {n.initial_sd:.2e} {SI_UNIT[k]}" for k, n in numbers.items() if n.initial_sd]
    lines += (
        wrapped(
            f"start bias, 1 sigma (with the turn-on bias of the sheet, if any): {', '.join(starts)}"
        )
        if starts
        else []
    )
    worst = [f"{k} {max(n.nees.values()):.2g}" for k, n in numbers.items()]
    warnings = [n for each in numbers.values() for n in each.notices if n.severity == "warning"]
    lines += bullets(dict.fromkeys(map(str, warnings)))
    lines += wrapped(f"NEES at most {', '.join(worst)} (1: consistent, below: cautious)")
    return "\n".join([*lines, *wrapped("An hour of recording tells more: gmwm calibrate")])


def _in_use(imu: Path, rate: float) -> Any:
    from gmwm.export import read_numbers

    found = read_numbers(imu, rate)
    if not {"gyro", "accel"} & {*found}:
        raise InputError(f"{imu}: has numbers by axis: judge one by gmwm certify, with a recording")
    return found


def _judged(nees: dict[str, tuple[float, float]], imu: Path) -> str:
    """The range of NEES of a filter with numbers in use, by sensor."""
    lines = wrapped(f"{imu}: NEES of a filter with these numbers, over the models (1: consistent)")
    rows = (f"{k}: {a:.2g} to {b:.2g}, {_verdict(a, b)}" for k, (a, b) in nees.items())
    return "\n".join([*lines, *bullets(rows)])


def _verdict(least: float, largest: float) -> str:
    """Of the NEES in typical and in noisy units."""
    if largest > 1.0:
        return "overconfident" if least > 1.0 else "overconfident where the sensor is noisier"
    return "cautious" if largest < _CAUTIOUS else "consistent"
