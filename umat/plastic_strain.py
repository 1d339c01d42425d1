"""The plastic strain of a Chang–Hicher point along a recorded path, which its state does not hold.

Contact forces of the total form follow from stress, fabric and void ratio; the elastic displacement that goes with
their change is exact on a straight force path, δᵉ = C (Δf_n n + Δf_t/k_tR), C = √(f_ref p_ref)/k_n0 /(√f_n + √f_n,old),
and averaged as in the model at the mean fabric of the step, ε = sym(⟨δ n⟩ G⁻¹). What is left of the strain is plastic.
Second order in the distance of the records, in which the stress point may have taken several steps.
"""

import numpy as np

from .chang_hicher.material import ChangHicher, constants_of, contact_forces
from .directions import Directions
from .mandel import Array, from_tensor, to_tensor


def plastic_strain(
    material: ChangHicher, rule: Directions, stress: Array, strain: Array, fabric: Array, void_ratio: Array
) -> Array:
    """Return the plastic strain (m + 1, n, 6) [-] since the first of m + 1 records of n points.

    Parameters
    ----------
    material, rule
        The material, in the total form, and its contact directions (no quarter).
    stress, strain, fabric : (m + 1, n, 6) arrays
        Records of a path; `umat.path.History` has them.
    void_ratio : (m + 1, n) array
        Void ratio (e) [-].
    """
    if material.localisation != "total":
        raise ValueError("the plastic strain of a path is found from its records in the total form only")
    if rule.symmetry == "quarter":
        raise ValueError("the plastic strain of a path needs all directions of the half sphere")
    forces = np.array(
        [contact_forces(material, rule, *now) for now in zip(stress, fabric, void_ratio, strict=True)]
    )  # (m + 1, n, N, 3)
    elastic = np.zeros_like(strain)
    for k in range(1, len(stress)):
        mean = 0.5 * (fabric[k] + fabric[k - 1])
        elastic[k] = elastic[k - 1] + _elastic(material, rule, forces[k - 1], forces[k], mean)
    return np.asarray(strain - strain[0] - elastic)


def _elastic(material: ChangHicher, rule: Directions, old: Array, new: Array, fabric: Array) -> Array:
    """Return the elastic strain (n, 6) of a change of contact forces (n, N, 3) at a fabric (n, 6)."""
    compliance, ease_t, _ = constants_of(material).elastic
    n, f = rule.normals, to_tensor(fabric)
    before, after = (np.maximum(np.einsum("paj,aj->pa", force, n), 0.0) for force in (old, new))
    slack = compliance / np.maximum(np.sqrt(before) + np.sqrt(after), 1e-12)
    along = (after - before)[..., None] * n
    displacement = slack[..., None] * (along + ease_t * (new - old - along))
    share = rule.weights * (1.0 + np.einsum("ai,pij,aj->pa", n, f, n))
    average = np.einsum("pa,pai,aj->pij", share, displacement, n)
    return from_tensor(average @ np.linalg.inv(np.eye(3) / 3.0 + 2.0 / 15.0 * f))
