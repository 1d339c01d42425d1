"""What pushes: weight of zones, pressure and traction on boundaries; and the initial stress of level ground.

A load is a fixed field times a factor that goes from `start` to `end` over the stage, or follows a table of (fraction
of the stage, factor), linear in between.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import singledispatch
from typing import NamedTuple

import numpy as np

from fabfem.fem.elements import ELEMENTS, quadrature, shape
from fabfem.fem.space import Space
from fabfem.fem.supports import MOTIONS, RigidBody, body_modes


@dataclass(frozen=True)
class Gravity:
    """Weight; unit weights [force/volume] by zone, or at the points of a zone; a zone not named weighs nothing."""

    unit_weights: Mapping[str, float | np.ndarray]
    direction: tuple[float, ...] | None = None
    start: float = 1.0
    end: float = 1.0


@dataclass(frozen=True)
class Pressure:
    """Pressure [force/area] against a boundary, positive into the body."""

    boundary: str
    pressure: float
    start: float = 0.0
    end: float = 1.0
    table: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class Traction:
    """Force per area along the displacement components."""

    boundary: str
    traction: tuple[float, ...]
    start: float = 0.0
    end: float = 1.0
    table: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class BodyForce:
    """Force [force] and moment at the point of a rigid body, by motion of the body (`supports.MOTIONS`).

    It acts on the body, so it is no load of the soil: the body hands it on as the reaction of its boundary.
    """

    body: RigidBody
    force: Mapping[str, float]
    start: float = 0.0
    end: float = 1.0
    table: tuple[tuple[float, float], ...] = ()


Load = Gravity | Pressure | Traction | BodyForce


Force = Callable[[float], np.ndarray]


class Loading(NamedTuple):
    """The (ndof,) nodal forces of a stage as functions of the fraction of it that has passed."""

    total: Force
    """All loads."""
    on_soil: Force
    """Those that act on the soil, not on rigid bodies."""

    def released(self, force: np.ndarray) -> "Loading":
        """The same with a force (ndof,) that fades away over the stage."""
        return Loading(
            lambda fraction: self.total(fraction) + (1.0 - fraction) * force,
            lambda fraction: self.on_soil(fraction) + (1.0 - fraction) * force,
        )


def loading(space: Space, loads: Sequence[Load]) -> Loading:
    """The nodal forces of `loads`."""
    total = external_force(space, loads)
    soil = tuple(load for load in loads if not isinstance(load, BodyForce))
    return Loading(total, total if len(soil) == len(loads) else external_force(space, soil))


def external_force(space: Space, loads: Sequence[Load]) -> Force:
    """The (ndof,) nodal forces of `loads` as a function of the fraction of the stage that has passed."""
    base, growth = np.zeros(space.ndof), np.zeros(space.ndof)
    tabled = []
    for load in loads:
        force = nodal_force(load, space)
        if isinstance(load, Gravity) or not load.table:
            base += load.start * force
            growth += (load.end - load.start) * force
        else:
            tabled.append((force, *np.transpose(load.table)))
    return lambda at: base + at * growth + sum(np.interp(at, *table) * force for force, *table in tabled)


@singledispatch
def nodal_force(load: object, space: Space) -> np.ndarray:
    """The (ndof,) nodal forces of a load at factor one."""
    raise TypeError(f"{type(load).__name__} is not a load.")


@nodal_force.register
def _(load: Gravity, space: Space) -> np.ndarray:
    density = np.zeros(space.npoints)
    for zone, weight in load.unit_weights.items():
        density[space.points_of(space.mesh.zone(zone))] = weight
    down = np.zeros(len(space.components))
    down[space.mesh.dim - 1] = -1.0
    direction = down if load.direction is None else _checked(space, load.direction, "the direction of gravity")
    share = (density * space.weights).reshape(-1, space.nq) @ space.values
    return _gather(space, space.mesh.cells, share[:, :, None] * direction)


@nodal_force.register
def _(load: Pressure, space: Space) -> np.ndarray:
    facets, values, areas, normals = _boundary(space, load.boundary)
    pushed = np.zeros((*areas.shape, len(space.components)))
    pushed[..., : space.mesh.dim] = -load.pressure * normals
    return _gather(space, facets, np.einsum("fq,qa,fqc->fac", areas, values, pushed))


@nodal_force.register
def _(load: Traction, space: Space) -> np.ndarray:
    facets, values, areas, _ = _boundary(space, load.boundary)
    traction = _checked(space, load.traction, "a traction")
    return _gather(space, facets, np.einsum("fq,qa->fa", areas, values)[:, :, None] * traction)


@nodal_force.register
def _(load: BodyForce, space: Space) -> np.ndarray:
    """Forces on the tied dofs, in the span of the rigid motions, with the resultants asked for."""
    names, (dofs, modes) = MOTIONS[space.components], body_modes(space, load.body)
    for name in load.force:
        if name not in names:
            raise ValueError(f"a rigid body takes no force along '{name}' here; it has {', '.join(names)}.")
    resultant = np.array([load.force.get(name, 0.0) for name in names])
    own = np.isin(dofs, space.once(dofs))[:, None] * modes
    gram = space.mesh.ranks.sum(own.T @ own)
    factors = np.linalg.lstsq(gram, resultant, rcond=1e-12)[0]
    if np.abs(gram @ factors - resultant).max() > 1e-9 * np.abs(resultant).max(initial=0.0):
        raise ValueError(f"a smooth body on boundary '{load.body.boundary}' cannot hand on a force along it.")
    force = np.zeros(space.ndof)
    force[dofs] = modes @ factors
    return force


def k0_stress(
    space: Space,
    points: slice | np.ndarray,
    level: float,
    unit_weight: float,
    k0: float,
    surcharge: float = 0.0,
    table: float = -np.inf,
    buoyant_weight: float = 0.0,
) -> np.ndarray:
    """(n, 6) effective stress of level ground: σ_v = γ·depth + surcharge, σ_h = K0·σ_v, at points of `space`.

    `level` [length] is the height of the surface; below the height `table` the soil has its buoyant weight. Raises
    ValueError where a point would be pulled or not loaded.
    """
    up = space.mesh.dim - 1
    depth, wet = level - space.points[points, up], np.maximum(min(table, level) - space.points[points, up], 0.0)
    vertical = unit_weight * (depth - wet) + buoyant_weight * wet + surcharge
    if vertical.min(initial=np.inf) <= 0.0:
        height = space.points[points, up][vertical.argmin()]
        raise ValueError(f"the K0 stress is {vertical.min():g} at height {height:g}, above the surface {level:g}.")
    stress = np.zeros((len(vertical), 6))
    stress[:, :3] = k0 * vertical[:, None]
    stress[:, up] = vertical
    return stress


def _checked(space: Space, vector: Sequence[float], what: str) -> np.ndarray:
    if len(vector) != len(space.components):
        raise ValueError(f"{what} has one entry for each of {', '.join(space.components)}, not {len(vector)}.")
    return np.asarray(vector, float)


def _boundary(space: Space, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Facets, shape values (nq, nnode), areas (nf, nq) and outward unit normals (nf, nq, dim) of a boundary."""
    facets, element = space.mesh.boundary(name), ELEMENTS[space.mesh.element.facet_type]
    where, rule = quadrature(element, max(element.rules))
    values, reference = shape(element, where)
    nodes = space.mesh.points[facets]
    normals = _normals(np.einsum("fai,qaj->fqji", nodes, reference))
    areas = np.linalg.norm(normals, axis=2)
    weights = areas * rule
    if space.kinematics.radial:
        weights = weights * 2.0 * np.pi * np.einsum("qa,fa->fq", values, nodes[:, :, 0])
    return facets, values, weights, normals / areas[..., None]


def _normals(tangents: np.ndarray) -> np.ndarray:
    """Normals of the area's size from tangents (..., dim-1, dim) of facets that turn right-handed about them."""
    if tangents.shape[-1] == 2:
        return np.stack([tangents[..., 0, 1], -tangents[..., 0, 0]], axis=-1)
    return np.cross(tangents[..., 0, :], tangents[..., 1, :])


def _gather(space: Space, cells: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """(ndof,) sum of shares (n, nnode, ncomp) at the nodes of `cells`."""
    ncomp = len(space.components)
    dofs = cells[:, :, None] * ncomp + np.arange(ncomp)
    return space.summed(np.bincount(dofs.ravel(), shares.ravel(), space.ndof))
