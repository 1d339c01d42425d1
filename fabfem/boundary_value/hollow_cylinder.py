"""Averages of a hollow cylinder: those that a laboratory computes from what it can measure, and the true volume means.

A laboratory knows the axial force F, the torque T, the pressures p_i and p_o, the radial displacements u_i and u_o of
the walls, and the displacement w and the turn θ of the platen. Hight, Gens & Symes (1983) make of them

    σ_z = F/π(r_o² - r_i²)                      ε_z = -w/H
    σ_r = (p_o r_o + p_i r_i)/(r_o + r_i)       ε_r = -(u_o - u_i)/(r_o - r_i)
    σ_θ = (p_o r_o - p_i r_i)/(r_o - r_i)       ε_θ = -(u_o + u_i)/(r_o + r_i)
    τ = 3T/2π(r_o³ - r_i³)                      γ = 2θ(r_o³ - r_i³)/3H(r_o² - r_i²)

where F is the whole force on the specimen, the ram's and what the pressures exert on the platen. σ_r and σ_θ hold where
the stress goes linearly from wall to wall, τ where it is the same everywhere. The volume means are ∫σ dV/V of the
stress at the points and of the strain. Their distance is what the averages are wrong by. u_i and u_o are means over the
walls. Geometry is that of the start. α and b follow from σ_z, σ_θ, σ_r and τ: tan 2α = 2τ/(σ_z - σ_θ),
b = (σ2 - σ3)/(σ1 - σ3).
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from fabfem.boundary_value.fields import point_fields
from fabfem.boundary_value.probes import Column
from fabfem.case import BoundaryValueCase
from fabfem.case.boundary_value import HollowCylinder
from fabfem.fem.increment import Increment
from fabfem.fem.space import Space
from umat.mandel import Array, from_tensor, principal, to_tensor

STRESS = ("sigma_z", "sigma_r", "sigma_theta", "tau")
"""Names of the mean stresses: axial, radial, circumferential, and the shear stress τ_zθ."""
STRAIN = ("eps_z", "eps_r", "eps_theta", "gamma")
"""Names of the mean strains, γ being twice the tensor's."""
SHAPE = ("alpha", "b")
"""Names of what the stresses are in proportion: direction of the major stress, and the intermediate one."""


class Walls(NamedTuple):
    """What of a mesh the averages need."""

    inner: float
    """Radius of the inner wall (r_i)."""
    outer: float
    """Radius of the outer wall (r_o)."""
    height: float
    """Height of what is modelled (H)."""
    at: dict[str, Array]
    """Nodes of the boundaries ``inner``, ``outer`` and ``platen``."""


def hollow_cylinder_columns(case: BoundaryValueCase, space: Space) -> tuple[Column, ...]:
    """Return the columns of a hollow cylinder, none where the case does not ask for them.

    Columns called ``hgs_*`` are the averages of Hight, Gens & Symes, those called ``mean_*`` the volume means.

    Raises
    ------
    ValueError
        If a wall is not a cylinder, or the radii are not in order.
    """
    if case.hollow_cylinder is None:
        return ()
    walls = walls_of(case.hollow_cylinder, space)
    ways: dict[str, Callable[[Increment], dict[str, float]]] = {
        "hgs": _latest(lambda increment: laboratory_averages(space, walls, increment)),
        "mean": _latest(lambda increment: volume_means(space, increment)),
    }
    stress = case.unit_system.label("stress")
    return tuple(column for way, found in ways.items() for column in _columns(way, found, stress))


def _columns(way: str, found: Callable[[Increment], dict[str, float]], stress: str) -> Iterator[Column]:
    units = dict.fromkeys(STRESS, stress) | dict.fromkeys(STRAIN, "-") | {"alpha": "deg", "b": "-"}
    for name, unit in units.items():
        yield Column(f"{way}_{name}", unit, "average", _entry(found, name))


def _entry(found: Callable[[Increment], dict[str, float]], name: str) -> Callable[[Increment], float]:
    return lambda increment: found(increment)[name]


def _latest(measure: Callable[[Increment], dict[str, float]]) -> Callable[[Increment], dict[str, float]]:
    """Return a measure that is taken once for all columns of an increment."""
    last: list[tuple[Increment, dict[str, float]]] = []

    def remembered(increment: Increment) -> dict[str, float]:
        if not last or last[0][0] is not increment:
            last[:] = [(increment, measure(increment))]
        return last[0][1]

    return remembered


