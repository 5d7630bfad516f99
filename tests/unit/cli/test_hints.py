"""Options that the command line adds to the library's messages."""

import ast
import re

import numpy as np
import pytest

from gmwm.cli.console import HINTS, with_hint, with_option
from gmwm.cli.main import cli
from gmwm.errors import InputError
from gmwm.issues import Notice
from gmwm.readers import read
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
        (("wrong", "unknown-code", "do this"), "wrong: do this"),
    ],
)  # fmt: skip
def test_a_hint_is_said_in_the_words_of_the_command_line(error, words):
    assert with_hint(InputError(*error)) == words


def test_the_unit_that_is_advised_is_that_of_gravity(tmp_path):
    path = tmp_path / "a.csv"
    rows = np.random.default_rng(1).normal(size=(100, 3)) * 1e-3 + [0.1, -0.2, 9.8]
    np.savetxt(path, rows, delimiter=",", header="ax [g],ay [g],az [g]", comments="")
    with pytest.raises(InputError, match="is gravity in m/s") as caught:
        read(path, rate=100.0)
    assert with_hint(caught.value).endswith("give e.g. --accel-unit m/s^2")


def test_rows_in_no_order_are_sorted_before_their_stamps_are_ignored(tmp_path):
    path = tmp_path / "a.csv"
    rows = np.column_stack([np.arange(200) / 100.0, np.random.default_rng(1).normal(size=200)])
    rows = np.random.default_rng(2).permutation(rows)
    np.savetxt(path, rows, delimiter=",", header="time_s,gx [deg/s]", comments="", fmt="%.9f")
    with pytest.raises(InputError) as caught:
        read(path)
    assert re.search(
        "sort the rows .* if the samples are evenly spaced .* --rate 100 --time none",
        with_hint(caught.value),
    )


@pytest.mark.parametrize(
    ("code", "where", "options"),
    [("sd-assumed", "position", ["--position-sd"]), ("sd-assumed", "velocity", ["--velocity-sd"]),
     ("axis-up", "accel_z", ["--channel", "--channel"])],
)  # fmt: skip
def test_a_notice_of_navigating_has_its_options(code, where, options):
    hint = with_option(Notice(code, "warning", where, "", {}, "do this")).hint
    assert re.findall(r"--[a-z-]+", hint) == options
    known = {name for p in cli.commands["navigate"].params for name in p.opts}
    assert known.issuperset(options)


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
            text = re.sub(r"gmwm [a-z]+ --[a-z]+", "", text) if isinstance(text, str) else ""
            assert not re.search(r"(?<![-\w])--[a-z]", text), path
