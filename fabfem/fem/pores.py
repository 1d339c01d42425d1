"""Water in the pores: its excess pressure at corner nodes beside displacement at all nodes, and its balance of volume.

The total stress is σ = σ' + p 1, compression positive, p the pressure in excess of the given hydrostatic one. With
ε_v = 1:ε(u), storage S = n / K_w and mobility κ = k / γ_w (k the hydraulic conductivity), an increment Δt obeys

    ∫ Bᵀσ' + Q p = load,                       Q = ∫ Bᵀ1 N
    Qᵀ Δu − M Δp − Δt H p = 0,                 M = ∫ S NᵀN,  H = ∫ κ ∇Nᵀ∇N

(backward Euler; H = 0 where nothing flows). The water squeezed out of the pores is stored or flows off; a boundary
where the pressure is not held lets nothing through. Displacement is quadratic, pressure linear (Taylor and Hood 1973):
the pair is stable for any K_w and any Δt, but first steps shorter than h² / (6 c_v) resolve nothing [Vermeer and
Verruijt 1981].
"""

from dataclasses import dataclass, fields
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_matrix

from fabfem.fem.assembly import Pattern
from fabfem.fem.elements import ELEMENTS, shape
from fabfem.fem.space import Space

PORE_PRESSURE = "pore_pressure"
"""Name of the component that a support holds where water drains."""


@dataclass(frozen=True)
class PorousSpace(Space):
    """A space whose unknowns are the displacements of all nodes, then the pore pressures of the corner nodes.

    Attributes
    ----------
    pressure_nodes : (m,) array
        Nodes of the mesh that have a pressure, ascending.
    pressure_values : (nq, ncorner) array
        Shape functions of the pressure at the points of the reference element.
    pressure_gradients : (nel, nq, ncorner, dim) array
    """

    pressure_nodes: np.ndarray
    pressure_values: np.ndarray
    pressure_gradients: np.ndarray

    @property
    def nmotion(self) -> int:
        """Number of displacement dofs, which come first."""
        return len(self.mesh.points) * len(self.components)

    @property
    def ndof(self) -> int:
        """Unknowns, fixed ones included."""
        return self.nmotion + len(self.pressure_nodes)

    def dofs_on(self, boundary: str, component: str) -> np.ndarray:
        """Dofs of one component on a boundary, each once."""
        if component != PORE_PRESSURE:
            return super().dofs_on(boundary, component)
        here = np.isin(self.pressure_nodes, self.mesh.nodes_on(boundary))
        return self.nmotion + np.flatnonzero(here)

    def summed(self, force: np.ndarray) -> np.ndarray:
        """(ndof,) nodal forces and volumes with what the elements of other ranks add to them."""
        if self.mesh.ranks.size == 1:
            return force
        volumes = np.zeros((len(self.mesh.points), 1))
        volumes[self.pressure_nodes, 0] = force[self.nmotion :]
        whole = self.mesh.ranks.summed(volumes)[self.pressure_nodes, 0]
        return np.concatenate([super().summed(force[: self.nmotion]), whole])

    @cached_property
    def counted(self) -> np.ndarray | slice:
        """Which dofs this rank counts: all, or those of the nodes that it owns."""
        motion, owned = super().counted, self.mesh.ranks.owned(self.pressure_nodes)
        if isinstance(motion, slice) or isinstance(owned, slice):
            return slice(None)
        return np.concatenate([motion, owned])

    def displacement(self, u: np.ndarray) -> np.ndarray:
        """(nnodes, 3) displacement along the three axes of the kinematics."""
        return super().displacement(u[: self.nmotion])

    def at_rest(self, u: np.ndarray) -> np.ndarray:
        """The unknowns with the displacement set to zero."""
        rest = np.zeros_like(u)
        rest[self.nmotion :] = u[self.nmotion :]
        return rest

    def nodal_pressure(self, u: np.ndarray) -> np.ndarray:
        """(nnodes,) pore pressure, interpolated at the nodes between corners."""
        pressure = np.zeros(len(self.mesh.points))
        pressure[self.pressure_nodes] = u[self.nmotion :]
        corners = len(self.mesh.element.corners)
        for k, between in enumerate(self.mesh.element.midside, corners):
            pressure[self.mesh.cells[:, k]] = pressure[self.mesh.cells[:, list(between)]].mean(axis=1)
        return pressure

    def point_pressure(self, u: np.ndarray) -> np.ndarray:
        """(npoints,) pore pressure at the points."""
        return (u[self._pressure_dofs] @ self.pressure_values.T).ravel()

    @cached_property
    def _pressure_dofs(self) -> np.ndarray:
        """(nel, ncorner) dofs."""
        return self.dofs[:, self.mesh.cells.shape[1] * len(self.components) :]


