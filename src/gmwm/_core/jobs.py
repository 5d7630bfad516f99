"""Work shared by processes of this machine or by the workers of a Dask cluster.

A worker that ends before its work does loses nothing: its items are done again.
"""

import os
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import CancelledError, Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache, partial
from importlib import import_module
from multiprocessing import current_process
from operator import call
from pickle import PicklingError
from queue import SimpleQueue
from threading import Lock, Thread, enumerate as threads
from time import sleep
from typing import Any, TypeVar

from gmwm._core import checks
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

_LAST_SECONDS = 5.0  # that the end of a thread is waited for, which takes a thousandth of one


def _rejected(item: Any) -> Any:
    raise InputError(
        f"{ENDED} processes ended at {checks.shown(item)}: they may need more memory than there "
        "is, use fewer jobs",
        "worker-lost",
    )


def results(
    work: Work[T, R],
    items: Sequence[T],
    *,
    jobs: int = 1,
    cluster: str | None = None,
    lost: Work[T, R] = _rejected,
) -> Done[T, R]:
    """Do the work of every item, in any order.

    items: Hashable and different.
    jobs: Processes on this machine; -1 for one a core. One does the work itself.
    lost: Gives the result of an item at which `ENDED` processes ended; by default that is an error.
    Raises InputError if no scheduler answers, it has no workers, or an item is lost (code
        "worker-lost").
    """
    if cluster is not None:
        return _on_cluster(work, items, cluster, lost)
    return _on_this_machine(work, items, jobs, lost)


def extra_workers(jobs: int, items: int) -> int:
    """How many processes beside this one help, if ``jobs`` (-1: one a core) share some items."""
    if current_process().name != "MainProcess":  # whoever started it has shared the cores out
        return 0
    cores = os.cpu_count() or 1
    return max(min(cores if jobs == -1 else checks.whole("jobs", jobs, 1), cores, items) - 1, 0)


_pool: ContextVar[tuple[Any, Sequence[Future[Any]]]] = ContextVar("pool", default=(None, ()))
"""The pool, and what each of its processes begins with."""


_has_pool = Lock()


@contextmanager
def worker_pool(others: int, first: str) -> Iterator[None]:
    """Processes for `shared` that end with the block, unless there are some already.

    first: Module that they import while this process does something else.
    """
    # One pool for a process: of threads side by side, the others work alone.
    if not others or _pool.get()[0] is not None or not _has_pool.acquire(blocking=False):
        yield
        return
    try:
        with _new_pool(others, first):
            yield
    finally:
        _has_pool.release()


@contextmanager
def _new_pool(others: int, first: str) -> Iterator[None]:
    from joblib.externals.loky import ProcessPoolExecutor

    before = threads()
    try:
        # None: they do not end while they wait for work, only with this block or this process.
        pool = ProcessPoolExecutor(max_workers=others, timeout=None)
        begun = [pool.submit(_in_worker, _imported, first, os.getpid()) for _ in range(others)]
    except (ImportError, OSError):  # a machine without semaphores, or one that lets none be started
        yield
        return
    token = _pool.set((pool, begun))
    try:
        yield
    finally:
        _pool.reset(token)
        pool.shutdown(kill_workers=True)
        # The threads that fed the pool give its semaphores back, which the pool does not wait for:
        # if this process ended meanwhile, it would warn of leaks.
        for each in threads():
            if each not in before and each.name == "QueueFeederThread":
                each.join(_LAST_SECONDS)


def shared(work: Work[T, R], items: Iterable[T]) -> Iterator[tuple[T, R]]:
    """Do the work of every item, in any order, in this process and in those of `worker_pool`.

    Items, none of which is None, are drawn as work on them begins, in any thread. What cannot be
    sent to a process, or was sent to one that ended, is done here.
    """
    left, lock, sent, received = iter(items), Lock(), 0, 0
    pool, begun = _pool.get()
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


