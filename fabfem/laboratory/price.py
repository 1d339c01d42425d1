"""What an element test will cost, before it runs: rows times evaluations of the material times the time of one.

The rates are those of a run of the same kind that completed, else of the test's first rows, which a pilot takes and
leaves after a second or two (`fabfem.rates`). The number of rows and of cycles may differ between runs of a kind. A leg
takes a step for each row at least, and as many as its curve needs to be as accurate as the case asks.
"""

import time
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fabfem import rates as kept
from fabfem.case import ElementCase
from fabfem.case.paths import ElementStage, Path, Probe
from fabfem.laboratory.plans import plan
from fabfem.laboratory.specimen import Specimen
from fabfem.laboratory.stages import End, path
from fabfem.rates import Price, Stopwatch, share_of, source, start_of

PILOT = 2.0
"""Time after which a pilot is left [s]."""
APART = {"title", "output", "checkpoint", "sweep", "study", "calibration"}
"""Tables that do not decide the kind of a test."""


class Rates(NamedTuple):
    """What a kind of test costs on this machine."""

    evaluation: float
    """An evaluation of the material, and what goes with it [s]."""
    evaluations: float
    """Evaluations of a step."""
    steps: float
    """Steps that a leg needs for the accuracy of its curve; 0 where its rows were enough."""
    row: float
    """Writing of a row [s]."""
    start: float
    """Program, packages, kernels [s]."""
    whole: bool
    """Whether a whole run was measured, or a pilot."""


def price(specimen: Specimen) -> Price:
    """Return what a test will cost; without rates of its kind a pilot measures them, in two seconds or so."""
    rates = stored(specimen.case)
    if rates is None:
        rates = _pilot(specimen)
        kept.store(_kind(specimen.case), rates._asdict())
    return predicted(specimen, rates)


def predicted(specimen: Specimen, rates: Rates) -> Price:
    """Return the price of a test at some rates."""
    evaluations = rates.evaluations * sum(max(rows, rates.steps) for rows in legs(specimen))
    spent = rates.evaluation * evaluations + rates.row * sum(legs(specimen))
    return Price(rates.start + spent, source(rates.whole, "its first rows"), evaluations)


def legs(specimen: Specimen) -> list[int]:
    """Return the rows that each leg of a test is recorded at; a probe is a leg."""
    return [rows for stage in specimen.case.stage for rows in _legs(specimen, stage)]


def _legs(specimen: Specimen, stage: ElementStage) -> Iterator[int]:
    if isinstance(stage, Probe):
        yield from [stage.increments] * stage.directions
    elif isinstance(stage, Path):
        todo = plan(stage, specimen.state.stress[0])
        yield from [stage.increments * todo.turns] * len(todo.targets)


def remember(specimen: Specimen, report: dict[str, Any]) -> None:
    """Store the rates of a test that completed, from its report."""
    spent, free = report["wall_time"], share_of(report)
    taken = [(stage["increments"], stage["steps"], stage["work"]) for stage in report["stages"] if "work" in stage]
    if not taken:
        return
    rates = _rates(specimen, tuple(np.sum(taken, axis=0).tolist()), free * spent["paths"])
    rest = free * (spent["total"] - spent["paths"] - spent["output"])
    row = free * spent["output"] / max(sum(legs(specimen)), 1)
    rates = rates._replace(row=row, start=start_of(report) + rest, whole=True)
    kept.store(_kind(specimen.case), rates._asdict())


def stored(case: ElementCase) -> Rates | None:
    """Return the rates of the kind of a test, if they are known."""
    return kept.known(Rates, _kind(case))


def _rates(specimen: Specimen, taken: tuple[int, int, int], seconds: float) -> Rates:
    """Return the rates of a number of rows, steps and evaluations that took some time [s]."""
    rows, steps, work = (max(number, 1) for number in taken)
    mean = sum(legs(specimen)) / max(len(legs(specimen)), 1)
    return Rates(seconds / work, work / steps, mean * steps / rows if steps > rows else 0.0, 0.0, 0.0, False)


def _pilot(specimen: Specimen) -> Rates:
    """Return the rates of the first rows; what the first of all takes longer than others is the loading of kernels."""
    start, first, rows = time.process_time(), Stopwatch(), _rows(specimen)
    begun = next(rows, np.zeros(3, int))
    loading, watch, last = 0.0 if first.compiled else first.free, Stopwatch(), begun
    for now in rows:
        last = now
        if watch.free > PILOT:
            break
    alone = bool((last == begun).all())
    taken, seconds = (begun, loading) if alone else (last - begun, watch.free)
    rates = _rates(specimen, tuple(taken.tolist()), seconds)
    return rates._replace(start=start + max(loading - rates.evaluation * float(begun[2]), 0.0))


def _rows(specimen: Specimen) -> Iterator[NDArray[np.intp]]:
    """Yield the rows, steps and evaluations (3,) that the paths have come to at each row, one path after the other."""
    state, strain, before = specimen.state, np.zeros(6), np.zeros(3, int)
    for stage in (stage for stage in specimen.case.stage if isinstance(stage, Path)):
        now = before
        for found in path(specimen, stage, state, strain if stage.keep_strain else np.zeros(6)):
            if isinstance(found, End):
                break
            state, strain, now = (
                found.state,
                found.strain,
                before + np.array([found.increment, found.steps, found.work]),
            )
            if found.increment:
                yield now
        before = now


def _kind(case: ElementCase) -> dict[str, Any]:
    """Return what tells the kind of a test."""
    said = case.model_dump(mode="json", exclude=APART)
    for stage in said["stage"]:
        stage.pop("increments")
        stage.pop("cycles", None)
    return said