def walls_of(said: HollowCylinder, space: Space) -> Walls:
    """Return radii, height and nodes of the walls that a case names; ValueError where they are no walls."""
    at = {key: space.mesh.nodes_on(getattr(said, key)) for key in ("inner", "outer", "platen")}
    ranks, x = space.mesh.ranks, space.mesh.points
    for key in ("inner", "outer"):
        low, high = ranks.least(x[at[key], 0].min(initial=np.inf)), ranks.largest(x[at[key], 0].max(initial=-np.inf))
        if high - low > 1e-9 * high:
            raise ValueError(f"the {key} wall is no cylinder: its radius goes from {low:g} to {high:g}")
    inner, outer = (space.nodal_mean(x[at[key], 0], at[key]) for key in ("inner", "outer"))
    if not inner < outer:
        raise ValueError(f"the inner wall has radius {inner:g}, the outer one {outer:g}")
    return Walls(inner, outer, float(ranks.largest(x[:, 1].max()) - ranks.least(x[:, 1].min())), at)


def laboratory_averages(space: Space, walls: Walls, increment: Increment) -> dict[str, float]:
    """Return the averages of Hight, Gens & Symes (1983) by name; α in degrees."""
    r_i, r_o, height, at = walls
    outside, on_soil = (force.reshape(-1, 3) for force in _forces(space, increment))
    radius = space.mesh.points[at["platen"], 0]

    def summed(values: Array, name: str) -> float:
        return space.nodal_sum(values, at[name])

    force, torque = -summed(on_soil[at["platen"], 1], "platen"), summed(on_soil[at["platen"], 2] * radius, "platen")
    p_i = summed(outside[at["inner"], 0], "inner") / (2.0 * np.pi * r_i * height)
    p_o = -summed(outside[at["outer"], 0], "outer") / (2.0 * np.pi * r_o * height)
    area, cubes = r_o**2 - r_i**2, r_o**3 - r_i**3
    stress = (
        force / (np.pi * area),
        (p_o * r_o + p_i * r_i) / (r_o + r_i),
        (p_o * r_o - p_i * r_i) / (r_o - r_i),
        3.0 * torque / (2.0 * np.pi * cubes),
    )
    moved = increment.displacement[: space.mesh.points.shape[0] * 3].reshape(-1, 3)
    u_i, u_o = (space.nodal_mean(moved[at[name], 0], at[name]) for name in ("inner", "outer"))
    turn = summed(moved[at["platen"], 2] * radius, "platen") / summed(radius**2, "platen")
    strain = (
        -space.nodal_mean(moved[at["platen"], 1], at["platen"]) / height,
        -(u_o - u_i) / (r_o - r_i),
        -(u_o + u_i) / (r_o + r_i),
        2.0 * turn * cubes / (3.0 * height * area),
    )
    return _named(stress, strain)


def _forces(space: Space, increment: Increment) -> tuple[Array, Array]:
    """Return the nodal forces of the loads, and those with what supports and platens exert."""
    ndof = len(space.mesh.points) * 3
    return increment.external_force[:ndof], increment.internal_force[:ndof]


def volume_means(space: Space, increment: Increment) -> dict[str, float]:
    """Return the volume means of stress and strain by name; α and b are those of the mean stress."""
    fields = point_fields(space, increment, ("stress", "strain"))
    means = (space.volume_mean(fields[name], space.weights) for name in ("stress", "strain"))
    stress, strain = (to_tensor(mean) for mean in means)
    # compression is positive in the tensors, so that a positive torque has a negative shear stress there
    return _named(
        (stress[1, 1], stress[0, 0], stress[2, 2], -stress[1, 2]),
        (strain[1, 1], strain[0, 0], strain[2, 2], -2.0 * strain[1, 2]),
    )


def _named(stress: tuple[float, ...], strain: tuple[float, ...]) -> dict[str, float]:
    values = (*stress, *strain, *shape_of(*stress))
    return dict(zip((*STRESS, *STRAIN, *SHAPE), map(float, values), strict=True))


def shape_of(axial: float, radial: float, around: float, shear: float) -> tuple[float, float]:
    """Return the direction α of the major stress from the axis and b; NaN where the stress is isotropic.

    α goes from -45° to 135°, so that it does not jump where compression along the axis or around it is largest.
    """
    if np.hypot(axial - around, 2.0 * shear) <= 1e-9 * abs(axial + radial + around):
        alpha = np.nan
    else:
        alpha = (0.5 * np.degrees(np.arctan2(2.0 * shear, axial - around)) + 45.0) % 180.0 - 45.0
    major, middle, minor = principal(from_tensor([[radial, 0, 0], [0, axial, shear], [0, shear, around]]))
    spread = major - minor
    return float(alpha), float((middle - minor) / spread) if spread > 1e-9 * abs(major) else np.nan
