"""What a type checker says of programs that use the package."""

import re
import subprocess
import sys

import pytest

from places import REPOSITORY

pytestmark = pytest.mark.slow  # half a minute; `.ci/run` runs it beside the linters

USER = REPOSITORY / "tests" / "typed_user"


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """Lines with an error of each program, in strict mode."""
    cache = str(tmp_path_factory.mktemp("mypy"))
    command = [sys.executable, "-m", "mypy", "--cache-dir", cache, "."]
    done = subprocess.run(command, cwd=USER, capture_output=True, text=True, timeout=300)
    errors = re.findall(r"^(\w+)\.py:(\d+): error: (.*)", done.stdout, re.MULTILINE)
    assert errors, done.stdout + done.stderr
    return errors


def test_a_program_as_users_write_it_passes_in_strict_mode(found):
    assert [error for error in found if error[0] != "mistakes"] == []


def test_mistakes_are_found_where_they_are(found):
    lines = (USER / "mistakes.py").read_text().splitlines()
    expected = [number for number, line in enumerate(lines, 1) if line.endswith("# mistake")]
    assert [int(number) for name, number, _ in found if name == "mistakes"] == expected
