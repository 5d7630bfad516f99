"""Files: opened if they are regular ones, written so that they appear whole or not at all."""

import hashlib
import os
import platform
import re
import shutil
import stat
import tempfile
import tomllib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from io import BufferedReader
from pathlib import Path
from typing import Any, TextIO

from gmwm.errors import InputError

_PREFIX = f".gmwm-{re.sub('[^A-Za-z0-9]', '', platform.node())}-"
"""Prefix of temporary files and folders of this machine; the number of their process follows."""


def _own_prefix(folder: Path) -> str:
    """How a process begins temporary names in a folder, after those of killed ones are gone."""
    if os.name == "posix":  # elsewhere the question whether a process lives would end it
        _remove_left_over(folder.absolute(), os.getpid())
    return f"{_PREFIX}{os.getpid()}-"


@cache  # once a process: a folder may hold thousands of files
def _remove_left_over(folder: Path, _: int) -> None:
    for each in folder.glob(f"{_PREFIX}*-*"):
        try:
            os.kill(int(each.name.removeprefix(_PREFIX).partition("-")[0]), 0)
        except ProcessLookupError:
            shutil.rmtree(each, ignore_errors=True)
            each.unlink(missing_ok=True)
        except (OSError, ValueError, OverflowError):  # it lives, or the name is another's
            continue


