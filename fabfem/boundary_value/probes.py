"""Columns of the history: what each increment is, and the probes, reactions and derived values of the case."""

from collections.abc import Callable, Iterator, Sequence
from math import prod
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from fabfem.boundary_value.fields import QUANTITIES, point_fields
from fabfem.boundary_value.water import nodal_pore_pressure
from fabfem.case import BoundaryValueCase
from fabfem.case.boundary_value import Derived, Probe, Reaction
from fabfem.fem.increment import Increment
from fabfem.fem.space import Space
from fabfem.fem.stages import ArcLength, DisplacementControl, Stage, StrengthSearch
from umat.mandel import Array, to_tensor

Value = str | int | float
Measure = Callable[[Increment], float]


class Keeper(Protocol):
    """What adds up from row to row."""

    def memory(self) -> Any:
        """Return all that it has gathered; a value that an archive can hold."""

    def recall(self, memory: Any) -> None:
        """Take what an earlier run had gathered."""


class Column(NamedTuple):
    """A column of the history."""

    name: str
    """Name, as the case gives it."""
    unit: str
    """Unit, ``-`` for a plain number, empty for text."""
    kind: str
    """``probe``, ``reaction`` or ``derived``, empty for what every history has."""
    value: Callable[[Increment], Value]
    """The entry of an increment's row."""
    keeper: Keeper | None = None
    """What adds up from row to row, where something does."""

    @property
    def header(self) -> str:
        """Name and unit as they stand in the first line of the file."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


def columns(case: BoundaryValueCase, space: Space, stages: Sequence[Stage] = ()) -> tuple[Column, ...]:
    """Return the columns of a case's history; a factor has one where a stage lets it vary."""
    units = case.unit_system
    force = units.label("line_force" if case.scene.kinematics == "plane_strain" else "force")
    measures: dict[str, Measure] = {}
    found = [*_standing(), *_factors(stages)]
    for probe in case.probe:
        measure, quantity = PROBES[probe.kind]
        measures[probe.name] = measure(case, probe, space)
        quantity = QUANTITIES.get(probe.field) if probe.field else quantity
        found.append(Column(probe.name, units.label(quantity) if quantity else "-", "probe", measures[probe.name]))
    for entry in case.reaction:
        measures[entry.name] = _force(entry, space)
        found.append(Column(entry.name, force, "reaction", measures[entry.name]))
    for derived in case.derived:
        found.append(Column(derived.name, derived.unit, "derived", _quotient(derived, measures[derived.of])))
    return tuple(found)


def _standing() -> tuple[Column, ...]:
    return (
        Column("stage", "", "", lambda increment: increment.stage),
        Column("increment", "-", "", lambda increment: increment.number),
        Column("time", "-", "", lambda increment: float(increment.time)),
        Column("iterations", "-", "", lambda increment: increment.iterations),
    )


def _factors(stages: Sequence[Stage]) -> Iterator[Column]:
    goals = [stage.goal for stage in stages]
    if any(isinstance(goal, StrengthSearch) for goal in goals) or any(stage.strength != 1.0 for stage in stages):
        yield Column("strength_factor", "-", "", lambda increment: float(increment.strength))
    if any(isinstance(goal, DisplacementControl | ArcLength) for goal in goals):
        yield Column("load_factor", "-", "factor", lambda increment: float(increment.load_factor))


def _displacement(_: BoundaryValueCase, probe: Probe, space: Space) -> Measure:
    """Return the scaled mean displacement of the nodes of a probe."""
    nodes = _probed(probe, space)
    dofs = nodes * len(space.components) + space.component(probe.component or "")
    return lambda increment: float(probe.scale * space.nodal_mean(increment.displacement[dofs], nodes))


def _pore_pressure(case: BoundaryValueCase, probe: Probe, space: Space) -> Measure:
    """Return the scaled mean pore pressure at the nodes of a probe."""
    nodes = _probed(probe, space)
    return lambda increment: float(
        probe.scale * space.nodal_mean(nodal_pore_pressure(case, space, increment)[nodes], nodes)
    )


def _mean(_: BoundaryValueCase, probe: Probe, space: Space) -> Measure:
    """Return the scaled volume mean of a field."""

    def measure(increment: Increment) -> float:
        values, weights = _sample(probe, space, increment)
        return float(probe.scale * space.volume_mean(values, weights))

    return measure


def _deviation(_: BoundaryValueCase, probe: Probe, space: Space) -> Measure:
    """Return the scaled standard deviation of a field about its volume mean."""

    def measure(increment: Increment) -> float:
        values, weights = _sample(probe, space, increment)
        apart = values - space.volume_mean(values, weights)
        return float(probe.scale * np.sqrt(space.volume_mean(apart**2, weights)))

    return measure


def _sample(probe: Probe, space: Space, increment: Increment) -> tuple[Array, Array]:
    """Return a field, or an entry of it, and the volumes of its points, where its zones are.

    ValueError if a tensor has no entry named, or a number has one.
    """
    name = probe.field or ""
    values = point_fields(space, increment, (name,))[name]
    if probe.entry:
        row, column = ("xyz".index(axis) for axis in probe.entry)
        values = to_tensor(values)[:, row, column]
    there = ~np.isnan(values)
    if probe.zones:
        inside = np.zeros(space.npoints, bool)
        for zone in probe.zones:
            inside[space.points_of(space.mesh.zone(zone))] = True
        there &= inside
    return values[there], space.weights[there]


PROBES: dict[str, tuple[Callable[[BoundaryValueCase, Probe, Space], Measure], str | None]] = {
    "displacement": (_displacement, "length"),
    "pore_pressure": (_pore_pressure, "stress"),
    "mean": (_mean, None),
    "deviation": (_deviation, None),
}
"""How each kind of probe measures, and what, where it is not the field that decides."""


def _probed(probe: Probe, space: Space) -> NDArray[np.intp]:
    """Return the nodes of a boundary, or the node nearest to a point."""
    if probe.boundary is not None:
        return np.unique(np.concatenate([space.mesh.nodes_on(name) for name in probe.boundary]))
    return space.mesh.ranks.nearest(np.linalg.norm(space.mesh.points - np.asarray(probe.point), axis=1))


def _force(entry: Reaction, space: Space) -> Measure:
    """Return the scaled sum of the support's forces over the nodes of the boundaries, each node once."""
    dofs = _dofs(space, entry.boundary, entry.component)
    return lambda increment: float(entry.scale * space.total(increment.internal_force - increment.external_force, dofs))


def _dofs(space: Space, boundaries: Sequence[str], component: str) -> NDArray[np.intp]:
    return np.unique(np.concatenate([space.dofs_on(name, component) for name in boundaries]))


def _quotient(derived: Derived, measure: Measure) -> Measure:
    divisor = prod(derived.divide_by)
    return lambda increment: measure(increment) / divisor
