"""What the entry point makes of what ends a command."""

import subprocess
import sys

import pytest

from gmwm.cli.main import _run, cli


def ends_with(error):
    def command(**_):
        raise error

    return command


def test_an_interrupt_while_compiled_code_is_loaded_is_one(monkeypatch, capsys):
    error = SystemError("<method> returned a result with an exception set")
    monkeypatch.setattr(cli, "main", ends_with(error))
    with pytest.raises(SystemError, match="method"):  # others of the system are not hidden
        _run()
    error.__cause__ = KeyboardInterrupt()
    assert _run() == 130
    assert capsys.readouterr().err == "gmwm: interrupted, no file is half-written\n"


def test_an_interrupt_while_a_class_is_made_is_said_in_the_status(tmp_path):
    """Python ends a module that was run with -m by the signal then, whatever its status."""
    (tmp_path / "run.py").write_text(
        "from gmwm.cli.main import cli, main\n"
        "def command(**_):\n"
        "    try:\n"
        "        exec('raise KeyboardInterrupt')\n"
        "    except KeyboardInterrupt:\n"
        "        import click\n"
        "        raise click.Abort from None\n"
        "cli.main = command\n"
        "main()\n"
    )
    done = subprocess.run([sys.executable, "-m", "run"], cwd=tmp_path, capture_output=True)
    assert (done.returncode, done.stderr.split()[1]) == (130, b"interrupted,")


@pytest.mark.parametrize("number", ["EPIPE", "ENOSPC"])
def test_only_what_is_printed_is_trouble_with_the_output(tmp_path, number):
    """A file or a pipe to a process that breaks inside a command is named as such."""
    (tmp_path / "run.py").write_text(
        "import errno, os\n"
        "from gmwm.cli.main import cli, main\n"
        "def fails(**_):\n"
        f"    raise OSError(errno.{number}, os.strerror(errno.{number}))\n"
        "cli.commands['budget'].callback = fails\n"
        "main()\n"
    )
    command = [sys.executable, "run.py", "budget", "a.json"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "gmwm: the system cannot open a file or start a process (" in done.stderr
    assert "output" not in done.stderr and "Traceback" not in done.stderr
