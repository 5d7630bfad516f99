"""The command line: parse, call, print."""

from gmwm.cli.main import cli, main

__all__ = ["cli", "main"]
