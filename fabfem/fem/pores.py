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

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_matrix

from fabfem.fem.assembly import Pattern
from fabfem.fem.porous_space import PorousSpace


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
