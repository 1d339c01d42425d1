"""How wrong a run is, by its own estimate: what ``[errors]`` asks for, a column of the history each.

* ``equilibrium``: the force that the last iteration left out of balance, with the drag of the viscosity, over the
  forces at work.
* ``integration``: the error of the stress that the points estimate for their own steps, over the stress, both root mean
  square over the volume, added up over the increments. Materials in closed form have none. It is the error of the
  lower of two orders and keeps its sign to itself, so that the truth is far below (docs/study.md).
* ``substeps``: the same error, from some points of each zone, spread evenly over its volume, that go through the same
  strains with a hundredth of the tolerance; the distance of the two stresses over the first, both root mean square.
* ``discretisation``: of the mesh, in the energy norm, from the recovered stress (`fabfem.fem.recovery`), over the norm
  of the stress. The field ``discretisation_error`` says where: the root of the error's energy density over the mean
  energy density.
* ``directions``: of the set of contact directions, by a second rule instead of a smaller tolerance.
"""

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

import umat
from fabfem.boundary_value.probes import Column, Keeper, Value
from fabfem.case import BoundaryValueCase, CaseError
from fabfem.fem.model import Model, Zone
from fabfem.fem.points import tangents
from fabfem.fem.recovery import energy_density, fine_space, nearest, recovered, stress_within
from fabfem.fem.share import mapped
from fabfem.fem.solve import Increment
from fabfem.substance import Substance
from umat.mandel import Array, norm
from umat.status import OK

FIELD = "discretisation_error"
FINER = 0.01
"""Tolerance of the points that are followed a second time, over their own."""


class Discretisation:
    """The error of the mesh."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self.fine = fine_space(model.space)

    @cached_property
    def recovered(self) -> Callable[[Array], Array]:
        """What recovers the stress at the fine points."""
        return recovered(self.model.space, self.fine, self.model.zones)

    def energies(self, increment: Increment) -> tuple[Array, Array]:
        """Return the (nel,) energies of the error and of the stress."""
        zones, space = self.model.zones, self.model.space
        stress = _stress(self.model, increment)
        points = np.zeros((space.npoints, 6, 6))
        for name, zone in zones.items():
            points[zone.points] = umat.elastic_tangent(zone.material, increment.states[name])
        elastic = points.reshape(-1, space.nq, 6, 6)[:, nearest(space, self.fine)].reshape(-1, 6, 6)
        tangent = tangents(space, increment.zones, space.strain(increment.step), increment.before)
        within = stress_within(space, self.fine, stress, tangent, increment.displacement)
        weights = self.fine.weights
        parts = (energy_density(part, elastic) * weights for part in (self.recovered(stress) - within, within))
        error, energy = (part.reshape(-1, self.fine.nq).sum(axis=1) for part in parts)
        return error, energy

    def field(self, increment: Increment) -> Array:
        """Return the (npoints,) root of the error's energy density in the element over the mean energy density."""
        error, energy = self.energies(increment)
        volume = self.fine.weights.reshape(-1, self.fine.nq).sum(axis=1)
        total = self.model.space.mesh.ranks.sum
        mean = total(float(energy.sum())) / total(float(volume.sum()))
        found = np.sqrt(error / volume / mean) if mean > 0.0 else np.zeros_like(error)
        return np.repeat(found, self.model.space.nq)

    def value(self, increment: Increment) -> float:
        """Return the norm of the error over that of the recovered stress, both in energy."""
        error, energy = (self.model.space.mesh.ranks.sum(float(part.sum())) for part in self.energies(increment))
        return float(np.sqrt(error / (energy + error))) if energy > 0.0 else 0.0


