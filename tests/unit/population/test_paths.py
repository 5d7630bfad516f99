"""Which recordings a fleet has, and what their units are called."""

import pytest

from gmwm import InputError
from gmwm.population.task import recordings


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("a/static.csv", "b/static.csv", "b/other one.csv", "c [1]/x.csv", "x.npy"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.touch()
    return tmp_path


def found(*given, folder=None):
    return {item.path: item.name for item in recordings(given, folder)}


def test_a_pattern_is_every_file_that_matches_once(folder):
    assert found("b/*.csv", "*/static.csv") == {
        "b/other one.csv": "other one", "b/static.csv": "b-static.csv",
        "a/static.csv": "a-static.csv",
    }  # fmt: skip
    (folder / "link.csv").symlink_to(folder / "x.npy")
    assert found("x.npy", "link.csv") == {"x.npy": "x"}


def test_folders_on_the_way_are_no_recordings_but_bags_are(folder):
    (folder / "bag").mkdir()
    (folder / "bag" / "metadata.yaml").touch()
    assert "a" not in found("**")
    assert {"a/static.csv", "b/other one.csv", "bag", "x.npy"} <= found("**").keys()
    assert found("b/**").keys() == {"b/static.csv", "b/other one.csv"}


def test_what_exists_is_no_pattern(folder):
    assert found("c [1]/x.csv") == {"c [1]/x.csv": "x"}
    assert found("c*/x.csv", "x.npy") == {"c [1]/x.csv": "x.csv", "x.npy": "x.npy"}


@pytest.mark.parametrize(
    "given",
    [
        ["a/static.csv", "b/static.csv", "STATIC.csv.gz"],  # case does not count
        ["t:1.npz", "t*1.npz", "t_1-2.npz"],  # a number that is added gives no name of another
        ["x" * 200 + "1.csv", "x" * 200 + "2.csv"],  # long names are told apart by their ends
    ],
)
def test_names_differ(folder, given):
    for name in given:
        (folder / name).touch()
    names = found(*given).values()
    assert len({name.lower() for name in names}) == len(given)


@pytest.mark.parametrize("name", ["x" * 250, "a\nb", "a:b", "..hidden", " ", "ünït"])
def test_names_are_names_of_files(folder, name):
    (given,) = found(f"{name}.csv").values()
    (folder / f"{given}.json").touch()
    assert len(given) <= 100
    assert given.isprintable()


def test_outputs_are_no_recordings(folder):
    for name in ("out/calibrations/x.csv", "out/fleet.parquet", "out/mine.csv"):
        (folder / name).parent.mkdir(exist_ok=True, parents=True)
        (folder / name).touch()
    assert list(found("out/**", folder=folder / "out")) == ["out/mine.csv"]
    assert "out" not in found("*", folder=folder / "out")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ((), "no recordings given"),
        (("nothing-*.csv",), "no file matches 'nothing-*.csv'"),
        ((b"x.csv",), "give recording paths as strings"),
        ((3,), "3 is not a path"),
        (("a\0b",), "give recording paths as strings"),
    ],
)
def test_no_path_is_refused(folder, given, words):
    with pytest.raises(InputError) as caught:
        recordings(given, None)
    assert words in str(caught.value)
    with pytest.raises(InputError, match="5 is not a path"):
        recordings(5, None)
