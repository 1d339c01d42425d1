"""An element test from the case to the last row: lead the specimen through its stages, write, say how it ended."""

from collections.abc import Iterator
from pathlib import Path as Folder
from typing import Any

import numpy as np

from fabfem.case import ElementCase
from fabfem.case.element import Path, Probe
from fabfem.laboratory.record import PHASES, Recorder
from fabfem.laboratory.specimen import Specimen, build
from fabfem.laboratory.stages import End, path
from fabfem.outcome import Description, Outcome, make_folder, short
from fabfem.output.interrupt import held_back
from fabfem.output.progress import Quiet, Terminal
from fabfem.timing import Timer
from umat.mandel import Array


def describe(case: ElementCase) -> Description:
    """Return what a case leaves out and what remains, without running it.

    Raises
    ------
    CaseError
        If the case cannot be run.
    """
    specimen = build(case)
    return Description(specimen.omitted, tuple(_remaining(specimen)))


def _remaining(specimen: Specimen) -> Iterator[tuple[str, str]]:
    case = specimen.case
    for stage in case.stage:
        what = f"{stage.directions} probes" if isinstance(stage, Probe) else f"{stage.increments} rows to each target"
        yield f"stage {stage.name}", f"{stage.kind}, {what}"
    if specimen.directions is not None:
        yield "directions", str(len(specimen.directions))
    yield "columns", str(len(specimen.columns))
    yield "accuracy", f"curves to {100.0 * case.accuracy.curve:g} %"


def run(case: ElementCase, folder: Folder, quiet: bool, timer: Timer | None = None) -> Outcome:
    """Run a case and write its results into a folder; see `fabfem.run.run_case`."""
    timer = timer or Timer(PHASES)
    with timer.phase("material"):
        specimen = build(case)
    make_folder(folder)
    recorder = Recorder(specimen, folder, timer)
    with Quiet() if quiet else Terminal(len(case.stage)) as shown:
        status, reason = _drive(specimen, recorder, shown)
    last = tuple((header, short(value)) for header, value in zip(recorder.headers, recorder.values, strict=False))
    return Outcome(status, reason, folder, recorder.count, last, timer.total())


def _drive(specimen: Specimen, recorder: Recorder, shown: Quiet) -> tuple[str, str]:
    """Go through the stages and return the status and the reason."""
    state, strain = specimen.state, np.zeros(6)
    try:
        for number, stage in enumerate(specimen.case.stage):
            if isinstance(stage, Probe):
                recorder.probe(stage, state)
                continue
            strain = strain if stage.keep_strain else np.zeros(6)
            state, strain, end = _path(specimen, stage, number, state, strain, recorder, shown)
            if end.reason:
                shown.say(f"{stage.name}: {end.status.replace('_', ' ')}: {end.reason}")
            if end.status == "stopped":
                sentence = f"stage {stage.name} stopped {end.reason}; all increments that converged are kept"
                return recorder.end("stopped", sentence)
    except KeyboardInterrupt:
        return recorder.end("interrupted", "interrupted; all increments that converged are kept")
    except OSError as error:
        return "stopped", f"the results cannot be written: {error.strerror or error}"
    return recorder.end("completed", "")


def _path(
    specimen: Specimen, stage: Path, number: int, state: Any, strain: Array, recorder: Recorder, shown: Quiet
) -> tuple[Any, Array, End]:
    """Follow the path of a stage and return the state and the strain that it ends with, and how."""
    steps = path(specimen, stage, state, strain)
    end = End("completed", "", 0, 0, 0.0)
    while True:
        with recorder.timer.phase("paths"):
            step = next(steps)
        if isinstance(step, End):
            end = step
            break
        with held_back():
            recorder.add(step)
        state, strain = step.state, step.strain
        shown.advance(stage.name, number + min(max(step.fraction, 0.0), 1.0), step.increment, 1)
    recorder.end_path(stage, end)
    return state, strain, end
