"""All that a run writes, as it goes on: the history, the fields and the report."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from fabfem.boundary_value.audit import audit, audited
from fabfem.boundary_value.entries import entry, head, refused, worst
from fabfem.boundary_value.frame import frame
from fabfem.boundary_value.meshes import mesh_file
from fabfem.boundary_value.peaks import Peaks
from fabfem.boundary_value.probes import Column
from fabfem.boundary_value.problem import Problem
from fabfem.boundary_value.safety import safety, write_curve
from fabfem.boundary_value.shares import shares
from fabfem.boundary_value.stability import localisation
from fabfem.failures import clear as clear_failures
from fabfem.failures import keep_points, keep_stage
from fabfem.fem.increment import Collapsed, Cutback, Increment, Stopped
from fabfem.fem.share import share_of
from fabfem.fem.start import Start
from fabfem.output.checkpoints import PATTERN as CHECKPOINTS
from fabfem.output.checkpoints import SHARES, Checkpoint, Checkpoints
from fabfem.output.history import History, Unheard
from fabfem.output.report import Report
from fabfem.output.view import write_view
from fabfem.output.vtu import FieldFiles, FieldPieces, Frame
from fabfem.timing import Timer

SIGN = "stress and strain are positive in compression"
GATHERED = {"increments", "cutbacks", "worst_points"}
"""Parts of a report that grow."""
PHASES = ("read", "mesh", "material", "assembly", "linear_solve", "output")


class Written(NamedTuple):
    """What the files of a run have come to, for a checkpoint."""

    history: int = 0
    """Size of the table [bytes]."""
    fields: tuple[tuple[float, str], ...] = ()
    """Time and file of each stored increment."""
    report: Mapping[str, Any] = {}
    """What the report has gathered."""
    row: tuple[Any, ...] = ()
    peaks: Any = ()
    stored: int = 0
    """Number of the increment that was stored last."""
    pending: Frame | None = None
    """Fields of the last increment, where they are not stored."""
    keepers: Mapping[str, Any] = {}
    """What columns add up, by their names."""
    wall_time: Mapping[str, float] = {}
    """Time by phase and in all [s]."""


class Recorder:
    """All that a run writes."""

    def __init__(
        self,
        problem: Problem,
        folder: Path,
        timer: Timer,
        identity: dict[str, Any],
        start: Start | None = None,
        written: Written | None = None,
    ) -> None:
        self._start = start
        self.problem, self.folder, self.timer, self.identity = problem, folder, timer, identity
        then = written or Written()
        headers = [column.header for column in problem.columns]
        self._ranks = problem.model.space.mesh.ranks
        self._first = self._ranks.rank == 0
        self.history = History(folder / "history.csv", headers, then.history) if self._first else Unheard(headers)
        if self._first:
            _clear(folder, [name for _, name in then.fields], bool(written))
        self.report = Report(folder / "report.json" if self._first else None, **head(problem))
        self._standing = set(self.report.content) - GATHERED
        self.report.content |= then.report
        self.fields = _field_files(problem, folder, then.fields)
        self.row = then.row
        self._peaks = Peaks(problem.columns)
        self._peaks.recall(then.peaks)
        self._stored = then.stored
        self._last: Increment | None = None
        self._pending = then.pending
        said = problem.case.checkpoint
        wait = lambda: self._ranks.sum(0)  # noqa: E731
        self._checkpoints = Checkpoints(folder, said.seconds, said.increments, self._ranks.rank, wait)
        recall(problem.columns, then.keepers)
        timer.resume(then.wall_time, then.wall_time.get("total", 0.0))

    def add(self, increment: Increment) -> None:
        """Write what an increment adds to the result."""
        self.timer.add(increment.timings)
        with self.timer.phase("output"):
            self.row = tuple(column.value(increment) for column in self.problem.columns)
            self.history.write(self.row)
            self._last, self._pending = increment, None
            if self._first:
                keep_points(self.problem.case, self.folder, increment.cutbacks)
            output = self.problem.case.output
            if output and (increment.number % output.every == 0 or increment.fraction >= 1.0):
                self._store()
            self.report.add(entry(increment), map(refused, increment.cutbacks))
            self._peaks.add(increment, self.row)
            self.report.content["peaks"] = self._peaks.content()
            if increment.worst_error > 0.0:
                self.report.worst(worst(self.problem, increment))
            if audited(self.problem, increment):
                self.report.content["audit"] = audit(self.problem, increment)
            if output and "acoustic_determinant" in output.fields and "localisation" not in self.report.content:
                self.report.content.update(localisation(self.problem.model.space, increment))
        self._write_report()
        with self.timer.phase("output"):
            if self._ranks.largest(self._checkpoints.due()):
                self._keep()

    def failed(self, end: Collapsed) -> None:
        """Write how a search for the factor of safety ended: its bracket, its curve and its mechanism."""
        self.timer.add(end.timings)
        with self.timer.phase("output"):
            self._keep()
            self._store()
            self.report.content["factor_of_safety"] = safety(end)
            self.report.content["cutbacks"].extend(map(refused, end.cutbacks))
            if self._first:
                write_curve(self.folder / "strength_reduction.csv", end, self.problem.case.units.length)
            if self.fields and end.failing and self.problem.case.output:
                self.fields.write(frame(self.problem, self.problem.case.output, end.failing))

    def stopped(self, end: Stopped) -> None:
        """Write what it takes to run again alone what a run could not get through."""
        self.timer.add(end.timings)
        case, resume = self.problem.case, self._last.resume if self._last else self._start
        if self._first:
            keep_points(case, self.folder, end.cutbacks)
        if self._ranks.size > 1:  # the state of one rank alone cannot be run again; its checkpoint can
            return
        keep_stage(case, self.folder, resume, (end.stage, end.fraction, end.reason), mesh_file(case))

    def end(self, status: str, reason: str, cutbacks: tuple[Cutback, ...] = ()) -> tuple[str, str]:
        """Store the last increment and a checkpoint, say how the run ended, close, and return status and reason."""
        self._keep()
        self._store()
        self.report.content["cutbacks"].extend(map(refused, cutbacks))
        self.report.end(status, reason)
        self._write_report()
        self.history.close()
        return status, reason

    def _store(self) -> None:
        output, last = self.problem.case.output, self._last
        if self.fields and output and last and last.number != self._stored:
            self.fields.write(frame(self.problem, output, last))
            self._stored = last.number
        elif self.fields and self._pending:
            self.fields.write(self._pending)
            self._pending = None

    def _keep(self) -> None:
        """Write a checkpoint of the last increment."""
        if self._last is not None:
            share, number = share_of(self.problem.model.space), self._ranks.size
            moment = Checkpoint(self.identity, self._last.resume, self._written()._asdict(), share, number)
            self._checkpoints.write(self._last.number, moment)

    def _written(self) -> Written:
        """Return what the files have come to."""
        keepers = {column.name: column.keeper.memory() for column in self.problem.columns if column.keeper}
        fields = tuple(self.fields.stored) if self.fields else ()
        content = {name: entry for name, entry in self.report.content.items() if name not in self._standing}
        time = {**self.timer.spent, "total": self.timer.total()}
        peaks = self._peaks.memory()
        return Written(
            self.history.size, fields, content, self.row, peaks, self._stored, self._unstored(), keepers, time
        )

    def _unstored(self) -> Frame | None:
        """Return the fields of the last increment where they are not stored yet."""
        output, last = self.problem.case.output, self._last
        if output and last and last.number != self._stored:
            return frame(self.problem, output, last)
        return self._pending

    def _write_report(self) -> None:
        self.report.content |= shares(self.problem.model.space, self.timer)
        self.report.write_timed(self.timer)


def recall(columns: Sequence[Column], keepers: Mapping[str, Any]) -> None:
    """Give the columns that add something up what an earlier run had gathered; `CaseError` where it had not."""
    for column in columns if keepers else ():
        if column.keeper:
            column.keeper.recall(keepers[column.name])


def _field_files(problem: Problem, folder: Path, stored: Sequence[tuple[float, str]]) -> FieldFiles | None:
    if problem.case.output is None:
        return None
    mesh = problem.model.space.mesh
    units = problem.case.unit_system
    if mesh.ranks.rank == 0:
        write_view(folder, problem.case.path.stem, problem.case.output.fields)
    note = f"fabfem: {SIGN}; length in {units.length}, stress in {units.label('stress')}"
    parts = (folder, mesh.points, mesh.cells, mesh.cell_type, note, stored)
    ranks = mesh.ranks
    return FieldFiles(*parts) if ranks.size == 1 else FieldPieces(ranks.rank, ranks.size, *parts)


def _clear(folder: Path, kept: Sequence[str], resumed: bool) -> None:
    """Remove the results and pictures of an earlier run, or what it has that is later than its checkpoint."""
    if not resumed:
        clear_failures(folder)
    later = ("fields_*.vtu", "fields_*.pvtu", "strength_reduction.csv", "*.png", ".*.part")
    for pattern in later if resumed else (*later, "fields.pvd", "report.json", CHECKPOINTS, SHARES):
        for file in folder.glob(pattern):
            if not _belongs(file.name, kept):
                file.unlink()


def _belongs(name: str, kept: Sequence[str]) -> bool:
    """Return whether a file is one of those kept, or a rank's piece of one."""
    return name in kept or f"{name[: len('fields_0000')]}.pvtu" in kept
