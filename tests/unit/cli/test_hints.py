"""Options that the command line adds to the library's messages."""

import ast
import re

import pytest

from gmwm.cli.main import cli
from gmwm.cli.options import HINTS, with_hint
from gmwm.errors import InputError
from places import REPOSITORY

ROOT = REPOSITORY / "src" / "gmwm"


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (("the rate is missing: give rate=100", "rate"),
         "the rate is missing: give rate=100 (on the command line: --rate 100)"),
        (("the rate is missing",), "the rate is missing"),
        (("there is no rate and no unit", "rate gyro-unit-missing", "give rate=100"),
         "there is no rate and no unit: give e.g. --rate 100 --gyro-unit deg/s"),
        (("the rates differ", "rate-contradicted", "give time=False"),
         f"the rates differ: {HINTS['rate-contradicted']}"),
        (("'x' is not a number", "no-number", "give other channels= and time="),
         f"'x' is not a number: {HINTS['no-number']}"),
        (("wrong", "unknown-code", "do this"), "wrong: do this"),
    ],
)  # fmt: skip
def test_a_hint_is_said_in_the_words_of_the_command_line(error, words):
    assert with_hint(InputError(*error)) == words


@pytest.mark.parametrize("code", HINTS)
def test_every_option_that_is_named_exists(code):
    options = {name for command in cli.commands.values() for p in command.params for name in p.opts}
    named = [word for word in HINTS[code].replace(",", " ").split() if word.startswith("-")]
    assert named
    assert options.issuperset(named)


@pytest.mark.parametrize(
    "room", ["readers", "diagnosis", "calibration", "export", "report", "ins", "study"]
)
def test_messages_of_the_library_name_no_option(room):
    """But with the whole command, as in comments of files."""
    for path in (ROOT / room).rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            text = node.value if isinstance(node, ast.Constant) else None
            text = re.sub(r"gmwm [a-z]+( --\w+| NAME)+", "", text) if isinstance(text, str) else ""
            assert not re.search(r"(?<![-\w])--[a-z]", text), path