def porous(space: Space) -> PorousSpace:
    """The space with pore pressure as well.

    Raises ValueError where the displacement is linear: the pair would not be stable.
    """
    element = space.mesh.element
    if not element.linear:
        raise ValueError(f"pore pressure needs a quadratic displacement; {element.name} is linear. Take order = 2.")
    corner = ELEMENTS[element.linear]
    cells = space.mesh.cells[:, : len(corner.corners)]
    nodes = np.unique(cells)
    values, reference = shape(corner, space.where)
    jacobian = np.einsum("eai,qaj->eqij", space.mesh.points[space.mesh.cells], shape(element, space.where)[1])
    gradients = np.einsum("qaj,eqji->eqai", reference, np.linalg.inv(jacobian))
    numbers = len(space.mesh.points) * len(space.components) + np.searchsorted(nodes, cells)
    given = {field.name: getattr(space, field.name) for field in fields(space)}
    given["dofs"] = np.ascontiguousarray(np.hstack([space.dofs, numbers.astype(np.int32)]))
    return PorousSpace(**given, pressure_nodes=nodes, pressure_values=values, pressure_gradients=gradients)


@dataclass(frozen=True)
class PoreWater:
    """The water of a scene.

    Attributes
    ----------
    storage : (npoints,) array
        Porosity over the bulk modulus of water [1/stress]; 0 where it is taken as incompressible.
    mobility : (npoints,) array
        Hydraulic conductivity over the unit weight of water [length² / (stress time)].
    """

    storage: np.ndarray
    mobility: np.ndarray


class Water(NamedTuple):
    """What the water does in a stage: matrices of the pattern of the stiffness."""

    coupling: csr_matrix
    """[[0, Q], [Qᵀ, −M]]"""
    seepage: csr_matrix | None
    """[[0, 0], [0, H]], or None where nothing flows."""
    duration: float
    """Time that the stage takes."""
    nmotion: int
    space: PorousSpace

    def matrix(self, size: float) -> csr_matrix:
        """What is added to the stiffness in an increment of a part `size` of the stage."""
        if self.seepage is None:
            return self.coupling
        matrix = self.coupling.copy()
        matrix.data = self.coupling.data - size * self.duration * self.seepage.data
        return matrix

    def start(self, unknowns: np.ndarray, size: float) -> np.ndarray:
        """(ndof,) what pressures at the start of an increment add to its forces and volumes, in a rank's elements."""
        pressure = unknowns.copy()
        pressure[: self.nmotion] = 0.0
        force = self.coupling @ pressure
        force[self.nmotion :] = 0.0
        return force if self.seepage is None else force - size * self.duration * (self.seepage @ pressure)

    def misfit(self, step: np.ndarray, volumes: np.ndarray, unknown: np.ndarray) -> float:
        """The norm of the volumes (ndof,) left over at dofs `unknown`, over that of all volumes that go to and fro."""
        kept, moved = np.zeros(len(volumes)), self.space.summed(abs(self.coupling) @ np.abs(step))
        pressures = unknown[unknown >= self.nmotion]
        kept[pressures], moved[: self.nmotion] = volumes[pressures], 0.0
        size = self.space.norm(moved)
        return self.space.norm(kept) / size if size > 0.0 else 0.0


