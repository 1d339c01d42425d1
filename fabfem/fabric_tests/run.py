"""A case on fabric laws from the case to the last row: its one drive makes a table, which is written block by block."""

from collections.abc import Iterator
from functools import singledispatch
from pathlib import Path
from typing import Any

from fabfem.case import CaseError, FabricCase
from fabfem.case import fabric as said
from fabfem.fabric_tests.drives import Block, Measured, Value
from fabfem.fabric_tests.price import price, stored
from fabfem.fabric_tests.price import remember as remember_run
from fabfem.outcome import Description, Outcome, Pricing, claimed, short, unwritten
from fabfem.output.history import History
from fabfem.output.interrupt import held_back
from fabfem.output.report import Report, about, read_report
from fabfem.restart import FRESH, Restart
from fabfem.timing import Timer

PHASES = ("start", "curves", "output")
OMITTED = ("no stress point: the laws do not act back on the stress and strain that they are given",)


@singledispatch
def measure(drive: Any, case: FabricCase) -> Measured:
    """Return the table that a drive makes of the laws of a case; `CaseError` if it cannot be run."""
    raise TypeError(f"{type(drive).__name__} drives nothing")


@measure.register
def _(drive: said.History | said.Loading, case: FabricCase) -> Measured:
    from fabfem.fabric_tests import histories

    return histories.measure(drive, case)


@measure.register
def _(drive: said.Probe, case: FabricCase) -> Measured:
    from fabfem.fabric_tests import probes

    return probes.measure(drive, case)


@measure.register
def _(drive: said.Surface, case: FabricCase) -> Measured:
    from fabfem.fabric_tests import surfaces

    return surfaces.measure(drive, case)


@measure.register
def _(drive: said.Contacts, case: FabricCase) -> Measured:
    from fabfem.fabric_tests import contacts

    return contacts.measure(drive, case)


def describe(case: FabricCase, pricing: Pricing = Pricing.NONE) -> Description:
    """Return what a case leaves out and what remains; see `fabfem.run.describe_case`."""
    time = pricing.time(stored(case) is not None, lambda: price(case, lambda: measure(case.drive, case)).told())
    return Description(OMITTED, measure(case.drive, case).remains, time=time)


def remember(case: FabricCase, folder: Path) -> None:
    """Keep what a completed run has cost, for the price of the next one of its kind."""
    remember_run(case, read_report(folder))


def run(case: FabricCase, folder: Path, quiet: bool, timer: Timer | None = None, restart: Restart = FRESH) -> Outcome:
    """Run a case and write its results into a folder; see `fabfem.run.run_case`.

    Such a run takes seconds and keeps no checkpoints: to resume it is to run it again, which gives the same.
    """
    if restart.branch is not None:
        raise CaseError(f"{case.path.name}: scene.kind: a fabric scene keeps no state to branch from")
    timer = timer or Timer(PHASES)
    with timer.phase("start"):
        measured = measure(case.drive, case)
    with claimed(folder):
        try:
            return _recorded(case, folder, measured, timer)
        except OSError as error:
            return unwritten(error, folder, timer.total())


def _recorded(case: FabricCase, folder: Path, measured: Measured, timer: Timer) -> Outcome:
    """Write the blocks of a table as they come and return how that ended."""
    for file in (*folder.glob("*.png"), folder / "history.csv"):
        file.unlink(missing_ok=True)
    history = History(folder / "history.csv", measured.headers)
    report = Report(folder / "report.json", **_head(case, measured))
    count, status = 0, "completed"
    last: tuple[Value, ...] = ()
    reasons: list[str] = []
    try:
        blocks = iter(measured.blocks)
        while block := _next(blocks, timer):
            with held_back(), timer.phase("output"):
                for last in block.rows:
                    history.write(last)
                count += len(block.rows)
                report.content["curves"].append(block.summary)
            reasons += [block.reason] if block.reason else []
        status = "stopped" if reasons else status
    except KeyboardInterrupt:
        status, reasons = "interrupted", ["interrupted; all curves that were done are kept"]
    history.close()
    reason = "; ".join(reasons)
    report.end(status, reason)
    report.content["processor_time"] = timer.processor()
    report.write({**timer.spent, "total": timer.total()})
    shown = tuple((header, short(value)) for header, value in zip(measured.headers, last, strict=False) if value != "")
    return Outcome(status, reason, folder, count, shown, timer.total())


def _next(blocks: Iterator[Block], timer: Timer) -> Block | None:
    """Compute a block; None after the last."""
    with timer.phase("curves"):
        return next(blocks, None)


def _head(case: FabricCase, measured: Measured) -> dict[str, Any]:
    """Return what a report says before anything has run."""
    return {
        **about(case),
        "kind": case.scene.kind,
        "columns": {},
        "scene": dict(measured.remains),
        "omitted": list(OMITTED),
        "resolved_case": case.model_dump(mode="json", exclude_none=True),
        "curves": [],
    }
