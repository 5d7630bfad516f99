"""Whoever does the work, and whoever of them ends, every item is done once."""

import os
import pickle
import signal
import threading

import pytest

from gmwm import InputError
from gmwm._core import jobs
from gmwm._core.jobs import results, shared, worker_pool


class Square:
    """Squares; at some numbers the process ends, at some of them only the first time."""

    def __init__(self, folder, once=(), always=()):
        self.folder, self.once, self.always = folder, once, always

    def __call__(self, number):
        mark = self.folder / f"{number}-{os.getpid()}"
        before = list(self.folder.glob(f"{number}-*"))
        mark.touch()
        if number in self.always or (number in self.once and not before):
            os.kill(os.getpid(), signal.SIGKILL)
        return number**2


@pytest.mark.slow
def test_what_a_killed_process_was_at_is_done_again(tmp_path):
    """And an item at which every process ends is reported, not tried for ever."""
    work = Square(tmp_path, once=(1,), always=(4,))
    found = list(results(work, range(8), jobs=2, lost=lambda number: -number))
    assert sorted(found) == [(n, -4 if n == 4 else n**2) for n in range(8)]
    assert jobs.ENDED <= len(list(tmp_path.glob("4-*"))) <= 2 + jobs.ENDED
    assert str(os.getpid()) not in {path.name.partition("-")[2] for path in tmp_path.iterdir()}


def test_a_lost_item_is_an_error_by_default(tmp_path, monkeypatch):
    monkeypatch.setattr(jobs, "ENDED", 1)
    work = Square(tmp_path, always=(2,))
    with pytest.raises(InputError, match="1 processes ended at 2: ") as caught:
        list(results(work, range(4), jobs=2))
    assert caught.value.code == "worker-lost"


def test_this_process_shares_the_work_and_does_what_another_could_not(tmp_path):
    """One that is killed, and what cannot be sent; it takes the next item as it ends one."""
    work, drawn = Square(tmp_path, once=(1,)), []

    def items():
        for number in (1, *range(2, 9)):
            drawn.append(number)
            yield number

    with worker_pool(1, "time"), worker_pool(1, "time"):
        until_ready()
        found = shared(work, items())
        assert next(found)[0] == 2 and drawn[:2] == [1, 2]  # the first one was sent
        assert dict(found) == {n: n**2 for n in (1, *range(3, 9))}
    with worker_pool(1, "time"):
        until_ready()
        unsent = dict(shared(Unsendable(), (3, 4)))
    assert unsent == {3: os.getpid(), 4: os.getpid()}
    assert dict(shared(work, iter((3, 2)))) == {3: 9, 2: 4}


def until_ready():
    for each in jobs._pool.get()[1]:
        each.result(60.0)


def test_nothing_waits_for_a_process_that_is_not_ready(tmp_path, monkeypatch):
    (tmp_path / "pausing.py").write_text("import signal\nsignal.pause()\n")
    monkeypatch.syspath_prepend(tmp_path)
    with worker_pool(1, "pausing"):
        found = dict(shared(Square(tmp_path), range(1, 9)))
    assert found == {n: n**2 for n in range(1, 9)}
    assert {path.name.partition("-")[2] for path in tmp_path.glob("*-*")} == {str(os.getpid())}


class Unsendable:
    """Tells which process does the work, and cannot be sent to another."""

    def __reduce__(self):
        raise pickle.PicklingError

    def __call__(self, number):
        return os.getpid()


def test_processes_end_with_an_interrupt(tmp_path):
    def pids():
        return {path.name.partition("-")[2] for path in tmp_path.iterdir()} - {str(os.getpid())}

    with pytest.raises(KeyboardInterrupt), worker_pool(1, "time"):
        until_ready()
        dict(shared(Square(tmp_path), range(50)))
        other = int(min(pids()))
        os.kill(other, 0)
        raise KeyboardInterrupt
    with pytest.raises(ProcessLookupError):
        os.kill(other, 0)


def test_no_thread_that_gives_semaphores_back_is_left_for_the_end_of_this_process():
    before = set(threading.enumerate())
    for _ in range(12):
        with worker_pool(1, "os"):
            assert dict(shared(abs, [-1, 2])) == {-1: 1, 2: 2}
        assert set(threading.enumerate()) <= before
