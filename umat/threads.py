"""Points in slices of fixed size, shared between threads.

A kernel is serial and releases the interpreter lock.  Each slice is computed by one
thread and written by it alone, so results do not depend on the number of threads.
"""

import os
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor

SLICE_SIZE = 256

Kernel = Callable[[int, int], object]


def _available() -> int:
    """Return the number of processors this process may run on."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


_n_threads = _available()
_pool: ThreadPoolExecutor | None = None


def set_threads(n_threads: int) -> None:
    """Use `n_threads` threads, the calling one among them, from the next batch on."""
    global _n_threads, _pool
    if n_threads < 1:
        raise ValueError(f"the number of threads must be at least 1, got {n_threads}")
    if _pool is not None:
        _pool.shutdown(wait=False)
    _n_threads, _pool = int(n_threads), None


def get_threads() -> int:
    """Return the number of threads in use (default: all processors available)."""
    return _n_threads


def map_slices(kernel: Kernel, n_points: int, slice_size: int = SLICE_SIZE) -> None:
    """Call `kernel(start, stop)` for slices that cover `n_points` points once each.

    The calling thread works too and waits for helpers that have begun only, so a call
    from within a kernel, or in a forked process, cannot block.
    """
    todo = deque(range(0, n_points, slice_size))

    def drain() -> None:
        for start in _taken(todo):
            kernel(start, min(start + slice_size, n_points))

    helpers = min(_n_threads, len(todo)) - 1
    futures = [_executor().submit(drain) for _ in range(helpers)]
    drain()
    for future in futures:
        if not future.cancel():
            future.result()


def _taken(todo: deque[int]) -> Iterator[int]:
    """Yield the starts left; several threads may take from one deque."""
    while True:
        try:
            start = todo.popleft()
        except IndexError:
            return
        yield start


def _executor() -> ThreadPoolExecutor:
    """Return the pool of helper threads, started when first needed."""
    global _pool
    if _pool is None:
        _pool = ThreadPoolExecutor(_n_threads - 1, thread_name_prefix="umat")
    return _pool
