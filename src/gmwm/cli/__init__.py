"""The command line: parse, call, print."""

from gmwm.cli.main import cli as cli, main as main
