"""All that a run writes, as it goes on: the history, the fields and the report."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

from fabfem.boundary_value.audit import audit, audited
from fabfem.boundary_value.fields import QUANTITIES
from fabfem.boundary_value.frame import frame
from fabfem.boundary_value.omitted import remaining
from fabfem.boundary_value.peaks import Peaks
from fabfem.boundary_value.problem import Problem
from fabfem.boundary_value.safety import safety, write_curve
from fabfem.boundary_value.stability import localisation
from fabfem.fem.increment import Collapsed, Cutback, Increment
from fabfem.output.history import History
from fabfem.output.report import Report
from fabfem.output.vtu import FieldFiles
from fabfem.timing import Timer

SIGN = "stress and strain are positive in compression"
PHASES = ("read", "mesh", "material", "assembly", "linear_solve", "output")


class Recorder:
    """All that a run writes."""

    def __init__(self, problem: Problem, folder: Path, timer: Timer) -> None:
        self.problem, self.folder, self.timer = problem, folder, timer
        _clear(folder)
        self.history = History(folder / "history.csv", [column.header for column in problem.columns])
        self.report = Report(folder / "report.json", **_head(problem))
        self.fields = _field_files(problem, folder)
        self.row: tuple[Any, ...] = ()
        self._peaks = Peaks(problem.columns)
        self._stored = 0
        self._last: Increment | None = None

    def add(self, increment: Increment) -> None:
        """Write what an increment adds to the result."""
        self.timer.add(increment.timings)
        with self.timer.phase("output"):
            self.row = tuple(column.value(increment) for column in self.problem.columns)
            self.history.write(self.row)
            self._last = increment
            output = self.problem.case.output
            if output and (increment.number % output.every == 0 or increment.fraction >= 1.0):
                self._store()
            self.report.add(_entry(increment), map(asdict, increment.cutbacks))
            self._peaks.add(increment, self.row)
            self.report.content["peaks"] = self._peaks.content()
            if increment.worst_error > 0.0:
                self.report.worst(_place(self.problem, increment))
            if audited(self.problem, increment):
                self.report.content["audit"] = audit(self.problem, increment)
            if output and "acoustic_determinant" in output.fields and "localisation" not in self.report.content:
                self.report.content.update(localisation(self.problem.model.space, increment))
        self._write_report()

    def failed(self, end: Collapsed) -> None:
        """Write how a search for the factor of safety ended: its bracket, its curve and its mechanism."""
        self.timer.add(end.timings)
        with self.timer.phase("output"):
            self._store()
            self.report.content["factor_of_safety"] = safety(end)
            self.report.content["cutbacks"].extend(map(asdict, end.cutbacks))
            write_curve(self.folder / "strength_reduction.csv", end, self.problem.case.units.length)
            if self.fields and end.failing and self.problem.case.output:
                self.fields.write(frame(self.problem, self.problem.case.output, end.failing))

    def end(self, status: str, reason: str, cutbacks: tuple[Cutback, ...] = ()) -> tuple[str, str]:
        """Store the fields of the last increment, say how the run ended, close, and return status and reason."""
        self._store()
        self.report.content["cutbacks"].extend(map(asdict, cutbacks))
        self.report.end(status, reason)
        self._write_report()
        self.history.close()
        return status, reason

    def _store(self) -> None:
        output, last = self.problem.case.output, self._last
        if self.fields and output and last and last.number != self._stored:
            self.fields.write(frame(self.problem, output, last))
            self._stored = last.number

    def _write_report(self) -> None:
        total = self.timer.total()
        self.report.write({**self.timer.spent, "other": total - sum(self.timer.spent.values()), "total": total})


def _head(problem: Problem) -> dict[str, Any]:
    """Return what a report says before anything has run."""
    case, units = problem.case, problem.case.unit_system
    kinds = ("probe", "reaction", "derived", "error")
    fields = case.output.fields if case.output else ()
    return {
        "case": case.path.name,
        "title": case.title,
        "units": {**units._asdict(), "stress": units.label("stress")},
        "columns": {kind: [column.header for column in problem.columns if column.kind == kind] for kind in kinds},
        "fields": {name: units.label(QUANTITIES.get(name, "none")) for name in fields},
        "scene": dict(remaining(problem.model)),
        "omitted": list(problem.omitted),
        "resolved_case": case.model_dump(mode="json", exclude_none=True),
    }


def _entry(increment: Increment) -> dict[str, Any]:
    """Return what a report keeps of an increment."""
    kept = ("stage", "number", "fraction", "size", "time", "iterations", "residuals", "out_of_balance")
    found = {name: getattr(increment, name) for name in (*kept, "drag", "held", "moved", "strength", "load_factor")}
    return found | {"cutbacks": len(increment.cutbacks)}


def _place(problem: Problem, increment: Increment) -> dict[str, Any]:
    """Return the point of an increment with the largest local error, and where it is."""
    return {
        "point": increment.worst_point,
        "error": increment.worst_error,
        "at": problem.model.space.points[increment.worst_point].tolist(),
        "stage": increment.stage,
        "increment": increment.number,
    }


def _field_files(problem: Problem, folder: Path) -> FieldFiles | None:
    if problem.case.output is None:
        return None
    mesh = problem.model.space.mesh
    units = problem.case.unit_system
    note = f"fabfem: {SIGN}; length in {units.length}, stress in {units.label('stress')}"
    return FieldFiles(folder, mesh.points, mesh.cells, mesh.cell_type, note)


def _clear(folder: Path) -> None:
    """Remove the results and pictures of an earlier run."""
    for pattern in ("fields_*.vtu", "fields.pvd", "history.csv", "report.json", "strength_reduction.csv", "*.png"):
        for file in folder.glob(pattern):
            file.unlink()
