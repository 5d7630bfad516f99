"""Where the time of a run goes, stage by stage.

A watch that runs counts whatever is within a `stage`; without one, a stage costs nothing::

    with Stopwatch().running() as watch:
        gmwm.calibrate(recording)
    print(watch.worked)
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field


@dataclass(frozen=True, eq=False)
class Stopwatch:
    """Time by stage, of all processes together.

    elapsed: Stage -> s by the clock on the wall; stages of several processes run at one time.
    worked: Stage -> s of the processor.
    """

    elapsed: dict[str, float] = field(default_factory=dict)
    worked: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def running(self) -> Iterator[Stopwatch]:
        """Let `stage` of this thread count here."""
        before = _watch.set(self)
        try:
            yield self
        finally:
            _watch.reset(before)

    def add(self, name: str, elapsed: float, worked: float) -> None:
        self.elapsed[name] = self.elapsed.get(name, 0.0) + elapsed
        self.worked[name] = self.worked.get(name, 0.0) + worked


_watch: ContextVar[Stopwatch | None] = ContextVar("watch", default=None)


def current() -> Stopwatch | None:
    """The watch that runs in this thread, for threads that it starts."""
    return _watch.get()


@contextmanager
def stage(name: str) -> Iterator[None]:
    """Count the time of a block for the watch that runs, if one does."""
    watch = _watch.get()
    if watch is None:
        yield
        return
    start, worked = time.perf_counter(), time.thread_time()
    try:
        yield
    finally:
        watch.add(name, time.perf_counter() - start, time.thread_time() - worked)
