"""An element test from the case to the last row: lead the specimen through its stages, write, say how it ended."""

from collections.abc import Callable, Iterator
from pathlib import Path as Folder
from typing import Any

import numpy as np

from fabfem.case import CaseError, ElementCase
from fabfem.case.paths import Path, Probe
from fabfem.failures import keep_stage
from fabfem.identity import identity
from fabfem.laboratory.price import price, stored
from fabfem.laboratory.price import remember as remember_run
from fabfem.laboratory.record import PHASES, STANDING, Reached, Recorder, Written
from fabfem.laboratory.specimen import Specimen, build
from fabfem.laboratory.stages import End, path
from fabfem.outcome import INTERRUPTED, Description, Outcome, Pricing, claimed, short, unwritten
from fabfem.output.interrupt import held_back, patient
from fabfem.output.progress import Quiet
from fabfem.output.progress import shown as progress
from fabfem.output.report import read_report
from fabfem.restart import FRESH, Restart, checkpoint_of
from fabfem.timing import Timer
from umat.mandel import Array

PROGRAM = 185
"""Memory of the interpreter with the packages and compiled kernels that an element test loads [MiB]."""


def describe(case: ElementCase, pricing: Pricing = Pricing.NONE) -> Description:
    """Return what a case leaves out and what remains, without running it; see `fabfem.run.describe_case`.

    Raises
    ------
    CaseError
        If the case cannot be run.
    """
    specimen = build(case)
    time = pricing.time(stored(case) is not None, lambda: price(specimen).told())
    return Description(specimen.omitted, tuple(_remaining(specimen)), time=time)


def remember(case: ElementCase, folder: Folder) -> None:
    """Keep what a completed run has cost, for the price of the next one of its kind."""
    remember_run(build(case), read_report(folder))


def _remaining(specimen: Specimen) -> Iterator[tuple[str, str]]:
    case = specimen.case
    for stage in case.stage:
        what = f"{stage.directions} probes" if isinstance(stage, Probe) else f"{stage.increments} rows to each target"
        yield f"stage {stage.name}", f"{stage.kind}, {what}"
    if specimen.directions is not None:
        yield "directions", str(len(specimen.directions))
    yield "columns", str(len(specimen.columns))
    yield "accuracy", f"curves to {100.0 * case.accuracy.curve:g} %"
    yield "memory", f"about {PROGRAM} MiB, the program itself; points and rows are nothing beside it"


def run(
    case: ElementCase, folder: Folder, quiet: bool, timer: Timer | None = None, restart: Restart = FRESH
) -> Outcome:
    """Run a case and write its results into a folder; see `fabfem.run.run_case`."""
    timer = timer or Timer(PHASES)
    with timer.phase("material"):
        specimen = build(case)
    known = identity(case)
    begun = checkpoint_of(restart, folder, known)
    start = begun.start if begun else Reached(0, specimen.state, np.zeros(6))
    if restart.branch is not None:
        _fits(specimen, start, restart)
    written = Written(**begun.written) if begun and restart.branch is None else None
    with claimed(folder):
        try:
            recorder = Recorder(specimen, folder, timer, known, written)
            with progress(quiet, len(case.stage)) as shown:
                status, reason = _drive(specimen, recorder, shown, start)
        except OSError as error:
            return unwritten(error, folder, timer.total())
    last = tuple((header, short(value)) for header, value in zip(recorder.headers, recorder.values, strict=False))
    return Outcome(status, reason, folder, recorder.count, last, timer.total())


def _fits(specimen: Specimen, start: Reached, restart: Restart) -> None:
    """Refuse a state that the material of a case does not keep, or that lies behind its last stage."""
    shapes = [[part.shape for part in state] for state in (specimen.state, start.state)]
    if type(start.state) is not type(specimen.state) or shapes[0] != shapes[1]:
        raise CaseError(f"{specimen.case.path.name}: the material keeps another state than that in {restart.branch}")
    if start.number > len(specimen.case.stage):
        raise CaseError(f"{specimen.case.path.name}: the state in {restart.branch} is behind {start.number} stages")


def replay(case: ElementCase, start: Any) -> tuple[tuple[str, float, str] | None, list[str]]:
    """Return how the stage after a start fails (stage, fraction, reason), None if not; and the steps that it took."""
    specimen, stage = build(case), case.stage[start.number]
    if isinstance(stage, Probe):
        return None, []
    strain = start.strain if stage.keep_strain else np.zeros(6)
    fraction = 0.0
    for step in path(specimen, stage, start.state, strain):
        if isinstance(step, End):
            told = f"  {step.steps} steps, {step.work} evaluations of the material, error {step.error:.1e}"
            return (stage.name, fraction, step.reason) if step.status == "stopped" else None, [told]
        fraction = step.fraction
    raise AssertionError("a path ends with its end")


def _drive(specimen: Specimen, recorder: Recorder, shown: Quiet, start: Reached) -> tuple[str, str]:
    """Go through the stages from a start and return the status and the reason."""
    stages = specimen.case.stage
    reached = start
    try:
        with patient(shown.say) as interrupted:
            for number, stage in enumerate(stages[start.number :], start.number):
                with held_back():
                    recorder.keep(reached)
                if isinstance(stage, Probe):
                    recorder.probe(stage, reached.state)
                    reached = reached._replace(number=number + 1)
                    continue
                state, strain, end = _path(specimen, stage, reached, recorder, shown, interrupted)
                if end.reason:
                    shown.say(f"{stage.name}: {end.status.replace('_', ' ')}: {end.reason}")
                if end.status == "stopped":
                    fraction = float(recorder.values[STANDING.index("fraction [-]")])
                    keep_stage(specimen.case, recorder.folder, reached, (stage.name, fraction, end.reason))
                    sentence = f"stage {stage.name} stopped {end.reason}; all increments that converged are kept"
                    return recorder.end("stopped", sentence)
                reached = Reached(number + 1, state, strain)
    except KeyboardInterrupt:
        return recorder.end("interrupted", INTERRUPTED)
    recorder.keep(reached)
    return recorder.end("completed", "")


def _path(
    specimen: Specimen, stage: Path, reached: Reached, recorder: Recorder, shown: Quiet, interrupted: Callable[[], bool]
) -> tuple[Any, Array, End]:
    """Follow the path of a stage and return the state and the strain that it ends with, and how."""
    state, strain = reached.state, reached.strain if stage.keep_strain else np.zeros(6)
    steps = path(specimen, stage, state, strain)
    while True:
        with recorder.timer.phase("paths"):
            step = next(steps)
        if isinstance(step, End):
            recorder.end_path(stage, step)
            return state, strain, step
        with held_back():
            recorder.add(step)
        state, strain = step.state, step.strain
        shown.advance(stage.name, reached.number + min(max(step.fraction, 0.0), 1.0), step.increment, 1)
        if interrupted():
            raise KeyboardInterrupt
