"""Output files appear whole or not at all."""

import errno
import os

import pytest

from gmwm._core.files import folder_to_fill, moved_together, written
from gmwm.errors import InputError


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_text_arrives_whole_in_utf8_and_the_old_one_is_there_until_then(tmp_path):
    path = tmp_path / "out.txt"
    path.write_text("old")
    with written(str(path)) as stream:
        stream.write("µg/√Hz\n")
        stream.flush()
        assert path.read_text() == "old"
    assert path.read_bytes() == "µg/√Hz\n".encode()
    assert names(tmp_path) == ["out.txt"]


@pytest.mark.parametrize("error", [RuntimeError("bug"), KeyboardInterrupt()], ids=repr)
@pytest.mark.parametrize("before", [None, "old"])
def test_an_interruption_leaves_everything_as_it_was(tmp_path, error, before):
    path = tmp_path / "out.txt"
    if before is not None:
        path.write_text(before)
    with pytest.raises(type(error)), written(path) as stream:
        stream.write("half of it")
        stream.flush()
        raise error
    assert names(tmp_path) == ([] if before is None else ["out.txt"])
    if before is not None:
        assert path.read_text() == before


def test_full_disk_is_told_and_leaves_nothing(tmp_path):
    path = tmp_path / "out.txt"
    with pytest.raises(InputError, match=r"out\.txt: cannot be written \(No space"), written(path):
        raise OSError(errno.ENOSPC, "No space left on device")
    assert names(tmp_path) == []


@pytest.mark.skipif(os.name != "posix", reason="files of POSIX")
def test_a_link_stays_and_a_pipe_is_no_file(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "file")
    with written(tmp_path / "link") as stream:
        stream.write("new")
    assert (tmp_path / "link").is_symlink() and (tmp_path / "file").read_text() == "new"
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="a pipe or device"), written(tmp_path / "pipe"):
        pass


@pytest.mark.skipif(os.name != "posix", reason="file modes are those of POSIX")
def test_permissions_are_those_of_any_new_file(tmp_path):
    before = os.umask(0o027)
    try:
        with written(tmp_path / "out.txt") as stream:
            stream.write("x")
        assert os.umask(0o027) == 0o027  # the process's own mask is as it was
    finally:
        os.umask(before)
    assert (tmp_path / "out.txt").stat().st_mode & 0o777 == 0o640


def test_a_file_for_a_folder_and_a_folder_for_a_file(tmp_path):
    (tmp_path / "file").write_text("x")
    (tmp_path / "folder").mkdir()
    for path in (tmp_path / "file" / "out", tmp_path / "folder"):
        with pytest.raises(InputError, match=r"cannot be written|in the way"), written(path):
            pass
    assert (tmp_path / "file").read_text() == "x"
    assert names(tmp_path) == ["file", "folder"]


# -- folders --------------------------------------------------------------------------------------


def test_a_folder_is_tried_before_any_work(tmp_path, monkeypatch):
    def refuse(*args, **kwargs):
        raise OSError(errno.EROFS, "Read-only file system")

    monkeypatch.setattr("gmwm._core.files.tempfile.TemporaryFile", refuse)
    message = r"cannot be written \(Read-only file system\)"
    with pytest.raises(InputError, match=message), folder_to_fill(tmp_path):
        pass


def test_files_of_one_run_stand_together(tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).write_text("old")
    with pytest.raises(RuntimeError), moved_together(tmp_path) as folder:
        (folder / "a").write_text("new")
        raise RuntimeError
    assert [(tmp_path / name).read_text() for name in "ab"] == ["old", "old"]
    with moved_together(tmp_path) as folder:
        for name in ("a", "b", "c"):
            (folder / name).write_text("new")
        assert (tmp_path / "a").read_text() == "old"
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == dict.fromkeys(
        "abc", "new"
    )