def water_of(space: PorousSpace, pattern: Pattern, water: PoreWater, flows: bool, duration: float) -> Water:
    """The water in a stage that lasts `duration`; `flows` tells whether it may move through the pores."""
    coupling = _assembled(space, pattern, _coupling(space, water.storage))
    seepage = _assembled(space, pattern, _seepage(space, water.mobility)) if flows else None
    return Water(coupling, seepage, duration, space.nmotion, space)


class Flowed(NamedTuple):
    """What the error of the next time step is judged by."""

    rate: np.ndarray | None = None
    """Rate of the pressures in the last step, per stage; None before a first."""
    largest: float = 0.0
    """Largest pressure so far [stress]."""


class Pace:
    """The error of the time steps of a stage where water flows, over what the stage allows."""

    def __init__(self, water: Water | None, tolerance: float) -> None:
        self._water = water if water is not None and water.seepage is not None and tolerance > 0.0 else None
        self._tolerance = tolerance

    def error(self, past: Flowed, start: np.ndarray, step: np.ndarray, size: float) -> float:
        """The local error of backward Euler, Δt/2 |ṗ − ṗ_last| over the largest pressure so far, over the tolerance.

        `start` and `step` are unknowns (ndof,), `size` is the part of the stage. It is 0 before a second step.
        """
        if self._water is None or past.rate is None:
            return 0.0
        pressures = slice(self._water.nmotion, None)
        largest = max(past.largest, self._most(start[pressures]))
        change = self._most(step[pressures] / size - past.rate)
        return float(0.5 * size * change / (largest * self._tolerance)) if largest > 0.0 else 0.0

    def after(self, past: Flowed, start: np.ndarray, step: np.ndarray, size: float) -> Flowed:
        """What the next step is judged by once a step is done."""
        if self._water is None:
            return past
        pressures = slice(self._water.nmotion, None)
        return Flowed(step[pressures] / size, max(past.largest, self._most(start[pressures])))

    def _most(self, pressures: np.ndarray) -> float:
        assert self._water is not None
        return self._water.space.mesh.ranks.largest(float(np.abs(pressures).max(initial=0.0)))


def _assembled(space: PorousSpace, pattern: Pattern, local: np.ndarray) -> csr_matrix:
    return pattern.matrix(np.bincount(pattern.positions.ravel(), local.ravel(), len(pattern.indices)))


def _coupling(space: PorousSpace, storage: np.ndarray) -> np.ndarray:
    """(nel, m, m) element matrices of [[0, Q], [Qᵀ, −M]]."""
    nel, m = space.dofs.shape
    nmotion = m - space.pressure_values.shape[1]
    volume = space.kinematics.operator[:3].sum(axis=0)
    weights = space.weights.reshape(nel, -1)
    push = np.einsum("eqnt,ct,qv,eq->encv", space.terms, volume, space.pressure_values, weights, optimize=True)
    local = np.zeros((nel, m, m))
    local[:, :nmotion, nmotion:] = push.reshape(nel, nmotion, -1)
    local[:, nmotion:, :nmotion] = local[:, :nmotion, nmotion:].transpose(0, 2, 1)
    stored = weights * storage.reshape(nel, -1)
    local[:, nmotion:, nmotion:] = -np.einsum("qv,qw,eq->evw", *2 * [space.pressure_values], stored, optimize=True)
    return local


def _seepage(space: PorousSpace, mobility: np.ndarray) -> np.ndarray:
    """(nel, m, m) element matrices of [[0, 0], [0, H]]."""
    nel, m = space.dofs.shape
    nmotion = m - space.pressure_values.shape[1]
    through = space.weights.reshape(nel, -1) * mobility.reshape(nel, -1)
    local = np.zeros((nel, m, m))
    local[:, nmotion:, nmotion:] = np.einsum(
        "eqvi,eqwi,eq->evw", *2 * [space.pressure_gradients], through, optimize=True
    )
    return local
