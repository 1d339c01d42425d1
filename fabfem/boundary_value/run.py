"""A boundary-value run from the case to the last row: march the problem, write what converges, say how it ended."""

from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from fabfem.boundary_value.audit import audited
from fabfem.boundary_value.entries import place_of
from fabfem.boundary_value.meshes import hash_of
from fabfem.boundary_value.omitted import memory, remaining
from fabfem.boundary_value.price import price, stored
from fabfem.boundary_value.price import remember as remember_run
from fabfem.boundary_value.problem import Problem, build
from fabfem.boundary_value.record import PHASES, Recorder, Written, recall
from fabfem.boundary_value.safety import sentence
from fabfem.boundary_value.shares import blame, dealt
from fabfem.case import BoundaryValueCase, CaseError
from fabfem.fem.flow import UNDECIDED
from fabfem.fem.increment import Collapsed, Increment, Stopped
from fabfem.fem.solve import march
from fabfem.fem.start import misfit
from fabfem.identity import identity
from fabfem.outcome import INTERRUPTED, Description, Outcome, Pricing, claimed, short, unwritten
from fabfem.output.checkpoints import Checkpoint
from fabfem.output.interrupt import held_back, patient
from fabfem.output.progress import Quiet
from fabfem.output.progress import shown as progress
from fabfem.output.report import read_report
from fabfem.restart import FRESH, Restart, checkpoint_of
from fabfem.timing import Timer


def describe(case: BoundaryValueCase, pricing: Pricing = Pricing.NONE) -> Description:
    """Return what a case leaves out and what remains, without running it; see `fabfem.run.describe_case`.

    Raises
    ------
    CaseError
        If the case cannot be run.
    """
    problem = build(case)
    time = pricing.time(stored(case) is not None, lambda: price(problem).told())
    return Description(problem.omitted, tuple(remaining(problem.model)), memory(problem.model), time)


def remember(case: BoundaryValueCase, folder: Path) -> None:
    """Keep what a completed run has cost, for the price of the next one of its kind."""
    remember_run(build(case), read_report(folder))


def run(
    case: BoundaryValueCase, folder: Path, quiet: bool, timer: Timer | None = None, restart: Restart = FRESH
) -> Outcome:
    """Run a case and write its results into a folder; see `fabfem.run.run_case`."""
    timer = timer or Timer(PHASES)
    with timer.phase("mesh"):
        problem = build(case)
        known = identity(case, mesh=problem.model.space.mesh.ranks.told() or hash_of(problem.model.space.mesh))
        begun = checkpoint_of(restart, folder, known)
        if begun:
            begun = dealt(begun, restart.branch or folder, problem.model.space, known["mesh"])
        steps = _steps(problem, begun, restart)
    ranks = problem.model.space.mesh.ranks
    with claimed(folder) if ranks.rank == 0 else nullcontext():
        ranks.sum(0)  # none writes before the folder is there
        try:
            recorder = _recorder(problem, folder, timer, known, begun, restart)
            with progress(quiet or bool(ranks.rank), len(problem.model.stages)) as shown:
                status, reason = _drive(steps, recorder, shown)
        except OSError as error:
            if ranks.size > 1:  # the others wait for this rank, and do not know
                raise
            return unwritten(error, folder, timer.total())
    headers = [column.header for column in problem.columns]
    last = tuple((header, short(value)) for header, value in zip(headers, recorder.row, strict=False))
    return Outcome(status, reason, folder, len(recorder.report.content["increments"]), last, timer.total())


def replay(case: BoundaryValueCase, start: Any) -> tuple[tuple[str, float, str] | None, list[str]]:
    """Return how the next increment after a start fails (stage, fraction, reason), None if not, and a line a try."""
    step = next(march(build(case).model, start))
    assert not isinstance(step, Collapsed)
    tries = [
        f"  increment of {100 * cut.size:.4g} %: {cut.reason}; residuals {' '.join(f'{r:.1e}' for r in cut.residuals)}"
        for cut in step.cutbacks
    ]
    return (step.stage, step.fraction, step.reason) if isinstance(step, Stopped) else None, tries


