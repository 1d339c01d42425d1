"""The error of the mesh, in the energy norm, from the recovered stress (`fabfem.fem.recovery`)."""

from collections.abc import Callable
from functools import cached_property

import numpy as np

import umat
from fabfem.fem.model import Model
from fabfem.fem.points import stress_of, tangents
from fabfem.fem.recovery import energy_density, fine_space, nearest, recovered, stress_within
from fabfem.fem.solve import Increment
from umat.mandel import Array

FIELD = "discretisation_error"


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
        stress = stress_of(self.model.space, self.model.zones, increment.states)
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
