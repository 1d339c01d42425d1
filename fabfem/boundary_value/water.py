"""What a case's water means for the scene: weights below the table, hydrostatic pressure, storage and mobility."""

from collections.abc import Mapping

import numpy as np

from fabfem.case import BoundaryValueCase
from fabfem.case.materials import ChangHicher, Material
from fabfem.fem.increment import Increment
from fabfem.fem.model import Zone
from fabfem.fem.pores import PoreWater
from fabfem.fem.porous_space import PorousSpace
from fabfem.fem.space import Space
from umat.mandel import Array


def table_level(case: BoundaryValueCase) -> float:
    """Return the height of the water table, minus infinity where there is none."""
    water = case.water
    return -np.inf if water is None or water.level is None else water.level


def effective_weights(case: BoundaryValueCase, material: str) -> tuple[float, float]:
    """Return the unit weight of a material above the water table and its buoyant one below."""
    said = case.material[material]
    if case.water is None or said.saturated_unit_weight is None:
        return said.unit_weight, said.unit_weight
    return said.unit_weight, said.saturated_unit_weight - case.water.unit_weight


def weight_at_points(case: BoundaryValueCase, space: Space, material: str, zone: str) -> Array:
    """Return the effective unit weight at the points of a zone."""
    height = space.points[space.points_of(space.mesh.zone(zone)), -1]
    above, below = effective_weights(case, material)
    return np.where(height < table_level(case), below, above)


def hydrostatic(case: BoundaryValueCase, places: Array) -> Array:
    """Return the given pore pressure (n,) at places (n, dim)."""
    level = table_level(case)
    if case.water is None or not np.isfinite(level):
        return np.zeros(len(places))
    return case.water.unit_weight * np.maximum(level - places[:, -1], 0.0)


def nodal_pore_pressure(case: BoundaryValueCase, space: Space, increment: Increment) -> Array:
    """Return the pore pressure (nnodes,), the hydrostatic one and its excess."""
    given = hydrostatic(case, space.mesh.points)
    return given + space.nodal_pressure(increment.displacement) if isinstance(space, PorousSpace) else given


def point_pore_pressure(case: BoundaryValueCase, space: Space, increment: Increment) -> Array:
    """Return the pore pressure (npoints,), the hydrostatic one and its excess."""
    given = hydrostatic(case, space.points)
    return given + space.point_pressure(increment.displacement) if isinstance(space, PorousSpace) else given


def pore_water(
    case: BoundaryValueCase, space: Space, zones: Mapping[str, Zone], materials: Mapping[str, str]
) -> PoreWater | None:
    """Return storage and mobility at the points, or None where no excess pressure is asked for.

    Parameters
    ----------
    materials : dict of str to str
        Name of the material of each zone.

    Raises
    ------
    ValueError
        If a compressible fluid meets a material of unknown porosity.
    """
    if case.water is None or not case.water.excess:
        return None
    storage, mobility = np.zeros(space.npoints), np.zeros(space.npoints)
    for name, zone in zones.items():
        said = case.material[materials[name]]
        mobility[zone.points] = said.conductivity / case.water.unit_weight
        if case.water.bulk_modulus is not None:
            storage[zone.points] = _porosity(said, materials[name]) / case.water.bulk_modulus
    return PoreWater(storage, mobility)


def _porosity(said: Material, name: str) -> float:
    if said.porosity is not None:
        return said.porosity
    if isinstance(said, ChangHicher):
        return said.void_ratio / (1.0 + said.void_ratio)
    raise ValueError(f"the porosity of '{name}' is missing; compressible water is stored in proportion to it")
