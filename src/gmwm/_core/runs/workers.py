"""Who does the work: processes of this machine, or the workers of a Dask cluster.

A worker that ends before its work does loses nothing: what it was at is done again.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import CancelledError, Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache, partial
from multiprocessing import current_process
from pickle import PicklingError
from pkgutil import resolve_name
from queue import SimpleQueue
from threading import Lock, Thread, enumerate as threads
from time import sleep
from typing import Any, TypeVar

from gmwm._core import checks
from gmwm._core.runs.allocation import memory_kept
from gmwm._core.runs.threads import one_blas_thread
from gmwm.errors import InputError

T = TypeVar("T")
R = TypeVar("R")

Work = Callable[[T], R]
"""Does one item; can be pickled, and gives the same whoever calls it."""

Done = Generator[tuple[T, R], None, None]
"""Items with what came of them, as they come."""

ENDED = 3
"""Processes at least that end at an item before it is taken for the cause; Dask's own number."""

PROCESSES = 2
"""That share the work on one recording by default: each takes 200 MB."""

_TOGETHER = 2  # times that an item may be among those at which a process ended; then it goes alone
_ALONE = 2  # ends of a process at an item alone: one may be of processes that were still closing
_LAST_SECONDS = 5.0  # that the end of a thread is waited for, which takes a thousandth of one
_WAITING = 2  # items that a process is given: the one at work, and the next


def results(
    work: Work[T, R],
    items: Sequence[T],
    *,
    jobs: int = 1,
    cluster: str | None = None,
    lost: Work[T, R] | None = None,
) -> Done[T, R]:
    """Do the work of every item, in any order.

    items: Hashable and different.
    jobs: Processes on this machine; -1 for one a core. One does the work itself.
    cluster: Address of a Dask scheduler that does the work instead.
    lost: Gives the result of an item at which `ENDED` processes ended; by default that is an error.
    Raises InputError if no scheduler answers, it has no workers, or an item is lost (code
        "worker-lost").
    """
    given_up = _refused if lost is None else lost
    if cluster is not None:
        return _on_cluster(work, items, cluster, given_up)
    return _here(work, items, jobs, given_up)


def spare(jobs: int, items: int) -> int:
    """How many processes beside this one are of use, of which ``jobs`` are to share the work.

    jobs: -1 for one a core.
    items: That can be worked on side by side.
    """
    if current_process().name != "MainProcess":  # whoever started it has shared the cores out
        return 0
    cores = os.cpu_count() or 1
    return max(min(cores if jobs == -1 else checks.whole("jobs", jobs, 1), cores, items) - 1, 0)


_beside: ContextVar[tuple[Any, Sequence[Future[Any]]]] = ContextVar("beside", default=(None, ()))
"""The pool, and what each of its processes begins with."""


@contextmanager
def beside(others: int, first: str) -> Iterator[None]:
    """Processes for `shared` that end with the block, unless there are some already.

    first: "module:function", what they import and call while this process does something else.
    """
    if not others or _beside.get()[0] is not None:
        yield
        return
    from joblib.externals.loky import ProcessPoolExecutor

    before = threads()
    try:
        # None: they do not end while they wait for work, only with this block or this process.
        pool = ProcessPoolExecutor(max_workers=others, timeout=None)
        begun = [pool.submit(_in_worker, _called, first, os.getpid()) for _ in range(others)]
    except (ImportError, OSError):  # a machine without semaphores, or one that lets none be started
        yield
        return
    token = _beside.set((pool, begun))
    try:
        yield
    finally:
        _beside.reset(token)
        pool.shutdown(kill_workers=True)
        _joined([each for each in threads() if each not in before])


def _joined(started: Iterable[Thread]) -> None:
    """Wait for the threads that fed a pool, which the pool does not.

    They give its semaphores back; where this process ended meanwhile, a warning of leaks was shown.
    """
    for each in started:
        if each.name == "QueueFeederThread":
            each.join(_LAST_SECONDS)


def while_beginning(work: Callable[[], object]) -> None:
    """Do what helps the processes `beside` this one, if one of them is not ready."""
    if not all(each.done() for each in _beside.get()[1]):
        work()


def shared(work: Work[T, R], items: Iterable[T]) -> Iterator[tuple[T, R]]:
    """Do the work of every item, in any order, in this process and in those `beside` it.

    Items, none of which is None, are drawn as work on them begins, in any thread. What cannot be
    sent to a process, or was sent to one that ended, is done here.
    """
    left, lock, sent, received = iter(items), Lock(), 0, 0
    pool, begun = _beside.get()
    ended: SimpleQueue[tuple[T, Future[tuple[T, R]] | None]] = SimpleQueue()

    def drawn(to_send: bool) -> T | None:
        nonlocal sent
        with lock:
            item = next(left, None)
            sent += to_send and item is not None
            return item

    def send() -> None:
        if (item := drawn(True)) is None:
            return
        try:
            future = pool.submit(_in_worker, work, item, os.getpid())
        except RuntimeError:  # a process ended: the pool is of no use
            ended.put((item, None))
        else:
            future.add_done_callback(partial(receive, item))

    def receive(item: T, future: Future[tuple[T, R]]) -> None:
        ended.put((item, future))
        send()

    for each in begun:  # nothing waits for a process that is not ready
        each.add_done_callback(lambda _: send())
    while True:
        if ended.empty():
            if (own := drawn(False)) is not None:
                yield own, work(own)
                continue
            if received == sent:
                return
        item, future = ended.get()
        received += 1
        if future is None or isinstance(future.exception(), BrokenProcessPool | PicklingError):
            yield item, work(item)
        else:
            yield item, future.result()[1]