class Integration:
    """The error of the points' integration, added up."""

    def __init__(self, model: Model) -> None:
        self.model, self.weights = model, model.space.weights
        self.total = 0.0

    def value(self, increment: Increment) -> float:
        """Return the sum over all increments so far."""
        size = norm(_stress(self.model, increment))
        total = self.model.space.mesh.ranks.sum
        whole = np.sqrt(total(float(self.weights @ size**2)))
        error = np.sqrt(total(float(self.weights @ (increment.local_error * size) ** 2)))
        self.total += float(error / whole) if whole else 0.0
        return self.total

    def memory(self) -> float:
        """Return the sum so far."""
        return self.total

    def recall(self, memory: float) -> None:
        """Go on from a sum."""
        self.total = memory


class _Sampled(NamedTuple):
    """Some points of a zone and how they are followed a second time."""

    zone: Zone
    second: Substance
    ids: np.ndarray
    """Numbers of the points in the space."""
    within: np.ndarray
    """Their numbers in the zone."""
    places: np.ndarray
    """Which of the samples of all ranks they are."""


class Followed:
    """An error that shows when some points go through the same strains in a second way."""

    def __init__(self, model: Model, seconds: Mapping[str, Substance], samples: int) -> None:
        self.model, self.ranks = model, model.space.mesh.ranks
        self.sampled = {name: _sampled(zone, seconds[name], model, samples) for name, zone in _spread(model, seconds)}
        self.states = {name: _started(sampled) for name, sampled in self.sampled.items()}
        self.alive = {name: np.ones(len(sampled.ids), bool) for name, sampled in self.sampled.items()}
        self.strains = {name: np.zeros((len(sampled.ids), 6)) for name, sampled in self.sampled.items()}
        self._stage = 0

    def value(self, increment: Increment) -> Value:
        """Return the distance of the stresses by the two ways; nothing where the second refused all points."""
        if increment.stage_index != self._stage and self.model.stages[self._stage].zero_displacement:
            self.strains = {name: np.zeros_like(strain) for name, strain in self.strains.items()}
        self._stage = increment.stage_index
        strain = self.model.space.strain(increment.displacement)
        followed = [self._follow(name, strain, increment) for name in self.sampled]
        gaps, stress = (np.concatenate(part) for part in zip(*followed, strict=True))
        gap, size = self.ranks.sum(float(np.sum(gaps**2))), self.ranks.sum(float(np.sum(stress**2)))
        return float(np.sqrt(gap / size)) if size > 0.0 else ""

    def memory(self) -> Any:
        """Return the states of the samples, which of them are still followed, their strains, and the last stage."""
        return *(self._of_all(part) for part in (self.states, self.alive, self.strains)), self._stage

    def recall(self, memory: Any) -> None:
        """Go on from what an earlier run had gathered, by as many ranks as it had."""
        *parts, self._stage = memory
        self.states, self.alive, self.strains = (self._of_own(part) for part in parts)

    def _of_all(self, by_zone: Mapping[str, Any]) -> dict[str, Any]:
        """Return what is known of the samples of this rank, of those of all."""
        return {name: mapped(value, f"zone:{name}", self._gathered) for name, value in by_zone.items()}

    def _of_own(self, by_zone: Mapping[str, Any]) -> dict[str, Any]:
        """Return what is known of the samples of all ranks, of those of this one."""
        return {name: mapped(value, f"zone:{name}", self._picked) for name, value in by_zone.items()}

    def _gathered(self, kind: str, array: Array) -> Array:
        order = np.argsort(self.ranks.stacked(self._places(kind)))
        return self.ranks.stacked(array)[order]

    def _picked(self, kind: str, array: Array) -> Array:
        return array[self._places(kind)]

    def _places(self, kind: str) -> np.ndarray:
        return self.sampled[kind.removeprefix("zone:")].places

    def _follow(self, name: str, strain: Array, increment: Increment) -> tuple[Array, Array]:
        """Lead the samples of a zone on; return the distance of the stresses and the size of the first."""
        sampled, old, alive = self.sampled[name], self.states[name], self.alive[name]
        now = strain[sampled.ids]
        response = umat.update(sampled.second.material, sampled.second.directions, now - self.strains[name], old)
        self.states[name], self.strains[name] = response.state, now
        alive &= response.status == OK
        first = increment.states[name].stress[sampled.within]
        return norm(first - response.stress)[alive], norm(first)[alive]


