"""What a case on fabric laws will cost, before it runs: its blocks times the time of one.

The time is that of a run of the same laws under the same drive that completed, else of the first blocks, which a
pilot computes and leaves after some seconds (`fabfem.rates`).
"""

import time
from typing import Any, NamedTuple

from fabfem import rates as kept
from fabfem.case import FabricCase
from fabfem.fabric_tests.drives import Measured
from fabfem.rates import Stopwatch, share_of, start_of

PILOT = 5.0
"""Time after which a pilot is left [s]."""
APART = {"title", "output", "picture"}
"""Tables that do not decide the kind of a run."""


class Rates(NamedTuple):
    """What a kind of run costs on this machine."""

    block: float
    """A block, computed and written [s]."""
    start: float
    """Program, packages, kernels, and the history that the laws are run along [s]."""
    whole: bool
    """Whether a whole run was measured, or a pilot."""


class Price(NamedTuple):
    """What a run will cost."""

    seconds: float
    """Wall time on a machine that does nothing else, from the command to its end [s]."""
    source: str
    """Where the rates come from."""


def price(case: FabricCase, measured: Measured, pilot: bool) -> Price | None:
    """Return what a run will cost; None where no rates of its kind are kept and no pilot may measure them."""
    rates = stored(case)
    if rates is None and pilot:
        rates = _pilot(measured)
        kept.store(_kind(case), rates._asdict())
    if rates is None:
        return None
    source = "a run of this kind on this machine" if rates.whole else "its first curves on this machine"
    return Price(rates.start + rates.block * measured.size, source)


def remember(case: FabricCase, report: dict[str, Any]) -> None:
    """Store the rates of a run that completed, from its report."""
    spent, free, count = report["wall_time"], share_of(report), max(len(report["curves"]), 1)
    blocks = free * (spent["curves"] + spent["output"])
    start = start_of(report) + free * spent["total"] - blocks
    kept.store(_kind(case), Rates(blocks / count, start, True)._asdict())


def stored(case: FabricCase) -> Rates | None:
    """Return the rates of the kind of a case, if they are known."""
    try:
        return Rates(**(kept.stored(_kind(case)) or {}))
    except TypeError:
        return None


def _pilot(measured: Measured) -> Rates:
    """Return the rates of the first blocks; one that compiled kernels does not count where there are others."""
    start, watch, blocks, laps = time.process_time(), Stopwatch(), iter(measured.blocks), [0.0]
    next(blocks, None)
    first, compiled = watch.free, watch.compiled
    for _ in blocks:
        laps.append(watch.free - first)
        if watch.free > PILOT:
            break
    others = len(laps) - 1
    if compiled and others:
        return Rates(laps[-1] / others, start, False)
    return Rates((first + laps[-1]) / (others + 1), start, False)


def _kind(case: FabricCase) -> dict[str, Any]:
    """Return what tells the kind of a run."""
    return case.model_dump(mode="json", exclude=APART)
