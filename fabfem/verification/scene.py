"""A scene that is known only to the verification: its tables and its mesh take the way of every user's case."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any, NamedTuple

import meshio
import numpy as np

from fabfem.boundary_value.problem import Problem, build
from fabfem.case import BoundaryValueCase, case_from
from fabfem.fem.increment import Collapsed, Increment, Stopped
from fabfem.fem.mesh import Mesh
from fabfem.fem.solve import march
from umat.mandel import Array

Tables = dict[str, Any]
"""The tables of a case, as they would be read from its file."""


class Answer(NamedTuple):
    """What a scene's run gave."""

    problem: Problem
    history: list[dict[str, Any]]
    """A row per converged increment: column of the history -> value."""
    last: Increment | None
    """The last converged increment."""
    stopped: str
    """Why the run ended early; empty where it reached its end."""
    seconds: float
    """Wall time from the case to the last increment [s]."""
    collapsed: Collapsed | None = None
    """How a search for the factor of safety ended."""

    def measured(self, measure: "Callable[[Answer], float]") -> float | None:
        """Return what `measure` makes of the answer, or None where the run did not reach its end."""
        return None if self.stopped else float(measure(self))

    def final(self, column: str) -> float | None:
        """Return a column's last value, or None where the run did not reach its end."""
        return self.measured(lambda answer: answer.history[-1][column])

    def rise(self, column: str) -> float:
        """Return by how much of its end a column still grew in the last fifth of the run."""
        end, before = self.history[-1][column], self.history[-1 - len(self.history) // 5][column]
        return float((end - before) / end)

    @property
    def state_stress(self) -> Array:
        """(npoints, 6) stress of the last increment in a scene of one zone, compression positive."""
        assert self.last is not None
        (state,) = self.last.states.values()
        return state.stress


def solve(tables: Tables, mesh: Mesh) -> Answer:
    """Return the answer of a scene whose tables say everything but the mesh file.

    Raises
    ------
    CaseError
        If the tables say something impossible.
    """
    start = perf_counter()
    with TemporaryDirectory() as folder:
        write_inp(mesh, Path(folder) / "mesh.inp")
        said = tables | {"mesh": {"file": "mesh.inp"} | tables.get("mesh", {})}
        case = case_from(said, Path(folder) / "case.toml")
        assert isinstance(case, BoundaryValueCase)
        problem = build(case)
    history: list[dict[str, Any]] = []
    last, stopped, collapsed = None, "", None
    for step in march(problem.model):
        if isinstance(step, Stopped):
            stopped = f"stage {step.stage} stopped at {100.0 * step.fraction:.3g} %: {step.reason}"
        elif isinstance(step, Collapsed):
            collapsed, stopped = step, "" if step.verdict == "collapse" else step.reason
        else:
            last = step
            history.append({column.name: column.value(step) for column in problem.columns})
    return Answer(problem, history, last, stopped, perf_counter() - start, collapsed)


def write_inp(mesh: Mesh, path: Path) -> None:
    """Write a linear mesh with its zones and boundaries as an Abaqus file."""
    blocks = [(mesh.cell_type, mesh.cells)]
    blocks += [(mesh.element.facet_type, facets) for facets in mesh.boundaries.values()]
    empty = [np.zeros(0, int)] * len(blocks)
    sets: Mapping[str, list[np.ndarray]] = {name: [ids, *empty[1:]] for name, ids in mesh.zones.items()}
    whole = {
        name: [np.arange(len(facets)) if number == i else empty[0] for i in range(len(blocks))]
        for number, (name, facets) in enumerate(mesh.boundaries.items(), 1)
    }
    meshio.Mesh(mesh.points, blocks, cell_sets={**sets, **whole}).write(path)


def stage(name: str, initial: float, maximum: float, **said: Any) -> Tables:
    """Return a load stage with its increments."""
    return {"name": name, "kind": "load", "increments": {"initial": initial, "maximum": maximum}, **said}


def held(**fixed: Sequence[str]) -> list[Tables]:
    """Return supports: boundary -> components, such as ``left="x", bottom="xy"``."""
    return [{"boundary": boundary, "fix": list(components)} for boundary, components in fixed.items()]
