"""A run from the case to the last row: march the problem, write what converges, say how it ended."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from fabfem.case import Case, CaseError, read_case
from fabfem.case.stages import Geostatic
from fabfem.interrupt import held_back
from fabfem.output.progress import Quiet, Terminal, summary
from fabfem.problem import Problem, build
from fabfem.record import Recorder, Timer
from fabfem.solve import Increment, Stopped, march


class Outcome(NamedTuple):
    """How a run ended."""

    status: str
    """``completed``, ``stopped`` or ``interrupted``."""
    reason: str
    """Why it ended before its end, in a sentence; empty when completed."""
    folder: Path
    """Where the results are."""
    increments: int
    """Converged increments."""
    last: tuple[tuple[str, str], ...]
    """Header and value of the last row of the history."""
    seconds: float
    """Wall time [s]."""

    def summary(self) -> str:
        """Return what the terminal shows when a run is over: how it ended and where to look."""
        head = f"{self.status} after {self.increments} increments in {self.seconds:.1f} s"
        files = {"history": "history.csv", "fields": "fields.pvd", "report": "report.json"}
        places = [(name, str(self.folder / file)) for name, file in files.items() if (self.folder / file).is_file()]
        return "\n".join([head, summary(self.last), "", summary([*places, ("pictures", f"fabfem show {self.folder}")])])


def run_case(source: Case | Path, folder: Path, quiet: bool = False) -> Outcome:
    """Run a case and write its results into a folder.

    Parameters
    ----------
    source : Case or Path
        What to run, or the file that says it.
    folder : Path
        Folder of the results, made if it is not there; results of an earlier run in it are replaced.
    quiet : bool
        Show no progress.

    Raises
    ------
    CaseError
        If the case cannot be run or the folder cannot be written.
    """
    timer = Timer()
    with timer.phase("read"):
        case = source if isinstance(source, Case) else read_case(source)
    with timer.phase("mesh"):
        problem = build(case)
        steps = march(problem.model)
    _make(folder)
    recorder = Recorder(problem, folder, timer)
    stages = len(problem.model.stages)
    with Quiet() if quiet else Terminal(stages) as shown:
        status, reason = _drive(steps, recorder, shown)
    headers = [column.header for column in problem.columns]
    last = tuple((header, _short(value)) for header, value in zip(headers, recorder.row, strict=False))
    return Outcome(status, reason, folder, len(recorder.report.content["increments"]), last, timer.total())


def _drive(steps: Iterator[Increment | Stopped], recorder: Recorder, shown: Quiet) -> tuple[str, str]:
    """March to the end and return the status and the reason."""
    case = recorder.problem.case
    try:
        for step in steps:
            if isinstance(step, Stopped):
                recorder.timer.add(step.timings)
                return recorder.end("stopped", _why(step, recorder.problem), step.cutbacks)
            with held_back():
                recorder.add(step)
            if isinstance(case.stage[step.stage_index], Geostatic):
                shown.say(_audit(step, case.units.length))
            shown.advance(step.stage, step.stage_index + step.fraction, step.number, step.iterations)
    except KeyboardInterrupt:
        return recorder.end("interrupted", "interrupted; all increments that converged are kept")
    except OSError as error:
        return "stopped", f"the results cannot be written: {error.strerror or error}"
    return recorder.end("completed", "")


def _audit(step: Increment, length: str) -> str:
    """Return how far the initial state was from equilibrium."""
    unbalanced = f"out of balance by {step.out_of_balance:.1e} of the forces at work"
    return f"{step.stage}: {unbalanced}, moved {step.moved:.1e} {length}"


def _why(stopped: Stopped, problem: Problem) -> str:
    """Return the sentence that says why and where a run stopped."""
    where = f" at {_coordinates(problem, stopped.point)}" if stopped.point >= 0 else ""
    return (
        f"stage {stopped.stage} stopped at {100.0 * stopped.fraction:.3g} % of its course: "
        f"{stopped.reason.rstrip('.')}{where}; all increments that converged are kept"
    )


def _coordinates(problem: Problem, point: int) -> str:
    places = ", ".join(f"{value:.4g}" for value in problem.model.space.points[point])
    return f"point {point} ({places})"


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "report.json").touch()
    except OSError as error:
        raise CaseError(f"{folder}: results cannot be written there ({error.strerror or error})") from None


def _short(value: Any) -> str:
    return f"{value:.5g}" if isinstance(value, float) else str(value)
