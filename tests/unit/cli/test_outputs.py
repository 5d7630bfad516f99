"""An output that cannot be written is refused before anything is read."""

from pathlib import Path

import pytest
from click.testing import CliRunner

from gmwm.cli.main import cli
from gmwm.errors import InputError

ARGUMENTS = {"reproduce": ["table2"], "demo": [], "navigate": []}
"""Of commands that read no file before their options; the files of others are not there."""

COMMANDS = {
    name: isinstance(option.default, Path)
    for name, command in cli.commands.items()
    for option in command.params
    if option.name == "output"
}
"""Of those that write, whether it is a folder."""


def refusal(name, output):
    given = ARGUMENTS.get(name, ["absent.json", "absent.csv"][: 2 if name == "compare" else 1])
    result = CliRunner().invoke(cli, [name, *given, "-o", output])
    assert isinstance(result.exception, InputError), (name, result.output)
    return str(result.exception)


def test_a_data_sheet_is_read_before_the_recordings():
    given = ["compare", "absent.csv", "absent.json", "--datasheet", "taken"]
    assert "taken: holds no sensors" in str(CliRunner().invoke(cli, given).exception)


@pytest.fixture(autouse=True)
def _place(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("taken").write_text("mine")
    Path("folder/report.html").mkdir(parents=True)
    before = sorted(tmp_path.rglob("*"))
    yield
    assert sorted(tmp_path.rglob("*")) == before


def test_every_command_that_writes_is_here():
    files = {name for name, is_folder in COMMANDS.items() if not is_folder}
    numbers = {"bound", "reduce", "certify", "export", "sheet"}
    assert files == numbers | {"array", "compare", "health", "motion"}
    assert {"calibrate", "demo", "fleet", "navigate", "reproduce"} == set(COMMANDS) - files


@pytest.mark.parametrize("name", [name for name, is_folder in COMMANDS.items() if not is_folder])
def test_a_file_that_cannot_be_written(name):
    assert "folder: a folder of that name is in the way" in refusal(name, "folder")
    for output in ("absent/file", "taken/file"):
        assert f"{Path(output)}: cannot be written (" in refusal(name, output)


@pytest.mark.parametrize("name", [name for name, is_folder in COMMANDS.items() if is_folder])
def test_a_folder_that_cannot_be_written(name):
    for output in ("taken", "taken/under"):
        assert f"{Path(output)}: cannot be written (" in refusal(name, output)


@pytest.mark.parametrize("name", ["calibrate", "demo", "navigate"])
def test_a_folder_in_the_way_of_a_file_in_the_folder(name):
    assert f"{Path('folder/report.html')}: a folder of that name" in refusal(name, "folder")