@contextmanager
def moved_into_place(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A temporary file to be filled; it takes its own name when all went well."""
    target = replaceable(Path(os.path.realpath(path)))  # a link stays, and its file is replaced
    try:
        handle, name = tempfile.mkstemp(prefix=_own_prefix(target.parent), dir=target.parent)
        os.close(handle)
    except OSError as error:
        raise _not_written(target, error) from None
    try:
        yield Path(name)
        os.umask(mask := os.umask(0))
        os.chmod(name, 0o666 & ~mask)
        os.replace(name, target)
    except OSError as error:
        raise _not_written(target, error) from None
    finally:
        with suppress(FileNotFoundError):
            os.unlink(name)


@contextmanager
def written(path: str | os.PathLike[str]) -> Iterator[TextIO]:
    """Open a text file for writing under a temporary name; it takes its own when all went well."""
    with moved_into_place(path) as name, open(name, "w", encoding="utf-8") as stream:
        yield stream


def write_text(path: str | os.PathLike[str], text: str) -> Path:
    """Write a text file, with a line end at its end, whole or not at all; returns its path."""
    with written(path) as stream:
        stream.write(text if text.endswith("\n") else f"{text}\n")
    return Path(path)


@contextmanager
def moved_together(folder: Path) -> Iterator[Path]:
    """A temporary folder to be filled; its files take their places together when all went well.

    Earlier files go first: after a kill some are missing, and none is of another run.
    Raises InputError if it cannot be written.
    """
    try:
        with tempfile.TemporaryDirectory(prefix=_own_prefix(folder), dir=folder) as name:
            yield Path(name)
            made = sorted(Path(name).iterdir())
            for each in made:
                (folder / each.name).unlink(missing_ok=True)
            for each in made:
                os.replace(each, folder / each.name)
    except OSError as error:
        raise _not_written(folder, error) from None


def run_of(path: Path) -> str:
    """What marks files that were written with this one: its name and a short hash."""
    with opened(path) as stream:
        return f"{path.name} sha256 {hashlib.file_digest(stream, 'sha256').hexdigest()[:12]}"


def of_other_runs(path: Path, names: Iterable[str]) -> list[str]:
    """Those of some files beside one whose mark is another than its own; see `run_of`."""
    found, own = [], run_of(path).encode()
    mark = re.compile(re.escape(path.name).encode() + rb" sha256 [0-9a-f]{12}")
    for name in names:
        with suppress(OSError, InputError), opened(path.with_name(name)) as stream:
            marks = mark.findall(stream.read())
            found += [name] if marks and own not in marks else []
    return found


def toml_beside(module: str | Path) -> dict[str, Any]:
    """Content of the TOML file beside a module, of its name: what the package itself knows."""
    return tomllib.loads(Path(module).with_suffix(".toml").read_text(encoding="utf-8"))


def existing_file(path: str | os.PathLike[str]) -> Path:
    """The path, if a file is there.

    Raises InputError if nothing is there, or no file: a directory, a pipe or a device.
    """
    found = Path(path)
    try:
        if found.is_dir():
            raise InputError(f"{path} is a directory: name a file in it")
        _check_regular(found)
    except (OSError, ValueError) as error:  # ValueError: a null character in the name
        if isinstance(error, InputError):
            raise
        raise InputError(f"{str(path)[:200]} does not exist: check the path") from None
    return found


def opened(path: str | os.PathLike[str]) -> BufferedReader:
    """A file, open for reading: the only function that opens one.

    Raises OSError if it cannot be opened.
    Raises InputError if it is a pipe or a device.
    """
    _check_regular(Path(path))
    return open(path, "rb")


def content_of(path: str | os.PathLike[str], most: int = 1 << 20) -> bytes:
    """The bytes of a document, by default of one that a person writes.

    Raises InputError if it cannot be read, is a pipe or a device, or has more than ``most``.
    """
    try:
        with opened(path) as stream:
            content = stream.read(most + 1)
    except (OSError, ValueError) as error:  # ValueError: a null character in the name
        if isinstance(error, InputError):
            raise
        why = getattr(error, "strerror", error)
        raise InputError(f"{path}: cannot be read ({why}): check the path") from None
    if len(content) > most:
        raise InputError(f"{path}: has more than {most / 2**20:.3g} MB: check the path")
    return content


def _check_regular(path: Path) -> None:
    # Opened, it may wait for ever, or give for ever.
    mode = path.stat().st_mode
    if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):
        raise InputError(f"{path} is a pipe or a device: write its content to a file first")


def writable_file(path: str | os.PathLike[str]) -> Path:
    """The path, if a file can be written there: to be asked before the work of filling it.

    Raises InputError if a folder stands there, or none that can be written is around it.
    """
    file = Path(path)
    return _taking_files(file.parent, replaceable(file))


def writable_folder(path: Path, names: Iterable[str] = ()) -> Path:
    """The path, if it is or can become a folder with files of these names.

    Raises InputError if it cannot be made or written, or a folder is in the way of a file.
    """
    for name in names:
        replaceable(path / name)
    return _taking_files(next(p for p in (path, *path.parents) if os.path.exists(p)), path)


def replaceable(path: Path) -> Path:
    """The path, if a file can take its place.

    Raises InputError if a folder, a pipe or a device stands there.
    """
    if os.path.exists(path) and not os.path.isfile(path):
        what, hint = ("folder", "move it, or ") if os.path.isdir(path) else ("pipe or device", "")
        problem = f"{path}: a {what} of that name is in the way"
        raise InputError(problem, "output", f"{hint}choose another place", {"first": hint})
    return path


def _taking_files(folder: Path, output: Path) -> Path:
    """The output; raises InputError if the folder takes no new file."""
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise _not_written(output, error) from None
    return output


@contextmanager
def folder_to_fill(path: str | os.PathLike[str]) -> Iterator[Path]:
    """An output folder, which is taken away again if it was made and an error left it empty.

    Raises InputError if it cannot be made or written.
    """
    folder = Path(path)
    missing = [each for each in (folder, *folder.parents) if not each.exists()]
    try:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise _not_written(folder, error) from None
        yield _taking_files(folder, folder)
    except BaseException:
        for made in missing:
            with suppress(OSError):  # there is something in it
                made.rmdir()
        raise


@contextmanager
def one_writer(folder: Path) -> Iterator[None]:
    """Keep others from filling the same folder at the same time.

    Raises InputError with the code "runs-in-use", if another process fills it.
    """
    from filelock import FileLock, Timeout

    path = folder / ".lock"
    lock = FileLock(path, timeout=0)
    try:
        lock.acquire()
    except Timeout:
        raise InputError(
            f"{folder} is in use by another run: wait until it ends, or give another folder",
            "runs-in-use",
        ) from None
    try:
        yield
    finally:
        lock.release()
        with suppress(FileNotFoundError):  # someone removed the folder
            if all(each == path for each in folder.iterdir()):
                path.unlink(missing_ok=True)


def _not_written(path: Path, error: OSError) -> InputError:
    problem = f"{path}: cannot be written ({error.strerror})"
    return InputError(problem, "output", "choose another place", {"first": ""})
