"""Median time of a call, for the benchmarks."""

import statistics
import time
from collections.abc import Callable


def median_time(run: Callable[[], object], repeats: int = 5, clock: Callable[[], float] = time.perf_counter) -> float:
    """Return the median time of `run` [s], after once; `time.process_time` does not count what other programs take."""
    run()
    times = []
    for _ in range(repeats):
        begin = clock()
        run()
        times.append(clock() - begin)
    return statistics.median(times)
