"""From the stages of a case to those of the finite-element side, which hold only what each names.

In a case, gravity, pressures and tractions stay until a later stage changes them; here every stage says them all.
"""

from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np

from fabfem.case import BoundaryValueCase
from fabfem.case.stages import AnyStage, Geostatic, Load
from fabfem.case.stages import Stage as Said
from fabfem.fem.loads import Gravity, Pressure, Traction, k0_stress
from fabfem.fem.loads import Load as Acting
from fabfem.fem.mesh import Mesh
from fabfem.fem.space import Space
from fabfem.fem.stages import Stage
from fabfem.fem.supports import Support
from umat.mandel import Array

Factors = dict[tuple[str, ...], float]
"""Size of each load at the end of a stage, by what it is and where it acts."""


def program(case: BoundaryValueCase, space: Space) -> tuple[Stage, ...]:
    """Return the stages of a case."""
    weights = {
        zone: table.unit_weight for name, table in case.material.items() for zone in zones_of(case, name, space.mesh)
    }
    factors: Factors = {}
    stages = []
    for said in case.stage:
        before, factors = factors, factors | _factors(said)
        if isinstance(said, Geostatic):
            before = factors
        loads = tuple(_load(key, before.get(key, 0.0), end, weights, space) for key, end in factors.items())
        stages.append(_stage(said, (*_fixed(case), *_moved(said)), loads))
    return tuple(stages)


def zones_of(case: BoundaryValueCase, material: str, mesh: Mesh) -> tuple[str, ...]:
    """Return the zones of the mesh that a material of the case fills."""
    named = case.material[material].zones
    return tuple(mesh.zones) if named is None else named


def _stage(said: AnyStage, supports: tuple[Support, ...], loads: tuple[Acting, ...]) -> Stage:
    steps = said.increments
    return Stage(
        name=said.name,
        supports=supports,
        loads=loads,
        first=steps.initial,
        largest=steps.maximum,
        smallest=steps.minimum,
        zero_displacement=isinstance(said, Geostatic),
        duration=said.duration if isinstance(said, Load) else 1.0,
    )


def _factors(said: Said) -> Factors:
    """Return the loads that a stage names, with their size at its end."""
    found: Factors = {}
    gravity = 1.0 if isinstance(said, Geostatic) else said.gravity if isinstance(said, Load) else None
    if gravity is not None:
        found["gravity",] = gravity
    for pressure in said.pressure:
        found |= {("pressure", boundary): pressure.value for boundary in pressure.boundary}
    for traction in said.traction:
        for component, value in traction.components().items():
            found |= {("traction", boundary, component): value for boundary in traction.boundary}
    return found


def _load(key: tuple[str, ...], start: float, end: float, weights: dict[str, float], space: Space) -> Acting:
    if key[0] == "gravity":
        return Gravity(weights, start=start, end=end)
    if key[0] == "pressure":
        return Pressure(key[1], 1.0, start, end)
    unit = tuple(float(component == key[2]) for component in space.components)
    return Traction(key[1], unit, start, end)


def _fixed(case: BoundaryValueCase) -> Iterable[Support]:
    return (
        Support(boundary, part) for support in case.support for boundary in support.boundary for part in support.fix
    )


def _moved(said: AnyStage) -> Sequence[Support]:
    if not isinstance(said, Load):
        return ()
    return [
        Support(boundary, component, value)
        for motion in said.displacement
        for boundary in motion.boundary
        for component, value in motion.components().items()
    ]


def ground_stress(case: BoundaryValueCase, space: Space, material: str, zone: str) -> Array:
    """Return the (n, 6) initial stress of a zone: level ground under its own weight, or none without that stage.

    Raises
    ------
    ValueError
        If zones of different unit weight are not level layers.
    """
    points = space.points_of(space.mesh.zone(zone))
    said = case.stage[0]
    if not isinstance(said, Geostatic):
        return np.zeros((len(space.weights[points]), 6))
    _, top = _heights(space.mesh, zone)
    surcharge = said.surcharge + _overburden(case, space.mesh, top)
    return k0_stress(space, points, top, case.material[material].unit_weight, said.k0, surcharge)


def _overburden(case: BoundaryValueCase, mesh: Mesh, height: float) -> float:
    """Return the weight per area of the zones above a height."""
    layers = [
        (*_heights(mesh, zone), table.unit_weight)
        for name, table in case.material.items()
        for zone in zones_of(case, name, mesh)
    ]
    levels = sorted({level for low, high, _ in layers for level in (low, high)} | {height})
    total = 0.0
    for low, high in pairwise(level for level in levels if level >= height):
        weights = {weight for bottom, top, weight in layers if bottom < high and top > low}
        if len(weights) > 1:
            raise ValueError(
                f"zones of different unit weight lie side by side at height {low:g}; turn gravity on in a load stage"
            )
        total += (high - low) * max(weights, default=0.0)
    return total


def _heights(mesh: Mesh, zone: str) -> tuple[float, float]:
    """Return the lowest and the highest level of a zone."""
    levels = mesh.points[mesh.cells[mesh.zone(zone)], -1]
    return float(levels.min()), float(levels.max())