def _on_this_machine(
    work: Work[T, R], items: Sequence[T], jobs: int, lost: Work[T, R]
) -> Done[T, R]:
    if jobs == 1 or len(items) < 2:
        for item in items:
            yield item, work(item)
        return
    left = dict.fromkeys(items)
    # A broken pool does not tell at which item a process ended. What is left is tried once more,
    # then one by one, so that none is lost for what another did.
    for group in (items, items, *([item] for item in items)):
        for _ in range(ENDED if len(group) == 1 else 1):
            waiting = [item for item in group if item in left]
            if not waiting:
                break
            try:
                for item, result in _in_processes(work, waiting, jobs):
                    del left[item]
                    yield item, result
            except BrokenProcessPool:
                pass
        if len(group) == 1 and group[0] in left:
            del left[group[0]]
            yield group[0], lost(group[0])


def _in_processes(work: Work[T, R], items: Sequence[T], jobs: int) -> Done[T, R]:
    from joblib import Parallel, delayed, parallel_config

    with parallel_config("loky", inner_max_num_threads=1):
        pool = Parallel(n_jobs=jobs, return_as="generator_unordered")
    found = pool(delayed(_in_worker)(work, item, os.getpid()) for item in items)
    with warnings.catch_warnings():
        # Workers that have grown end after their item and others begin; and who interrupts the
        # work knows that some of it is not done.
        warnings.filterwarnings("ignore", "A worker stopped while some jobs", UserWarning)
        warnings.filterwarnings("ignore", ".*have been cancelled", UserWarning)
        try:
            yield from found
        finally:
            found.close()


def _imported(name: str) -> None:
    import_module(name)


def _in_worker(work: Work[T, R], item: T, parent: int) -> tuple[T, R]:
    _end_with(parent)
    with one_blas_thread():
        return item, work(item)


@cache
def _end_with(parent: int) -> None:
    """End this process when its parent ends, also where that is killed and cannot send word."""

    def watch() -> None:
        while os.getppid() == parent:
            sleep(1.0)
        os._exit(1)

    Thread(target=watch, daemon=True).start()


def _on_cluster(work: Work[T, R], items: Sequence[T], address: str, lost: Work[T, R]) -> Done[T, R]:
    with _client(address) as client:
        from distributed import KilledWorker, as_completed

        left = dict.fromkeys(items)
        for _ in range(ENDED):
            try:
                # Each worker is sent the work once, not with every item.
                sent = client.scatter(work, broadcast=True)
            except TimeoutError:
                raise InputError(
                    f"the Dask scheduler at {address!r} has no workers: start some"
                ) from None
            futures = {client.submit(call, sent, item, pure=False): item for item in left}
            for future in as_completed(futures):
                item = futures[future]
                try:
                    result = future.result()
                except KilledWorker:
                    result = lost(item)
                except CancelledError:  # the last worker that had the work ended
                    continue
                del left[item]
                yield item, result
            if not left:
                return
        raise InputError(
            f"the workers of the Dask cluster at {address!r} stopped before the work was done: "
            "see their logs"
        )


def _client(address: str) -> Any:
    try:
        from distributed import Client
        from distributed.comm.addressing import parse_address
        from distributed.comm.registry import get_backend
    except ImportError:
        raise InputError("a cluster needs Dask: pip install 'gmwm[cluster]'") from None
    try:
        # A scheme that nobody speaks is rejected before any thread is started.
        get_backend(parse_address(address)[0])
        return Client(address, timeout="10s")
    except (OSError, TypeError, ValueError) as error:  # TypeError: tls:// without certificates
        raise InputError(f"no Dask scheduler answers at {address!r} ({error}): start one") from None


_lock = Lock()
_within: list[Any] = []
"""One entry for each block that runs: the first has the limits to be taken off."""


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Let the BLAS work in one thread within the block, or the function that this decorates.

    Matrices here are small: threads for each product cost three times what the work does, and more
    where other programs keep the processors busy. Of blocks side by side the last one to end sets
    what was before.
    """
    with _lock:
        _within.append(None if _within else _controller().limit(limits=1, user_api="blas"))
    try:
        yield
    finally:
        with _lock:
            last = _within[0] if len(_within) == 1 else None
            _within.pop()
            if last is not None:
                last.restore_original_limits()


@cache
def _controller() -> Any:
    """Controller of all loaded thread pools; looking for it takes milliseconds."""
    from threadpoolctl import ThreadpoolController

    import_module("scipy.linalg")  # has a BLAS of its own, found only once it is loaded
    return ThreadpoolController()
