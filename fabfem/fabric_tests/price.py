"""What a case on fabric laws will cost, before it runs.

It is what a run of the same laws under the same drive that completed has cost, else what the first blocks cost, which a
pilot computes and leaves after some seconds, times their number (`fabfem.rates`).
"""

import time
from collections.abc import Callable
from typing import Any, NamedTuple

from fabfem import rates as kept
from fabfem.case import FabricCase
from fabfem.fabric_tests.drives import Measured
from fabfem.rates import Price, Stopwatch, share_of, source, start_of

PILOT = 5.0
"""Time after which a pilot is left [s]."""
APART = {"title", "output", "picture"}
"""Tables that do not decide the kind of a run."""


class Rates(NamedTuple):
    """What a kind of run costs on this machine."""

    seconds: float
    """Program, packages, kernels, the history that the laws are run along, and all blocks [s]."""
    whole: bool
    """Whether a whole run was measured, or a pilot."""


def price(case: FabricCase, measure: Callable[[], Measured]) -> Price:
    """Return what a run will cost; without rates of its kind a pilot measures the beginning of its table."""
    rates = stored(case)
    if rates is None:
        rates = _pilot(measure)
        kept.store(_kind(case), rates._asdict())
    return Price(rates.seconds, source(rates.whole, "its first curves"))


def remember(case: FabricCase, report: dict[str, Any]) -> None:
    """Store the rates of a run that completed, from its report."""
    seconds = start_of(report) + share_of(report) * report["wall_time"]["total"]
    kept.store(_kind(case), Rates(seconds, True)._asdict())


def stored(case: FabricCase) -> Rates | None:
    """Return the rates of the kind of a case, if they are known."""
    return kept.known(Rates, _kind(case))


def _pilot(measure: Callable[[], Measured]) -> Rates:
    """Return the rates of the first blocks; one that compiled kernels does not count where there are others."""
    start, loading = time.process_time(), Stopwatch()
    measured = measure()
    start += 0.0 if loading.compiled else loading.free
    watch, count, each = Stopwatch(), 0, 0.0
    for _ in measured.blocks:
        count += 1
        each = watch.free / count
        if watch.compiled:
            watch, count = Stopwatch(), 0
        elif watch.free > PILOT:
            break
    return Rates(start + measured.size * each, False)


def _kind(case: FabricCase) -> dict[str, Any]:
    """Return what tells the kind of a run."""
    return case.model_dump(mode="json", exclude=APART)
