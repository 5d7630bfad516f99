"""The group of all commands, and how it ends."""

from __future__ import annotations

import sys
from io import TextIOWrapper

import click

from gmwm import __version__
from gmwm._core.memory import OUT_OF_MEMORY
from gmwm.cli.budget import budget
from gmwm.cli.calibrate import calibrate
from gmwm.cli.demo import demo
from gmwm.cli.health import health
from gmwm.cli.hints import with_hint
from gmwm.cli.navigate import navigate
from gmwm.cli.reproduce import reproduce
from gmwm.errors import InputError, printable

_EXIT_INPUT = 2


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="gmwm")
def cli() -> None:
    """Stochastic error models of inertial sensors from static recordings."""


for _command in (calibrate, demo, budget, health, navigate, reproduce):
    cli.add_command(_command)


def main() -> None:
    """Entry point: bad input is one sentence and exit code 2, never a traceback."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            # What the encoding of a terminal lacks is written as an escape.
            stream.reconfigure(errors="backslashreplace")
    try:
        cli.main(standalone_mode=False)
    except InputError as error:
        click.echo(f"gmwm: {with_hint(error)}", err=True)
        sys.exit(_EXIT_INPUT)
    except MemoryError:
        click.echo(f"gmwm: {OUT_OF_MEMORY}", err=True)
        sys.exit(_EXIT_INPUT)
    except click.exceptions.Exit as error:
        sys.exit(error.exit_code)
    except click.ClickException as error:
        click.echo(f"gmwm: {printable(error.format_message())}", err=True)
        sys.exit(_EXIT_INPUT)
    except click.Abort:
        click.echo("gmwm: interrupted, no file is half-written", err=True)
        sys.exit(130)
