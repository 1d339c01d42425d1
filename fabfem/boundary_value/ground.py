"""Where the zones of a case are at first, and the stress that they begin with."""

from itertools import pairwise

import numpy as np

from fabfem.boundary_value.water import effective_weights, table_level
from fabfem.case import BoundaryValueCase
from fabfem.case.stages import Geostatic, Gravity, Load
from fabfem.fem.loads import k0_stress
from fabfem.fem.mesh import Mesh
from fabfem.fem.space import Space
from umat import mandel
from umat.mandel import Array


def zones_of(case: BoundaryValueCase, material: str, mesh: Mesh) -> tuple[str, ...]:
    """Return the zones of the mesh that a material of the case fills at first."""
    named = case.material[material].zones
    return tuple(mesh.zones) if named is None else named


def absent_at_first(case: BoundaryValueCase) -> frozenset[str]:
    """Return the zones that are put in place later: those that a stage adds before any removes them."""
    first: dict[str, bool] = {}
    for said in case.stage:
        for key in ("add", "remove"):
            for zone in (getattr(said, key) or ()) if isinstance(said, Load) else ():
                first.setdefault(zone, key == "add")
    return frozenset(zone for zone, added in first.items() if added)


def ground_stress(case: BoundaryValueCase, space: Space, material: str, zone: str) -> Array:
    """Return the (n, 6) initial stress of a zone: level ground under its own weight, else what its stage gives or none.

    Raises
    ------
    ValueError
        If zones of different unit weight are not level layers.
    """
    points = space.points_of(space.mesh.zone(zone))
    said = case.stage[0]
    if not isinstance(said, Geostatic) or zone in absent_at_first(case):
        return _isotropic(_first_stress(case, zone), len(space.weights[points]))
    _, top = _heights(space.mesh, zone)
    surcharge = said.surcharge + _overburden(case, space.mesh, top)
    above, below = effective_weights(case, material)
    return k0_stress(space, points, top, above, said.k0, surcharge, table_level(case), below)


def ground_in_words(case: BoundaryValueCase, stress: Array) -> str:
    """Return the tail of a sentence about an initial stress that a material refuses: what it is and comes from."""
    p = stress[:, :3].mean(axis=1)
    steepest = float(np.max(mandel.q(stress)[p > 0] / p[p > 0], initial=0.0))
    return (
        f" (the initial p goes from {p.min(initial=np.inf):.3g} to {p.max(initial=-np.inf):.3g} "
        f"{case.unit_system.label('stress')}, q/p to {steepest:.3g}; "
        "see [units], unit_weight, k0, surcharge and void_ratio)"
    )


def _first_stress(case: BoundaryValueCase, zone: str) -> float:
    """Return the mean stress that a zone begins with."""
    for said in case.stage:
        if isinstance(said, Load) and zone in (said.add or ()):
            return said.initial_stress
    return case.stage[0].initial_stress if isinstance(case.stage[0], Gravity) else 0.0


def _isotropic(pressure: float, count: int) -> Array:
    stress = np.zeros((count, 6))
    stress[:, :3] = pressure
    return stress


def _overburden(case: BoundaryValueCase, mesh: Mesh, height: float) -> float:
    """Return the weight per area of the zones above a height."""
    layers = [
        (*_heights(mesh, zone), effective_weights(case, name))
        for name in case.material
        for zone in zones_of(case, name, mesh)
        if zone not in absent_at_first(case)
    ]
    table = table_level(case)
    levels = sorted({level for low, high, _ in layers for level in (low, high, min(max(table, low), high))} | {height})
    total = 0.0
    for low, high in pairwise(level for level in levels if level >= height):
        weights = {weight[low < table] for bottom, top, weight in layers if bottom < high and top > low}
        if len(weights) > 1:
            raise ValueError(
                f"zones of different unit weight lie side by side at height {low:g}; turn gravity on in a load stage"
            )
        total += (high - low) * max(weights, default=0.0)
    return total


def _heights(mesh: Mesh, zone: str) -> tuple[float, float]:
    """Return the lowest and the highest level of a zone."""
    levels = mesh.points[mesh.cells[mesh.zone(zone)], -1]
    low, high = float(levels.min(initial=np.inf)), float(levels.max(initial=-np.inf))
    return mesh.ranks.least(low), mesh.ranks.largest(high)