def _refused(item: Any) -> Any:
    raise InputError(
        f"{ENDED} processes ended at {checks.shown(item)}: they may need more memory than there "
        "is, use fewer jobs",
        "worker-lost",
    )


def _here(work: Work[T, R], items: Sequence[T], jobs: int, lost: Work[T, R]) -> Done[T, R]:
    if jobs == 1 or len(items) < 2:
        for item in items:
            yield item, work(item)
        return
    from joblib import effective_n_jobs

    left, ended, alone = dict.fromkeys(items), dict.fromkeys(items, 0), dict.fromkeys(items, 0)
    while left:
        # At which item a process ended is known only of one that has the processes for itself.
        suspect = next((item for item in left if ended[item] >= _TOGETHER), None)
        group = list(left) if suspect is None else [suspect]
        try:
            with _quietly_closing(_in_processes(work, group, jobs)) as found:
                for item, result in found:
                    del left[item]
                    yield item, result
        except BrokenProcessPool:
            for item in [item for item in group if item in left][
                : _WAITING * effective_n_jobs(jobs)
            ]:
                ended[item] += 1
            if suspect is not None:
                alone[suspect] += 1
                if alone[suspect] == _ALONE:
                    del left[suspect]
                    yield suspect, lost(suspect)


@contextmanager
def _quietly_closing(found: Done[T, R]) -> Iterator[Done[T, R]]:
    """Close it at the end; who interrupts work knows that some of it is not done."""
    try:
        yield found
    finally:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", ".*have been cancelled", UserWarning)
            found.close()


def _in_processes(work: Work[T, R], items: Sequence[T], jobs: int) -> Done[T, R]:
    from joblib import Parallel, delayed, parallel_config

    # One that has grown ends after its item, and another begins: nothing for who waits.
    warnings.filterwarnings("ignore", "A worker stopped while some jobs", UserWarning)
    with parallel_config("loky", inner_max_num_threads=1):
        pool = Parallel(
            n_jobs=jobs, pre_dispatch=f"{_WAITING} * n_jobs", return_as="generator_unordered"
        )
    yield from pool(delayed(_in_worker)(work, item, os.getpid()) for item in items)


def _called(name: str) -> None:
    resolve_name(name)()


def _in_worker(work: Work[T, R], item: T, parent: int) -> tuple[T, R]:
    _end_with(parent)
    with one_blas_thread():
        return _with_item(work, item)


@cache
def _end_with(parent: int) -> None:
    """End this process when its parent ends, also where that is killed and cannot send word."""

    def watch() -> None:
        while os.getppid() == parent:
            sleep(1.0)
        os._exit(1)

    Thread(target=watch, daemon=True).start()


def _with_item(work: Work[T, R], item: T) -> tuple[T, R]:
    return item, work(item)


def _for_cluster(work: Work[T, R], item: T) -> tuple[T, R]:
    with memory_kept():
        return _with_item(work, item)


def _on_cluster(work: Work[T, R], items: Sequence[T], address: str, lost: Work[T, R]) -> Done[T, R]:
    with _client(address) as client:
        from distributed import KilledWorker, as_completed

        left = dict.fromkeys(items)
        for_nothing = 0
        while left:
            before = len(left)
            try:
                # Each worker is sent the work once, not with every item.
                shared = client.scatter(work, broadcast=True)
            except TimeoutError:
                raise InputError(
                    f"the Dask scheduler at {address!r} has no workers: start some"
                ) from None
            futures = {client.submit(_for_cluster, shared, item, pure=False): item for item in left}
            for future in as_completed(futures):
                item = futures[future]
                try:
                    _, result = future.result()
                except KilledWorker:
                    result = lost(item)
                except CancelledError:  # the last worker that had the work ended
                    continue
                del left[item]
                yield item, result
            for_nothing = for_nothing + 1 if len(left) == before else 0
            if for_nothing == ENDED:
                raise InputError(
                    f"the workers of the Dask cluster at {address!r} end before their work: see "
                    "their logs"
                )


def _client(address: str) -> Any:
    try:
        from distributed import Client
        from distributed.comm.addressing import parse_address
        from distributed.comm.registry import get_backend
    except ImportError:
        raise InputError(
            "a cluster needs Dask: install it with pip install 'gmwm[cluster]'"
        ) from None
    try:
        # A scheme that nobody speaks is refused before any thread is started.
        get_backend(parse_address(address)[0])
        return Client(address, timeout="10s")
    except TypeError as error:  # what distributed raises for tls:// without certificates
        raise InputError(
            f"{address} cannot be spoken to ({checks.line(str(error))}): give Dask its "
            "certificates, distributed.comm.tls in its configuration"
        ) from None
    except (OSError, TimeoutError, ValueError) as error:
        raise InputError(f"no Dask scheduler answers at {address!r} ({error})") from None