def _steps(problem: Problem, begun: Checkpoint | None, restart: Restart) -> Iterator[Increment | Stopped | Collapsed]:
    """Return the march from a checkpoint; `CaseError` where the case cannot go on from it."""
    start = begun.start if begun else None
    why = misfit(problem.model, start) if start else ""
    if why:
        raise CaseError(f"{problem.case.path.name}: it cannot go on from the state in {restart.branch}: {why}")
    return march(problem.model, start)


def _recorder(
    problem: Problem,
    folder: Path,
    timer: Timer,
    known: dict[str, Any],
    begun: Checkpoint | None,
    restart: Restart,
) -> Recorder:
    if begun is None or restart.branch is None:
        return Recorder(problem, folder, timer, known, *((begun.start, Written(**begun.written)) if begun else ()))
    gathering = [column.name for column in problem.columns if column.keeper]
    if set(gathering) - set(begun.written["keepers"]):
        raise CaseError(f"{problem.case.path.name}: errors: {restart.branch} has not gathered {', '.join(gathering)}")
    recorder = Recorder(problem, folder, timer, known, begun.start)
    recall(problem.columns, begun.written["keepers"])
    start = begun.start
    told = {"folder": str(restart.branch), "stage": start.stage, "increment": start.number}
    recorder.report.content["branch"] = told | {"hash": begun.identity["hash"]}
    return recorder


def _drive(steps: Iterator[Increment | Stopped | Collapsed], recorder: Recorder, shown: Quiet) -> tuple[str, str]:
    """March to the end and return the status and the reason."""
    case, ranks = recorder.problem.case, recorder.problem.model.space.mesh.ranks
    try:
        with patient(shown.say) as interrupted:
            for step in steps:
                if isinstance(step, Stopped):
                    recorder.stopped(step)
                    return recorder.end("stopped", _why(step, recorder.problem), step.cutbacks)
                if isinstance(step, Collapsed):
                    return _found(step, recorder, shown)
                with held_back():
                    recorder.add(step)
                if audited(recorder.problem, step):
                    shown.say(_audit(recorder.report.content["audit"], case.units.length))
                shown.advance(step.stage, step.stage_index + step.fraction, step.number, step.iterations)
                if ranks.largest(interrupted()):
                    return recorder.end("interrupted", INTERRUPTED)
    except (KeyboardInterrupt, Exception) as error:
        if ranks.size > 1:
            blame(recorder.folder, ranks.rank, error)
            raise
        if isinstance(error, KeyboardInterrupt):
            return recorder.end("interrupted", INTERRUPTED)
        raise
    return recorder.end("completed", "")


def _found(end: Collapsed, recorder: Recorder, shown: Quiet) -> tuple[str, str]:
    """Record the factor of safety and return status and reason."""
    with held_back():
        recorder.failed(end)
    shown.say(sentence(end))
    if end.last_equilibrium is None or end.verdict == UNDECIDED:
        return recorder.end("stopped", sentence(end))
    return recorder.end("completed", "")


def _audit(found: dict[str, Any], length: str) -> str:
    """Return how far the initial state was from equilibrium, and why."""
    unbalanced = f"out of balance by {found['out_of_balance']:.1e} of the forces at work"
    return f"{found['stage']}: {unbalanced}, moved {found['moved']:.1e} {length}; {found['why']}"


def _why(stopped: Stopped, problem: Problem) -> str:
    """Return the sentence that says why and where a run stopped."""
    where = f" at {_coordinates(problem, stopped.point)}" if stopped.point >= 0 else ""
    return (
        f"stage {stopped.stage} stopped at {100.0 * stopped.fraction:.3g} % of its course: "
        f"{stopped.reason.rstrip('.')}{where}; all increments that converged are kept"
    )


def _coordinates(problem: Problem, point: int) -> str:
    places = ", ".join(f"{value:.4g}" for value in place_of(problem.model.space, point))
    return f"point {point} ({places})"
