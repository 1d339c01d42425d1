"""What the report of a boundary-value run keeps of the problem, of its increments and of their cut-backs."""

from typing import Any

from fabfem.boundary_value.fields import QUANTITIES
from fabfem.boundary_value.omitted import remaining
from fabfem.boundary_value.problem import Problem
from fabfem.fem.increment import Cutback, Increment
from fabfem.fem.space import Space
from fabfem.output.report import about


def refused(cutback: Cutback) -> dict[str, Any]:
    """Return what a report keeps of a cut-back."""
    return {name: getattr(cutback, name) for name in ("stage", "fraction", "size", "reason", "point")}


def head(problem: Problem) -> dict[str, Any]:
    """Return what a report says before anything has run."""
    case, units = problem.case, problem.case.unit_system
    kinds = ("probe", "reaction", "derived", "error")
    fields = case.output.fields if case.output else ()
    return {
        **about(case),
        "columns": {kind: [column.header for column in problem.columns if column.kind == kind] for kind in kinds},
        "fields": {name: units.label(QUANTITIES.get(name, "none")) for name in fields},
        "scene": dict(remaining(problem.model)),
        "omitted": list(problem.omitted),
        "resolved_case": case.model_dump(mode="json", exclude_none=True),
    }


def entry(increment: Increment) -> dict[str, Any]:
    """Return what a report keeps of an increment."""
    kept = ("stage", "number", "fraction", "size", "time", "iterations", "residuals", "out_of_balance")
    found = {name: getattr(increment, name) for name in (*kept, "drag", "held", "moved", "strength", "load_factor")}
    return found | {"cutbacks": len(increment.cutbacks)}


def worst(problem: Problem, increment: Increment) -> dict[str, Any]:
    """Return the point of an increment with the largest local error, and where it is."""
    return {
        "point": increment.worst_point,
        "error": increment.worst_error,
        "at": place_of(problem.model.space, increment.worst_point),
        "stage": increment.stage,
        "increment": increment.number,
    }


def place_of(space: Space, point: int) -> list[float]:
    """Return where a point of the whole mesh is."""
    return space.mesh.ranks.places(space.points, [point], space.nq)[0].tolist()
