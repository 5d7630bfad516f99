"""The group of all commands, and how it ends."""

from __future__ import annotations

import errno
import gc
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import BufferedWriter, FileIO, StringIO, TextIOWrapper
from typing import TYPE_CHECKING, TextIO

import click

from gmwm._core import __version__
from gmwm._core.memory import OUT_OF_MEMORY
from gmwm.cli.calibrate import calibrate, health
from gmwm.cli.compare import array, compare, fleet, motion
from gmwm.cli.demo import demo, reproduce
from gmwm.cli.navigate import navigate
from gmwm.cli.numbers import bound, budget, certify, export, reduce, sheet
from gmwm.cli.options import with_hint
from gmwm.errors import InputError, printable

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer as Buffer

_EXIT_INPUT, _EXIT_INTERRUPTED, _EXIT_PIPE = 2, 130, 141  # the latter two as shells have them


class _Group(click.Group):
    """Commands for which the system may refuse a file or a process."""

    def invoke(self, context: click.Context) -> object:
        try:
            return super().invoke(context)
        except _OutputError:
            raise
        except OSError as error:  # click takes a broken pipe for that of its output
            place = "" if error.filename is None else f"{error.filename}: "
            raise InputError(
                f"{place}the system cannot open a file or start a process "
                f"({error.strerror or error}): close other programs, or check the path"
            ) from error


@click.group(
    cls=_Group,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"]},
)
@click.version_option(__version__, prog_name="gmwm")
@click.pass_context
def cli(context: click.Context) -> None:
    """Stochastic error models of inertial sensors from static recordings."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


_COMMANDS = (calibrate, fleet, compare, array, demo, budget, health)
for _command in (*_COMMANDS, bound, reduce, certify, export, sheet, navigate, motion, reproduce):
    cli.add_command(_command)


def main() -> None:
    """Entry point: bad input is one sentence and exit code 2, never a traceback."""
    # Most of what is made is of imports and stays: looking for garbage there takes 0.2 s.
    gc.set_threshold(100_000)
    # Before numpy is loaded: matrices are small, and threads for each product cost more than they
    # save.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    # None where who started us closed them: what is printed then goes nowhere.
    sys.stdout, sys.stderr = sys.stdout or StringIO(), sys.stderr or StringIO()
    sys.stdout, sys.stderr = map(_told_apart, (sys.stdout, sys.stderr))
    try:
        with _ended_as_interrupted() as ended:
            status = _run()
        sys.stdout.flush()
        if status == _EXIT_INTERRUPTED and ended:
            status = 128 + ended[0]
    except _OutputError as error:
        _discard_output()
        status = _EXIT_PIPE
        if error.errno not in (errno.EPIPE, errno.EINVAL):
            status = _failed(f"the output cannot be written ({error.strerror}): send it elsewhere")
    sys.exit(status)


class _OutputError(OSError):
    """What is printed cannot be written."""


class _Output(FileIO):
    """Standard output or standard error, whose failures are distinguished from those of files."""

    def write(self, data: Buffer, /) -> int:
        try:
            return super().write(data)
        except OSError as error:
            raise _OutputError(*error.args) from None


def _told_apart(stream: TextIO) -> TextIO:
    """A stream whose errors are `_OutputError`; what its encoding lacks is written as an escape."""
    if not isinstance(stream, TextIOWrapper):
        return stream
    stream.reconfigure(errors="backslashreplace")
    if not isinstance(getattr(stream.buffer, "raw", stream.buffer), FileIO):
        return stream
    raw = BufferedWriter(_Output(stream.fileno(), "wb", closefd=False))
    encoding, flushes = stream.encoding, stream.line_buffering
    return TextIOWrapper(raw, encoding, stream.errors, line_buffering=flushes)


@contextmanager
def _ended_as_interrupted() -> Iterator[list[int]]:
    """Let signals end a process as an interrupt does, leaving nothing; yields those that come."""
    came: list[int] = []

    def end(number: int, _: object) -> None:
        came.append(number)
        # A terminal that closes sends two: the second would end what cleans up after the first.
        for each in usual:
            signal.signal(each, signal.SIG_IGN)
        if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # of a shell that runs us behind it
            raise KeyboardInterrupt
        signal.raise_signal(signal.SIGINT)

    numbers = [getattr(signal, name, None) for name in ("SIGTERM", "SIGHUP")]
    usual = [n for n in numbers if n is not None and signal.getsignal(n) is signal.SIG_DFL]
    for number in usual:
        signal.signal(number, end)
    try:
        yield came
    finally:
        for number in usual if not came else ():
            signal.signal(number, signal.SIG_DFL)


def _run() -> int:
    """Run the command; its exit status."""
    try:
        return int(cli.main(prog_name="gmwm", standalone_mode=False) or 0)
    except InputError as error:
        return _failed(with_hint(error))
    except MemoryError:
        return _failed(OUT_OF_MEMORY)
    except click.ClickException as error:
        return _failed(printable(error.format_message()))
    except click.Abort:
        return _interrupted()
    except SystemError as error:
        # What is interrupted while compiled code is loaded; click knows it by no other name.
        if not isinstance(error.__cause__, KeyboardInterrupt):
            raise
        return _interrupted()
    except SystemExit as stop:
        if stop.code == 0:  # of click, after it has answered a shell that completes a line
            return 0
        _discard_output()  # of click and rich, where nobody reads on, as head does
        return _EXIT_PIPE


def _interrupted() -> int:
    _failed("interrupted, no file is half-written")
    # Python notes an interrupt inside text that it runs, as where a dataclass is made, and ends by
    # that signal in place of the status unless other text was run since.
    exec("")
    return _EXIT_INTERRUPTED


def _failed(sentence: str) -> int:
    with suppress(OSError):
        click.echo(f"gmwm: {sentence}", err=True)
    return _EXIT_INPUT


def _discard_output() -> None:
    """Let what is still in the buffer go nowhere: at its end Python tries to write it again."""
    with suppress(OSError), open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), sys.stdout.fileno())
