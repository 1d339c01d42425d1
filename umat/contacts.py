"""What the contacts of a Chang–Hicher point do in each direction of space: density, force and mobilised friction.

In both readings of the localisation the force of a direction is linear in its normal, f(n) = T n: in the total form
T = σ A, in the rate form T is the accumulated ∫σ̇ A dt. So a state says f for every n, not only for those of its rule.
E(n) = (1 + F:nn)/4π [ZK 14]. Forces are over p_ref r², as in the state, or over their mean.
"""

from typing import Any

import numpy as np

from .chang_hicher.material import ChangHicher, ChangHicherState, contact_forces, mobilised
from .directions import Directions
from .mandel import Array, to_tensor


def density(fabric: Array, normals: Array) -> Array:
    """Return E(n) 4π = 1 + F:nn of fabrics (n, 6) at normals (N, 3), shape (n, N); 1 is the mean."""
    return 1.0 + np.einsum("pij,ai,aj->pa", to_tensor(fabric), normals, normals)


def force_tensor(material: ChangHicher, directions: Directions, state: ChangHicherState) -> Array:
    """Return T (n, 3, 3) with f = T n, forces over p_ref r²."""
    if material.localisation == "total":
        axes = Directions(np.eye(3), np.full(3, 1.0 / 3.0), "axes", 1)
        force = contact_forces(material, axes, state.stress, state.fabric, state.void_ratio)
        return np.swapaxes(force, 1, 2)
    found, *_ = np.linalg.lstsq(directions.normals, np.swapaxes(state.force, 0, 1).reshape(len(directions), -1))
    return np.asarray(np.moveaxis(found.reshape(3, len(state.stress), 3), 0, 2), dtype=float)


def mobilisation(
    material: ChangHicher, directions: Directions, state: ChangHicherState, normals: Array
) -> tuple[Array, Array]:
    """Return f_n over its mean and f_t/f_n of the contacts with given normals (N, 3), both (n, N)."""
    tensor = force_tensor(material, directions, state)
    force = np.einsum("pij,aj->pai", tensor, normals)
    asked = Directions(normals, np.full(len(normals), 1.0 / len(normals)), "asked", 1)
    normal, friction = mobilised(material, asked, force)
    return normal / (np.trace(tensor, axis1=1, axis2=2) / 3.0)[:, None], friction


def ring(plane: str, count: int) -> tuple[Array, Array]:
    """Return angles (count,) [deg] from the first axis of a plane such as ``zx`` to its second, and normals there."""
    first, second = (np.eye(3)["xyz".index(axis)] for axis in plane)
    angles = np.linspace(0.0, 360.0, count, endpoint=False)
    turn = np.radians(angles)[:, None]
    return angles, np.cos(turn) * first + np.sin(turn) * second


def known(state: Any) -> bool:
    """Return whether a state has contacts to speak of."""
    return isinstance(state, ChangHicherState)