def error_columns(
    case: BoundaryValueCase, model: Model, second: Callable[[str | None], Mapping[str, Substance]]
) -> tuple[tuple[Column, ...], Discretisation | None]:
    """Return the columns of the errors that a case asks for, and the estimate of the mesh's if it is among them.

    Parameters
    ----------
    case : BoundaryValueCase
        What is asked.
    model : Model
        What is run.
    second : callable
        Name of a rule -> substances by zone with that rule, with their own for None, where there are directions.

    Raises
    ------
    CaseError
        If no material has contact directions whose error could be estimated.
    """
    said = case.errors
    if said is None:
        return (), None
    mesh = Discretisation(model)
    makers: dict[str, Callable[[], tuple[Callable[[Increment], Value], Keeper | None]]] = {
        "equilibrium": lambda: (lambda increment: increment.residuals[-1] + increment.drag, None),
        "integration": lambda: _kept(Integration(model)),
        "discretisation": lambda: (mesh.value, None),
        "directions": lambda: _kept(Followed(model, _seconds(case, second(said.rule)), said.samples)),
        "substeps": lambda: _kept(Followed(model, _finer(_seconds(case, second(None))), said.samples)),
    }
    columns = tuple(Column(f"error_{name}", "-", "error", *makers[name]()) for name in said.estimate)
    return columns, mesh if "discretisation" in said.estimate else None


def _kept(error: Integration | Followed) -> tuple[Callable[[Increment], Value], Keeper]:
    return error.value, error


def _seconds(case: BoundaryValueCase, found: Mapping[str, Substance]) -> Mapping[str, Substance]:
    if not found:
        raise CaseError(f"{case.path.name}: errors.estimate: no material here has contact directions")
    return found


def _finer(substances: Mapping[str, Substance]) -> Mapping[str, Substance]:
    """Return substances that integrate with a smaller tolerance, for which sub-steps have to be √(1/FINER) shorter."""
    return {name: found._replace(material=_tightened(found.material)) for name, found in substances.items()}


def _tightened(sand: Any) -> Any:
    most = int(np.ceil(sand.max_evaluations / FINER**0.5))
    return sand._replace(tolerance=FINER * sand.tolerance, max_evaluations=most)


def _stress(model: Model, increment: Increment) -> Array:
    """Return the (npoints, 6) stress of all points."""
    stress = np.empty((model.space.npoints, 6))
    for name, zone in model.zones.items():
        stress[zone.points] = increment.states[name].stress
    return stress


def _ids(zone: Zone, model: Model) -> Array:
    """Return the numbers of the points of a zone."""
    return np.arange(model.space.npoints)[zone.points]


def _spread(model: Model, seconds: Mapping[str, Substance]) -> list[tuple[str, Zone]]:
    return [(name, zone) for name, zone in model.zones.items() if name in seconds]


def _sampled(zone: Zone, second: Substance, model: Model, samples: int) -> _Sampled:
    """Return this rank's of the points of a zone that stand for equal parts of its volume."""
    ids, ranks = _ids(zone, model), model.space.mesh.ranks
    elements = ranks.numbers(len(model.space.mesh.cells), len(model.space.mesh.points))[0]
    nq = model.space.nq
    number = elements[ids // nq] * nq + ids % nq
    every = ranks.stacked(number)
    order = np.argsort(every)
    volume = np.cumsum(ranks.stacked(model.space.weights[ids])[order])
    parts = min(samples, len(every))
    chosen = every[order][np.unique(np.searchsorted(volume, volume[-1] * (np.arange(parts) + 0.5) / parts))]
    within = np.flatnonzero(np.isin(number, chosen))
    return _Sampled(zone, second, ids[within], within, np.searchsorted(chosen, number[within]))


def _started(sampled: _Sampled) -> Any:
    """Return the state of the samples before the run."""
    second = sampled.second
    return umat.initial_state(
        second.material, second.directions, sampled.zone.state.stress[sampled.within], **second.needs
    )
