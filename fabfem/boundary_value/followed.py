"""Points that go through the same strains a second time in another way: the distance of the stresses is an error."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

import umat
from fabfem.boundary_value.probes import Value
from fabfem.fem.model import Model, Zone
from fabfem.fem.share import mapped
from fabfem.fem.solve import Increment
from fabfem.substance import Substance
from umat.mandel import Array, norm
from umat.status import OK

FINER = 0.01
"""Tolerance of the points that are followed a second time, over their own."""


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
        self.sampled = {
            name: _sampled(zone, seconds[name], model, samples) for name, zone in model.zones.items() if name in seconds
        }
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


def finer(substances: Mapping[str, Substance]) -> Mapping[str, Substance]:
    """Return substances that integrate with a smaller tolerance, for which sub-steps have to be √(1/FINER) shorter."""
    return {name: found._replace(material=_tightened(found.material)) for name, found in substances.items()}


def _tightened(sand: Any) -> Any:
    most = int(np.ceil(sand.max_evaluations / FINER**0.5))
    return sand._replace(tolerance=FINER * sand.tolerance, max_evaluations=most)


def _sampled(zone: Zone, second: Substance, model: Model, samples: int) -> _Sampled:
    """Return this rank's of the points of a zone that stand for equal parts of its volume."""
    ids, ranks = np.arange(model.space.npoints)[zone.points], model.space.mesh.ranks
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
