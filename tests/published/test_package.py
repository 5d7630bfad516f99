"""What is published: the archives, and the command in a shell."""

import tarfile
import zipfile

import pytest
from click.testing import CliRunner

import gmwm
from gmwm import cli
from places import REPOSITORY

pytest.importorskip("hatchling", reason="hatchling builds the archives")

TEMPLATES = ("template.html", "report.css", "report.js", "validation.html", "comparison.html",
             "fleet.html")  # fmt: skip


@pytest.fixture(scope="module")
def sdist(tmp_path_factory):
    """Name within the archive -> size."""
    from hatchling.builders.sdist import SdistBuilder

    folder = tmp_path_factory.mktemp("sdist")
    (path,) = SdistBuilder(str(REPOSITORY)).build(directory=str(folder))
    with tarfile.open(path) as archive:
        members = archive.getmembers()
    assert {each.name.partition("/")[0] for each in members} == {f"gmwm-{gmwm.__version__}"}
    return {each.name.partition("/")[2]: each.size for each in members}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """Name within the archive -> size."""
    from hatchling.builders.wheel import WheelBuilder

    folder = tmp_path_factory.mktemp("wheel")
    (path,) = WheelBuilder(str(REPOSITORY)).build(directory=str(folder), versions=["standard"])
    with zipfile.ZipFile(path) as archive:
        return {each.filename: each.file_size for each in archive.infolist()}


def assert_clean(names):
    unwanted = (
        "__pycache__",
        ".nbi",
        ".nbc",
        ".pyc",
        ".mypy_cache",
        ".hypothesis",
        ".git/",
        ".venv",
    )
    assert not [name for name in names if any(each in name for each in unwanted)]


def test_the_sdist_is_the_source_without_caches(sdist):
    assert_clean(sdist)
    needed = ["LICENSE", "README.md", "CHANGELOG.md", "CITATION.cff", "pyproject.toml", "PKG-INFO"]
    needed += ["src/gmwm/py.typed", "src/gmwm/__init__.pyi", "docs/conf.py", ".ci/run"]
    needed += ["tests/published/test_package.py", "tests/golden/fit.txt", "examples/notebook.py"]
    needed += [f"src/gmwm/report/{name}" for name in TEMPLATES]
    assert [name for name in needed if name not in sdist] == []
    assert sum(sdist.values()) < 12e6


def test_the_wheel_is_the_package_with_its_templates_and_licence(sdist, wheel):
    assert_clean(wheel)
    source = {name.removeprefix("src/") for name in sdist if name.startswith("src/gmwm/")}
    info = f"gmwm-{gmwm.__version__}.dist-info/"
    beside = {name for name in wheel if not name.startswith("gmwm/")}
    assert wheel.keys() - beside == source
    assert {f"{info}licenses/LICENSE", f"{info}entry_points.txt"} <= beside
    assert all(name.startswith(info) for name in beside)


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_shell_completes_commands_and_options(shell, monkeypatch):
    words = {"COMP_WORDS": "gmwm calibrate --gyr", "COMP_CWORD": "2"}
    if shell == "fish":
        words["COMP_CWORD"] = "--gyr"
    shown = CliRunner().invoke(
        cli.cli, prog_name="gmwm", env={"_GMWM_COMPLETE": f"{shell}_complete", **words}
    )
    assert shown.exit_code == 0
    assert "--gyro-unit" in shown.output
